//! Products and mixtures of rows, pixel by pixel.

use std::f32::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};
use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::load_store::{load, store};
use crate::DIRECTIONS;
use crate::plane::LANES;
use crate::row::bands::Rows;
use crate::row::lateral::STRIP;

/// The lobula's product, one row of each direction: `out = max(l, 0) (tm1_4 + mi1_up) tm1_5_up` zero where
/// it is below `floor`. Returns of each direction whether anything is not zero.
#[inline(always)]
#[allow(unsafe_code)]
pub(crate) fn correlate<S: Simd, const K: usize>(
    simd: S,
    [l, tm1_4]: [&[f32]; 2],
    [mi1_up, tm1_5_up]: [[&[f32]; K]; 2],
    floor: f32,
    out: [&mut [f32]; K],
) -> [bool; K] {
    let width = l.len();
    assert!(width.is_multiple_of(LANES) && tm1_4.len() == width);
    for k in 0..K {
        assert!(mi1_up[k].len() == width && tm1_5_up[k].len() == width && out[k].len() == width);
    }
    let zero = S::f32s::splat(simd, 0.0);
    let floor = S::f32s::splat(simd, floor);
    let mut any = [zero; K];
    for x in (0..width).step_by(S::f32s::LEN) {
        // SAFETY: x + LEN <= width, the length of every row.
        unsafe {
            let (tm3, tm1_4) = (load(simd, l, x).max(zero), load(simd, tm1_4, x));
            for k in 0..K {
                let product = (tm1_4 + load(simd, mi1_up[k], x)) * tm3 * load(simd, tm1_5_up[k], x);
                let value = product.simd_lt(floor).select(zero, product);
                any[k] = any[k].max(value);
                store::<S>(value, out[k], x);
            }
        }
    }
    let mut live = [false; K];
    for k in 0..K {
        live[k] = any[k].simd_gt(zero).any_true();
    }
    live
}

