//! Lateral inhibition in two steps: a row spreads along itself, what spread is gathered across rows.
//!
//! The kernel is two separable Gaussians and a core, a small square that is symmetric in both directions: each source
//! row becomes 2 + J rows, J = 1 + half width of the core, and an output row is a weighted sum of those around it. A strip
//! goes through row by row, and only the spread rows that the kernel spans are kept, in the first-level cache.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::load_store::{load, store};
use crate::memory::heap;
use crate::plane::LANES;

/// Taps of two separable kernels and a core, by distance.
#[derive(Clone, Debug)]
pub(crate) struct Lateral {
    /// Of both Gaussians along a row.
    along: Vec<[f32; 2]>,
    /// Of both across a pair of rows.
    across: Vec<[Pair; 2]>,
    /// Of the core, from its middle on: `side` rows of `side`.
    core: Vec<f32>,
    side: usize,
}

/// What the mean of two output rows takes of the sum of two source rows that lie evenly around them, and half their
/// difference of the difference.
#[derive(Clone, Copy, Debug)]
struct Pair {
    mean: f32,
    half: f32,
}

heap!(Pair);
heap!(Lateral { along, across, core });

impl Lateral {
    /// From taps by distance: both Gaussians along and across rows, and the core.
    pub fn new(along: Vec<[f32; 2]>, across: &[[f64; 2]], core: &[Vec<f32>]) -> Self {
        assert!(along.len() == across.len() && (1..=along.len()).contains(&core.len()));
        let tap = |d: usize, k: usize| across.get(d).map_or(0.0, |taps| taps[k]);
        let pair = |d: usize, k: usize| Pair {
            mean: (0.5 * (tap(d, k) + tap(d + 1, k))) as f32,
            half: (0.5 * (tap(d, k) - tap(d + 1, k))) as f32,
        };
        Self {
            along,
            across: (0..across.len()).map(|d| [pair(d, 0), pair(d, 1)]).collect(),
            core: core.concat(),
            side: core.len(),
        }
    }

    pub fn radius(&self) -> usize {
        self.along.len() - 1
    }

    /// Floats that the spread rows of a strip need.
    pub fn ring(&self) -> usize {
        self.taps().ring()
    }

    fn taps(&self) -> Taps<'_> {
        let slots = (2 * self.along.len()).next_power_of_two();
        Taps { along: &self.along, across: &self.across, core: &self.core, side: self.side, slots }
    }
}

/// The kernel as loops see it.
#[derive(Clone, Copy)]
struct Taps<'a> {
    along: &'a [[f32; 2]],
    across: &'a [[Pair; 2]],
    core: &'a [f32],
    side: usize,
    /// Spread row y lies in slot y mod `slots`, a power of two.
    slots: usize,
}

/// The default kernel: radius 7, a core of radius 2.
const DEFAULT_TAPS: usize = 8;
const DEFAULT_SIDE: usize = 3;

impl<'a> Taps<'a> {
    fn is_default(&self) -> bool {
        self.along.len() == DEFAULT_TAPS && self.side == DEFAULT_SIDE
    }

    /// With lengths that the compiler knows, so that it unrolls the loops.
    #[inline(always)]
    fn of_default_shape(self) -> Taps<'a> {
        let (along, across) = (&self.along[..DEFAULT_TAPS], &self.across[..DEFAULT_TAPS]);
        let core = &self.core[..DEFAULT_SIDE * DEFAULT_SIDE];
        Taps { along, across, core, side: DEFAULT_SIDE, slots: (2 * DEFAULT_TAPS).next_power_of_two() }
    }

    /// Floats of a slot: both Gaussians' rows and then the core's.
    #[inline(always)]
    fn slot(&self) -> usize {
        (2 + self.side) * STRIP
    }

    #[inline(always)]
    fn ring(&self) -> usize {
        self.slots * self.slot()
    }

    /// Start of the slot of a row.
    #[inline(always)]
    fn at(&self, row: usize) -> usize {
        (row & (self.slots - 1)) * self.slot()
    }
}

