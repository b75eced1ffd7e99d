//! The fast core beside the naive model, frame by frame.
//!
//! Numbers are compared stage by stage. Yes-or-no decisions are compared as decisions: where the two models stand on
//! different sides of a threshold, both must stand within rounding of it; the naive model then takes the fast one's
//! side, so that every later frame can be held to the same strict bound.

use apgstmd_core::params::BackgroundMotion;
use apgstmd_core::{Detector, Frame, Model, Params, Region, Response, Size, Stage};
use ndarray::{Array2, Array3, ArrayView2, Axis};

pub use crate::floors::{Floors, LUMINANCE_ROUNDING};
use crate::naive::lobula::theta;
use crate::naive::map::{Map, maximum, peak};
use crate::naive::motion::{Found, Motion};
use crate::naive::retina::{region, threshold};
use crate::naive::rivals::Rival;
use crate::naive::{Decisions, Detection, Naive, Seen};

/// Share of a stage's maximum in a frame by which it may differ: the specification's.
pub const RELATIVE: f64 = 1e-4;

/// Sub-pixel positions come from differences of f32 responses near their maximum, px.
const PLACE: f64 = 2e-3;

/// Gauss-Newton stops at steps below 1e-3 px, and f32 may take one step more or less, px.
const SHIFT: f64 = 2e-3;

/// Luminance that the median absolute residual may be off: f32 rounding of P and of places up to 300 px, and one step more
/// or less of Gauss-Newton.
const RESIDUAL: f64 = 1e-4;

/// The fast core lets go of a region that has faded below this share: what it still adds is lost in the rounding of P.
const FADED: f64 = 1e-6;

/// A stage of the fast core in float64.
pub fn maps(stage: &Array3<f32>) -> Vec<Map> {
    stage.axis_iter(Axis(0)).map(|plane| plane.mapv(f64::from)).collect()
}

/// How far a stage is off.
#[derive(Debug)]
pub struct Difference {
    /// Pixels (of all planes) beyond the tolerance.
    pub beyond: usize,
    /// Pixels compared.
    pub pixels: usize,
    /// The worst one: plane, row, column.
    pub at: (usize, usize, usize),
    /// How many tolerances it is off.
    pub worst: f64,
}

/// Compares planes with the truth: how many pixels are off by more than `tolerance`, and by how much.
pub fn difference(truth: &[Map], given: &[Map], tolerance: f64) -> Difference {
    assert_eq!(truth.len(), given.len());
    let mut result = Difference { beyond: 0, pixels: 0, at: (0, 0, 0), worst: 0.0 };
    for (k, (truth, given)) in truth.iter().zip(given).enumerate() {
        assert_eq!(truth.dim(), given.dim());
        for ((y, x), truth) in truth.indexed_iter() {
            let off = (truth - given[[y, x]]).abs();
            // A NaN is beyond every tolerance.
            let off = if off.is_nan() { f64::INFINITY } else { off };
            result.pixels += 1;
            if off > tolerance {
                result.beyond += 1;
            }
            let off = if tolerance > 0.0 { off / tolerance } else { off };
            if off > result.worst {
                (result.worst, result.at) = (off, (k, y, x));
            }
        }
    }
    result
}

/// The naive model of either kind.
enum Oracle {
    ApgStmd(Box<Naive>),
    Rival(Box<Rival>),
}

impl Oracle {
    fn new(params: &Params, lag: f64) -> Self {
        match params.model {
            Model::ApgStmd => Self::ApgStmd(Box::new(Naive::new(params, lag))),
            _ => Self::Rival(Box::new(Rival::new(params, lag))),
        }
    }

    fn step_with(&mut self, frame: &Map, decisions: Decisions<'_>) -> Seen {
        match self {
            Self::ApgStmd(naive) => naive.step_with(frame, decisions),
            Self::Rival(rival) => rival.step_with(frame, decisions),
        }
    }

    fn past_prediction(&self) -> Option<&Map> {
        match self {
            Self::ApgStmd(naive) => naive.past_prediction(),
            Self::Rival(_) => None,
        }
    }
}

/// A fast detector and the naive model on the same frames.
pub struct Pair {
    /// The fast one.
    pub fast: Detector,
    /// Its last output.
    pub response: Response,
    naive: Oracle,
    looked_in: Option<Region>,
    params: Params,
    floors: Floors,
    /// M of the fast one, every frame.
    m: Vec<(Map, f64)>,
    /// Frames in which attention did something.
    pub attended: usize,
    /// Detections so far.
    pub detections: usize,
}

impl Pair {
    /// Both for frames of `size`.
    pub fn new(size: Size, params: &Params, threads: usize) -> Self {
        let fast = Detector::with_threads(size, params, threads).expect("valid parameters");
        Self {
            response: fast.make_response(),
            naive: Oracle::new(params, f64::from(fast.lag())),
            fast,
            looked_in: None,
            params: params.clone(),
            floors: Floors::new(params),
            m: Vec::new(),
            attended: 0,
            detections: 0,
        }
    }

