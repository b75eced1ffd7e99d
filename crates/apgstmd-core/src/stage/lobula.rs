//! Lobula (STMD): D = Tm3 (Tm1_4 + Mi1_up) Tm1_5_up for 8 directions, S = max(D * W_s, 0), E = max(W_d * S, 0).
//!
//! Input: L and the medulla. Output: the largest E over directions; E in all of the picture where nothing is rejected, else
//! around confirmed peaks only, when they are known. No state. W_s = A [g]+ + B [g]- with g = G(sigma_2) - e G(sigma_3) - rho
//! is computed as B g + (A - B) [g]+: two separable Gaussians and a small core. About 80 operations a pixel and
//! direction; where D is zero, none.

use std::ops::Range;
use std::slice::from_ref;
use std::sync::atomic::{AtomicUsize, Ordering};

use fearless_simd::{Level, Simd, dispatch};
use ndarray::{Array3, ArrayView1};

use crate::DIRECTIONS;
use crate::direction::upstream;
use crate::filter::kernel::normal;
use crate::filter::opponent::Opponent;
use crate::filter::rolling::{Around, ROLLING_ROWS, Rolling, Source};
use crate::frame::Size;
use crate::memory::heap;
use crate::params::{LobulaParams, Params, RejectionMode};
use crate::plane::{Buffer, LANES, Plane, padded};
use crate::region::Region;
use crate::row::bands::{Bands, Rows, Scratch};
use crate::row::lateral::{Lateral, Positive, STRIP};
use crate::row::mix::{correlate, inhibit_directions};
use crate::stage::medulla::Delayed;
use crate::stage::rejection::Responses;
use crate::tiles::{Area, TILE};

/// Products below this are zero: 15 x 15 of them under the lateral kernel stay far below the response floor.
const CORRELATION_FLOOR: f32 = 1e-24;

pub(crate) struct Lobula {
    stmd: Stmd,
    /// E, of no size where only parts of it are asked for.
    pub e: [Plane; DIRECTIONS],
    /// max over directions of E.
    strongest: Plane,
    /// Rows in which it is asked for, by strip; all of them if none.
    asked: Option<Vec<Vec<Range<usize>>>>,
    /// Pixels inhibited in the last frame, times directions.
    inhibited: AtomicUsize,
}

/// What computes a strip.
struct Stmd {
    upstream: [(isize, isize); DIRECTIONS],
    lateral: Lateral,
    between: [f32; DIRECTIONS / 2 + 1],
    floor: f32,
    scratch: Scratch<Work>,
}

struct Work {
    d: [Source; DIRECTIONS],
    s: [Buffer; DIRECTIONS],
    e: [Buffer; DIRECTIONS],
    strongest: Buffer,
    rolling: Rolling,
}

heap!(Work { d, s, e, strongest, rolling });
heap!(Stmd { lateral, scratch });
heap!(Lobula { stmd, e, strongest });

impl Lobula {
    pub fn new(size: Size, params: &Params, threads: usize) -> Self {
        let whole = params.rejection.mode == RejectionMode::Off;
        Self {
            stmd: Stmd::new(&params.lobula, threads),
            e: std::array::from_fn(|_| Plane::new(if whole { size } else { Size::new(0, 0) })),
            strongest: Plane::new(size),
            asked: None,
            inhibited: AtomicUsize::new(0),
        }
    }

    pub fn process(&mut self, bands: &Bands, l: &Plane, medulla: Delayed<'_>) {
        let (size, stride) = (l.size(), l.stride());
        let Self { stmd, e, strongest, asked, inhibited } = self;
        *inhibited.get_mut() = 0;
        let inhibited = &*inhibited;
        let whole = e[0].size() == size;
        let e = whole.then(|| e.each_mut().map(|plane| Rows { data: plane.data_mut(), stride }));
        let out = (e, Rows { data: strongest.data_mut(), stride });
        bands.over_long(size.height, ROLLING_ROWS, out, |range, (mut e, mut strongest)| {
            stmd.scratch.with(bands, |work| {
                let mut computed = 0;
                for (strip, left) in (0..size.width).step_by(STRIP).enumerate() {
                    let columns = STRIP.min(size.width - left);
                    let whole = 0..size.height;
                    for run in asked.as_ref().map_or(from_ref(&whole), |asked| &asked[strip]) {
                        // Bands begin at even rows, too.
                        let rows = run.start.max(range.start)..run.end.min(range.end);
                        if rows.is_empty() {
                            continue;
                        }
                        computed += columns * stmd.inhibit(bands, l, medulla, (&rows, left, columns), work);
                        let first = rows.start - range.start;
                        let mut e = e.as_mut().map(|e| e.each_mut().map(|e| e.from(first)));
                        let (columns, strongest) = (left..left + padded(columns), &mut strongest.from(first));
                        stmd.compare(bands, &work.s, rows.len(), columns, e.as_mut(), strongest);
                    }
                }
                inhibited.fetch_add(computed, Ordering::Relaxed);
            });
        });
    }

