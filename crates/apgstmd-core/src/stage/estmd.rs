//! ESTMD: ON = max([L1]+ * W, 0), OFF = max([-L1]+ * W, 0), Y(t) = ON(t) (Gamma(n, tau) * OFF)(t).
//!
//! Input: L1. Output: Y, which is large where light follows dark at one pixel, whatever way the target moves. State: the
//! delay of OFF. W has the form of the lobula's W_s and its parameters. Nothing lies outside the picture.

use crate::filter::gamma::{Gamma, Response};
use crate::filter::rolling::{ROLLING_ROWS, Rolling, STRIP};
use crate::filter::temporal::TemporalFilter;
use crate::frame::Size;
use crate::memory::heap;
use crate::params::Params;
use crate::plane::{Plane, padded};
use crate::row::bands::{Bands, Rows, Scratch};
use crate::row::lateral::{Lateral, gather};
use crate::row::opponent::multiply;
use crate::row::recurse::Prepare;
use crate::stage::lobula::lateral;

pub(crate) struct Estmd {
    lateral: Lateral,
    floor: f32,
    pub on: Plane,
    pub off: Plane,
    pub off_delayed: Plane,
    pub y: Plane,
    delay: TemporalFilter<1>,
    scratch: Scratch<Rolling>,
}

heap!(Estmd { lateral, on, off, off_delayed, y, delay, scratch });

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
            delay: TemporalFilter::new(size, params.engine.temporal, Prepare::Keep, &delay, Response::Impulse),
            scratch: Scratch::new(threads, || Rolling::new(&lateral)),
            lateral,
        }
    }

    pub fn process(&mut self, bands: &Bands, l1: &Plane) {
        self.divide(bands, l1);
        self.delay.process(bands, &self.off, [&mut self.off_delayed]);
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
        let (size, stride, level) = (l1.size(), l1.stride(), bands.level());
        let Self { lateral, on, off, scratch, .. } = self;
        let out = [on, off].map(|plane| Rows { data: plane.data_mut(), stride });
        bands.over_long(size.height, ROLLING_ROWS, out, |range, out| {
            scratch.with(bands, |rolling| {
                for (mut out, sign) in out.into_iter().zip([Prepare::Positive, Prepare::Negative]) {
                    for left in (0..size.width).step_by(STRIP) {
                        let columns = STRIP.min(size.width - left);
                        let halo_left = left as isize - rolling.halo() as isize;
                        rolling.begin(columns, range.start);
                        for (row, y) in range.clone().enumerate() {
                            let any = rolling.reach(level, lateral, y, |y, out| {
                                l1.copy_row(y, halo_left, out);
                                out.iter_mut().for_each(|value| *value = sign.apply(*value));
                                out.iter().any(|value| *value != 0.0)
                            });
                            let out = &mut out.row(row)[left..left + padded(columns)];
                            if any || bands.dense() {
                                gather(level, rolling.rows(y), lateral, out);
                            } else {
                                out.fill(0.0);
                            }
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
