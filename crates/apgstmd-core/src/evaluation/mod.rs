//! How good detections are, against ground truth, over all thresholds.
//!
//! A detection is true when it lies within 5 px of the centre of a visible target, or inside its box grown by 2 px.
//! One detection for one target: within a frame the best score chooses first (equal scores in the order given), and
//! takes the nearest target that is still free. A detection that finds no free target but lies on one that is not
//! visible or is marked `ignore` counts for nothing; any other one is false. What a detection is depends only on
//! those that come before it, so the matching at a threshold is the beginning of the matching of all detections, and
//! one pass serves every threshold. Thresholds are global: one number for all frames.
//!
//! ```
//! use apgstmd_core::evaluation::{Options, Scored, TruthBox, evaluate};
//! let truth = [TruthBox::new(0, [10.0, 20.0, 4.0, 4.0]), TruthBox::new(1, [11.0, 20.0, 4.0, 4.0])];
//! let found = [Scored::new(0, 11.5, 21.5, 0.9), Scored::new(1, 60.0, 7.0, 0.4)];
//! let evaluation = evaluate(&found, &truth, &Options::new(0..2))?;
//! assert_eq!((evaluation.targets, evaluation.area), (2, 0.5));
//! # Ok::<(), apgstmd_core::evaluation::EvaluationError>(())
//! ```
//!
//! Tracks, which besides say which detections are the same target, are judged by [`evaluate_tracks`].

mod curve;
mod matching;
mod read;
mod table;
mod track;
mod tracks;

use std::ops::Range;

use serde::Serialize;
use thiserror::Error;

pub use curve::{Evaluation, FALSE_ALARM_LIMITS, OperatingPoint, Point};
pub use read::{detections_from_text, tracks_from_text, truth_from_text};
pub use table::ReadError;
pub(crate) use table::Table;
pub use tracks::{Clear, Hota, HotaPoint, Identity, TrackEvaluation, Tracked, evaluate_tracks};

/// A detection to be judged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Scored {
    /// Frame, counted from 0.
    pub frame: usize,
    /// Column, px, pixel centres at integers.
    pub x: f64,
    /// Row, px, downward.
    pub y: f64,
    /// The higher, the surer.
    pub score: f64,
    /// Direction of motion, radians counter-clockwise on the screen, where known.
    pub direction: Option<f64>,
}

impl Scored {
    /// Without direction.
    pub fn new(frame: usize, x: f64, y: f64, score: f64) -> Self {
        Self { frame, x, y, score, direction: None }
    }
}

/// A target in one frame. `x`, `y` is the upper left *edge* of its box: pixel i lies between edge i and edge i + 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TruthBox {
    /// Frame, counted from 0.
    pub frame: usize,
    /// Which target it is, where known: links the boxes of a track.
    pub id: Option<i64>,
    /// Left edge, px.
    pub x: f64,
    /// Upper edge, px.
    pub y: f64,
    /// Width, px.
    pub width: f64,
    /// Height, px.
    pub height: f64,
    /// Whether it can be seen; if not, finding it or missing it counts for nothing.
    pub visible: bool,
    /// Whether it is no target but something that may be taken for one without punishment.
    pub ignore: bool,
}

impl TruthBox {
    /// A visible target at [x, y, width, height], without id.
    pub fn new(frame: usize, [x, y, width, height]: [f64; 4]) -> Self {
        Self { frame, id: None, x, y, width, height, visible: true, ignore: false }
    }

    /// Centre as an array index, (x, y): comparable with a detection.
    pub fn center(&self) -> (f64, f64) {
        (self.x + self.width / 2.0 - 0.5, self.y + self.height / 2.0 - 0.5)
    }

    /// Whether finding it is rewarded and missing it punished.
    pub fn counts(&self) -> bool {
        self.visible && !self.ignore
    }
}

/// What is judged, and by which distances.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Frames that are judged; detections and truth outside are left out. Frames without truth count their false
    /// alarms, so give the frames the detector saw, not those the truth names.
    pub frames: Range<usize>,
    /// Farthest a true detection may lie from the centre of its target, px.
    pub radius: f64,
    /// How far beyond the edges of its target's box a true detection may lie, px.
    pub margin: f64,
}

impl Options {
    /// The distances of the field: 5 px from the centre or 2 px beyond the box.
    pub fn new(frames: Range<usize>) -> Self {
        Self { frames, radius: 5.0, margin: 2.0 }
    }

