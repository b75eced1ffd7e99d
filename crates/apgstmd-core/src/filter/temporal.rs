//! Filters over time: weighted sums of gamma kernels of one input, in two engines behind one interface.
//!
//! Input: one map a frame. Output: K maps a frame. State: n + 1 planes a pole (cascade), or as many past frames as the
//! kernel is long (FIR, the reference). The state before the first frame is zero.

use super::gamma::{Response, Sum, cascades, taps};
use super::ring::{FrameRing, weighted_sum};
use crate::frame::Size;
use crate::memory::{Heap, Memory, heap};
use crate::params::TemporalEngine;
use crate::plane::{Buffer, Plane, padded};
use crate::row::bands::{Bands, Rows};
use crate::row::recurse::{CascadeTaps, Prepare, cascade};

pub(crate) struct TemporalFilter<const K: usize> {
    height: usize,
    prepare: Prepare,
    engine: Engine<K>,
}

enum Engine<const K: usize> {
    /// One cascade a pole, each with its states row by row.
    Cascade(Vec<(CascadeTaps<K>, Buffer)>),
    Fir {
        ring: FrameRing,
        taps: [Vec<f32>; K],
    },
}

heap!(const K => TemporalFilter<K> { engine });

impl<const K: usize> Heap for Engine<K> {
    fn heap(&self) -> Memory {
        match self {
            Self::Cascade(groups) => groups.heap(),
            Self::Fir { ring, taps } => ring.heap() + taps.heap(),
        }
    }
}

impl<const K: usize> TemporalFilter<K> {
    /// One output for each of `sums`; every sample goes through `prepare` first.
    pub fn new(size: Size, engine: TemporalEngine, prepare: Prepare, sums: &[Sum; K], response: Response) -> Self {
        let stride = padded(size.width);
        let engine = match engine {
            TemporalEngine::Cascade => Engine::Cascade(
                cascades(sums, response)
                    .into_iter()
                    .map(|taps| {
                        let states = Buffer::zeros(size.height * taps.weights.len() * stride);
                        (taps, states)
                    })
                    .collect(),
            ),
            TemporalEngine::Fir => {
                let taps: [Vec<f32>; K] =
                    sums.each_ref().map(|sum| taps(sum, response).into_iter().map(|tap| tap as f32).collect());
                let capacity = taps.iter().map(Vec::len).max().unwrap_or(1);
                Engine::Fir { ring: FrameRing::new(size, capacity), taps }
            }
        };
        Self { height: size.height, prepare, engine }
    }

    /// Takes the next frame of the input and writes the outputs of this frame.
    pub fn process(&mut self, bands: &Bands, input: &Plane, out: [&mut Plane; K]) {
        let stride = input.stride();
        let prepare = self.prepare;
        let mut out = out.map(|plane| Rows { data: plane.data_mut(), stride });
        match &mut self.engine {
            Engine::Cascade(groups) => {
                for (index, (taps, states)) in groups.iter_mut().enumerate() {
                    let taps = &*taps;
                    let states = Rows { data: states, stride: taps.weights.len() * stride };
                    let out = out.each_mut().map(|rows| Rows { data: &mut *rows.data, stride });
                    bands.over(self.height, (states, out), |range, (mut states, mut out)| {
                        for (row, y) in range.enumerate() {
                            let out = out.each_mut().map(|rows| rows.row(row));
                            let input = input.padded_row(y);
                            cascade(bands.level(), taps, prepare, input, states.row(row), out, index > 0);
                        }
                    });
                }
            }
            Engine::Fir { ring, taps } => {
                ring.advance();
                let newest = ring.newest();
                bands.over(self.height, (ring.rows(), out), |range, (mut slots, mut out)| {
                    for (row, y) in range.enumerate() {
                        let slots = slots.row(row);
                        let into = &mut slots[newest * stride..(newest + 1) * stride];
                        into.iter_mut().zip(input.padded_row(y)).for_each(|(into, x)| *into = prepare.apply(*x));
                        for (taps, out) in taps.iter().zip(&mut out) {
                            weighted_sum(bands.level(), slots, newest, taps, out.row(row));
                        }
                    }
                });
            }
        }
    }

    /// As before the first frame.
    pub fn reset(&mut self) {
        match &mut self.engine {
            Engine::Cascade(groups) => groups.iter_mut().for_each(|(_, states)| states.fill(0.0)),
            Engine::Fir { ring, .. } => ring.clear(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::gamma::Gamma;

    /// Both engines on the same random walk, for poles shared and not.
    #[test]
    fn engines_agree() {
        let size = Size::new(3, 5);
        for sums in [
            [vec![(1.0, Gamma { order: 5, tau: 25.0 })], vec![(1.0, Gamma { order: 8, tau: 40.0 })]],
            [vec![(1.0, Gamma { order: 5, tau: 3.0 })], vec![(2.0, Gamma { order: 2, tau: 0.2 })]],
        ] {
            for response in [Response::Impulse, Response::Tail] {
                let bands = Bands::single();
                let mut filters = [TemporalEngine::Cascade, TemporalEngine::Fir]
                    .map(|engine| TemporalFilter::new(size, engine, Prepare::Positive, &sums, response));
                let mut input = Plane::new(size);
                let mut outputs = [(); 2].map(|()| [Plane::new(size), Plane::new(size)]);
                let mut seed = 1u32;
                for _ in 0..200 {
                    for y in 0..3 {
                        input.row_mut(y).iter_mut().for_each(|x| {
                            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                            *x = seed as f32 / u32::MAX as f32 - 0.5;
                        });
                    }
                    for (filter, out) in filters.iter_mut().zip(&mut outputs) {
                        let [a, b] = out;
                        filter.process(&bands, &input, [a, b]);
                    }
                    for (cascade, fir) in outputs[0].iter().zip(&outputs[1]) {
                        for (a, b) in cascade.view().iter().zip(fir.view()) {
                            // Sums of some hundred f32 terms of size up to one.
                            assert!((a - b).abs() < 2e-5, "{a} {b}");
                        }
                    }
                }
            }
        }
    }
}
