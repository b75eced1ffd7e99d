//! What is written down of each clip, `clip.json`, and of all, `manifest.json`.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::Outcome;
use crate::failure::Failure;

/// Raised when a field changes its meaning or goes away.
pub const SCHEMA_VERSION: u32 = 1;

/// What became of a clip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// Its folder is whole.
    Done,
    /// It could not be read or computed to its end.
    Failed,
}

/// One clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// See [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Name of its folder.
    pub name: String,
    /// What became of it.
    pub status: Status,
    /// Why it failed.
    pub error: Option<String>,
    /// Its folder, seen from that of the batch.
    pub folder: String,
    /// What went in.
    pub input: InputRecord,
    /// Flags of `apgstmd run`, those of `batch` that stand for such included.
    pub flags: Vec<String>,
    /// SHA-256 of the files that flags name.
    pub flag_files: BTreeMap<String, String>,
    /// Version of the program.
    pub version: String,
    /// Threads that computed.
    pub threads: usize,
    /// From the first look at the input to the last checksum, start of the process included.
    pub wall_seconds: f64,
    /// Processor time of the process and of its ffmpeg; null where that is not known.
    pub processor_seconds: Option<f64>,
    /// Rows and columns of its frames.
    pub size: Option<Size>,
    /// Frames that were computed.
    pub frames: Option<u64>,
    /// Rows of detections.
    pub detections: Option<u64>,
    /// Tracks; null where none were asked for.
    pub tracks: Option<u64>,
    /// Every file of its folder but clip.json itself.
    pub files: BTreeMap<String, FileRecord>,
}

/// Size of frames, px.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Size {
    /// Rows.
    pub height: u64,
    /// Columns.
    pub width: u64,
}

/// What went in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InputRecord {
    /// Full path; what is no Unicode in it is replaced.
    pub path: String,
    /// Files that it is made of.
    pub files: usize,
    /// In all of them.
    pub bytes: u64,
    /// Seconds since 1970 of the latest; null where nothing could be read.
    pub modified: Option<f64>,
    /// Of the file, or of several files' sums and names as `sha256sum` prints them; null where they could not be read.
    pub sha256: Option<String>,
}

/// A file that came out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FileRecord {
    /// Its size.
    pub bytes: u64,
    /// Of its bytes.
    pub sha256: String,
}

/// All clips.
#[derive(Debug, Serialize)]
pub struct Manifest<'a> {
    /// See [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// This program.
    pub program: &'static str,
    /// Its version.
    pub version: &'static str,
    /// `batch`.
    pub command: &'static str,
    /// Clips whose folder is whole.
    pub done: usize,
    /// Clips that failed.
    pub failed: usize,
    /// Clips that were asked for last and have not been tried since, or were being computed when this was written.
    pub waiting: usize,
    /// The user ended it early.
    pub interrupted: bool,
    /// Each, in natural order of their names.
    pub clips: Vec<&'a Record>,
}

impl InputRecord {
    /// Of which nothing else is known.
    pub fn named(path: &Path) -> Self {
        Self { path: path.to_string_lossy().into_owned(), files: 0, bytes: 0, modified: None, sha256: None }
    }
}

impl Record {
    /// The record in a clip's folder, where it is one of this program and of this schema.
    pub(super) fn read(folder: &Path) -> Option<Self> {
        let record: Self = serde_json::from_str(&fs::read_to_string(folder.join(super::CLIP)).ok()?).ok()?;
        (record.schema_version == SCHEMA_VERSION).then_some(record)
    }

    /// From [`Record::text`].
    ///
    /// # Errors
    /// It is none.
    pub fn parse(text: &str) -> Outcome<Self> {
        serde_json::from_str(text)
            .map_err(|error| Failure::failed(format_args!("this is no record of a clip: {error}")))
    }

    /// As JSON.
    pub fn text(&self) -> String {
        serde_json::to_string(self).expect("text and numbers are JSON")
    }

    /// Whether it is done.
    pub fn is_done(&self) -> bool {
        self.status == Status::Done
    }

    /// Frames a second of all the time it took.
    pub fn rate(&self) -> Option<f64> {
        Some(self.frames? as f64 / self.wall_seconds.max(1e-9))
    }
}
