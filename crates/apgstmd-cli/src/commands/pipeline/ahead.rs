//! Reading ahead: threads that decode pictures while others are computed, into bounded queues, in order; or, live, into
//! a place for the newest.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::{Builder, Scope};
use std::time::{Duration, Instant};

use super::latest::Latest;
use crate::Outcome;
use crate::failure::{Failure, reason};
use crate::interrupt;
use crate::source::{Arrival, FrameSource, Switch};

/// Memory that the pictures of a queue may take, bytes. Large ones are few, small ones many.
const BUDGET: usize = 64 << 20;
/// Pictures in a queue, however small.
const MOST: usize = 64;
/// How often a wait looks whether the user asked for the end.
const LOOK: Duration = Duration::from_millis(50);

/// A picture that has been read, or why it could not be, and how long that took.
pub(super) struct Read {
    pub arrival: Arrival,
    pub spent: Duration,
    /// When it was there.
    pub came: Instant,
}

/// How many things of `bytes` may wait, or be computed together: at least one.
pub(super) fn room(bytes: usize) -> usize {
    (BUDGET / bytes.max(1)).clamp(1, MOST)
}

/// The frames of several sources, one from each in turn, each source read by a thread of its own.
pub(super) struct ReadAhead {
    /// Read before there were threads: its size says how many more may wait.
    first: Option<Read>,
    queues: Vec<Receiver<Read>>,
    turn: usize,
    live: Option<Arc<Latest>>,
    /// Of sources that may be waiting when nobody wants more.
    switches: Vec<Switch>,
}

impl ReadAhead {
    /// Reads the first frame, then starts a thread for each source.
    ///
    /// # Errors
    /// The system has no more threads.
    pub fn start<'scope, 'env: 'scope>(
        scope: &'scope Scope<'scope, 'env>,
        mut sources: Vec<Box<dyn FrameSource + 'env>>,
    ) -> Outcome<Self> {
        let switches = sources.iter().filter_map(|source| source.switch()).collect();
        let first = sources.first_mut().and_then(|source| read(&mut **source));
        let bytes = first.as_ref().and_then(|read| read.arrival.picture.as_ref().ok()).map_or(0, |p| p.bytes());
        let room = room(bytes).div_ceil(sources.len().max(1));
        let mut queues = Vec::new();
        for source in sources {
            let (sender, queue) = sync_channel(room);
            spawn(scope, move || fill(source, &sender))?;
            queues.push(queue);
        }
        let turn = usize::from(first.is_some()) % queues.len().max(1);
        Ok(Self { first, queues, turn, live: None, switches })
    }

    /// The same, but only the newest frame is kept.
    ///
    /// # Errors
    /// The system has no more threads.
    pub fn start_live<'scope, 'env: 'scope>(
        scope: &'scope Scope<'scope, 'env>,
        sources: Vec<Box<dyn FrameSource + 'env>>,
    ) -> Outcome<Self> {
        let latest = Arc::new(Latest::default());
        let switches = sources.iter().filter_map(|source| source.switch()).collect();
        for mut source in sources {
            let latest = Arc::clone(&latest);
            spawn(scope, move || {
                while read(&mut *source).is_some_and(|read| latest.put(read)) {}
                latest.end();
            })?;
        }
        Ok(Self { first: None, queues: Vec::new(), turn: 0, live: Some(latest), switches })
    }

    /// Frames that nobody took.
    pub fn dropped(&self) -> Option<usize> {
        self.live.as_ref().map(|latest| latest.dropped())
    }

    /// The next frame, waited for; none at the end, and when the user asks for it.
    pub fn next(&mut self) -> Option<Read> {
        if self.first.is_some() {
            return self.first.take();
        }
        if let Some(latest) = &self.live {
            return latest.take();
        }
        // The source whose turn it is ends first: with it all have ended.
        let queue = self.queues.get(self.turn)?;
        let read = loop {
            match queue.recv_timeout(LOOK) {
                Ok(read) => break read,
                Err(RecvTimeoutError::Timeout) if !interrupt::asked() => {}
                Err(_) => return None,
            }
        };
        self.turn = (self.turn + 1) % self.queues.len();
        Some(read)
    }

    /// The next frame if it is there already.
    pub fn next_at_hand(&mut self) -> Option<Read> {
        if self.first.is_some() {
            return self.first.take();
        }
        let read = self.queues.get(self.turn)?.try_recv().ok()?;
        self.turn = (self.turn + 1) % self.queues.len();
        Some(read)
    }
}

impl Drop for ReadAhead {
    fn drop(&mut self) {
        self.switches.iter().for_each(Switch::turn_off);
        if let Some(latest) = &self.live {
            latest.close();
        }
    }
}

fn spawn<'scope>(scope: &'scope Scope<'scope, '_>, work: impl FnOnce() + Send + 'scope) -> Outcome {
    let started = Builder::new().name("apgstmd-read".to_owned()).spawn_scoped(scope, work);
    started.map(drop).map_err(|error| Failure::failed(format_args!("cannot start a thread: {}", reason(&error))))
}

/// Ends with the source, or when nobody wants more.
fn fill(mut source: Box<dyn FrameSource + '_>, sender: &SyncSender<Read>) {
    while let Some(read) = read(&mut *source) {
        if sender.send(read).is_err() {
            return;
        }
    }
}

fn read(source: &mut dyn FrameSource) -> Option<Read> {
    let begin = Instant::now();
    let arrival = source.next_frame()?;
    Some(Read { arrival, spent: begin.elapsed(), came: Instant::now() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers from `next` on in steps; each takes another time to come.
    struct Numbers {
        next: usize,
        step: usize,
        end: usize,
    }

    impl FrameSource for Numbers {
        fn expected(&self) -> Option<usize> {
            None
        }

        fn next_frame(&mut self) -> Option<Arrival> {
            let frame = self.next;
            self.next += self.step;
            std::thread::sleep(Duration::from_micros((frame as u64 * 7919) % 300));
            let picture = Err(String::new());
            let arrival = Arrival { frame, name: String::new(), origin: String::new(), time: None, picture };
            (frame < self.end).then_some(arrival)
        }
    }

    fn sources(parts: usize, end: usize) -> Vec<Box<dyn FrameSource>> {
        (0..parts.min(end)).map(|next| Box::new(Numbers { next, step: parts, end }) as Box<dyn FrameSource>).collect()
    }

    #[test]
    fn frames_come_in_order_from_any_number_of_threads() {
        for parts in [1, 2, 3, 7] {
            for end in [0, 1, 2, 3, 100] {
                std::thread::scope(|scope| {
                    let mut ahead = ReadAhead::start(scope, sources(parts, end)).unwrap();
                    let mut frames = Vec::new();
                    while let Some(read) = ahead.next() {
                        frames.push(read.arrival.frame);
                        while let Some(read) = ahead.next_at_hand() {
                            frames.push(read.arrival.frame);
                        }
                    }
                    assert_eq!(frames, (0..end).collect::<Vec<_>>(), "{parts} of {end}");
                });
            }
        }
    }

    #[test]
    fn threads_end_when_nobody_wants_more() {
        std::thread::scope(|scope| {
            let mut ahead = ReadAhead::start(scope, sources(3, usize::MAX)).unwrap();
            assert_eq!(ahead.next().map(|read| read.arrival.frame), Some(0));
        });
    }

    #[test]
    fn queues_are_bounded_in_memory() {
        assert_eq!((room(1), room(0), room(16 << 20), room(1 << 30)), (MOST, MOST, 4, 1));
    }
}