    /// Both look in a region only; of the naive models, apg-STMD can.
    pub fn look_in(&mut self, region: &Region) {
        let Oracle::ApgStmd(naive) = &mut self.naive else { panic!("only apg-STMD") };
        self.fast.look_in(Some(region)).expect("a region of the size of the frames");
        // Peaks count from where a target inside may be reported.
        let reach = self.fast.lag().abs().ceil() as isize + 1;
        let Size { height, width } = region.size();
        let near = |y: usize, x: usize| {
            let rows = (y as isize - reach).max(0)..=(y as isize + reach).min(height as isize - 1);
            let columns = (x as isize - reach).max(0)..=(x as isize + reach).min(width as isize - 1);
            rows.into_iter().any(|v| columns.clone().any(|u| region.contains(u as f32, v as f32)))
        };
        naive.region = Some(Array2::from_shape_fn((height, width), |(y, x)| near(y, x)));
        self.looked_in = Some(region.clone());
    }

    /// One frame through both.
    ///
    /// # Errors
    /// What differs, in words.
    pub fn step(&mut self, frame: ArrayView2<'_, u8>) -> Result<Seen, String> {
        self.fast.process_into(Frame::from(frame), &mut self.response).map_err(|error| error.to_string())?;
        let fast = |stage: Stage| maps(&self.fast.probe().stage(stage).expect("the model says it has it"));
        let (e, c) = (fast(if self.params.model.is_directional() { Stage::E } else { Stage::Y }), fast(Stage::C));
        let region = self.region()?;
        let given = self.motion();
        let decisions =
            Decisions { region: region.as_ref(), response: Some((&e, &c)), motion: Some(given), faded: FADED };
        let seen = self.naive.step_with(&frame.mapv(|v| f64::from(v) / 255.0), decisions);

        self.background(&given, &seen.background)?;
        let floor = self.floors.of(&seen, &e);
        for &stage in self.params.model.stages() {
            let most = peak(&seen[stage]);
            let tolerance = (RELATIVE * most).max(floor(stage));
            let off = difference(&seen[stage], &fast(stage), tolerance);
            if off.beyond > 0 {
                return Err(format!("stage {stage}, maximum {most:e}, tolerance {tolerance:e}: {off:?}"));
            }
        }
        let shown = match self.params.model {
            Model::ApgStmd => Stage::Q,
            Model::StmdPlus | Model::Dstmd | Model::Cascaded => Stage::Ep,
            Model::Estmd => Stage::Y,
        };
        self.detections(&seen, floor(shown))?;
        match self.params.model {
            Model::ApgStmd => {
                self.maps(&fast(Stage::Q))?;
                self.attended += usize::from(peak(&seen[Stage::A]) > 0.0);
                self.m.push((fast(Stage::M).swap_remove(0), floor(Stage::M)));
            }
            Model::StmdPlus | Model::Dstmd | Model::Cascaded => self.maps(&fast(Stage::Ep))?,
            Model::Estmd => self.map_without_direction(&fast(Stage::Y)[0], &seen.q[0], floor(Stage::Y))?,
        }
        self.detections += seen.detections.len();
        Ok(seen)
    }

    /// The background's motion as the fast core has it.
    fn motion(&self) -> Motion {
        let ((dx, dy), ego) = (self.response.background_shift, self.response.ego_motion);
        Motion::new((f64::from(dx), f64::from(dy)), f64::from(ego.rotation), f64::from(ego.zoom))
    }

    /// The background's motion at the ends of the longer side, and what is left of the picture.
    fn background(&self, given: &Motion, truth: &Found) -> Result<(), String> {
        let ego = self.response.ego_motion;
        let half = self.fast.size().width.max(self.fast.size().height) as f64 / 2.0;
        let shift = (given.shift.0 - truth.motion.shift.0).hypot(given.shift.1 - truth.motion.shift.1);
        let ends = half * (given.stretch - truth.motion.stretch).hypot(given.turn - truth.motion.turn);
        let similarity = self.params.rejection.background == BackgroundMotion::Similarity;
        let same = (ego.unexplained, self.response.cut) == (truth.unexplained, truth.cut)
            && (f64::from(ego.residual) - truth.residual).abs() <= RESIDUAL;
        if shift.max(ends) > SHIFT || similarity && !same {
            let cut = self.response.cut;
            return Err(format!("background {given:?}, {ego:?}, cut {cut}, the truth is {truth:?}"));
        }
        Ok(())
    }

    /// Omega as the fast core's own M gives it, after checking that the naive M gives the same but for rounding.
    fn region(&self) -> Result<Option<Map>, String> {
        let Some(naive) = self.naive.past_prediction() else { return Ok(None) };
        let (fast, floor) = &self.m[self.m.len() - self.params.prediction.horizon as usize];
        let omega = region(fast, &self.params);
        let level = threshold(naive, &self.params);
        let slack = (2.0 * RELATIVE * peak(std::slice::from_ref(naive))).max(*floor);
        for ((at, own), chosen) in region(naive, &self.params).indexed_iter().zip(&omega) {
            if own != chosen && (naive[at] - level).abs() > slack {
                return Err(format!("attended region at {at:?}: M is {:e}, the level {level:e}", naive[at]));
            }
        }
        Ok(Some(omega))
    }

