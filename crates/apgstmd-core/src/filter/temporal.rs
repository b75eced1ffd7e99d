//! Filters over time: weighted sums of gamma kernels of one input, in two engines behind one interface.
//!
//! Input: one map a frame, or its change; several frames at once, so that a row of the state is read and written once for
//! all of them. Output: K maps a frame. State: n + 1 planes a pole (cascade), or as many past frames as the
//! kernel is long (FIR, the reference). The state before the first frame is zero.

use fearless_simd::Level;

use super::gamma::{Response, Sum, cascades, taps};
use super::ring::{FrameRing, weighted_sum};
use crate::frame::Size;
use crate::memory::{Heap, Memory, heap};
use crate::params::TemporalEngine;
use crate::plane::{Buffer, Plane, Series, padded};
use crate::row::bands::{Bands, Rows, Scratch};
use crate::row::mix::subtract;
use crate::row::recurse::{CascadeTaps, Prepare, cascade};
use crate::scroll::{Scroll, Scrolls, scroll_maps};
use crate::state::{Remember, StateError, Visit, remember};

/// Most frames that are computed together.
pub(crate) const MOST_TOGETHER: usize = 8;

pub(crate) struct TemporalFilter<const K: usize> {
    size: Size,
    prepare: Prepare,
    engine: Engine<K>,
    /// A row of changes.
    scratch: Scratch<Buffer>,
}

enum Engine<const K: usize> {
    /// One cascade a pole, each with its states row by row.
    Cascade(Vec<(CascadeTaps<K>, Buffer)>),
    Fir {
        ring: FrameRing,
        taps: [Vec<f32>; K],
    },
}

heap!(const K => TemporalFilter<K> { engine, scratch });
remember!(const K => TemporalFilter<K> { engine });

impl<const K: usize> Heap for Engine<K> {
    fn heap(&self) -> Memory {
        match self {
            Self::Cascade(groups) => groups.heap(),
            Self::Fir { ring, taps } => ring.heap() + taps.heap(),
        }
    }
}

impl<const K: usize> Remember for Engine<K> {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        match self {
            Self::Cascade(groups) => groups
                .iter_mut()
                .enumerate()
                .try_for_each(|(index, (_, states))| visit.part(&format!("states{index}"), states)),
            Self::Fir { ring, .. } => visit.part("ring", ring),
        }
    }
}

impl<const K: usize> Scrolls for TemporalFilter<K> {
    fn scroll(&mut self, scroll: &Scroll<'_>) {
        match &mut self.engine {
            Engine::Cascade(groups) => {
                for (taps, states) in groups {
                    scroll_maps(states, self.size, taps.weights.len(), scroll.by);
                }
            }
            Engine::Fir { ring, .. } => ring.scroll(scroll),
        }
    }
}

/// What is filtered, in frames that follow each other.
#[derive(Clone, Copy)]
pub(crate) enum Input<'a> {
    Maps(&'a [Plane]),
    /// Changes from frame to frame, and what is added to them. The first frame of all is taken to have stood before.
    Changes {
        of: &'a Series,
        first: bool,
        added: Option<&'a [Plane]>,
    },
}

impl<'a> Input<'a> {
    fn maps(self) -> &'a [Plane] {
        match self {
            Self::Maps(maps) => maps,
            Self::Changes { of, .. } => of.maps(),
        }
    }

    /// Row y of a frame; changes are written into `line`.
    fn row<'s>(self, level: Level, frame: usize, y: usize, line: &'s mut [f32]) -> &'s [f32]
    where
        'a: 's,
    {
        match self {
            Self::Maps(maps) => maps[frame].padded_row(y),
            Self::Changes { of, first, added } => {
                let now = of.maps()[frame].padded_row(y);
                let before = if first && frame == 0 { now } else { of.before(frame).padded_row(y) };
                subtract(level, now, before, added.map(|added| added[frame].padded_row(y)), line);
                line
            }
        }
    }
}

