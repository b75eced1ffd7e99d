//! The background's motion and cuts of the scene, from `docs/motion.md`, section by section.

use apgstmd_core::Params;
use apgstmd_core::params::{BackgroundMotion, RejectionMode};

use super::map::Map;
use super::shift::background_shift;

/// A place at (u, v) from the middle moves by shift + (stretch u - turn v, turn u + stretch v).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// (x, y), px.
    pub shift: (f64, f64),
    /// zoom cos(rotation) - 1.
    pub stretch: f64,
    /// -zoom sin(rotation).
    pub turn: f64,
}

impl Motion {
    /// None.
    pub const NONE: Self = Self { shift: (0.0, 0.0), stretch: 0.0, turn: 0.0 };

    /// From the rotation, counter-clockwise on the screen, and the zoom.
    pub fn new(shift: (f64, f64), rotation: f64, zoom: f64) -> Self {
        Self { shift, stretch: zoom * rotation.cos() - 1.0, turn: -zoom * rotation.sin() }
    }

    /// Where a place goes, in a picture with this middle.
    pub fn carry(&self, (x, y): (f64, f64), middle: (f64, f64)) -> (f64, f64) {
        let (u, v) = (x - middle.0, y - middle.1);
        (x + self.shift.0 + self.stretch * u - self.turn * v, y + self.shift.1 + self.turn * u + self.stretch * v)
    }
}

/// Middle of a picture of so many rows and columns, (x, y).
pub fn middle((height, width): (usize, usize)) -> (f64, f64) {
    ((width as f64 - 1.0) / 2.0, (height as f64 - 1.0) / 2.0)
}

/// What a frame tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Since the last frame.
    pub motion: Motion,
    /// 1.5 times the steep median absolute residual.
    pub residual: f64,
    /// No motion was found.
    pub unexplained: bool,
    /// The scene was cut before this frame.
    pub cut: bool,
}

/// Nothing to tell.
const NOTHING: Found = Found { motion: Motion::NONE, residual: 0.0, unexplained: false, cut: false };

/// On a level: motion in its px, and the step of luminance.
#[derive(Clone, Copy)]
struct Guess {
    motion: Motion,
    step: f64,
}

struct Level {
    /// Of the full picture.
    full: (usize, usize),
    halvings: u32,
    every: usize,
    margin: usize,
}

/// What is kept from frame to frame.
#[derive(Default)]
pub struct Background {
    last: Option<Map>,
    /// The coarsest level's own last motion.
    coarse: Option<Motion>,
    usual: Option<f64>,
    /// Translation: where the next search begins.
    pub shift: (f64, f64),
}

impl Background {
    /// The next frame.
    pub fn step(&mut self, p: &Map, params: &Params) -> Found {
        let found = match (&self.last, params.rejection.mode, params.rejection.background) {
            (Some(last), RejectionMode::Motion, BackgroundMotion::Translation) => {
                let shift = background_shift(last, p, self.shift);
                self.shift = shift;
                Found { motion: Motion { shift, ..Motion::NONE }, ..NOTHING }
            }
            (Some(last), RejectionMode::Motion, BackgroundMotion::Similarity) => self.similarity(&last.clone(), p),
            _ => NOTHING,
        };
        self.last = Some(p.clone());
        found
    }

