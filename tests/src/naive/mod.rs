//! The naive float64 model of apg-STMD: every stage as its equation reads, every frame kept, nothing clever.
//!
//! It is the oracle for every fast path, and is itself checked against golden data. Written to be compared with the
//! specification line by line; it shares with the fast core only the parameters and the names of the stages.
//!
//! What the specification leaves open and is decided here:
//! - attention: before frame dt, R = 0; at the first frame that has an Omega, R = Omega.
//! - `gate = change`: the lamina filters the sum of all steps P(t) - P(t-1) + alpha R(t) (A(t) - A(t-1)), A without R.
//! - `masked`: A = max min ((P R) * W_a) is added as it is, not multiplied by R again.
//! - rounding to the nearest pixel takes halves away from zero.
//! - a peak's direction and score are read at its pixel; only matched points count in a trace.

pub mod gamma;
pub mod lobula;
pub mod map;
pub mod motion;
pub mod prediction;
pub mod rejection;
pub mod retina;
pub mod rivals;
pub mod shift;

use std::ops::Index;

use apgstmd_core::params::{Gate, Localise};
use apgstmd_core::{DIRECTIONS, Params, Stage};
use ndarray::Array2;

use self::map::{Map, maximum};
use self::motion::{Background, Found, Motion};
use self::rejection::{Confirmed, Traces};

/// A detection in float64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// Column, px.
    pub x: f64,
    /// Row, px.
    pub y: f64,
    /// max over theta of Q at the peak's pixel.
    pub score: f64,
    /// Angle of the vector sum of Q(theta) at the peak's pixel.
    pub direction: f64,
    /// Length of that vector sum over the sum of Q: near 0 the direction means nothing.
    pub directedness: f64,
    /// Number of the trace.
    pub trace: u64,
}

/// Everything about one frame.
pub struct Seen {
    stages: Vec<(Stage, Vec<Map>)>,
    /// The response, of which the output shows the maximum: Q, or E' in models without prediction.
    pub q: Vec<Map>,
    /// Detections, highest score first.
    pub detections: Vec<Detection>,
    /// The background's motion as estimated here.
    pub background: Found,
}

impl Index<Stage> for Seen {
    type Output = [Map];
    fn index(&self, stage: Stage) -> &[Map] {
        let found = self.stages.iter().find(|(own, _)| *own == stage);
        &found.unwrap_or_else(|| panic!("the model has no stage {stage}")).1
    }
}

/// Yes-or-no decisions taken elsewhere, for following another model's rounding: where two models must agree on a
/// threshold, one last bit could otherwise part them for good.
#[derive(Clone, Copy, Default)]
pub struct Decisions<'a> {
    /// Omega of this frame.
    pub region: Option<&'a Map>,
    /// E and C of this frame, from which peaks are found and traces judged.
    pub response: Option<(&'a [Map], &'a [Map])>,
    /// The background's motion in this frame.
    pub motion: Option<Motion>,
    /// R below this counts as 0. By the specification nothing does: a region fades for ever.
    pub faded: f64,
}

/// The model and all it has seen.
pub struct Naive {
    /// Where peaks may lie, if not anywhere.
    pub region: Option<Array2<bool>>,
    params: Params,
    lag: f64,
    contrast_kernels: Vec<Map>,
    attention_kernels: Vec<Vec<Map>>,
    lateral_kernel: Map,
    prediction_kernels: Vec<Map>,
    lamina: [Vec<f64>; 2],
    medulla: [Vec<f64>; 3],
    // One entry a frame, latest last.
    p: Vec<Map>,
    /// What the lamina filters.
    seen: Vec<Map>,
    tm3: Vec<Map>,
    tm2: Vec<Map>,
    f: Vec<Vec<Map>>,
    m: Vec<Map>,
    r: Option<Map>,
    traces: Traces,
    background: Background,
}

impl Naive {
    /// `lag` is how far detections are moved forward with `localise = target`, px.
    pub fn new(params: &Params, lag: f64) -> Self {
        let (lamina, medulla) = (&params.lamina, &params.medulla);
        Self {
            region: None,
            params: params.clone(),
            lag,
            contrast_kernels: retina::contrast_kernels(params),
            attention_kernels: retina::attention_kernels(params),
            lateral_kernel: lobula::lateral_kernel(params),
            prediction_kernels: prediction::prediction_kernels(params),
            lamina: [gamma::taps(lamina.fast_order, lamina.fast_tau), gamma::taps(lamina.slow_order, lamina.slow_tau)],
            medulla: [
                gamma::taps(medulla.mi1_order, medulla.mi1_tau),
                gamma::taps(medulla.tm1_4_order, medulla.tm1_4_tau),
                gamma::taps(medulla.tm1_5_order, medulla.tm1_5_tau),
            ],
            p: Vec::new(),
            seen: Vec::new(),
            tm3: Vec::new(),
            tm2: Vec::new(),
            f: Vec::new(),
            m: Vec::new(),
            r: None,
            traces: Traces::default(),
            background: Background::default(),
        }
    }

    /// M(t - dt) of the frame that comes next, if there is one.
    pub fn past_prediction(&self) -> Option<&Map> {
        let horizon = self.params.prediction.horizon as usize;
        self.m.len().checked_sub(horizon).map(|past| &self.m[past])
    }

    /// One frame of luminance in [0, 1].
    pub fn step(&mut self, frame: &Map) -> Seen {
        self.step_with(frame, Decisions::default())
    }

