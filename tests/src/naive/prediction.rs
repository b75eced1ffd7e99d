//! Prediction: F, M, Q.

use apgstmd_core::{DIRECTIONS, Params};

use super::lobula::theta;
use super::map::{Map, convolve_zero, kernel_from};

/// I_0(x), the mean of exp(x cos phi) over the circle: sum of (x/2)^2k / k!^2.
fn bessel_i0(x: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..400 {
        term *= (x / (2.0 * f64::from(k))).powi(2);
        sum += term;
    }
    sum
}

/// W_p for every direction: exp(-(r - R_p)^2 / 2 zeta^2) exp(eta cos(phi - theta)), R_p = v_opt dt, on the square of
/// half width ceil(R_p + 3 zeta), sum 1; at the origin, where phi has no value, the angular factor is its mean.
pub fn prediction_kernels(params: &Params) -> Vec<Map> {
    let prediction = &params.prediction;
    let reach = prediction.v_opt * f64::from(prediction.horizon);
    let radius = (reach + 3.0 * prediction.ring_width).ceil() as usize;
    (0..DIRECTIONS)
        .map(|k| {
            let kernel = kernel_from(radius, |x, y| {
                let radial = (-(x.hypot(y) - reach).powi(2) / (2.0 * prediction.ring_width.powi(2))).exp();
                let angular = if x == 0.0 && y == 0.0 {
                    bessel_i0(prediction.concentration)
                } else {
                    (prediction.concentration * (y.atan2(x) - theta(k)).cos()).exp()
                };
                radial * angular
            });
            let total = kernel.sum();
            kernel / total
        })
        .collect()
}

/// F(t) = (mu E'(t) + (1 - mu) F(t - dt)) * W_p, zero border; `past` is F(t - dt), none before the start.
pub fn gain(kept: &[Map], past: Option<&Vec<Map>>, kernels: &[Map], params: &Params) -> Vec<Map> {
    let mu = params.prediction.mu;
    (0..DIRECTIONS)
        .map(|k| {
            let mut source = &kept[k] * mu;
            if let Some(past) = past {
                source.scaled_add(1.0 - mu, &past[k]);
            }
            convolve_zero(&source, &kernels[k])
        })
        .collect()
}

/// Q(t) = E'(t) + beta * sum over k = 0..=dt of exp(kappa (k - dt)) F(t - k); `gains` is F of every frame, latest last.
pub fn facilitated(kept: &[Map], gains: &[Vec<Map>], params: &Params) -> Vec<Map> {
    let prediction = &params.prediction;
    let horizon = prediction.horizon as usize;
    (0..DIRECTIONS)
        .map(|direction| {
            let mut q = kept[direction].clone();
            for (k, gain) in gains.iter().rev().take(horizon + 1).enumerate() {
                let weight = (prediction.kappa * (k as f64 - horizon as f64)).exp();
                q.scaled_add(prediction.beta * weight, &gain[direction]);
            }
            q
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessel() {
        // Abramowitz and Stegun, table 9.8.
        assert!((bessel_i0(0.0) - 1.0).abs() < 1e-15);
        assert!((bessel_i0(2.5) - 3.289_839_144_050_123).abs() < 1e-14);
    }
}
