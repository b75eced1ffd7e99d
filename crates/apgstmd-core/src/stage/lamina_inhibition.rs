//! Lateral inhibition in the lamina: L1 = ([h]+ * L) filtered by exp(-t / tau_e) + ([h]- * L) filtered by exp(-t / tau_i),
//! h = G(sigma_e) - G(sigma_i).
//!
//! Input: L. Output: L1. State: both low-pass filters. Nothing lies outside the picture, as in the lobula. [h]- is negative:
//! the surround inhibits, and later than the centre excites. About 70 multiply-adds a pixel.

use crate::filter::low_pass::LowPass;
use crate::filter::opponent::Opponent;
use crate::filter::patch::{Border, Patch, STRIP, strips};
use crate::frame::Size;
use crate::memory::heap;
use crate::params::LaminaInhibitionParams;
use crate::plane::{Plane, padded};
use crate::row::bands::{BAND_ROWS, Bands, Rows, Scratch};
use crate::row::convolve::{Lateral, horizontal};
use crate::row::opponent::center_surround;

pub(crate) struct LaminaInhibition {
    along: Vec<[f32; 2]>,
    lateral: Lateral,
    center: Plane,
    surround: Plane,
    excitation: LowPass,
    inhibition: LowPass,
    pub l1: Plane,
    scratch: Scratch<(Patch, [Patch; 2])>,
}

heap!(LaminaInhibition { along, lateral, center, surround, excitation, inhibition, l1, scratch });

impl LaminaInhibition {
    pub fn new(size: Size, params: &LaminaInhibitionParams, threads: usize) -> Self {
        let radius = params.radius as usize;
        let h = Opponent {
            center_sigma: params.center_sigma,
            surround_sigma: params.surround_sigma,
            surround_weight: 1.0,
            offset: 0.0,
            radius,
        };
        let (along, lateral) = h.parts(1.0, 1.0);
        Self {
            along,
            lateral,
            center: Plane::new(size),
            surround: Plane::new(size),
            excitation: LowPass::new(size, params.excitation_tau),
            inhibition: LowPass::new(size, params.inhibition_tau),
            l1: Plane::new(size),
            scratch: Scratch::new(threads, || {
                let patch = || Patch::with_capacity(BAND_ROWS + 2 * radius, STRIP + 2 * radius);
                (patch(), [patch(), patch()])
            }),
        }
    }

    pub fn process(&mut self, bands: &Bands, l: &Plane) {
        self.divide(bands, l);
        self.excitation.process(bands, &self.center, &mut self.l1, false);
        self.inhibition.process(bands, &self.surround, &mut self.l1, true);
    }

    /// [h]+ * L and [h]- * L.
    fn divide(&mut self, bands: &Bands, l: &Plane) {
        let (size, stride, level) = (l.size(), l.stride(), bands.level());
        let radius = self.along.len() - 1;
        let Self { along, lateral, center, surround, scratch, .. } = self;
        let out = [center, surround].map(|plane| Rows { data: plane.data_mut(), stride });
        bands.over(size.height, out, |range, [mut center, mut surround]| {
            scratch.with(bands, |(patch, smooth)| {
                for (left, columns) in strips(size.width) {
                    let (rows, width) = (range.len() + 2 * radius, padded(columns));
                    let (top, halo_left) = (range.start as isize - radius as isize, left as isize - radius as isize);
                    patch.gather(l, top, halo_left, rows, columns + 2 * radius, Border::Zero);
                    for smooth in &mut *smooth {
                        smooth.shape(rows, columns);
                    }
                    let [near, far] = &mut *smooth;
                    for y in 0..rows {
                        horizontal(
                            level,
                            patch.row(y),
                            along,
                            [near.row_mut(y), far.row_mut(y)].map(|row| &mut row[..width]),
                        );
                    }
                    for y in 0..range.len() {
                        let dense = patch.below(y + radius - lateral.reach);
                        let out = [&mut center, &mut surround].map(|rows| &mut rows.row(y)[left..left + width]);
                        let strides = [near.stride, patch.stride];
                        center_surround(level, [near.below(y), far.below(y)], dense, strides, lateral, out);
                    }
                }
            });
        });
    }

    pub fn reset(&mut self) {
        self.excitation.reset();
        self.inhibition.reset();
        self.l1.fill(0.0);
    }
}
