//! Lobula: D = Tm3(x) (Tm1_4(x) + Mi1(x_up)) Tm1_5(x_up), inhibition across space (W_s) and directions (W_d): E.

use apgstmd_core::{DIRECTIONS, Params};

use super::map::{Map, convolve_zero, kernel_from};

/// theta_k = k pi/4.
pub fn theta(k: usize) -> f64 {
    k as f64 * std::f64::consts::FRAC_PI_4
}

/// From a pixel to its upstream pixel, (rows, columns): (+gamma sin theta, -gamma cos theta), each rounded to the
/// nearest pixel, halves away from zero.
pub fn upstream(k: usize, spacing: f64) -> (isize, isize) {
    let (sin, cos) = theta(k).sin_cos();
    ((spacing * sin).round() as isize, (-spacing * cos).round() as isize)
}

/// D for every direction. The upstream pixel is zero outside the image.
pub fn correlation(tm3: &Map, mi1: &Map, tm1_4: &Map, tm1_5: &Map, params: &Params) -> Vec<Map> {
    let (height, width) = tm3.dim();
    (0..DIRECTIONS)
        .map(|k| {
            let (down, right) = upstream(k, params.lobula.spacing);
            Map::from_shape_fn((height, width), |(y, x)| {
                let (up_y, up_x) = (y as isize + down, x as isize + right);
                if up_y < 0 || up_y >= height as isize || up_x < 0 || up_x >= width as isize {
                    return 0.0;
                }
                let up = [up_y as usize, up_x as usize];
                tm3[[y, x]] * (tm1_4[[y, x]] + mi1[up]) * tm1_5[up]
            })
        })
        .collect()
}

/// `W_s = A [g]+ + B [g]-`, g = G(sigma_2) - e G(sigma_3) - rho.
pub fn lateral_kernel(params: &Params) -> Map {
    let lobula = &params.lobula;
    kernel_from(lobula.radius as usize, |x, y| {
        let gauss = |s: f64| (-(x * x + y * y) / (2.0 * s * s)).exp() / (2.0 * std::f64::consts::PI * s * s);
        let g = gauss(lobula.center_sigma) - lobula.surround_weight * gauss(lobula.surround_sigma) - lobula.offset;
        lobula.excitation * g.max(0.0) + lobula.inhibition * g.min(0.0)
    })
}

/// W_d at an angular distance of `steps` times 45 degrees, circular over the 8.
pub fn direction_weight(steps: usize, params: &Params) -> f64 {
    let d = steps.min(DIRECTIONS - steps) as f64;
    let density = |s: f64| (-d * d / (2.0 * s * s)).exp() / ((2.0 * std::f64::consts::PI).sqrt() * s);
    density(params.lobula.direction_center_sigma) - density(params.lobula.direction_surround_sigma)
}

/// S = max(D * W_s, 0), E(theta) = max(sum over psi of W_d(theta - psi) S(psi), 0), at or below the floor exactly 0.
pub fn inhibition(d: &[Map], lateral: &Map, params: &Params) -> Vec<Map> {
    let s: Vec<Map> = d.iter().map(|d| convolve_zero(d, lateral).mapv(|v| v.max(0.0))).collect();
    (0..DIRECTIONS)
        .map(|theta| {
            let mut e = Map::zeros(s[0].dim());
            for (psi, s) in s.iter().enumerate() {
                e.scaled_add(direction_weight(theta.abs_diff(psi), params), s);
            }
            e.mapv(|v| if v <= params.lobula.response_floor { 0.0 } else { v })
        })
        .collect()
}
