//! Differences that rounding of the input alone explains, stage by stage: [`LUMINANCE_ROUNDING`] carried through the
//! model; the rounding of kernels that are a difference of Gaussians, as far as these cancel; and what is lost with gains that
//! are let go as negligible. Only where a stage is tiny (first frames, faint scenes) does it exceed [`crate::compare::RELATIVE`] of its maximum.

use std::f64::consts::{PI, TAU};

use apgstmd_core::{Model, Params, Stage};

use crate::naive::Seen;
use crate::naive::lobula::{direction_weight, lateral_kernel};
use crate::naive::map::{Map, kernel_from, peak};
use crate::naive::rivals::lamina_kernel;

/// Rounding of luminance: one unit in the last place of 1.0 in f32. P_e, L and what follows L linearly cannot be
/// nearer to the truth than this, however small they are.
pub const LUMINANCE_ROUNDING: f64 = 1.2e-7;

/// A sum of so many terms is rounded by up to half a unit in the last place as often: five standard deviations of that, in units.
fn rounded(terms: f64) -> f64 {
    5.0 * (terms / 12.0).sqrt()
}

/// A separable kernel is a sum along rows, and one along columns.
fn separable(width: f64) -> f64 {
    rounded(2.0 * width)
}

/// What a model makes of rounding.
pub struct Floors {
    model: Model,
    /// Of P, as a multiple of the rounding of luminance. Its sums stay below 1, where units are half as large.
    retina_parts: f64,
    lamina_gain: f64,
    /// Of the Gaussians that the kernel is the difference of: rounding is a share of these, however much of them cancels.
    lamina_parts: f64,
    lateral_gain: f64,
    lateral_parts: f64,
    directional_gain: f64,
    facilitation_gain: f64,
    /// Of A, as a multiple of the rounding of luminance.
    attention_parts: f64,
    alpha: f64,
    /// Of C, as a multiple of the rounding of luminance.
    contrast_parts: f64,
    /// The largest floors so far of L1, of ON and OFF, of Y and of the response, which delays and low-pass filters remember.
    signal: f64,
    part: f64,
    y: f64,
    response: f64,
    /// Share of the largest M so far that a gain may be short of the truth. A frame lets go what is below `negligible` of
    /// the frame before, and what earlier ones lost comes with weight 1 - mu.
    lost: f64,
    /// Largest M of the frames before.
    gains: f64,
    /// Responses at or below are zero.
    least: f64,
}

impl Floors {
    /// For a model with these parameters.
    pub fn new(params: &Params) -> Self {
        let absolute = |kernel: Map| kernel.iter().map(|w| w.abs()).sum();
        let Params { prediction, lamina_inhibition, lobula, .. } = params;
        let gaussians = |radius: u32, weights: [(f64, f64); 2]| {
            let density = |x: f64, y: f64, s: f64| (-(x * x + y * y) / (2.0 * s * s)).exp() / (TAU * s * s);
            let sum =
                kernel_from(radius as usize, |x, y| weights.iter().map(|(weight, s)| weight * density(x, y, *s)).sum());
            separable(2.0 * f64::from(radius) + 1.0) * sum.sum()
        };
        let (center, surround) = (lamina_inhibition.center_sigma, lamina_inhibition.surround_sigma);
        let window: f64 = (0..=prediction.horizon).map(|k| (-prediction.kappa * f64::from(k)).exp()).sum();
        Self {
            model: params.model,
            retina_parts: (separable(2.0 * (4.0 * params.retina.sigma).ceil() + 1.0) / 2.0).max(1.0),
            lamina_gain: absolute(lamina_kernel(params)),
            lamina_parts: gaussians(lamina_inhibition.radius, [(1.0, center), (1.0, surround)]),
            lateral_gain: absolute(lateral_kernel(params)),
            // The offset is a part of the core, which is one tap a pixel.
            lateral_parts: lobula.inhibition.max(lobula.excitation)
                * gaussians(
                    lobula.radius,
                    [(1.0, lobula.center_sigma), (lobula.surround_weight, lobula.surround_sigma)],
                ),
            directional_gain: (0..8).map(|steps| direction_weight(steps, params).abs()).sum(),
            facilitation_gain: 1.0 + prediction.beta * window,
            // Both parts of W_a, sigma^2 and u^2 times its Gaussian, come to sqrt(2 / pi), however much of them cancels.
            attention_parts: params.attention.scales.iter().fold(1.0, |most, sigma| {
                let width = 2.0 * (4.0 * sigma).ceil() + 1.0;
                most.max(2.0 * (2.0 / PI).sqrt() * separable(width))
            }),
            alpha: params.attention.alpha,
            contrast_parts: {
                let radius = (params.rejection.contrast_offset + 4.0 * params.rejection.contrast_sigma).ceil();
                rounded((2.0 * radius + 1.0).powi(2))
            },
            signal: 0.0,
            part: 0.0,
            y: 0.0,
            response: 0.0,
            lost: prediction.negligible / prediction.mu,
            gains: 0.0,
            least: lobula.response_floor,
        }
    }

