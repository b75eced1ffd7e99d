//! Lateral inhibition in two steps: a row spreads along itself, what spread gathers across rows.
//!
//! The kernel is two separable Gaussians and a core, a small square that is symmetric in both directions: each source
//! row becomes 2 + J rows, J = 1 + half width of the core, and an output row is a weighted sum of those around it.

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::load_store::{load, store};
use crate::memory::heap;
use crate::plane::LANES;

/// Taps of two separable kernels and a core, by distance.
#[derive(Clone, Debug)]
pub(crate) struct Lateral {
    /// Of both Gaussians along a row.
    pub along: Vec<[f32; 2]>,
    /// Of both across rows.
    pub across: Vec<[f32; 2]>,
    /// Of the core: row by row, from its middle row on, and in a row from its middle column on.
    pub core: Vec<Vec<f32>>,
}

heap!(Lateral { along, across, core });

impl Lateral {
    pub fn radius(&self) -> usize {
        self.along.len() - 1
    }

    /// Rows that a source row becomes.
    pub fn rows(&self) -> usize {
        2 + self.core.len()
    }
}

/// Core rows that are spread together with the Gaussians.
const TOGETHER: usize = 3;

/// Spreads a row: `out` is 2 + J rows of one length, both Gaussians and then the core's. `src` starts `radius` columns to
/// their left.
pub(crate) fn spread(level: Level, src: &[f32], kernel: &Lateral, out: &mut [f32]) {
    let together = kernel.core.len().min(TOGETHER);
    let width = out.len() / kernel.rows();
    let (first, rest) = out.split_at_mut((2 + together) * width);
    match together {
        0 => dispatch!(level, simd => spread_in::<_, 0>(simd, src, kernel, first)),
        1 => dispatch!(level, simd => spread_in::<_, 1>(simd, src, kernel, first)),
        2 => dispatch!(level, simd => spread_in::<_, 2>(simd, src, kernel, first)),
        _ => dispatch!(level, simd => spread_in::<_, TOGETHER>(simd, src, kernel, first)),
    }
    for (core, out) in kernel.core[together..].iter().zip(rest.chunks_exact_mut(width)) {
        let inset = kernel.radius() + 1 - core.len();
        dispatch!(level, simd => spread_core(simd, &src[inset..], core, out));
    }
}

#[inline(always)]
fn spread_in<S: Simd, const J: usize>(simd: S, src: &[f32], kernel: &Lateral, out: &mut [f32]) {
    let (radius, width) = (kernel.radius(), out.len() / (2 + J));
    let reach = if J == 0 { 0 } else { kernel.core[0].len() - 1 };
    assert!(width.is_multiple_of(LANES) && src.len() >= width + 2 * radius && reach <= radius);
    assert!(kernel.core[..J].iter().all(|core| core.len() == reach + 1));
    let mut core: [&[f32]; J] = [&[]; J];
    for (core, taps) in core.iter_mut().zip(&kernel.core) {
        *core = taps;
    }
    let step = 2 * S::f32s::LEN;
    let pairs = width - width % step;
    for x in (0..pairs).step_by(step) {
        spread_at::<S, J, 2>(simd, src, &kernel.along, core, out, [x, width]);
    }
    for x in (pairs..width).step_by(S::f32s::LEN) {
        spread_at::<S, J, 1>(simd, src, &kernel.along, core, out, [x, width]);
    }
}

/// V vectors from column x on: each tap is fetched once for all of them.
#[inline(always)]
#[allow(unsafe_code)]
fn spread_at<S: Simd, const J: usize, const V: usize>(
    simd: S,
    src: &[f32],
    along: &[[f32; 2]],
    core: [&[f32]; J],
    out: &mut [f32],
    [x, width]: [usize; 2],
) {
    let radius = along.len() - 1;
    let reach = if J == 0 { 0 } else { core[0].len() - 1 };
    let zero = S::f32s::splat(simd, 0.0);
    // Loops rather than `map` and `from_fn`, which are not compiled for the instruction set unless they are inlined.
    let (mut smooth, mut inner, mut pair) = ([[zero; V]; 2], [[zero; V]; J], [zero; V]);
    for d in 0..=radius {
        for (v, pair) in pair.iter_mut().enumerate() {
            let at = x + radius + v * S::f32s::LEN;
            // SAFETY: `spread_in` asserts that src has radius columns on both sides of width, and x + V LEN <= width.
            *pair = unsafe { load(simd, src, at - d) };
            if d > 0 {
                // SAFETY: as above.
                *pair += unsafe { load(simd, src, at + d) };
            }
        }
        for k in 0..2 {
            let tap = S::f32s::splat(simd, along[d][k]);
            for v in 0..V {
                smooth[k][v] = pair[v].mul_add(tap, smooth[k][v]);
            }
        }
        if d <= reach {
            for j in 0..J {
                let tap = S::f32s::splat(simd, core[j][d]);
                for v in 0..V {
                    inner[j][v] = pair[v].mul_add(tap, inner[j][v]);
                }
            }
        }
    }
    for row in 0..2 + J {
        for v in 0..V {
            let sum = if row < 2 { smooth[row][v] } else { inner[row - 2][v] };
            // SAFETY: out is 2 + J rows of width, and x + V LEN <= width.
            unsafe { store::<S>(sum, out, row * width + x + v * S::f32s::LEN) };
        }
    }
}

