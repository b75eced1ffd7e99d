//! ESTMD: ON = max([L1]+ * W, 0), OFF = max([-L1]+ * W, 0), Y(t) = ON(t) (Gamma(n, tau) * OFF)(t).
//!
//! Input: L1. Output: Y, which is large where light follows dark at one pixel, whatever way the target moves. State: the
//! delay of OFF. W has the form of the lobula's W_s and its parameters. Nothing lies outside the picture.

use crate::filter::gamma::{Gamma, Response};
use crate::filter::patch::{Border, Patch, STRIP, strips};
use crate::filter::temporal::TemporalFilter;
use crate::frame::Size;
use crate::memory::heap;
use crate::params::{LobulaParams, Params};
use crate::plane::{Plane, padded};
use crate::row::bands::{BAND_ROWS, Bands, Rows, Scratch};
use crate::row::convolve::{Lateral, horizontal, inhibit};
use crate::row::opponent::multiply;
use crate::row::recurse::Prepare;
use crate::stage::lobula::lateral;

pub(crate) struct Estmd {
    along: Vec<[f32; 2]>,
    lateral: Lateral,
    floor: f32,
    pub on: Plane,
    pub off: Plane,
    pub off_delayed: Plane,
    pub y: Plane,
    delay: TemporalFilter<1>,
    scratch: Scratch<(Patch, [Patch; 2])>,
}

heap!(Estmd { along, lateral, on, off, off_delayed, y, delay, scratch });

impl Estmd {
    pub fn new(size: Size, params: &Params, threads: usize) -> Self {
        let LobulaParams { radius, response_floor, .. } = params.lobula;
        let radius = radius as usize;
        let (along, lateral) = lateral(&params.lobula);
        let delay = [vec![(1.0, Gamma { order: params.estmd.off_order, tau: params.estmd.off_tau })]];
        Self {
            along,
            lateral,
            floor: response_floor as f32,
            on: Plane::new(size),
            off: Plane::new(size),
            off_delayed: Plane::new(size),
            y: Plane::new(size),
            delay: TemporalFilter::new(size, params.engine.temporal, Prepare::Keep, &delay, Response::Impulse),
            scratch: Scratch::new(threads, || {
                let patch = || Patch::with_capacity(BAND_ROWS + 2 * radius, STRIP + 2 * radius);
                (patch(), [patch(), patch()])
            }),
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
        let radius = self.along.len() - 1;
        let Self { along, lateral, on, off, scratch, .. } = self;
        let out = [on, off].map(|plane| Rows { data: plane.data_mut(), stride });
        bands.over(size.height, out, |range, out| {
            scratch.with(bands, |(patch, smooth)| {
                for (mut out, sign) in out.into_iter().zip([Prepare::Positive, Prepare::Negative]) {
                    for (left, columns) in strips(size.width) {
                        let (rows, width) = (range.len() + 2 * radius, padded(columns));
                        let (top, halo_left) =
                            (range.start as isize - radius as isize, left as isize - radius as isize);
                        patch.gather(l1, top, halo_left, rows, columns + 2 * radius, Border::Zero);
                        patch.data.iter_mut().for_each(|value| *value = sign.apply(*value));
                        if patch.data.iter().all(|value| *value == 0.0) {
                            (0..range.len()).for_each(|y| out.row(y)[left..left + width].fill(0.0));
                            continue;
                        }
                        for smooth in &mut *smooth {
                            smooth.shape(rows, columns);
                        }
                        let [near, far] = &mut *smooth;
                        for y in 0..rows {
                            let out = [near.row_mut(y), far.row_mut(y)].map(|row| &mut row[..width]);
                            horizontal(level, patch.row(y), along, out);
                        }
                        for y in 0..range.len() {
                            let dense = patch.below(y + radius - lateral.reach);
                            let strides = [near.stride, patch.stride];
                            let out = &mut out.row(y)[left..left + width];
                            inhibit(level, [near.below(y), far.below(y)], dense, strides, lateral, out);
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