/// Most columns of a strip: the spread rows of the default kernel take 20 KB, and stay in the first-level cache.
pub(crate) const STRIP: usize = 64;

/// What is inhibited: rows of a strip from `radius` above its first on to `radius` below the last pair.
#[derive(Clone, Copy)]
pub(crate) struct Strip<'a> {
    /// Rows of `stride`, which begin `radius` columns to the left.
    pub data: &'a [f32],
    pub stride: usize,
    /// Of each row, whether anything in it is not zero.
    pub live: &'a [bool],
    /// Columns, whole vectors, `STRIP` at most.
    pub width: usize,
}

/// What becomes of the sums of both Gaussians and of the core, in rows of `STRIP`.
pub(crate) trait Sink {
    /// Floats that it has room for.
    fn len(&self) -> usize;

    /// # Safety
    /// `at + S::f32s::LEN <= self.len()`.
    #[allow(unsafe_code)]
    unsafe fn put<S: Simd>(&mut self, simd: S, at: usize, smooth: S::f32s, inner: S::f32s);

    fn zero(&mut self, range: Range<usize>);
}

/// `max(both Gaussians + core, 0)`.
pub(crate) struct Positive<'a>(pub &'a mut [f32]);

#[allow(unsafe_code)]
impl Sink for Positive<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    // SAFETY: what the trait asks of the caller, and no more.
    unsafe fn put<S: Simd>(&mut self, simd: S, at: usize, smooth: S::f32s, inner: S::f32s) {
        // SAFETY: passed on to the caller.
        unsafe { store::<S>((smooth + inner).max(S::f32s::splat(simd, 0.0)), self.0, at) };
    }

    fn zero(&mut self, range: Range<usize>) {
        self.0[range].fill(0.0);
    }
}

/// Both parts of a kernel g of which the core is [g]+: the core's, and what the Gaussians have beside it, [g]-.
pub(crate) struct Parts<'a>(pub [&'a mut [f32]; 2]);

#[allow(unsafe_code)]
impl Sink for Parts<'_> {
    fn len(&self) -> usize {
        self.0[0].len().min(self.0[1].len())
    }

    #[inline(always)]
    // SAFETY: what the trait asks of the caller, and no more.
    unsafe fn put<S: Simd>(&mut self, _: S, at: usize, smooth: S::f32s, inner: S::f32s) {
        // SAFETY: passed on to the caller.
        unsafe {
            store::<S>(inner, self.0[0], at);
            store::<S>(smooth - inner, self.0[1], at);
        }
    }

    fn zero(&mut self, range: Range<usize>) {
        self.0.iter_mut().for_each(|rows| rows[range.clone()].fill(0.0));
    }
}

/// Inhibits `rows` rows of a strip, in pairs: what a pixel comes to does not depend on its band if bands begin at even rows.
/// `spread` has the room that [`Lateral::ring`] says, `sink` room for an even number of rows. Where the source is zero
/// around a pair nothing is computed, unless `dense`. Returns how many rows were computed.
pub(crate) fn inhibit(
    level: Level,
    kernel: &Lateral,
    source: Strip<'_>,
    rows: usize,
    spread: &mut [f32],
    dense: bool,
    sink: &mut impl Sink,
) -> usize {
    let taps = kernel.taps();
    if taps.is_default() {
        dispatch!(level, simd => inhibit_in::<_, true>(simd, taps, source, rows, spread, dense, sink))
    } else {
        dispatch!(level, simd => inhibit_in::<_, false>(simd, taps, source, rows, spread, dense, sink))
    }
}

