//! What leaves the detector.

use ndarray::Array2;
use serde::{Deserialize, Serialize};

use crate::frame::Size;
use crate::memory::{Heap, Memory, heap, owned};

/// One small moving target in one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Detection {
    /// Column of the target, px, pixel centres at integers.
    pub x: f32,
    /// Row of the target, px, downward.
    pub y: f32,
    /// Response Q at the peak: comparable between frames and clips of one parameter set. From a [`crate::Bank`] 0..1:
    /// equivalent contrast, weighed by what its trace and its place have shown so far: see [`crate::Bank`].
    pub score: f32,
    /// Direction of motion, radians in (-pi, pi], counter-clockwise on the screen: 0 = right, pi/2 = up. From a [`crate::Bank`] relative
    /// to the background, else in the picture. NaN where the model has no directions.
    pub direction: f32,
    /// Number of the trace that links this target from frame to frame, counted from 0 since the last reset.
    pub trace: u64,
    /// Frames in which this trace had a peak so far, this one included. Several frames that a member of a [`crate::Bank`] takes as
    /// one count once ([`crate::Member::exposure`]).
    pub points: u32,
    /// Net displacement over path length of the trace's last points, 60 at most, relative to the background: 1 is a straight
    /// line, 0 a place returned to, or a trace that has not moved.
    pub straightness: f32,
    /// That net displacement, px.
    pub displacement: f32,
    /// Velocity of the trace relative to the background, (x, y) px/frame, y downward: over its last steps, 0.3 of each and 0.7 of those
    /// before. 0 at first.
    pub velocity: (f32, f32),
    /// Equivalent contrast: Weber contrast of a black 5 x 5 target on white that looks and responds as strongly, 0..1. Known
    /// to a [`crate::Bank`]; 0 from a detector alone.
    pub contrast: f32,
    /// Speed that what saw it is tuned to, px/frame; from a [`crate::Bank`] relative to the background, as the direction.
    pub speed: f32,
    /// Side of the targets that what saw it is tuned to, px.
    pub size: f32,
}

heap!(Detection);

impl Detection {
    /// Moves it along its direction, where it has one.
    pub(crate) fn move_ahead(&mut self, distance: f32) {
        if !self.direction.is_nan() {
            self.x += distance * self.direction.cos();
            self.y -= distance * self.direction.sin();
        }
    }
}

/// The maps and detections of one frame. Made once by [`crate::Detector::make_response`] and used again.
#[derive(Clone, Debug)]
pub struct Response {
    /// max over directions of Q, (rows, columns). Q = E' in models without prediction, Y near confirmed peaks in ESTMD.
    pub map: Array2<f32>,
    /// Angle of the vector sum of Q over directions, radians, NaN where Q = 0 and in ESTMD, (rows, columns).
    pub direction: Array2<f32>,
    /// Confirmed targets, strongest first.
    pub detections: Vec<Detection>,
    /// Shift of the background from the last frame to this one in the middle of the picture, (x, y) px; (0, 0) where it
    /// is not estimated.
    pub background_shift: (f32, f32),
    /// The rest of the background's motion, and how well it explains the picture.
    pub ego_motion: EgoMotion,
    /// The picture has nothing to do with the last one (found with `rejection.background = "similarity"` only): filters
    /// and traces begin anew, as before the first frame.
    pub cut: bool,
    /// Directions, of the map and of detections, are relative to the background and not to the picture: those of a [`crate::Bank`].
    pub in_world: bool,
}

/// How the background moved from the last frame to this one, about the middle of the picture: turned by `rotation`,
/// enlarged by `zoom` and shifted by [`Response::background_shift`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EgoMotion {
    /// Radians, counter-clockwise on the screen.
    pub rotation: f32,
    /// Factor: above 1 things become larger.
    pub zoom: f32,
    /// Robust scale of what the motion leaves of the change from frame to frame: 1.5 times the median absolute residual,
    /// luminance, steep places counting more. 0 where nothing was compared.
    pub residual: f32,
    /// The picture tells of no motion (no structure, nothing that fits, more than the estimate can follow), and none is
    /// assumed.
    pub unexplained: bool,
}

impl Default for EgoMotion {
    /// Nothing moves.
    fn default() -> Self {
        Self { rotation: 0.0, zoom: 1.0, residual: 0.0, unexplained: false }
    }
}

impl Heap for Response {
    fn heap(&self) -> Memory {
        owned((self.map.len() + self.direction.len()) * size_of::<f32>()) + self.detections.heap()
    }
}

impl Response {
    pub(crate) fn new(size: Size, max_peaks: usize) -> Self {
        let shape = (size.height, size.width);
        Self {
            map: Array2::zeros(shape),
            direction: Array2::from_elem(shape, f32::NAN),
            detections: Vec::with_capacity(max_peaks),
            background_shift: (0.0, 0.0),
            ego_motion: EgoMotion::default(),
            cut: false,
            in_world: false,
        }
    }

    /// Nothing is seen.
    pub(crate) fn clear(&mut self) {
        self.map.fill(0.0);
        self.direction.fill(f32::NAN);
        self.detections.clear();
    }

    /// Rows and columns.
    pub fn size(&self) -> Size {
        let (height, width) = self.map.dim();
        Size { height, width }
    }
}
