//! The background's shift from frame to frame: a global translation found by Gauss-Newton on the retina output.
//!
//! Input: P. Output: (x, y) px that the background moved. State: the last P and the last shift. At most 4 iterations on
//! at most 16384 pixels of a regular grid, bilinear, Cauchy weights at 1.5 times the median absolute residual, a margin
//! left out. Where the picture has no structure, or the shift explains it no better than none, it is zero.

use crate::frame::Size;
use crate::memory::heap;
use crate::plane::Plane;
use crate::stage::median::Median;
use crate::state::remember;

const ITERATIONS: usize = 4;
const MARGIN: usize = 12;
const MOST_SAMPLES: usize = 16384;
/// Least mean squared gradient along the weakest axis, (luminance / px)^2.
const STRUCTURE: f64 = 1e-8;
/// Least scale of the residuals, luminance.
const LEAST_SCALE: f32 = 1e-6;
/// Steps below this end the search, px.
const SETTLED: f64 = 1e-3;

pub(crate) struct Translation {
    size: Size,
    margin: usize,
    step: usize,
    /// Luminance of the last frame at the samples, and its gradient.
    last: Vec<f32>,
    gradient: [Vec<f32>; 2],
    first: bool,
    shift: (f64, f64),
    /// Robust scale of the last residuals.
    residual: f32,
    residuals: Vec<f32>,
    median: Median,
}

heap!(Translation { last, gradient, residuals, median });
remember!(Translation { first, last, gradient, shift });

impl Translation {
    pub fn new(size: Size) -> Self {
        let least = size.height.min(size.width);
        let margin = if least < 2 * MARGIN + 8 { least / 4 } else { MARGIN };
        let area = (size.height - 2 * margin) * (size.width - 2 * margin);
        let step = ((area as f64 / MOST_SAMPLES as f64).sqrt().ceil() as usize).max(1);
        let samples = (size.height - 2 * margin).div_ceil(step) * (size.width - 2 * margin).div_ceil(step);
        let sampled = || vec![0.0; samples];
        Self {
            size,
            margin,
            step,
            last: sampled(),
            gradient: [sampled(), sampled()],
            first: true,
            shift: (0.0, 0.0),
            residual: 0.0,
            residuals: sampled(),
            median: Median::new(samples),
        }
    }

    /// The shift from the last frame to this one, none where the picture tells of none, and the scale of the residuals.
    pub fn process(&mut self, p: &Plane) -> (Option<(f64, f64)>, f32) {
        self.residual = 0.0;
        let shift = if std::mem::replace(&mut self.first, false) { Some((0.0, 0.0)) } else { self.estimate(p) };
        self.shift = shift.unwrap_or((0.0, 0.0));
        self.remember(p);
        (shift, self.residual)
    }

    pub fn reset(&mut self) {
        self.first = true;
        self.shift = (0.0, 0.0);
    }

    fn estimate(&mut self, p: &Plane) -> Option<(f64, f64)> {
        self.compare(p, (0.0, 0.0));
        let still = self.scale();
        self.residual = still;
        let without = cost(&self.residuals, still);
        let mut shift = self.shift;
        for _ in 0..ITERATIONS {
            self.compare(p, shift);
            let scale = self.scale();
            let step = self.step(scale)?;
            shift = (shift.0 - step.0, shift.1 - step.1);
            let limit = self.margin as f64 - 1.0;
            if shift.0.abs() > limit || shift.1.abs() > limit {
                return None;
            }
            if step.0.hypot(step.1) < SETTLED {
                break;
            }
        }
        self.compare(p, shift);
        if cost(&self.residuals, still) > without {
            return None;
        }
        self.residual = self.scale();
        Some(shift)
    }

    fn columns(&self) -> impl Iterator<Item = usize> + Clone + use<> {
        (self.margin..self.size.width - self.margin).step_by(self.step)
    }

    fn rows(&self) -> impl Iterator<Item = usize> + Clone + use<> {
        (self.margin..self.size.height - self.margin).step_by(self.step)
    }

    /// Keeps what the next frame is compared with.
    fn remember(&mut self, p: &Plane) {
        let (rows, columns) = (self.rows(), self.columns());
        let Self { last, gradient: [gx, gy], .. } = self;
        [&mut *last, &mut *gx, &mut *gy].into_iter().for_each(Vec::clear);
        for y in rows {
            let (above, here, below) = (p.row(y - 1), p.row(y), p.row(y + 1));
            for x in columns.clone() {
                last.push(here[x]);
                gx.push(0.5 * (here[x + 1] - here[x - 1]));
                gy.push(0.5 * (below[x] - above[x]));
            }
        }
    }

