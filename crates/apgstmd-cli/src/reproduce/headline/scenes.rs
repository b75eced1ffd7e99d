//! Scenes of the headline: what differs between them, and the scene of each.

use std::f64::consts::TAU;

use apgstmd_core::stimulus::{Background, Path, Scene, Shade, Target};

use crate::reproduce::Extent;

/// The speed that every model is tuned to, px/frame.
pub const TUNED: f64 = 1.0;
/// Frames left out at the beginning: no model can have found anything yet.
pub const SETTLING: usize = 40;
const FRAMES: usize = 240;
const SIZE: (usize, usize) = (256, 192);
const TARGETS: usize = 3;

/// What lies behind the targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clutter {
    /// Noise with the power spectrum of natural scenes.
    Natural,
    /// Sky, ridges and foliage.
    Panorama,
}

impl Clutter {
    /// In tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Natural => "natural",
            Self::Panorama => "panorama",
        }
    }
}

/// What differs between scenes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    pub clutter: Clutter,
    /// Weber contrast of the targets.
    pub contrast: f64,
    /// Speed of the background, px/frame.
    pub background: f64,
    /// Speed of the targets, px/frame.
    pub speed: f64,
    pub seed: u64,
}

/// Scenes to report on: seeds on which nothing was chosen.
pub fn reported(extent: Extent) -> Vec<Setting> {
    match extent {
        Extent::Quick => all(&[0.2, 0.3], &[1.0], &[TUNED], 6..=7),
        Extent::Full => all(&[0.05, 0.1, 0.2, 0.3, 0.6], &[0.3, 1.0], &[0.7, TUNED, 1.4], 6..=10),
    }
}

/// Scenes to choose settings on.
pub fn chosen_on(extent: Extent) -> Vec<Setting> {
    match extent {
        Extent::Quick => all(&[0.2], &[1.0], &[TUNED], 1..=1),
        Extent::Full => all(&[0.1, 0.2], &[0.3, 1.0], &[TUNED], 1..=3),
    }
}

fn all(contrasts: &[f64], backgrounds: &[f64], speeds: &[f64], seeds: std::ops::RangeInclusive<u64>) -> Vec<Setting> {
    let mut settings = Vec::new();
    for clutter in [Clutter::Natural, Clutter::Panorama] {
        for &contrast in contrasts {
            for &background in backgrounds {
                for &speed in speeds {
                    settings.extend(seeds.clone().map(|seed| Setting { clutter, contrast, background, speed, seed }));
                }
            }
        }
    }
    settings
}

impl Setting {
    /// The scene: targets cross the middle in the middle of the clip, at least a quarter turn off the background's way.
    pub fn scene(&self) -> Scene {
        let mut random = Random(self.seed);
        let away = random.uniform() * TAU;
        let drift = [self.background * away.cos(), -self.background * away.sin()];
        let (width, height) = (SIZE.0 as f64, SIZE.1 as f64);
        let path = self.speed * FRAMES as f64;
        let targets = (0..TARGETS).map(|i| {
            let direction = away + (0.25 + 0.5 * random.uniform()) * TAU;
            let x = width * (0.35 + 0.3 * random.uniform());
            let y = height * (0.2 + 0.3 * i as f64 + 0.1 * (random.uniform() - 0.5));
            let start = [x - 0.5 * path * direction.cos(), y + 0.5 * path * direction.sin()];
            let path = Path::Straight { start, speed: self.speed, direction };
            Target { shade: Shade::Dark(self.contrast), ..Target::new(path) }
        });
        Scene {
            width: SIZE.0,
            height: SIZE.1,
            rate: 1.0,
            frames: FRAMES,
            seed: self.seed,
            noise: 0.004,
            targets: targets.collect(),
            background: match self.clutter {
                Clutter::Natural => Background::Natural { mean: 0.5, contrast: 0.15, velocity: drift },
                Clutter::Panorama => Background::Panorama { file: String::new(), velocity: drift },
            },
            ..Scene::default()
        }
    }
}

/// SplitMix64.
pub struct Random(pub u64);

impl Random {
    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_is_sound_and_has_its_targets_in_view() {
        for extent in [Extent::Quick, Extent::Full] {
            for setting in reported(extent).into_iter().chain(chosen_on(extent)) {
                let scene = setting.scene();
                scene.validate().unwrap();
                let middle = scene.frames as f64 / 2.0;
                for target in &scene.targets {
                    let (x, y) = target.path.at(middle);
                    assert!((0.0..SIZE.0 as f64).contains(&x) && (0.0..SIZE.1 as f64).contains(&y));
                }
            }
        }
    }

    #[test]
    fn seeds_matter() {
        let setting = reported(Extent::Full)[0];
        assert_ne!(setting.scene().targets, Setting { seed: setting.seed + 1, ..setting }.scene().targets);
    }
}
