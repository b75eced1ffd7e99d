//! One gamma cascade over a row: all states read and written once, any number of outputs.

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use super::load_store::{load, store};
use crate::memory::heap;
use crate::plane::LANES;

/// States and outputs below this are set to zero: ten orders above the denormals, which are slow, and far below anything
/// that reaches the response floor.
const TINY: f32 = 1e-28;

/// What happens to a sample on its way into a filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Prepare {
    /// Nothing.
    Keep,
    /// Its positive part.
    Positive,
    /// Its negative part, as a positive number.
    Negative,
}

heap!(const K => CascadeTaps<K> { feeds, weights });

impl Prepare {
    pub fn apply(self, x: f32) -> f32 {
        match self {
            Self::Keep => x,
            Self::Positive => x.max(0.0),
            Self::Negative => (-x).max(0.0),
        }
    }
}

/// States c_j = pole c_j + feed_j c_{j-1}, with the input before the first, and K outputs
/// y = direct x + sum of weight_j c_j over the states before the update.
#[derive(Clone, Debug)]
pub(crate) struct CascadeTaps<const K: usize> {
    pub pole: f32,
    pub direct: [f32; K],
    /// One entry a state, as in `weights`.
    pub feeds: Vec<f32>,
    pub weights: Vec<[f32; K]>,
}

/// Filters one row. `states` holds all states of `LANES` columns, then those of the next, so that memory is one stream;
/// with `add` the outputs are added to what `out` holds.
pub(crate) fn cascade<const K: usize>(
    level: Level,
    taps: &CascadeTaps<K>,
    prepare: Prepare,
    input: &[f32],
    states: &mut [f32],
    out: [&mut [f32]; K],
    add: bool,
) {
    // max(sign x, least).
    let (sign, least) = match prepare {
        Prepare::Keep => (1.0, f32::NEG_INFINITY),
        Prepare::Positive => (1.0, 0.0),
        Prepare::Negative => (-1.0, 0.0),
    };
    let count = taps.weights.len();
    // The counts of the default filters, for the compiler to unroll.
    match count {
        4 => dispatch!(level, simd => cascade_in(simd, taps, 4, [sign, least], input, states, out, add)),
        7 => dispatch!(level, simd => cascade_in(simd, taps, 7, [sign, least], input, states, out, add)),
        9 => dispatch!(level, simd => cascade_in(simd, taps, 9, [sign, least], input, states, out, add)),
        _ => dispatch!(level, simd => cascade_in(simd, taps, count, [sign, least], input, states, out, add)),
    }
}

#[inline(always)]
#[allow(unsafe_code, clippy::too_many_arguments)]
fn cascade_in<S: Simd, const K: usize>(
    simd: S,
    taps: &CascadeTaps<K>,
    count: usize,
    [sign, least]: [f32; 2],
    input: &[f32],
    states: &mut [f32],
    out: [&mut [f32]; K],
    add: bool,
) {
    let width = input.len();
    assert!(taps.weights.len() == count && taps.feeds.len() == count);
    assert!(width.is_multiple_of(LANES) && states.len() == width * count);
    assert!(out.iter().all(|row| row.len() == width));
    let zero = S::f32s::splat(simd, 0.0);
    let tiny = S::f32s::splat(simd, TINY);
    let flush = |value: S::f32s| value.abs().simd_lt(tiny).select(zero, value);
    let (pole, least) = (S::f32s::splat(simd, taps.pole), S::f32s::splat(simd, least));
    for x in (0..width).step_by(S::f32s::LEN) {
        // All states of LANES columns lie side by side.
        let first = (x - x % LANES) * count + x % LANES;
        // SAFETY: x + LEN <= width, the length of input and outputs; LEN divides LANES, and states holds `count` of them
        // for each of width.
        unsafe {
            let sample = (load(simd, input, x) * sign).max(least);
            let mut sums = [zero; K];
            for (sum, tap) in sums.iter_mut().zip(&taps.direct) {
                *sum = sample * *tap;
            }
            let mut before = sample;
            for j in 0..count {
                let (weights, feed) = (&taps.weights[j], taps.feeds[j]);
                let state = load(simd, states, first + j * LANES);
                for k in 0..K {
                    sums[k] = state.mul_add(S::f32s::splat(simd, weights[k]), sums[k]);
                }
                let next = before.mul_add(S::f32s::splat(simd, feed), pole * state);
                store::<S>(flush(next), states, first + j * LANES);
                before = state;
            }
            for k in 0..K {
                let sum = flush(sums[k]);
                store::<S>(if add { sum + load(simd, out[k], x) } else { sum }, out[k], x);
            }
        }
    }
}