/// `DEFAULT`: the kernel has the default shape.
#[inline(always)]
fn inhibit_in<S: Simd, const DEFAULT: bool>(
    simd: S,
    taps: Taps<'_>,
    source: Strip<'_>,
    rows: usize,
    spread: &mut [f32],
    dense: bool,
    sink: &mut impl Sink,
) -> usize {
    let taps = if DEFAULT { taps.of_default_shape() } else { taps };
    let Strip { data, stride, live, width } = source;
    let radius = taps.along.len() - 1;
    let count = rows.next_multiple_of(2) + 2 * radius;
    assert!(width.is_multiple_of(LANES) && width <= STRIP && stride >= width + 2 * radius);
    assert!(live.len() >= count && data.len() >= count * stride && sink.len() >= (count - 2 * radius) * STRIP);
    assert!(spread.len() >= taps.ring() && taps.core.len() == taps.side * taps.side && taps.side <= radius + 1);
    let (mut next, mut until, mut computed) = (0, 0, 0);
    for y in (0..rows).step_by(2) {
        while next < y + 2 + 2 * radius {
            let slot = taps.at(next);
            let out = &mut spread[slot..slot + taps.slot()];
            if live[next] {
                until = next + 1;
                spread_row(simd, &data[next * stride..(next + 1) * stride], width, taps, out);
            } else {
                out.fill(0.0);
            }
            next += 1;
        }
        let at = y * STRIP;
        if until <= y && !dense {
            sink.zero(at..at + 2 * STRIP);
            continue;
        }
        // As many vectors at once as there are registers for their sums.
        if S::f32s::LEN == LANES {
            gather_row::<S, 4>(simd, spread, width, taps, y + radius, at, sink);
        } else {
            gather_row::<S, 2>(simd, spread, width, taps, y + radius, at, sink);
        }
        computed += 2.min(rows - y);
    }
    computed
}

/// Spreads a row into a slot. `src` starts `radius` columns to the left.
#[inline(always)]
fn spread_row<S: Simd>(simd: S, src: &[f32], width: usize, taps: Taps<'_>, out: &mut [f32]) {
    let pairs = width - width % (2 * S::f32s::LEN);
    for x in (0..pairs).step_by(2 * S::f32s::LEN) {
        spread_at::<S, 2>(simd, src, taps, out, x);
    }
    for x in (pairs..width).step_by(S::f32s::LEN) {
        spread_at::<S, 1>(simd, src, taps, out, x);
    }
    if taps.side != DEFAULT_SIDE {
        let radius = taps.along.len() - 1;
        for (core, out) in taps.core.chunks_exact(taps.side).zip(out[2 * STRIP..].chunks_exact_mut(STRIP)) {
            spread_core(simd, &src[radius + 1 - core.len()..], core, &mut out[..width]);
        }
    }
}

/// V vectors from column x on: each tap is fetched once for all of them.
#[inline(always)]
#[allow(unsafe_code)]
fn spread_at<S: Simd, const V: usize>(simd: S, src: &[f32], taps: Taps<'_>, out: &mut [f32], x: usize) {
    let radius = taps.along.len() - 1;
    let zero = S::f32s::splat(simd, 0.0);
    // Loops rather than `map` and `from_fn`, which are not compiled for the instruction set unless they are inlined.
    let (mut smooth, mut inner, mut pair) = ([[zero; V]; 2], [[zero; V]; DEFAULT_SIDE], [zero; V]);
    for d in 0..=radius {
        for (v, pair) in pair.iter_mut().enumerate() {
            let at = x + radius + v * S::f32s::LEN;
            // SAFETY: `inhibit_in` asserts that src has radius columns on both sides of width, and x + V LEN <= width.
            *pair = unsafe { load(simd, src, at - d) };
            if d > 0 {
                // SAFETY: as above.
                *pair += unsafe { load(simd, src, at + d) };
            }
        }
        for (k, smooth) in smooth.iter_mut().enumerate() {
            let tap = S::f32s::splat(simd, taps.along[d][k]);
            for v in 0..V {
                smooth[v] = pair[v].mul_add(tap, smooth[v]);
            }
        }
        if taps.side == DEFAULT_SIDE && d < DEFAULT_SIDE {
            for (j, inner) in inner.iter_mut().enumerate() {
                let tap = S::f32s::splat(simd, taps.core[j * DEFAULT_SIDE + d]);
                for v in 0..V {
                    inner[v] = pair[v].mul_add(tap, inner[v]);
                }
            }
        }
    }
    let rows = if taps.side == DEFAULT_SIDE { 2 + DEFAULT_SIDE } else { 2 };
    for row in 0..rows {
        for v in 0..V {
            let sum = if row < 2 { smooth[row][v] } else { inner[row - 2][v] };
            // SAFETY: out is 2 + side rows of STRIP, and x + V LEN <= width <= STRIP.
            unsafe { store::<S>(sum, out, row * STRIP + x + v * S::f32s::LEN) };
        }
    }
}

