//! Opponent signals along a row: centre and surround, ON and delayed OFF, one direction and its opposite.

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::convolve::{Lateral, load, store, vertical_sum};
use crate::plane::LANES;

/// Both parts of a kernel g given as in `inhibit`, with the core [g]+: `out[0] = core * dense`, and `out[1]` is what the
/// smooth sources have beside it, [g]- * dense.
pub(crate) fn center_surround(
    level: Level,
    smooth: [&[f32]; 2],
    dense: &[f32],
    strides: [usize; 2],
    kernel: &Lateral,
    out: [&mut [f32]; 2],
) {
    dispatch!(level, simd => center_surround_in(simd, smooth, dense, strides, kernel, out));
}

#[inline(always)]
#[allow(unsafe_code)]
fn center_surround_in<S: Simd>(
    simd: S,
    smooth: [&[f32]; 2],
    dense: &[f32],
    [stride, dense_stride]: [usize; 2],
    Lateral { across: taps, reach, core }: &Lateral,
    out: [&mut [f32]; 2],
) {
    let [center, surround] = out;
    let width = center.len();
    let (radius, reach) = (taps.len() - 1, *reach);
    assert!(width.is_multiple_of(LANES) && surround.len() == width);
    assert!(smooth.iter().all(|src| src.len() >= 2 * radius * stride + width));
    assert!(radius >= reach && dense.len() >= 2 * reach * dense_stride + radius + reach + width);
    assert!(core.iter().all(|&(row, column, _)| row <= 2 * reach && column <= 2 * reach));
    for x in (0..width).step_by(S::f32s::LEN) {
        // SAFETY: x + LEN <= width, and the assertions keep the farthest load of each source inside its slice.
        unsafe {
            let mut inner = S::f32s::splat(simd, 0.0);
            for &(row, column, tap) in core {
                let value = load(simd, dense, row * dense_stride + radius - reach + column + x);
                inner = value.mul_add(S::f32s::splat(simd, tap), inner);
            }
            let all = vertical_sum(simd, smooth, stride, taps, x);
            store::<S>(inner, center, x);
            store::<S>(all - inner, surround, x);
        }
    }
}

/// `out = a b`, zero where it is not above `floor`.
pub(crate) fn multiply(level: Level, a: &[f32], b: &[f32], floor: f32, out: &mut [f32]) {
    dispatch!(level, simd => multiply_in(simd, a, b, floor, out));
}

#[inline(always)]
fn multiply_in<S: Simd>(_: S, a: &[f32], b: &[f32], floor: f32, out: &mut [f32]) {
    let width = out.len();
    let (a, b) = (&a[..width], &b[..width]);
    for x in 0..width {
        let product = a[x] * b[x];
        out[x] = if product > floor { product } else { 0.0 };
    }
}

/// Elementary motion detector: `out = y slow_up - slow y_up`, zero where it is not above `floor`; `strongest` becomes the
/// larger of it and what it held. No fused multiply-add: the last columns, which are no whole vector, get the same bits.
pub(crate) fn oppose(
    level: Level,
    [y, slow]: [&[f32]; 2],
    [y_up, slow_up]: [&[f32]; 2],
    floor: f32,
    out: &mut [f32],
    strongest: &mut [f32],
) {
    dispatch!(level, simd => oppose_in(simd, [y, slow], [y_up, slow_up], floor, out, strongest));
}

#[inline(always)]
fn oppose_in<S: Simd>(
    _: S,
    [y, slow]: [&[f32]; 2],
    [y_up, slow_up]: [&[f32]; 2],
    floor: f32,
    out: &mut [f32],
    strongest: &mut [f32],
) {
    let width = out.len();
    let (y, slow, y_up, slow_up) = (&y[..width], &slow[..width], &y_up[..width], &slow_up[..width]);
    let strongest = &mut strongest[..width];
    for x in 0..width {
        let difference = y[x] * slow_up[x] - slow[x] * y_up[x];
        out[x] = if difference > floor { difference } else { 0.0 };
        strongest[x] = strongest[x].max(out[x]);
    }
}
