//! Kernels over space, sampled and normalised in f64 once, at construction.

use std::f64::consts::TAU;

/// exp(-t^2 / 2 sigma^2) for t = 0..=radius.
pub(crate) fn gaussian_half(sigma: f64, radius: usize) -> Vec<f64> {
    (0..=radius).map(|t| (-(t as f64).powi(2) / (2.0 * sigma * sigma)).exp()).collect()
}

/// Sum over -radius..=radius of a symmetric kernel given by its half.
pub(crate) fn sum_of_half(half: &[f64]) -> f64 {
    half[0] + 2.0 * half[1..].iter().sum::<f64>()
}

/// The 1-D normal density.
pub(crate) fn normal(x: f64, sigma: f64) -> f64 {
    (-x * x / (2.0 * sigma * sigma)).exp() / (sigma * TAU.sqrt())
}

/// Modified Bessel function I_0.
pub(crate) fn bessel_i0(x: f64) -> f64 {
    let mut term = 1.0;
    let mut sum = 1.0;
    for k in 1..200 {
        term *= (x / (2.0 * f64::from(k))).powi(2);
        sum += term;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bessel_is_the_mean_of_the_exponential_around_the_circle() {
        for eta in [0.0, 1.0, 2.5, 20.0] {
            let mean = (0..1000).map(|i| (eta * (TAU * f64::from(i) / 1000.0).cos()).exp()).sum::<f64>() / 1000.0;
            assert!((bessel_i0(eta) / mean - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn gaussian_sums() {
        let half = gaussian_half(1.5, 12);
        // A Gaussian of 1.5 px is sampled well enough for its sum to be its integral.
        assert!((sum_of_half(&half) - 1.5 * TAU.sqrt()).abs() < 1e-9);
        assert!((normal(0.0, 1.5) - 1.0 / (1.5 * TAU.sqrt())).abs() < 1e-15);
    }
}
