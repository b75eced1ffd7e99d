//! A square kernel over one tile: what is not separable, done with as little of its source as there is.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::load_store::{load, store};
use crate::memory::heap;
use crate::tiles::TILE;

/// Rows of a tile whose sums are in flight together, half of it: each vector of the source is loaded once for all of them.
pub(crate) const ROWS: usize = TILE / 2;

/// Side of a patch, px, and patches along a side of a tile.
pub(crate) const PATCH: usize = 4;
pub(crate) const PATCHES: usize = TILE / PATCH;

/// The taps of a square kernel, arranged for [`correlate_tile`].
#[derive(Clone, Debug)]
pub(crate) struct TileKernel {
    side: usize,
    /// Column by column from below upward, with `ROWS` zeros at both ends: the taps that one row of the source has in
    /// consecutive rows of the tile lie side by side.
    taps: Vec<f32>,
}

heap!(TileKernel { taps });

impl TileKernel {
    /// `taps` row by row, an odd number of rows and as many columns.
    pub fn new(taps: &[f32]) -> Self {
        let side = taps.len().isqrt();
        assert_eq!(side * side, taps.len());
        let column = |i: usize| {
            let zeros = || std::iter::repeat_n(0.0, ROWS);
            zeros().chain((0..side).rev().map(move |j| taps[j * side + i])).chain(zeros())
        };
        Self { side, taps: (0..side).flat_map(column).collect() }
    }

    fn column(&self) -> usize {
        self.side + 2 * ROWS
    }
}

/// `out[y][x] = sum over j, i of taps[j][i] src[y + j][x + i]` for a tile. `spans[row]` names the columns of a source row
/// outside which it is zero; what they leave out is not computed, which changes no bit. Halves that are not wanted are zero.
pub(crate) fn correlate_tile(
    level: Level,
    src: &[f32],
    stride: usize,
    spans: &[Range<usize>],
    kernel: &TileKernel,
    halves: [bool; 2],
    out: &mut [f32],
) {
    dispatch!(level, simd => correlate_tile_in(simd, src, stride, spans, kernel, halves, out));
}

#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn correlate_tile_in<S: Simd>(
    simd: S,
    src: &[f32],
    stride: usize,
    spans: &[Range<usize>],
    kernel: &TileKernel,
    halves: [bool; 2],
    out: &mut [f32],
) {
    let side = kernel.side;
    assert!(spans.len() == side + TILE - 1 && out.len() == TILE * TILE && TILE.is_multiple_of(S::f32s::LEN));
    assert!(stride >= side - 1 + TILE && src.len() >= (spans.len() - 1) * stride + side - 1 + TILE);
    assert!(kernel.taps.len() == side * kernel.column());
    for (top, wanted) in [0, ROWS].into_iter().zip(halves) {
        if !wanted {
            out[top * TILE..(top + ROWS) * TILE].fill(0.0);
            continue;
        }
        for left in (0..TILE).step_by(S::f32s::LEN) {
            let mut sums = [S::f32s::splat(simd, 0.0); ROWS];
            for (j, span) in spans[top..top + side + ROWS - 1].iter().enumerate() {
                // Columns of the kernel with which some lane meets the span.
                let first = (span.start + 1).saturating_sub(left + S::f32s::LEN);
                let last = span.end.saturating_sub(left).min(side);
                let row = (top + j) * stride + left;
                // The first rows of the source reach only the upper half of these rows, the last only the lower.
                if j < ROWS / 2 {
                    add_row::<S, 0, { ROWS / 2 }>(simd, &src[row..], kernel, j, first..last, &mut sums);
                } else if j >= side + ROWS / 2 - 1 {
                    add_row::<S, { ROWS / 2 }, ROWS>(simd, &src[row..], kernel, j, first..last, &mut sums);
                } else {
                    add_row::<S, 0, ROWS>(simd, &src[row..], kernel, j, first..last, &mut sums);
                }
            }
            for (y, sum) in sums.iter().enumerate() {
                let at = (top + y) * TILE + left;
                sum.store_slice(&mut out[at..at + S::f32s::LEN]);
            }
        }
    }
}

