//! A picture that can be read between its pixels: cubic B-spline interpolation, which passes through the samples and
//! keeps fine detail almost independent of the sub-pixel phase, so that a moving background does not breathe.

use ndarray::{Array2, ArrayViewMut1};

use super::draw::Window;

/// What lies beyond the upper and lower edge; beyond left and right the picture always repeats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Vertical {
    Repeat,
    Mirror,
}

#[derive(Clone, Debug)]
pub(super) struct Texture {
    coefficients: Array2<f32>,
    /// Samples per pixel, down and across.
    density: usize,
    vertical: Vertical,
}

/// Taps on each side of the inverse B-spline filter: its pole is sqrt(3) - 2, and 0.268^16 is below f32 rounding.
const REACH: usize = 16;

impl Texture {
    pub fn new(samples: &Array2<f64>, density: usize, vertical: Vertical) -> Self {
        let (height, width) = samples.dim();
        let taps = inverse_taps();
        let mut rows = samples.clone();
        let across = |index| wrap(index, width);
        rows.rows_mut().into_iter().for_each(|row| filter(row, &taps, across));
        let down = |index| beyond(index, height, vertical);
        rows.columns_mut().into_iter().for_each(|column| filter(column, &taps, down));
        let coefficients = rows.mapv(|value| value as f32);
        Self { coefficients, density, vertical }
    }

    /// Fills `into` with the part of the picture in `window`, the picture being moved by `shift` (right, down) px.
    pub fn paint(&self, window: Window, shift: (f64, f64), into: &mut Array2<f32>) {
        let (height, width) = self.coefficients.dim();
        let (x0, across) = phase(window.left as f64 - shift.0, self.density);
        let (y0, down) = phase(window.top as f64 - shift.1, self.density);
        let mut blended = vec![0f32; self.density * window.width + 3];
        for (i, mut out) in into.rows_mut().into_iter().enumerate() {
            let lines: [_; 4] = std::array::from_fn(|k| {
                let y = beyond(y0 + (i * self.density + k) as i64 - 1, height, self.vertical);
                self.coefficients.row(y)
            });
            let mut x = wrap(x0 - 1, width);
            for value in &mut blended {
                *value = down[0] * lines[0][x] + down[1] * lines[1][x] + down[2] * lines[2][x] + down[3] * lines[3][x];
                x = if x + 1 == width { 0 } else { x + 1 };
            }
            for (out, near) in out.iter_mut().zip(blended.windows(4).step_by(self.density)) {
                let value = across[0] * near[0] + across[1] * near[1] + across[2] * near[2] + across[3] * near[3];
                *out = value.clamp(0.0, 1.0);
            }
        }
    }

    /// The picture at a place, px.
    pub fn at(&self, x: f64, y: f64) -> f32 {
        let (height, width) = self.coefficients.dim();
        let ((x0, across), (y0, down)) = (phase(x, self.density), phase(y, self.density));
        let columns: [usize; 4] = std::array::from_fn(|k| wrap(x0 + k as i64 - 1, width));
        let mut value = 0.0;
        for (k, down) in down.iter().enumerate() {
            let line = self.coefficients.row(beyond(y0 + k as i64 - 1, height, self.vertical));
            value += down * columns.iter().zip(across).map(|(x, across)| across * line[*x]).sum::<f32>();
        }
        value.clamp(0.0, 1.0)
    }
}

/// The filter that undoes B-spline weighting, from its middle tap outward.
fn inverse_taps() -> Vec<f64> {
    let pole = 3f64.sqrt() - 2.0;
    let middle = -6.0 * pole / (1.0 - pole * pole);
    std::iter::successors(Some(middle), |tap| Some(tap * pole)).take(REACH + 1).collect()
}

/// Filters a line in place; `index` says which sample stands beyond its ends.
fn filter(mut line: ArrayViewMut1<'_, f64>, taps: &[f64], index: impl Fn(i64) -> usize) {
    let reach = REACH as i64;
    let long: Vec<f64> = (-reach..line.len() as i64 + reach).map(|i| line[index(i)]).collect();
    for (i, out) in line.iter_mut().enumerate() {
        let middle = i + REACH;
        *out = (1..=REACH).fold(taps[0] * long[middle], |sum, k| sum + taps[k] * (long[middle - k] + long[middle + k]));
    }
}

