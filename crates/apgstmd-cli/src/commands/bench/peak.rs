//! What the machine gives at most: multiply-adds out of registers, bytes copied through memory. Measured now, since
//! clocks and neighbours differ from hour to hour.

use std::hint::black_box;
use std::sync::Barrier;
use std::thread;
use std::time::{Duration, Instant};

use fearless_simd::{Level, Simd, dispatch, prelude::*};
use serde::Serialize;

/// Chains of multiply-adds that do not wait for each other: enough for two units with a latency of five.
const CHAINS: usize = 10;
const ROUNDS: usize = 20_000;
/// Floats copied by a thread: far beyond any cache.
const FLOATS: usize = 12 << 20;
const SPAN: Duration = Duration::from_millis(150);

/// Of some threads together.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Peak {
    pub threads: usize,
    /// Multiply-adds a second in f32, 10^9.
    pub gfma_per_s: f64,
    /// Bytes read and written a second, 10^9.
    pub gbytes_per_s: f64,
}

impl Peak {
    /// With the best instruction set, in a third of a second.
    pub fn measure(threads: usize) -> Self {
        let fma = together(threads, |begin| {
            begin();
            repeat(|| dispatch!(Level::new(), simd => multiply_add(simd)))
        });
        let copy = together(threads, |begin| {
            let (from, mut to) = (vec![1.0f32; FLOATS], vec![0.0f32; FLOATS]);
            begin();
            repeat(|| {
                to.copy_from_slice(black_box(&from));
                black_box(&mut to);
                2.0 * size_of_val(&*from) as f64
            })
        });
        Self { threads, gfma_per_s: fma / 1e9, gbytes_per_s: copy / 1e9 }
    }
}

/// The sum of what threads get done in a second, all at once.
fn together(threads: usize, work: impl Fn(&dyn Fn()) -> f64 + Sync) -> f64 {
    let barrier = Barrier::new(threads);
    let begin = || {
        barrier.wait();
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(|| work(&begin))).collect();
        workers.into_iter().map(|worker| worker.join().unwrap_or(0.0)).sum()
    })
}

/// Best rate of `work`, which says how much it did.
fn repeat(mut work: impl FnMut() -> f64) -> f64 {
    let end = Instant::now() + SPAN;
    let mut best = 0.0f64;
    while Instant::now() < end {
        let begin = Instant::now();
        let done = work();
        best = best.max(done / begin.elapsed().as_secs_f64());
    }
    best
}

/// How many multiply-adds were done.
#[inline(always)]
fn multiply_add<S: Simd>(simd: S) -> f64 {
    let (scale, shift) = (S::f32s::splat(simd, black_box(0.75)), S::f32s::splat(simd, black_box(0.25)));
    let mut sums = [S::f32s::splat(simd, black_box(0.5)); CHAINS];
    for _ in 0..ROUNDS {
        for sum in &mut sums {
            *sum = sum.mul_add(scale, shift);
        }
    }
    black_box(sums.map(|sum| sum.as_slice()[0]));
    (ROUNDS * CHAINS * S::f32s::LEN) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_those_of_a_computer() {
        let peak = Peak::measure(1);
        assert!((0.1..1e4).contains(&peak.gfma_per_s), "{peak:?}");
        assert!((0.1..1e4).contains(&peak.gbytes_per_s), "{peak:?}");
    }
}
