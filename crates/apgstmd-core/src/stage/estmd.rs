//! ESTMD: ON = max([L1]+ * W, 0), OFF = max([-L1]+ * W, 0), Y(t) = ON(t) (Gamma(n, tau) * OFF)(t).
//!
//! Input: L1. Output: Y, which is large where light follows dark at one pixel, whatever way the target moves. State: the
//! delay of OFF. W has the form of the lobula's W_s and its parameters. Nothing lies outside the picture.

use std::slice::{from_mut, from_ref};

use crate::filter::gamma::{Gamma, Response};
use crate::filter::rolling::{Around, ROLLING_ROWS, Rolling, Source};
use crate::filter::temporal::{Input, TemporalFilter};
use crate::frame::Size;
use crate::memory::heap;
use crate::params::Params;
use crate::plane::{Buffer, Plane};
use crate::row::bands::{Bands, Rows, Scratch};
use crate::row::lateral::{Lateral, Positive, STRIP};
use crate::row::opponent::multiply;
use crate::row::recurse::Prepare;
use crate::scroll::scrolls;
use crate::stage::lobula::lateral;
use crate::state::remember;

pub(crate) struct Estmd {
    lateral: Lateral,
    floor: f32,
    pub on: Plane,
    pub off: Plane,
    pub off_delayed: Plane,
    pub y: Plane,
    delay: TemporalFilter<1>,
    /// And what a strip comes to.
    scratch: Scratch<(Source, Rolling, Buffer)>,
}

heap!(Estmd { lateral, on, off, off_delayed, y, delay, scratch });
remember!(Estmd { delay });
scrolls!(Estmd { delay });

impl Estmd {
    pub fn new(size: Size, params: &Params, threads: usize) -> Self {
        let lateral = lateral(&params.lobula);
        let delay = [vec![(1.0, Gamma { order: params.estmd.off_order, tau: params.estmd.off_tau })]];
        Self {
            floor: params.lobula.response_floor as f32,
            on: Plane::new(size),
            off: Plane::new(size),
            off_delayed: Plane::new(size),
            y: Plane::new(size),
            delay: TemporalFilter::new(size, params.engine.temporal, Prepare::Keep, &delay, Response::Impulse, threads),
            scratch: Scratch::new(threads, || {
                (Source::new(&lateral), Rolling::new(&lateral), Buffer::zeros(ROLLING_ROWS * STRIP))
            }),
            lateral,
        }
    }

    pub fn process(&mut self, bands: &Bands, l1: &Plane) {
        self.divide(bands, l1);
        self.delay.process(bands, Input::Maps(from_ref(&self.off)), [from_mut(&mut self.off_delayed)]);
        let Self { on, off_delayed, y, floor, .. } = self;
        let stride = y.stride();
        bands.over(l1.size().height, Rows { data: y.data_mut(), stride }, |range, mut out| {
            for (row, y) in range.enumerate() {
                multiply(bands.level(), on.padded_row(y), off_delayed.padded_row(y), *floor, out.row(row));
            }
        });
    }

    /// ON and OFF.
    fn divide(&mut self, bands: &Bands, l1: &Plane) {
        let (size, stride) = (l1.size(), l1.stride());
        let Self { lateral, on, off, scratch, .. } = self;
        let out = [on, off].map(|plane| Rows { data: plane.data_mut(), stride });
        bands.over_long(size.height, ROLLING_ROWS, out, |range, out| {
            scratch.with(bands, |(source, rolling, part)| {
                for (mut out, sign) in out.into_iter().zip([Prepare::Positive, Prepare::Negative]) {
                    for left in (0..size.width).step_by(STRIP) {
                        let columns = STRIP.min(size.width - left);
                        let around = Around::of(lateral, &range, left, columns);
                        source.fill(&around, l1, sign);
                        rolling.inhibit(bands, lateral, (source, &around), range.len(), &mut Positive(part));
                        for (y, part) in part.chunks_exact(STRIP).enumerate().take(range.len()) {
                            out.part(y, left..left + columns).copy_from_slice(&part[..columns]);
                        }
                    }
                }
            });
        });
    }

    pub fn reset(&mut self) {
        for plane in [&mut self.on, &mut self.off, &mut self.off_delayed, &mut self.y] {
            plane.fill(0.0);
        }
        self.delay.reset();
    }
}
