//! The background's shift from frame to frame: a global translation found by Gauss-Newton on the retina output.
//!
//! Input: P. Output: (x, y) px that the background moved. State: the last P and the last shift. At most 4 iterations on
//! at most 16384 pixels of a regular grid, bilinear, Cauchy weights at 1.5 times the median absolute residual, a margin
//! left out. Where the picture has no structure, or the shift explains it no better than none, it is zero.

use crate::frame::Size;
use crate::memory::heap;
use crate::plane::Plane;

const ITERATIONS: usize = 4;
const MARGIN: usize = 12;
const MOST_SAMPLES: usize = 16384;
/// Least mean squared gradient along the weakest axis, (luminance / px)^2.
const STRUCTURE: f64 = 1e-8;
/// Least scale of the residuals, luminance.
const LEAST_SCALE: f32 = 1e-6;
/// Steps below this end the search, px.
const SETTLED: f64 = 1e-3;

pub(crate) struct Background {
    margin: usize,
    step: usize,
    last: Plane,
    first: bool,
    shift: (f64, f64),
    residuals: Vec<f32>,
    sorted: Vec<f32>,
}

heap!(Background { last, residuals, sorted });

impl Background {
    pub fn new(size: Size) -> Self {
        let least = size.height.min(size.width);
        let margin = if least < 2 * MARGIN + 8 { least / 4 } else { MARGIN };
        let area = (size.height - 2 * margin) * (size.width - 2 * margin);
        let step = ((area as f64 / MOST_SAMPLES as f64).sqrt().ceil() as usize).max(1);
        let samples = (size.height - 2 * margin).div_ceil(step) * (size.width - 2 * margin).div_ceil(step);
        Self {
            margin,
            step,
            last: Plane::new(size),
            first: true,
            shift: (0.0, 0.0),
            residuals: Vec::with_capacity(samples),
            sorted: Vec::with_capacity(samples),
        }
    }

    /// The shift from the last frame to this one.
    pub fn process(&mut self, p: &Plane) -> (f64, f64) {
        self.shift = if std::mem::replace(&mut self.first, false) { (0.0, 0.0) } else { self.estimate(p) };
        for y in 0..p.size().height {
            self.last.row_mut(y).copy_from_slice(p.row(y));
        }
        self.shift
    }

    pub fn reset(&mut self) {
        self.first = true;
        self.shift = (0.0, 0.0);
    }

    fn estimate(&mut self, p: &Plane) -> (f64, f64) {
        self.compare(p, (0.0, 0.0));
        let still = self.scale();
        let cost =
            |residuals: &[f32]| -> f64 { residuals.iter().map(|r| f64::from((r / still) * (r / still)).ln_1p()).sum() };
        let without = cost(&self.residuals);
        let mut shift = self.shift;
        for _ in 0..ITERATIONS {
            self.compare(p, shift);
            let scale = self.scale();
            let Some(step) = self.step(scale) else { return (0.0, 0.0) };
            shift = (shift.0 - step.0, shift.1 - step.1);
            let limit = self.margin as f64 - 1.0;
            if shift.0.abs() > limit || shift.1.abs() > limit {
                return (0.0, 0.0);
            }
            if step.0.hypot(step.1) < SETTLED {
                break;
            }
        }
        self.compare(p, shift);
        if cost(&self.residuals) <= without { shift } else { (0.0, 0.0) }
    }

    fn columns(&self) -> impl Iterator<Item = usize> + use<> {
        (self.margin..self.last.size().width - self.margin).step_by(self.step)
    }

    fn rows(&self) -> impl Iterator<Item = usize> + use<> {
        (self.margin..self.last.size().height - self.margin).step_by(self.step)
    }

    /// Residuals P_t(x + shift) - P_{t-1}(x).
    fn compare(&mut self, p: &Plane, (shift_x, shift_y): (f64, f64)) {
        let (whole_x, whole_y) = (shift_x.floor(), shift_y.floor());
        let (fx, fy) = ((shift_x - whole_x) as f32, (shift_y - whole_y) as f32);
        let height = p.size().height;
        self.residuals.clear();
        for y in self.rows() {
            let top = (y as isize + whole_y as isize) as usize;
            let (above, below) = (p.row(top), p.row((top + 1).min(height - 1)));
            let last = self.last.row(y);
            for x in self.columns() {
                let left = (x as isize + whole_x as isize) as usize;
                let right = (left + 1).min(above.len() - 1);
                let upper = above[left] + fx * (above[right] - above[left]);
                let lower = below[left] + fx * (below[right] - below[left]);
                self.residuals.push(upper + fy * (lower - upper) - last[x]);
            }
        }
    }

    /// 1.5 times the median absolute residual.
    fn scale(&mut self) -> f32 {
        self.sorted.clear();
        self.sorted.extend(self.residuals.iter().map(|r| r.abs()));
        let middle = self.sorted.len() / 2;
        (1.5 * *self.sorted.select_nth_unstable_by(middle, f32::total_cmp).1).max(LEAST_SCALE)
    }

    /// The Gauss-Newton step, with the gradient of the last frame; none where there is no structure.
    fn step(&self, scale: f32) -> Option<(f64, f64)> {
        let (mut xx, mut xy, mut yy, mut bx, mut by, mut weights) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let mut residuals = self.residuals.iter();
        for y in self.rows() {
            let (above, here, below) = (self.last.row(y - 1), self.last.row(y), self.last.row(y + 1));
            for x in self.columns() {
                let r = *residuals.next()?;
                let gx = f64::from(0.5 * (here[x + 1] - here[x - 1]));
                let gy = f64::from(0.5 * (below[x] - above[x]));
                let weight = f64::from(1.0 / (1.0 + (r / scale) * (r / scale)));
                let r = f64::from(r);
                xx += weight * gx * gx;
                xy += weight * gx * gy;
                yy += weight * gy * gy;
                bx += weight * gx * r;
                by += weight * gy * r;
                weights += weight;
            }
        }
        let weakest = (0.5 * (xx + yy) - (0.25 * (xx - yy).powi(2) + xy * xy).sqrt()) / weights;
        let determinant = xx * yy - xy * xy;
        (weakest >= STRUCTURE).then(|| ((yy * bx - xy * by) / determinant, (xx * by - xy * bx) / determinant))
    }
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
    fn finds_the_shift_behind_a_target_that_moves_otherwise() {
        let size = Size::new(90, 120);
        for (dx, dy) in [(0.25, 0.0), (-0.6, 0.4), (1.5, -1.0), (-2.4, 0.1)] {
            let mut background = Background::new(size);
            let mut found = (0.0, 0.0);
            for t in 0..6 {
                let shift = (dx * f64::from(t), dy * f64::from(t));
                found = background.process(&picture(size, shift, (40 + t as usize, 50)));
            }
            // Bilinear interpolation of waves of 9 px and more.
            assert!((found.0 - dx).abs() < 0.02 && (found.1 - dy).abs() < 0.02, "{found:?} {dx} {dy}");
        }
    }

    #[test]
    fn no_shift_without_structure() {
        let size = Size::new(40, 50);
        let mut background = Background::new(size);
        for t in 0..5 {
            let mut plane = Plane::new(size);
            plane.fill(0.7);
            for y in 18..23 {
                plane.row_mut(y)[15 + t..20 + t].fill(0.0);
            }
            let (x, y) = background.process(&plane);
            // What does not change weighs a million times more than the target's edges.
            assert!(x.abs() < 1e-6 && y.abs() < 1e-6, "{x} {y}");
        }
    }
}
