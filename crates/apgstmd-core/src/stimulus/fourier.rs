//! Radix-2 Fourier transform. Own, scalar and small, because a scene must not change with the machine's vector unit
//! or C library; it runs twice per scene, so its speed does not matter.

/// A complex number, (real, imaginary).
pub(super) type Complex = (f64, f64);

#[derive(Clone, Copy)]
pub(super) enum Sign {
    /// e^(-i w t).
    Forward,
    /// e^(+i w t), not divided by the length.
    Backward,
}

/// Transforms rows, then columns, of a row-major plane whose sides are powers of two.
pub(super) fn transform_2d(data: &mut [Complex], height: usize, width: usize, sign: Sign) {
    assert_eq!(data.len(), height * width);
    let twiddles = twiddles(width, sign);
    data.chunks_exact_mut(width).for_each(|row| transform(row, &twiddles));
    let twiddles = self::twiddles(height, sign);
    let mut column = vec![(0.0, 0.0); height];
    for x in 0..width {
        column.iter_mut().zip(data[x..].iter().step_by(width)).for_each(|(c, d)| *c = *d);
        transform(&mut column, &twiddles);
        column.iter().zip(data[x..].iter_mut().step_by(width)).for_each(|(c, d)| *d = *c);
    }
}

fn twiddles(length: usize, sign: Sign) -> Vec<Complex> {
    let turn = match sign {
        Sign::Forward => -std::f64::consts::TAU,
        Sign::Backward => std::f64::consts::TAU,
    };
    (0..length / 2).map(|k| turn * k as f64 / length as f64).map(|angle| (libm::cos(angle), libm::sin(angle))).collect()
}

fn transform(data: &mut [Complex], twiddles: &[Complex]) {
    let length = data.len();
    assert!(length.is_power_of_two());
    if length == 1 {
        return;
    }
    let shift = usize::BITS - length.trailing_zeros();
    for i in 0..length {
        let j = i.reverse_bits() >> shift;
        if i < j {
            data.swap(i, j);
        }
    }
    let mut half = 1;
    while half < length {
        let stride = length / (2 * half);
        for block in data.chunks_exact_mut(2 * half) {
            let (low, high) = block.split_at_mut(half);
            for (k, (a, b)) in low.iter_mut().zip(high).enumerate() {
                let w = twiddles[k * stride];
                let turned = (b.0 * w.0 - b.1 * w.1, b.0 * w.1 + b.1 * w.0);
                *b = (a.0 - turned.0, a.1 - turned.1);
                *a = (a.0 + turned.0, a.1 + turned.1);
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    #[test]
    fn equals_the_defining_sum() {
        for (height, width) in [(1, 1), (1, 2), (4, 1), (8, 4), (2, 16)] {
            let mut random = Random::new(5, 0);
            let data: Vec<Complex> = (0..height * width).map(|_| (random.normal(), random.normal())).collect();
            let mut fast = data.clone();
            transform_2d(&mut fast, height, width, Sign::Forward);
            for v in 0..height {
                for u in 0..width {
                    let mut sum = (0.0, 0.0);
                    for (i, d) in data.iter().enumerate() {
                        let (y, x) = (i / width, i % width);
                        let cycles = (u * x) as f64 / width as f64 + (v * y) as f64 / height as f64;
                        let (sin, cos) = (-std::f64::consts::TAU * cycles).sin_cos();
                        sum = (sum.0 + d.0 * cos - d.1 * sin, sum.1 + d.0 * sin + d.1 * cos);
                    }
                    let got = fast[v * width + u];
                    // 32 terms of size 1 in f64.
                    assert!((got.0 - sum.0).abs() < 1e-12 && (got.1 - sum.1).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn back_and_forth() {
        let mut random = Random::new(6, 0);
        let data: Vec<Complex> = (0..32 * 64).map(|_| (random.normal(), 0.0)).collect();
        let mut there = data.clone();
        transform_2d(&mut there, 32, 64, Sign::Forward);
        transform_2d(&mut there, 32, 64, Sign::Backward);
        assert!(data.iter().zip(&there).all(|(a, b)| (a.0 - b.0 / 2048.0).abs() < 1e-13 && b.1.abs() < 1e-9));
    }
}