    /// From frame 0 to the last one that a detection or the truth names, for when nothing tells how many there were.
    pub fn spanning(detections: &[Scored], truth: &[TruthBox]) -> Self {
        let named = detections.iter().map(|d| d.frame).chain(truth.iter().map(|b| b.frame));
        Self::new(0..named.max().map_or(0, |last| last.saturating_add(1)))
    }
}

/// Farthest place and largest size that are judged, px: far beyond any picture.
const FAR: f64 = 1e12;

/// What cannot be evaluated.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum EvaluationError {
    /// No frames to judge.
    #[error("frames {first}..{end} hold no frame: give at least one")]
    NoFrames {
        /// First frame.
        first: usize,
        /// Frame after the last.
        end: usize,
    },
    /// A distance that is no distance.
    #[error("{name} is {value} px, but it must be a number from 0 to {FAR:e}")]
    Distance {
        /// Field of [`Options`].
        name: &'static str,
        /// The value given.
        value: f64,
    },
    /// A number that is not finite.
    #[error("{what} {index} (frame {frame}) has {name} = {value}, but it must be a finite number")]
    NotFinite {
        /// "detection" or "truth box".
        what: &'static str,
        /// Its place in the list, from 0.
        index: usize,
        /// Its frame.
        frame: usize,
        /// Field.
        name: &'static str,
        /// The value given.
        value: f64,
    },
    /// A place so far off that distances from it overflow.
    #[error("{what} {index} (frame {frame}) has {name} = {value}, but places and sizes must lie within {FAR:e} px")]
    TooFar {
        /// "detection" or "truth box".
        what: &'static str,
        /// Its place in the list, from 0.
        index: usize,
        /// Its frame.
        frame: usize,
        /// Field.
        name: &'static str,
        /// The value given.
        value: f64,
    },
    /// One name for two things in a frame.
    #[error("{what} {id} is twice in frame {frame}, but it can be in one place only")]
    Twice {
        /// "the track" or "the target".
        what: &'static str,
        /// Its number.
        id: i64,
        /// The frame.
        frame: usize,
    },
    /// Tracks need targets that can be told apart.
    #[error("frame {frame} of the truth holds several targets without id: tracks can be judged only against ids")]
    NoIds {
        /// The frame.
        frame: usize,
    },
}

/// Judges detections against truth.
///
/// # Errors
/// When there are no frames, or a number is not finite.
pub fn evaluate(detections: &[Scored], truth: &[TruthBox], options: &Options) -> Result<Evaluation, EvaluationError> {
    check(detections, truth, options)?;
    let outcomes = matching::outcomes(detections, truth, options);
    let targets = truth.iter().filter(|b| b.counts() && options.frames.contains(&b.frame)).count();
    Ok(Evaluation::new(options.frames.clone(), targets, outcomes))
}

fn check(detections: &[Scored], truth: &[TruthBox], options: &Options) -> Result<(), EvaluationError> {
    let Range { start: first, end } = options.frames;
    if first >= end {
        return Err(EvaluationError::NoFrames { first, end });
    }
    for (name, value) in [("radius", options.radius), ("margin", options.margin)] {
        if !(0.0..=FAR).contains(&value) {
            return Err(EvaluationError::Distance { name, value });
        }
    }
    let finite = |what, index, frame, fields: &[(&'static str, f64)]| match fields.iter().find(|f| !f.1.is_finite()) {
        Some((name, value)) => Err(EvaluationError::NotFinite { what, index, frame, name, value: *value }),
        None => Ok(()),
    };
    let near = |what, index, frame, fields: &[(&'static str, f64)]| match fields.iter().find(|f| f.1.abs() > FAR) {
        Some((name, value)) => Err(EvaluationError::TooFar { what, index, frame, name, value: *value }),
        None => Ok(()),
    };
    for (index, d) in detections.iter().enumerate() {
        let direction = ("direction", d.direction.unwrap_or(0.0));
        finite("detection", index, d.frame, &[("x", d.x), ("y", d.y), ("score", d.score), direction])?;
        near("detection", index, d.frame, &[("x", d.x), ("y", d.y)])?;
    }
    for (index, b) in truth.iter().enumerate() {
        let sides = [("x", b.x), ("y", b.y), ("width", b.width), ("height", b.height)];
        finite("truth box", index, b.frame, &sides)?;
        near("truth box", index, b.frame, &sides)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