    /// E is asked for there only, from now on, and is zero elsewhere.
    pub fn look_in(&mut self, region: Option<&Region>) {
        self.reset();
        let (size, gap) = (self.strongest.size(), 2 * self.stmd.lateral.radius());
        let strips = || (0..size.width).step_by(STRIP).map(|left| left..(left + STRIP).min(size.width));
        self.asked = region.map(|region| strips().map(|columns| region.runs(columns, gap)).collect());
    }

    /// The last frame's responses, of which parts may be asked for.
    pub fn responses<'a>(&'a self, l: &'a Plane, medulla: Delayed<'a>) -> Seen<'a> {
        Seen { lobula: self, l, medulla }
    }

    /// Tiles inhibited in the last frame, times directions.
    pub fn tiles(&self) -> usize {
        self.inhibited.load(Ordering::Relaxed).div_ceil(TILE * TILE)
    }

    pub fn reset(&mut self) {
        self.e.iter_mut().chain([&mut self.strongest]).for_each(|plane| plane.fill(0.0));
    }

    /// D of the last frame.
    pub fn correlation(&self, l: &Plane, medulla: Delayed<'_>) -> Array3<f32> {
        let Size { height, width } = l.size();
        let mut out = vec![0.0; padded(width)];
        let mut d = Array3::zeros((DIRECTIONS, height, width));
        let inputs = Inputs { l, medulla, upstream: &self.stmd.upstream, floor: 0.0 };
        for k in 0..DIRECTIONS {
            for y in 0..height {
                dispatch!(Level::new(), simd => inputs.row(simd, k, y as isize, 0, &mut out));
                d.slice_mut(ndarray::s![k, y, ..]).assign(&ArrayView1::from(&out[..width]));
            }
        }
        d
    }
}

/// E of the last frame.
pub(crate) struct Seen<'a> {
    lobula: &'a Lobula,
    l: &'a Plane,
    medulla: Delayed<'a>,
}

impl Responses<DIRECTIONS> for Seen<'_> {
    fn strongest(&self) -> &Plane {
        &self.lobula.strongest
    }

    fn copy(&self, bands: &Bands, area: &Area, first: usize, out: &mut [Rows<'_>; DIRECTIONS]) {
        let stmd = &self.lobula.stmd;
        let Area { top, left, rows, columns } = *area;
        stmd.scratch.with(bands, |work| {
            // From an even row on, as in `process`.
            for start in (top & !1..top + rows).step_by(ROLLING_ROWS) {
                let range = start..(start + ROLLING_ROWS).min(top + rows);
                for left in (left..left + columns).step_by(STRIP) {
                    let columns = STRIP.min(area.left + area.columns - left);
                    stmd.inhibit(bands, self.l, self.medulla, (&range, left, columns), work);
                    let Work { s, e, strongest, .. } = &mut *work;
                    let mut e = e.each_mut().map(|e| Rows { data: e, stride: STRIP });
                    let mut strongest = Rows { data: strongest, stride: STRIP };
                    stmd.compare(bands, s, range.len(), 0..padded(columns), Some(&mut e), &mut strongest);
                    for (out, e) in out.iter_mut().zip(&mut e) {
                        for y in range.start.max(top)..range.end {
                            out.part(y - first, left..left + columns)
                                .copy_from_slice(e.part(y - range.start, 0..columns));
                        }
                    }
                }
            }
        });
    }
}

impl Stmd {
    fn new(params: &LobulaParams, threads: usize) -> Self {
        let lateral = lateral(params);
        // At even distances around the circle both ways are the same direction: d = 4 counts once.
        let between = std::array::from_fn(|d| {
            let d = d as f64;
            (normal(d, params.direction_center_sigma) - normal(d, params.direction_surround_sigma)) as f32
        });
        let strip = || Buffer::zeros(ROLLING_ROWS * STRIP);
        Self {
            upstream: std::array::from_fn(|k| upstream(k, params.spacing)),
            between,
            floor: params.response_floor as f32,
            scratch: Scratch::new(threads, || Work {
                d: std::array::from_fn(|_| Source::new(&lateral)),
                s: std::array::from_fn(|_| strip()),
                e: std::array::from_fn(|_| strip()),
                strongest: strip(),
                rolling: Rolling::new(&lateral),
            }),
            lateral,
        }
    }

    /// S of a strip of at most `STRIP` columns and `ROLLING_ROWS` rows, the first of which is even. Returns how many rows
    /// were not known to be zero, times directions.
    fn inhibit(
        &self,
        bands: &Bands,
        l: &Plane,
        medulla: Delayed<'_>,
        (rows, left, columns): (&Range<usize>, usize, usize),
        work: &mut Work,
    ) -> usize {
        let around = Around::of(&self.lateral, rows, left, columns);
        let inputs = Inputs { l, medulla, upstream: &self.upstream, floor: CORRELATION_FLOOR };
        let Work { d, s, rolling, .. } = work;
        dispatch!(bands.level(), simd => inputs.strip(simd, &around, d));
        let each = d.iter().zip(s);
        each.map(|(d, s)| rolling.inhibit(bands, &self.lateral, (d, &around), rows.len(), &mut Positive(s))).sum()
    }

