//! The naive float64 models beside apg-STMD, as the specification's section on them reads: ESTMD, Cascaded, DSTMD, STMD+.
//!
//! What it leaves open and is decided here: the lateral kernels meet zero outside the picture, as in the lobula; a
//! discrete exponential runs over i = 0, 1, 2, ...; every filter's past before the first frame is zero (L is zero then);
//! responses at or below `response_floor` are zero in Y and in the motion detectors as in E.

use apgstmd_core::{DIRECTIONS, Model, Params, Stage};

use super::lobula::{correlation, inhibition, lateral_kernel, upstream};
use super::map::{Map, convolve_replicate, convolve_zero, kernel_from, maximum};
use super::motion::Background;
use super::rejection::{Traces, keep, peaks};
use super::{Decisions, Detection, Seen, gamma, retina};

/// A model and all it has seen.
pub struct Rival {
    params: Params,
    lag: f64,
    contrast_kernels: Vec<Map>,
    lateral_kernel: Map,
    /// [h]+ and [h]-, and the filters behind them.
    lamina_kernels: [Map; 2],
    lamina_exponentials: [Vec<f64>; 2],
    lamina: [Vec<f64>; 2],
    medulla: [Vec<f64>; 3],
    off_delay: Vec<f64>,
    low_pass: Vec<f64>,
    traces: Traces,
    background: Background,
    // One entry a frame, latest last.
    p: Vec<Map>,
    excitation: Vec<Map>,
    inhibition: Vec<Map>,
    tm3: Vec<Map>,
    tm2: Vec<Map>,
    off: Vec<Map>,
    y: Vec<Map>,
}

/// h = G(center) - G(surround), 2-D, cut off at `radius`.
pub fn lamina_kernel(params: &Params) -> Map {
    let inhibition = &params.lamina_inhibition;
    let gauss =
        |x: f64, y: f64, s: f64| (-(x * x + y * y) / (2.0 * s * s)).exp() / (2.0 * std::f64::consts::PI * s * s);
    kernel_from(inhibition.radius as usize, |x, y| {
        gauss(x, y, inhibition.center_sigma) - gauss(x, y, inhibition.surround_sigma)
    })
}

/// exp(-i / tau), i = 0, 1, 2, ..., of unit sum.
fn exponential(tau: f64) -> Vec<f64> {
    let taps: Vec<f64> = (0..).map(|i| (-f64::from(i) / tau).exp()).take_while(|tap| *tap > 1e-16).collect();
    let total: f64 = taps.iter().sum();
    taps.into_iter().map(|tap| tap / total).collect()
}

impl Rival {
    /// `lag` is how far detections are moved forward with `localise = target`, px.
    pub fn new(params: &Params, lag: f64) -> Self {
        let Params { lamina, lamina_inhibition, medulla, estmd, emd, .. } = params;
        let h = lamina_kernel(params);
        Self {
            params: params.clone(),
            lag,
            contrast_kernels: retina::contrast_kernels(params),
            lateral_kernel: lateral_kernel(params),
            lamina_kernels: [h.mapv(|h| h.max(0.0)), h.mapv(|h| h.min(0.0))],
            lamina_exponentials: [lamina_inhibition.excitation_tau, lamina_inhibition.inhibition_tau].map(exponential),
            lamina: [gamma::taps(lamina.fast_order, lamina.fast_tau), gamma::taps(lamina.slow_order, lamina.slow_tau)],
            medulla: [
                gamma::taps(medulla.mi1_order, medulla.mi1_tau),
                gamma::taps(medulla.tm1_4_order, medulla.tm1_4_tau),
                gamma::taps(medulla.tm1_5_order, medulla.tm1_5_tau),
            ],
            off_delay: gamma::taps(estmd.off_order, estmd.off_tau),
            low_pass: exponential(emd.tau),
            traces: Traces::default(),
            background: Background::default(),
            p: Vec::new(),
            excitation: Vec::new(),
            inhibition: Vec::new(),
            tm3: Vec::new(),
            tm2: Vec::new(),
            off: Vec::new(),
            y: Vec::new(),
        }
    }

    /// One frame of luminance in [0, 1], with some decisions taken elsewhere.
    pub fn step_with(&mut self, frame: &Map, decisions: Decisions<'_>) -> Seen {
        let p = retina::retina(frame, &self.params);
        let c: Vec<Map> = self.contrast_kernels.iter().map(|kernel| convolve_replicate(&p, kernel)).collect();
        let background = self.background.step(&p, &self.params);
        let motion = decisions.motion.unwrap_or(background.motion);
        self.background.shift = motion.shift;
        if background.cut {
            self.traces.end();
            let Self { p, excitation, inhibition, tm3, tm2, off, y, .. } = self;
            [p, excitation, inhibition, tm3, tm2, off, y].into_iter().for_each(Vec::clear);
        }
        self.p.push(p.clone());
        let [fast, slow] = &self.lamina;
        let l = gamma::filter_primed(&self.p, fast) - gamma::filter_primed(&self.p, slow);
        let mut stages = vec![(Stage::P, vec![p]), (Stage::C, c.clone()), (Stage::L, vec![l.clone()])];

        let e = match self.params.model {
            Model::ApgStmd => unreachable!("the subject has its own naive model"),
            Model::StmdPlus => self.stmd(l, &mut stages),
            Model::Dstmd => {
                let l1 = self.inhibited(&l, &mut stages);
                self.stmd(l1, &mut stages)
            }
            Model::Cascaded => {
                let l1 = self.inhibited(&l, &mut stages);
                let y = self.estmd(&l1, &mut stages);
                self.motion_detectors(y, &mut stages)
            }
            Model::Estmd => {
                let l1 = self.inhibited(&l, &mut stages);
                vec![self.estmd(&l1, &mut stages)]
            }
        };

        let (judged_e, judged_c) = decisions.response.unwrap_or((&e, &c));
        let confirmed =
            self.traces.step(&peaks(&maximum(judged_e), &self.params, None), judged_c, &motion, &self.params);
        let q = keep(&e, &confirmed, &self.params);
        if self.params.model.is_directional() {
            stages.push((Stage::Ep, q.clone()));
        }
        let mut detections: Vec<_> =
            confirmed.iter().map(|confirmed| Detection::new(confirmed, &q, &self.params, self.lag)).collect();
        detections.sort_by(|a, b| b.score.total_cmp(&a.score));
        Seen { stages, q, detections, background }
    }