    /// One frame, with some decisions taken elsewhere.
    pub fn step_with(&mut self, frame: &Map, decisions: Decisions<'_>) -> Seen {
        let params = self.params.clone();
        let zero = Map::zeros(frame.dim());

        let p = retina::retina(frame, &params);
        let background = self.background.step(&p, &params);
        let motion = decisions.motion.unwrap_or(background.motion);
        self.background.shift = motion.shift;
        if background.cut {
            self.traces.end();
            [&mut self.p, &mut self.seen, &mut self.tm3, &mut self.tm2, &mut self.m].into_iter().for_each(Vec::clear);
            self.f.clear();
            self.r = None;
        }
        let c: Vec<Map> = self.contrast_kernels.iter().map(|kernel| map::convolve_replicate(&p, kernel)).collect();

        let attends = params.attention.enabled && params.prediction.enabled;
        if let Some(past) = self.past_prediction() {
            let own = retina::region(past, &params);
            let omega = decisions.region.unwrap_or(&own);
            self.r = Some(match &self.r {
                None => omega.clone(),
                Some(r) => {
                    (r + &((omega - r) / params.attention.ramp)).mapv(|r| if r < decisions.faded { 0.0 } else { r })
                }
            });
        }
        let a = match &self.r {
            Some(r) if attends => retina::attention(&p, r, &self.attention_kernels, &params),
            _ => zero.clone(),
        };
        let p_e = &p + &(&a * params.attention.alpha);
        self.seen.push(match (params.attention.gate, self.seen.last(), self.p.last()) {
            (Gate::Change, Some(seen), Some(before)) => {
                let added = match &self.r {
                    Some(r) if attends => {
                        let speckles = params.attention.speckles;
                        let a = |p| retina::speckles_where(p, r, &self.attention_kernels, speckles);
                        (a(&p) - a(before)) * r * params.attention.alpha
                    }
                    _ => zero.clone(),
                };
                seen + &p - before + added
            }
            _ => p_e.clone(),
        });

        let [fast, slow] = &self.lamina;
        let l = gamma::filter_primed(&self.seen, fast) - gamma::filter_primed(&self.seen, slow);
        let (tm3, tm2) = (l.mapv(|l| l.max(0.0)), l.mapv(|l| (-l).max(0.0)));
        self.tm3.push(tm3.clone());
        self.tm2.push(tm2.clone());
        let mi1 = gamma::filter(&self.tm3, &self.medulla[0]);
        let tm1_4 = gamma::filter(&self.tm2, &self.medulla[1]);
        let tm1_5 = gamma::filter(&self.tm2, &self.medulla[2]);

        let d = lobula::correlation(&tm3, &mi1, &tm1_4, &tm1_5, &params);
        let e = lobula::inhibition(&d, &self.lateral_kernel, &params);

        let (judged_e, judged_c) = decisions.response.unwrap_or((&e, &c));
        let peaks = rejection::peaks(&maximum(judged_e), &params, self.region.as_ref());
        let confirmed = self.traces.step(&peaks, judged_c, &motion, &params);
        let kept = rejection::keep(&e, &confirmed, &params);
        self.p.push(p.clone());

        let (f, m, q) = if params.prediction.enabled {
            let horizon = params.prediction.horizon as usize;
            let past = self.f.len().checked_sub(horizon).map(|past| &self.f[past]);
            let f = prediction::gain(&kept, past, &self.prediction_kernels, &params);
            self.f.push(f.clone());
            let m = f.iter().fold(zero, |sum, f| sum + f);
            let q = prediction::facilitated(&kept, &self.f, &params);
            (f, m, q)
        } else {
            (vec![zero.clone(); DIRECTIONS], zero, kept.clone())
        };
        self.m.push(m.clone());

        let mut detections: Vec<_> =
            confirmed.iter().map(|confirmed| Detection::new(confirmed, &q, &params, self.lag)).collect();
        detections.sort_by(|a, b| b.score.total_cmp(&a.score));
        let stages = vec![
            (Stage::P, vec![p]),
            (Stage::C, c),
            (Stage::A, vec![a]),
            (Stage::Pe, vec![p_e]),
            (Stage::L, vec![l]),
            (Stage::Tm3, vec![tm3]),
            (Stage::Tm2, vec![tm2]),
            (Stage::Mi1, vec![mi1]),
            (Stage::Tm1_4, vec![tm1_4]),
            (Stage::Tm1_5, vec![tm1_5]),
            (Stage::D, d),
            (Stage::E, e),
            (Stage::Ep, kept),
            (Stage::F, f),
            (Stage::M, vec![m]),
            (Stage::Q, q.clone()),
        ];
        Seen { stages, q, detections, background }
    }
}

impl Detection {
    /// Read from the response `q`, in 8 directions or in one map that has none.
    fn new(confirmed: &Confirmed, q: &[Map], params: &Params, lag: f64) -> Self {
        let q: Vec<f64> = q.iter().map(|q| q[confirmed.peak.pixel]).collect();
        let score = q.iter().copied().fold(0.0, f64::max);
        let (x, y) = confirmed.peak.place;
        if q.len() != DIRECTIONS {
            return Self { x, y, score, direction: f64::NAN, directedness: f64::NAN, trace: confirmed.trace };
        }
        let (mut cos, mut sin) = (0.0, 0.0);
        for (k, q) in q.iter().enumerate() {
            cos += q * lobula::theta(k).cos();
            sin += q * lobula::theta(k).sin();
        }
        let direction = sin.atan2(cos);
        let lag = if params.detection.localise == Localise::Target { lag } else { 0.0 };
        Self {
            x: x + lag * direction.cos(),
            y: y - lag * direction.sin(),
            score,
            direction,
            directedness: cos.hypot(sin) / q.iter().sum::<f64>(),
            trace: confirmed.trace,
        }
    }
}
