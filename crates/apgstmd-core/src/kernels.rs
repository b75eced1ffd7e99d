//! The kernels of attention and prediction as maps, to look at. The stages keep them in forms of their own.
//!
//! Row 0 is the uppermost one; the centre is the origin.

use std::f64::consts::PI;

use ndarray::Array2;

use crate::filter::kernel::{gaussian_half, sum_of_half};
use crate::params::Params;
use crate::stage::prediction;

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
}
