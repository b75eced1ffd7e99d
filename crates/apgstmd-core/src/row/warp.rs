//! Two pictures compared under a movement: smaller copies, residuals along a row of samples, sums over them.

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::load_store::load;
use crate::plane::LANES;

/// Residual of a sample that is moved out of the picture: its Cauchy weight is zero, and so is its product with it.
pub(crate) const OUTSIDE: f32 = 1e25;

/// Unknowns of a similarity and a step of luminance.
pub(crate) const UNKNOWNS: usize = 5;
/// Sums of the normal equations: the upper triangle row by row, then the right-hand sides.
pub(crate) const SUMS: usize = UNKNOWNS * (UNKNOWNS + 1) / 2 + UNKNOWNS;

/// Luminance, row after row.
#[derive(Clone, Copy)]
pub(crate) struct Picture<'a> {
    pub data: &'a [f32],
    pub stride: usize,
    pub width: usize,
    pub height: usize,
}

/// A row of samples: where the first one is looked up, and how far on the next.
#[derive(Clone, Copy)]
pub(crate) struct Line {
    pub start: (f32, f32),
    pub step: (f32, f32),
}

/// Means of 2 x 2 pixels of two rows.
pub(crate) fn halve(level: Level, above: &[f32], below: &[f32], out: &mut [f32]) {
    dispatch!(level, simd => halve_in(simd, above, below, out));
}

#[inline(always)]
fn halve_in<S: Simd>(_: S, above: &[f32], below: &[f32], out: &mut [f32]) {
    let width = out.len();
    let (above, below) = (&above[..2 * width], &below[..2 * width]);
    for i in 0..width {
        out[i] = 0.25 * ((above[2 * i] + above[2 * i + 1]) + (below[2 * i] + below[2 * i + 1]));
    }
}

/// `residuals = picture along the line - last - offset`, bilinear. Returns how many samples lie inside the picture; the
/// others become [`OUTSIDE`].
pub(crate) fn compare(
    level: Level,
    picture: Picture<'_>,
    line: Line,
    offset: f32,
    last: &[f32],
    residuals: &mut [f32],
) -> usize {
    dispatch!(level, simd => compare_in(simd, picture, line, offset, last, residuals))
}

#[inline(always)]
fn compare_in<S: Simd>(
    _: S,
    picture: Picture<'_>,
    line: Line,
    offset: f32,
    last: &[f32],
    residuals: &mut [f32],
) -> usize {
    const BLOCK: usize = 64;
    let Picture { data, stride, width, height } = picture;
    let (right, bottom) = ((width - 1) as f32, (height - 1) as f32);
    let (last_column, last_row) = (width as i32 - 2, height as i32 - 2);
    let (mut first, mut seen) = (0, 0);
    let (mut at, mut fx, mut fy, mut inside) = ([0i32; BLOCK], [0f32; BLOCK], [0f32; BLOCK], [false; BLOCK]);
    for (residuals, last) in residuals.chunks_mut(BLOCK).zip(last.chunks(BLOCK)) {
        for i in 0..BLOCK {
            let along = (first + i) as i32 as f32;
            let (x, y) = (line.start.0 + along * line.step.0, line.start.1 + along * line.step.1);
            inside[i] = (x >= 0.0) & (x <= right) & (y >= 0.0) & (y <= bottom);
            let (column, row) = ((x as i32).clamp(0, last_column), (y as i32).clamp(0, last_row));
            fx[i] = x - column as f32;
            fy[i] = y - row as f32;
            at[i] = row * stride as i32 + column;
        }
        for (i, (residual, last)) in residuals.iter_mut().zip(last).enumerate() {
            let above = &data[at[i] as usize..][..stride + 2];
            let upper = above[0] + fx[i] * (above[1] - above[0]);
            let lower = above[stride] + fx[i] * (above[stride + 1] - above[stride]);
            let value = upper + fy[i] * (lower - upper) - last - offset;
            *residual = if inside[i] { value } else { OUTSIDE };
            seen += usize::from(inside[i]);
        }
        first += BLOCK;
    }
    seen
}

/// Sum of `|now - last - offset|`.
pub(crate) fn disagreement(level: Level, now: &[f32], last: &[f32], offset: f32) -> f32 {
    dispatch!(level, simd => disagreement_in(simd, now, last, offset))
}

#[inline(always)]
fn disagreement_in<S: Simd>(_: S, now: &[f32], last: &[f32], offset: f32) -> f32 {
    let mut sums = [0.0f32; LANES];
    let (now_blocks, last_blocks) = (now.chunks_exact(LANES), last.chunks_exact(LANES));
    let (now_rest, last_rest) = (now_blocks.remainder(), last_blocks.remainder());
    for (now, last) in now_blocks.zip(last_blocks) {
        for i in 0..LANES {
            sums[i] += (now[i] - last[i] - offset).abs();
        }
    }
    for (sum, (now, last)) in sums.iter_mut().zip(now_rest.iter().zip(last_rest)) {
        *sum += (now - last - offset).abs();
    }
    sums.iter().sum()
}

/// Adds a row of samples to the normal equations of Gauss-Newton with Cauchy weights 1 / (1 + (r / scale)^2). The
/// derivatives of a residual are -1, g_x, g_y, g_x u + g_y v and g_y u - g_x v, at (u, v) from the middle of the picture.
pub(crate) fn normal(
    level: Level,
    scale: f32,
    (u, v): (&[f32], f32),
    [residuals, gx, gy]: [&[f32]; 3],
    sums: &mut [f64; SUMS],
) {
    dispatch!(level, simd => normal_in(simd, scale, (u, v), [residuals, gx, gy], sums));
}

