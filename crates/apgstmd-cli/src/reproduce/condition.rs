//! What an experiment is made of: a scene, parameters, recorders.

use std::ops::Range;

use apgstmd_core::Params;
use apgstmd_core::Stage;
use apgstmd_core::params::RejectionMode;
use apgstmd_core::stimulus::{Path, Scene, Shade, Target};

/// Frames per second of every scene of the paper, Hz.
pub const RATE: f64 = 1000.0;
/// Speed that the default constants are tuned to, px/s.
pub const SPEED: f64 = 250.0;
/// Frames that a target of that speed takes for a pixel.
pub const FRAMES_PER_PX: f64 = RATE / SPEED;

/// One scene through the model.
pub struct Condition {
    /// Numbers that tell it from the others: the first columns of the table.
    pub factors: Vec<(&'static str, f64)>,
    /// What is shown.
    pub scene: Scene,
    /// To what.
    pub params: Params,
    /// What is kept of it.
    pub recorders: Vec<Recorder>,
}

/// Keeps something of what happens in the model.
pub struct Recorder {
    /// Tells it from the others of its condition.
    pub name: &'static str,
    /// When it looks.
    pub frames: Range<usize>,
    /// At what.
    pub what: What,
}

/// What a recorder keeps.
pub enum What {
    /// The largest E and Q of each direction in a region.
    Peaks(Region),
    /// E and Q of a direction at a pixel, frame by frame.
    Course {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// Number of the direction.
        direction: usize,
    },
    /// Signals along a row, in the last of the frames. Of eight directions the largest.
    Line {
        /// Row.
        y: usize,
        /// Stages of the model; the luminance of the scene comes along.
        stages: &'static [Stage],
    },
    /// E and Q in a rectangle of the picture, summed over the frames.
    Map {
        /// Columns.
        x: Range<usize>,
        /// Rows.
        y: Range<usize>,
        /// Of this direction; else of that where it is largest.
        direction: Option<usize>,
    },
    /// The picture itself, in the last of the frames.
    Picture,
}

/// Where [`What::Peaks`] looks.
pub enum Region {
    /// Everywhere.
    Everywhere,
    /// On one row.
    Row(usize),
    /// In these zones.
    Inside(Vec<Zone>),
    /// Outside all of them.
    Outside(Vec<Zone>),
}

/// A rectangle that may move.
#[derive(Clone)]
pub struct Zone {
    /// Of its centre.
    pub path: Path,
    /// Half its width and half its height, px.
    pub half: [f64; 2],
}

impl Zone {
    /// A rectangle that stands still.
    pub fn fixed(center: [f64; 2], half: [f64; 2]) -> Self {
        Self { path: Path::Straight { start: center, speed: 0.0, direction: 0.0 }, half }
    }

    /// Whether a pixel lies in it, `seconds` after the scene's beginning.
    pub fn holds(&self, (x, y): (usize, usize), seconds: f64) -> bool {
        let center = self.path.at(seconds);
        (x as f64 - center.0).abs() <= self.half[0] && (y as f64 - center.1).abs() <= self.half[1]
    }
}

impl Recorder {
    /// Largest E and Q.
    pub fn peaks(name: &'static str, frames: Range<usize>, region: Region) -> Self {
        Self { name, frames, what: What::Peaks(region) }
    }
}

/// The paper's constants, nothing rejected. With attention E feeds back into the luminance, so tuning is measured
/// without.
pub fn params(attention: bool) -> Params {
    let mut params = Params::default();
    params.rejection.mode = RejectionMode::Off;
    params.attention.enabled = attention;
    params
}

/// A white scene at 1000 Hz, just large enough: on white a target's response does not depend on how much of it there is.
pub fn white(width: usize, height: usize, frames: usize, targets: Vec<Target>) -> Scene {
    Scene { width, height, frames, targets, rate: RATE, ..Scene::default() }
}

/// A 5 x 5 px target on a straight path.
pub fn straight(start: [f64; 2], speed: f64, direction: f64, luminance: f64) -> Target {
    let path = Path::Straight { start, speed, direction };
    Target { shade: Shade::Luminance(luminance), ..Target::new(path) }
}

/// From `low` to `high`, both included.
pub fn steps(low: f64, high: f64, step: f64) -> Vec<f64> {
    let count = ((high - low) / step).round() as usize;
    // Rounded, so that 0.1 + 0.2 is the 0.3 that a check asks for.
    (0..=count).map(|i| ((low + step * i as f64) * 1e6).round() / 1e6).collect()
}
