//! Small scenes for the suites: rectangles, drawn by exact area coverage, on uniform or wavy moving backgrounds.
//!
//! The suites keep their own renderer, so that they do not lean on the scenes of the program they test.

use apgstmd_core::Size;
use ndarray::Array2;

use crate::naive::map::Map;

/// A rectangle in straight, even motion.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Centre (x, y) in frame 0, px.
    pub start: (f64, f64),
    /// (x, y) px/frame, y downward.
    pub velocity: (f64, f64),
    /// (width, height), px.
    pub size: (f64, f64),
    /// Luminance.
    pub luminance: f64,
}

impl Target {
    /// Centre (x, y) in frame `t`.
    pub fn center(&self, t: usize) -> (f64, f64) {
        (self.start.0 + self.velocity.0 * t as f64, self.start.1 + self.velocity.1 * t as f64)
    }

    /// Share of pixel (x, y) that the target covers in frame `t`.
    pub fn coverage(&self, t: usize, x: usize, y: usize) -> f64 {
        let (cx, cy) = self.center(t);
        let along = |pixel: usize, center: f64, side: f64| {
            let low = (pixel as f64 - 0.5).max(center - side / 2.0);
            let high = (pixel as f64 + 0.5).min(center + side / 2.0);
            (high - low).max(0.0)
        };
        along(x, cx, self.size.0) * along(y, cy, self.size.1)
    }
}

/// What lies behind the targets.
#[derive(Clone, Copy, Debug)]
pub struct Background {
    /// Mean luminance.
    pub luminance: f64,
    /// Amplitude of the waves.
    pub texture: f64,
    /// (x, y) px/frame.
    pub velocity: (f64, f64),
    /// Picks the waves.
    pub seed: u64,
}

impl Background {
    /// The same luminance everywhere.
    pub fn uniform(luminance: f64) -> Self {
        Self { luminance, texture: 0.0, velocity: (0.0, 0.0), seed: 0 }
    }

    /// Six waves of wavelength 5 to 40 px, longer ones stronger; they move by any fraction of a pixel exactly.
    fn at(&self, t: usize, x: usize, y: usize) -> f64 {
        if self.texture == 0.0 {
            return self.luminance;
        }
        let (x, y) = (x as f64 - self.velocity.0 * t as f64, y as f64 - self.velocity.1 * t as f64);
        let mut sum = 0.0;
        for wave in 0..6 {
            let wavelength = 5.0 * 8f64.powf(unit(self.seed, 3 * wave));
            let (sin, cos) = (std::f64::consts::TAU * unit(self.seed, 3 * wave + 1)).sin_cos();
            let phase = std::f64::consts::TAU * unit(self.seed, 3 * wave + 2);
            sum += wavelength / 40.0 * (std::f64::consts::TAU / wavelength * (cos * x + sin * y) + phase).sin();
        }
        (self.luminance + self.texture * sum).clamp(0.0, 1.0)
    }
}

/// Number `index` of a stream in [0, 1): splitmix64.
fn unit(seed: u64, index: u64) -> f64 {
    let mut z = seed.wrapping_add((index + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// A scene; frame t is a function of t.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Rows and columns.
    pub size: Size,
    /// Behind everything.
    pub background: Background,
    /// Later ones hide earlier ones.
    pub targets: Vec<Target>,
}

impl Scene {
    /// Luminance of frame `t`, exact.
    pub fn luminance(&self, t: usize) -> Map {
        Map::from_shape_fn((self.size.height, self.size.width), |(y, x)| {
            let behind = self.background.at(t, x, y);
            self.targets.iter().fold(behind, |behind, target| {
                let share = target.coverage(t, x, y);
                share * target.luminance + (1.0 - share) * behind
            })
        })
    }

    /// Frame `t` as a camera gives it.
    pub fn frame(&self, t: usize) -> Array2<u8> {
        self.luminance(t).mapv(|v| (v * 255.0).round() as u8)
    }

    /// A dark and a bright target crossing a texture that itself moves; `speed` in px/frame.
    pub fn lively(size: Size, speed: f64, seed: u64) -> Self {
        let (height, width) = (size.height as f64, size.width as f64);
        let background = Background { luminance: 0.5, texture: 0.15, velocity: (0.3 * speed, -0.1 * speed), seed };
        let dark =
            Target { start: (2.0, 0.35 * height), velocity: (speed, 0.15 * speed), size: (4.0, 3.5), luminance: 0.0 };
        let bright = Target {
            start: (width - 2.0, 0.7 * height),
            velocity: (-speed, -0.1 * speed),
            size: (4.0, 4.0),
            luminance: 1.0,
        };
        Self { size, background, targets: vec![dark, bright] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_covers_its_area_wherever_it_stands() {
        for (x, y, size) in [(10.0, 8.0, (5.0, 5.0)), (9.37, 8.81, (3.2, 6.7)), (10.5, 7.25, (0.4, 0.3))] {
            let target = Target { start: (x, y), velocity: (0.25, 0.0), size, luminance: 1.0 };
            let scene = Scene { size: Size::new(18, 22), background: Background::uniform(0.0), targets: vec![target] };
            assert!((scene.luminance(3).sum() - size.0 * size.1).abs() < 1e-12);
        }
    }

    #[test]
    fn a_background_moves_as_one() {
        let background = Background { luminance: 0.5, texture: 0.1, velocity: (1.0, -2.0), seed: 7 };
        assert!((background.at(3, 9, 4) - background.at(0, 6, 10)).abs() < 1e-12);
    }
}
