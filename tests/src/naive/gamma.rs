//! Temporal kernels: Gamma(n, tau)(t) proportional to t^n exp(-n t / tau), first-order hold, unit sum.

use super::map::Map;

/// Taps h_i = integral of Gamma(s) max(0, 1 - |s - i|) ds over s >= 0, for i = 0, 1, 2, ... until what is left of the
/// kernel is below 1e-15 of it, divided by their sum.
pub fn taps(order: u32, tau: f64) -> Vec<f64> {
    let n = f64::from(order);
    // Peaks with 1 at s = tau.
    let gamma = |s: f64| if s == 0.0 { 0.0 } else { (n * (s / tau).ln() + n - n * s / tau).exp() };
    // Panels no wider than the kernel's peak, 10 nodes each: exact to rounding.
    let panels = (2.0 / (tau / n.sqrt()).min(1.0)).ceil() as usize;
    // The interval from i to i + 1 gives `falling` to tap i and `rising` to tap i + 1.
    let mut taps = vec![0.0];
    let mut total = 0.0;
    for i in 0.. {
        let (mut falling, mut rising) = (0.0, 0.0);
        for panel in 0..panels {
            for (node, weight) in GAUSS_LEGENDRE_10 {
                for node in [-node, node] {
                    let part = (panel as f64 + 0.5 + 0.5 * node) / panels as f64;
                    let mass = 0.5 * weight / panels as f64 * gamma(i as f64 + part);
                    falling += (1.0 - part) * mass;
                    rising += part * mass;
                }
            }
        }
        taps[i] += falling;
        taps.push(rising);
        total += falling + rising;
        // Beyond twice the peak the kernel falls at least as fast as exp(-n s / 2 tau): what follows this interval is
        // at most 2 tau / n times it.
        let left = (falling + rising) * (2.0 * tau / n).max(1.0);
        if i as f64 > 2.0 * tau && left < 1e-15 * total {
            break;
        }
    }
    taps.iter().map(|tap| tap / total).collect()
}

/// Literal sum over the history, latest frame last: sum of h_i history(t - i), zero before the first frame.
pub fn filter(history: &[Map], taps: &[f64]) -> Map {
    let mut out = Map::zeros(history[0].dim());
    for (frame, tap) in history.iter().rev().zip(taps) {
        out.scaled_add(*tap, frame);
    }
    out
}

/// As [`filter`], but the first frame has stood for ever: every tap older than it reads it.
pub fn filter_primed(history: &[Map], taps: &[f64]) -> Map {
    let mut out = Map::zeros(history[0].dim());
    let oldest = history.len() - 1;
    let mut older = 0.0;
    for (i, tap) in taps.iter().enumerate() {
        if i < oldest {
            out.scaled_add(*tap, &history[oldest - i]);
        } else {
            older += tap;
        }
    }
    out.scaled_add(older, &history[0]);
    out
}

/// Positive nodes and their weights on [-1, 1].
const GAUSS_LEGENDRE_10: [(f64, f64); 5] = [
    (0.148_874_338_981_631_2, 0.295_524_224_714_752_9),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_4),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// For order 1 and rate a = 1 / tau the integrals are elementary.
    #[test]
    fn order_one_in_closed_form() {
        for tau in [0.05, 0.7, 3.0, 40.0] {
            let a = 1.0 / tau;
            // Second antiderivative of s exp(-a s), whose second difference is the hat integral.
            let twice = |s: f64| (s + 2.0 / a) / (a * a) * (-a * s).exp();
            let mass = 1.0 / (a * a);
            let slope_at_zero = -1.0 / (a * a);
            let h = taps(1, tau);
            let truth = |i: usize| {
                if i == 0 {
                    (twice(1.0) - twice(0.0) - slope_at_zero) / mass
                } else {
                    (twice(i as f64 + 1.0) - 2.0 * twice(i as f64) + twice(i as f64 - 1.0)) / mass
                }
            };
            for i in [0, 1, 2, 5] {
                if i < h.len() {
                    // The second differences of the closed form cancel more than the quadrature errs.
                    assert!((h[i] - truth(i)).abs() < 1e-12, "tau {tau}, tap {i}: {} against {}", h[i], truth(i));
                }
            }
        }
    }

    #[test]
    fn unit_sum_and_mean_delay() {
        for (order, tau) in [(1, 0.01), (2, 3.0), (6, 9.0), (8, 40.0), (24, 0.2), (24, 200.0), (2, 300.0)] {
            let h = taps(order, tau);
            assert!((h.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            // A hat keeps the mean, so the mean delay is that of the continuous kernel, (n + 1) tau / n.
            let mean: f64 = h.iter().enumerate().map(|(i, tap)| i as f64 * tap).sum();
            let truth = f64::from(order + 1) * tau / f64::from(order);
            assert!((mean - truth).abs() < 1e-9 * truth, "order {order}, tau {tau}: {mean} against {truth}");
        }
    }
}
