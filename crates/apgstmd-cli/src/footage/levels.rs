//! How much of the picture is at the ends of its scale, where contrast is lost.

use ndarray::ArrayView3;
use serde::{Deserialize, Serialize};

use super::Warning;
use crate::source::{Picture, Pixels};

/// Samples of a frame that are looked at, at most: whole columns, evenly spaced.
const MOST: usize = 1 << 18;
/// Share of saturated samples that is worth a word.
const SATURATED: f64 = 0.1;

/// Columns of a picture in [0, 1], row by row; of colour, the green.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Sample {
    pub columns: usize,
    pub values: Vec<f32>,
}

impl Sample {
    pub fn of(picture: &Picture) -> Self {
        let full = 2f64.powi(picture.bits.unwrap_or(16) as i32) - 1.0;
        match &picture.pixels {
            Pixels::U8(samples) => Self::take(samples.view(), 255.0),
            Pixels::U16(samples) => Self::take(samples.view(), full),
            Pixels::F32(samples) => Self::take(samples.view(), 1.0),
            Pixels::F64(samples) => Self::take(samples.view(), 1.0),
        }
    }

    fn take<T: Copy + Into<f64>>(samples: ArrayView3<'_, T>, full: f64) -> Self {
        let (height, width, channels) = samples.dim();
        let step = (height * width).div_ceil(MOST).max(1);
        let channel = usize::from(channels >= 3);
        let scale = full.recip();
        let columns = width.div_ceil(step);
        let mut values = Vec::with_capacity(height * columns);
        for row in samples.outer_iter() {
            values.extend(row.outer_iter().step_by(step).map(|pixel| (pixel[channel].into() * scale) as f32));
        }
        Self { columns, values }
    }
}

/// Sums over frames.
#[derive(Default, Serialize, Deserialize)]
pub(super) struct Levels {
    samples: usize,
    black: usize,
    white: usize,
}

impl Levels {
    pub fn add(&mut self, sample: &Sample) {
        self.samples += sample.values.len();
        self.black += sample.values.iter().filter(|value| **value <= 0.0).count();
        self.white += sample.values.iter().filter(|value| **value >= 1.0).count();
    }

    pub fn warning(&self) -> Option<Warning> {
        let share = |count: usize| count as f64 / self.samples.max(1) as f64;
        let (black, white) = (share(self.black), share(self.white));
        let (share, end, remedy) = match white >= black {
            true => (white, "the largest value", "expose less"),
            false => (black, "0", "expose more (black bars around the picture count too)"),
        };
        (black + white >= SATURATED).then(|| {
            let text = format!("{:.0} % of the pixels are at {end}: what differs there cannot be seen", 100.0 * share);
            Warning::new("saturated", text, format!("{remedy}, or choose a lower contrast in the camera"))
        })
    }
}
