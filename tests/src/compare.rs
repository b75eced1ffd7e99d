//! The fast core beside the naive model, frame by frame.
//!
//! Numbers are compared stage by stage. Yes-or-no decisions are compared as decisions: where the two models stand on
//! different sides of a threshold, both must stand within rounding of it; the naive model then takes the fast one's
//! side, so that every later frame can be held to the same strict bound.

use apgstmd_core::{Detector, Frame, Params, Response, Size, Stage};
use ndarray::{Array2, Array3, ArrayView2, Axis};

use crate::naive::lobula::{direction_weight, lateral_kernel, theta};
use crate::naive::map::{Map, maximum, peak};
use crate::naive::retina::{region, threshold};
use crate::naive::{Decisions, Detection, Naive, Seen};

/// Share of a stage's maximum in a frame by which it may differ: the specification's.
pub const RELATIVE: f64 = 1e-4;

/// Rounding of luminance: one unit in the last place of 1.0 in f32. P_e, L and what follows L linearly cannot be
/// nearer to the truth than this, however small they are.
pub const LUMINANCE_ROUNDING: f64 = 1.2e-7;

/// Sub-pixel positions come from differences of f32 responses near their maximum, px.
const PLACE: f64 = 2e-3;

/// Gauss-Newton stops at steps below 1e-3 px, and f32 may take one step more or less, px.
const SHIFT: f64 = 2e-3;

/// The fast core lets go of a region that has faded below this share: what it still adds is lost in the rounding of P.
const FADED: f64 = 1e-6;

/// A stage of the fast core in float64.
pub fn maps(stage: &Array3<f32>) -> Vec<Map> {
    stage.axis_iter(Axis(0)).map(|plane| plane.mapv(f64::from)).collect()
}

/// Differences that rounding of the input alone explains, stage by stage: [`LUMINANCE_ROUNDING`] carried through the
/// model. Only where a stage is tiny (first frames, faint scenes) does it exceed [`RELATIVE`] of its maximum.
pub struct Floors {
    inhibition_gain: f64,
    facilitation_gain: f64,
    alpha: f64,
    response: f64,
}

impl Floors {
    /// For a model with these parameters.
    pub fn new(params: &Params) -> Self {
        let lateral: f64 = lateral_kernel(params).iter().map(|w| w.abs()).sum();
        let directional: f64 = (0..8).map(|steps| direction_weight(steps, params).abs()).sum();
        let prediction = &params.prediction;
        let window: f64 = (0..=prediction.horizon).map(|k| (-prediction.kappa * f64::from(k)).exp()).sum();
        Self {
            inhibition_gain: lateral * directional,
            facilitation_gain: 1.0 + prediction.beta * window,
            alpha: params.attention.alpha,
            response: 0.0,
        }
    }

