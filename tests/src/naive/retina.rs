//! Retina: P. Attention: A, P_e. T1: C.

use apgstmd_core::Params;
use apgstmd_core::params::{Speckles, Support};

use super::map::{Map, convolve_replicate, convolve_replicate_at, convolve_zero, kernel_from};

/// P = I * G(sigma_1): radius ceil(4 sigma_1), taps normalised to sum 1, replicate border.
pub fn retina(frame: &Map, params: &Params) -> Map {
    let sigma = params.retina.sigma;
    let gauss = kernel_from((4.0 * sigma).ceil() as usize, |x, y| (-(x * x + y * y) / (2.0 * sigma * sigma)).exp());
    // The 2-D kernel normalised to sum 1 is the product of the two 1-D kernels normalised to sum 1.
    let total = gauss.sum();
    convolve_replicate(frame, &(gauss / total))
}

/// T1 contrast kernels: a unit Gaussian `contrast_offset` px ahead along phi_j = j pi/4, minus the same behind.
/// "Unit" is the density 1 / (2 pi eta^2), not normalised by its samples.
pub fn contrast_kernels(params: &Params) -> Vec<Map> {
    let (sigma, offset) = (params.rejection.contrast_sigma, params.rejection.contrast_offset);
    let gauss = |x: f64, y: f64| {
        (-(x * x + y * y) / (2.0 * sigma * sigma)).exp() / (2.0 * std::f64::consts::PI * sigma * sigma)
    };
    let radius = (offset + 4.0 * sigma).ceil() as usize;
    (0..4)
        .map(|j| {
            let (sin, cos) = (f64::from(j) * std::f64::consts::FRAC_PI_4).sin_cos();
            let (ax, ay) = (offset * cos, offset * sin);
            kernel_from(radius, |x, y| gauss(x - ax, y - ay) - gauss(x + ax, y + ay))
        })
        .collect()
}

/// W_a, `[scale][orientation]`.
pub fn attention_kernels(params: &Params) -> Vec<Vec<Map>> {
    let kernel = |s: f64, phi: f64| {
        let radius = (4.0 * s).ceil() as usize;
        let g = |t: f64| (-t * t / (2.0 * s * s)).exp();
        let support = || (-(radius as i32)..=radius as i32).map(f64::from);
        let c = support().map(|t| t * t * g(t)).sum::<f64>() / support().map(g).sum::<f64>();
        kernel_from(radius, |x, y| {
            let u = x * phi.cos() + y * phi.sin();
            2.0 * (c - u * u) / (std::f64::consts::PI * s.powi(4)) * (-(x * x + y * y) / (2.0 * s * s)).exp()
        })
    };
    let orientations = |s: f64| (0..4).map(|j| kernel(s, f64::from(j) * std::f64::consts::FRAC_PI_4)).collect();
    params.attention.scales.iter().map(|s| orientations(*s)).collect()
}

/// Omega = { M(t - dt) > max(threshold * max M(t - dt), floor) }; the maximum is that of the whole map.
pub fn region(m_past: &Map, params: &Params) -> Map {
    let level = threshold(m_past, params);
    m_past.mapv(|m| if m > level { 1.0 } else { 0.0 })
}

/// The level that M(t - dt) must exceed.
pub fn threshold(m_past: &Map, params: &Params) -> f64 {
    let most = m_past.iter().fold(0.0, |a: f64, b| a.max(*b));
    (params.attention.threshold * most).max(params.attention.threshold_floor)
}

/// A, as it is added to P with weight alpha: `full`: of P, replicate border, times R; `masked`: of P R, zero border, kept
/// everywhere.
pub fn attention(p: &Map, r: &Map, kernels: &[Vec<Map>], params: &Params) -> Map {
    let speckles = params.attention.speckles;
    match params.attention.support {
        Support::Full => speckles_where(p, r, kernels, speckles) * r,
        Support::Masked => {
            let masked = p * r;
            let convolved = |kernel: &Map| convolve_zero(&masked, kernel);
            let responses: Vec<Vec<Map>> = kernels.iter().map(|scale| scale.iter().map(convolved).collect()).collect();
            Map::from_shape_fn(p.dim(), |at| {
                let here: Vec<Vec<f64>> =
                    responses.iter().map(|scale| scale.iter().map(|map| map[at]).collect()).collect();
                chosen(&here, speckles)
            })
        }
    }
}

/// A without R, at the pixels where `r` is not zero; zero elsewhere.
pub fn speckles_where(p: &Map, r: &Map, kernels: &[Vec<Map>], speckles: Speckles) -> Map {
    Map::from_shape_fn(p.dim(), |(y, x)| {
        if r[[y, x]] == 0.0 {
            return 0.0;
        }
        let here: Vec<Vec<f64>> = kernels
            .iter()
            .map(|scale| scale.iter().map(|kernel| convolve_replicate_at(p, kernel, y, x)).collect())
            .collect();
        chosen(&here, speckles)
    })
}

/// The choice among the responses at one pixel, `[scale][orientation]`.
fn chosen(responses: &[Vec<f64>], speckles: Speckles) -> f64 {
    let least = |scale: &Vec<f64>| scale.iter().copied().fold(f64::INFINITY, f64::min);
    let greatest = |scale: &Vec<f64>| scale.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let light = responses.iter().map(least).fold(f64::NEG_INFINITY, f64::max);
    let dark = responses.iter().map(greatest).fold(f64::INFINITY, f64::min);
    match speckles {
        Speckles::Light => light,
        Speckles::Both => light.max(0.0) + dark.min(0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_luminance_attracts_nothing() {
        for kernel in attention_kernels(&Params::default()).iter().flatten() {
            assert!(kernel.sum().abs() < 1e-14);
        }
        for kernel in contrast_kernels(&Params::default()) {
            assert!(kernel.sum().abs() < 1e-14);
        }
    }
}
