//! Images as float64 arrays, and convolution as the two loops it is.

use ndarray::Array2;

/// One value a pixel: (rows, columns).
pub type Map = Array2<f64>;

/// (map * kernel)(x) = sum over d of kernel(d) map(x - d). Pixels outside repeat the border.
/// The kernel has odd sides; its middle is d = 0.
pub fn convolve_replicate(map: &Map, kernel: &Map) -> Map {
    let (height, width) = map.dim();
    let (ry, rx) = (kernel.nrows() / 2, kernel.ncols() / 2);
    let padded = Map::from_shape_fn((height + 2 * ry, width + 2 * rx), |(y, x)| {
        map[[y.saturating_sub(ry).min(height - 1), x.saturating_sub(rx).min(width - 1)]]
    });
    let mut out = Map::zeros((height, width));
    for ((ky, kx), &weight) in kernel.indexed_iter() {
        // x - d = x - (k - r), and the padding moves it by another r.
        let (top, left) = (2 * ry - ky, 2 * rx - kx);
        for (y, mut row) in out.rows_mut().into_iter().enumerate() {
            let source = padded.row(top + y);
            add(
                weight,
                &source.as_slice().expect("rows are contiguous")[left..],
                row.as_slice_mut().expect("likewise"),
            );
        }
    }
    out
}

/// The same sum with zero outside: every pixel spreads its value forward, kernel(d) of it to x + d.
pub fn convolve_zero(map: &Map, kernel: &Map) -> Map {
    let (height, width) = map.dim();
    let (ry, rx) = (kernel.nrows() / 2, kernel.ncols() / 2);
    let side = 2 * rx + 1;
    let mut out = Map::zeros((height, width));
    let (pixels, taps) = (out.as_slice_mut().expect("fresh"), kernel.as_slice().expect("kernels are contiguous"));
    for ((y, x), &value) in map.indexed_iter() {
        if value == 0.0 {
            continue;
        }
        let (left, right) = (rx.saturating_sub(x), (width + rx - x).min(side));
        for ky in ry.saturating_sub(y)..(height + ry - y).min(2 * ry + 1) {
            let target = (y + ky - ry) * width + x + left - rx;
            add(value, &taps[ky * side + left..ky * side + right], &mut pixels[target..]);
        }
    }
    out
}

/// to += weight from, as far as both go.
fn add(weight: f64, from: &[f64], to: &mut [f64]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += weight * from;
    }
}

/// The replicate convolution at one pixel.
pub fn convolve_replicate_at(map: &Map, kernel: &Map, y: usize, x: usize) -> f64 {
    let (height, width) = map.dim();
    let (ry, rx) = (kernel.nrows() / 2, kernel.ncols() / 2);
    let mut sum = 0.0;
    for ky in 0..kernel.nrows() {
        let row = (y + ry).saturating_sub(ky).min(height - 1);
        for kx in 0..kernel.ncols() {
            let column = (x + rx).saturating_sub(kx).min(width - 1);
            sum += kernel[[ky, kx]] * map[[row, column]];
        }
    }
    sum
}

/// A kernel of half width `radius` from a function of (x to the right, y **upward**).
pub fn kernel_from(radius: usize, value: impl Fn(f64, f64) -> f64) -> Map {
    let side = 2 * radius + 1;
    let r = radius as f64;
    Map::from_shape_fn((side, side), |(ky, kx)| value(kx as f64 - r, r - ky as f64))
}

/// Pixel by pixel maximum over directions.
pub fn maximum(maps: &[Map]) -> Map {
    let mut out = maps[0].clone();
    for map in &maps[1..] {
        out.zip_mut_with(map, |a, b| *a = a.max(*b));
    }
    out
}

/// Largest absolute value.
pub fn peak(maps: &[Map]) -> f64 {
    maps.iter().flatten().fold(0.0, |most, value| value.abs().max(most))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_becomes_the_kernel_in_every_form() {
        let kernel = kernel_from(2, |x, y| 10.0 * x + y + 0.5);
        let mut point = Map::zeros((9, 8));
        point[[4, 3]] = 2.0;
        let zero = convolve_zero(&point, &kernel);
        let replicate = convolve_replicate(&point, &kernel);
        for ((y, x), &value) in zero.indexed_iter() {
            let inside = y.abs_diff(4) <= 2 && x.abs_diff(3) <= 2;
            let truth = if inside { 2.0 * (10.0 * (x as f64 - 3.0) + (4.0 - y as f64) + 0.5) } else { 0.0 };
            assert_eq!((value, replicate[[y, x]]), (truth, truth), "at {y}, {x}");
            assert_eq!(convolve_replicate_at(&point, &kernel, y, x), truth);
        }
    }

    #[test]
    fn borders() {
        let kernel = kernel_from(3, |x, y| 1.0 + 0.1 * x - 0.2 * y);
        let flat = Map::ones((4, 5));
        let total = kernel.sum();
        assert!(convolve_replicate(&flat, &kernel).iter().all(|v| (v - total).abs() < 1e-12));
        // Of the corner's neighbourhood only x + d inside the image counts: d from 0 to 3 in y, 0 to 3 in x, flipped.
        let corner: f64 = (0..=3).flat_map(|y| (0..=3).map(move |x| (x, y))).map(|(x, y)| kernel[[3 - y, 3 - x]]).sum();
        assert!((convolve_zero(&flat, &kernel)[[0, 0]] - corner).abs() < 1e-12);
    }
}