    fn similarity(&mut self, last: &Map, now: &Map) -> Found {
        let full = now.dim();
        let halvings = (0..).take_while(|k| full.0.min(full.1) >> k >= 48).count() as u32;
        let margin = |k: u32| (4 >> k).max(1);
        let coarsest = Level { full, halvings, every: 1, margin: margin(halvings) };
        let (small_last, small_now) = (halved(last, halvings), halved(now, halvings));
        let (dark, light) = (median(small_last.iter().copied()), median(small_now.iter().copied()));
        let spread = |map: &Map, middle: f64| median(map.iter().map(|v| (v - middle).abs()));
        let spread = spread(&small_last, dark).max(spread(&small_now, light));

        // The coarsest level: where to start, what it comes to, whether that is a cut.
        let begin = Guess { motion: Motion::NONE, step: light - dark };
        let again = Guess { motion: self.coarse.unwrap_or(Motion::NONE), ..begin };
        let cost = |guess: &Guess| mean_absolute(&coarsest.residuals(&small_last, &small_now, guess));
        let (mut start, mut least) =
            if cost(&again) <= cost(&begin) { (again, cost(&again)) } else { (begin, cost(&begin)) };
        least *= 0.8;
        for dy in -4..=4 {
            for dx in -4..=4 {
                let whole = Guess { motion: Motion { shift: (f64::from(dx), f64::from(dy)), ..Motion::NONE }, ..begin };
                if cost(&whole) < least {
                    (start, least) = (whole, cost(&whole));
                }
            }
        }
        self.coarse = None;
        let found = coarsest.descend(&small_last, &small_now, start, 8, 2e-2);
        let residuals = coarsest.residuals(&small_last, &small_now, &found.unwrap_or(begin));
        let left = median_of(&residuals);
        if left > 0.5 * spread && left > 0.01 && self.usual.is_some_and(|usual| left > 4.0 * usual) {
            self.usual = None;
            return Found { cut: true, ..NOTHING };
        }
        self.usual = Some(self.usual.map_or(left, |usual| 0.9 * usual + 0.1 * left));
        let from_dark: Vec<Option<f64>> =
            coarsest.samples(small_last.dim()).iter().map(|&place| Some(small_last[place] - dark)).collect();
        let steep = |values: &[Option<f64>]| coarsest.steep_median(&small_last, values);
        let mut found = found.filter(|_| steep(&residuals) <= 0.5 * steep(&from_dark));
        self.coarse = found.map(|guess| guess.motion);

        // Finer and finer.
        let mut from = halvings;
        for k in (0..halvings.max(1)).rev() {
            let (most, iterations, settled) = if k == 0 { (8192.0, 3, 1e-3) } else { (4096.0, 2, 2e-2) };
            let (height, width) = ((full.0 >> k) - 2 * margin(k), (full.1 >> k) - 2 * margin(k));
            let every = ((height * width) as f64 / most).sqrt().ceil() as usize;
            let level = Level { full, halvings: k, every, margin: margin(k) };
            let (last, now) = (halved(last, k), halved(now, k));
            let larger = f64::from(1u32 << (from - k));
            from = k;
            found = found.and_then(|guess| {
                let shift = (larger * guess.motion.shift.0, larger * guess.motion.shift.1);
                level.descend(
                    &last,
                    &now,
                    Guess { motion: Motion { shift, ..guess.motion }, ..guess },
                    iterations,
                    settled,
                )
            });
            if k == 0 {
                let none = Guess { motion: Motion::NONE, step: found.map_or(begin.step, |guess| guess.step) };
                let still = level.steep_median(&last, &level.residuals(&last, &now, &none));
                if let Some(guess) = found.filter(|_| level.has_structure(&last)) {
                    let left = level.steep_median(&last, &level.residuals(&last, &now, &guess));
                    if left <= 1.05 * still || 1.5 * left <= 1e-6 {
                        return Found { motion: guess.motion, residual: (1.5 * left).max(1e-6), ..NOTHING };
                    }
                }
                return Found { residual: (1.5 * still).max(1e-6), unexplained: true, ..NOTHING };
            }
        }
        unreachable!("the finest level returns")
    }
}

impl Level {
    /// Middle of the full picture, px of this level.
    fn middle(&self) -> (f64, f64) {
        let shrunk = f64::from(1u32 << self.halvings);
        let (x, y) = middle(self.full);
        ((x + 0.5) / shrunk - 0.5, (y + 0.5) / shrunk - 0.5)
    }

