//! What has been found where. Clutter is found again and again in its place, under ever new numbers: branches, waves, what
//! flickers. A target passes. So a detection counts less where others have been found: as a clutter map does in radar, and
//! habituation in neurons.
//!
//! The clutter at a place is the mean over the last frames of the scores found there, each times a Gaussian of its distance, those
//! of the same number left out. Places are carried along with the background.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::detection::Detection;
use crate::memory::heap;
use crate::stage::background::Finding;
use crate::state::{Remember, StateError, Visit};

/// Frames that are remembered.
const FRAMES: u64 = 300;
/// Frames over which is averaged at least.
const LEAST_FRAMES: u64 = 30;
/// Detections that are remembered of a frame, at most.
const MOST: usize = 20;
/// Standard deviation of the Gaussian, px.
const WIDTH: f64 = 5.0;
/// A detection of score s amid clutter c keeps s / (s + WEIGHT c) of it.
const WEIGHT: f32 = 20.0;

/// A detection that was.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Event {
    /// Where what was there is now.
    place: (f64, f64),
    score: f32,
    /// Its number in the bank.
    trace: u64,
    frame: u64,
}

heap!(Event);

pub(super) struct Clutter {
    most: usize,
    /// Frames since the start or the last cut.
    frames: u64,
    /// The oldest first.
    events: VecDeque<Event>,
}

heap!(Clutter { events });

impl Remember for Clutter {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        visit.part("frames", &mut self.frames)?;
        let most = self.most * FRAMES as usize;
        let finite = |event: &Event| event.place.0.is_finite() && event.place.1.is_finite() && event.score.is_finite();
        let sound = |events: &VecDeque<Event>| events.len() <= most && events.iter().all(finite);
        if let Some(loaded) = visit.record("events", || self.events.clone(), sound)? {
            self.events.clear();
            self.events.extend(loaded);
        }
        Ok(())
    }
}

impl Clutter {
    /// For at most `most` detections a frame.
    pub fn new(most: usize) -> Self {
        let most = most.min(MOST);
        Self { most, frames: 0, events: VecDeque::with_capacity(most * FRAMES as usize) }
    }

    pub fn reset(&mut self) {
        self.frames = 0;
        self.events.clear();
    }

    /// Begins a frame before which the background moved so, in pixels of the full picture.
    pub fn begin(&mut self, background: &Finding) {
        if background.cut {
            self.reset();
        }
        self.frames += 1;
        while self.events.front().is_some_and(|event| event.frame + FRAMES <= self.frames) {
            self.events.pop_front();
        }
        self.events.iter_mut().for_each(|event| event.place = background.motion.carry(event.place));
    }

    /// What is left of the score of a detection, which is above 0, given what was found here before this frame.
    pub fn left(&self, found: &Detection) -> f32 {
        let (x, y) = (f64::from(found.x), f64::from(found.y));
        let mut sum = 0.0;
        for event in &self.events {
            let (dx, dy) = (event.place.0 - x, event.place.1 - y);
            let distance = dx * dx + dy * dy;
            if distance < 9.0 * WIDTH * WIDTH && event.trace != found.trace && event.frame != self.frames {
                sum += event.score * (-distance / (2.0 * WIDTH * WIDTH)).exp() as f32;
            }
        }
        let clutter = sum / self.frames.clamp(LEAST_FRAMES, FRAMES) as f32;
        found.score * (found.score / (found.score + WEIGHT * clutter))
    }

    /// Remembers what was found in this frame, best first, with the scores that it had by itself.
    pub fn remember(&mut self, found: &[Detection]) {
        let event = |found: &Detection| Event {
            place: (f64::from(found.x), f64::from(found.y)),
            score: found.score,
            trace: found.trace,
            frame: self.frames,
        };
        self.events.extend(found.iter().take(self.most).map(event));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Size;
    use crate::stage::background::Motion;

    fn at(x: f32, score: f32, trace: u64) -> Detection {
        Detection { x, y: 40.0, score, trace, ..Detection::default() }
    }

    fn still() -> Finding {
        Finding::nothing(Size::new(80, 120))
    }

    /// After `frames` frames with something of score 0.1 at 60 px, under a new number in each.
    fn flicker(frames: u64) -> Clutter {
        let mut clutter = Clutter::new(20);
        for frame in 0..frames {
            clutter.begin(&still());
            clutter.remember(&[at(60.0, 0.1, frame)]);
        }
        clutter
    }

    #[test]
    fn what_comes_again_counts_less_and_what_passes_does_not() {
        let mut clutter = flicker(100);
        clutter.begin(&still());
        let left = |x, trace| clutter.left(&at(x, 0.1, trace));
        // c = 0.1 x 100 / 101 where it is, e^(-1/2) of that 5 px off, nothing from 15 px on.
        assert!((left(60.0, 200) - 0.1 / (1.0 + 20.0 * 100.0 / 101.0)).abs() < 1e-6);
        assert!((left(65.0, 200) - 0.1 / (1.0 + 20.0 * 100.0 / 101.0 * (-0.5f32).exp())).abs() < 1e-6);
        assert_eq!(left(75.1, 200), 0.1);
        // What is much stronger stays.
        assert!(clutter.left(&at(60.0, 10.0, 200)) > 8.0);
        // What is found in the same frame is none.
        clutter.remember(&[at(90.0, 0.1, 300)]);
        assert_eq!(clutter.left(&at(90.0, 0.1, 200)), 0.1);
    }

    #[test]
    fn nothing_is_clutter_to_itself() {
        let mut clutter = Clutter::new(20);
        for _ in 0..50 {
            clutter.begin(&still());
            assert_eq!(clutter.left(&at(60.0, 0.1, 7)), 0.1);
            clutter.remember(&[at(60.0, 0.1, 7)]);
        }
    }

    #[test]
    fn goes_with_the_background_and_ends_with_it() {
        let pan = Finding { motion: Motion { shift: (2.5, 0.0), ..still().motion }, ..still() };
        let mut clutter = flicker(40);
        let before = {
            clutter.begin(&pan);
            clutter.left(&at(62.5, 0.1, 100))
        };
        assert!(before < 0.01, "{before}");
        clutter.begin(&Finding { cut: true, ..still() });
        assert_eq!(clutter.left(&at(62.5, 0.1, 100)), 0.1);
    }

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn forgets() {
        let mut clutter = flicker(10);
        for _ in 0..FRAMES - 10 {
            clutter.begin(&still());
        }
        assert_eq!(clutter.events.len(), 10);
        clutter.begin(&still());
        assert_eq!(clutter.events.len(), 9);
        let most = clutter.events.capacity();
        for frame in 0..2 * FRAMES {
            clutter.begin(&still());
            clutter.remember(&(0..40).map(|i| at(i as f32, 0.1, 40 * frame + i)).collect::<Vec<_>>());
        }
        assert_eq!((clutter.events.len(), clutter.events.capacity()), (20 * FRAMES as usize, most));
    }
}
