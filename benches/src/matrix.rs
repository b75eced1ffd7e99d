//! Scenes of the matrix: a ground and a camera sampled from textures with the spectrum of natural scenes, and squares that
//! cross them in straight lines, over and over.

use std::f64::consts::TAU;

use apgstmd_core::evaluation::{Options, Scored, TruthBox, evaluate};
use apgstmd_core::stimulus::{Background, Renderer, Scene};
use apgstmd_core::{Bank, BankParams, Machine, Size};
use ndarray::Array2;

/// Frames of a scene.
pub const FRAMES: usize = 150;
/// Those of the beginning that do not count.
const SETTLING: usize = 30;
const SIZE: Size = Size { height: 240, width: 320 };
/// px/frame, relative to the ground.
pub const SPEEDS: [f64; 6] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
const SIZES: [f64; 4] = [3.0, 5.0, 8.0, 15.0];
const CONTRASTS: [f64; 4] = [0.1, 0.2, 0.4, 1.0];
/// Side of the textures, which repeat, px.
const PERIOD: usize = 512;
/// Standard deviation of the noise of a pixel.
const NOISE: f64 = 0.004;
/// False alarms a frame at which rates are given.
const ALARMS: [f64; 2] = [0.1, 1.0];

/// What lies behind the targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ground {
    /// Faint clouds.
    Sky,
    /// Strong clutter; columns of 40 px sway by 1.5 px, each in its own phase, once in 50 frames.
    Foliage,
    /// Two clutters that pass through each other at 0.6 px/frame.
    Sea,
}

impl Ground {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Sky, Self::Foliage, Self::Sea];

    /// In tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sky => "sky",
            Self::Foliage => "foliage",
            Self::Sea => "sea",
        }
    }

    fn mean_and_contrast(self) -> (f64, f64) {
        match self {
            Self::Sky => (0.65, 0.04),
            Self::Foliage => (0.4, 0.15),
            Self::Sea => (0.45, 0.12),
        }
    }
}

/// What the camera does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Camera {
    /// Nothing.
    Still,
    /// Turns by 1.5 px/frame.
    Pan,
    /// Shakes: two oscillations along each axis, of 2 px in 9 and 3 px in 23 frames.
    Shake,
}

impl Camera {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Still, Self::Pan, Self::Shake];

    /// In tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Still => "still",
            Self::Pan => "pan",
            Self::Shake => "shake",
        }
    }

    /// Where it looks, (x, y) px.
    fn at(self, t: usize) -> (f64, f64) {
        let t = t as f64;
        match self {
            Self::Still => (0.0, 0.0),
            Self::Pan => (1.45 * t, 0.4 * t),
            Self::Shake => (
                2.0 * (TAU * t / 9.0).sin() + 3.0 * (TAU * t / 23.0).cos(),
                2.0 * (TAU * t / 9.0 + 1.0).cos() + 3.0 * (TAU * t / 23.0 + 2.0).sin(),
            ),
        }
    }
}

/// One scene.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// What lies behind.
    pub ground: Ground,
    /// What the camera does.
    pub camera: Camera,
    /// Of the targets, px/frame.
    pub speed: f64,
    /// Of all its targets, if they have one: a scene then has one of each size.
    pub contrast: Option<f64>,
    seed: u64,
}

/// What was found of a target.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Side, px.
    pub size: f64,
    /// Weber contrast; it is darker than the ground.
    pub contrast: f64,
    /// Frames in which it was in the picture.
    pub visible: usize,
    /// Share of them in which it was found at 0.1 and 1 false alarms a frame.
    pub rates: [f64; 2],
}

struct Target {
    size: f64,
    contrast: f64,
    start: (f64, f64),
    velocity: (f64, f64),
}

/// All scenes: of each ground and camera every other speed, the others of the next one.
pub fn settings() -> Vec<Setting> {
    let mut all = Vec::new();
    for (g, ground) in Ground::ALL.into_iter().enumerate() {
        for (c, camera) in Camera::ALL.into_iter().enumerate() {
            for (s, speed) in SPEEDS.into_iter().enumerate() {
                if (g + c + s) % 2 == 0 {
                    let seed = 100 + 2 * all.len() as u64 + c as u64 % 2;
                    all.push(Setting { ground, camera, speed, contrast: None, seed });
                }
            }
        }
    }
    all
}

/// The same scenes, each once for every contrast.
pub fn settings_of_one_contrast() -> Vec<Setting> {
    let alone = |setting: Setting| CONTRASTS.map(|contrast| Setting { contrast: Some(contrast), ..setting });
    settings().into_iter().flat_map(alone).collect()
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Standard deviation 1: a sum of uniform numbers is normal enough.
    fn normal(&mut self) -> f64 {
        (0..4).map(|_| self.uniform() - 0.5).sum::<f64>() * 3f64.sqrt()
    }
}

