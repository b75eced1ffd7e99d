//! Detections against truth: which files hold them, which frames are judged. The judging itself is the core's.

mod detections;
mod frames;
mod truth;

use std::fs;
use std::path::Path;

use apgstmd_core::evaluation::{Evaluation, EvaluationError, Options, ReadError, Scored, TruthBox, evaluate};

use crate::Outcome;
use crate::failure::{Failure, reason};

pub use detections::{Found, read_detections};
pub use frames::{Frames, Origin, RunFrames};
pub use truth::read_truth;

/// What the judging found.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// Curves and numbers.
    pub evaluation: Evaluation,
    /// Detections in frames that are not judged.
    pub detections_outside: usize,
    /// Boxes of the truth in frames that are not judged.
    pub truth_outside: usize,
}

/// Judges the detections in `frames`. Frames that were not processed are taken out of the count and closed up: what
/// the model never saw is no miss.
///
/// # Errors
/// When there are no frames, or a number is not finite.
pub fn judge(
    found: &[Scored],
    truth: &[TruthBox],
    frames: &Frames,
    radius: f64,
    margin: f64,
) -> Result<Judgement, EvaluationError> {
    let options = |range| Options { frames: range, radius, margin };
    let outside = |frame: usize| usize::from(frames.rank(frame).is_none());
    let mut evaluation = if frames.has_gaps() {
        let found: Vec<Scored> =
            found.iter().filter_map(|d| Some(Scored { frame: frames.rank(d.frame)?, ..*d })).collect();
        let truth: Vec<TruthBox> =
            truth.iter().filter_map(|b| Some(TruthBox { frame: frames.rank(b.frame)?, ..*b })).collect();
        evaluate(&found, &truth, &options(0..frames.count()))?
    } else {
        evaluate(found, truth, &options(frames.first()..frames.first() + frames.count()))?
    };
    evaluation.first_frame = frames.first();
    Ok(Judgement {
        evaluation,
        detections_outside: found.iter().map(|d| outside(d.frame)).sum(),
        truth_outside: truth.iter().map(|b| outside(b.frame)).sum(),
    })
}

fn read_text(path: &Path) -> Outcome<String> {
    let bytes = fs::read(path)
        .map_err(|error| Failure::failed(format_args!("cannot read {}: {}", path.display(), reason(&error))))?;
    String::from_utf8(bytes).map_err(|error| {
        let line = 1 + error.as_bytes()[..error.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count();
        Failure::failed(format_args!(
            "{}: line {line}: found bytes that are no text, but expected UTF-8",
            path.display()
        ))
    })
}

/// Names the file. What is wrong with the first line is often the wrong file.
fn unreadable(path: &Path, error: &ReadError, order: &str) -> Failure {
    let failure = Failure::failed(format_args!("{}: {error}", path.display()));
    if error.line == 1 { failure.hint(order) } else { failure }
}

#[cfg(test)]
mod tests;
