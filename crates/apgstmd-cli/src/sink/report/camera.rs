//! How the camera moved, the numbers of camera.csv: of each frame that is kept, and the most of each bar of the timeline.

use serde::Serialize;

use super::{rounded, significant};
use crate::sink::Seen;

/// Of one frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moved {
    shift: (f32, f32),
    rotation: f32,
    zoom: f32,
    residual: f32,
    unexplained: bool,
    cut: bool,
}

/// Of the frames that are kept, as the page takes it.
#[derive(Serialize)]
pub(super) struct Columns {
    /// Of the background in the middle of the picture, px.
    x: Vec<f64>,
    y: Vec<f64>,
    /// Counter-clockwise.
    degrees: Vec<f64>,
    zoom: Vec<f64>,
    residual: Vec<f64>,
    /// 1 or 0.
    unexplained: Vec<u8>,
    cut: Vec<u8>,
}

impl Moved {
    pub fn of(seen: &Seen) -> Self {
        let Seen { background_shift, ego_motion, cut, .. } = seen;
        Self {
            shift: *background_shift,
            rotation: ego_motion.rotation,
            zoom: ego_motion.zoom,
            residual: ego_motion.residual,
            unexplained: ego_motion.unexplained,
            cut: *cut,
        }
    }

    pub fn columns(frames: &[&Self]) -> Columns {
        let each = |value: fn(&Self) -> f64| frames.iter().map(|moved| value(moved)).collect();
        let whether = |value: fn(&Self) -> bool| frames.iter().map(|moved| u8::from(value(moved))).collect();
        Columns {
            x: each(|moved| rounded(f64::from(moved.shift.0), 2)),
            y: each(|moved| rounded(f64::from(moved.shift.1), 2)),
            degrees: each(|moved| rounded(f64::from(moved.rotation).to_degrees(), 3)),
            zoom: each(|moved| rounded(f64::from(moved.zoom), 5)),
            residual: each(|moved| rounded(f64::from(moved.residual), 4)),
            unexplained: whether(|moved| moved.unexplained),
            cut: whether(|moved| moved.cut),
        }
    }
}

/// Of the frames of a bar: the most, and how many.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Most {
    pub shift: f32,
    pub residual: f32,
    pub unexplained: usize,
    pub cuts: usize,
}

/// Of all bars, as the page takes it.
#[derive(Serialize)]
pub(super) struct Bars {
    /// Px a frame.
    shift: Vec<f64>,
    residual: Vec<f64>,
    unexplained: Vec<usize>,
    cuts: Vec<usize>,
}

impl Most {
    pub fn of(seen: &Seen) -> Self {
        let Moved { shift, residual, unexplained, cut, .. } = Moved::of(seen);
        Self { shift: shift.0.hypot(shift.1), residual, unexplained: usize::from(unexplained), cuts: usize::from(cut) }
    }

    pub fn join(self, other: Self) -> Self {
        Self {
            shift: self.shift.max(other.shift),
            residual: self.residual.max(other.residual),
            unexplained: self.unexplained + other.unexplained,
            cuts: self.cuts + other.cuts,
        }
    }

    pub fn bars(bars: &[Self]) -> Bars {
        Bars {
            shift: bars.iter().map(|most| rounded(f64::from(most.shift), 2)).collect(),
            residual: bars.iter().map(|most| significant(f64::from(most.residual))).collect(),
            unexplained: bars.iter().map(|most| most.unexplained).collect(),
            cuts: bars.iter().map(|most| most.cuts).collect(),
        }
    }
}
