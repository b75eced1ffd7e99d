//! Lateral inhibition in the lamina: L1 = ([h]+ * L) filtered by exp(-t / tau_e) + ([h]- * L) filtered by exp(-t / tau_i),
//! h = G(sigma_e) - G(sigma_i).
//!
//! Input: L. Output: L1. State: both low-pass filters. Nothing lies outside the picture, as in the lobula. [h]- is negative:
//! the surround inhibits, and later than the centre excites. About 70 multiply-adds a pixel.

use crate::filter::low_pass::LowPass;
use crate::filter::opponent::Opponent;
use crate::filter::rolling::{Around, ROLLING_ROWS, Rolling, Source};
use crate::frame::Size;
use crate::memory::heap;
use crate::params::LaminaInhibitionParams;
use crate::plane::{Buffer, Plane};
use crate::row::bands::{Bands, Rows, Scratch};
use crate::row::lateral::{Lateral, Parts, STRIP};
use crate::row::recurse::Prepare;
use crate::scroll::scrolls;
use crate::state::remember;

pub(crate) struct LaminaInhibition {
    lateral: Lateral,
    center: Plane,
    surround: Plane,
    excitation: LowPass,
    inhibition: LowPass,
    pub l1: Plane,
    /// And both parts of a strip.
    scratch: Scratch<(Source, Rolling, [Buffer; 2])>,
}

heap!(LaminaInhibition { lateral, center, surround, excitation, inhibition, l1, scratch });
remember!(LaminaInhibition { excitation, inhibition });
scrolls!(LaminaInhibition { excitation, inhibition });

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
        let lateral = h.parts(1.0, 1.0);
        Self {
            center: Plane::new(size),
            surround: Plane::new(size),
            excitation: LowPass::new(size, params.excitation_tau),
            inhibition: LowPass::new(size, params.inhibition_tau),
            l1: Plane::new(size),
            scratch: Scratch::new(threads, || {
                (Source::new(&lateral), Rolling::new(&lateral), [0, 1].map(|_| Buffer::zeros(ROLLING_ROWS * STRIP)))
            }),
            lateral,
        }
    }

    pub fn process(&mut self, bands: &Bands, l: &Plane) {
        self.divide(bands, l);
        self.excitation.process(bands, &self.center, &mut self.l1, false);
        self.inhibition.process(bands, &self.surround, &mut self.l1, true);
    }

    /// [h]+ * L and [h]- * L.
    fn divide(&mut self, bands: &Bands, l: &Plane) {
        let (size, stride) = (l.size(), l.stride());
        let Self { lateral, center, surround, scratch, .. } = self;
        let out = [center, surround].map(|plane| Rows { data: plane.data_mut(), stride });
        bands.over_long(size.height, ROLLING_ROWS, out, |range, mut out| {
            scratch.with(bands, |(source, rolling, parts)| {
                for left in (0..size.width).step_by(STRIP) {
                    let columns = STRIP.min(size.width - left);
                    let around = Around::of(lateral, &range, left, columns);
                    source.fill(&around, l, Prepare::Keep);
                    let mut sink = Parts(parts.each_mut().map(|part| &mut part[..]));
                    rolling.inhibit(bands, lateral, (source, &around), range.len(), &mut sink);
                    for (out, part) in out.iter_mut().zip(&*parts) {
                        for (y, part) in part.chunks_exact(STRIP).enumerate().take(range.len()) {
                            out.part(y, left..left + columns).copy_from_slice(&part[..columns]);
                        }
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
