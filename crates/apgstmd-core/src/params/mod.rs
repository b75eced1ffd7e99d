//! Every constant of the model, one struct a stage. [`Params::default`] is the table of the paper as `SPEC` fixes it.
//!
//! Lengths are in pixels, times in frames, luminance in [0, 1], speeds in pixels per frame, angles in radians.

mod field;
mod file;
mod model;

use std::f64::consts::TAU;

use field::{Any, Between, EachBetween, Rule, check, stage_params};
use serde::{Deserialize, Serialize};

pub use field::FieldInfo;
pub use model::{Model, UnknownModel};

use crate::error::ParamError;

/// Ready-made parameter sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// For real footage: rejection `motion` with more peaks and a narrower gate; attention to everything that is predicted, of one scale,
    /// to speckles of either sign, gating change; ten times the weight of predictions; positions moved onto the target.
    /// Chosen by measurement, see `docs/attention.md`.
    Practical,
    /// The constants of the paper, with its rejection by directional contrast. Equals [`Params::default`].
    Paper,
}

/// Where the attention kernels read luminance from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Support {
    /// The convolution reads the retina everywhere and its result is kept inside the attended region.
    Full,
    /// The paper's literal integral over the region: luminance outside counts as zero, the result is kept everywhere.
    Masked,
}

/// Which speckles attention looks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Speckles {
    /// The paper's maximum over scales of the minimum over orientations. Lines and edges that are lighter than what is
    /// around them give nothing; darker ones do.
    Light,
    /// What all orientations agree on, light or dark: the maximum over scales of the minimum over orientations, as far as
    /// it is positive, plus the minimum over scales of the maximum over orientations, as far as it is negative. Lines and
    /// edges of either sign give nothing.
    Both,
}

/// What the region of attention gates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Gate {
    /// The luminance that attention adds, as in the paper: P_e = P + alpha R A. A region that comes or goes is a step of
    /// luminance, which the lamina sees as motion.
    Luminance,
    /// The change that attention adds: the lamina filters the steps P(t) - P(t-1) + alpha R(t) (A(t) - A(t-1)). A region
    /// that comes or goes changes nothing by itself.
    Change,
}

/// How false positives are told from targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RejectionMode {
    /// Nothing is rejected.
    Off,
    /// A trace counts when the directional contrast along it varies (the paper's rule).
    Contrast,
    /// A trace counts when it moves, in a line, relative to the background.
    Motion,
}

/// How the background is taken to move from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BackgroundMotion {
    /// Not at all: the camera stands still.
    Off,
    /// All of it alike, by up to about 10 px a frame, found from the last shift on.
    Translation,
    /// With rotation and zoom, found from coarse to fine; the scene may be cut. See `docs/motion.md`.
    Similarity,
}

/// Which point of a moving thing a detection names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Localise {
    /// The peak of the response, a few pixels behind the target.
    Response,
    /// The peak moved forward along its direction by the lag of the model, onto the target.
    Target,
}

/// How the temporal filters are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TemporalEngine {
    /// Recursive gamma cascades: exact, infinite memory, a few planes of state.
    Cascade,
    /// Weighted sums over a ring buffer of past frames: the reference; slow and large.
    Fir,
}

stage_params! {
    /// Retina (ommatidia): P = I * G(sigma).
    RetinaParams in "retina" {
        /// sigma_1: standard deviation of the optical blur, px.
        sigma: f64 = 1.0, Between(0.1, 8.0);
    }
}

stage_params! {
    /// Attention: P_e = P + alpha R A inside the region that prediction points at.
    AttentionParams in "attention" {
        /// Whether attention is computed at all; without it P_e = P.
        enabled: bool = true, Any("true or false");
        /// alpha: weight of the attention response in the enhanced luminance.
        alpha: f64 = 1.0, Between(0.0, 10.0);
        /// Scales of the attention kernels, px.
        scales: Vec<f64> = vec![2.0, 2.5, 3.0, 3.5], EachBetween { low: 0.5, high: 8.0, most: 8 };
        /// Share of the strongest prediction above which a pixel is attended to.
        threshold: f64 = 0.2, Between(0.0, 1.0);
        /// Prediction below which no pixel is attended to.
        threshold_floor: f64 = 1e-10, Between(0.0, 1.0);
        /// "full": kernels read luminance everywhere; "masked": only inside the region, the paper's literal integral.
        support: Support = Support::Full, Any("\"full\" or \"masked\"");
        /// "light": the paper's maximum over scales of the minimum over orientations; "both": what all orientations agree
        /// on, light or dark.
        speckles: Speckles = Speckles::Light, Any("\"light\" or \"both\"");
        /// "luminance": the region gates what is added to the luminance, as in the paper; "change": how that changes,
        /// which needs support = "full".
        gate: Gate = Gate::Luminance, Any("\"luminance\" or \"change\"");
        /// Frames over which a region fades in and out; 1 switches at once, as in the paper.
        ramp: f64 = 1.0, Between(1.0, 1000.0);
    }
}

