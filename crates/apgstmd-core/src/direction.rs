//! The preferred directions theta_k = k pi / 4, counter-clockwise on the screen: 0 = right, pi/2 = up.

use std::f64::consts::FRAC_PI_4;

use crate::DIRECTIONS;

/// theta_k, radians.
pub(crate) fn angle(k: usize) -> f64 {
    k as f64 * FRAC_PI_4
}

/// Unit step along an angle in image coordinates (x to the right, y downward).
pub(crate) fn step(angle: f64) -> (f64, f64) {
    (angle.cos(), -angle.sin())
}

/// The pixel that a target moving along direction k came from, `distance` px back: (dx, dy), each rounded.
pub(crate) fn upstream(k: usize, distance: f64) -> (isize, isize) {
    let (x, y) = step(angle(k));
    ((-distance * x).round() as isize, (-distance * y).round() as isize)
}

/// Angle of the vector sum of responses along the directions, radians in (-pi, pi]; NaN where all are zero.
pub(crate) fn of_vector_sum(q: &[f32; DIRECTIONS]) -> f32 {
    if q.iter().all(|q| *q == 0.0) {
        return f32::NAN;
    }
    let diagonal = std::f32::consts::FRAC_1_SQRT_2;
    let right = (q[0] - q[4]) + diagonal * ((q[1] - q[5]) + (q[7] - q[3]));
    let up = (q[2] - q[6]) + diagonal * ((q[1] - q[5]) + (q[3] - q[7]));
    up.atan2(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn upstream_is_behind() {
        let expected = [(-3, 0), (-2, 2), (0, 3), (2, 2), (3, 0), (2, -2), (0, -3), (-2, -2)];
        assert_eq!(std::array::from_fn(|k| upstream(k, 3.0)), expected);
    }

    #[test]
    fn vector_sum_of_one_direction_is_that_direction() {
        for k in 0..DIRECTIONS {
            let mut q = [0.0; DIRECTIONS];
            q[k] = 2.0;
            let expected = angle(k).sin().atan2(angle(k).cos()) as f32;
            let turn = (of_vector_sum(&q) - expected).abs();
            assert!(turn < 1e-6 || (turn - std::f32::consts::TAU).abs() < 1e-6);
        }
        assert!(of_vector_sum(&[0.0; DIRECTIONS]).is_nan());
    }
}