    fn samples(&self, (height, width): (usize, usize)) -> Vec<(usize, usize)> {
        let mut samples = Vec::new();
        for y in (self.margin..height - self.margin).step_by(self.every) {
            for x in (self.margin..width - self.margin).step_by(self.every) {
                samples.push((y, x));
            }
        }
        samples
    }

    /// |g_x| + |g_y| at the samples.
    fn steepness(&self, last: &Map) -> Vec<f64> {
        let steep = |&(y, x): &(usize, usize)| {
            let (gx, gy) = (last[[y, x + 1]] - last[[y, x - 1]], last[[y + 1, x]] - last[[y - 1, x]]);
            (gx.abs() + gy.abs()) / 2.0
        };
        self.samples(last.dim()).iter().map(steep).collect()
    }

    /// At a fifth of the samples or more, or at a fiftieth and in half of the columns.
    fn has_structure(&self, last: &Map) -> bool {
        let steep: Vec<bool> = self.steepness(last).iter().map(|g| *g > 1.0 / 1024.0).collect();
        let mut columns: Vec<usize> = self.samples(last.dim()).iter().map(|(_, x)| *x).collect();
        let mut with: Vec<usize> = columns.iter().zip(&steep).filter(|(_, steep)| **steep).map(|(x, _)| *x).collect();
        let many = with.len();
        for list in [&mut columns, &mut with] {
            list.sort_unstable();
            list.dedup();
        }
        5 * many >= steep.len() || (50 * many >= steep.len() && 2 * with.len() >= columns.len())
    }

    /// The least |r| that has half of the steepness at or below it, and more.
    fn steep_median(&self, last: &Map, residuals: &[Option<f64>]) -> f64 {
        let steepness = self.steepness(last);
        let mut weighed: Vec<(f64, f64)> =
            residuals.iter().zip(steepness).filter_map(|(r, g)| Some((r.as_ref()?.abs(), g))).collect();
        weighed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let half = weighed.iter().map(|(_, g)| g).sum::<f64>() / 2.0;
        let mut below = 0.0;
        for (r, g) in weighed {
            below += g;
            if below > half {
                return r;
            }
        }
        0.0
    }

    /// P_t(x + m(x)) - P_{t-1}(x) - step; none where x + m(x) is outside.
    fn residuals(&self, last: &Map, now: &Map, guess: &Guess) -> Vec<Option<f64>> {
        let (height, width) = now.dim();
        let residual = |&(y, x): &(usize, usize)| {
            let (u, v) = guess.motion.carry((x as f64, y as f64), self.middle());
            let inside = u >= 0.0 && v >= 0.0 && u <= width as f64 - 1.0 && v <= height as f64 - 1.0;
            inside.then(|| bilinear(now, u, v) - last[[y, x]] - guess.step)
        };
        self.samples(now.dim()).iter().map(residual).collect()
    }

