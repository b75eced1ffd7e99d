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
