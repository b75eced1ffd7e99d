//! The kernels of the model as maps and as curves over time, to look at. The stages keep them in forms of their own.
//!
//! Row 0 is the uppermost one; the centre is the origin.

use std::f64::consts::PI;

use ndarray::Array2;

use crate::filter::gamma::{Gamma, Response};
use crate::filter::kernel::{gaussian_half, sum_of_half};
use crate::params::Params;
use crate::stage::{lobula, prediction};

/// W_a = 2 (c - u^2) / (pi s^4) exp(-(x^2 + y^2) / 2 s^2), u = x cos phi + y sin phi, y upward, radius ceil(4 s). c makes
/// it sum to zero.
pub fn attention(scale: f64, orientation: f64) -> Array2<f64> {
    let radius = (4.0 * scale).ceil() as usize;
    let half = gaussian_half(scale, radius);
    let moment: Vec<f64> = half.iter().enumerate().map(|(t, g)| (t * t) as f64 * g).collect();
    let center = sum_of_half(&moment) / sum_of_half(&half);
    let (sin, cos) = orientation.sin_cos();
    Array2::from_shape_fn((2 * radius + 1, 2 * radius + 1), |(row, column)| {
        let (x, y) = (column as f64 - radius as f64, radius as f64 - row as f64);
        let along = x * cos + y * sin;
        let gaussian = half[row.abs_diff(radius)] * half[column.abs_diff(radius)];
        2.0 * (center - along * along) / (PI * scale.powi(4)) * gaussian
    })
}

/// W_p for a direction of motion: where a target that is at the origin now will be after dt frames. Unit sum.
pub fn prediction(params: &Params, direction: f64) -> Array2<f64> {
    let radius = prediction::reach(params);
    let side = 2 * radius + 1;
    Array2::from_shape_vec((side, side), prediction::kernel(params, radius, direction)).expect("a square of that side")
}

/// W_s = `A [g]+ + B [g]-`, g = G(sigma_2) - e G(sigma_3) - rho: lateral inhibition in the lobula.
pub fn lateral(params: &Params) -> Array2<f64> {
    let g = lobula::opponent(&params.lobula);
    let side = 2 * g.radius + 1;
    Array2::from_shape_fn((side, side), |(row, column)| {
        let value = g.at(row.abs_diff(g.radius), column.abs_diff(g.radius));
        let weight = if value > 0.0 { params.lobula.excitation } else { params.lobula.inhibition };
        weight * value
    })
}

/// The gamma kernels of lamina and medulla by name: tap i is what a frame i frames ago weighs, for luminance that runs
/// linearly from frame to frame. Unit sum each, up to 1e-10.
pub fn temporal(params: &Params) -> [(&'static str, Vec<f64>); 5] {
    let (lamina, medulla) = (&params.lamina, &params.medulla);
    let taps = |order, tau| Gamma { order, tau }.taps(Response::Impulse);
    [
        ("lamina fast", taps(lamina.fast_order, lamina.fast_tau)),
        ("lamina slow", taps(lamina.slow_order, lamina.slow_tau)),
        ("Mi1", taps(medulla.mi1_order, medulla.mi1_tau)),
        ("Tm1_4", taps(medulla.tm1_4_order, medulla.tm1_4_tau)),
        ("Tm1_5", taps(medulla.tm1_5_order, medulla.tm1_5_tau)),
    ]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_4;

    use super::*;

    #[test]
    fn sums_and_places() {
        for k in 0..4 {
            let kernel = attention(3.0, f64::from(k) * FRAC_PI_4);
            assert!(kernel.sum().abs() < 1e-12, "{}", kernel.sum());
            assert!(kernel.iter().all(|value| *value <= kernel[(12, 12)]));
        }
        // phi = pi/4: dark lobes to the upper right and the lower left.
        let kernel = attention(3.0, FRAC_PI_4);
        assert!(kernel[(8, 16)] < 0.0 && kernel[(16, 8)] < 0.0 && kernel[(8, 8)] > 0.0);

        let kernel = prediction(&Params::default(), 0.0);
        assert!((kernel.sum() - 1.0).abs() < 1e-12);
        let ((y, x), _) = kernel.indexed_iter().max_by(|a, b| a.1.total_cmp(b.1)).expect("it has values");
        // v_opt dt = 6.25 px to the right, radius 13.
        assert_eq!((x, y), (13 + 6, 13));
    }

    #[test]
    fn lateral_inhibition_and_time() {
        let params = Params::default();
        let kernel = lateral(&params);
        let radius = params.lobula.radius as usize;
        assert_eq!(kernel.dim(), (2 * radius + 1, 2 * radius + 1));
        // G(1.25) - 1.2 G(2.5) at the origin, weighted by A = 1; 3 px away it inhibits, weighted by B = 3.5.
        let g = |sigma: f64, r: f64| (-(r / sigma).powi(2) / 2.0).exp() / (2.0 * PI * sigma.powi(2));
        let wanted = |weight: f64, r: f64| weight * (g(1.25, r) - 1.2 * g(2.5, r));
        assert!((kernel[(radius, radius)] - wanted(1.0, 0.0)).abs() < 1e-15);
        assert!((kernel[(radius + 3, radius)] - wanted(3.5, 3.0)).abs() < 1e-15);
        for (name, taps) in temporal(&params) {
            assert!((taps.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{name}");
        }
        // Of all kernels the slowest peaks last: tau = 40 frames.
        let taps = &temporal(&params)[4].1;
        let peak = (0..taps.len()).max_by(|a, b| taps[*a].total_cmp(&taps[*b])).expect("it has taps");
        assert!(peak.abs_diff(40) <= 1, "{peak}");
    }
}
