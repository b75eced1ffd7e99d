//! Lamina (LMC): L = Gamma(n_1, tau_1) * P_e - Gamma(n_2, tau_2) * P_e over time.
//!
//! Input: P_e, or P and what attention adds to its step from frame to frame. Output: L. State: the filter. Both kernels have unit sum, so L is also the difference of
//! their tails applied to the change from frame to frame. That form is used: what does not change gives exactly zero,
//! in the first frame and ever after, and needs no priming.

use crate::filter::gamma::{Gamma, Response};
use crate::filter::temporal::{Input, TemporalFilter};
use crate::frame::Size;
use crate::memory::heap;
use crate::params::{LaminaParams, TemporalEngine};
use crate::plane::{Plane, Series};
use crate::row::bands::Bands;
use crate::row::recurse::Prepare;
use crate::scroll::scrolls;
use crate::state::remember;

pub(crate) struct Lamina {
    first: bool,
    filter: TemporalFilter<1>,
}

heap!(Lamina { filter });
remember!(Lamina { first, filter });
scrolls!(Lamina { filter });

impl Lamina {
    pub fn new(size: Size, params: &LaminaParams, engine: TemporalEngine, threads: usize) -> Self {
        let fast = Gamma { order: params.fast_order, tau: params.fast_tau };
        let slow = Gamma { order: params.slow_order, tau: params.slow_tau };
        let sums = [vec![(1.0, slow), (-1.0, fast)]];
        Self { first: true, filter: TemporalFilter::new(size, engine, Prepare::Keep, &sums, Response::Tail, threads) }
    }

    /// Takes the next frames and writes L of each; `added` is what attention adds to the changes of the input.
    pub fn process(&mut self, bands: &Bands, (of, added): (&Series, Option<&[Plane]>), l: &mut [Plane]) {
        let first = std::mem::replace(&mut self.first, false);
        self.filter.process(bands, Input::Changes { of, first, added }, [l]);
    }

    pub fn reset(&mut self) {
        self.first = true;
        self.filter.reset();
    }
}