#[inline(always)]
#[allow(unsafe_code)]
fn normal_in<S: Simd>(
    simd: S,
    scale: f32,
    (u, v): (&[f32], f32),
    [residuals, gx, gy]: [&[f32]; 3],
    sums: &mut [f64; SUMS],
) {
    let length = residuals.len();
    assert!(length.is_multiple_of(LANES) && u.len() == length && gx.len() == length && gy.len() == length);
    let splat = |value: f32| S::f32s::splat(simd, value);
    let (one, inverse, v) = (splat(1.0), splat(1.0 / scale), splat(v));
    let mut totals = [splat(0.0); SUMS];
    for at in (0..length).step_by(S::f32s::LEN) {
        // SAFETY: at + LEN <= length, the length of every slice.
        let (r, u, gx, gy) =
            unsafe { (load(simd, residuals, at), load(simd, u, at), load(simd, gx, at), load(simd, gy, at)) };
        let share = r * inverse;
        let weight = one / share.mul_add(share, one);
        let derivatives = [-one, gx, gy, gx * u + gy * v, gy * u - gx * v];
        let mut k = 0;
        for i in 0..UNKNOWNS {
            let weighted = derivatives[i] * weight;
            for derivative in &derivatives[i..] {
                totals[k] = weighted.mul_add(*derivative, totals[k]);
                k += 1;
            }
            totals[SUMS - UNKNOWNS + i] = weighted.mul_add(r, totals[SUMS - UNKNOWNS + i]);
        }
    }
    for (sum, total) in sums.iter_mut().zip(&totals) {
        *sum += f64::from(total.as_slice().iter().sum::<f32>());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::machine::SimdLevel;

    fn rough(count: usize, seed: u32) -> Vec<f32> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state as f32 / u32::MAX as f32
        };
        (0..count).map(|_| next()).collect()
    }

    #[test]
    fn residuals_by_definition() {
        let (width, height, stride) = (37, 20, 48);
        let data = rough(stride * height, 1);
        let last = rough(90, 2);
        let picture = Picture { data: &data, stride, width, height };
        let line = Line { start: (-2.3, 11.7), step: (0.71, -0.13) };
        let at = |x: usize, y: usize| data[y * stride + x];
        for level in SimdLevel::available() {
            let mut found = vec![0.0; 90];
            let seen = compare(level.level(), picture, line, 0.05, &last, &mut found);
            let mut inside = 0;
            for (i, found) in found.iter().enumerate() {
                let (x, y) = (-2.3 + 0.71 * i as f32, 11.7 - 0.13 * i as f32);
                if x < 0.0 || y < 0.0 || x > 36.0 || y > 19.0 {
                    assert_eq!(*found, OUTSIDE);
                    continue;
                }
                inside += 1;
                let (left, top) = ((x as usize).min(35), (y as usize).min(18));
                let (fx, fy) = (x - left as f32, y - top as f32);
                let value = (1.0 - fy) * ((1.0 - fx) * at(left, top) + fx * at(left + 1, top))
                    + fy * ((1.0 - fx) * at(left, top + 1) + fx * at(left + 1, top + 1));
                // Roundings of positions up to 37 px, times steps of luminance up to 1.
                assert!((found - (value - last[i] - 0.05)).abs() < 2e-5, "{level} {i}");
            }
            assert_eq!(seen, inside);
        }
    }

    #[test]
    fn normal_equations_by_definition() {
        let n = 3 * LANES;
        let [mut r, u, gx, gy] = [3, 4, 5, 6].map(|seed| rough(n, seed));
        r[5] = OUTSIDE;
        let (scale, v) = (0.4f32, 0.3f32);
        let mut expected = [0.0f64; SUMS];
        for i in (0..n).filter(|i| *i != 5) {
            let weight = f64::from(1.0 / (1.0 + (r[i] / scale).powi(2)));
            let j = [-1.0, gx[i], gy[i], gx[i] * u[i] + gy[i] * v, gy[i] * u[i] - gx[i] * v].map(f64::from);
            let products = (0..5).flat_map(|a| (a..5).map(move |b| j[a] * j[b]));
            let all = products.chain(j.iter().map(|j| j * f64::from(r[i])));
            expected.iter_mut().zip(all).for_each(|(sum, term)| *sum += weight * term);
        }
        for level in SimdLevel::available() {
            let mut sums = [0.0; SUMS];
            normal(level.level(), scale, (&u, v), [&r, &gx, &gy], &mut sums);
            // f32 sums of 48 terms up to 1.
            assert!(sums.iter().zip(&expected).all(|(sum, expected)| (sum - expected).abs() < 2e-5), "{level}");
        }
    }

    #[test]
    fn disagreement_and_halves_by_definition() {
        let (a, b) = (rough(75, 7), rough(75, 8));
        let expected: f32 = a.iter().zip(&b).map(|(a, b)| (a - b - 0.1).abs()).sum();
        for level in SimdLevel::available() {
            let sum = disagreement(level.level(), &a, &b, 0.1);
            assert!((sum - expected).abs() < 1e-4, "{level}");
            let mut out = [0.0; 37];
            halve(level.level(), &a, &b, &mut out);
            for (i, out) in out.iter().enumerate() {
                let mean = 0.25 * (a[2 * i] + a[2 * i + 1] + b[2 * i] + b[2 * i + 1]);
                assert!((out - mean).abs() < 1e-6);
            }
        }
    }
}
