//! Detections from a results folder, a table or MOTChallenge text, with what run.json beside them tells.

use std::path::{Path, PathBuf};

use apgstmd_core::evaluation::{Scored, Tracked, detections_from_text, tracks_from_text};
use serde::Deserialize;

use super::{RunFrames, read_text, unreadable};
use crate::Outcome;
use crate::failure::Failure;
use crate::sink::results::{CSV, JSONL, RUN, TRACKS};

const ORDER: &str = "DETECTIONS comes first: a table with frame,x,y,score, or MOTChallenge text; then TRUTH";

/// Detections and where they came from.
#[derive(Clone, Debug)]
pub struct Found {
    /// The file they were read from.
    pub file: PathBuf,
    /// The detections.
    pub detections: Vec<Scored>,
    /// The tracks, where they are told of.
    pub tracks: Option<Vec<Tracked>>,
    /// Which frames were processed, where run.json of this program says so.
    pub run: Option<RunFrames>,
}

/// Reads detections, and the tracks beside them in a results folder or in the same file.
///
/// # Errors
/// Names the file, the line, what stands there and what was expected.
pub fn read_detections(path: &Path) -> Outcome<Found> {
    let file = if path.is_dir() { table_of(path)? } else { path.to_owned() };
    let text = read_text(&file)?;
    let mut tracks = None;
    let detections = if file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("jsonl")) {
        detections_from_json(&text, &file)?
    } else {
        tracks = tracks_from_text(&text).map_err(|error| unreadable(&file, &error, ORDER))?;
        detections_from_text(&text).map_err(|error| unreadable(&file, &error, ORDER))?
    };
    let beside = path.join(TRACKS);
    if path.is_dir() && beside.is_file() {
        tracks = tracks_from_text(&read_text(&beside)?).map_err(|error| unreadable(&beside, &error, ORDER))?;
    }
    let run = RunFrames::beside(&file)?;
    Ok(Found { file, detections, tracks, run })
}

fn table_of(folder: &Path) -> Outcome<PathBuf> {
    let file = [CSV, JSONL].map(|name| folder.join(name)).into_iter().find(|file| file.is_file());
    file.ok_or_else(|| {
        let finished = if folder.join(RUN).is_file() { "" } else { " nor run.json" };
        Failure::failed(format_args!("there is no {CSV} or {JSONL}{finished} in {}", folder.display()))
            .hint("DETECTIONS is a results folder of `apgstmd run`, or a file")
    })
}

/// A row of detections.jsonl. NaN, which JSON has not, is null.
#[derive(Deserialize)]
struct Row {
    frame: usize,
    x: f64,
    y: f64,
    score: f64,
    direction_rad: Option<f64>,
}

/// Reads detections.jsonl.
pub(crate) fn detections_from_json(text: &str, file: &Path) -> Outcome<Vec<Scored>> {
    text.lines().enumerate().map(|(i, line)| from_json(line, i + 1, file)).collect()
}

fn from_json(line: &str, number: usize, file: &Path) -> Outcome<Scored> {
    let Row { frame, x, y, score, direction_rad } = serde_json::from_str(line).map_err(|error| {
        let error = error.to_string();
        let what = error.split(" at line ").next().unwrap_or_default();
        Failure::failed(format_args!(
            "{}: line {number}: found {what}, but expected an object with frame, x, y, score",
            file.display()
        ))
    })?;
    Ok(Scored { frame, x, y, score, direction: direction_rad })
}
