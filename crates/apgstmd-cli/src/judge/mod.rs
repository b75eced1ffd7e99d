//! Detections against truth: which files hold them, which frames are judged. The judging itself is the core's.

mod detections;
mod frames;
mod truth;

use std::fs;
use std::path::Path;

use apgstmd_core::evaluation::{
    Evaluation, EvaluationError, Options, ReadError, Scored, TrackEvaluation, Tracked, TruthBox, evaluate,
    evaluate_tracks,
};

use crate::Outcome;
use crate::failure::{Failure, reason};

pub(crate) use detections::detections_from_json;
pub use detections::{Found, read_detections};
pub use frames::{Frames, Origin, RunFrames};
pub use truth::read_truth;

/// What the judging found.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// Curves and numbers.
    pub evaluation: Evaluation,
    /// Of the tracks, where there are any, or why they cannot be judged.
    pub tracks: Option<Result<TrackEvaluation, EvaluationError>>,
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
    tracks: Option<&[Tracked]>,
    truth: &[TruthBox],
    frames: &Frames,
    radius: f64,
    margin: f64,
) -> Result<Judgement, EvaluationError> {
    let options = |range| Options { frames: range, radius, margin };
    let outside = |frame: usize| usize::from(frames.rank(frame).is_none());
    let (mut evaluation, tracks) = if frames.has_gaps() {
        let rank = |frame: usize| frames.rank(frame);
        let closed: Vec<Scored> = found.iter().filter_map(|d| Some(Scored { frame: rank(d.frame)?, ..*d })).collect();
        let boxes: Vec<TruthBox> =
            truth.iter().filter_map(|b| Some(TruthBox { frame: rank(b.frame)?, ..*b })).collect();
        let close = |tracks: &[Tracked]| -> Vec<Tracked> {
            tracks.iter().filter_map(|p| Some(Tracked { frame: rank(p.frame)?, ..*p })).collect()
        };
        let options = options(0..frames.count());
        (evaluate(&closed, &boxes, &options)?, tracks.map(|tracks| evaluate_tracks(&close(tracks), &boxes, &options)))
    } else {
        let options = options(frames.first()..frames.first() + frames.count());
        (evaluate(found, truth, &options)?, tracks.map(|tracks| evaluate_tracks(tracks, truth, &options)))
    };
    evaluation.first_frame = frames.first();
    Ok(Judgement {
        evaluation,
        tracks,
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
