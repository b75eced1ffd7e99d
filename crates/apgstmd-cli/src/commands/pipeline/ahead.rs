//! Reading ahead: threads that decode pictures while others are computed, into bounded queues, in order.

use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{Builder, Scope};
use std::time::{Duration, Instant};

use crate::Outcome;
use crate::failure::{Failure, reason};
use crate::source::{Arrival, FrameSource};

/// Memory that the pictures of a queue may take, bytes. Large ones are few, small ones many.
const BUDGET: usize = 64 << 20;
/// Pictures in a queue, however small.
const MOST: usize = 64;

/// A picture that has been read, or why it could not be, and how long that took.
pub(super) struct Read {
    pub arrival: Arrival,
    pub spent: Duration,
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
        let first = sources.first_mut().and_then(|source| read(&mut **source));
        let bytes = first.as_ref().and_then(|read| read.arrival.picture.as_ref().ok()).map_or(0, |p| p.bytes());
        let room = room(bytes).div_ceil(sources.len().max(1));
        let mut queues = Vec::new();
        for source in sources {
            let (sender, queue) = sync_channel(room);
            Builder::new()
                .name("apgstmd-read".to_owned())
                .spawn_scoped(scope, move || fill(source, &sender))
                .map_err(|error| Failure::failed(format_args!("cannot start a thread: {}", reason(&error))))?;
            queues.push(queue);
        }
        let turn = usize::from(first.is_some()) % queues.len().max(1);
        Ok(Self { first, queues, turn })
    }

    /// The next frame, waited for; none at the end.
    pub fn next(&mut self) -> Option<Read> {
        if self.first.is_some() {
            return self.first.take();
        }
        // The source whose turn it is ends first: with it all have ended.
        let read = self.queues.get(self.turn)?.recv().ok()?;
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
    Some(Read { arrival, spent: begin.elapsed() })
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
            let arrival = Arrival { frame, name: String::new(), origin: String::new(), picture: Err(String::new()) };
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
