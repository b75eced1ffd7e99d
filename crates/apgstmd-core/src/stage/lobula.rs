//! Lobula (STMD): D = Tm3 (Tm1_4 + Mi1_up) Tm1_5_up for 8 directions, S = max(D * W_s, 0), E = max(W_d * S, 0).
//!
//! Input: L and the medulla. Output: E and its largest value over directions. No state. W_s = A [g]+ + B [g]- with
//! g = G(sigma_2) - e G(sigma_3) - rho is computed as B g + (A - B) [g]+: two separable Gaussians and a small core.
//! About 100 operations a pixel and direction; where D is zero, none.

use std::sync::atomic::{AtomicUsize, Ordering};

use ndarray::Array3;

use crate::DIRECTIONS;
use crate::direction::upstream;
use crate::filter::kernel::normal;
use crate::filter::opponent::Opponent;
use crate::filter::patch::Patch;
use crate::frame::Size;
use crate::memory::heap;
use crate::params::LobulaParams;
use crate::plane::{Plane, padded};
use crate::row::bands::{BAND_ROWS, Bands, Rows, Scratch};
use crate::row::convolve::{Lateral, horizontal, inhibit};
use crate::row::mix::{correlate, inhibit_directions};
use crate::stage::medulla::Medulla;
use crate::tiles::TILE;

/// Products below this are zero: 15 x 15 of them under the lateral kernel stay far below the response floor.
const CORRELATION_FLOOR: f32 = 1e-24;
/// Columns worked on at a time: 8 directions of a band stay in the second-level cache.
const STRIP: usize = 128;

pub(crate) struct Lobula {
    upstream: [(isize, isize); DIRECTIONS],
    along: Vec<[f32; 2]>,
    lateral: Lateral,
    between: [f32; DIRECTIONS / 2 + 1],
    floor: f32,
    pub e: [Plane; DIRECTIONS],
    /// max over directions of E.
    pub strongest: Plane,
    /// Pixels inhibited in the last frame, times directions.
    inhibited: AtomicUsize,
    scratch: Scratch<Work>,
}

struct Work {
    d: Patch,
    smooth: [Patch; 2],
    s: [Patch; DIRECTIONS],
}

heap!(Work { d, smooth, s });
heap!(Lobula { along, lateral, e, strongest, scratch });

impl Lobula {
    pub fn new(size: Size, params: &LobulaParams, threads: usize) -> Self {
        let radius = params.radius as usize;
        let (along, lateral) = lateral(params);
        // At even distances around the circle both ways are the same direction: d = 4 counts once.
        let between = std::array::from_fn(|d| {
            let d = d as f64;
            (normal(d, params.direction_center_sigma) - normal(d, params.direction_surround_sigma)) as f32
        });
        Self {
            upstream: std::array::from_fn(|k| upstream(k, params.spacing)),
            along,
            lateral,
            between,
            floor: params.response_floor as f32,
            e: std::array::from_fn(|_| Plane::new(size)),
            strongest: Plane::new(size),
            inhibited: AtomicUsize::new(0),
            scratch: Scratch::new(threads, || {
                let patch = || Patch::with_capacity(BAND_ROWS + 2 * radius, STRIP + 2 * radius);
                Work { d: patch(), smooth: [0, 1].map(|_| patch()), s: std::array::from_fn(|_| patch()) }
            }),
        }
    }

