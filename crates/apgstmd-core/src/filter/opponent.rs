//! Centre against surround: g = G(center) - e G(surround) - rho in two dimensions, its parts weighted apart.
//!
//! What depends on the sign of g is not separable. smooth g + core [g]+ is: two separable Gaussians and the core, the few
//! pixels where g is positive. W_s = A [g]+ + B [g]- is B g + (A - B) [g]+.

use std::f64::consts::TAU;

use super::kernel::gaussian_half;
use crate::row::convolve::Lateral;

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
    /// smooth g + core [g]+: taps of both Gaussians along rows, and what follows across rows.
    pub fn parts(&self, smooth: f64, core: f64) -> (Vec<[f32; 2]>, Lateral) {
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
        let along = (0..=radius).map(|d| [center[d] as f32, surround[d] as f32]).collect();
        let across = (0..=radius)
            .map(|d| [(smooth * center_weight * center[d]) as f32, (-smooth * surround_weight * surround[d]) as f32])
            .collect();
        let core = (0..=2 * reach)
            .flat_map(|row| (0..=2 * reach).map(move |column| (row, column)))
            .map(|(row, column)| (row, column, at(row.abs_diff(reach), column.abs_diff(reach))))
            .filter(|(_, _, tap)| *tap != 0.0)
            .collect();
        (along, Lateral { across, reach, core })
    }
}
