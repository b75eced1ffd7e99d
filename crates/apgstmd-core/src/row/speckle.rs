//! The steerable kernels of attention over a block of rows: moments along each row, then orientations across rows.

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::load_store::{load, store};
use crate::plane::LANES;

/// Rows of one block of memory, `stride` apart, `width` columns each.
#[derive(Clone, Copy)]
pub(crate) struct Layout {
    pub stride: usize,
    pub rows: usize,
    pub width: usize,
}

impl Layout {
    fn fits(self, data: &[f32], beyond: usize) -> bool {
        self.width.is_multiple_of(LANES)
            && self.width <= self.stride
            && (self.rows == 0 || data.len() >= (self.rows - 1) * self.stride + self.width + beyond)
    }
}

/// Three moments along the rows: even kernels g0, g2 and the odd kernel g1 (`taps[|d|] = [g0, g1, g2]`). `src` has rows
/// `src_stride` apart that start `radius` columns to the left.
pub(crate) fn moments(
    level: Level,
    (src, src_stride): (&[f32], usize),
    taps: &[[f32; 3]],
    layout: Layout,
    out: [&mut [f32]; 3],
) {
    dispatch!(level, simd => moments_in(simd, (src, src_stride), taps, layout, out));
}

#[inline(always)]
fn moments_in<S: Simd>(
    simd: S,
    (src, src_stride): (&[f32], usize),
    taps: &[[f32; 3]],
    layout: Layout,
    [out0, out1, out2]: [&mut [f32]; 3],
) {
    assert!(layout.fits(out0, 0) && layout.fits(out1, 0) && layout.fits(out2, 0));
    assert!(Layout { stride: src_stride, ..layout }.fits(src, 2 * (taps.len() - 1)));
    let pairs = layout.rows / 2 * 2;
    for x in (0..layout.width).step_by(S::f32s::LEN) {
        for y in (0..pairs).step_by(2) {
            moments_at::<S, 2>(simd, (src, src_stride), taps, [y, x], layout.stride, [out0, out1, out2]);
        }
        for y in pairs..layout.rows {
            moments_at::<S, 1>(simd, (src, src_stride), taps, [y, x], layout.stride, [out0, out1, out2]);
        }
    }
}

/// One vector of R rows: sums enough for none to wait for the one before.
#[inline(always)]
#[allow(unsafe_code)]
fn moments_at<S: Simd, const R: usize>(
    simd: S,
    (src, src_stride): (&[f32], usize),
    taps: &[[f32; 3]],
    [y, x]: [usize; 2],
    stride: usize,
    [out0, out1, out2]: [&mut [f32]; 3],
) {
    let radius = taps.len() - 1;
    let mut sums = [[S::f32s::splat(simd, 0.0); 3]; R];
    for (d, taps) in taps.iter().enumerate() {
        let taps = [S::f32s::splat(simd, taps[0]), S::f32s::splat(simd, taps[1]), S::f32s::splat(simd, taps[2])];
        for (row, [g0, g1, g2]) in sums.iter_mut().enumerate() {
            let middle = (y + row) * src_stride + x + radius;
            // SAFETY: `moments_in` asserts radius columns on both sides of every row.
            let (left, right) = unsafe { (load(simd, src, middle - d), load(simd, src, middle + d)) };
            if d == 0 {
                (*g0, *g2) = (left * taps[0], left * taps[2]);
            } else {
                let (even, odd) = (left + right, right - left);
                *g0 = even.mul_add(taps[0], *g0);
                *g1 = odd.mul_add(taps[1], *g1);
                *g2 = even.mul_add(taps[2], *g2);
            }
        }
    }
    for (row, [g0, g1, g2]) in sums.into_iter().enumerate() {
        let at = (y + row) * stride + x;
        // SAFETY: `moments_in` asserts that all outputs hold every row.
        unsafe {
            store::<S>(g0, out0, at);
            store::<S>(g1, out1, at);
            store::<S>(g2, out2, at);
        }
    }
}

/// One scale of the steerable attention kernels across the rows of three moments, which start `radius` rows above. With Vab
/// the response of g_a along x and g_b along y, the least of the four orientations is
/// `c V00 - max(V20, V02, (V20 + V02) / 2 + |V11|)`; `out` becomes the larger of it and what it held.
pub(crate) fn steer(
    level: Level,
    moments: [&[f32]; 3],
    taps: &[[f32; 3]],
    center: f32,
    layout: Layout,
    out: &mut [f32],
) {
    dispatch!(level, simd => steer_in(simd, moments, taps, center, layout, out));
}

#[inline(always)]
fn steer_in<S: Simd>(simd: S, moments: [&[f32]; 3], taps: &[[f32; 3]], center: f32, layout: Layout, out: &mut [f32]) {
    let sources = Layout { rows: layout.rows + 2 * (taps.len() - 1), ..layout };
    assert!(layout.fits(out, 0) && moments.iter().all(|moment| sources.fits(moment, 0)));
    let pairs = layout.rows / 2 * 2;
    for x in (0..layout.width).step_by(S::f32s::LEN) {
        for y in (0..pairs).step_by(2) {
            steer_at::<S, 2>(simd, moments, taps, center, [y, x], layout.stride, out);
        }
        for y in pairs..layout.rows {
            steer_at::<S, 1>(simd, moments, taps, center, [y, x], layout.stride, out);
        }
    }
}

#[inline(always)]
#[allow(unsafe_code)]
fn steer_at<S: Simd, const R: usize>(
    simd: S,
    [m0, m1, m2]: [&[f32]; 3],
    taps: &[[f32; 3]],
    center: f32,
    [y, x]: [usize; 2],
    stride: usize,
    out: &mut [f32],
) {
    let radius = taps.len() - 1;
    let mut sums = [[S::f32s::splat(simd, 0.0); 4]; R];
    for (d, taps) in taps.iter().enumerate() {
        let taps = [S::f32s::splat(simd, taps[0]), S::f32s::splat(simd, taps[1]), S::f32s::splat(simd, taps[2])];
        for (row, [v00, v02, v20, v11]) in sums.iter_mut().enumerate() {
            let (up, down) = ((y + row + radius - d) * stride + x, (y + row + radius + d) * stride + x);
            // SAFETY: `steer_in` asserts radius rows above and below every row.
            unsafe {
                if d == 0 {
                    let middle = load(simd, m0, up);
                    (*v00, *v02, *v20) = (middle * taps[0], middle * taps[2], load(simd, m2, up) * taps[0]);
                } else {
                    let even0 = load(simd, m0, up) + load(simd, m0, down);
                    let even2 = load(simd, m2, up) + load(simd, m2, down);
                    let odd1 = load(simd, m1, down) - load(simd, m1, up);
                    *v00 = even0.mul_add(taps[0], *v00);
                    *v02 = even0.mul_add(taps[2], *v02);
                    *v20 = even2.mul_add(taps[0], *v20);
                    *v11 = odd1.mul_add(taps[1], *v11);
                }
            }
        }
    }
    for (row, [v00, v02, v20, v11]) in sums.into_iter().enumerate() {
        let diagonal = (v20 + v02).mul_add(S::f32s::splat(simd, 0.5), v11.abs());
        let least = v00 * center - v20.max(v02).max(diagonal);
        let at = (y + row) * stride + x;
        // SAFETY: `steer_in` asserts that out holds every row.
        unsafe { store::<S>(least.max(load(simd, out, at)), out, at) };
    }
}