    /// Residuals P_t(x + shift) - P_{t-1}(x).
    fn compare(&mut self, p: &Plane, (shift_x, shift_y): (f64, f64)) {
        let (whole_x, whole_y) = (shift_x.floor(), shift_y.floor());
        let (fx, fy) = ((shift_x - whole_x) as f32, (shift_y - whole_y) as f32);
        let Size { height, width } = self.size;
        let (rows, columns) = (self.rows(), self.columns());
        let mut last = self.last.iter();
        self.residuals.clear();
        for y in rows {
            let top = (y as isize + whole_y as isize) as usize;
            let (above, below) = (p.row(top), p.row((top + 1).min(height - 1)));
            for (x, last) in columns.clone().zip(&mut last) {
                let left = (x as isize + whole_x as isize) as usize;
                let right = (left + 1).min(width - 1);
                let upper = above[left] + fx * (above[right] - above[left]);
                let lower = below[left] + fx * (below[right] - below[left]);
                self.residuals.push(upper + fy * (lower - upper) - last);
            }
        }
    }

    /// 1.5 times the median absolute residual.
    fn scale(&mut self) -> f32 {
        (1.5 * self.median.of_absolute(&self.residuals)).max(LEAST_SCALE)
    }

    /// The Gauss-Newton step, with the gradient of the last frame; none where there is no structure.
    fn step(&self, scale: f32) -> Option<(f64, f64)> {
        const LANES: usize = 8;
        // Several sums side by side: a single one would wait for each addition.
        let mut sums = [[0.0f64; LANES]; 6];
        let [gx, gy] = &self.gradient;
        for ((r, gx), gy) in self.residuals.chunks(LANES).zip(gx.chunks(LANES)).zip(gy.chunks(LANES)) {
            for (lane, ((&r, &gx), &gy)) in r.iter().zip(gx).zip(gy).enumerate() {
                let weight = f64::from(1.0 / (1.0 + (r / scale) * (r / scale)));
                let (r, gx, gy) = (f64::from(r), f64::from(gx), f64::from(gy));
                let terms = [gx * gx, gx * gy, gy * gy, gx * r, gy * r, 1.0];
                for (sum, term) in sums.iter_mut().zip(terms) {
                    sum[lane] += weight * term;
                }
            }
        }
        let [xx, xy, yy, bx, by, weights] = sums.map(|lanes| lanes.iter().sum::<f64>());
        let weakest = (0.5 * (xx + yy) - (0.25 * (xx - yy).powi(2) + xy * xy).sqrt()) / weights;
        let determinant = xx * yy - xy * xy;
        (weakest >= STRUCTURE).then(|| ((yy * bx - xy * by) / determinant, (xx * by - xy * bx) / determinant))
    }
}

/// Sum of ln(1 + (r / scale)^2): what the Cauchy weights minimise.
fn cost(residuals: &[f32], scale: f32) -> f64 {
    // Logarithms of products: a factor is at most 1e12, for residuals up to 1 and the least scale.
    const FACTORS: usize = 16;
    let factor = |r: &f32| 1.0 + f64::from((r / scale) * (r / scale));
    residuals.chunks(FACTORS).map(|residuals| residuals.iter().map(factor).product::<f64>().ln()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(size: Size, shift: (f64, f64), target: (usize, usize)) -> Plane {
        let mut plane = Plane::new(size);
        for y in 0..size.height {
            for x in 0..size.width {
                let (u, v) = (x as f64 - shift.0, y as f64 - shift.1);
                let value = 0.5 + 0.2 * (0.31 * u + 0.1 * v).sin() * (0.23 * v).cos() + 0.1 * (0.7 * v - 0.2 * u).sin();
                let on_target = x.abs_diff(target.0) < 3 && y.abs_diff(target.1) < 3;
                plane.row_mut(y)[x] = if on_target { 0.0 } else { value as f32 };
            }
        }
        plane
    }

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn finds_the_shift_behind_a_target_that_moves_otherwise() {
        let size = Size::new(90, 120);
        for (dx, dy) in [(0.25, 0.0), (-0.6, 0.4), (1.5, -1.0), (-2.4, 0.1)] {
            let mut background = Translation::new(size);
            let mut found = (0.0, 0.0);
            for t in 0..6 {
                let shift = (dx * f64::from(t), dy * f64::from(t));
                found = background.process(&picture(size, shift, (40 + t as usize, 50))).0.unwrap();
            }
            // Bilinear interpolation of waves of 9 px and more.
            assert!((found.0 - dx).abs() < 0.02 && (found.1 - dy).abs() < 0.02, "{found:?} {dx} {dy}");
        }
    }

    #[test]
    fn no_shift_without_structure() {
        let size = Size::new(40, 50);
        let mut background = Translation::new(size);
        for t in 0..5 {
            let mut plane = Plane::new(size);
            plane.fill(0.7);
            for y in 18..23 {
                plane.row_mut(y)[15 + t..20 + t].fill(0.0);
            }
            let (x, y) = background.process(&plane).0.unwrap_or((0.0, 0.0));
            // What does not change weighs a million times more than the target's edges.
            assert!(x.abs() < 1e-6 && y.abs() < 1e-6, "{x} {y}");
        }
    }
}
