//! Lamina (LMC): L = Gamma(n_1, tau_1) * P_e - Gamma(n_2, tau_2) * P_e over time.
//!
//! Input: P_e, or P and what attention adds to its step from frame to frame. Output: L. State: the last input and the
//! filter. Both kernels have unit sum, so L is also the difference of
//! their tails applied to the change from frame to frame. That form is used: what does not change gives exactly zero,
//! in the first frame and ever after, and needs no priming.

use crate::filter::gamma::{Gamma, Response};
use crate::filter::temporal::TemporalFilter;
use crate::frame::Size;
use crate::memory::heap;
use crate::params::{LaminaParams, TemporalEngine};
use crate::plane::Plane;
use crate::row::bands::{Bands, Rows};
use crate::row::recurse::Prepare;

pub(crate) struct Lamina {
    before: Plane,
    change: Plane,
    first: bool,
    filter: TemporalFilter<1>,
}

heap!(Lamina { before, change, filter });

impl Lamina {
    pub fn new(size: Size, params: &LaminaParams, engine: TemporalEngine) -> Self {
        let fast = Gamma { order: params.fast_order, tau: params.fast_tau };
        let slow = Gamma { order: params.slow_order, tau: params.slow_tau };
        let sums = [vec![(1.0, slow), (-1.0, fast)]];
        Self {
            before: Plane::new(size),
            change: Plane::new(size),
            first: true,
            filter: TemporalFilter::new(size, engine, Prepare::Keep, &sums, Response::Tail),
        }
    }

    pub fn process(&mut self, bands: &Bands, (pe, added): (&Plane, Option<&Plane>), l: &mut Plane) {
        let stride = pe.stride();
        let first = std::mem::replace(&mut self.first, false);
        let before = Rows { data: self.before.data_mut(), stride };
        let change = Rows { data: self.change.data_mut(), stride };
        bands.over(pe.size().height, [before, change], |range, [mut before, mut change]| {
            for (row, y) in range.enumerate() {
                let (before, change, now) = (before.row(row), change.row(row), pe.padded_row(y));
                if first {
                    change.fill(0.0);
                } else {
                    for ((change, now), before) in change.iter_mut().zip(now).zip(&*before) {
                        *change = now - before;
                    }
                }
                if let Some(added) = added {
                    change.iter_mut().zip(added.padded_row(y)).for_each(|(change, added)| *change += added);
                }
                before.copy_from_slice(now);
            }
        });
        self.filter.process(bands, &self.change, [l]);
    }

    pub fn reset(&mut self) {
        self.first = true;
        self.filter.reset();
    }
}