#[inline(always)]
#[allow(unsafe_code)]
fn spread_core<S: Simd>(simd: S, src: &[f32], taps: &[f32], out: &mut [f32]) {
    let (width, reach) = (out.len(), taps.len() - 1);
    assert!(width.is_multiple_of(LANES) && src.len() >= width + 2 * reach);
    for x in (0..width).step_by(S::f32s::LEN) {
        // SAFETY: x + LEN <= width, and src has reach columns on both sides.
        unsafe {
            let mut sum = load(simd, src, x + reach) * taps[0];
            for (d, tap) in taps.iter().enumerate().skip(1) {
                let pair = load(simd, src, x + reach - d) + load(simd, src, x + reach + d);
                sum = pair.mul_add(S::f32s::splat(simd, *tap), sum);
            }
            store::<S>(sum, out, x);
        }
    }
}

/// Rows y and y + 1, V vectors at a time.
#[inline(always)]
fn gather_row<S: Simd, const V: usize>(
    simd: S,
    spread: &[f32],
    width: usize,
    taps: Taps<'_>,
    y: usize,
    at: usize,
    sink: &mut impl Sink,
) {
    let whole = width - width % (V * S::f32s::LEN);
    for x in (0..whole).step_by(V * S::f32s::LEN) {
        gather_at::<S, V>(simd, spread, taps, [y, x], at + x, sink);
    }
    for x in (whole..width).step_by(S::f32s::LEN) {
        gather_at::<S, 1>(simd, spread, taps, [y, x], at + x, sink);
    }
}

