//! A strip of a map on its way through lateral inhibition, row by row: only the rows that a kernel spans are kept, spread,
//! so that they stay in the first-level cache.

use fearless_simd::Level;

use crate::memory::heap;
use crate::plane::{Buffer, padded};
use crate::row::lateral::{Lateral, SpreadRows, spread};

/// Columns of a strip: the rows that the default kernel spans fit the first-level cache.
pub(crate) const STRIP: usize = 128;
/// Rows of a band: few enough for two threads at 270 rows; each begins with the rows that its kernel spans.
pub(crate) const ROLLING_ROWS: usize = 72;

pub(crate) struct Rolling {
    halo: usize,
    radius: usize,
    rows: usize,
    slots: usize,
    width: usize,
    /// One row of the source, with the columns that the kernel reaches on both sides.
    source: Buffer,
    spread: Buffer,
    /// The row that enters next.
    next: isize,
    /// The last row that was not zero.
    live: isize,
}

heap!(Rolling { source, spread });

impl Rolling {
    pub fn new(kernel: &Lateral) -> Self {
        let (radius, rows) = (kernel.radius(), kernel.rows());
        let (halo, slots) = (padded(radius), (2 * radius + 1).next_power_of_two());
        Self {
            halo,
            radius,
            rows,
            slots,
            width: 0,
            source: Buffer::zeros(STRIP + 2 * halo),
            spread: Buffer::zeros(slots * rows * STRIP),
            next: 0,
            live: isize::MIN,
        }
    }

    /// Begins a strip of at most `STRIP` columns; the first row to be asked for is `row`.
    pub fn begin(&mut self, columns: usize, row: usize) {
        self.width = padded(columns);
        self.next = row as isize - self.radius as isize;
        self.live = isize::MIN;
    }

    /// Columns left of the strip that `fill` writes, a multiple of a vector.
    pub fn halo(&self) -> usize {
        self.halo
    }

    /// Lets the rows in that `row` depends on. `fill` writes a row with its halo on both sides, and says whether
    /// anything in it is not zero. Rows outside the picture are asked for as well.
    ///
    /// Returns whether any of the rows is not zero.
    pub fn reach(
        &mut self,
        level: Level,
        kernel: &Lateral,
        row: usize,
        mut fill: impl FnMut(isize, &mut [f32]) -> bool,
    ) -> bool {
        let size = self.rows * self.width;
        while self.next <= (row + self.radius) as isize {
            let source = &mut self.source[..self.width + 2 * self.halo];
            let slot = self.next as usize & (self.slots - 1);
            let out = &mut self.spread[slot * size..(slot + 1) * size];
            if fill(self.next, source) {
                self.live = self.next;
                spread(level, &source[self.halo - self.radius..], kernel, out);
            } else {
                out.fill(0.0);
            }
            self.next += 1;
        }
        self.live >= row as isize - self.radius as isize
    }

    /// The rows that `row` depends on, which have been let in.
    pub fn rows(&self, row: usize) -> SpreadRows<'_> {
        let size = self.slots * self.rows * self.width;
        SpreadRows { data: &self.spread[..size], slots: self.slots, width: self.width, middle: row }
    }
}
