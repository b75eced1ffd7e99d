//! Where results go: each sink sees every processed frame once, in order.

pub(crate) mod beside;
pub mod camera;
pub mod dump;
pub mod outline;
pub mod overlay;
mod png;
pub mod poster;
pub mod report;
pub mod results;
pub mod run_json;
pub mod scene_folder;
pub mod table;
pub mod tracks;
pub mod video;

use std::path::Path;

use apgstmd_core::tracking::TrackPoint;
use apgstmd_core::{Detection, EgoMotion, Stage};
use ndarray::{Array2, Array3};

use crate::Outcome;
use crate::source::Picture;

/// One processed frame.
pub struct Seen {
    /// Number of the frame in its source.
    pub frame: usize,
    /// Its name.
    pub name: String,
    /// Seconds since the source's beginning, where it tells.
    pub time: Option<f64>,
    /// What went in.
    pub picture: Picture,
    /// What was found, strongest first.
    pub detections: Vec<Detection>,
    /// Points of tracks that became certain with this frame: its own and earlier ones.
    pub tracks: Vec<TrackPoint>,
    /// How the background moved, (x, y) px in the middle and the rest.
    pub background_shift: (f32, f32),
    /// Rotation, zoom and what they leave.
    pub ego_motion: EgoMotion,
    /// The scene was cut before this frame.
    pub cut: bool,
    /// What happened inside, as far as that is to be written.
    pub maps: Vec<(Stage, Array3<f32>)>,
    /// The response, (rows, columns), where a sink asked for it.
    pub response: Option<Array2<f32>>,
}

#[cfg(test)]
impl Seen {
    /// A frame in which nothing was found.
    pub fn bare(frame: usize, picture: Picture) -> Self {
        Self {
            frame,
            name: format!("frame {frame}"),
            time: None,
            picture,
            detections: Vec::new(),
            tracks: Vec::new(),
            background_shift: (0.0, 0.0),
            ego_motion: EgoMotion::default(),
            cut: false,
            maps: Vec::new(),
            response: None,
        }
    }
}

/// Tracks below this share of the strongest score are drawn faintly: single detectors list clutter that is thousands of
/// times weaker than targets. A bank has a floor of its own.
const WEAK: f32 = 0.01;

/// A receiver of results.
pub trait Sink {
    /// Takes a frame; what it writes is on its way to the disk when this returns.
    ///
    /// # Errors
    /// Writing failed.
    fn frame(&mut self, seen: &Seen) -> Outcome;

    /// The file that grows with every frame and can be cut back, by name: its length now is where to go on. None where there is
    /// no such file.
    fn grows(&self) -> Option<&Path> {
        None
    }

    /// The last frame is through, or the run ends early.
    ///
    /// # Errors
    /// Writing failed.
    fn finish(&mut self) -> Outcome {
        Ok(())
    }
}
