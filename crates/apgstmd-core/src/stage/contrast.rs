//! Directional contrast (T1): C(phi) = P * (G ahead along phi - G behind), phi = j pi / 4, j = 0..3.
//!
//! Input: P. Output: the four contrasts at one pixel; only the pixels on traces are needed. No state.

use ndarray::Array3;

use crate::direction::{angle, step};
use crate::frame::Size;
use crate::memory::heap;
use crate::params::RejectionParams;
use crate::plane::Plane;

/// Orientations of T1.
pub(crate) const ORIENTATIONS: usize = 4;

pub(crate) struct Contrast {
    radius: isize,
    /// For each offset of the square support, row by row, what a pixel there adds to each orientation.
    taps: Vec<[f32; ORIENTATIONS]>,
}

heap!(Contrast { taps });

impl Contrast {
    pub fn new(params: &RejectionParams) -> Self {
        let radius = (params.contrast_offset + 4.0 * params.contrast_sigma).ceil() as isize;
        let gaussian = |x: f64, y: f64| {
            let variance = params.contrast_sigma.powi(2);
            (-(x * x + y * y) / (2.0 * variance)).exp() / (std::f64::consts::TAU * variance)
        };
        let taps = (-radius..=radius)
            .flat_map(|dy| (-radius..=radius).map(move |dx| (dx as f64, dy as f64)))
            .map(|(dx, dy)| {
                std::array::from_fn(|j| {
                    let (ahead_x, ahead_y) = step(angle(j));
                    let (cx, cy) = (params.contrast_offset * ahead_x, params.contrast_offset * ahead_y);
                    // Convolution: the pixel at +(dx, dy) meets the kernel at -(dx, dy).
                    (gaussian(-dx - cx, -dy - cy) - gaussian(-dx + cx, -dy + cy)) as f32
                })
            })
            .collect();
        Self { radius, taps }
    }

    /// The four contrasts at (x, y), border replicated.
    pub fn at(&self, p: &Plane, x: usize, y: usize) -> [f32; ORIENTATIONS] {
        let (height, width) = (p.size().height as isize, p.size().width as isize);
        let mut taps = self.taps.iter();
        let mut sums = [0.0; ORIENTATIONS];
        for dy in -self.radius..=self.radius {
            let row = p.row((y as isize + dy).clamp(0, height - 1) as usize);
            for (dx, taps) in (-self.radius..=self.radius).zip(&mut taps) {
                let value = row[(x as isize + dx).clamp(0, width - 1) as usize];
                for (sum, tap) in sums.iter_mut().zip(taps) {
                    *sum += tap * value;
                }
            }
        }
        sums
    }

    /// C of a whole frame.
    pub fn map(&self, p: &Plane) -> Array3<f32> {
        let Size { height, width } = p.size();
        let mut map = Array3::zeros((ORIENTATIONS, height, width));
        for y in 0..height {
            for x in 0..width {
                for (j, c) in self.at(p, x, y).into_iter().enumerate() {
                    map[[j, y, x]] = c;
                }
            }
        }
        map
    }
}
