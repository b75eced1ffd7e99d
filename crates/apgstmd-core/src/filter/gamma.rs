//! Gamma kernels over discrete time, in f64, as taps and as coefficients of a recursive cascade.
//!
//! Gamma(n, tau)(s) is proportional to s^n exp(-n s / tau), unit integral. Luminance runs linearly from frame to frame
//! (first-order hold), so tap i is the integral of Gamma(s) max(0, 1 - |s - i|) ds.
//!
//! With r = n / tau and a = exp(-r), the taps i >= 1 are a polynomial of degree n in i times a^i. Over states
//! c_0(t) = a c_0(t-1) + x(t), c_j(t) = a (c_j(t-1) + c_{j-1}(t-1)), whose impulse response is C(t, j) a^t,
//! y(t) = tap_0 x(t) + sum_j b_j c_j(t-1), with b_j the j-th forward difference at i = 0 of tap_{i+1} / a^i. Since
//! (i + w)^n = sum_k C(n, k) w^{n-k} sum_j S(k, j) j! C(i, j), with S the Stirling numbers of the second kind,
//! every b_j is a sum of positive terms: nothing cancels, at any order.

use std::sync::LazyLock;

use crate::row::recurse::CascadeTaps;

/// A gamma kernel of order n and time constant tau (frames).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gamma {
    pub order: u32,
    pub tau: f64,
}

/// What the taps of a kernel stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Response {
    /// The kernel itself.
    Impulse,
    /// What is left of the kernel: tap i is the sum of the taps after i. Applied to the differences between frames it
    /// gives sum(taps) x(t) minus the filtered x.
    Tail,
}

const NODES: usize = 16;

/// Gauss-Legendre nodes and weights on [-1, 1]. Each tap of a filter needs them, and they take longer than the tap.
static LEGENDRE: LazyLock<[(f64, f64); NODES]> = LazyLock::new(legendre);

fn legendre() -> [(f64, f64); NODES] {
    std::array::from_fn(|i| {
        let n = NODES as f64;
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
        let mut slope = 0.0;
        for _ in 0..100 {
            let (mut p0, mut p1) = (1.0, x);
            for k in 2..=NODES {
                let k = k as f64;
                (p0, p1) = (p1, ((2.0 * k - 1.0) * x * p1 - (k - 1.0) * p0) / k);
            }
            slope = n * (x * p1 - p0) / (x * x - 1.0);
            let step = p1 / slope;
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    })
}

fn integrate(from: f64, to: f64, panels: usize, f: impl Fn(f64) -> f64) -> f64 {
    let nodes = &*LEGENDRE;
    let half = (to - from) / (2.0 * panels as f64);
    (0..panels)
        .map(|panel| {
            let middle = from + half * (2 * panel + 1) as f64;
            nodes.iter().map(|(x, weight)| weight * f(middle + half * x)).sum::<f64>() * half
        })
        .sum()
}

impl Gamma {
    fn rate(self) -> f64 {
        f64::from(self.order) / self.tau
    }

    /// The kernel at s frames, unit integral.
    fn at(self, s: f64) -> f64 {
        if s <= 0.0 {
            return 0.0;
        }
        let n = f64::from(self.order);
        let log_factorial: f64 = (1..=self.order).map(|k| f64::from(k).ln()).sum();
        ((n + 1.0) * self.rate().ln() - log_factorial + n * s.ln() - self.rate() * s).exp()
    }

    /// Where the kernel has died away, frames: 12 standard deviations and 60 e-foldings behind its peak.
    fn end(self) -> f64 {
        self.tau + (60.0 + 12.0 * f64::from(self.order).sqrt()) / self.rate()
    }

    fn panels(self, length: f64) -> usize {
        ((length * self.rate()).ceil() as usize).clamp(1, 2000)
    }

    /// Integral of f against the kernel over [from, to].
    fn against(self, from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
        let to = to.min(self.end());
        if to <= from { 0.0 } else { integrate(from, to, self.panels(to - from), |s| self.at(s) * f(s)) }
    }

    /// Tap i of the response.
    pub fn tap(self, i: usize, response: Response) -> f64 {
        let i = i as f64;
        match response {
            Response::Impulse => {
                let rising = if i > 0.0 { self.against(i - 1.0, i, |s| s - (i - 1.0)) } else { 0.0 };
                rising + self.against(i, i + 1.0, |s| i + 1.0 - s)
            }
            Response::Tail => self.against(i, i + 1.0, |s| s - i) + self.against(i + 1.0, f64::INFINITY, |_| 1.0),
        }
    }

    /// All taps until what follows sums to less than 1e-10.
    pub fn taps(self, response: Response) -> Vec<f64> {
        let mut taps = Vec::new();
        let mut left = 1.0;
        while left > 1e-10 {
            let tap = self.tap(taps.len(), Response::Impulse);
            left -= tap;
            taps.push(match response {
                Response::Impulse => tap,
                Response::Tail => left,
            });
        }
        taps
    }

    /// b_j for j = 0..=n.
    fn weights(self, response: Response) -> Vec<f64> {
        let n = self.order as usize;
        let rate = self.rate();
        // Integral of w^p exp(-r w) against what tap_{i+1} reads of the kernel from s = i on.
        let moment = |p: usize| -> f64 {
            let term = |w: f64| w.powi(p as i32) * (-rate * w).exp();
            let panels = |length: f64| self.panels(length);
            let middle = |to: f64, f: &dyn Fn(f64) -> f64, from: f64| {
                let to = to.min(from + self.end());
                integrate(from, to, panels(to - from), |w| term(w) * f(w))
            };
            match response {
                Response::Impulse => middle(1.0, &|w| w, 0.0) + middle(2.0, &|w| 2.0 - w, 1.0),
                Response::Tail => middle(2.0, &|w| w - 1.0, 1.0) + middle(2.0 + self.end(), &|_| 1.0, 2.0),
            }
        };
        let moments: Vec<f64> = (0..=n).map(moment).collect();
        // rate^(n+1) / n!
        let scale = (1..=n).fold(rate, |scale, k| scale * rate / k as f64);
        let stirling = stirling(n);
        let binomial = |k: usize| (0..k).fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64);
        (0..=n)
            .map(|j| {
                let factorial: f64 = (1..=j).map(|k| k as f64).product();
                scale * factorial * (j..=n).map(|k| binomial(k) * stirling[k][j] * moments[n - k]).sum::<f64>()
            })
            .collect()
    }
}

