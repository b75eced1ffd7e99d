//! Opponent signals along a row: ON and delayed OFF, one direction and its opposite.

use fearless_simd::{Level, Simd, dispatch};

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
