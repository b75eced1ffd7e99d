//! The background's shift from one retina output to the next: a global translation by Gauss-Newton.
//!
//! Minimises, over s, the robust residual r(x) = P_t(x + s) - P_{t-1}(x) with Cauchy weights at 1.5 x the median |r|.
//! Where the specification is silent: the grid, the limit, what counts as structure and the last comparison below.

use super::map::Map;

/// Left out at every border, px; a quarter of the picture where it is too small for that.
const MARGIN: usize = 12;
/// More pixels than this are thinned out evenly.
const MOST_SAMPLES: usize = 16_384;
const ITERATIONS: usize = 4;
const SMALLEST_STEP: f64 = 1e-3;
const LEAST_SCALE: f64 = 1e-6;
/// Smaller eigenvalue of the mean of g g^T below which the picture has no structure.
const LEAST_STRUCTURE: f64 = 1e-8;

/// (x, y) by which the picture moved from `before` to `now`, px, looked for around `start`.
pub fn background_shift(before: &Map, now: &Map, start: (f64, f64)) -> (f64, f64) {
    let (height, width) = now.dim();
    let least = height.min(width);
    let margin = if least < 2 * MARGIN + 8 { least / 4 } else { MARGIN };
    let limit = margin as f64 - 1.0;
    let area = (height - 2 * margin) * (width - 2 * margin);
    let every = if area <= MOST_SAMPLES { 1 } else { (area as f64 / MOST_SAMPLES as f64).sqrt().ceil() as usize };
    let mut grid = Vec::new();
    for y in (margin..height - margin).step_by(every) {
        for x in (margin..width - margin).step_by(every) {
            grid.push((y, x));
        }
    }
    let residuals = |shift: (f64, f64)| -> Vec<f64> {
        grid.iter().map(|&(y, x)| bilinear(now, x as f64 + shift.0, y as f64 + shift.1) - before[[y, x]]).collect()
    };

    let mut shift = start;
    if shift.0.abs() > limit || shift.1.abs() > limit {
        return (0.0, 0.0);
    }
    for _ in 0..ITERATIONS {
        let r = residuals(shift);
        let c = cauchy_scale(&r);
        let (mut xx, mut xy, mut yy, mut bx, mut by, mut total) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for (&(y, x), r) in grid.iter().zip(&r) {
            let gx = (before[[y, x + 1]] - before[[y, x - 1]]) / 2.0;
            let gy = (before[[y + 1, x]] - before[[y - 1, x]]) / 2.0;
            let weight = 1.0 / (1.0 + (r / c).powi(2));
            xx += weight * gx * gx;
            xy += weight * gx * gy;
            yy += weight * gy * gy;
            bx += weight * gx * r;
            by += weight * gy * r;
            total += weight;
        }
        let smaller = (xx + yy) / 2.0 - ((xx - yy) / 2.0).hypot(xy);
        if smaller / total < LEAST_STRUCTURE {
            return (0.0, 0.0);
        }
        let det = xx * yy - xy * xy;
        let step = (-(yy * bx - xy * by) / det, -(xx * by - xy * bx) / det);
        shift = (shift.0 + step.0, shift.1 + step.1);
        if shift.0.abs() > limit || shift.1.abs() > limit {
            return (0.0, 0.0);
        }
        if step.0.hypot(step.1) < SMALLEST_STEP {
            break;
        }
    }

    // A shift that explains the picture worse than none is none.
    let still = residuals((0.0, 0.0));
    let c = cauchy_scale(&still);
    let cost = |r: &[f64]| r.iter().map(|r| (r / c).powi(2).ln_1p()).sum::<f64>();
    if cost(&residuals(shift)) <= cost(&still) { shift } else { (0.0, 0.0) }
}

fn bilinear(map: &Map, x: f64, y: f64) -> f64 {
    let (left, top) = (x.floor(), y.floor());
    let (fx, fy) = (x - left, y - top);
    let (left, top) = (left as usize, top as usize);
    (1.0 - fy) * ((1.0 - fx) * map[[top, left]] + fx * map[[top, left + 1]])
        + fy * ((1.0 - fx) * map[[top + 1, left]] + fx * map[[top + 1, left + 1]])
}

/// 1.5 times the median (the upper one of an even number) of |r|.
fn cauchy_scale(r: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = r.iter().map(|r| r.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    (1.5 * sizes[sizes.len() / 2]).max(LEAST_SCALE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Smooth waves, moved by exactly `shift`.
    fn picture(size: (usize, usize), shift: (f64, f64)) -> Map {
        Map::from_shape_fn(size, |(y, x)| {
            let (x, y) = (x as f64 - shift.0, y as f64 - shift.1);
            0.5 + 0.1 * (0.31 * x + 0.17 * y).sin() + 0.1 * (0.12 * x - 0.29 * y + 1.0).sin() + 0.05 * (0.5 * y).cos()
        })
    }

    #[test]
    fn finds_a_known_shift() {
        for size in [(48, 64), (16, 20), (150, 160)] {
            let before = picture(size, (0.0, 0.0));
            for truth in [(0.0, 0.0), (0.4, -0.7), (-1.3, 0.9)] {
                let found = background_shift(&before, &picture(size, truth), (0.0, 0.0));
                // Bilinear interpolation flattens a wave of wavelength 12 px by up to 3 %, and the step with it.
                assert!((found.0 - truth.0).hypot(found.1 - truth.1) < 0.05, "{size:?}: {found:?} against {truth:?}");
            }
        }
    }

    #[test]
    fn no_structure_no_shift() {
        let flat = Map::from_elem((40, 40), 0.5);
        assert_eq!(background_shift(&flat, &flat, (0.3, 0.3)), (0.0, 0.0));
        // Vertical stripes say nothing about vertical movement.
        let stripes = |s: f64| Map::from_shape_fn((40, 40), |(_, x)| 0.5 + 0.2 * (0.4 * (x as f64 - s)).sin());
        assert_eq!(background_shift(&stripes(0.0), &stripes(0.5), (0.0, 0.0)), (0.0, 0.0));
    }
}
