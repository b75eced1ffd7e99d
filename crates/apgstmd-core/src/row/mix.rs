//! Products and mixtures of rows, pixel by pixel.

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::convolve::{load, store};
use crate::DIRECTIONS;
use crate::plane::LANES;

/// The lobula's product: `out = max(l, 0) (tm1_4 + mi1_up) tm1_5_up`, zero where it is below `floor`.
/// No fused multiply-add, so that the last columns of a row, which are no whole vector, get the same bits.
pub(crate) fn correlate(
    level: Level,
    l: &[f32],
    tm1_4: &[f32],
    mi1_up: &[f32],
    tm1_5_up: &[f32],
    floor: f32,
    out: &mut [f32],
) {
    dispatch!(level, simd => correlate_in(simd, l, tm1_4, mi1_up, tm1_5_up, floor, out));
}

#[inline(always)]
fn correlate_in<S: Simd>(
    _: S,
    l: &[f32],
    tm1_4: &[f32],
    mi1_up: &[f32],
    tm1_5_up: &[f32],
    floor: f32,
    out: &mut [f32],
) {
    let width = out.len();
    let (l, tm1_4, mi1_up, tm1_5_up) = (&l[..width], &tm1_4[..width], &mi1_up[..width], &tm1_5_up[..width]);
    for x in 0..width {
        let product = l[x].max(0.0) * (tm1_4[x] + mi1_up[x]) * tm1_5_up[x];
        out[x] = if product < floor { 0.0 } else { product };
    }
}

/// Inhibition between directions: `out[k] = max(sum over m of weights[|k - m|] s[m], 0)`, the distance taken around the
/// circle; values at or below `floor` become zero. `strongest` receives the largest over k.
pub(crate) fn inhibit_directions(
    level: Level,
    s: [&[f32]; DIRECTIONS],
    weights: &[f32; DIRECTIONS / 2 + 1],
    floor: f32,
    out: [&mut [f32]; DIRECTIONS],
    strongest: &mut [f32],
) {
    dispatch!(level, simd => inhibit_directions_in(simd, s, weights, floor, out, strongest));
}

#[inline(always)]
#[allow(unsafe_code)]
fn inhibit_directions_in<S: Simd>(
    simd: S,
    s: [&[f32]; DIRECTIONS],
    weights: &[f32; DIRECTIONS / 2 + 1],
    floor: f32,
    out: [&mut [f32]; DIRECTIONS],
    strongest: &mut [f32],
) {
    let width = strongest.len();
    assert!(
        width.is_multiple_of(LANES)
            && s.iter().all(|row| row.len() == width)
            && out.iter().all(|row| row.len() == width)
    );
    let zero = S::f32s::splat(simd, 0.0);
    let floor = S::f32s::splat(simd, floor);
    let w = weights.map(|weight| S::f32s::splat(simd, weight));
    for x in (0..width).step_by(S::f32s::LEN) {
        // SAFETY: x + LEN <= width, the length of every row.
        unsafe {
            let s: [S::f32s; DIRECTIONS] = std::array::from_fn(|k| load(simd, s[k], x));
            let mut most = zero;
            for k in 0..DIRECTIONS {
                let around = |d: usize| s[(k + d) % DIRECTIONS] + s[(k + DIRECTIONS - d) % DIRECTIONS];
                let mut sum = s[k] * w[0];
                for (d, w) in w.iter().enumerate().take(DIRECTIONS / 2).skip(1) {
                    sum = around(d).mul_add(*w, sum);
                }
                sum = s[(k + DIRECTIONS / 2) % DIRECTIONS].mul_add(w[DIRECTIONS / 2], sum);
                let value = sum.simd_gt(floor).select(sum, zero);
                most = most.max(value);
                store::<S>(value, out[k], x);
            }
            store::<S>(most, strongest, x);
        }
    }
}

/// `out = a x + b y`.
pub(crate) fn blend(level: Level, a: f32, x: &[f32], b: f32, y: &[f32], out: &mut [f32]) {
    dispatch!(level, simd => blend_in(simd, a, x, b, y, out));
}

#[inline(always)]
fn blend_in<S: Simd>(_: S, a: f32, x: &[f32], b: f32, y: &[f32], out: &mut [f32]) {
    let width = out.len();
    let (x, y) = (&x[..width], &y[..width]);
    for i in 0..width {
        out[i] = a * x[i] + b * y[i];
    }
}

/// `out += a x`. No fused multiply-add: one pixel alone gives the same bits as a row.
pub(crate) fn add_scaled(level: Level, a: f32, x: &[f32], out: &mut [f32]) {
    dispatch!(level, simd => add_scaled_in(simd, a, x, out));
}

#[inline(always)]
fn add_scaled_in<S: Simd>(_: S, a: f32, x: &[f32], out: &mut [f32]) {
    let width = out.len();
    let x = &x[..width];
    for i in 0..width {
        out[i] += a * x[i];
    }
}
