//! The background's motion as a similarity (translation, rotation, zoom), coarse to fine; and cuts of the scene.
//!
//! Input: P. Output: a [`Finding`]. State: samples of the last P and their gradients on every level of the pyramid, the
//! last motion, the usual residual. Robust Gauss-Newton (Cauchy weights at 1.5 times the median absolute residual, steep places counting more) over
//! (step of luminance, shift, stretch, turn); on the coarsest level it starts from the last motion, from none, or from
//! the best of all whole shifts. `docs/motion.md` defines every step.

use fearless_simd::Level;

use crate::frame::Size;
use crate::memory::heap;
use crate::plane::Plane;
use crate::row::warp::{OUTSIDE, Picture, SUMS};
use crate::stage::background::{Finding, Motion};
use crate::stage::median::Median;
use crate::stage::normal::solve;
use crate::stage::pyramid::{Pyramid, Scale, scales};
use crate::state::{Remember, StateError, Visit, remember};

/// Most samples of the finest level, and of those between it and the coarsest, which is sampled in full.
const SAMPLES: (usize, usize) = (8192, 4096);
/// Most iterations on the coarsest level, between, and on the finest.
const ITERATIONS: [usize; 3] = [8, 2, 3];
/// Steps below this end the search on the finest level and on the others, px of the level.
const SETTLED: (f64, f64) = (1e-3, 2e-2);
/// Whole shifts that are tried on the coarsest level, px of the level, each way.
const REACH: isize = 4;
/// A whole shift is believed when its mean absolute residual is below this share of the others'.
const BETTER: f64 = 0.8;
/// Farthest a motion may move the middle, or the ends of the longer side, as a share of the shorter side.
const FARTHEST: f64 = 0.25;
/// Least scale of the residuals, luminance.
const LEAST_SCALE: f32 = 1e-6;
/// Most of the picture's spread that what a motion leaves may come to.
const UNEXPLAINED: f32 = 0.5;
/// A cut leaves so many times more than usual, and at least so much.
const JUMP: (f32, f32) = (4.0, 0.01);
/// How much the latest frame counts in what is usual.
const USUAL: f32 = 0.1;
/// What a motion leaves may come to this much of what none leaves.
const NO_WORSE: f32 = 1.05;

/// Motion in px of a level, and the step of luminance.
#[derive(Clone, Copy)]
struct Estimate {
    shift: (f64, f64),
    stretch: f64,
    turn: f64,
    offset: f64,
}

impl Estimate {
    fn none(offset: f64) -> Self {
        Self { shift: (0.0, 0.0), stretch: 0.0, turn: 0.0, offset }
    }
}

/// What the coarsest level says.
#[derive(Clone, Copy)]
enum Glance {
    First,
    Found(Estimate),
    Unexplained,
    Cut,
}

/// A frame that was looked at and is to be followed.
struct Looked {
    pyramid: Pyramid,
    glance: Glance,
    /// By how much it is brighter than the frame before, luminance.
    brighter: f64,
}

heap!(Looked { pyramid });

pub(crate) struct Similarity {
    /// The finest first. `look` uses the last of them, `follow` the others.
    scales: Vec<Scale>,
    /// Of the frames that are computed together.
    looked: Vec<Looked>,
    first: bool,
    none: Finding,
    /// Last motion on the coarsest level.
    last: Estimate,
    /// Of the last picture on the coarsest level.
    brightness: f32,
    spread: f32,
    usual: Option<f32>,
    residuals: Vec<f32>,
    median: Median,
}

heap!(Similarity { scales, looked, residuals, median });
remember!(Estimate { shift, stretch, turn, offset });

impl Remember for Similarity {
    /// Between frames: what was looked at has been followed.
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        for (index, scale) in self.scales.iter_mut().enumerate() {
            visit.part(&format!("scale{index}"), scale)?;
        }
        visit.part("first", &mut self.first)?;
        visit.part("last", &mut self.last)?;
        visit.part("brightness", &mut self.brightness)?;
        visit.part("spread", &mut self.spread)?;
        let usual = visit.some_values("usual", 1, || self.usual.into_iter().collect(), |_| true)?;
        self.usual = usual.map_or(self.usual, |usual| usual.first().copied());
        Ok(())
    }
}

impl Similarity {
    /// For `together` frames at once.
    pub fn new(size: Size, together: usize) -> Self {
        let scales = scales(size, SAMPLES);
        let most = scales.iter().map(|scale| scale.rows * scale.padded).max().expect("there is a level");
        let coarsest = &scales[scales.len() - 1];
        let most = most.max(coarsest.pixels());
        let looked = || Looked { pyramid: Pyramid::new(size, coarsest.level), glance: Glance::First, brighter: 0.0 };
        let looked = (0..together).map(|_| looked()).collect();
        Self {
            scales,
            looked,
            first: true,
            none: Finding::nothing(size),
            last: Estimate::none(0.0),
            brightness: 0.0,
            spread: 0.0,
            usual: None,
            residuals: vec![OUTSIDE; most],
            median: Median::new(most),
        }
    }