/// Rows y and y + 1 of V vectors from column x on, which lie from `at` on in `sink`. Source rows that lie evenly around the pair are added and subtracted
/// once for both: half the loads of a row alone.
#[inline(always)]
#[allow(unsafe_code)]
fn gather_at<S: Simd, const V: usize>(
    simd: S,
    spread: &[f32],
    taps: Taps<'_>,
    [y, x]: [usize; 2],
    at: usize,
    sink: &mut impl Sink,
) {
    let zero = S::f32s::splat(simd, 0.0);
    let (mut mean, mut half, mut inner) = ([[zero; V]; 2], [[zero; V]; 2], [[zero; V]; 2]);
    // SAFETY: `inhibit_in` asserts that every row of every slot lies inside spread, and x + V LEN <= width <= STRIP.
    unsafe {
        for (d, pairs) in taps.across.iter().enumerate() {
            let (above, below) = (taps.at(y - d), taps.at(y + 1 + d));
            for k in 0..2 {
                let (mean_tap, half_tap) = (S::f32s::splat(simd, pairs[k].mean), S::f32s::splat(simd, pairs[k].half));
                for v in 0..V {
                    let at = k * STRIP + x + v * S::f32s::LEN;
                    let (above, below) = (load(simd, spread, above + at), load(simd, spread, below + at));
                    mean[k][v] = (above + below).mul_add(mean_tap, mean[k][v]);
                    half[k][v] = (above - below).mul_add(half_tap, half[k][v]);
                }
            }
        }
        for j in 0..taps.side {
            for (row, inner) in inner.iter_mut().enumerate() {
                let (above, below) = (taps.at(y + row - j), taps.at(y + row + j));
                for (v, inner) in inner.iter_mut().enumerate() {
                    let at = (2 + j) * STRIP + x + v * S::f32s::LEN;
                    let value = load(simd, spread, above + at);
                    *inner += if j == 0 { value } else { value + load(simd, spread, below + at) };
                }
            }
        }
    }
    for v in 0..V {
        let (mean, half) = (mean[0][v] + mean[1][v], half[0][v] + half[1][v]);
        let at = at + v * S::f32s::LEN;
        // SAFETY: `inhibit_in` asserts that sink holds both rows.
        unsafe {
            sink.put(simd, at, mean + half, inner[0][v]);
            sink.put(simd, at + STRIP, mean - half, inner[1][v]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::machine::SimdLevel;

    /// Every instruction set against nested loops, for cores of any size, widths that are not a multiple of the blocks, and
    /// an odd number of rows.
    #[test]
    fn by_definition() {
        let mut seed = 5u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            seed as f32 / u32::MAX as f32
        };
        let all = [(1, 0, 16), (2, 2, 48), (7, 2, 64), (7, 7, 32), (9, 4, 48)];
        // Miri takes a thousand times as long for each value.
        let (shapes, rows) = if cfg!(miri) { (&[(1, 0, 16), (7, 2, 16)][..], 3) } else { (&all[..], 9) };
        for &(radius, reach, width) in shapes {
            let along: Vec<[f32; 2]> = (0..=radius).map(|_| [random(), random() - 1.0]).collect();
            let across: Vec<[f64; 2]> = (0..=radius).map(|_| [random(), random() - 1.0].map(f64::from)).collect();
            let core: Vec<Vec<f32>> = (0..=reach).map(|_| (0..=reach).map(|_| random()).collect()).collect();
            let kernel = Lateral::new(along.clone(), &across, &core);
            let stride = width + 2 * radius;
            let count = rows + 1 + 2 * radius;
            let data: Vec<f32> = (0..count * stride).map(|_| random()).collect();
            let source = Strip { data: &data, stride, live: &vec![true; count], width };
            let tap = |dy: usize, dx: usize| {
                let smooth: f64 = (0..2).map(|k| f64::from(along[dx][k]) * across[dy][k]).sum();
                [smooth, core.get(dy).and_then(|row| row.get(dx)).map_or(0.0, |tap| f64::from(*tap))]
            };
            for simd in SimdLevel::available() {
                let mut spread = vec![f32::NAN; kernel.ring()];
                let mut out = vec![vec![0.0; (rows + 1) * STRIP]; 3];
                let [positive, center, surround] = &mut out[..] else { unreachable!() };
                inhibit(simd.level(), &kernel, source, rows, &mut spread, false, &mut Positive(positive));
                inhibit(simd.level(), &kernel, source, rows, &mut spread, false, &mut Parts([center, surround]));
                for row in 0..rows {
                    for x in 0..width {
                        let (mut smooth, mut inner) = (0.0, 0.0);
                        for dy in 0..=2 * radius {
                            for dx in 0..=2 * radius {
                                let taps = tap(dy.abs_diff(radius), dx.abs_diff(radius));
                                let value = f64::from(data[(row + dy) * stride + x + dx]);
                                (smooth, inner) = (smooth + taps[0] * value, inner + taps[1] * value);
                            }
                        }
                        let given = [&out[0], &out[1], &out[2]].map(|out| f64::from(out[row * STRIP + x]));
                        let truth = [(smooth + inner).max(0.0), inner, smooth - inner];
                        for (given, truth) in given.into_iter().zip(truth) {
                            // Some hundred terms of size up to one.
                            assert!((given - truth).abs() < 1e-3, "{simd}, radius {radius}: {given} {truth}");
                        }
                    }
                }
            }
        }
    }
}