/// Stirling numbers of the second kind up to n.
fn stirling(n: usize) -> Vec<Vec<f64>> {
    let mut table = vec![vec![0.0; n + 1]; n + 1];
    table[0][0] = 1.0;
    for k in 1..=n {
        for j in 1..=k {
            table[k][j] = j as f64 * table[k - 1][j] + table[k - 1][j - 1];
        }
    }
    table
}

/// A weighted sum of gamma kernels: one output of a temporal filter.
pub(crate) type Sum = Vec<(f64, Gamma)>;

/// Taps of a weighted sum.
pub(crate) fn taps(sum: &Sum, response: Response) -> Vec<f64> {
    let mut taps = Vec::new();
    for (weight, gamma) in sum {
        for (i, tap) in gamma.taps(response).into_iter().enumerate() {
            if i == taps.len() {
                taps.push(0.0);
            }
            taps[i] += weight * tap;
        }
    }
    taps
}

/// Cascades that compute K weighted sums of gamma kernels, one for each pole among them.
pub(crate) fn cascades<const K: usize>(sums: &[Sum; K], response: Response) -> Vec<CascadeTaps<K>> {
    let mut rates: Vec<f64> = Vec::new();
    for rate in sums.iter().flatten().map(|(_, gamma)| gamma.rate()) {
        if !rates.iter().any(|known| same_rate(*known, rate)) {
            rates.push(rate);
        }
    }
    rates.into_iter().map(|rate| cascade(rate, sums, response)).collect()
}

fn same_rate(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * a.abs()
}

fn cascade<const K: usize>(rate: f64, sums: &[Sum; K], response: Response) -> CascadeTaps<K> {
    let pole = (-rate).exp();
    let mut direct = [0.0; K];
    let mut weights: Vec<[f64; K]> = Vec::new();
    for (k, sum) in sums.iter().enumerate() {
        for (weight, gamma) in sum.iter().filter(|(_, gamma)| same_rate(rate, gamma.rate())) {
            direct[k] += weight * gamma.tap(0, response);
            for (j, b) in gamma.weights(response).into_iter().enumerate() {
                if j == weights.len() {
                    weights.push([0.0; K]);
                }
                weights[j][k] += weight * b;
            }
        }
    }
    // States are kept divided by the peak of their impulse response, so that all are of the size of the input.
    let gains: Vec<f64> = (0..weights.len()).map(|j| peak_gain(j, rate)).collect();
    // Where the pole is so small that a state never matters, it is left out.
    let most = |j: usize| weights[j].iter().fold(0.0, |most: f64, b| most.max(b.abs())) * gains[j];
    let states = (0..weights.len()).rev().find(|j| most(*j) > 1e-12).map_or(1, |j| j + 1);
    CascadeTaps {
        pole: pole as f32,
        direct: direct.map(|tap| tap as f32),
        feeds: (0..states).map(|j| if j == 0 { 1.0 } else { pole * gains[j - 1] / gains[j] } as f32).collect(),
        weights: (0..states).map(|j| weights[j].map(|b| (b * gains[j]) as f32)).collect(),
    }
}

