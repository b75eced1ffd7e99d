//! The last frames of a map, in a ring of fixed capacity: nothing is copied or allocated after construction.

use std::ops::Range;

use fearless_simd::{Level, Simd, dispatch, prelude::*};

use crate::frame::Size;
use crate::memory::heap;
use crate::plane::{Buffer, padded};
use crate::row::bands::Rows;
use crate::scroll::{Scroll, Scrolls, scroll_maps};
use crate::state::{Remember, StateError, Visit};

/// Ring buffer of frames, newest first. Frames before the first are zero.
pub(crate) struct FrameRing {
    capacity: usize,
    width: usize,
    stride: usize,
    /// Row by row, and in a row slot by slot, so that a band of rows is one piece.
    data: Buffer,
    /// Slot of the newest frame.
    newest: usize,
}

heap!(FrameRing { data });

impl Remember for FrameRing {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        visit.index("newest", &mut self.newest, self.capacity)?;
        visit.part("data", &mut self.data)
    }
}

impl Scrolls for FrameRing {
    /// The rows of all slots are those of one high map.
    fn scroll(&mut self, scroll: &Scroll<'_>) {
        let rows = self.data.len() / self.stride;
        let down = scroll.by.1.saturating_mul(self.capacity as isize);
        scroll_maps(&mut self.data, Size { height: rows, width: self.width }, 1, (scroll.by.0, down));
    }
}

impl FrameRing {
    pub fn new(size: Size, capacity: usize) -> Self {
        let stride = padded(size.width);
        Self { capacity, width: size.width, stride, data: Buffer::zeros(size.height * capacity * stride), newest: 0 }
    }

    /// Makes the oldest slot the newest; its content is then to be written.
    pub fn advance(&mut self) {
        self.newest = (self.newest + 1) % self.capacity;
    }

    pub fn clear(&mut self) {
        self.data.fill(0.0);
    }

    pub fn newest(&self) -> usize {
        self.newest
    }

    /// The rows of all slots, for row bands: each is `capacity` rows of one slot.
    pub fn rows(&mut self) -> Rows<'_> {
        Rows { data: &mut self.data, stride: self.capacity * self.stride }
    }
}

/// `out[x] = sum over i of taps[i] (frame i ago)[x]` over one row of a ring with `taps.len()` slots.
pub(crate) fn weighted_sum(level: Level, slots: &[f32], newest: usize, taps: &[f32], out: &mut [f32]) {
    dispatch!(level, simd => weighted_sum_in(simd, slots, newest, taps, out));
}

#[inline(always)]
fn weighted_sum_in<S: Simd>(simd: S, slots: &[f32], newest: usize, taps: &[f32], out: &mut [f32]) {
    let (stride, capacity) = (out.len(), slots.len() / out.len());
    let columns = |x: usize| -> Range<usize> { x..x + S::f32s::LEN };
    for x in (0..stride).step_by(S::f32s::LEN) {
        let mut sum = S::f32s::splat(simd, 0.0);
        for (i, tap) in taps.iter().enumerate() {
            let slot = &slots[(newest + capacity - i) % capacity * stride..][..stride];
            sum = S::f32s::from_slice(simd, &slot[columns(x)]).mul_add(S::f32s::splat(simd, *tap), sum);
        }
        sum.store_slice(&mut out[columns(x)]);
    }
}