impl Setting {
    /// What a bank without flags finds of each of its targets.
    ///
    /// # Panics
    /// When a scene is not sound.
    pub fn run(&self) -> Vec<Found> {
        let targets = self.targets();
        let textures = [0, 1].map(|layer| self.texture(layer));
        let mut noise = Random(self.seed ^ 0xFFFF);
        let mut bank = Bank::with_options(SIZE, &BankParams::default(), &Machine::with_threads(1)).expect("valid");
        let mut response = bank.make_response();
        let (mut found, mut truth) = (Vec::new(), Vec::new());
        for t in 0..FRAMES {
            let mut frame = self.ground(&textures, t);
            for (id, target) in targets.iter().enumerate() {
                let (x, y) = target.at(t, self.camera.at(t));
                target.draw(&mut frame, x, y);
                // What touches the border is half in the picture.
                let inside = |place: f64, side: usize| (0.0..side as f64 - 1.0).contains(&place);
                if inside(x, SIZE.width) && inside(y, SIZE.height) {
                    let half = target.size / 2.0;
                    let place = [x + 0.5 - half, y + 0.5 - half, target.size, target.size];
                    truth.push(TruthBox { id: Some(id as i64), ..TruthBox::new(t, place) });
                }
            }
            let seen: Array2<u8> =
                frame.mapv(|value| ((value + NOISE * noise.normal()).clamp(0.0, 1.0) * 255.0).round() as u8);
            bank.process_into(seen.view(), &mut response).expect("a valid frame");
            found.extend(response.detections.iter().map(|d| Scored::new(t, d.x.into(), d.y.into(), d.score.into())));
        }
        let options = Options::new(SETTLING..FRAMES);
        let evaluation = evaluate(&found, &truth, &options).expect("a valid table");
        // The lowest score at which there are no more false alarms than that.
        let thresholds = ALARMS.map(|alarms| {
            let within = evaluation.curve.iter().filter(|point| point.false_alarms <= alarms);
            within.map(|point| point.threshold).fold(f64::INFINITY, f64::min)
        });
        targets
            .iter()
            .enumerate()
            .map(|(id, target)| {
                let own: Vec<&TruthBox> =
                    truth.iter().filter(|place| place.id == Some(id as i64) && place.frame >= SETTLING).collect();
                let hit = |place: &TruthBox, least: f64| {
                    let (x, y) = place.center();
                    let near = options.radius.max(0.75 * target.size);
                    found.iter().any(|d| d.frame == place.frame && d.score >= least && (d.x - x).hypot(d.y - y) <= near)
                };
                let rates = thresholds
                    .map(|least| own.iter().filter(|place| hit(place, least)).count() as f64 / own.len().max(1) as f64);
                Found { size: target.size, contrast: target.contrast, visible: own.len(), rates }
            })
            .collect()
    }

    /// Every other pair of size and contrast, or every size with one contrast.
    fn targets(&self) -> Vec<Target> {
        let mut random = Random(self.seed);
        let mut targets = Vec::new();
        for (i, size) in SIZES.into_iter().enumerate() {
            for (j, contrast) in CONTRASTS.into_iter().enumerate() {
                if self.contrast.map_or((i + j) as u64 % 2 != self.seed % 2, |own| own != contrast) {
                    continue;
                }
                let angle = random.uniform() * TAU;
                // Spread over the picture, so that few meet.
                let cell = targets.len();
                let (column, row) = ((cell % 4) as f64, (cell / 4) as f64);
                let start =
                    (80.0 * (column + 0.2 + 0.6 * random.uniform()), 120.0 * (row + 0.2 + 0.6 * random.uniform()));
                let velocity = (self.speed * angle.cos(), self.speed * angle.sin());
                targets.push(Target { size, contrast, start, velocity });
            }
        }
        targets
    }

    /// A static texture of natural statistics.
    fn texture(&self, layer: u64) -> Array2<f32> {
        let (mean, contrast) = self.ground.mean_and_contrast();
        let background = Background::Natural { mean, contrast, velocity: [0.0, 0.0] };
        let seed = 2 * self.seed + layer;
        let scene = Scene { width: PERIOD, height: PERIOD, rate: 1.0, frames: 1, seed, background, ..Scene::default() };
        Renderer::new(&scene).expect("a sound scene").frame(0)
    }