    fn detections(&self, seen: &Seen, floor: f64) -> Result<(), String> {
        let tolerance = (RELATIVE * peak(&seen.q)).max(floor);
        // On the border of a region rounding decides, also of what is so faint that its direction, and with it its place, is.
        let clear = |x: f32, y: f32, score: f64| {
            self.looked_in.as_ref().is_none_or(|region| {
                let around = [(-0.01, 0.0), (0.01, 0.0), (0.0, -0.01), (0.0, 0.01)];
                score > tolerance && around.iter().all(|(dx, dy)| region.contains(x + dx, y + dy))
            })
        };
        let truth = seen.detections.iter().filter(|found| clear(found.x as f32, found.y as f32, found.score));
        let truth: Vec<&Detection> = truth.collect();
        let given = self.response.detections.iter().filter(|found| clear(found.x, found.y, found.score.into()));
        let given: Vec<_> = given.collect();
        let differ = |what: String| Err(format!("{what}\ngiven: {given:#?}\ntruth: {truth:#?}"));
        if given.len() != truth.len() {
            return differ(format!("{} detections instead of {}", given.len(), truth.len()));
        }
        if !given.is_sorted_by(|a, b| a.score >= b.score) {
            return differ("the strongest must come first".to_owned());
        }
        for truth in &truth {
            let Some(given) = given.iter().find(|given| given.trace == truth.trace) else {
                return differ(format!("trace {} is missing", truth.trace));
            };
            let Detection { x, y, score, direction, directedness, .. } = **truth;
            if direction.is_nan() != given.direction.is_nan() {
                return differ(format!("a direction is there or is not: {given:?} instead of {truth:?}"));
            }
            // The angle of a sum that nearly cancels is known that much less well, and moves the place along. Where
            // there is no direction, nothing moves.
            let known = !direction.is_nan();
            let turn = if known { (f64::from(given.direction) - direction).sin().abs() } else { 0.0 };
            let blur = if known { tolerance / (score * directedness.max(RELATIVE)).max(1e-30) } else { 0.0 };
            if (f64::from(given.score) - score).abs() > tolerance
                || turn > 2.0 * blur
                || f64::from(given.direction).cos() * direction.cos() < -0.5 && blur < 0.1
            {
                return differ(format!("a detection is wrong: {given:?} instead of {truth:?}"));
            }
            let slack = PLACE + 2.0 * blur * f64::from(self.fast.lag());
            if (f64::from(given.x) - x).abs() > slack || (f64::from(given.y) - y).abs() > slack {
                return differ(format!("a detection is misplaced: {given:?} instead of {truth:?}"));
            }
        }
        Ok(())
    }

    /// Y of the fast core itself, kept in the same places as by the naive model, but for rounding at the least response.
    fn map_without_direction(&self, y: &Map, kept: &Map, floor: f64) -> Result<(), String> {
        let tolerance = (RELATIVE * peak(std::slice::from_ref(y))).max(self.params.lobula.response_floor + floor);
        for (at, &given) in self.response.map.indexed_iter() {
            let given = f64::from(given);
            if given != y[at] && given != 0.0
                || given == 0.0 && kept[at] > tolerance
                || given > tolerance && kept[at] == 0.0
            {
                return Err(format!("response at {at:?} is {given:e}, Y {:e}, E' {:e}", y[at], kept[at]));
            }
        }
        if self.response.direction.iter().any(|direction| !direction.is_nan()) {
            return Err("there must be no direction".to_owned());
        }
        Ok(())
    }

    /// The output maps against the fast core's own Q: these are definitions, not approximations.
    fn maps(&self, q: &[Map]) -> Result<(), String> {
        let strongest: Array2<f32> = maximum(q).mapv(|v| v as f32);
        if self.response.map != strongest {
            return Err("the response map is not the maximum of Q".to_owned());
        }
        for (at, &direction) in self.response.direction.indexed_iter() {
            let sum = |f: fn(f64) -> f64| (0..8).map(|k| q[k][at] * f(theta(k))).sum::<f64>();
            let (cos, sin, total) = (sum(f64::cos), sum(f64::sin), q.iter().map(|q| q[at]).sum::<f64>());
            let direction = f64::from(direction);
            let right = if total == 0.0 {
                direction.is_nan()
            } else {
                // f32 sums of 8 values, and an angle in f32.
                let slack = 1e-5 * total;
                (direction.sin() * cos - direction.cos() * sin).abs() <= slack
                    && direction.cos() * cos + direction.sin() * sin >= -slack
            };
            if !right {
                return Err(format!("direction at {at:?} is {direction}, the sum of Q is ({cos:e}, {sin:e})"));
            }
        }
        Ok(())
    }
}
