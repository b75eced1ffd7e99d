//! A procedural panorama: a sky that darkens upward, ridges before it, foliage of overlapping leaves at its foot. Sharp
//! edges, occlusion and objects of all sizes: what noise of the same spectrum has not.

use std::f64::consts::TAU;

use ndarray::Array2;

use super::scenes::Random;

/// Columns; it repeats after them.
const WIDTH: usize = 768;
const HEIGHT: usize = 320;
const LEAVES: usize = 9000;

/// Luminance of the panorama of a seed, in [0, 1].
pub fn panorama(seed: u64) -> Array2<f32> {
    let mut random = Random(seed ^ 0x5EED);
    let mut picture = Array2::from_shape_fn((HEIGHT, WIDTH), |(y, _)| (0.62 + 0.25 * y as f64 / HEIGHT as f64) as f32);
    for (ridge, luminance) in [(0.36, 0.55), (0.44, 0.42), (0.52, 0.30)] {
        let waves: Vec<(f64, f64, f64)> = (1..40)
            .map(|k| (f64::from(k), 0.05 * HEIGHT as f64 / f64::from(k).powf(0.9), random.uniform() * TAU))
            .collect();
        for x in 0..WIDTH {
            let turn = TAU * x as f64 / WIDTH as f64;
            let height: f64 = waves.iter().map(|(k, a, phase)| a * (k * turn + phase).sin()).sum();
            let top = (ridge * HEIGHT as f64 + height).clamp(0.0, HEIGHT as f64) as usize;
            for y in top..HEIGHT {
                picture[(y, x)] = (luminance + 0.04 * (random.uniform() - 0.5)) as f32;
            }
        }
    }
    for leaf in 0..LEAVES {
        // Areas fall off as those of things seen at all distances do: radius^-3.
        let radius = 1.5 / (1.0 - 0.99 * random.uniform()).sqrt();
        let depth = leaf as f64 / LEAVES as f64;
        let (x, y) = (random.uniform() * WIDTH as f64, HEIGHT as f64 * (0.5 + 0.08 * depth + 0.5 * random.uniform()));
        let luminance = (0.12 + 0.5 * random.uniform() * random.uniform().sqrt()) as f32;
        let (squash, turn) = (0.4 + 0.6 * random.uniform(), random.uniform() * TAU);
        ellipse(&mut picture, (x, y), radius, squash, turn, luminance);
    }
    picture
}

fn ellipse(picture: &mut Array2<f32>, (x, y): (f64, f64), radius: f64, squash: f64, turn: f64, luminance: f32) {
    let reach = radius.ceil() as i64;
    let (sin, cos) = turn.sin_cos();
    for row in y as i64 - reach..=y as i64 + reach {
        for column in x as i64 - reach..=x as i64 + reach {
            let (dx, dy) = (column as f64 - x, row as f64 - y);
            let (u, v) = (dx * cos + dy * sin, (dy * cos - dx * sin) / squash);
            if u * u + v * v <= radius * radius && (0..HEIGHT as i64).contains(&row) {
                picture[(row as usize, column.rem_euclid(WIDTH as i64) as usize)] = luminance;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_a_picture() {
        let picture = panorama(3);
        assert!(picture.iter().all(|value| (0.0..=1.0).contains(value)));
        assert_ne!(picture, panorama(4));
        let mean = |rows: std::ops::Range<usize>| picture.slice(ndarray::s![rows, ..]).mean().unwrap();
        assert!(mean(0..60) > 0.6 && mean(260..320) < 0.45, "bright sky, dark ground");
    }
}