/// Inhibition between directions: `e[k] = max(sum over m of weights[|k - m|] s[m], 0)`, the distance taken around the
/// circle; values at or below `floor` become zero. `strongest` receives the largest over k. Without `e` nothing else
/// is written. `s` holds rows of `STRIP`, of
/// which the first are written to `columns`.
pub(crate) fn inhibit_directions(
    level: Level,
    s: [&[f32]; DIRECTIONS],
    columns: Range<usize>,
    weights: &[f32; DIRECTIONS / 2 + 1],
    floor: f32,
    e: Option<&mut [Rows<'_>; DIRECTIONS]>,
    strongest: &mut Rows<'_>,
) {
    let mut none: [Rows<'_>; DIRECTIONS] = std::array::from_fn(|_| Rows { data: &mut [], stride: 0 });
    match e {
        Some(e) => {
            dispatch!(level, simd => inhibit_directions_in::<_, true>(simd, s, columns, weights, floor, e, strongest));
        }
        None => {
            dispatch!(level, simd => inhibit_directions_in::<_, false>(simd, s, columns, weights, floor, &mut none, strongest));
        }
    }
}

#[inline(always)]
#[allow(unsafe_code)]
fn inhibit_directions_in<S: Simd, const MAPS: bool>(
    simd: S,
    s: [&[f32]; DIRECTIONS],
    columns: Range<usize>,
    weights: &[f32; DIRECTIONS / 2 + 1],
    floor: f32,
    e: &mut [Rows<'_>; DIRECTIONS],
    strongest: &mut Rows<'_>,
) {
    let (width, length) = (columns.len(), s[0].len());
    assert!(width.is_multiple_of(LANES) && width <= STRIP && s.iter().all(|s| s.len() == length));
    let zero = S::f32s::splat(simd, 0.0);
    let floor = S::f32s::splat(simd, floor);
    let mut w = [zero; DIRECTIONS / 2 + 1];
    for (w, weight) in w.iter_mut().zip(weights) {
        *w = S::f32s::splat(simd, *weight);
    }
    for row in 0..length / STRIP {
        for x in (0..width).step_by(S::f32s::LEN) {
            let mut at = [zero; DIRECTIONS];
            for k in 0..DIRECTIONS {
                // SAFETY: x + LEN <= width, and s holds the row.
                at[k] = unsafe { load(simd, s[k], row * STRIP + x) };
            }
            let columns = columns.start + x..columns.start + x + S::f32s::LEN;
            let mut most = zero;
            for k in 0..DIRECTIONS {
                let mut sum = at[k] * w[0];
                for d in 1..DIRECTIONS / 2 {
                    let both = at[(k + d) % DIRECTIONS] + at[(k + DIRECTIONS - d) % DIRECTIONS];
                    sum = both.mul_add(w[d], sum);
                }
                sum = at[(k + DIRECTIONS / 2) % DIRECTIONS].mul_add(w[DIRECTIONS / 2], sum);
                let value = sum.simd_gt(floor).select(sum, zero);
                most = most.max(value);
                if MAPS {
                    value.store_slice(e[k].part(row, columns.clone()));
                }
            }
            most.store_slice(strongest.part(row, columns));
        }
    }
}

/// `out = x - y`, and `+ z` where there is one.
pub(crate) fn subtract(level: Level, x: &[f32], y: &[f32], z: Option<&[f32]>, out: &mut [f32]) {
    dispatch!(level, simd => subtract_in(simd, x, y, z, out));
}

#[inline(always)]
fn subtract_in<S: Simd>(_: S, x: &[f32], y: &[f32], z: Option<&[f32]>, out: &mut [f32]) {
    let width = out.len();
    let (x, y) = (&x[..width], &y[..width]);
    for i in 0..width {
        out[i] = x[i] - y[i];
    }
    if let Some(z) = z {
        let z = &z[..width];
        for i in 0..width {
            out[i] += z[i];
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

/// `out += sum of a x` over the terms (a, x), in their order. No fused multiply-add: one pixel alone gives the same bits
/// as a row.
pub(crate) fn add_scaled(level: Level, terms: &[(f32, &[f32])], out: &mut [f32]) {
    dispatch!(level, simd => add_scaled_in(simd, terms, out));
}

#[inline(always)]
#[allow(unsafe_code)]
fn add_scaled_in<S: Simd>(simd: S, terms: &[(f32, &[f32])], out: &mut [f32]) {
    let width = out.len();
    assert!(width.is_multiple_of(LANES) && terms.iter().all(|(_, x)| x.len() == width));
    for at in (0..width).step_by(S::f32s::LEN) {
        // SAFETY: at + LEN <= width, the length of every row.
        unsafe {
            let mut sum = load(simd, out, at);
            for (a, x) in terms {
                sum += load(simd, x, at) * *a;
            }
            store::<S>(sum, out, at);
        }
    }
}

/// Makes of `f` zero what is below `floor`, adds it to `m`, and returns the largest of it.
pub(crate) fn accumulate(level: Level, floor: f32, f: &mut [f32], m: &mut [f32]) -> f32 {
    dispatch!(level, simd => accumulate_in(simd, floor, f, m))
}

#[inline(always)]
fn accumulate_in<S: Simd>(simd: S, floor: f32, f: &mut [f32], m: &mut [f32]) -> f32 {
    assert!(f.len().is_multiple_of(LANES) && f.len() == m.len());
    let (zero, floor) = (S::f32s::splat(simd, 0.0), S::f32s::splat(simd, floor));
    let mut most = zero;
    for (f, m) in f.chunks_exact_mut(S::f32s::LEN).zip(m.chunks_exact_mut(S::f32s::LEN)) {
        let value = S::f32s::from_slice(simd, f);
        let value = value.simd_lt(floor).select(zero, value);
        value.store_slice(f);
        (S::f32s::from_slice(simd, m) + value).store_slice(m);
        most = most.max(value);
    }
    most.as_slice().iter().copied().fold(0.0, f32::max)
}

/// What a frame shows at each pixel of a row, from Q over directions: the largest value, and the angle of the vector sum
/// in (-pi, pi], NaN where all are zero.
pub(crate) fn summarise(level: Level, q: [&[f32]; DIRECTIONS], largest: &mut [f32], angle: &mut [f32]) {
    dispatch!(level, simd => summarise_in(simd, q, largest, angle));
}

/// atan(z) / z as a polynomial in z^2, |z| <= 1, error below 2e-8 (Abramowitz & Stegun, 4.4.49).
const ARC_TANGENT: [f32; 9] = [
    1.0,
    -0.333_331_45,
    0.199_935_51,
    -0.142_089,
    0.106_562_64,
    -0.075_289_64,
    0.042_909_614,
    -0.016_165_737,
    0.002_866_225_7,
];

#[inline(always)]
#[allow(unsafe_code)]
fn summarise_in<S: Simd>(simd: S, q: [&[f32]; DIRECTIONS], largest: &mut [f32], angle: &mut [f32]) {
    let width = largest.len();
    assert!(width.is_multiple_of(LANES) && angle.len() == width && q.iter().all(|row| row.len() == width));
    let splat = |value: f32| S::f32s::splat(simd, value);
    let zero = splat(0.0);
    for x in (0..width).step_by(S::f32s::LEN) {
        // SAFETY: x + LEN <= width, the length of every row.
        let q: [S::f32s; DIRECTIONS] = std::array::from_fn(|k| unsafe { load(simd, q[k], x) });
        let most = q.iter().fold(zero, |most, q| most.max(*q));
        let rising = q[1] - q[5];
        let falling = q[3] - q[7];
        let right = (rising - falling).mul_add(splat(FRAC_1_SQRT_2), q[0] - q[4]);
        let up = (rising + falling).mul_add(splat(FRAC_1_SQRT_2), q[2] - q[6]);
        let (a, b) = (right.abs(), up.abs());
        let steep = b.simd_gt(a);
        let z = a.min(b) / a.max(b).max(splat(f32::MIN_POSITIVE));
        let squared = z * z;
        let series = ARC_TANGENT.iter().rev().fold(zero, |sum, term| sum.mul_add(squared, splat(*term)));
        let first_octant = z * series;
        let quadrant = steep.select(splat(FRAC_PI_2) - first_octant, first_octant);
        let half = right.simd_lt(zero).select(splat(PI) - quadrant, quadrant);
        let full = up.simd_lt(zero).select(-half, half);
        // SAFETY: as above.
        unsafe {
            store::<S>(most, largest, x);
            store::<S>(most.simd_gt(zero).select(full, splat(f32::NAN)), angle, x);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direction::of_vector_sum;

    #[test]
    fn the_angle_is_that_of_the_vector_sum() {
        // Miri takes a thousand times as long for each value; every octant has its turn.
        for degrees in (0..360).step_by(if cfg!(miri) { 15 } else { 1 }) {
            let target = f64::from(degrees).to_radians();
            let q: [[f32; LANES]; DIRECTIONS] =
                std::array::from_fn(|k| [1e-5 * (target - crate::direction::angle(k)).cos().max(0.0) as f32; LANES]);
            let (mut largest, mut angle) = ([0.0; LANES], [0.0; LANES]);
            summarise(Level::new(), q.each_ref().map(|row| &row[..]), &mut largest, &mut angle);
            let expected = of_vector_sum(&q.map(|row| row[0]));
            // A few roundings of an angle up to pi; the ends of the circle are one angle.
            let turn = (angle[3] - expected).abs();
            assert!(turn < 2e-6 || (turn - 2.0 * PI).abs() < 2e-6, "{degrees} {} {expected}", angle[3]);
            assert_eq!(largest[5], q.iter().map(|row| row[5]).fold(0.0, f32::max));
        }
        let zero = [0.0; LANES];
        let (mut largest, mut angle) = ([1.0; LANES], [0.0; LANES]);
        summarise(Level::new(), [&zero; DIRECTIONS], &mut largest, &mut angle);
        assert!(largest.iter().all(|q| *q == 0.0) && angle.iter().all(|angle| angle.is_nan()));
    }
}
