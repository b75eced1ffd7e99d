//! Retina (ommatidia): P = I * G(sigma_1).
//!
//! Input: luminance. Output: P. No state. Separable, radius ceil(4 sigma), taps of unit sum, replicate border;
//! 2 (2 radius + 1) multiply-adds a pixel, halved by symmetry.

use crate::filter::kernel::{gaussian_half, sum_of_half};
use crate::filter::patch::{Border, Patch, STRIP, strips};
use crate::memory::heap;
use crate::params::RetinaParams;
use crate::plane::{Plane, padded};
use crate::row::bands::{BAND_ROWS, Bands, Rows, Scratch};
use crate::row::convolve::{horizontal, vertical};

pub(crate) struct Retina {
    taps: Vec<[f32; 1]>,
    /// What it is given is P already.
    passes: bool,
    scratch: Scratch<[Patch; 2]>,
}

heap!(Retina { taps, scratch });

impl Retina {
    pub fn new(params: &RetinaParams, threads: usize) -> Self {
        let radius = (4.0 * params.sigma).ceil() as usize;
        let half = gaussian_half(params.sigma, radius);
        let sum = sum_of_half(&half);
        Self {
            taps: half.into_iter().map(|tap| [(tap / sum) as f32]).collect(),
            passes: false,
            scratch: Scratch::new(threads, || {
                [0, 1].map(|_| Patch::with_capacity(BAND_ROWS + 2 * radius, STRIP + 2 * radius))
            }),
        }
    }

    /// Is given P from now on.
    pub fn pass(&mut self) {
        self.passes = true;
    }

    pub fn process(&self, bands: &Bands, luminance: &Plane, p: &mut Plane) {
        if self.passes {
            p.data_mut().copy_from_slice(luminance.data());
            return;
        }
        let (size, stride, radius) = (p.size(), p.stride(), self.taps.len() - 1);
        let level = bands.level();
        bands.over(size.height, Rows { data: p.data_mut(), stride }, |range, mut out| {
            self.scratch.with(bands, |[patch, across]| {
                for (left, columns) in strips(size.width) {
                    let rows = range.len() + 2 * radius;
                    let (top, halo_left) = (range.start as isize - radius as isize, left as isize - radius as isize);
                    patch.gather(luminance, top, halo_left, rows, columns + 2 * radius, Border::Replicate);
                    across.shape(rows, columns);
                    let width = padded(columns);
                    for y in 0..rows {
                        horizontal(level, patch.row(y), &self.taps, [&mut across.row_mut(y)[..width]]);
                    }
                    for y in 0..range.len() {
                        let out = &mut out.row(y)[left..left + width];
                        vertical(level, [across.below(y)], across.stride, &self.taps, out);
                    }
                }
            });
        });
    }
}