    /// E of a strip, into `columns`, and the largest of it.
    fn compare(
        &self,
        bands: &Bands,
        s: &[Buffer; DIRECTIONS],
        rows: usize,
        columns: Range<usize>,
        e: Option<&mut [Rows<'_>; DIRECTIONS]>,
        strongest: &mut Rows<'_>,
    ) {
        let s = s.each_ref().map(|s| &s[..rows * STRIP]);
        inhibit_directions(bands.level(), s, columns, &self.between, self.floor, e, strongest);
    }
}

/// g of lateral inhibition.
pub(crate) fn opponent(params: &LobulaParams) -> Opponent {
    Opponent {
        center_sigma: params.center_sigma,
        surround_sigma: params.surround_sigma,
        surround_weight: params.surround_weight,
        offset: params.offset,
        radius: params.radius as usize,
    }
}

/// W_s as two separable Gaussians and a core.
pub(crate) fn lateral(params: &LobulaParams) -> Lateral {
    opponent(params).parts(params.inhibition, params.excitation - params.inhibition)
}

/// What D depends on. Products below `floor` are zero.
#[derive(Clone, Copy)]
struct Inputs<'a> {
    l: &'a Plane,
    medulla: Delayed<'a>,
    upstream: &'a [(isize, isize); DIRECTIONS],
    floor: f32,
}

impl Inputs<'_> {
    /// D of a strip with what is around it.
    #[inline(always)]
    fn strip<S: Simd>(self, simd: S, around: &Around, d: &mut [Source; DIRECTIONS]) {
        let Around { top, left, rows, stride, .. } = *around;
        let Size { height, width } = self.l.size();
        let reach = self.upstream[0].0.unsigned_abs() as isize;
        let inside = |first: isize, length: usize, all: usize| {
            first >= reach && first + (length as isize) + reach <= all as isize
        };
        let within = inside(left, stride, width);
        for row in 0..rows {
            let y = top + row as isize;
            let columns = row * stride..(row + 1) * stride;
            if within && inside(y, 1, height) {
                let mut out: [&mut [f32]; DIRECTIONS] = Default::default();
                for (out, d) in out.iter_mut().zip(&mut *d) {
                    *out = &mut d.data[columns.clone()];
                }
                let live = self.row_inside(simd, y as usize, left, stride, out);
                for k in 0..DIRECTIONS {
                    d[k].live[row] = live[k];
                }
            } else {
                for (k, d) in d.iter_mut().enumerate() {
                    d.live[row] = self.row(simd, k, y, left, &mut d.data[columns.clone()]);
                }
            }
        }
    }

    /// One row of each direction, where all that it depends on lies inside the picture.
    #[inline(always)]
    fn row_inside<S: Simd>(
        self,
        simd: S,
        y: usize,
        x: isize,
        length: usize,
        out: [&mut [f32]; DIRECTIONS],
    ) -> [bool; DIRECTIONS] {
        let here = [self.l.around(y, x, length), self.medulla.tm1_4.around(y, x, length)];
        let there = [self.medulla.mi1, self.medulla.tm1_5];
        let mut up: [[&[f32]; DIRECTIONS]; 2] = [[&[]; DIRECTIONS]; 2];
        for (up, plane) in up.iter_mut().zip(there) {
            for (up, (dx, dy)) in up.iter_mut().zip(self.upstream) {
                *up = plane.around((y as isize + dy) as usize, x + dx, length);
            }
        }
        correlate(simd, here, up, self.floor, out)
    }

    /// One row of direction k from (y, x) on, zero where the pixel or the one upstream lies outside the picture. Returns
    /// whether anything is not zero. The length of `out` is whole vectors.
    #[inline(always)]
    fn row<S: Simd>(self, simd: S, k: usize, y: isize, x: isize, out: &mut [f32]) -> bool {
        let (dx, dy) = self.upstream[k];
        let (height, width) = (self.l.size().height as isize, self.l.size().width as isize);
        let (first, last) = (0.max(-dx).max(x), width.min(width - dx).min(x + out.len() as isize));
        if !(0..height).contains(&y) || !(0..height).contains(&(y + dy)) || first >= last {
            out.fill(0.0);
            return false;
        }
        // Whole vectors around them; what lies outside is put right afterwards.
        let lanes = LANES as isize;
        let (from, to) = (first - (first - x) % lanes, last + (x - last).rem_euclid(lanes));
        let length = (to - from) as usize;
        let (row, up) = (y as usize, (y + dy) as usize);
        let here = [self.l, self.medulla.tm1_4].map(|plane| plane.around(row, from, length));
        let there = [self.medulla.mi1, self.medulla.tm1_5].map(|plane| [plane.around(up, from + dx, length)]);
        let [any] = correlate(simd, here, there, self.floor, [&mut out[(from - x) as usize..(to - x) as usize]]);
        out[..(first - x) as usize].fill(0.0);
        out[(last - x) as usize..].fill(0.0);
        any
    }
}