    /// The floors of this frame, by stage, where E is `e`. Rounding decides whether a response at the least one is zero.
    pub fn of(&mut self, seen: &Seen, e: &[Map]) -> impl Fn(Stage) -> f64 + use<> {
        let has = |stage| self.model.stages().contains(&stage);
        let most = |stage| if has(stage) { peak(&seen[stage]) } else { 0.0 };
        let luminance = LUMINANCE_ROUNDING * most(Stage::P).max(most(Stage::Pe)).max(1.0);
        let blurred = luminance * self.retina_parts;
        let enhanced = blurred * if has(Stage::Pe) { 1.0 + self.alpha } else { 1.0 };
        let cancelled = |stage, parts: f64| LUMINANCE_ROUNDING * parts * most(stage);
        let inhibited = enhanced * self.lamina_gain + cancelled(Stage::L, self.lamina_parts);
        self.signal = self.signal.max(if has(Stage::L1) { inhibited } else { enhanced });
        let signal = self.signal;
        // Product rule for Tm3 (Tm1_4 + Mi1) Tm1_5.
        let [on, delayed_on, off_4, off_5] = [Stage::Tm3, Stage::Mi1, Stage::Tm1_4, Stage::Tm1_5].map(most);
        let sum = off_4 + delayed_on;
        let correlation = signal * (sum * off_5 + 2.0 * on * off_5 + on * sum);
        // And for ON OFFd and Y Yd_up - Yd Y_up.
        let part = signal * self.lateral_gain + cancelled(Stage::L1, self.lateral_parts);
        self.part = self.part.max(part);
        let y = part * most(Stage::OFFd) + self.part * most(Stage::ON);
        self.y = self.y.max(y);
        let detector = 2.0 * (y * most(Stage::Yd) + self.y * most(Stage::Y));
        let lateral = correlation * self.lateral_gain + cancelled(Stage::D, self.lateral_parts);
        let mut response = if has(Stage::D) { lateral * self.directional_gain } else { detector };
        if has(Stage::E) {
            let highest = self.least + response;
            let either = |(a, b): (&f64, &f64)| (*a == 0.0) != (*b == 0.0) && a.max(*b) <= highest;
            if seen[Stage::E].iter().zip(e).any(|(a, b)| a.iter().zip(b).any(either)) {
                response = response.max(highest);
            }
        }
        // Predictions and low-pass filters remember earlier frames.
        self.response = self.response.max(response);
        let (remembered, gain) = (self.response, self.facilitation_gain);
        let (delayed, slow, attention, contrast) = (self.part, self.y, self.attention_parts, self.contrast_parts);
        let lost = self.lost * self.gains;
        self.gains = self.gains.max(most(Stage::M));
        move |stage| match stage {
            Stage::P => blurred,
            Stage::C => luminance * contrast,
            Stage::A => luminance * attention,
            Stage::Pe | Stage::L => enhanced,
            Stage::L1 | Stage::Tm3 | Stage::Tm2 | Stage::Mi1 | Stage::Tm1_4 | Stage::Tm1_5 => signal,
            Stage::ON | Stage::OFF => part,
            Stage::OFFd => delayed,
            Stage::Y => y,
            Stage::Yd => slow,
            Stage::D => correlation,
            Stage::E | Stage::Ep => response,
            Stage::F => remembered.max(lost),
            Stage::M => 8.0 * remembered.max(lost),
            Stage::Q => gain * remembered.max(lost),
        }
    }
}