    /// The floors of this frame, by stage.
    pub fn of(&mut self, seen: &Seen) -> impl Fn(Stage) -> f64 + use<> {
        let luminance = LUMINANCE_ROUNDING * peak(&seen[Stage::Pe]).max(1.0);
        let enhanced = luminance * (1.0 + self.alpha);
        let [on, delayed_on, off_4, off_5] =
            [Stage::Tm3, Stage::Mi1, Stage::Tm1_4, Stage::Tm1_5].map(|stage| peak(&seen[stage]));
        // Product rule for Tm3 (Tm1_4 + Mi1) Tm1_5.
        let sum = off_4 + delayed_on;
        let correlation = enhanced * (sum * off_5 + 2.0 * on * off_5 + on * sum);
        let response = correlation * self.inhibition_gain;
        // Predictions remember earlier frames.
        self.response = self.response.max(response);
        let (remembered, gain) = (self.response, self.facilitation_gain);
        move |stage| match stage {
            Stage::P | Stage::C | Stage::A => luminance,
            Stage::Pe | Stage::L | Stage::Tm3 | Stage::Tm2 | Stage::Mi1 | Stage::Tm1_4 | Stage::Tm1_5 => enhanced,
            Stage::D => correlation,
            Stage::E | Stage::Ep => response,
            Stage::F => remembered,
            Stage::M => 8.0 * remembered,
            Stage::Q => gain * remembered,
        }
    }
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

/// A fast detector and the naive model on the same frames.
pub struct Pair {
    /// The fast one.
    pub fast: Detector,
    /// Its last output.
    pub response: Response,
    naive: Naive,
    params: Params,
    floors: Floors,
    /// M of the fast one, every frame.
    m: Vec<Map>,
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
            naive: Naive::new(params, f64::from(fast.lag())),
            fast,
            params: params.clone(),
            floors: Floors::new(params),
            m: Vec::new(),
            attended: 0,
            detections: 0,
        }
    }

    /// One frame through both.
    ///
    /// # Errors
    /// What differs, in words.
    pub fn step(&mut self, frame: ArrayView2<'_, u8>) -> Result<Seen, String> {
        self.fast.process_into(Frame::from(frame), &mut self.response).map_err(|error| error.to_string())?;
        let fast = |stage: Stage| maps(&self.fast.probe().stage(stage));
        let (e, c) = (fast(Stage::E), fast(Stage::C));
        let region = self.region()?;
        let (dx, dy) = self.response.background_shift;
        let shift = (f64::from(dx), f64::from(dy));
        let decisions =
            Decisions { region: region.as_ref(), response: Some((&e, &c)), shift: Some(shift), faded: FADED };
        let seen = self.naive.step_with(&frame.mapv(|v| f64::from(v) / 255.0), decisions);

        if (seen.shift.0 - shift.0).hypot(seen.shift.1 - shift.1) > SHIFT {
            return Err(format!("background shift {shift:?}, the truth is {:?}", seen.shift));
        }
        let floor = self.floors.of(&seen);
        for &stage in Stage::ALL {
            let most = peak(&seen[stage]);
            let tolerance = (RELATIVE * most).max(floor(stage));
            let off = difference(&seen[stage], &fast(stage), tolerance);
            if off.beyond > 0 {
                return Err(format!("stage {stage}, maximum {most:e}, tolerance {tolerance:e}: {off:?}"));
            }
        }
        self.detections(&seen)?;
        self.maps(&fast(Stage::Q))?;
        self.attended += usize::from(peak(&seen[Stage::A]) > 0.0);
        self.detections += seen.detections.len();
        self.m.push(fast(Stage::M).swap_remove(0));
        Ok(seen)
    }

    /// Omega as the fast core's own M gives it, after checking that the naive M gives the same but for rounding.
    fn region(&self) -> Result<Option<Map>, String> {
        let Some(naive) = self.naive.past_prediction() else { return Ok(None) };
        let fast = &self.m[self.m.len() - self.params.prediction.horizon as usize];
        let omega = region(fast, &self.params);
        let level = threshold(naive, &self.params);
        let slack = 2.0 * RELATIVE * peak(std::slice::from_ref(naive));
        for ((at, own), chosen) in region(naive, &self.params).indexed_iter().zip(&omega) {
            if own != chosen && (naive[at] - level).abs() > slack {
                return Err(format!("attended region at {at:?}: M is {:e}, the level {level:e}", naive[at]));
            }
        }
        Ok(Some(omega))
    }

    fn detections(&self, seen: &Seen) -> Result<(), String> {
        let (given, truth) = (&self.response.detections, &seen.detections);
        let differ = |what: String| Err(format!("{what}\ngiven: {given:#?}\ntruth: {truth:#?}"));
        if given.len() != truth.len() {
            return differ(format!("{} detections instead of {}", given.len(), truth.len()));
        }
        if !given.is_sorted_by(|a, b| a.score >= b.score) {
            return differ("the strongest must come first".to_owned());
        }
        let most = peak(&seen[Stage::Q]);
        for truth in truth {
            let Some(given) = given.iter().find(|given| given.trace == truth.trace) else {
                return differ(format!("trace {} is missing", truth.trace));
            };
            let Detection { x, y, score, direction, directedness, .. } = *truth;
            let turn = (f64::from(given.direction) - direction).sin().abs();
            // The angle of a sum that nearly cancels is known that much less well, and moves the place along.
            let blur = RELATIVE / directedness.max(RELATIVE) * (most / score.max(1e-30)).max(1.0);
            if (f64::from(given.score) - score).abs() > RELATIVE * most
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