    fn ground(&self, textures: &[Array2<f32>; 2], t: usize) -> Array2<f64> {
        let (left, top) = self.camera.at(t);
        let time = t as f64;
        Array2::from_shape_fn((SIZE.height, SIZE.width), |(y, x)| {
            let (x, y) = (x as f64 + left, y as f64 + top);
            match self.ground {
                Ground::Sky => sample(&textures[0], x, y),
                Ground::Foliage => {
                    let phase = 2.4 * (x / 40.0).floor();
                    sample(&textures[0], x + 1.5 * (TAU * time / 50.0 + phase).sin(), y)
                }
                Ground::Sea => {
                    let waves = [0.6, -0.6].map(|speed| speed * time);
                    0.5 * (sample(&textures[0], x + waves[0], y)
                        + sample(&textures[1], x + waves[1], y + 0.3 * waves[0]))
                }
            }
        })
    }
}

/// Between pixels, repeated.
fn sample(texture: &Array2<f32>, x: f64, y: f64) -> f64 {
    let (left, top) = (x.floor(), y.floor());
    let (fx, fy) = (x - left, y - top);
    let at = |dx: i64, dy: i64| {
        let wrap = |place: i64| place.rem_euclid(PERIOD as i64) as usize;
        f64::from(texture[[wrap(top as i64 + dy), wrap(left as i64 + dx)]])
    };
    let row = |dy| at(0, dy) + fx * (at(1, dy) - at(0, dy));
    row(0) + fy * (row(1) - row(0))
}

impl Target {
    /// Its centre in the picture. Relative to the ground it moves in a line; what has left the picture by 20 px comes in at
    /// the other side.
    fn at(&self, t: usize, (left, top): (f64, f64)) -> (f64, f64) {
        const BEYOND: f64 = 20.0;
        let around = |place: f64, side: usize| (place + BEYOND).rem_euclid(side as f64 + 2.0 * BEYOND) - BEYOND;
        let t = t as f64;
        (
            around(self.start.0 + t * self.velocity.0 - left, SIZE.width),
            around(self.start.1 + t * self.velocity.1 - top, SIZE.height),
        )
    }

    fn draw(&self, frame: &mut Array2<f64>, x: f64, y: f64) {
        let half = self.size / 2.0;
        let covered = |pixel: usize, center: f64| {
            let (first, last) = (pixel as f64 - 0.5, pixel as f64 + 0.5);
            (last.min(center + half) - first.max(center - half)).max(0.0)
        };
        let range = |center: f64, side: usize| {
            let end = (center + half + 2.0).clamp(0.0, side as f64) as usize;
            ((center - half - 1.0).clamp(0.0, side as f64) as usize)..end
        };
        for v in range(y, SIZE.height) {
            for u in range(x, SIZE.width) {
                frame[[v, u]] *= 1.0 - self.contrast * covered(u, x) * covered(v, y);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_of_size_and_contrast_takes_part() {
        let all = settings();
        assert_eq!(all.len(), 27);
        for speed in SPEEDS {
            let of_speed: Vec<Target> = all.iter().filter(|s| s.speed == speed).flat_map(Setting::targets).collect();
            for (size, contrast) in SIZES.into_iter().flat_map(|size| CONTRASTS.map(|contrast| (size, contrast))) {
                assert!(of_speed.iter().any(|target| (target.size, target.contrast) == (size, contrast)));
            }
        }
    }

    #[test]
    fn one_of_each_size_has_the_one_contrast() {
        let all = settings_of_one_contrast();
        assert_eq!(all.len(), 27 * CONTRASTS.len());
        for setting in all {
            let targets = setting.targets();
            assert_eq!(targets.iter().map(|target| target.size).collect::<Vec<_>>(), SIZES);
            assert!(targets.iter().all(|target| Some(target.contrast) == setting.contrast));
        }
    }

    #[test]
    fn targets_are_as_dark_as_they_say_and_move_with_the_ground() {
        let target = Target { size: 5.0, contrast: 0.4, start: (100.0, 50.0), velocity: (2.0, 0.0) };
        let mut frame = Array2::from_elem((SIZE.height, SIZE.width), 0.5);
        target.draw(&mut frame, 100.0, 50.0);
        assert!((frame[[50, 100]] - 0.3).abs() < 1e-12 && frame[[50, 104]] == 0.5);
        assert!((frame.iter().map(|value| 0.5 - value).sum::<f64>() - 25.0 * 0.2).abs() < 1e-9);
        let (x, y) = target.at(10, Camera::Pan.at(10));
        assert!((x - 105.5).abs() < 1e-9 && (y - 46.0).abs() < 1e-9);
        assert!(target.at(125, (0.0, 0.0)).0 < 0.0, "it has left at the right");
    }
}