/// Largest value of C(t, j) exp(-rate t) over whole t >= j.
fn peak_gain(j: usize, rate: f64) -> f64 {
    let log = |t: f64| (0..j).map(|i| ((t - i as f64) / (i + 1) as f64).ln()).sum::<f64>() - rate * t;
    // C(t + 1, j) / C(t, j) = (t + 1) / (t + 1 - j) falls to exp(rate) at the peak.
    let peak = (j as f64 / (1.0 - (-rate).exp()) - 1.0).floor().max(j as f64);
    [peak, peak + 1.0].into_iter().map(log).fold(f64::NEG_INFINITY, f64::max).max(-600.0).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [(u32, f64); 9] =
        [(2, 3.0), (6, 9.0), (3, 15.0), (5, 25.0), (8, 40.0), (8, 1.25), (1, 0.05), (24, 300.0), (12, 0.5)];

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn impulse_taps_sum_to_one_and_tails_are_their_remainders() {
        for (order, tau) in ALL {
            let gamma = Gamma { order, tau };
            let taps = gamma.taps(Response::Impulse);
            assert!((taps.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{gamma:?}");
            for (i, tail) in gamma.taps(Response::Tail).into_iter().enumerate() {
                assert!((gamma.tap(i, Response::Tail) - tail).abs() < 1e-12, "{gamma:?} {i}");
            }
        }
    }

    /// The mean delay of a first-order hold is that of the kernel: (n + 1) tau / n.
    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn mean_delay() {
        for (order, tau) in ALL {
            let gamma = Gamma { order, tau };
            let mean: f64 = gamma.taps(Response::Impulse).iter().enumerate().map(|(i, tap)| i as f64 * tap).sum();
            let expected = f64::from(order + 1) * tau / f64::from(order);
            // The taps stop where 1e-10 of the mass is left, some hundred frames out.
            assert!((mean - expected).abs() < 1e-6 * (1.0 + expected), "{gamma:?} {mean} {expected}");
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn cascade_has_the_taps_as_impulse_response() {
        for response in [Response::Impulse, Response::Tail] {
            for (order, tau) in ALL {
                let gamma = Gamma { order, tau };
                let [cascade] = &cascades(&[vec![(1.0, gamma)]], response)[..] else { panic!("one pole") };
                let mut states = vec![0.0f64; cascade.weights.len()];
                let most = (0..400).map(|i| gamma.tap(i, response)).fold(0.0, f64::max);
                for t in 0..400 {
                    let x = if t == 0 { 1.0 } else { 0.0 };
                    let mut y = f64::from(cascade.direct[0]) * x;
                    let mut before = x;
                    for (j, state) in states.iter_mut().enumerate() {
                        y += f64::from(cascade.weights[j][0]) * *state;
                        let next = f64::from(cascade.pole) * *state + f64::from(cascade.feeds[j]) * before;
                        before = std::mem::replace(state, next);
                    }
                    // Coefficients are rounded to f32: 6e-8 each, raised to the t-th power in the pole.
                    let bound = most * (1e-6 + 6e-8 * t as f64);
                    assert!(
                        (y - gamma.tap(t, response)).abs() < bound,
                        "{response:?} {gamma:?} {t} {y} {} {bound}",
                        gamma.tap(t, response)
                    );
                }
            }
        }
    }

    #[test]
    fn one_cascade_for_one_pole() {
        let slow = Gamma { order: 6, tau: 9.0 };
        let fast = Gamma { order: 2, tau: 3.0 };
        let other = Gamma { order: 2, tau: 3.5 };
        assert_eq!(cascades(&[vec![(1.0, slow), (-1.0, fast)]], Response::Tail).len(), 1);
        assert_eq!(cascades(&[vec![(1.0, slow)], vec![(-1.0, other)]], Response::Tail).len(), 2);
    }
}
