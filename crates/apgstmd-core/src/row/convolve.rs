//! Weighted sums inside and across rows, all taps in one pass. Output rows are whole SIMD blocks; sources carry their
//! halo, so there are no borders here.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use crate::memory::heap;
use crate::plane::LANES;
use crate::tiles::TILE;

/// Lanes of the narrowest vector.
const LEAST_LEN: usize = 4;

/// One vector from `src[at..]`.
///
/// # Safety
/// `at + S::f32s::LEN <= src.len()`.
#[inline(always)]
#[allow(unsafe_code)]
pub(super) unsafe fn load<S: Simd>(simd: S, src: &[f32], at: usize) -> S::f32s {
    debug_assert!(at + S::f32s::LEN <= src.len());
    // SAFETY: the caller keeps the range inside the slice.
    S::f32s::from_slice(simd, unsafe { src.get_unchecked(at..at + S::f32s::LEN) })
}

/// One vector into `dst[at..]`.
///
/// # Safety
/// `at + S::f32s::LEN <= dst.len()`.
#[inline(always)]
#[allow(unsafe_code)]
pub(super) unsafe fn store<S: Simd>(value: S::f32s, dst: &mut [f32], at: usize) {
    debug_assert!(at + S::f32s::LEN <= dst.len());
    // SAFETY: the caller keeps the range inside the slice.
    value.store_slice(unsafe { dst.get_unchecked_mut(at..at + S::f32s::LEN) });
}

/// K symmetric kernels along one row: `out[k][x] = sum over d of taps[|d|][k] src[x + radius + d]`.
pub(crate) fn horizontal<const K: usize>(level: Level, src: &[f32], taps: &[[f32; K]], out: [&mut [f32]; K]) {
    dispatch!(level, simd => horizontal_in(simd, src, taps, out));
}

#[inline(always)]
#[allow(unsafe_code)]
fn horizontal_in<S: Simd, const K: usize>(simd: S, src: &[f32], taps: &[[f32; K]], out: [&mut [f32]; K]) {
    let width = out[0].len();
    let radius = taps.len() - 1;
    assert!(width.is_multiple_of(LANES) && out.iter().all(|row| row.len() == width) && src.len() >= width + 2 * radius);
    for x in (0..width).step_by(S::f32s::LEN) {
        // SAFETY: x + LEN <= width since width is a multiple of LEN, so every load ends at width + 2 radius at most.
        unsafe {
            let middle = load(simd, src, x + radius);
            let mut sums = taps[0].map(|tap| middle * tap);
            for (d, taps) in taps.iter().enumerate().skip(1) {
                let pair = load(simd, src, x + radius - d) + load(simd, src, x + radius + d);
                for k in 0..K {
                    sums[k] = pair.mul_add(S::f32s::splat(simd, taps[k]), sums[k]);
                }
            }
            for k in 0..K {
                store::<S>(sums[k], out[k], x);
            }
        }
    }
}

/// K symmetric kernels across rows, one source each, summed:
/// `out[x] = sum over k, d of taps[|d|][k] src[k][(radius + d) stride + x]`.
pub(crate) fn vertical<const K: usize>(
    level: Level,
    src: [&[f32]; K],
    stride: usize,
    taps: &[[f32; K]],
    out: &mut [f32],
) {
    dispatch!(level, simd => vertical_in(simd, src, stride, taps, out));
}

#[inline(always)]
#[allow(unsafe_code)]
fn vertical_in<S: Simd, const K: usize>(simd: S, src: [&[f32]; K], stride: usize, taps: &[[f32; K]], out: &mut [f32]) {
    let radius = taps.len() - 1;
    assert!(out.len().is_multiple_of(LANES) && src.iter().all(|src| src.len() >= 2 * radius * stride + out.len()));
    for x in (0..out.len()).step_by(S::f32s::LEN) {
        // SAFETY: x + LEN <= out.len(), and the assertion keeps the last source row inside its slice.
        unsafe {
            store::<S>(vertical_sum(simd, src, stride, taps, x), out, x);
        }
    }
}

/// # Safety
/// As asserted by `vertical_in` for this `x`.
#[inline(always)]
#[allow(unsafe_code)]
pub(super) unsafe fn vertical_sum<S: Simd, const K: usize>(
    simd: S,
    src: [&[f32]; K],
    stride: usize,
    taps: &[[f32; K]],
    x: usize,
) -> S::f32s {
    let radius = taps.len() - 1;
    let mut sum = S::f32s::splat(simd, 0.0);
    // SAFETY: passed on to the caller.
    unsafe {
        for k in 0..K {
            sum = load(simd, src[k], radius * stride + x).mul_add(S::f32s::splat(simd, taps[0][k]), sum);
        }
        for (d, taps) in taps.iter().enumerate().skip(1) {
            for k in 0..K {
                let above = load(simd, src[k], (radius - d) * stride + x);
                let below = load(simd, src[k], (radius + d) * stride + x);
                sum = (above + below).mul_add(S::f32s::splat(simd, taps[k]), sum);
            }
        }
    }
    sum
}

