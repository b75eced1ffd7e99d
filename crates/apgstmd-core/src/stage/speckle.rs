//! Speckles: max over scales of min over orientations of (P * W_a), for one tile at a time.
//!
//! Input: P, or P R for `masked`. Output: A without R. No state. W_a is steerable: with g_j = t^j exp(-t^2 / 2 s^2), three
//! passes along x and four along y give all orientations of a scale.

use std::f64::consts::PI;

use crate::filter::kernel::{gaussian_half, sum_of_half};
use crate::filter::patch::{Border, Patch};
use crate::memory::heap;
use crate::params::{AttentionParams, Speckles, Support};
use crate::plane::{Plane, padded};
use crate::row::bands::{Bands, Scratch};
use crate::row::speckle::{Layout, moments, steer};
use crate::tiles::{Area, TILE};

struct Scale {
    /// g_0, g_1, g_2 at 0..=radius.
    taps: Vec<[f32; 3]>,
    /// c: makes every kernel sum to exactly zero.
    center: f32,
}

struct Work {
    patch: Patch,
    moments: [Patch; 3],
    light: Patch,
    dark: Patch,
}

pub(crate) struct Speckle {
    scales: Vec<Scale>,
    /// Radius of the widest kernel.
    pub reach: usize,
    border: Border,
    speckles: Speckles,
    scratch: Scratch<Work>,
}

heap!(Scale { taps });
heap!(Work { patch, moments, light, dark });
heap!(Speckle { scales, scratch });

impl Speckle {
    pub fn new(params: &AttentionParams, threads: usize) -> Self {
        let reach = params.scales.iter().map(|sigma| (4.0 * sigma).ceil() as usize).max().unwrap_or(0);
        Self {
            scales: params.scales.iter().map(|sigma| scale(*sigma)).collect(),
            reach,
            border: match params.support {
                Support::Full => Border::Replicate,
                Support::Masked => Border::Zero,
            },
            speckles: params.speckles,
            scratch: Scratch::new(threads, || {
                let patch = || Patch::with_capacity(TILE + 2 * reach, TILE + 2 * reach);
                Work { patch: patch(), moments: [0, 1, 2].map(|_| patch()), light: patch(), dark: patch() }
            }),
        }
    }

    /// Calls `row(y, A without R)` for the rows of a tile.
    pub fn each_row(&self, bands: &Bands, source: &Plane, tile: &Area, mut row: impl FnMut(usize, &[f32])) {
        let Area { top, left, rows, columns } = *tile;
        let reach = self.reach;
        self.scratch.with(bands, |Work { patch, moments: sums, light, dark }| {
            let (above, before) = (top as isize - reach as isize, left as isize - reach as isize);
            patch.gather(source, above, before, rows + 2 * reach, columns + 2 * reach, self.border);
            if self.border == Border::Replicate {
                // The kernels sum to zero: what the tile has in common only costs precision.
                let common = patch.row(reach)[reach];
                patch.data_mut().iter_mut().for_each(|value| *value -= common);
            }
            let both = self.speckles == Speckles::Both;
            light.shape(rows, columns);
            dark.shape(rows, columns);
            light.data_mut().fill(if both { 0.0 } else { f32::NEG_INFINITY });
            dark.data_mut().fill(0.0);
            let width = padded(columns);
            for Scale { taps, center } in &self.scales {
                let radius = taps.len() - 1;
                let inset = reach - radius;
                for sum in &mut *sums {
                    sum.shape(rows + 2 * radius, columns);
                }
                let [m0, m1, m2] = &mut *sums;
                let stride = m0.stride;
                let above = Layout { stride, rows: rows + 2 * radius, width };
                let out = [m0.data_mut(), m1.data_mut(), m2.data_mut()];
                moments(bands.level(), (&patch.below(inset)[inset..], patch.stride), taps, above, out);
                let sources = [m0.data(), m1.data(), m2.data()];
                let out = [light.data_mut(), dark.data_mut()];
                steer(bands.level(), sources, taps, *center, Layout { stride, rows, width }, out);
            }
            for y in 0..rows {
                let a = &mut light.row_mut(y)[..columns];
                if both {
                    a.iter_mut().zip(dark.row(y)).for_each(|(a, dark)| *a += dark);
                }
                row(y, a);
            }
        });
    }
}

fn scale(sigma: f64) -> Scale {
    let half = gaussian_half(sigma, (4.0 * sigma).ceil() as usize);
    let moment: Vec<f64> = half.iter().enumerate().map(|(t, g)| (t * t) as f64 * g).collect();
    // 2 / (pi s^4), shared between the two passes.
    let weight = (2.0 / (PI * sigma.powi(4))).sqrt();
    let tap = |(t, g): (usize, &f64)| {
        let t = t as f64;
        [g * weight, t * g * weight, t * t * g * weight].map(|tap| tap as f32)
    };
    Scale {
        taps: half.iter().enumerate().map(tap).collect(),
        center: (sum_of_half(&moment) / sum_of_half(&half)) as f32,
    }
}