#[inline(always)]
#[allow(unsafe_code)]
fn spread_core<S: Simd>(simd: S, src: &[f32], taps: &[f32], out: &mut [f32]) {
    let (width, reach) = (out.len(), taps.len() - 1);
    assert!(width.is_multiple_of(LANES) && src.len() >= width + 2 * reach);
    for x in (0..width).step_by(S::f32s::LEN) {
        // SAFETY: x + LEN <= width, and src has reach columns on both sides.
        unsafe {
            let mut sum = load(simd, src, x + reach) * taps[0];
            for (d, tap) in taps.iter().enumerate().skip(1) {
                let pair = load(simd, src, x + reach - d) + load(simd, src, x + reach + d);
                sum = pair.mul_add(S::f32s::splat(simd, *tap), sum);
            }
            store::<S>(sum, out, x);
        }
    }
}

/// Spread rows in a ring: row y lies in slot y mod `slots`, a power of two.
#[derive(Clone, Copy)]
pub(crate) struct SpreadRows<'a> {
    pub data: &'a [f32],
    pub slots: usize,
    pub width: usize,
    /// The row to gather for.
    pub middle: usize,
}

impl SpreadRows<'_> {
    fn at(&self, kernel: &Lateral, row: usize) -> usize {
        (row & (self.slots - 1)) * kernel.rows() * self.width
    }

    /// Start of the rows `d` above and below.
    #[inline(always)]
    fn around(&self, kernel: &Lateral, d: usize) -> [usize; 2] {
        [self.at(kernel, self.middle.wrapping_sub(d)), self.at(kernel, self.middle + d)]
    }

    fn check(&self, kernel: &Lateral) {
        assert!(
            self.slots.is_power_of_two()
                && self.slots > 2 * kernel.radius()
                && kernel.core.len() <= kernel.radius() + 1
        );
        assert!(self.width.is_multiple_of(LANES) && self.data.len() >= self.slots * kernel.rows() * self.width);
    }
}

/// Gathers spread rows: `out = max(both Gaussians + core, 0)`.
pub(crate) fn gather(level: Level, rows: SpreadRows<'_>, kernel: &Lateral, out: &mut [f32]) {
    dispatch!(level, simd => gather_in(simd, rows, kernel, out));
}

#[inline(always)]
fn gather_in<S: Simd>(simd: S, rows: SpreadRows<'_>, kernel: &Lateral, out: &mut [f32]) {
    rows.check(kernel);
    assert!(out.len() == rows.width);
    let step = 4 * S::f32s::LEN;
    let fours = rows.width - rows.width % step;
    for x in (0..fours).step_by(step) {
        let sums = gather_at::<S, 4>(simd, rows, kernel, x);
        put_positive::<S, 4>(simd, sums, &mut out[x..x + step]);
    }
    for x in (fours..rows.width).step_by(S::f32s::LEN) {
        let sums = gather_at::<S, 1>(simd, rows, kernel, x);
        put_positive::<S, 1>(simd, sums, &mut out[x..x + S::f32s::LEN]);
    }
}

#[inline(always)]
fn put_positive<S: Simd, const V: usize>(simd: S, sums: [[S::f32s; 2]; V], out: &mut [f32]) {
    let zero = S::f32s::splat(simd, 0.0);
    for v in 0..V {
        let [smooth, inner] = sums[v];
        (smooth + inner).max(zero).store_slice(&mut out[v * S::f32s::LEN..(v + 1) * S::f32s::LEN]);
    }
}

/// Gathers both parts of a kernel g of which the core is [g]+: `out[0]` is the core's, `out[1]` what the Gaussians have
/// beside it, [g]-.
pub(crate) fn gather_parts(level: Level, rows: SpreadRows<'_>, kernel: &Lateral, out: [&mut [f32]; 2]) {
    dispatch!(level, simd => gather_parts_in(simd, rows, kernel, out));
}

#[inline(always)]
fn gather_parts_in<S: Simd>(simd: S, rows: SpreadRows<'_>, kernel: &Lateral, [center, surround]: [&mut [f32]; 2]) {
    rows.check(kernel);
    assert!(center.len() == rows.width && surround.len() == rows.width);
    for x in (0..rows.width).step_by(S::f32s::LEN) {
        let [[smooth, inner]] = gather_at::<S, 1>(simd, rows, kernel, x);
        inner.store_slice(&mut center[x..x + S::f32s::LEN]);
        (smooth - inner).store_slice(&mut surround[x..x + S::f32s::LEN]);
    }
}

