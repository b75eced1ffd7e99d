//! Tracks: tracks.csv, MOTChallenge text, COCO JSON.
//!
//! A point is written when it has become certain (see `apgstmd_core::tracking`), so rows are not in the order of frames:
//! a track's first points come with its confirmation, those of an occlusion when it is seen again. What has been written
//! stays. COCO JSON is valid only as a whole: it grows beside its place, points in a file of their own, and is put together
//! and moved there at the end of the run.

use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;

use apgstmd_core::Size;
use apgstmd_core::tracking::TrackPoint;
use serde::Serialize;

use super::beside::Beside;
use super::table::{Target, microseconds};
use super::{Seen, Sink};
use crate::Outcome;
use crate::failure::Failure;

/// Columns of tracks.csv.
pub const COLUMNS: &str = "frame,time_s,track,x,y,vx,vy,score,state,age";

/// tracks.csv.
pub struct TracksCsv(Target);

impl TracksCsv {
    /// Writes the header.
    ///
    /// # Errors
    /// Writing failed.
    pub fn new(path: &Path) -> Outcome<Self> {
        Ok(Self(Target::file(path)?.headed(COLUMNS)?))
    }

    /// Goes on behind the first `length` bytes.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn resume(path: &Path, length: u64) -> Outcome<Self> {
        Ok(Self(Target::resume(path, length)?))
    }
}

impl Sink for TracksCsv {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        for point in &seen.tracks {
            let TrackPoint { frame, track, x, y, vx, vy, score, state, age, .. } = point;
            let time = point.time.map_or(String::new(), |time| microseconds(time).to_string());
            // A thousandth of a pixel, and of a pixel a frame, is far below what is known.
            let row =
                format_args!("{frame},{time},{track},{x:.3},{y:.3},{vx:.4},{vy:.4},{score},{},{age}", state.name());
            let _ = writeln!(self.0.rows, "{row}");
        }
        self.0.flush()
    }

    fn grows(&self) -> Option<&Path> {
        Some(self.0.path())
    }
}

/// MOTChallenge text: `frame,id,left,top,width,height,conf,-1,-1,-1`; frames, ids and pixels count from 1.
pub struct Mot {
    target: Target,
    side: f64,
}

impl Mot {
    /// Starts empty; a box of `side` px stands for each point.
    ///
    /// # Errors
    /// Writing failed.
    pub fn new(path: &Path, side: f64) -> Outcome<Self> {
        Ok(Self { target: Target::file(path)?, side })
    }

    /// Goes on behind the first `length` bytes.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn resume(path: &Path, side: f64, length: u64) -> Outcome<Self> {
        Ok(Self { target: Target::resume(path, length)?, side })
    }
}

impl Sink for Mot {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        for point in &seen.tracks {
            let (x, y) = corner(point, self.side);
            let (frame, id, side) = (point.frame + 1, point.track + 1, self.side);
            let row = format_args!("{frame},{id},{:.3},{:.3},{side},{side},{},-1,-1,-1", x + 1.0, y + 1.0, point.score);
            let _ = writeln!(self.target.rows, "{row}");
        }
        self.target.flush()
    }

    fn grows(&self) -> Option<&Path> {
        Some(self.target.path())
    }
}

/// Upper left edge of the box around a point, pixel i lying between edge i and edge i + 1.
fn corner(point: &TrackPoint, side: f64) -> (f64, f64) {
    (point.x + 0.5 - side / 2.0, point.y + 0.5 - side / 2.0)
}

/// COCO JSON: an image for each frame, an annotation for each point, in the order in which they become certain.
pub struct Coco {
    beside: Beside,
    side: f64,
    /// All up to the last image.
    images: BufWriter<File>,
    /// What comes behind them. It has no name, and goes with the process.
    annotations: BufWriter<File>,
    count: (usize, usize),
    /// A part of something may be there: it will never be whole.
    failed: bool,
}

