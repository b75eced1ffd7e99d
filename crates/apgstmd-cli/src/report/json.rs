//! Everything as JSON.

use apgstmd_core::evaluation::{Evaluation, TrackEvaluation};
use serde::Serialize;

use super::Report;
use crate::judge::Origin;

/// Raised when a field changes its meaning or goes away.
const SCHEMA_VERSION: u32 = 1;

#[derive(Serialize)]
struct Json<'a> {
    schema_version: u32,
    program: &'static str,
    version: &'static str,
    command: &'static str,
    detections: String,
    truth: String,
    /// `run.json`, `given` or `named`.
    frames_from: &'static str,
    last_frame: usize,
    radius: f64,
    margin: f64,
    detections_outside: usize,
    truth_outside: usize,
    notes: Vec<String>,
    /// Null where there are none or they cannot be judged.
    tracks: Option<&'a TrackEvaluation>,
    #[serde(flatten)]
    evaluation: &'a Evaluation,
}

/// One object with all that is known.
pub fn json(report: &Report) -> String {
    let record = Json {
        schema_version: SCHEMA_VERSION,
        program: "apgstmd",
        version: env!("CARGO_PKG_VERSION"),
        command: "eval",
        detections: report.detections.display().to_string(),
        truth: report.truth.display().to_string(),
        frames_from: match report.origin {
            Origin::Run(_) => "run.json",
            Origin::Given => "given",
            Origin::Named => "named",
        },
        last_frame: *report.frames.end(),
        radius: report.radius,
        margin: report.margin,
        detections_outside: report.judgement.detections_outside,
        truth_outside: report.judgement.truth_outside,
        notes: report.notes(),
        tracks: report.tracks(),
        evaluation: &report.judgement.evaluation,
    };
    serde_json::to_string_pretty(&record).expect("numbers, names and lists") + "\n"
}