    /// L1 = ([h]+ * L) filtered by exp(-t / 3) + ([h]- * L) filtered by exp(-t / 9).
    fn inhibited(&mut self, l: &Map, stages: &mut Vec<(Stage, Vec<Map>)>) -> Map {
        self.excitation.push(convolve_zero(l, &self.lamina_kernels[0]));
        self.inhibition.push(convolve_zero(l, &self.lamina_kernels[1]));
        let l1 = gamma::filter(&self.excitation, &self.lamina_exponentials[0])
            + gamma::filter(&self.inhibition, &self.lamina_exponentials[1]);
        stages.push((Stage::L1, vec![l1.clone()]));
        l1
    }

    /// Medulla and lobula.
    fn stmd(&mut self, l: Map, stages: &mut Vec<(Stage, Vec<Map>)>) -> Vec<Map> {
        let (tm3, tm2) = (l.mapv(|l| l.max(0.0)), l.mapv(|l| (-l).max(0.0)));
        self.tm3.push(tm3.clone());
        self.tm2.push(tm2.clone());
        let mi1 = gamma::filter(&self.tm3, &self.medulla[0]);
        let [tm1_4, tm1_5] = [1, 2].map(|delay| gamma::filter(&self.tm2, &self.medulla[delay]));
        let d = correlation(&tm3, &mi1, &tm1_4, &tm1_5, &self.params);
        let e = inhibition(&d, &self.lateral_kernel, &self.params);
        let signals =
            [(Stage::Tm3, tm3), (Stage::Tm2, tm2), (Stage::Mi1, mi1), (Stage::Tm1_4, tm1_4), (Stage::Tm1_5, tm1_5)];
        stages.extend(signals.map(|(stage, map)| (stage, vec![map])));
        stages.extend([(Stage::D, d), (Stage::E, e.clone())]);
        e
    }

    /// Y(t) = ON(t) (Gamma(12, 25) * OFF)(t).
    fn estmd(&mut self, l1: &Map, stages: &mut Vec<(Stage, Vec<Map>)>) -> Map {
        let [on, off] = [1.0, -1.0].map(|sign| {
            let part = l1.mapv(|l| (sign * l).max(0.0));
            convolve_zero(&part, &self.lateral_kernel).mapv(|v| v.max(0.0))
        });
        self.off.push(off.clone());
        let delayed = gamma::filter(&self.off, &self.off_delay);
        let y = (&on * &delayed).mapv(|y| self.floored(y));
        let signals = [(Stage::ON, on), (Stage::OFF, off), (Stage::OFFd, delayed), (Stage::Y, y.clone())];
        stages.extend(signals.map(|(stage, map)| (stage, vec![map])));
        y
    }

    /// max(Y(x) LP[Y](x_up) - LP[Y](x) Y(x_up), 0), zero where the upstream pixel lies outside.
    fn motion_detectors(&mut self, y: Map, stages: &mut Vec<(Stage, Vec<Map>)>) -> Vec<Map> {
        self.y.push(y.clone());
        let slow = gamma::filter(&self.y, &self.low_pass);
        let (height, width) = y.dim();
        let e: Vec<Map> = (0..DIRECTIONS)
            .map(|k| {
                let (down, right) = upstream(k, self.params.emd.spacing);
                Map::from_shape_fn((height, width), |(row, column)| {
                    let (up_row, up_column) = (row as isize + down, column as isize + right);
                    if up_row < 0 || up_row >= height as isize || up_column < 0 || up_column >= width as isize {
                        return 0.0;
                    }
                    let (here, up) = ([row, column], [up_row as usize, up_column as usize]);
                    self.floored(y[here] * slow[up] - slow[here] * y[up])
                })
            })
            .collect();
        stages.extend([(Stage::Yd, vec![slow]), (Stage::E, e.clone())]);
        e
    }

    fn floored(&self, value: f64) -> f64 {
        if value <= self.params.lobula.response_floor { 0.0 } else { value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponentials() {
        let taps = exponential(3.0);
        assert!((taps.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        assert!((taps[4] / taps[1] - (-1.0f64).exp()).abs() < 1e-14);
    }

    #[test]
    fn the_centre_excites_and_the_surround_inhibits() {
        let h = lamina_kernel(&Params::for_model(Model::Dstmd));
        assert_eq!(h.dim(), (11, 11));
        // G(1.5) and G(3) meet at r^2 = 2 ln 4 / (1 / 2.25 - 1 / 9) = 8.3: (2, 2) is still inside.
        assert!(h[[5, 5]] > 0.0 && h[[7, 7]] > 0.0 && h[[5, 8]] < 0.0 && h[[0, 5]] < 0.0);
    }
}
