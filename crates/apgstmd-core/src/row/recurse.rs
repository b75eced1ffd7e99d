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

/// Filters one row. `states` holds one row a state; with `add` the outputs are added to what `out` holds.
pub(crate) fn cascade<const K: usize>(
    level: Level,
    taps: &CascadeTaps<K>,
    prepare: Prepare,
    input: &[f32],
    states: &mut [f32],
    out: [&mut [f32]; K],
    add: bool,
) {
    match prepare {
        Prepare::Keep => dispatch!(level, simd => cascade_in(simd, taps, |x| x, input, states, out, add)),
        Prepare::Positive => {
            dispatch!(level, simd => cascade_in(simd, taps, |x| x.max(0.0), input, states, out, add));
        }
        Prepare::Negative => {
            dispatch!(level, simd => cascade_in(simd, taps, |x| (-x).max(0.0), input, states, out, add));
        }
    }
}

#[inline(always)]
#[allow(unsafe_code, clippy::too_many_arguments)]
fn cascade_in<S: Simd, const K: usize>(
    simd: S,
    taps: &CascadeTaps<K>,
    prepare: impl Fn(S::f32s) -> S::f32s,
    input: &[f32],
    states: &mut [f32],
    out: [&mut [f32]; K],
    add: bool,
) {
    let width = input.len();
    assert!(width.is_multiple_of(LANES) && states.len() == width * taps.weights.len());
    assert!(out.iter().all(|row| row.len() == width));
    let zero = S::f32s::splat(simd, 0.0);
    let tiny = S::f32s::splat(simd, TINY);
    let flush = |value: S::f32s| value.abs().simd_lt(tiny).select(zero, value);
    let pole = S::f32s::splat(simd, taps.pole);
    for x in (0..width).step_by(S::f32s::LEN) {
        // SAFETY: x + LEN <= width, the length of input, outputs and each state.
        unsafe {
            let sample = prepare(load(simd, input, x));
            let mut sums = taps.direct.map(|tap| sample * tap);
            let mut before = sample;
            for (j, (weights, &feed)) in taps.weights.iter().zip(&taps.feeds).enumerate() {
                let state = load(simd, states, j * width + x);
                for k in 0..K {
                    sums[k] = state.mul_add(S::f32s::splat(simd, weights[k]), sums[k]);
                }
                let next = before.mul_add(S::f32s::splat(simd, feed), pole * state);
                store::<S>(flush(next), states, j * width + x);
                before = state;
            }
            for k in 0..K {
                let sum = flush(sums[k]);
                store::<S>(if add { sum + load(simd, out[k], x) } else { sum }, out[k], x);
            }
        }
    }
}