/// The sample before a place in px, and the weights of the four samples at -1, 0, 1, 2 around it. Places are rounded to
/// 2^-16 px, so that rounding of velocity times time never looks like motion.
fn phase(place: f64, density: usize) -> (i64, [f32; 4]) {
    let place = (place * 65536.0).round() / 65536.0 * density as f64;
    let whole = place.floor();
    let f = place - whole;
    let g = 1.0 - f;
    let weights = [
        g * g * g / 6.0,
        (4.0 + f * f * (3.0 * f - 6.0)) / 6.0,
        (4.0 + g * g * (3.0 * g - 6.0)) / 6.0,
        f * f * f / 6.0,
    ];
    (whole as i64, weights.map(|w| w as f32))
}

fn wrap(index: i64, length: usize) -> usize {
    index.rem_euclid(length as i64) as usize
}

fn beyond(index: i64, length: usize, rule: Vertical) -> usize {
    match rule {
        Vertical::Repeat => wrap(index, length),
        Vertical::Mirror => {
            let folded = wrap(index, 2 * length);
            folded.min(2 * length - 1 - folded)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: Window = Window { top: 0, left: 0, height: 12, width: 16 };

    fn painted(texture: &Texture, shift: (f64, f64)) -> Array2<f32> {
        let mut into = Array2::zeros((WINDOW.height, WINDOW.width));
        texture.paint(WINDOW, shift, &mut into);
        into
    }

    fn rough(height: usize, width: usize) -> Array2<f64> {
        Array2::from_shape_fn((height, width), |(y, x)| ((7 * x * x + 13 * y * y + x * y) % 97) as f64 / 96.0)
    }

    #[test]
    fn passes_through_the_samples_and_repeats() {
        let samples = rough(12, 16);
        let texture = Texture::new(&samples, 1, Vertical::Repeat);
        let at_rest = painted(&texture, (0.0, 0.0));
        // f32 coefficients up to 3 in size, four of them.
        assert!(at_rest.iter().zip(&samples).all(|(a, b)| (f64::from(*a) - b).abs() < 1e-6));
        assert_eq!(painted(&texture, (16.0, -24.0)), at_rest);
        let moved = painted(&texture, (3.0, 2.0));
        assert!(moved.indexed_iter().all(|((y, x), v)| *v == at_rest[[(y + 10) % 12, (x + 13) % 16]]));
    }

    #[test]
    fn mirror_meets_itself_at_the_edge() {
        let samples = rough(5, 16);
        let shown = painted(&Texture::new(&samples, 1, Vertical::Mirror), (0.0, 5.0));
        // The four terms are added in the other order: f32 rounding.
        assert!((0..5).all(|i| (0..16).all(|x| (shown[[4 - i, x]] - shown[[5 + i, x]]).abs() < 1e-6)));
    }

    #[test]
    fn a_wave_moves_between_pixels() {
        let wave = |x: f64, period: f64| 0.5 + 0.4 * libm::cos(std::f64::consts::TAU * x / period);
        // Cubic splines err by about (pi f)^4 / 10 of the amplitude at f cycles per sample.
        for (period, density, bound) in [(8.0, 1, 2e-3), (8.0, 2, 1e-4), (4.0, 2, 2e-3)] {
            let sample = |(_, x): (usize, usize)| wave(x as f64 / density as f64, period);
            let texture = Texture::new(&Array2::from_shape_fn((4, 16 * density), sample), density, Vertical::Repeat);
            for shift in [0.25, 0.5, -3.3] {
                let shown = painted(&texture, (shift, 0.7));
                let error =
                    |((_, x), v): ((usize, usize), &f32)| (f64::from(*v) - wave(x as f64 - shift, period)).abs();
                let worst = shown.indexed_iter().map(error).fold(0.0, f64::max);
                assert!(worst < bound, "{period} px, {density} samples: {worst}");
            }
        }
    }
}
