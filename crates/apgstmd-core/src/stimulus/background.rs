//! Backgrounds, and the procedural natural one: Gaussian noise whose amplitude spectrum falls as 1/f.

use ndarray::Array2;

use super::camera::Pose;
use super::draw::Window;
use super::fourier::{Complex, Sign, transform_2d};
use super::random::Random;
use super::texture::{Texture, Vertical};

/// Longest period of the procedural background, px.
const MOST_PERIOD: usize = 2048;
/// Samples per pixel of the procedural background: with two, interpolation keeps all of its detail wherever it moves.
const DENSITY: usize = 2;

#[derive(Clone, Debug)]
pub(super) enum Ground {
    Uniform(f32),
    /// A texture that moves by so many px a second (right, down).
    Moving(Box<Texture>, [f64; 2]),
}

impl Ground {
    pub fn paint(&self, window: Window, seconds: f64, into: &mut Array2<f32>) {
        match self {
            Self::Uniform(luminance) => into.fill(*luminance),
            Self::Moving(texture, [right, down]) => texture.paint(window, (right * seconds, down * seconds), into),
        }
    }

    /// (right, down), px a second.
    pub fn velocity(&self) -> [f64; 2] {
        match self {
            Self::Uniform(_) => [0.0; 2],
            Self::Moving(_, velocity) => *velocity,
        }
    }

    /// The same, turned and enlarged about the middle of the picture, then shifted.
    pub fn paint_posed(&self, window: Window, seconds: f64, middle: (f64, f64), pose: Pose, into: &mut Array2<f32>) {
        match self {
            Self::Uniform(luminance) => into.fill(*luminance),
            Self::Moving(texture, [right, down]) => {
                let pose = Pose { shift: (pose.shift.0 + right * seconds, pose.shift.1 + down * seconds), ..pose };
                for (y, mut row) in into.rows_mut().into_iter().enumerate() {
                    for (x, value) in row.iter_mut().enumerate() {
                        let place = ((window.left + x as i64) as f64, (window.top + y as i64) as f64);
                        let (u, v) = pose.undo((place.0 - middle.0, place.1 - middle.1));
                        *value = texture.at(middle.0 + u, middle.1 + v);
                    }
                }
            }
        }
    }
}

/// The natural background for scenes of this size.
pub(super) fn natural(height: usize, width: usize, seed: u64, mean: f64, contrast: f64) -> Texture {
    let period = |side: usize| DENSITY * side.next_power_of_two().min(MOST_PERIOD);
    let clutter = clutter(period(height), period(width), seed);
    Texture::new(&toned(clutter, mean, contrast), DENSITY, Vertical::Repeat)
}

/// Periodic noise of zero mean and unit variance with power 1/f^2, with so many samples down and across.
fn clutter(height: usize, width: usize, seed: u64) -> Array2<f64> {
    let mut random = Random::new(seed, 0);
    let mut plane: Vec<Complex> = (0..height * width).map(|_| (random.normal(), 0.0)).collect();
    transform_2d(&mut plane, height, width, Sign::Forward);
    for (i, value) in plane.iter_mut().enumerate() {
        let frequency = libm::hypot(cycles(i / width, height), cycles(i % width, width));
        let gain = if frequency == 0.0 { 0.0 } else { lens(frequency) / frequency };
        *value = (value.0 * gain, value.1 * gain);
    }
    transform_2d(&mut plane, height, width, Sign::Backward);
    let power: f64 = plane.iter().map(|value| value.0 * value.0).sum::<f64>() / plane.len() as f64;
    let scale = if power > 0.0 { 1.0 / power.sqrt() } else { 0.0 };
    Array2::from_shape_fn((height, width), |(y, x)| plane[y * width + x].0 * scale)
}

/// Cycles per pixel of an entry of the spectrum.
fn cycles(index: usize, length: usize) -> f64 {
    let signed = if 2 * index > length { index as f64 - length as f64 } else { index as f64 };
    signed * DENSITY as f64 / length as f64
}

/// What a lens leaves of a frequency: everything to 0.45 cycles/px, nothing from 0.5 on, beyond which pixels cannot
/// tell which way a grating moves.
fn lens(frequency: f64) -> f64 {
    let (from, to) = (0.45, 0.5);
    if frequency <= from {
        1.0
    } else if frequency < to {
        0.5 + 0.5 * libm::cos(std::f64::consts::PI * (frequency - from) / (to - from))
    } else {
        0.0
    }
}

