//! Medulla: Tm3 = max(L, 0), Tm2 = max(-L, 0), Mi1 = Gamma(n_3, tau_3) * Tm3, Tm1 = Gamma(n, tau) * Tm2 twice.
//!
//! Input: L. Output: the three delayed signals; Tm3 and Tm2 are the signs of L and need no maps. State: the filters.

use crate::filter::gamma::{Gamma, Response};
use crate::filter::temporal::{Input, TemporalFilter};
use crate::frame::Size;
use crate::memory::heap;
use crate::params::{MedullaParams, TemporalEngine};
use crate::plane::Plane;
use crate::row::bands::Bands;
use crate::row::recurse::Prepare;
use crate::scroll::scrolls;
use crate::state::remember;

pub(crate) struct Medulla {
    /// Of each frame that is computed together.
    pub mi1: Vec<Plane>,
    pub tm1_4: Vec<Plane>,
    pub tm1_5: Vec<Plane>,
    on: TemporalFilter<1>,
    off: TemporalFilter<2>,
}

heap!(Medulla { mi1, tm1_4, tm1_5, on, off });
remember!(Medulla { on, off });
scrolls!(Medulla { on, off });

/// What the medulla makes of one frame.
#[derive(Clone, Copy)]
pub(crate) struct Delayed<'a> {
    pub mi1: &'a Plane,
    pub tm1_4: &'a Plane,
    pub tm1_5: &'a Plane,
}

impl Medulla {
    /// For `together` frames at once.
    pub fn new(size: Size, params: &MedullaParams, engine: TemporalEngine, threads: usize, together: usize) -> Self {
        let gamma = |order, tau| vec![(1.0, Gamma { order, tau })];
        let on = [gamma(params.mi1_order, params.mi1_tau)];
        let off = [gamma(params.tm1_4_order, params.tm1_4_tau), gamma(params.tm1_5_order, params.tm1_5_tau)];
        let planes = || (0..together).map(|_| Plane::new(size)).collect();
        Self {
            mi1: planes(),
            tm1_4: planes(),
            tm1_5: planes(),
            on: TemporalFilter::new(size, engine, Prepare::Positive, &on, Response::Impulse, threads),
            off: TemporalFilter::new(size, engine, Prepare::Negative, &off, Response::Impulse, threads),
        }
    }

    pub fn process(&mut self, bands: &Bands, l: &[Plane]) {
        let count = l.len();
        self.on.process(bands, Input::Maps(l), [&mut self.mi1[..count]]);
        self.off.process(bands, Input::Maps(l), [&mut self.tm1_4[..count], &mut self.tm1_5[..count]]);
    }

    /// Of a frame of the last ones.
    pub fn frame(&self, index: usize) -> Delayed<'_> {
        Delayed { mi1: &self.mi1[index], tm1_4: &self.tm1_4[index], tm1_5: &self.tm1_5[index] }
    }

    pub fn reset(&mut self) {
        self.mi1.iter_mut().chain(&mut self.tm1_4).chain(&mut self.tm1_5).for_each(|plane| plane.fill(0.0));
        self.on.reset();
        self.off.reset();
    }
}
