//! Frames that come one after the other and cannot be asked for by number: counted, timed, named and picked here.

use std::io::{self, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use super::span::{Pick, Picker};
use super::{Arrival, FrameSource, Picture, Span, Switch};
use crate::failure::reason;

/// A picture, none at the end, or why there is no more.
pub(super) type Parsed = Result<Option<Picture>, String>;

/// A picture with the time its stream tells.
pub type Timed = (Picture, Option<f64>);

/// Where the pictures of a stream come from.
pub trait Frames: Send {
    /// The next one; none at the end. After an error there are no more.
    ///
    /// # Errors
    /// Why there is none, in words.
    fn next(&mut self) -> Result<Option<Timed>, String>;
    /// Ends a wait for the next one.
    fn switch(&self) -> Switch;
}

impl Frames for Box<dyn Frames> {
    fn next(&mut self) -> Result<Option<Timed>, String> {
        (**self).next()
    }

    fn switch(&self) -> Switch {
        (**self).switch()
    }
}

/// What is known of a stream without reading it.
#[derive(Clone, Debug)]
pub(super) struct About {
    /// What its frames are named after.
    pub name: String,
    /// How messages name it.
    pub shown: String,
    /// Frames a second that count in place of its own times.
    pub fps: Option<f64>,
    /// How many of its frames will be used, about.
    pub expected: Option<usize>,
    /// How many have come, used or not.
    pub came: Arc<AtomicUsize>,
}

pub(super) struct Stream<F> {
    frames: F,
    about: About,
    span: Span,
    picker: Picker,
    /// Frames up to this one are left out.
    done: Option<usize>,
    next: usize,
    ended: bool,
}

impl<F: Frames> Stream<F> {
    pub fn new(frames: F, about: About, (span, done): (Span, Option<usize>)) -> Self {
        about.came.store(0, Ordering::Relaxed);
        Self { frames, about, span, picker: Picker::new(span), done, next: 0, ended: false }
    }

    fn timed(&mut self, frame: usize) -> Result<Option<Timed>, String> {
        let Some((picture, told)) = self.frames.next()? else { return Ok(None) };
        let time = self.about.fps.map(|fps| frame as f64 / fps).or(told);
        if time.is_none() && self.span.in_seconds() {
            return Err(
                "it tells no time, but --start, --stop or --step is in seconds: say --fps, or count frames".to_owned()
            );
        }
        Ok(Some((picture, time)))
    }
}

impl<F: Frames> FrameSource for Stream<F> {
    fn expected(&self) -> Option<usize> {
        self.about.expected
    }

    fn next_frame(&mut self) -> Option<Arrival> {
        while !self.ended {
            let frame = self.next;
            match self.timed(frame) {
                Ok(None) => self.ended = true,
                Err(reason) => {
                    self.ended = true;
                    return Some(self.arrival(frame, None, Err(reason)));
                }
                Ok(Some((picture, time))) => {
                    self.next += 1;
                    self.about.came.store(self.next, Ordering::Relaxed);
                    match self.picker.pick(frame, time) {
                        Pick::Pass => {}
                        Pick::Use if Some(frame) <= self.done => {}
                        Pick::Use => return Some(self.arrival(frame, time, Ok(picture))),
                        Pick::End => self.ended = true,
                    }
                }
            }
        }
        None
    }

    fn switch(&self) -> Option<Switch> {
        Some(self.frames.switch())
    }
}

impl<F> Stream<F> {
    fn arrival(&self, frame: usize, time: Option<f64>, picture: Result<Picture, String>) -> Arrival {
        Arrival {
            frame,
            name: format!("{}_{frame:06}", self.about.name),
            origin: format!("frame {frame} of {}", self.about.shown),
            time,
            picture,
        }
    }
}

/// What a wait came to.
pub(super) enum Waited<T> {
    Came(T),
    /// The other side is done.
    Ended,
    /// Nobody wants it any more.
    Off,
    /// It took longer than it may.
    TooLong,
}

/// Waits for the other side, looking at the switch meanwhile.
pub(super) fn wait<T>(queue: &Receiver<T>, switch: &Switch, limit: Option<Duration>) -> Waited<T> {
    const LOOK: Duration = Duration::from_millis(50);
    let begin = Instant::now();
    loop {
        if switch.is_off() {
            return Waited::Off;
        }
        match queue.recv_timeout(LOOK) {
            Ok(thing) => return Waited::Came(thing),
            Err(RecvTimeoutError::Disconnected) => return Waited::Ended,
            Err(RecvTimeoutError::Timeout) if limit.is_some_and(|limit| begin.elapsed() > limit) => {
                return Waited::TooLong;
            }
            Err(RecvTimeoutError::Timeout) => {}
        }
    }
}

/// As many bytes as a frame has; none at the end.
pub(super) fn read_frame(input: &mut impl Read, bytes: usize) -> Result<Option<Vec<u8>>, String> {
    let mut frame = Vec::new();
    frame.try_reserve_exact(bytes).map_err(|_| format!("there is no memory for a frame of {bytes} bytes"))?;
    input.take(bytes as u64).read_to_end(&mut frame).map_err(|error: io::Error| reason(&error))?;
    match frame.len() {
        0 => Ok(None),
        read if read == bytes => Ok(Some(frame)),
        read => Err(format!("it ends in the middle of a frame: {read} of {bytes} bytes came")),
    }
}