impl<const K: usize> TemporalFilter<K> {
    /// One output for each of `sums`; every sample goes through `prepare` first.
    pub fn new(
        size: Size,
        engine: TemporalEngine,
        prepare: Prepare,
        sums: &[Sum; K],
        response: Response,
        threads: usize,
    ) -> Self {
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
        Self { size, prepare, engine, scratch: Scratch::new(threads, || Buffer::zeros(stride)) }
    }

    /// Takes the next frames of the input, `MOST_TOGETHER` at most, and writes the outputs of each.
    pub fn process(&mut self, bands: &Bands, input: Input<'_>, mut out: [&mut [Plane]; K]) {
        let Self { size, prepare, engine, scratch } = self;
        let (height, prepare, scratch) = (size.height, *prepare, &*scratch);
        let (count, stride) = (input.maps().len(), input.maps()[0].stride());
        match engine {
            Engine::Cascade(groups) => {
                for (index, (taps, states)) in groups.iter_mut().enumerate() {
                    let taps = &*taps;
                    let states = Rows { data: states, stride: taps.weights.len() * stride };
                    let out = out.each_mut().map(|planes| rows_of(planes));
                    bands.over(height, (states, out), |range, (mut states, mut out)| {
                        scratch.with(bands, |line| {
                            for (row, y) in range.enumerate() {
                                for frame in 0..count {
                                    let out = out.each_mut().map(|planes| row_of(planes, frame, row));
                                    let input = input.row(bands.level(), frame, y, line);
                                    cascade(bands.level(), taps, prepare, input, states.row(row), out, index > 0);
                                }
                            }
                        });
                    });
                }
            }
            Engine::Fir { ring, taps } => {
                for frame in 0..count {
                    ring.advance();
                    let newest = ring.newest();
                    let out = out.each_mut().map(|planes| rows_of(planes));
                    bands.over(height, (ring.rows(), out), |range, (mut slots, mut out)| {
                        scratch.with(bands, |line| {
                            for (row, y) in range.enumerate() {
                                let slots = slots.row(row);
                                let into = &mut slots[newest * stride..(newest + 1) * stride];
                                let input = input.row(bands.level(), frame, y, line);
                                into.iter_mut().zip(input).for_each(|(into, x)| *into = prepare.apply(*x));
                                for (taps, out) in taps.iter().zip(&mut out) {
                                    weighted_sum(bands.level(), slots, newest, taps, row_of(out, frame, row));
                                }
                            }
                        });
                    });
                }
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

/// Rows of several maps, to be cut together.
type RowsOfMaps<'a> = [Option<Rows<'a>>; MOST_TOGETHER];

fn rows_of(planes: &mut [Plane]) -> RowsOfMaps<'_> {
    let mut rows = [const { None }; MOST_TOGETHER];
    for (rows, plane) in rows.iter_mut().zip(planes) {
        let stride = plane.stride();
        *rows = Some(Rows { data: plane.data_mut(), stride });
    }
    rows
}

fn row_of<'a>(maps: &'a mut RowsOfMaps<'_>, frame: usize, row: usize) -> &'a mut [f32] {
    maps[frame].as_mut().expect("an output for every frame").row(row)
}

#[cfg(test)]
mod tests {
    use std::slice::{from_mut, from_ref};

    use super::*;
    use crate::filter::gamma::Gamma;

    /// Both engines on the same random walk, for poles shared and not.
    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn engines_agree() {
        let size = Size::new(3, 5);
        for sums in [
            [vec![(1.0, Gamma { order: 5, tau: 25.0 })], vec![(1.0, Gamma { order: 8, tau: 40.0 })]],
            [vec![(1.0, Gamma { order: 5, tau: 3.0 })], vec![(2.0, Gamma { order: 2, tau: 0.2 })]],
        ] {
            for response in [Response::Impulse, Response::Tail] {
                let bands = Bands::single();
                let mut filters = [TemporalEngine::Cascade, TemporalEngine::Fir]
                    .map(|engine| TemporalFilter::new(size, engine, Prepare::Positive, &sums, response, 1));
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
                        filter.process(&bands, Input::Maps(from_ref(&input)), [from_mut(a), from_mut(b)]);
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