/// Gives zero-mean noise the mean and standard deviation asked for, squeezed into (0, 1).
fn toned(noise: Array2<f64>, mean: f64, contrast: f64) -> Array2<f64> {
    let count = noise.len() as f64;
    let (mut offset, mut gain) = (mean, contrast);
    // Squeezing lowers the contrast and shifts the mean a little: each round corrects what the last one missed.
    for _ in 0..8 {
        let sums = noise.iter().map(|v| squeezed(offset + gain * v)).fold((0.0, 0.0), |s, v| (s.0 + v, s.1 + v * v));
        let got_mean = sums.0 / count;
        let got_power = sums.1 / count - got_mean * got_mean;
        offset += mean - got_mean;
        if got_power > 0.0 {
            gain *= contrast / got_power.sqrt();
        }
    }
    noise.mapv_into(|v| squeezed(offset + gain * v))
}

/// The identity in [0.1, 0.9], smoothly approaching 0 and 1 beyond.
fn squeezed(value: f64) -> f64 {
    let margin = 0.1;
    let upper = |v: f64| {
        let over = v - (1.0 - margin);
        if over > 0.0 { 1.0 - margin * libm::exp(-over / margin) } else { v }
    };
    if value < 0.5 { 1.0 - upper(1.0 - value) } else { upper(value) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean and standard deviation.
    fn moments(plane: &Array2<f64>) -> (f64, f64) {
        let mean = plane.mean().unwrap();
        (mean, plane.mapv(|v| (v - mean).powi(2)).mean().unwrap().sqrt())
    }

    /// One period as it is drawn, moved by a part of a pixel.
    fn drawn(height: usize, width: usize, seed: u64, mean: f64, contrast: f64) -> Array2<f64> {
        let mut into = Array2::zeros((height, width));
        let window = Window { top: 0, left: 0, height, width };
        natural(height, width, seed, mean, contrast).paint(window, (0.5, 0.3), &mut into);
        into.mapv(f64::from)
    }

    /// Exponent of the radially averaged power spectrum between 0.01 and 0.45 cycles/px.
    fn slope(plane: &Array2<f64>) -> f64 {
        let (height, width) = plane.dim();
        let mut spectrum: Vec<Complex> = plane.iter().map(|v| (*v, 0.0)).collect();
        transform_2d(&mut spectrum, height, width, Sign::Forward);
        let bins = 16;
        let (low, high) = (0.01f64.ln(), 0.45f64.ln());
        let mut sums = vec![(0.0, 0.0, 0.0); bins];
        for (i, value) in spectrum.iter().enumerate() {
            let cycles = |index, length| cycles(index, length) / DENSITY as f64;
            let f = cycles(i / width, height).hypot(cycles(i % width, width)).ln();
            if f >= low && f < high {
                let sum = &mut sums[((f - low) / (high - low) * bins as f64) as usize];
                *sum = (sum.0 + 1.0, sum.1 + f, sum.2 + value.0 * value.0 + value.1 * value.1);
            }
        }
        let points: Vec<(f64, f64)> =
            sums.iter().filter(|s| s.0 > 0.0).map(|s| (s.1 / s.0, (s.2 / s.0).ln())).collect();
        let n = points.len() as f64;
        let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
        let cross: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
        cross / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>()
    }

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn spectrum_mean_and_contrast() {
        for (height, width, seed) in [(256, 512, 1), (256, 256, 2), (512, 512, 3)] {
            for (mean, contrast) in [(0.5, 0.15), (0.5, 0.22), (0.35, 0.15)] {
                let plane = drawn(height, width, seed, mean, contrast);
                let (got_mean, got_contrast) = moments(&plane);
                assert!((got_mean - mean).abs() < 1e-3 && (got_contrast - contrast).abs() < 1e-3);
                assert!(plane.iter().all(|v| (0.0..=1.0).contains(v)));
                // 16 bins of 20 to 20 000 random amplitudes scatter the fit by about 0.05.
                let slope = slope(&plane);
                assert!((slope + 2.0).abs() < 0.15, "{height} x {width}, {mean}, {contrast}: {slope}");
            }
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn seeds_matter() {
        assert_eq!(clutter(32, 32, 4), clutter(32, 32, 4));
        assert_ne!(clutter(32, 32, 4), clutter(32, 32, 5));
    }

    #[test]
    fn tiny_periods() {
        for (height, width) in [(1, 1), (1, 8), (2, 1)] {
            assert!(toned(clutter(height, width, 1), 0.5, 0.1).iter().all(|v| v.is_finite()));
        }
    }
}
