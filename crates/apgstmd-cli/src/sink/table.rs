//! Detections as CSV or JSON Lines, one row a detection, the strongest of a frame first. Flushed after each frame: what
//! an interrupted run leaves is complete up to there.

use std::borrow::Cow;
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{Seen, Sink};
use crate::Outcome;
use crate::failure::Failure;

/// Columns of the tables.
pub const COLUMNS: [&str; 11] =
    ["frame", "name", "time_s", "x", "y", "score", "direction_rad", "trace", "speed", "size", "contrast"];

#[derive(Serialize)]
struct Row<'a> {
    frame: usize,
    name: &'a str,
    /// Empty in CSV, null in JSON where it is not known.
    time_s: Option<f64>,
    x: f32,
    y: f32,
    score: f32,
    /// Empty in CSV, null in JSON where there is none.
    direction_rad: Option<f32>,
    trace: u64,
    speed: f32,
    size: f32,
    /// Empty in CSV, null in JSON where it was no bank.
    contrast: Option<f32>,
}

fn rows<'a>(seen: &'a Seen) -> impl Iterator<Item = Row<'a>> {
    seen.detections.iter().map(|detection| Row {
        frame: seen.frame,
        name: &seen.name,
        time_s: seen.time.map(microseconds),
        x: detection.x,
        y: detection.y,
        score: detection.score,
        direction_rad: Some(detection.direction).filter(|direction| !direction.is_nan()),
        trace: detection.trace,
        speed: detection.speed,
        size: detection.size,
        contrast: Some(detection.contrast).filter(|contrast| *contrast > 0.0),
    })
}

/// The same time told in other units, 1/30 s or ms, is to be the same number.
pub(super) fn microseconds(time: f64) -> f64 {
    (time * 1e6).round() / 1e6
}

/// An open file or stdout, with its name for messages.
pub struct Target {
    path: PathBuf,
    out: BufWriter<Box<dyn Write>>,
}

impl Target {
    /// Creates a file.
    ///
    /// # Errors
    /// It cannot be created.
    pub fn file(path: &Path) -> Outcome<Self> {
        let file = File::create(path).map_err(|error| Failure::write(path, error))?;
        Ok(Self { path: path.to_owned(), out: BufWriter::new(Box::new(file)) })
    }

    /// A file that an earlier run left, cut back to its first `length` bytes.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn resume(path: &Path, length: u64) -> Outcome<Self> {
        let file = cut_back(path, length)?;
        Ok(Self { path: path.to_owned(), out: BufWriter::new(Box::new(file)) })
    }

    /// Standard output.
    pub fn stdout() -> Self {
        Self { path: PathBuf::from("stdout"), out: BufWriter::new(Box::new(io::stdout())) }
    }
}

/// Opens a file to go on behind its first `length` bytes; what comes after them is lost.
pub(super) fn cut_back(path: &Path, length: u64) -> Outcome<File> {
    let cut = || -> io::Result<File> {
        let mut file = OpenOptions::new().write(true).open(path)?;
        file.set_len(length)?;
        file.seek(SeekFrom::End(0))?;
        Ok(file)
    };
    cut().map_err(|error| Failure::write(path, error))
}

/// Comma-separated values with a header.
pub struct Csv {
    path: PathBuf,
    writer: csv::Writer<BufWriter<Box<dyn Write>>>,
}

impl Csv {
    /// Writes the header.
    ///
    /// # Errors
    /// Writing failed.
    pub fn new(target: Target) -> Outcome<Self> {
        let Target { path, out } = target;
        let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(out);
        writer.write_record(COLUMNS).map_err(|error| Failure::write(&path, io_error(error)))?;
        writer.flush().map_err(|error| Failure::write(&path, error))?;
        Ok(Self { path, writer })
    }

    /// Goes on without a header.
    pub fn resume(target: Target) -> Self {
        let Target { path, out } = target;
        Self { path, writer: csv::WriterBuilder::new().has_headers(false).from_writer(out) }
    }
}

impl Sink for Csv {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        for row in rows(seen) {
            let name = plain_cell(row.name);
            let row = Row { name: &name, ..row };
            self.writer.serialize(row).map_err(|error| Failure::write(&self.path, io_error(error)))?;
        }
        self.writer.flush().map_err(|error| Failure::write(&self.path, error))
    }

    fn grows(&self) -> Option<&Path> {
        Some(&self.path)
    }
}

/// A name that a spreadsheet would take for a formula, as the same path that is none: `=1+1.png` as `./=1+1.png`.
fn plain_cell(name: &str) -> Cow<'_, str> {
    match name.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        true => Cow::Owned(format!("./{name}")),
        false => Cow::Borrowed(name),
    }
}

/// The crate's own conversion loses the kind, and with it whether a pipe was closed.
fn io_error(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        kind => io::Error::other(format!("{kind:?}")),
    }
}

/// One JSON object a line.
pub struct JsonLines {
    path: PathBuf,
    out: BufWriter<Box<dyn Write>>,
}

impl JsonLines {
    /// Starts empty.
    pub fn new(target: Target) -> Self {
        Self { path: target.path, out: target.out }
    }
}

impl Sink for JsonLines {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        for row in rows(seen) {
            serde_json::to_writer(&mut self.out, &row).map_err(|error| Failure::write(&self.path, error))?;
            self.out.write_all(b"\n").map_err(|error| Failure::write(&self.path, error))?;
        }
        self.out.flush().map_err(|error| Failure::write(&self.path, error))
    }

    fn grows(&self) -> Option<&Path> {
        Some(&self.path)
    }
}
