//! Tables that grow by whole rows, those of a frame at once: what an interrupted run leaves is complete up to there.
//! Detections as CSV or JSON Lines, one row a detection, the strongest of a frame first.

use std::borrow::Cow;
use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
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

/// A table that grows by the rows of a frame at once: an open file or stdout, with its name for messages.
pub struct Target {
    path: PathBuf,
    out: Out,
    /// Rows that are to be written.
    pub(super) rows: Vec<u8>,
}

enum Out {
    /// With the length of what was written.
    File(File, u64),
    Stdout(io::Stdout),
}

impl Target {
    /// Creates a file.
    ///
    /// # Errors
    /// It cannot be created.
    pub fn file(path: &Path) -> Outcome<Self> {
        let file = File::create(path).map_err(|error| Failure::write(path, error))?;
        Ok(Self { path: path.to_owned(), out: Out::File(file, 0), rows: Vec::new() })
    }

    /// A file that an earlier run left, to go on behind its first `length` bytes; what comes after them is lost.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn resume(path: &Path, length: u64) -> Outcome<Self> {
        let cut = || -> io::Result<File> {
            let mut file = OpenOptions::new().write(true).open(path)?;
            file.set_len(length)?;
            file.seek(SeekFrom::End(0))?;
            Ok(file)
        };
        let file = cut().map_err(|error| Failure::write(path, error))?;
        Ok(Self { path: path.to_owned(), out: Out::File(file, length), rows: Vec::new() })
    }

    /// Standard output.
    pub fn stdout() -> Self {
        Self { path: PathBuf::from("stdout"), out: Out::Stdout(io::stdout()), rows: Vec::new() }
    }

    /// Begins with these columns.
    pub(super) fn headed(mut self, columns: &str) -> Outcome<Self> {
        self.rows.extend(columns.as_bytes());
        self.rows.push(b'\n');
        self.flush()?;
        Ok(self)
    }

    /// Its name.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Hands the rows on. Where that fails, no part of them stays in a file.
    pub(super) fn flush(&mut self) -> Outcome {
        let written = match &mut self.out {
            Out::Stdout(stdout) => stdout.write_all(&self.rows).and_then(|()| stdout.flush()),
            Out::File(file, length) => {
                let written = is_there(file).and_then(|()| file.write_all(&self.rows));
                match &written {
                    Ok(()) => *length += self.rows.len() as u64,
                    // Where not even this can be done, a row without its end is left.
                    Err(_) => drop(file.set_len(*length)),
                }
                written
            }
        };
        self.rows.clear();
        written.map_err(|error| Failure::write(&self.path, error))
    }
}

/// Whether it still has a name: nobody would ever see what is written into a file that was removed.
#[cfg(unix)]
fn is_there(file: &File) -> io::Result<()> {
    match std::os::unix::fs::MetadataExt::nlink(&file.metadata()?) {
        0 => Err(io::Error::other("it was removed while it was being written")),
        _ => Ok(()),
    }
}

/// Files that are open cannot be removed here.
#[cfg(not(unix))]
fn is_there(_: &File) -> io::Result<()> {
    Ok(())
}

/// Comma-separated values with a header.
pub struct Csv(Target);

impl Csv {
    /// Writes the header.
    ///
    /// # Errors
    /// Writing failed.
    pub fn new(target: Target) -> Outcome<Self> {
        Ok(Self(target.headed(&COLUMNS.join(","))?))
    }

    /// Goes on without a header.
    pub fn resume(target: Target) -> Self {
        Self(target)
    }
}

impl Sink for Csv {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        let Self(target) = self;
        let mut writer = csv::WriterBuilder::new().has_headers(false).from_writer(&mut target.rows);
        for row in rows(seen) {
            let name = plain_cell(row.name);
            writer.serialize(Row { name: &name, ..row }).expect("rows are plain cells");
        }
        drop(writer);
        target.flush()
    }

    fn grows(&self) -> Option<&Path> {
        Some(self.0.path())
    }
}

/// A name that a spreadsheet would take for a formula, as the same path that is none: `=1+1.png` as `./=1+1.png`.
fn plain_cell(name: &str) -> Cow<'_, str> {
    match name.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        true => Cow::Owned(format!("./{name}")),
        false => Cow::Borrowed(name),
    }
}

/// One JSON object a line.
pub struct JsonLines(Target);

impl JsonLines {
    /// Starts empty.
    pub fn new(target: Target) -> Self {
        Self(target)
    }
}

impl Sink for JsonLines {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        for row in rows(seen) {
            serde_json::to_writer(&mut self.0.rows, &row).expect("rows are plain values");
            self.0.rows.push(b'\n');
        }
        self.0.flush()
    }

    fn grows(&self) -> Option<&Path> {
        Some(self.0.path())
    }
}