/// Gaussians and core of V vectors from column x on. `rows` has been checked, and x + V LEN <= width.
#[inline(always)]
#[allow(unsafe_code)]
fn gather_at<S: Simd, const V: usize>(simd: S, rows: SpreadRows<'_>, kernel: &Lateral, x: usize) -> [[S::f32s; 2]; V] {
    let (data, width) = (rows.data, rows.width);
    let zero = S::f32s::splat(simd, 0.0);
    let mut sums = [[zero; 2]; V];
    // SAFETY: every row of every slot lies inside data: `check`.
    unsafe {
        let [middle, _] = rows.around(kernel, 0);
        for (k, tap) in kernel.across[0].iter().enumerate() {
            let tap = S::f32s::splat(simd, *tap);
            for (v, [smooth, _]) in sums.iter_mut().enumerate() {
                *smooth = load(simd, data, middle + k * width + x + v * S::f32s::LEN).mul_add(tap, *smooth);
            }
        }
        for (d, taps) in kernel.across.iter().enumerate().skip(1) {
            let [above, below] = rows.around(kernel, d);
            for (k, tap) in taps.iter().enumerate() {
                let tap = S::f32s::splat(simd, *tap);
                for (v, [smooth, _]) in sums.iter_mut().enumerate() {
                    let at = k * width + x + v * S::f32s::LEN;
                    *smooth = (load(simd, data, above + at) + load(simd, data, below + at)).mul_add(tap, *smooth);
                }
            }
        }
        for j in 0..kernel.core.len() {
            let [above, below] = rows.around(kernel, j);
            for (v, [_, inner]) in sums.iter_mut().enumerate() {
                let at = (2 + j) * width + x + v * S::f32s::LEN;
                let value = load(simd, data, above + at);
                *inner += if j == 0 { value } else { value + load(simd, data, below + at) };
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::machine::SimdLevel;

    /// Every instruction set against nested loops, for cores of any size and widths that are not a multiple of the blocks.
    #[test]
    fn spread_and_gathered_by_definition() {
        let mut seed = 5u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            seed as f32 / u32::MAX as f32
        };
        for (radius, reach, width) in [(1, 0, 16), (2, 2, 48), (7, 2, 80), (7, 7, 64), (9, 4, 112)] {
            let mut taps = |count: usize| (0..count).map(|_| [random(), random() - 1.0]).collect::<Vec<_>>();
            let (along, across) = (taps(radius + 1), taps(radius + 1));
            let core = (0..=reach).map(|_| (0..=reach).map(|_| random()).collect()).collect();
            let kernel = Lateral { along, across, core };
            let (rows, stride) = (2 * radius + 1, width + 2 * radius);
            let src: Vec<f32> = (0..rows * stride).map(|_| random()).collect();
            let tap = |dy: usize, dx: usize| {
                let smooth: f64 =
                    (0..2).map(|k| f64::from(kernel.along[dx][k]) * f64::from(kernel.across[dy][k])).sum();
                let core = kernel.core.get(dy).and_then(|row| row.get(dx)).map_or(0.0, |tap| f64::from(*tap));
                [smooth, core]
            };
            for simd in SimdLevel::available() {
                let slots = rows.next_power_of_two();
                let size = kernel.rows() * width;
                let mut data = vec![0.0; slots * size];
                for (src, out) in src.chunks_exact(stride).zip(data.chunks_exact_mut(size)) {
                    spread(simd.level(), src, &kernel, out);
                }
                let spread = SpreadRows { data: &data, slots, width, middle: radius };
                let (mut out, mut center, mut surround) = (vec![0.0; width], vec![0.0; width], vec![0.0; width]);
                gather(simd.level(), spread, &kernel, &mut out);
                gather_parts(simd.level(), spread, &kernel, [&mut center, &mut surround]);
                for x in 0..width {
                    let mut truth = [0.0; 2];
                    for y in 0..rows {
                        for column in 0..rows {
                            let taps = tap(y.abs_diff(radius), column.abs_diff(radius));
                            let value = f64::from(src[y * stride + x + column]);
                            truth = [truth[0] + taps[0] * value, truth[1] + taps[1] * value];
                        }
                    }
                    let [smooth, inner] = truth;
                    let given = [out[x], center[x], surround[x]].map(f64::from);
                    for (given, truth) in given.into_iter().zip([(smooth + inner).max(0.0), inner, smooth - inner]) {
                        // Some hundred terms of size up to one.
                        assert!((given - truth).abs() < 1e-3, "{simd}, radius {radius}, column {x}: {given} {truth}");
                    }
                }
            }
        }
    }
}