stage_params! {
    /// Lamina (LMC): difference of two gamma filters over time.
    LaminaParams in "lamina" {
        /// n_1: order of the fast gamma filter.
        fast_order: u32 = 2, Between(1, 24);
        /// tau_1: time constant of the fast gamma filter, frames.
        fast_tau: f64 = 3.0, Between(0.01, 500.0);
        /// n_2: order of the slow gamma filter.
        slow_order: u32 = 6, Between(1, 24);
        /// tau_2: time constant of the slow gamma filter, frames.
        slow_tau: f64 = 9.0, Between(0.01, 500.0);
    }
}

stage_params! {
    /// Lateral inhibition in the lamina of ESTMD, Cascaded and DSTMD:
    /// `L1 = ([h]+ * L) filtered by exp(-t / excitation_tau) + ([h]- * L) filtered by exp(-t / inhibition_tau)`.
    LaminaInhibitionParams in "lamina_inhibition" {
        /// (estmd, cascaded, dstmd) Standard deviation of the centre of h, px.
        center_sigma: f64 = 1.5, Between(0.3, 8.0);
        /// (estmd, cascaded, dstmd) Standard deviation of the surround of h, px.
        surround_sigma: f64 = 3.0, Between(0.3, 8.0);
        /// (estmd, cascaded, dstmd) Half width of h, px.
        radius: u32 = 5, Between(1, 24);
        /// (estmd, cascaded, dstmd) Time constant of the excitation by the centre, frames.
        excitation_tau: f64 = 3.0, Between(0.01, 500.0);
        /// (estmd, cascaded, dstmd) Time constant of the inhibition by the surround, frames.
        inhibition_tau: f64 = 9.0, Between(0.01, 500.0);
    }
}

stage_params! {
    /// Medulla: delayed ON (Mi1) and OFF (Tm1) signals.
    MedullaParams in "medulla" {
        /// n_3: order of the Mi1 delay.
        mi1_order: u32 = 3, Between(1, 24);
        /// tau_3: time constant of the Mi1 delay, frames.
        mi1_tau: f64 = 15.0, Between(0.01, 500.0);
        /// n_4: order of the shorter Tm1 delay.
        tm1_4_order: u32 = 5, Between(1, 24);
        /// tau_4: time constant of the shorter Tm1 delay, frames.
        tm1_4_tau: f64 = 25.0, Between(0.01, 500.0);
        /// n_5: order of the longer Tm1 delay.
        tm1_5_order: u32 = 8, Between(1, 24);
        /// tau_5: time constant of the longer Tm1 delay, frames.
        tm1_5_tau: f64 = 40.0, Between(0.01, 500.0);
    }
}

stage_params! {
    /// Lobula (STMD): correlation of two pixels, inhibition across space and across directions.
    LobulaParams in "lobula" {
        /// gamma: distance to the upstream pixel, px.
        spacing: f64 = 3.0, Between(0.0, 32.0);
        /// A: weight of the positive part of the lateral kernel.
        excitation: f64 = 1.0, Between(0.0, 100.0);
        /// B: weight of the negative part of the lateral kernel.
        inhibition: f64 = 3.5, Between(0.0, 100.0);
        /// sigma_2: standard deviation of the centre of the lateral kernel, px.
        center_sigma: f64 = 1.25, Between(0.3, 8.0);
        /// sigma_3: standard deviation of the surround of the lateral kernel, px.
        surround_sigma: f64 = 2.5, Between(0.3, 8.0);
        /// e: weight of the surround.
        surround_weight: f64 = 1.2, Between(0.0, 10.0);
        /// rho: constant subtracted from the lateral kernel.
        offset: f64 = 0.0, Between(-1.0, 1.0);
        /// Half width of the lateral kernel, px.
        radius: u32 = 7, Between(1, 24);
        /// sigma_4: width of the excitation between directions, units of 45 degrees.
        direction_center_sigma: f64 = 1.5, Between(0.1, 16.0);
        /// sigma_5: width of the inhibition between directions, units of 45 degrees.
        direction_surround_sigma: f64 = 3.0, Between(0.1, 16.0);
        /// Responses at or below this become exactly zero.
        response_floor: f64 = 1e-12, Between(0.0, 1.0);
    }
}