/// Lateral inhibition: two kernels that are separable, with these taps across rows, and a dense core.
#[derive(Clone, Debug)]
pub(crate) struct Lateral {
    pub across: Vec<[f32; 2]>,
    /// Half width of the core.
    pub reach: usize,
    /// Row and column in the core, from its top left corner, and tap.
    pub core: Vec<(usize, usize, f32)>,
}

heap!(Lateral { across, core });

/// `out[x] = max(sum over the rows of both smooth sources + core around dense[x + radius], 0)`. `smooth` starts `radius`
/// rows above the output row, `dense` the core's radius above it and `radius` columns to the left.
pub(crate) fn inhibit(
    level: Level,
    smooth: [&[f32]; 2],
    dense: &[f32],
    strides: [usize; 2],
    kernel: &Lateral,
    out: &mut [f32],
) {
    dispatch!(level, simd => inhibit_in(simd, smooth, dense, strides, kernel, out));
}

#[inline(always)]
#[allow(unsafe_code)]
fn inhibit_in<S: Simd>(
    simd: S,
    smooth: [&[f32]; 2],
    dense: &[f32],
    [stride, dense_stride]: [usize; 2],
    Lateral { across: taps, reach, core }: &Lateral,
    out: &mut [f32],
) {
    let (radius, reach) = (taps.len() - 1, *reach);
    assert!(out.len().is_multiple_of(LANES) && smooth.iter().all(|src| src.len() >= 2 * radius * stride + out.len()));
    assert!(radius >= reach && dense.len() >= 2 * reach * dense_stride + radius + reach + out.len());
    assert!(core.iter().all(|&(row, column, _)| row <= 2 * reach && column <= 2 * reach));
    let zero = S::f32s::splat(simd, 0.0);
    let vectors = LANES / S::f32s::LEN;
    for x in (0..out.len()).step_by(LANES) {
        // SAFETY: x + LANES <= out.len(), and the assertions keep the farthest load of each source inside its slice.
        unsafe {
            // A block of LANES columns at a time: each tap is fetched once for all its vectors.
            let mut sums = [zero; LANES / LEAST_LEN];
            for k in 0..2 {
                let tap = S::f32s::splat(simd, taps[0][k]);
                for (v, sum) in sums.iter_mut().enumerate().take(vectors) {
                    *sum = load(simd, smooth[k], radius * stride + x + v * S::f32s::LEN).mul_add(tap, *sum);
                }
                for (d, taps) in taps.iter().enumerate().skip(1) {
                    let tap = S::f32s::splat(simd, taps[k]);
                    for (v, sum) in sums.iter_mut().enumerate().take(vectors) {
                        let above = load(simd, smooth[k], (radius - d) * stride + x + v * S::f32s::LEN);
                        let below = load(simd, smooth[k], (radius + d) * stride + x + v * S::f32s::LEN);
                        *sum = (above + below).mul_add(tap, *sum);
                    }
                }
            }
            for &(row, column, tap) in core {
                let at = row * dense_stride + radius - reach + column + x;
                let tap = S::f32s::splat(simd, tap);
                for (v, sum) in sums.iter_mut().enumerate().take(vectors) {
                    *sum = load(simd, dense, at + v * S::f32s::LEN).mul_add(tap, *sum);
                }
            }
            for (v, sum) in sums.iter().enumerate().take(vectors) {
                store::<S>(sum.max(zero), out, x + v * S::f32s::LEN);
            }
        }
    }
}

/// Three moments along one row: even kernels g0, g2 and the odd kernel g1 (`taps[|d|] = [g0, g1, g2]`).
pub(crate) fn moments(level: Level, src: &[f32], taps: &[[f32; 3]], out: [&mut [f32]; 3]) {
    dispatch!(level, simd => moments_in(simd, src, taps, out));
}

#[inline(always)]
#[allow(unsafe_code)]
fn moments_in<S: Simd>(simd: S, src: &[f32], taps: &[[f32; 3]], out: [&mut [f32]; 3]) {
    let [out0, out1, out2] = out;
    let width = out0.len();
    let radius = taps.len() - 1;
    assert!(
        width.is_multiple_of(LANES) && out1.len() == width && out2.len() == width && src.len() >= width + 2 * radius
    );
    for x in (0..width).step_by(S::f32s::LEN) {
        // SAFETY: as in `horizontal_in`.
        unsafe {
            let middle = load(simd, src, x + radius);
            let (mut g0, mut g1, mut g2) = (middle * taps[0][0], middle * taps[0][1], middle * taps[0][2]);
            for (d, taps) in taps.iter().enumerate().skip(1) {
                let (left, right) = (load(simd, src, x + radius - d), load(simd, src, x + radius + d));
                let (even, odd) = (left + right, right - left);
                g0 = even.mul_add(S::f32s::splat(simd, taps[0]), g0);
                g1 = odd.mul_add(S::f32s::splat(simd, taps[1]), g1);
                g2 = even.mul_add(S::f32s::splat(simd, taps[2]), g2);
            }
            store::<S>(g0, out0, x);
            store::<S>(g1, out1, x);
            store::<S>(g2, out2, x);
        }
    }
}