    #[allow(clippy::needless_range_loop, reason = "rows and columns of a matrix read best as such")]
    fn descend(&self, last: &Map, now: &Map, start: Guess, iterations: usize, settled: f64) -> Option<Guess> {
        let (height, width) = now.dim();
        let (half, middle) = (height.max(width) as f64 / 2.0, self.middle());
        let farthest = 0.25 * height.min(width) as f64;
        let mut guess = start;
        for _ in 0..iterations {
            let r = self.residuals(last, now, &guess);
            if 2 * r.iter().flatten().count() < r.len() {
                return None;
            }
            let scale = (1.5 * self.steep_median(last, &r)).max(1e-6);
            let (mut a, mut b) = ([[0.0; 5]; 5], [0.0; 5]);
            for (&(y, x), r) in self.samples(now.dim()).iter().zip(&r) {
                let Some(r) = *r else { continue };
                let gx = (last[[y, x + 1]] - last[[y, x - 1]]) / 2.0;
                let gy = (last[[y + 1, x]] - last[[y - 1, x]]) / 2.0;
                let (u, v) = ((x as f64 - middle.0) / half, (y as f64 - middle.1) / half);
                let j = [-1.0, gx, gy, gx * u + gy * v, gy * u - gx * v];
                let weight = 1.0 / (1.0 + (r / scale).powi(2));
                for i in 0..5 {
                    for k in 0..5 {
                        a[i][k] += weight * j[i] * j[k];
                    }
                    b[i] += weight * j[i] * r;
                }
            }
            let [step, x, y, stretch, turn] = eliminate(a, b)?;
            let motion = &mut guess.motion;
            motion.shift = (motion.shift.0 - x, motion.shift.1 - y);
            motion.stretch -= stretch / half;
            motion.turn -= turn / half;
            guess.step -= step;
            let motion = guess.motion;
            if motion.shift.0.hypot(motion.shift.1) > farthest || half * motion.stretch.hypot(motion.turn) > farthest {
                return None;
            }
            if x.hypot(y) + stretch.hypot(turn) < settled {
                break;
            }
        }
        let r = self.residuals(last, now, &guess);
        (2 * r.iter().flatten().count() >= r.len()).then_some(guess)
    }
}

/// Gauss's elimination from the first unknown to the last. A pivot below 1e-8 of the sum of weights ends it for the shift,
/// and leaves out a stretch or turn.
#[allow(clippy::needless_range_loop, reason = "rows and columns of a matrix read best as such")]
fn eliminate(mut a: [[f64; 5]; 5], mut b: [f64; 5]) -> Option<[f64; 5]> {
    let weights = a[0][0];
    if weights <= 0.0 {
        return None;
    }
    let mut used = [true; 5];
    for k in 0..5 {
        if k > 0 && a[k][k] / weights < 1e-8 {
            if k < 3 {
                return None;
            }
            used[k] = false;
            continue;
        }
        for i in k + 1..5 {
            let factor = a[i][k] / a[k][k];
            for j in k..5 {
                a[i][j] -= factor * a[k][j];
            }
            b[i] -= factor * b[k];
        }
    }
    let mut x = [0.0; 5];
    for k in (0..5).rev().filter(|k| used[*k]) {
        x[k] = (b[k] - (k + 1..5).map(|j| a[k][j] * x[j]).sum::<f64>()) / a[k][k];
    }
    Some(x)
}

/// Means of 2 x 2 pixels, so many times; an odd last row or column is dropped.
fn halved(map: &Map, times: u32) -> Map {
    let mut map = map.clone();
    for _ in 0..times {
        map = Map::from_shape_fn((map.nrows() / 2, map.ncols() / 2), |(y, x)| {
            (map[[2 * y, 2 * x]] + map[[2 * y, 2 * x + 1]] + map[[2 * y + 1, 2 * x]] + map[[2 * y + 1, 2 * x + 1]])
                / 4.0
        });
    }
    map
}

/// Between the pixels of a place in the picture, whose last row and column are part of it.
fn bilinear(map: &Map, x: f64, y: f64) -> f64 {
    let (height, width) = map.dim();
    let (left, top) = ((x as usize).min(width - 2), (y as usize).min(height - 2));
    let (fx, fy) = (x - left as f64, y - top as f64);
    (1.0 - fy) * ((1.0 - fx) * map[[top, left]] + fx * map[[top, left + 1]])
        + fy * ((1.0 - fx) * map[[top + 1, left]] + fx * map[[top + 1, left + 1]])
}

/// The upper one of an even number; 0 of none.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

fn median_of(residuals: &[Option<f64>]) -> f64 {
    median(residuals.iter().flatten().map(|r| r.abs()))
}

fn mean_absolute(residuals: &[Option<f64>]) -> f64 {
    let count = residuals.iter().flatten().count();
    if count == 0 { f64::INFINITY } else { residuals.iter().flatten().map(|r| r.abs()).sum::<f64>() / count as f64 }
}