stage_params! {
    /// ESTMD: ON times delayed OFF. Its lateral kernel is that of the lobula.
    EstmdParams in "estmd" {
        /// (estmd, cascaded) Order of the delay of the OFF signal.
        off_order: u32 = 12, Between(1, 24);
        /// (estmd, cascaded) Time constant of the delay of the OFF signal, frames.
        off_tau: f64 = 25.0, Between(0.01, 500.0);
    }
}

stage_params! {
    /// Elementary motion detectors of the Cascaded model.
    EmdParams in "emd" {
        /// (cascaded) Distance to the upstream pixel, px.
        spacing: f64 = 3.0, Between(0.0, 32.0);
        /// (cascaded) Time constant of the low-pass filter, frames.
        tau: f64 = 12.0, Between(0.01, 500.0);
    }
}

stage_params! {
    /// Rejection of false positives by what their traces do.
    RejectionParams in "rejection" {
        /// "off", "contrast" (the paper) or "motion" (movement relative to the background).
        mode: RejectionMode = RejectionMode::Contrast, Any("\"off\", \"contrast\" or \"motion\"");
        /// Farthest a peak may lie from where its trace was expected, px, at v_opt = 0.
        gate: f64 = 7.0, Between(0.5, 64.0);
        /// How much farther it may lie for faster targets: by the path of so many frames at v_opt.
        gate_frames: f64 = 0.0, Between(0.0, 10.0);
        /// Frames in a row a trace may miss before it ends.
        max_missed: u32 = 2, Between(0, 100);
        /// E is kept within this distance (square) of a confirmed peak, px.
        keep_radius: u32 = 6, Between(0, 64);
        /// "contrast": eta_c, standard deviation of the T1 Gaussians, px.
        contrast_sigma: f64 = 1.5, Between(0.3, 8.0);
        /// "contrast": alpha_c, distance of the T1 Gaussians from the pixel, px.
        contrast_offset: f64 = 3.0, Between(0.0, 32.0);
        /// "contrast": how many last points of a trace are judged.
        contrast_window: u32 = 20, Between(2, 1000);
        /// "contrast": fewest points of a confirmed trace.
        contrast_min_points: u32 = 5, Between(1, 1000);
        /// "contrast": least standard deviation of the contrast along a confirmed trace, luminance.
        contrast_deviation: f64 = 0.06, Between(0.0, 10.0);
        /// "motion": "off" (the camera stands still), "translation" or "similarity" (rotation and zoom too, larger
        /// shifts; a cut of the scene begins everything anew).
        background: BackgroundMotion = BackgroundMotion::Translation, Any("\"off\", \"translation\" or \"similarity\"");
        /// "motion": fewest points of a confirmed trace.
        motion_min_points: u32 = 4, Between(2, 1000);
        /// "motion": the last max(8, ceil(path / v_opt)) points are judged; this is path, px.
        motion_path: f64 = 8.0, Between(0.0, 1000.0);
        /// "motion": least movement relative to the background, px.
        motion_distance: f64 = 3.0, Between(0.0, 1000.0);
        /// "motion": least ratio of net displacement to path length.
        motion_straightness: f64 = 0.5, Between(0.0, 1.0);
    }
}

