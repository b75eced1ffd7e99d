//! What reads from outside, as functions of bytes: for the suites and the fuzz targets of this project, which hold them
//! to what they promise. No part of the interface.

use std::path::{Path, PathBuf};
use std::sync::mpsc::channel;

use apgstmd_core::evaluation::Scored;

use crate::source::Picture;
pub use crate::source::boundary::{in_natural_order, picture, pipe_raw, pipe_y4m, printf_pattern};
use crate::source::ffmpeg::{Location, log};

/// The rows of detections.jsonl.
///
/// # Errors
/// As the program says it.
pub fn detections_json(text: &str) -> Result<Vec<Scored>, String> {
    let rows = crate::judge::detections_from_json(text, Path::new("detections.jsonl"));
    rows.map_err(|failure| failure.text().unwrap_or_default())
}

/// Times of the frames that ffmpeg announces on stderr, and how many errors it reports.
pub fn ffmpeg_log(told: &[u8]) -> (Vec<Option<f64>>, usize) {
    let (sender, stamps) = channel();
    let complaints = log::read(told, &sender, str::to_owned);
    (stamps.try_iter().map(|stamp| stamp.time).collect(), complaints.errors)
}

/// Whether INPUT is taken for a camera or an address, with how it is shown and what results are named after.
pub fn location(input: &Path) -> Option<(String, String)> {
    Location::of(input).map(|location| (location.shown(), location.name()))
}

/// What results of a video file are named after.
pub fn name_of_video(file: PathBuf) -> String {
    Location::File(file).name()
}

/// Pictures that came, and why there were no more, where that was no orderly end.
pub type Piped = (Vec<Picture>, Option<String>);