/// One scale of the steerable attention kernels across the rows of three moments. With Vab the response of g_a along x
/// and g_b along y, the least of the four orientations is
/// `c V00 - max(V20, V02, (V20 + V02) / 2 + |V11|)`; `out` becomes the larger of it and what it held.
pub(crate) fn steer(
    level: Level,
    moments: [&[f32]; 3],
    stride: usize,
    taps: &[[f32; 3]],
    center: f32,
    out: &mut [f32],
) {
    dispatch!(level, simd => steer_in(simd, moments, stride, taps, center, out));
}

#[inline(always)]
#[allow(unsafe_code)]
fn steer_in<S: Simd>(simd: S, moments: [&[f32]; 3], stride: usize, taps: &[[f32; 3]], center: f32, out: &mut [f32]) {
    let [m0, m1, m2] = moments;
    let radius = taps.len() - 1;
    assert!(out.len().is_multiple_of(LANES) && moments.iter().all(|src| src.len() >= 2 * radius * stride + out.len()));
    let half = S::f32s::splat(simd, 0.5);
    for x in (0..out.len()).step_by(S::f32s::LEN) {
        // SAFETY: as in `vertical_in`.
        unsafe {
            let middle = load(simd, m0, radius * stride + x);
            let mut v00 = middle * taps[0][0];
            let mut v02 = middle * taps[0][2];
            let mut v20 = load(simd, m2, radius * stride + x) * taps[0][0];
            let mut v11 = S::f32s::splat(simd, 0.0);
            for (d, taps) in taps.iter().enumerate().skip(1) {
                let (up, down) = ((radius - d) * stride + x, (radius + d) * stride + x);
                let (g0, g1, g2) =
                    (S::f32s::splat(simd, taps[0]), S::f32s::splat(simd, taps[1]), S::f32s::splat(simd, taps[2]));
                let even0 = load(simd, m0, up) + load(simd, m0, down);
                let even2 = load(simd, m2, up) + load(simd, m2, down);
                let odd1 = load(simd, m1, down) - load(simd, m1, up);
                v00 = even0.mul_add(g0, v00);
                v02 = even0.mul_add(g2, v02);
                v20 = even2.mul_add(g0, v20);
                v11 = odd1.mul_add(g1, v11);
            }
            let diagonal = (v20 + v02).mul_add(half, v11.abs());
            let least = v00 * center - v20.max(v02).max(diagonal);
            store::<S>(least.max(load(simd, out, x)), out, x);
        }
    }
}

/// A square kernel over a tile of `TILE` x `TILE`: `out[y][x] = sum over j, i of taps[j][i] src[y + j][x + i]`. `spans[row]`
/// names the columns of a source row outside which it is zero; what they leave out is not computed.
pub(crate) fn correlate_tile(
    level: Level,
    src: &[f32],
    stride: usize,
    spans: &[Range<usize>],
    taps: &[f32],
    out: &mut [f32],
) {
    dispatch!(level, simd => correlate_tile_in(simd, src, stride, spans, taps, out));
}

/// Sums in flight: enough to hide the latency of a fused multiply-add, few enough for the registers.
const SUMS: usize = 8;

#[inline(always)]
#[allow(unsafe_code)]
fn correlate_tile_in<S: Simd>(
    simd: S,
    src: &[f32],
    stride: usize,
    spans: &[Range<usize>],
    taps: &[f32],
    out: &mut [f32],
) {
    let side = spans.len() + 1 - TILE;
    assert!(taps.len() == side * side && out.len() == TILE * TILE && TILE.is_multiple_of(S::f32s::LEN));
    assert!(stride >= side - 1 + TILE && src.len() >= (spans.len() - 1) * stride + side - 1 + TILE);
    let across = TILE / S::f32s::LEN;
    let rows = SUMS / across;
    for top in (0..TILE).step_by(rows) {
        let mut sums = [S::f32s::splat(simd, 0.0); SUMS];
        for (j, taps) in taps.chunks_exact(side).enumerate() {
            let (first, last) = spans[top + j..top + j + rows]
                .iter()
                .filter(|span| !span.is_empty())
                .fold((side + TILE, 0), |(first, last), span| (first.min(span.start), last.max(span.end)));
            let corner = (top + j) * stride;
            for (i, tap) in taps.iter().enumerate().take(last).skip(first.saturating_sub(TILE - 1)) {
                let tap = S::f32s::splat(simd, *tap);
                for (index, sum) in sums.iter_mut().enumerate() {
                    let at = corner + index / across * stride + index % across * S::f32s::LEN + i;
                    // SAFETY: the row is below spans.len() and the last column below side - 1 + TILE: as asserted.
                    *sum = unsafe { load(simd, src, at) }.mul_add(tap, *sum);
                }
            }
        }
        for (sum, out) in sums.iter().zip(out[top * TILE..].chunks_exact_mut(S::f32s::LEN)) {
            sum.store_slice(out);
        }
    }
}