stage_params! {
    /// Prediction of where targets will be, and the facilitation it gives.
    PredictionParams in "prediction" {
        /// Whether prediction is computed at all; without it Q = E' and there is nothing to attend to.
        enabled: bool = true, Any("true or false");
        /// v_opt: speed the model is tuned to, px/frame.
        v_opt: f64 = 0.25, Between(0.005, 64.0);
        /// dt: how far ahead prediction looks, frames.
        horizon: u32 = 25, Between(1, 250);
        /// zeta: width of the ring in which a target is expected, px.
        ring_width: f64 = 2.0, Between(0.3, 16.0);
        /// eta: concentration of the expected direction.
        concentration: f64 = 2.5, Between(0.0, 50.0);
        /// mu: weight of the present response against the earlier prediction.
        mu: f64 = 0.75, Between(0.0, 1.0);
        /// beta: weight of the predictions in the facilitated response.
        beta: f64 = 1.0, Between(0.0, 100.0);
        /// kappa: how much less recent predictions weigh, 1/frame.
        kappa: f64 = 0.02, Between(0.0, 10.0);
        /// Gains below this share of the largest M become zero, so that predictions do not spread over the whole picture; in a
        /// bank at least 0.001.
        negligible: f64 = 1e-5, Between(0.0, 0.01);
    }
}

stage_params! {
    /// From response to detections.
    DetectionParams in "detection" {
        /// Least response E at a peak.
        threshold: f64 = 0.0, Between(0.0, 1e6);
        /// Least score of a detection: the response Q at its peak; behind a bank 0 to 1, as its scores are.
        least_score: f64 = 0.0, Between(0.0, 1e12);
        /// Most peaks that are followed in one frame, strongest first; in a bank five times `most` of [bank] at most.
        max_peaks: u32 = 100, Between(1, 10_000);
        /// A peak is the maximum of its (2 radius + 1) squared neighbourhood, px.
        peak_radius: u32 = 5, Between(1, 64);
        /// "response": the peak itself; "target": moved forward by the lag of the model, onto the target.
        localise: Localise = Localise::Target, Any("\"response\" or \"target\"");
    }
}

stage_params! {
    /// From detections to tracks: a constant-velocity Kalman filter a track, relative to the moving background.
    TrackingParams in "tracking" {
        /// Detections that make a track, within birth_window frames from the first of them on.
        birth_hits: u32 = 3, Between(1, 1000);
        /// Frames within which a track must have them, or it ends.
        birth_window: u32 = 5, Between(1, 1000);
        /// Least score of a detection that begins a track. Weaker ones only continue tracks.
        birth_score: f64 = 0.0, Between(0.0, 1e12);
        /// Frames in a row that a track lives on without a detection, and never more than it had detections.
        coast: u32 = 30, Between(0, 10_000);
        /// Farthest a detection may lie from where a track is expected, standard deviations of that distance.
        gate: f64 = 3.0, Between(0.5, 10.0);
        /// Farthest it may lie however uncertain the track is, px.
        gate_limit: f64 = 24.0, Between(1.0, 1000.0);
        /// Standard deviation of a detection's place along each axis, px.
        noise: f64 = 1.0, Between(0.1, 32.0);
        /// Standard deviation of the change of velocity from frame to frame, as a share of v_opt.
        acceleration: f64 = 0.1, Between(0.0, 10.0);
        /// Standard deviation of the velocity at a first detection around v_opt in its direction, as a share of v_opt.
        velocity_spread: f64 = 1.0, Between(0.01, 10.0);
        /// How much the direction of a detection counts: this times 1 - cos of its angle to the track is added to the
        /// squared distance in standard deviations.
        direction_weight: f64 = 1.0, Between(0.0, 100.0);
        /// How much it counts that the detector linked a detection to the last one of a track: this is taken off the
        /// squared distance in standard deviations.
        trace_weight: f64 = 2.0, Between(0.0, 100.0);
        /// Whether a track without a detection follows the maximum of the response near where it is expected.
        guide: bool = true, Any("true or false");
        /// Standard deviation of the place of such a maximum along each axis, px.
        guide_noise: f64 = 3.0, Between(0.1, 100.0);
    }
}

stage_params! {
    /// How the numbers are computed; changes speed and rounding only.
    EngineParams in "engine" {
        /// "cascade": recursive gamma filters; "fir": weighted sums over past frames, the slow reference.
        temporal: TemporalEngine = TemporalEngine::Cascade, Any("\"cascade\" or \"fir\"");
    }
}