    pub fn process(&mut self, bands: &Bands, l: &Plane, medulla: &Medulla) {
        let (size, stride) = (l.size(), l.stride());
        let radius = self.along.len() - 1;
        let Self { e, strongest, inhibited, scratch, upstream, along, lateral, between, floor } = self;
        *inhibited.get_mut() = 0;
        let inhibited = &*inhibited;
        let level = bands.level();
        let out = (
            e.each_mut().map(|plane| Rows { data: plane.data_mut(), stride }),
            Rows { data: strongest.data_mut(), stride },
        );
        bands.over(size.height, out, |range, (mut e, mut strongest)| {
            scratch.with(bands, |Work { d, smooth, s }| {
                for left in (0..size.width).step_by(STRIP) {
                    let columns = STRIP.min(size.width - left);
                    let width = padded(columns);
                    let rows = range.len() + 2 * radius;
                    let (top, halo_left) = (range.start as isize - radius as isize, left as isize - radius as isize);
                    let mut active = false;
                    for (s, upstream) in s.iter_mut().zip(&*upstream) {
                        s.shape(range.len(), columns);
                        d.shape(rows, columns + 2 * radius);
                        let mut any = 0;
                        for y in 0..rows {
                            let out = &mut d.row_mut(y)[..columns + 2 * radius];
                            product(
                                bands,
                                l,
                                medulla,
                                *upstream,
                                (top + y as isize, halo_left),
                                CORRELATION_FLOOR,
                                out,
                            );
                            any = out.iter().fold(any, |any, value| any | value.to_bits());
                        }
                        if any == 0 && !bands.dense() {
                            s.data.fill(0.0);
                            continue;
                        }
                        active = true;
                        inhibited.fetch_add(range.len() * columns, Ordering::Relaxed);
                        for patch in &mut *smooth {
                            patch.shape(rows, columns);
                        }
                        let [center, surround] = smooth;
                        for y in 0..rows {
                            let out = [&mut center.row_mut(y)[..width], &mut surround.row_mut(y)[..width]];
                            horizontal(level, d.row(y), along, out);
                        }
                        for y in 0..range.len() {
                            let smooth = [center.below(y), surround.below(y)];
                            let dense = d.below(y + radius - lateral.reach);
                            let strides = [center.stride, d.stride];
                            inhibit(level, smooth, dense, strides, lateral, &mut s.row_mut(y)[..width]);
                        }
                    }
                    for y in 0..range.len() {
                        let strongest = &mut strongest.row(y)[left..left + width];
                        let e = e.each_mut().map(|rows| &mut rows.row(y)[left..left + width]);
                        if active {
                            let s = s.each_ref().map(|s| &s.row(y)[..width]);
                            inhibit_directions(level, s, between, *floor, e, strongest);
                        } else {
                            e.into_iter().chain([strongest]).for_each(|row| row.fill(0.0));
                        }
                    }
                }
            });
        });
    }

    /// Tiles inhibited in the last frame, times directions.
    pub fn tiles(&self) -> usize {
        self.inhibited.load(Ordering::Relaxed).div_ceil(TILE * TILE)
    }

    pub fn reset(&mut self) {
        self.e.iter_mut().chain([&mut self.strongest]).for_each(|plane| plane.fill(0.0));
    }

    /// D of the last frame.
    pub fn correlation(&self, l: &Plane, medulla: &Medulla) -> Array3<f32> {
        let Size { height, width } = l.size();
        let mut d = Array3::zeros((DIRECTIONS, height, width));
        for ((k, y, _), _) in d.clone().indexed_iter().filter(|((_, _, x), _)| *x == 0) {
            let mut row = d.slice_mut(ndarray::s![k, y, ..]);
            let out = row.as_slice_mut().expect("rows are contiguous");
            product(&Bands::single(), l, medulla, self.upstream[k], (y as isize, 0), 0.0, out);
        }
        d
    }
}

/// W_s as two separable Gaussians and a core: taps along rows, and the rest.
pub(crate) fn lateral(params: &LobulaParams) -> (Vec<[f32; 2]>, Lateral) {
    let g = Opponent {
        center_sigma: params.center_sigma,
        surround_sigma: params.surround_sigma,
        surround_weight: params.surround_weight,
        offset: params.offset,
        radius: params.radius as usize,
    };
    g.parts(params.inhibition, params.excitation - params.inhibition)
}

/// One row of D, from pixel (y, x) on; zero where the pixel or the one upstream lies outside the picture.
fn product(
    bands: &Bands,
    l: &Plane,
    medulla: &Medulla,
    (dx, dy): (isize, isize),
    (y, x): (isize, isize),
    floor: f32,
    out: &mut [f32],
) {
    let (height, width) = (l.size().height as isize, l.size().width as isize);
    let first = 0.max(-dx).max(x);
    let last = width.min(width - dx).min(x + out.len() as isize);
    if !(0..height).contains(&y) || !(0..height).contains(&(y + dy)) || first >= last {
        out.fill(0.0);
        return;
    }
    let here = first as usize..last as usize;
    let there = (first + dx) as usize..(last + dx) as usize;
    let inside = (first - x) as usize..(last - x) as usize;
    out[..inside.start].fill(0.0);
    out[inside.end..].fill(0.0);
    let (row, up) = (y as usize, (y + dy) as usize);
    correlate(
        bands.level(),
        &l.row(row)[here.clone()],
        &medulla.tm1_4.row(row)[here],
        &medulla.mi1.row(up)[there.clone()],
        &medulla.tm1_5.row(up)[there],
        floor,
        &mut out[inside],
    );
}
