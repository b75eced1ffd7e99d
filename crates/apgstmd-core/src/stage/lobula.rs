//! Lobula (STMD): D = Tm3 (Tm1_4 + Mi1_up) Tm1_5_up for 8 directions, S = max(D * W_s, 0), E = max(W_d * S, 0).
//!
//! Input: L and the medulla. Output: E and its largest value over directions. No state. W_s = A [g]+ + B [g]- with
//! g = G(sigma_2) - e G(sigma_3) - rho is computed as B g + (A - B) [g]+: two separable Gaussians and a small core.
//! About 100 operations a pixel and direction; where D is zero, none.

use std::sync::atomic::{AtomicUsize, Ordering};

use fearless_simd::Level;
use ndarray::{Array3, ArrayView1};

use crate::DIRECTIONS;
use crate::direction::upstream;
use crate::filter::kernel::normal;
use crate::filter::opponent::Opponent;
use crate::filter::patch::Patch;
use crate::filter::rolling::{ROLLING_ROWS, Rolling, STRIP};
use crate::frame::Size;
use crate::memory::heap;
use crate::params::LobulaParams;
use crate::plane::{LANES, Plane, padded};
use crate::row::bands::{Bands, Rows, Scratch};
use crate::row::lateral::{Lateral, gather};
use crate::row::mix::{correlate, inhibit_directions};
use crate::stage::medulla::Medulla;
use crate::tiles::TILE;

/// Products below this are zero: 15 x 15 of them under the lateral kernel stay far below the response floor.
const CORRELATION_FLOOR: f32 = 1e-24;
pub(crate) struct Lobula {
    upstream: [(isize, isize); DIRECTIONS],
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
    /// D of one direction.
    d: Rolling,
    s: [Patch; DIRECTIONS],
}

heap!(Work { d, s });
heap!(Lobula { lateral, e, strongest, scratch });

impl Lobula {
    pub fn new(size: Size, params: &LobulaParams, threads: usize) -> Self {
        let lateral = lateral(params);
        // At even distances around the circle both ways are the same direction: d = 4 counts once.
        let between = std::array::from_fn(|d| {
            let d = d as f64;
            (normal(d, params.direction_center_sigma) - normal(d, params.direction_surround_sigma)) as f32
        });
        Self {
            upstream: std::array::from_fn(|k| upstream(k, params.spacing)),
            between,
            floor: params.response_floor as f32,
            e: std::array::from_fn(|_| Plane::new(size)),
            strongest: Plane::new(size),
            inhibited: AtomicUsize::new(0),
            scratch: Scratch::new(threads, || Work {
                d: Rolling::new(&lateral),
                s: std::array::from_fn(|_| Patch::with_capacity(ROLLING_ROWS, STRIP)),
            }),
            lateral,
        }
    }

    pub fn process(&mut self, bands: &Bands, l: &Plane, medulla: &Medulla) {
        let (size, stride, level) = (l.size(), l.stride(), bands.level());
        let Self { e, strongest, inhibited, scratch, upstream, lateral, between, floor } = self;
        *inhibited.get_mut() = 0;
        let inhibited = &*inhibited;
        let out = (
            e.each_mut().map(|plane| Rows { data: plane.data_mut(), stride }),
            Rows { data: strongest.data_mut(), stride },
        );
        bands.over_long(size.height, ROLLING_ROWS, out, |range, (mut e, mut strongest)| {
            scratch.with(bands, |Work { d, s }| {
                let mut computed = 0;
                for left in (0..size.width).step_by(STRIP) {
                    let columns = STRIP.min(size.width - left);
                    let width = padded(columns);
                    let halo_left = left as isize - d.halo() as isize;
                    let mut active = [false; ROLLING_ROWS];
                    for (s, upstream) in s.iter_mut().zip(&*upstream) {
                        s.shape(range.len(), columns);
                        d.begin(columns, range.start);
                        for (row, y) in range.clone().enumerate() {
                            let any = d.reach(level, lateral, y, |y, out| {
                                product(level, l, medulla, *upstream, (y, halo_left), CORRELATION_FLOOR, out)
                            });
                            let s = &mut s.row_mut(row)[..width];
                            if any || bands.dense() {
                                gather(level, d.rows(y), lateral, s);
                                active[row] = true;
                                computed += columns;
                            } else {
                                s.fill(0.0);
                            }
                        }
                    }
                    for (row, active) in active.into_iter().enumerate().take(range.len()) {
                        let strongest = &mut strongest.row(row)[left..left + width];
                        let e = e.each_mut().map(|rows| &mut rows.row(row)[left..left + width]);
                        if active {
                            let s = s.each_ref().map(|s| &s.row(row)[..width]);
                            inhibit_directions(level, s, between, *floor, e, strongest);
                        } else {
                            e.into_iter().chain([strongest]).for_each(|row| row.fill(0.0));
                        }
                    }
                }
                inhibited.fetch_add(computed, Ordering::Relaxed);
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
        let (bands, mut out) = (Bands::single(), vec![0.0; padded(width)]);
        let mut d = Array3::zeros((DIRECTIONS, height, width));
        for ((k, y, _), _) in d.clone().indexed_iter().filter(|((_, _, x), _)| *x == 0) {
            product(bands.level(), l, medulla, self.upstream[k], (y as isize, 0), 0.0, &mut out);
            d.slice_mut(ndarray::s![k, y, ..]).assign(&ArrayView1::from(&out[..width]));
        }
        d
    }
}

/// W_s as two separable Gaussians and a core.
pub(crate) fn lateral(params: &LobulaParams) -> Lateral {
    let g = Opponent {
        center_sigma: params.center_sigma,
        surround_sigma: params.surround_sigma,
        surround_weight: params.surround_weight,
        offset: params.offset,
        radius: params.radius as usize,
    };
    g.parts(params.inhibition, params.excitation - params.inhibition)
}

/// One row of D, from pixel (y, x) on; zero where the pixel or the one upstream lies outside the picture. `x` and the
/// length of `out` are whole vectors. Returns whether anything may not be zero.
fn product(
    level: Level,
    l: &Plane,
    medulla: &Medulla,
    (dx, dy): (isize, isize),
    (y, x): (isize, isize),
    floor: f32,
    out: &mut [f32],
) -> bool {
    let (height, width) = (l.size().height as isize, l.size().width as isize);
    let first = 0.max(-dx).max(x);
    let last = width.min(width - dx).min(x + out.len() as isize);
    if !(0..height).contains(&y) || !(0..height).contains(&(y + dy)) || first >= last {
        out.fill(0.0);
        return false;
    }
    // Whole vectors around them; what lies outside is put right afterwards.
    let lanes = LANES as isize;
    let (from, to) = (first - (first - x) % lanes, last + (x - last).rem_euclid(lanes));
    let length = (to - from) as usize;
    let (row, up) = (y as usize, (y + dy) as usize);
    let here = [l, &medulla.tm1_4].map(|plane| plane.around(row, from, length));
    let there = [&medulla.mi1, &medulla.tm1_5].map(|plane| plane.around(up, from + dx, length));
    let any = correlate(level, here, there, floor, &mut out[(from - x) as usize..(to - x) as usize]);
    out[..(first - x) as usize].fill(0.0);
    out[(last - x) as usize..].fill(0.0);
    any
}