/// The choice of a model and all parameters. `Default` is apg-STMD as in the paper. Sections of stages that a model has
/// not are ignored.
///
/// ```
/// use apgstmd_core::{Params, Preset};
/// let params = Params::preset(Preset::Practical).for_speed(1.0)?;
/// assert_eq!(params.prediction.horizon, 6);
/// assert_eq!(Params::from_toml(&params.to_toml())?, params);
/// # Ok::<(), apgstmd_core::ParamError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Params {
    /// Which model is computed. [`Params::for_model`] also sets the constants that are its own.
    pub model: Model,
    /// Retina.
    pub retina: RetinaParams,
    /// Attention.
    pub attention: AttentionParams,
    /// Lamina.
    pub lamina: LaminaParams,
    /// Lateral inhibition in the lamina.
    pub lamina_inhibition: LaminaInhibitionParams,
    /// Medulla.
    pub medulla: MedullaParams,
    /// Lobula.
    pub lobula: LobulaParams,
    /// ESTMD.
    pub estmd: EstmdParams,
    /// Elementary motion detectors.
    pub emd: EmdParams,
    /// Rejection.
    pub rejection: RejectionParams,
    /// Prediction.
    pub prediction: PredictionParams,
    /// Detections.
    pub detection: DetectionParams,
    /// Tracks.
    pub tracking: TrackingParams,
    /// Engine.
    pub engine: EngineParams,
}

/// Speeds that [`Params::for_speed`] accepts, px/frame.
pub const SPEED_RANGE: std::ops::RangeInclusive<f64> = 0.01..=32.0;

impl Params {
    /// A ready-made set of apg-STMD.
    pub fn preset(preset: Preset) -> Self {
        Self::default().with_preset(preset)
    }

    /// What a preset changes in parameters as published: `Paper` nothing, `Practical` the rejection, attention, weight of
    /// predictions and localisation.
    #[must_use]
    pub fn with_preset(mut self, preset: Preset) -> Self {
        if preset == Preset::Practical {
            self.rejection.mode = RejectionMode::Motion;
            self.rejection.background = BackgroundMotion::Similarity;
            self.rejection.gate = 2.0;
            self.rejection.gate_frames = 1.5;
            self.rejection.motion_min_points = 3;
            self.attention.scales = vec![2.0];
            self.attention.threshold = 1e-3;
            self.attention.speckles = Speckles::Both;
            self.attention.gate = Gate::Change;
            self.prediction.beta = 10.0;
            self.prediction.negligible = 1e-4;
            self.detection.max_peaks = 200;
            self.detection.localise = Localise::Target;
        }
        self
    }

    /// The same model tuned to `speed` px/frame: with k = speed / v_opt every time constant is divided by k, the horizon
    /// becomes max(1, round(horizon / k)), v_opt keeps the predicted distance v_opt * horizon, and kappa is multiplied by k.
    ///
    /// # Errors
    /// When `speed` is outside [`SPEED_RANGE`], or a scaled constant leaves its own range.
    pub fn for_speed(&self, speed: f64) -> Result<Self, ParamError> {
        if !SPEED_RANGE.contains(&speed) {
            return Err(ParamError::Speed { speed, low: *SPEED_RANGE.start(), high: *SPEED_RANGE.end() });
        }
        let k = speed / self.prediction.v_opt;
        let mut params = self.clone();
        for tau in [
            &mut params.lamina.fast_tau,
            &mut params.lamina.slow_tau,
            &mut params.medulla.mi1_tau,
            &mut params.medulla.tm1_4_tau,
            &mut params.medulla.tm1_5_tau,
            &mut params.lamina_inhibition.excitation_tau,
            &mut params.lamina_inhibition.inhibition_tau,
            &mut params.estmd.off_tau,
            &mut params.emd.tau,
        ] {
            *tau /= k;
        }
        let reach = self.prediction.v_opt * f64::from(self.prediction.horizon);
        let horizon = (f64::from(self.prediction.horizon) / k).round().max(1.0);
        params.prediction.horizon = horizon as u32;
        params.prediction.v_opt = reach / horizon;
        params.prediction.kappa *= k;
        params.validate()?;
        Ok(params)
    }