/// Rows of a tile inside a map; below them it is zero.
#[derive(Clone, Copy)]
pub(crate) struct TileRows<'a> {
    pub data: &'a [f32],
    pub stride: usize,
    pub rows: usize,
}

/// `out = a x + b y` over a tile, of which `out` has rows `stride` apart; what is not there is zero. Returns for each row
/// which columns are not zero, as bits, and the sums over the patches of the tile.
pub(crate) fn mix_tile(
    level: Level,
    [a, b]: [f32; 2],
    (x, y): (Option<TileRows<'_>>, Option<&[f32]>),
    out: &mut [f32],
    stride: usize,
) -> ([u16; TILE], [f32; PATCHES * PATCHES]) {
    let zeros = [0.0; TILE];
    let x = x.unwrap_or(TileRows { data: &zeros, stride: 0, rows: TILE });
    let (y, step) = y.map_or((&zeros[..], 0), |y| (y, TILE));
    dispatch!(level, simd => mix_tile_in(simd, [a, b], x, (y, step), out, stride))
}

#[inline(always)]
#[allow(unsafe_code)]
fn mix_tile_in<S: Simd>(
    simd: S,
    [a, b]: [f32; 2],
    x: TileRows<'_>,
    (y, step): (&[f32], usize),
    out: &mut [f32],
    stride: usize,
) -> ([u16; TILE], [f32; PATCHES * PATCHES]) {
    assert!((1..=TILE).contains(&x.rows) && x.data.len() >= (x.rows - 1) * x.stride + TILE);
    assert!(y.len() >= (TILE - 1) * step + TILE && TILE.is_multiple_of(S::f32s::LEN));
    assert!(stride >= TILE && out.len() >= (TILE - 1) * stride + TILE);
    let zero = S::f32s::splat(simd, 0.0);
    let (mut columns, mut patches) = ([0; TILE], [0.0; PATCHES * PATCHES]);
    for (high, patches) in patches.chunks_exact_mut(PATCHES).enumerate() {
        let mut total = [0.0; TILE];
        for left in (0..TILE).step_by(S::f32s::LEN) {
            let mut sum = zero;
            for (row, columns) in columns.iter_mut().enumerate().skip(high * PATCH).take(PATCH) {
                // SAFETY: left + LEN <= TILE, x holds its rows, y and out hold TILE rows, as asserted.
                unsafe {
                    let first = if row < x.rows { load(simd, x.data, row * x.stride + left) } else { zero };
                    let value = first * a + load(simd, y, row * step + left) * b;
                    store::<S>(value, out, row * stride + left);
                    *columns |= (value.simd_gt(zero).to_bitmask() as u16) << left;
                    sum += value;
                }
            }
            sum.store_slice(&mut total[left..left + S::f32s::LEN]);
        }
        for (patch, total) in patches.iter_mut().zip(total.chunks_exact(PATCH)) {
            for value in total {
                *patch += value;
            }
        }
    }
    (columns, patches)
}

/// Whether anything in a tile is not zero. None is negative.
pub(crate) fn anything(level: Level, src: TileRows<'_>) -> bool {
    dispatch!(level, simd => anything_in(simd, src))
}

#[inline(always)]
#[allow(unsafe_code)]
fn anything_in<S: Simd>(simd: S, TileRows { data, stride, rows }: TileRows<'_>) -> bool {
    assert!(rows > 0 && data.len() >= (rows - 1) * stride + TILE && TILE.is_multiple_of(S::f32s::LEN));
    let zero = S::f32s::splat(simd, 0.0);
    let mut most = zero;
    for row in 0..rows {
        for left in (0..TILE).step_by(S::f32s::LEN) {
            // SAFETY: data holds TILE columns of each row, as asserted.
            most = most.max(unsafe { load(simd, data, row * stride + left) });
        }
    }
    most.simd_gt(zero).any_true()
}

/// `r += (inside - r) fade` along a row, inside being 1 where `m` exceeds `threshold` and 0 elsewhere; what falls below
/// `least` becomes zero. Returns whether anything is not zero.
pub(crate) fn fade_row(level: Level, m: Option<&[f32]>, threshold: f32, fade: f32, least: f32, r: &mut [f32]) -> bool {
    dispatch!(level, simd => fade_row_in(simd, m, threshold, fade, least, r))
}

#[inline(always)]
fn fade_row_in<S: Simd>(_: S, m: Option<&[f32]>, threshold: f32, fade: f32, least: f32, r: &mut [f32]) -> bool {
    // No fused multiply-add: columns that are no whole vector get the same bits.
    let mut any = false;
    match m {
        Some(m) => {
            for (r, m) in r.iter_mut().zip(m) {
                let inside = if *m > threshold { 1.0 } else { 0.0 };
                let next = *r + (inside - *r) * fade;
                *r = if next < least { 0.0 } else { next };
                any |= *r > 0.0;
            }
        }
        None => {
            for r in r {
                let next = *r + (0.0 - *r) * fade;
                *r = if next < least { 0.0 } else { next };
                any |= *r > 0.0;
            }
        }
    }
    any
}

/// Adds what row `j` of the source gives to rows FROM..TO of the tile.
#[inline(always)]
#[allow(unsafe_code)]
fn add_row<S: Simd, const FROM: usize, const TO: usize>(
    simd: S,
    src: &[f32],
    kernel: &TileKernel,
    j: usize,
    columns: Range<usize>,
    sums: &mut [S::f32s; ROWS],
) {
    let length = kernel.column();
    // Row y of the tile meets row j - y of the kernel.
    let place = kernel.side - 1 + ROWS - j;
    assert!(columns.end <= kernel.side && place + ROWS <= length && kernel.taps.len() >= kernel.side * length);
    assert!(columns.is_empty() || src.len() >= columns.end - 1 + S::f32s::LEN);
    let mut now = *sums;
    for i in columns {
        // SAFETY: i is below columns.end, up to which the source holds a whole vector.
        let value = unsafe { load(simd, src, i) };
        // SAFETY: i is below side, and a column of the kernel has more than place + ROWS taps: as asserted.
        let taps = unsafe { kernel.taps.get_unchecked(i * length + place..i * length + place + ROWS) };
        for y in FROM..TO {
            now[y] = value.mul_add(S::f32s::splat(simd, taps[y]), now[y]);
        }
    }
    *sums = now;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::machine::SimdLevel;

    /// Every instruction set against nested loops, and rows and columns passed over against none passed over.
    #[test]
    fn correlation_by_definition_whatever_is_passed_over() {
        let mut seed = 11u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            seed as f32 / u32::MAX as f32
        };
        // Miri takes a thousand times as long for each value.
        for &side in if cfg!(miri) { &[1, 3][..] } else { &[1, 3, 7, 27] } {
            let rows = side + TILE - 1;
            let (stride, taps): (usize, Vec<f32>) = (rows + 5, (0..side * side).map(|_| random()).collect());
            let mut src = vec![0.0; rows * stride + TILE];
            let mut spans = vec![0..0; rows];
            for (y, span) in spans.iter_mut().enumerate().filter(|(y, _)| y % 3 != 0) {
                *span = y % rows..(y + 4).min(rows);
                span.clone().for_each(|x| src[y * stride + x] = random());
            }
            let (kernel, whole) = (TileKernel::new(&taps), vec![0..rows; rows]);
            for simd in SimdLevel::available() {
                let correlate = |spans: &[Range<usize>], halves| {
                    let mut out = vec![7.0; TILE * TILE];
                    correlate_tile(simd.level(), &src, stride, spans, &kernel, halves, &mut out);
                    out
                };
                let out = correlate(&spans, [true; 2]);
                assert_eq!(out, correlate(&whole, [true; 2]), "{simd}, side {side}");
                let lower = correlate(&spans, [false, true]);
                assert!(lower[..TILE * ROWS].iter().all(|value| *value == 0.0));
                assert_eq!(lower[TILE * ROWS..], out[TILE * ROWS..]);
                for (place, given) in out.iter().enumerate() {
                    let (y, x) = (place / TILE, place % TILE);
                    let truth: f64 = (0..side * side)
                        .map(|i| f64::from(taps[i]) * f64::from(src[(y + i / side) * stride + x + i % side]))
                        .sum();
                    // Positive terms, at most 729 roundings of half a unit in the last place.
                    assert!((f64::from(*given) - truth).abs() <= 1e-5 * truth, "{simd}, side {side}: {given} {truth}");
                }
            }
        }
    }
}