    /// Makes the smaller pictures and compares the smallest with the last: whether the scene was cut before this frame of
    /// those that are computed together.
    pub fn look(&mut self, level: Level, p: &Plane, frame: usize) -> bool {
        let mut looked = self.looked.swap_remove(frame);
        looked.pyramid.build(level, p);
        let picture = looked.pyramid.level(p, self.scales[self.scales.len() - 1].level);
        let (brightness, spread) = self.light(picture);
        looked.brighter = f64::from(brightness) - f64::from(self.brightness);
        looked.glance = Glance::First;
        if !self.first {
            let largest = spread.max(self.spread);
            looked.glance = self.glance(level, picture, looked.brighter, largest);
        }
        self.last = match looked.glance {
            Glance::Found(estimate) => estimate,
            _ => Estimate::none(0.0),
        };
        (self.first, self.brightness, self.spread) = (false, brightness, spread);
        let coarsest = self.scales.len() - 1;
        self.scales[coarsest].remember(picture);
        let cut = matches!(looked.glance, Glance::Cut);
        self.looked.push(looked);
        let end = self.looked.len() - 1;
        self.looked.swap(frame, end);
        cut
    }

    /// What was looked at as `frame` is the first from now on.
    pub fn begin_at(&mut self, frame: usize) {
        self.looked.swap(0, frame);
    }

    /// Refines what `look` found, and keeps the picture to compare the next one with.
    pub fn follow(&mut self, level: Level, p: &Plane, frame: usize) -> Finding {
        let looked = self.looked.swap_remove(frame);
        let found = match looked.glance {
            Glance::First => self.none,
            Glance::Cut => Finding { cut: true, ..self.none },
            Glance::Unexplained => self.refine(level, p, &looked, None),
            Glance::Found(estimate) => self.refine(level, p, &looked, Some(estimate)),
        };
        let coarsest = self.scales.len() - 1;
        for scale in &mut self.scales[..coarsest] {
            scale.remember(looked.pyramid.level(p, scale.level));
        }
        self.looked.push(looked);
        let end = self.looked.len() - 1;
        self.looked.swap(frame, end);
        found
    }

    pub fn reset(&mut self) {
        self.first = true;
        self.last = Estimate::none(0.0);
        self.usual = None;
    }

    /// Median luminance of the smallest picture, and the median distance from it.
    fn light(&mut self, picture: Picture<'_>) -> (f32, f32) {
        self.residuals.clear();
        for y in 0..picture.height {
            self.residuals.extend_from_slice(&picture.data[y * picture.stride..][..picture.width]);
        }
        let middle = self.median.of_absolute(&self.residuals);
        self.residuals.iter_mut().for_each(|value| *value -= middle);
        (middle, self.median.of_absolute(&self.residuals))
    }

    /// What the smallest picture says.
    fn glance(&mut self, level: Level, picture: Picture<'_>, brighter: f64, spread: f32) -> Glance {
        let start = self.start(level, picture, brighter);
        let coarsest = self.scales.len() - 1;
        let estimate = self.descend(level, picture, coarsest, start);
        let inside = self.compare(level, picture, coarsest, &estimate.unwrap_or(Estimate::none(brighter)));
        let left = inside.map_or(0.0, |inside| self.median.of_least(&self.residuals, inside));
        if left > UNEXPLAINED * spread && left > JUMP.1 && self.usual.is_some_and(|usual| left > JUMP.0 * usual) {
            self.usual = None;
            return Glance::Cut;
        }
        self.usual = Some(self.usual.map_or(left, |usual| usual + USUAL * (left - usual)));
        let steep_left = self.steep_median(coarsest);
        self.residuals.clear();
        self.residuals.extend(self.scales[coarsest].last.iter().map(|value| value - self.brightness));
        let explained = steep_left <= UNEXPLAINED * self.steep_median(coarsest);
        estimate.filter(|_| explained).map_or(Glance::Unexplained, Glance::Found)
    }

