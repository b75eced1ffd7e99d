//! Tracks: tracks.csv, MOTChallenge text, COCO JSON.
//!
//! A point is written when it has become certain (see `apgstmd_core::tracking`), so rows are not in the order of frames:
//! a track's first points come with its confirmation, those of an occlusion when it is seen again. What has been written
//! stays. The two tables are written in whole rows, the rows of a frame at once; COCO JSON, which is valid only as a
//! whole, at the end of the run, beside its place and then moved there.

use std::fmt::Write as _;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use apgstmd_core::Size;
use apgstmd_core::tracking::TrackPoint;
use serde::Serialize;

use super::beside::Beside;
use super::table::{cut_back, microseconds};
use super::{Seen, Sink};
use crate::Outcome;
use crate::failure::Failure;

/// Columns of tracks.csv.
pub const COLUMNS: &str = "frame,time_s,track,x,y,vx,vy,score,state,age";

/// A text that grows by whole rows.
pub(super) struct Rows {
    pub path: PathBuf,
    file: File,
    pub text: String,
}

impl Rows {
    pub fn new(path: &Path) -> Outcome<Self> {
        let file = File::create(path).map_err(|error| Failure::write(path, error))?;
        Ok(Self { path: path.to_owned(), file, text: String::new() })
    }

    pub fn resume(path: &Path, length: u64) -> Outcome<Self> {
        Ok(Self { path: path.to_owned(), file: cut_back(path, length)?, text: String::new() })
    }

    pub fn flush(&mut self) -> Outcome {
        if !self.text.is_empty() {
            self.file.write_all(self.text.as_bytes()).map_err(|error| Failure::write(&self.path, error))?;
            self.text.clear();
        }
        Ok(())
    }
}

/// tracks.csv.
pub struct TracksCsv(Rows);

impl TracksCsv {
    /// Writes the header.
    ///
    /// # Errors
    /// Writing failed.
    pub fn new(path: &Path) -> Outcome<Self> {
        let mut rows = Rows::new(path)?;
        rows.text += COLUMNS;
        rows.text.push('\n');
        rows.flush()?;
        Ok(Self(rows))
    }

    /// Goes on behind the first `length` bytes.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn resume(path: &Path, length: u64) -> Outcome<Self> {
        Ok(Self(Rows::resume(path, length)?))
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
            let _ = writeln!(self.0.text, "{row}");
        }
        self.0.flush()
    }

    fn grows(&self) -> Option<&Path> {
        Some(&self.0.path)
    }
}

/// MOTChallenge text: `frame,id,left,top,width,height,conf,-1,-1,-1`; frames, ids and pixels count from 1.
pub struct Mot {
    rows: Rows,
    side: f64,
}

impl Mot {
    /// Starts empty; a box of `side` px stands for each point.
    ///
    /// # Errors
    /// Writing failed.
    pub fn new(path: &Path, side: f64) -> Outcome<Self> {
        Ok(Self { rows: Rows::new(path)?, side })
    }

    /// Goes on behind the first `length` bytes.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn resume(path: &Path, side: f64, length: u64) -> Outcome<Self> {
        Ok(Self { rows: Rows::resume(path, length)?, side })
    }
}

impl Sink for Mot {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        for point in &seen.tracks {
            let (x, y) = corner(point, self.side);
            let (frame, id, side) = (point.frame + 1, point.track + 1, self.side);
            let row = format_args!("{frame},{id},{:.3},{:.3},{side},{side},{},-1,-1,-1", x + 1.0, y + 1.0, point.score);
            let _ = writeln!(self.rows.text, "{row}");
        }
        self.rows.flush()
    }

    fn grows(&self) -> Option<&Path> {
        Some(&self.rows.path)
    }
}

/// Upper left edge of the box around a point, pixel i lying between edge i and edge i + 1.
fn corner(point: &TrackPoint, side: f64) -> (f64, f64) {
    (point.x + 0.5 - side / 2.0, point.y + 0.5 - side / 2.0)
}

/// COCO JSON: an image for each frame, an annotation for each point.
pub struct Coco {
    beside: Beside,
    side: f64,
    images: Vec<Image>,
    points: Vec<TrackPoint>,
}

#[derive(Serialize)]
struct Image {
    id: usize,
    file_name: String,
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

#[derive(Serialize)]
struct Dataset<'a> {
    info: Info,
    licenses: [(); 0],
    images: &'a [Image],
    annotations: Vec<Annotation>,
    categories: [Category; 1],
}

impl Coco {
    /// Sees at once whether it will be able to write; a box of `side` px stands for each point.
    ///
    /// # Errors
    /// Writing failed.
    pub fn new(path: &Path, side: f64) -> Outcome<Self> {
        Ok(Self { beside: Beside::new(path)?, side, images: Vec::new(), points: Vec::new() })
    }

    fn annotations(&mut self) -> Vec<Annotation> {
        self.points.sort_by_key(|point| (point.frame, point.track));
        let side = self.side;
        let annotation = |(index, point): (usize, &TrackPoint)| {
            let (x, y) = corner(point, side);
            Annotation {
                id: index + 1,
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
        };
        self.points.iter().enumerate().map(annotation).collect()
    }
}

impl Sink for Coco {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        let Size { height, width } = seen.picture.size();
        let (id, frame, file_name) = (seen.frame + 1, seen.frame, seen.name.clone());
        self.images.push(Image { id, file_name, width, height, frame });
        self.points.extend(&seen.tracks);
        Ok(())
    }

    fn finish(&mut self) -> Outcome {
        let annotations = self.annotations();
        let dataset = Dataset {
            info: Info {
                schema_version: SCHEMA_VERSION,
                description: "tracks found by apgstmd",
                version: env!("CARGO_PKG_VERSION"),
            },
            licenses: [],
            images: &self.images,
            annotations,
            categories: [Category { id: 1, name: "target", supercategory: "target" }],
        };
        let text = serde_json::to_string(&dataset).map_err(|error| Failure::write(self.beside.path(), error))?;
        self.beside.write(&(text + "\n"))
    }
}

fn thousandths(value: f64) -> f64 {
    (1000.0 * value).round() / 1000.0
}