#[derive(Serialize)]
struct Image<'a> {
    id: usize,
    file_name: &'a str,
    width: usize,
    height: usize,
    frame: usize,
}

#[derive(Serialize)]
struct Annotation {
    id: usize,
    image_id: usize,
    category_id: usize,
    /// x, y, width, height; x, y is the upper left edge.
    bbox: [f64; 4],
    area: f64,
    iscrowd: u8,
    score: f32,
    track_id: u64,
    /// The point itself, pixel centres at integers.
    center: [f64; 2],
    state: &'static str,
}

#[derive(Serialize)]
struct Category {
    id: usize,
    name: &'static str,
    supercategory: &'static str,
}

/// Raised when a field changes its meaning or goes away.
const SCHEMA_VERSION: u32 = 1;

#[derive(Serialize)]
struct Info {
    schema_version: u32,
    description: &'static str,
    version: &'static str,
}

impl Coco {
    /// Sees at once whether it will be able to write; a box of `side` px stands for each point.
    ///
    /// # Errors
    /// Writing failed.
    pub fn new(path: &Path, side: f64) -> Outcome<Self> {
        let (beside, mut images) = Beside::open(path)?;
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let info = Info {
            schema_version: SCHEMA_VERSION,
            description: "tracks found by apgstmd",
            version: env!("CARGO_PKG_VERSION"),
        };
        let head = format!("{{\"info\":{},\"licenses\":[],\"images\":[", json(&info));
        let failed = |error| Failure::write(path, error);
        images.write_all(head.as_bytes()).map_err(failed)?;
        let annotations = BufWriter::new(tempfile::tempfile_in(folder).map_err(failed)?);
        Ok(Self { beside, side, images: BufWriter::new(images), annotations, count: (0, 0), failed: false })
    }

    fn add(&mut self, seen: &Seen) -> io::Result<()> {
        let Size { height, width } = seen.picture.size();
        let image = Image { id: seen.frame + 1, file_name: &seen.name, width, height, frame: seen.frame };
        item(&mut self.images, &mut self.count.0, &image)?;
        for point in &seen.tracks {
            let annotation = self.annotation(point);
            item(&mut self.annotations, &mut self.count.1, &annotation)?;
        }
        Ok(())
    }

    fn annotation(&self, point: &TrackPoint) -> Annotation {
        let side = self.side;
        let (x, y) = corner(point, side);
        Annotation {
            id: self.count.1 + 1,
            image_id: point.frame + 1,
            category_id: 1,
            bbox: [thousandths(x), thousandths(y), side, side],
            area: side * side,
            iscrowd: 0,
            score: point.score,
            track_id: point.track,
            center: [thousandths(point.x), thousandths(point.y)],
            state: point.state.name(),
        }
    }

    fn put_together(&mut self) -> io::Result<()> {
        self.annotations.flush()?;
        let points = self.annotations.get_mut();
        points.rewind()?;
        self.images.write_all(b"],\"annotations\":[")?;
        io::copy(points, &mut self.images)?;
        let target = Category { id: 1, name: "target", supercategory: "target" };
        self.images.write_all(format!("],\"categories\":[{}]}}\n", json(&target)).as_bytes())?;
        self.images.flush()
    }
}

/// Writes one more item of a list.
fn item(out: &mut impl Write, count: &mut usize, item: &impl Serialize) -> io::Result<()> {
    let comma = if *count == 0 { "" } else { "," };
    *count += 1;
    out.write_all(format!("{comma}{}", json(item)).as_bytes())
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("plain values are JSON")
}

impl Sink for Coco {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        let added = self.add(seen);
        self.failed |= added.is_err();
        added.map_err(|error| Failure::write(self.beside.path(), error))
    }

    fn finish(&mut self) -> Outcome {
        if self.failed {
            return Ok(());
        }
        self.put_together().map_err(|error| Failure::write(self.beside.path(), error))?;
        self.beside.place()
    }
}

fn thousandths(value: f64) -> f64 {
    (1000.0 * value).round() / 1000.0
}
