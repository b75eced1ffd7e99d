//! Strips of a map on their way through lateral inhibition: what the kernel reaches is laid out once, and the rows that it
//! spans are spread once and kept in the first-level cache.

use std::ops::Range;

use crate::memory::heap;
use crate::plane::{Buffer, Plane, padded};
use crate::row::bands::Bands;
use crate::row::lateral::{Lateral, STRIP, Sink, Strip, inhibit};
use crate::row::recurse::Prepare;

/// Rows of a band: few enough for two threads at 270 rows; each begins with the rows that its kernel spans.
pub(crate) const ROLLING_ROWS: usize = 136;

/// Where a strip of a band lies, with what the kernel reaches around it.
#[derive(Clone, Copy)]
pub(crate) struct Around {
    pub top: isize,
    pub left: isize,
    pub rows: usize,
    /// Columns, whole vectors.
    pub stride: usize,
    /// Columns of the strip itself, whole vectors.
    pub width: usize,
}

impl Around {
    /// `STRIP` columns at most from `left` on.
    pub fn of(kernel: &Lateral, rows: &Range<usize>, left: usize, columns: usize) -> Self {
        let radius = kernel.radius();
        let width = padded(columns);
        Self {
            top: rows.start as isize - radius as isize,
            left: left as isize - radius as isize,
            rows: rows.len().next_multiple_of(2) + 2 * radius,
            stride: padded(width + 2 * radius),
            width,
        }
    }
}

/// A strip of a map with what the kernel reaches around it, zero outside the picture.
pub(crate) struct Source {
    pub data: Buffer,
    /// Of each row, whether anything in it is not zero.
    pub live: Vec<bool>,
}

heap!(Source { data, live });

impl Source {
    pub fn new(kernel: &Lateral) -> Self {
        let rows = ROLLING_ROWS + 2 * kernel.radius();
        Self { data: Buffer::zeros(rows * padded(STRIP + 2 * kernel.radius())), live: vec![false; rows] }
    }

    /// One sign of a map.
    pub fn fill(&mut self, around: &Around, plane: &Plane, sign: Prepare) {
        let Around { top, left, rows, stride, .. } = *around;
        for (y, (row, live)) in self.data.chunks_exact_mut(stride).zip(&mut self.live).enumerate().take(rows) {
            plane.copy_row(top + y as isize, left, row);
            row.iter_mut().for_each(|value| *value = sign.apply(*value));
            *live = row.iter().any(|value| *value != 0.0);
        }
    }
}

/// Spread rows of a strip.
pub(crate) struct Rolling(Buffer);

impl crate::memory::Heap for Rolling {
    fn heap(&self) -> crate::memory::Memory {
        self.0.heap()
    }
}

impl Rolling {
    pub fn new(kernel: &Lateral) -> Self {
        Self(Buffer::zeros(kernel.ring()))
    }

    /// Inhibits `rows` rows of a strip: see [`inhibit`].
    pub fn inhibit(
        &mut self,
        bands: &Bands,
        kernel: &Lateral,
        (source, around): (&Source, &Around),
        rows: usize,
        sink: &mut impl Sink,
    ) -> usize {
        let strip = Strip { data: &source.data, stride: around.stride, live: &source.live, width: around.width };
        inhibit(bands.level(), kernel, strip, rows, &mut self.0, bands.dense(), sink)
    }
}
