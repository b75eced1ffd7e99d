//! Centre against surround: g = G(center) - e G(surround) - rho in two dimensions, its parts weighted apart.
//!
//! What depends on the sign of g is not separable. smooth g + core [g]+ is: two separable Gaussians and the core, the few
//! pixels where g is positive. W_s = A [g]+ + B [g]- is B g + (A - B) [g]+.

use std::f64::consts::TAU;

use super::kernel::gaussian_half;
use crate::row::lateral::Lateral;

/// 2-D Gaussians with the factor 1 / (2 pi sigma^2).
pub(crate) struct Opponent {
    pub center_sigma: f64,
    pub surround_sigma: f64,
    /// e.
    pub surround_weight: f64,
    /// rho.
    pub offset: f64,
    pub radius: usize,
}

impl Opponent {
    /// g at a distance of (dy, dx), zero outside of the radius.
    pub fn at(&self, dy: usize, dx: usize) -> f64 {
        if dy.max(dx) > self.radius {
            return 0.0;
        }
        let gaussian = |sigma: f64| {
            let half = gaussian_half(sigma, self.radius);
            half[dy] * half[dx] / (TAU * sigma.powi(2))
        };
        gaussian(self.center_sigma) - self.surround_weight * gaussian(self.surround_sigma) - self.offset
    }

    /// smooth g + core [g]+.
    pub fn parts(&self, smooth: f64, core: f64) -> Lateral {
        let radius = self.radius;
        let (center, surround) = (gaussian_half(self.center_sigma, radius), gaussian_half(self.surround_sigma, radius));
        let center_weight = 1.0 / (TAU * self.center_sigma.powi(2));
        let surround_weight = self.surround_weight / (TAU * self.surround_sigma.powi(2));
        let at = |dy: usize, dx: usize| {
            let gaussians = center_weight * center[dy] * center[dx] - surround_weight * surround[dy] * surround[dx];
            let g: f64 = gaussians - self.offset;
            (core * g.max(0.0) - smooth * self.offset) as f32
        };
        let reach = (0..=radius).rev().find(|r| (0..=*r).any(|i| at(*r, i) != 0.0)).unwrap_or(0);
        let across: Vec<[f64; 2]> = (0..=radius)
            .map(|d| [smooth * center_weight * center[d], -smooth * surround_weight * surround[d]])
            .collect();
        let core: Vec<Vec<f32>> = (0..=reach).map(|dy| (0..=reach).map(|dx| at(dy, dx)).collect()).collect();
        Lateral::new((0..=radius).map(|d| [center[d] as f32, surround[d] as f32]).collect(), &across, &core)
    }
}
