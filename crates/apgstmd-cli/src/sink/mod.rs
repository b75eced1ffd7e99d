//! Where results go: each sink sees every processed frame once, in order.

pub mod dump;
pub mod overlay;
mod png;
pub mod results;
pub mod run_json;
pub mod scene_folder;
pub mod table;
pub mod tracks;

use apgstmd_core::tracking::TrackPoint;
use apgstmd_core::{Detection, EgoMotion, Stage};
use ndarray::Array3;

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
}

/// A receiver of results.
pub trait Sink {
    /// Takes a frame; what it writes is on its way to the disk when this returns.
    ///
    /// # Errors
    /// Writing failed.
    fn frame(&mut self, seen: &Seen) -> Outcome;

    /// The last frame is through, or the run ends early.
    ///
    /// # Errors
    /// Writing failed.
    fn finish(&mut self) -> Outcome {
        Ok(())
    }
}
