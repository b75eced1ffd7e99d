//! Medulla: Tm3 = max(L, 0), Tm2 = max(-L, 0), Mi1 = Gamma(n_3, tau_3) * Tm3, Tm1 = Gamma(n, tau) * Tm2 twice.
//!
//! Input: L. Output: the three delayed signals; Tm3 and Tm2 are the signs of L and need no maps. State: the filters.

use crate::filter::gamma::{Gamma, Response};
use crate::filter::temporal::TemporalFilter;
use crate::frame::Size;
use crate::memory::heap;
use crate::params::{MedullaParams, TemporalEngine};
use crate::plane::Plane;
use crate::row::bands::Bands;
use crate::row::recurse::Prepare;

pub(crate) struct Medulla {
    pub mi1: Plane,
    pub tm1_4: Plane,
    pub tm1_5: Plane,
    on: TemporalFilter<1>,
    off: TemporalFilter<2>,
}

heap!(Medulla { mi1, tm1_4, tm1_5, on, off });

impl Medulla {
    pub fn new(size: Size, params: &MedullaParams, engine: TemporalEngine) -> Self {
        let gamma = |order, tau| vec![(1.0, Gamma { order, tau })];
        let on = [gamma(params.mi1_order, params.mi1_tau)];
        let off = [gamma(params.tm1_4_order, params.tm1_4_tau), gamma(params.tm1_5_order, params.tm1_5_tau)];
        Self {
            mi1: Plane::new(size),
            tm1_4: Plane::new(size),
            tm1_5: Plane::new(size),
            on: TemporalFilter::new(size, engine, Prepare::Positive, &on, Response::Impulse),
            off: TemporalFilter::new(size, engine, Prepare::Negative, &off, Response::Impulse),
        }
    }

    pub fn process(&mut self, bands: &Bands, l: &Plane) {
        self.on.process(bands, l, [&mut self.mi1]);
        self.off.process(bands, l, [&mut self.tm1_4, &mut self.tm1_5]);
    }

    pub fn reset(&mut self) {
        for plane in [&mut self.mi1, &mut self.tm1_4, &mut self.tm1_5] {
            plane.fill(0.0);
        }
        self.on.reset();
        self.off.reset();
    }
}