    /// The last motion, none, or a whole shift, whichever explains the smallest picture best.
    fn start(&mut self, level: Level, picture: Picture<'_>, offset: f64) -> Estimate {
        let coarsest = self.scales.len() - 1;
        let scale = &self.scales[coarsest];
        let (mut still, mut best, mut place) = (f64::INFINITY, f64::INFINITY, (0, 0));
        for dy in -REACH..=REACH {
            for dx in -REACH..=REACH {
                let mean = scale.disagreement(level, picture, offset as f32, (dx, dy));
                if (dx, dy) == (0, 0) {
                    still = mean;
                }
                if mean < best {
                    (best, place) = (mean, (dx, dy));
                }
            }
        }
        let none = Estimate::none(offset);
        let last = Estimate { offset, ..self.last };
        self.compare(level, picture, coarsest, &last);
        let inside = self.residuals.iter().filter(|r| **r != OUTSIDE);
        let (sum, count) = inside.fold((0.0, 0), |(sum, count), r| (sum + f64::from(r.abs()), count + 1));
        let again = if count > 0 { sum / f64::from(count) } else { f64::INFINITY };
        let (start, cost) = if again <= still { (last, again) } else { (none, still) };
        if best < BETTER * cost { Estimate { shift: (place.0 as f64, place.1 as f64), ..none } } else { start }
    }

    /// Gauss-Newton on a level; none where there is no structure, or no end to the motion.
    fn descend(&mut self, level: Level, picture: Picture<'_>, index: usize, start: Estimate) -> Option<Estimate> {
        let coarsest = index + 1 == self.scales.len();
        let iterations = ITERATIONS[if coarsest {
            0
        } else if index == 0 {
            2
        } else {
            1
        }];
        let settled = if index == 0 { SETTLED.0 } else { SETTLED.1 };
        let mut estimate = start;
        for _ in 0..iterations {
            self.compare(level, picture, index, &estimate)?;
            let median = self.steep_median(index);
            let scale = &self.scales[index];
            let mut sums = [0.0; SUMS];
            scale.normal(level, (1.5 * median).max(LEAST_SCALE), &self.residuals, &mut sums);
            let [offset, x, y, stretch, turn] = solve(&sums)?;
            estimate = Estimate {
                shift: (estimate.shift.0 - x, estimate.shift.1 - y),
                stretch: estimate.stretch - stretch / scale.half,
                turn: estimate.turn - turn / scale.half,
                offset: estimate.offset - offset,
            };
            let farthest = FARTHEST * scale.shorter();
            let ends = scale.half * estimate.stretch.hypot(estimate.turn);
            if estimate.shift.0.hypot(estimate.shift.1) > farthest || ends > farthest {
                return None;
            }
            if x.hypot(y) + stretch.hypot(turn) < settled {
                break;
            }
        }
        Some(estimate)
    }

    fn refine(&mut self, level: Level, p: &Plane, looked: &Looked, coarse: Option<Estimate>) -> Finding {
        let mut found = coarse;
        for index in (0..self.scales.len() - 1).rev() {
            let at = self.scales[index].level;
            let larger = f64::from(1u32 << (self.scales[index + 1].level - at));
            found = found.and_then(|estimate| {
                let shift = (larger * estimate.shift.0, larger * estimate.shift.1);
                self.descend(level, looked.pyramid.level(p, at), index, Estimate { shift, ..estimate })
            });
        }
        let mut left = |estimate: &Estimate| {
            self.compare(level, looked.pyramid.level(p, 0), 0, estimate).map(|_| self.steep_median(0))
        };
        let still = left(&Estimate::none(found.map_or(looked.brighter, |estimate| estimate.offset))).unwrap_or(0.0);
        let found = found.and_then(|estimate| left(&estimate).map(|left| (estimate, left)));
        let robust = |median: f32| (1.5 * median).max(LEAST_SCALE);
        match found.filter(|_| self.scales[0].has_structure()) {
            Some((estimate, left)) if left <= NO_WORSE * still || robust(left) <= LEAST_SCALE => {
                let Estimate { shift, stretch, turn, .. } = estimate;
                let motion = Motion { shift, stretch, turn, ..self.none.motion };
                Finding { motion, residual: robust(left), ..self.none }
            }
            _ => Finding { residual: robust(still), unexplained: true, ..self.none },
        }
    }

    /// Residuals of a level under a motion. How many lie inside the picture, where at least half do.
    fn compare(&mut self, level: Level, picture: Picture<'_>, index: usize, estimate: &Estimate) -> Option<usize> {
        let scale = &self.scales[index];
        let Estimate { shift, stretch, turn, offset } = *estimate;
        let motion = Motion { shift, stretch, turn, middle: scale.middle };
        self.residuals.clear();
        self.residuals.resize(scale.rows * scale.padded, OUTSIDE);
        let inside = scale.compare(level, picture, &motion, offset as f32, &mut self.residuals);
        (2 * inside >= scale.rows * scale.columns).then_some(inside)
    }

    /// Median absolute residual of what was compared, each counting as much as the picture is steep there: smooth sky,
    /// which fits wherever it is moved, has no say.
    fn steep_median(&mut self, index: usize) -> f32 {
        self.median.weighted(&self.residuals, &self.scales[index].steepness, OUTSIDE)
    }
}

#[cfg(test)]
mod tests;
