//! Weighted sums inside and across rows, all taps in one pass. Output rows are whole SIMD blocks; sources carry their
//! halo, so there are no borders here.

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::load_store::{load, store};
use crate::plane::LANES;

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