    /// Every parameter with its documentation and rule, in file order.
    pub fn fields() -> impl Iterator<Item = &'static FieldInfo> {
        [
            RetinaParams::FIELDS,
            AttentionParams::FIELDS,
            LaminaParams::FIELDS,
            LaminaInhibitionParams::FIELDS,
            MedullaParams::FIELDS,
            LobulaParams::FIELDS,
            EstmdParams::FIELDS,
            EmdParams::FIELDS,
            RejectionParams::FIELDS,
            PredictionParams::FIELDS,
            DetectionParams::FIELDS,
            TrackingParams::FIELDS,
            EngineParams::FIELDS,
        ]
        .into_iter()
        .flatten()
    }

    /// Checks every range and the rules between parameters.
    ///
    /// # Errors
    /// Names the field, its value and the rule it breaks.
    pub fn validate(&self) -> Result<(), ParamError> {
        self.retina.check_ranges()?;
        self.attention.check_ranges()?;
        self.lamina.check_ranges()?;
        self.lamina_inhibition.check_ranges()?;
        self.medulla.check_ranges()?;
        self.lobula.check_ranges()?;
        self.estmd.check_ranges()?;
        self.emd.check_ranges()?;
        self.rejection.check_ranges()?;
        self.prediction.check_ranges()?;
        self.detection.check_ranges()?;
        self.tracking.check_ranges()?;
        self.engine.check_ranges()?;
        if self.rejection.motion_min_points > self.motion_window() {
            return Err(ParamError::OutOfRange {
                section: "rejection",
                name: "motion_min_points",
                value: self.rejection.motion_min_points.to_string(),
                rule: format!("must not exceed the {} points that are judged", self.motion_window()),
            });
        }
        if self.rejection.contrast_min_points > self.rejection.contrast_window {
            return Err(ParamError::OutOfRange {
                section: "rejection",
                name: "contrast_min_points",
                value: self.rejection.contrast_min_points.to_string(),
                rule: format!("must not exceed contrast_window = {}", self.rejection.contrast_window),
            });
        }
        if self.attention.gate == Gate::Change && self.attention.support == Support::Masked {
            return Err(ParamError::OutOfRange {
                section: "attention",
                name: "gate",
                value: "\"change\"".to_owned(),
                rule: "must be \"luminance\" where support is \"masked\"".to_owned(),
            });
        }
        if self.tracking.birth_hits > self.tracking.birth_window {
            return Err(ParamError::OutOfRange {
                section: "tracking",
                name: "birth_hits",
                value: self.tracking.birth_hits.to_string(),
                rule: format!("must not exceed birth_window = {}", self.tracking.birth_window),
            });
        }
        let reach = self.prediction.v_opt * f64::from(self.prediction.horizon);
        if reach > 64.0 {
            return Err(ParamError::OutOfRange {
                section: "prediction",
                name: "v_opt",
                value: format!("{:?}", self.prediction.v_opt),
                rule: format!("must keep the predicted distance v_opt * horizon at most 64 px (it is {reach} px)"),
            });
        }
        Ok(())
    }

    /// dt as a count of frames.
    pub(crate) fn horizon(&self) -> usize {
        self.prediction.horizon as usize
    }

    /// Side of the square target that the lobula is tuned to, whole px: the diameter of the excitatory core of lateral
    /// inhibition, where its kernel changes sign, rounded up. 5 with the constants of the paper.
    pub fn target_size(&self) -> f64 {
        let lobula = &self.lobula;
        let gaussian = |sigma: f64, r: f64| (-(r / sigma).powi(2) / 2.0).exp() / (TAU * sigma.powi(2));
        let kernel = |r: f64| {
            let surround = lobula.surround_weight * gaussian(lobula.surround_sigma, r);
            gaussian(lobula.center_sigma, r) - surround - lobula.offset
        };
        let steps = (0..=100 * lobula.radius).map(|step| f64::from(step) / 100.0);
        let core = steps.take_while(|r| kernel(*r) > 0.0).last().unwrap_or(0.0);
        (2.0 * core).ceil().max(1.0)
    }

    /// Farthest a peak may lie from where its trace was expected, px: gate + gate_frames v_opt.
    pub fn gate(&self) -> f64 {
        self.rejection.gate + self.rejection.gate_frames * self.prediction.v_opt
    }

    /// How many last points of a trace the `motion` rejection judges: max(8, ceil(motion_path / v_opt)).
    pub fn motion_window(&self) -> u32 {
        ((self.rejection.motion_path / self.prediction.v_opt).ceil() as u32).max(8)
    }
}
