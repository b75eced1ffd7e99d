//! Work over bands of rows: outputs are split into disjoint bands, bands go to threads by `rayon::join`.
//!
//! Every pixel is computed by the same operations whatever band it falls in, so results do not depend on the number of
//! threads.

use std::ops::Range;
use std::sync::Mutex;

use fearless_simd::Level;

use super::machine::SimdLevel;
use crate::memory::{Heap, Memory};
use crate::tiles::TILE;

/// Rows a band aims at: enough to pay for its halo, few enough to balance two threads at 270 rows. Measured with
/// `cargo bench -p apgstmd-benches`.
pub(crate) const BAND_ROWS: usize = 32;

/// How the machine is used: threads and instruction set.
pub(crate) struct Bands {
    threads: usize,
    level: Level,
    dense: bool,
}

/// Outputs that can be cut between two rows.
pub(crate) trait Split: Sized + Send {
    fn split(self, rows: usize) -> (Self, Self);
}

/// Rows of equal length, to be written.
pub(crate) struct Rows<'a> {
    pub data: &'a mut [f32],
    pub stride: usize,
}

impl Split for Rows<'_> {
    fn split(self, rows: usize) -> (Self, Self) {
        let (head, tail) = self.data.split_at_mut(rows * self.stride);
        (Self { data: head, stride: self.stride }, Self { data: tail, stride: self.stride })
    }
}

impl Rows<'_> {
    pub fn row(&mut self, y: usize) -> &mut [f32] {
        &mut self.data[y * self.stride..(y + 1) * self.stride]
    }

    /// From a row on.
    pub fn from(&mut self, row: usize) -> Rows<'_> {
        Rows { data: &mut self.data[row * self.stride..], stride: self.stride }
    }

    /// `columns` of a row.
    #[inline(always)]
    pub fn part(&mut self, y: usize, columns: Range<usize>) -> &mut [f32] {
        &mut self.data[y * self.stride + columns.start..y * self.stride + columns.end]
    }
}

/// One value a row.
pub(crate) struct Slice<'a, T>(pub &'a mut [T]);

impl<T: Send> Split for Slice<'_, T> {
    fn split(self, rows: usize) -> (Self, Self) {
        let (head, tail) = self.0.split_at_mut(rows);
        (Self(head), Self(tail))
    }
}

/// Several values a row.
pub(crate) struct Table<'a, T> {
    pub values: &'a mut [T],
    pub stride: usize,
}

impl<T: Send> Split for Table<'_, T> {
    fn split(self, rows: usize) -> (Self, Self) {
        let (head, tail) = self.values.split_at_mut(rows * self.stride);
        (Self { values: head, stride: self.stride }, Self { values: tail, stride: self.stride })
    }
}

impl<T: Split, const N: usize> Split for [T; N] {
    fn split(self, rows: usize) -> (Self, Self) {
        let mut tails = [const { None }; N];
        let mut index = 0;
        let heads = self.map(|part| {
            let (head, tail) = part.split(rows);
            tails[index] = Some(tail);
            index += 1;
            head
        });
        (heads, tails.map(|tail| tail.expect("every part was split")))
    }
}

impl Split for () {
    fn split(self, _: usize) -> (Self, Self) {
        ((), ())
    }
}

impl<A: Split, B: Split> Split for (A, B) {
    fn split(self, rows: usize) -> (Self, Self) {
        let (a, b) = (self.0.split(rows), self.1.split(rows));
        ((a.0, b.0), (a.1, b.1))
    }
}

impl<T: Split> Split for Option<T> {
    fn split(self, rows: usize) -> (Self, Self) {
        self.map(|outputs| outputs.split(rows)).unzip()
    }
}

impl Bands {
    pub fn new(threads: usize, simd: SimdLevel, dense: bool) -> Self {
        Self { threads, level: simd.level(), dense }
    }

    /// The same on one of the threads alone.
    pub fn alone(&self) -> Self {
        Self { threads: 1, ..*self }
    }

    /// One thread, the best instruction set.
    pub fn single() -> Self {
        Self::new(1, SimdLevel::best(), false)
    }

    pub fn threads(&self) -> usize {
        self.threads
    }

    /// The instruction set to dispatch to.
    pub fn level(&self) -> Level {
        self.level
    }

    /// Whether work that is known to give zero is to be done all the same.
    pub fn dense(&self) -> bool {
        self.dense
    }

    /// Calls `work(rows, outputs of these rows)` for bands that cover `0..height`.
    pub fn over<T: Split>(&self, height: usize, outputs: T, work: impl Fn(Range<usize>, T) + Sync) {
        self.over_long(height, BAND_ROWS, outputs, work);
    }

    /// As [`Bands::over`] for bands of about `most` rows, which begin at even rows.
    pub fn over_long<T: Split>(&self, height: usize, most: usize, outputs: T, work: impl Fn(Range<usize>, T) + Sync) {
        let count = height.div_ceil(most).next_multiple_of(self.threads.min(height.div_ceil(8))).max(1);
        let rows = height.div_ceil(count).next_multiple_of(2);
        self.halve(0..height, rows, outputs, &work);
    }

    /// As [`Bands::over`], but bands are the rows of tiles.
    pub fn over_tiles<T: Split>(&self, height: usize, outputs: T, work: impl Fn(Range<usize>, T) + Sync) {
        self.halve(0..height, TILE, outputs, &work);
    }

    fn halve<T: Split>(&self, range: Range<usize>, rows: usize, outputs: T, work: &(impl Fn(Range<usize>, T) + Sync)) {
        if range.len() <= rows {
            work(range, outputs);
            return;
        }
        let head_rows = range.len().div_ceil(rows).div_ceil(2) * rows;
        let middle = range.start + head_rows;
        let (head, tail) = outputs.split(head_rows);
        if self.threads == 1 {
            self.halve(range.start..middle, rows, head, work);
            self.halve(middle..range.end, rows, tail, work);
        } else {
            rayon::join(
                || self.halve(range.start..middle, rows, head, work),
                || self.halve(middle..range.end, rows, tail, work),
            );
        }
    }

    /// Calls both, at the same time where there are threads: `main`, which may use all of them, and `aside`, which uses one.
    pub fn both(&self, main: impl FnOnce() + Send, aside: impl FnOnce() + Send) {
        if self.threads == 1 {
            main();
            aside();
        } else {
            rayon::join(main, aside);
        }
    }

    /// Calls `work` for the parts of `items`, down to single ones where there are threads.
    pub fn each<T: Send, O: Split>(&self, items: (Slice<'_, T>, O), work: impl Fn((Slice<'_, T>, O)) + Sync) {
        let count = items.0.0.len();
        let rows = if self.threads == 1 { count.max(1) } else { 1 };
        self.halve(0..count, rows, items, &|_, items| work(items));
    }

    fn worker(&self) -> usize {
        if self.threads == 1 { 0 } else { rayon::current_thread_index().unwrap_or(0) }
    }
}

/// Scratch memory, one piece a thread. Taking it never waits: a thread takes only its own, one at a time.
pub(crate) struct Scratch<T>(Vec<Mutex<T>>);

impl<T> Scratch<T> {
    pub fn new(threads: usize, make: impl Fn() -> T) -> Self {
        Self((0..threads).map(|_| Mutex::new(make())).collect())
    }

    pub fn with<R>(&self, bands: &Bands, work: impl FnOnce(&mut T) -> R) -> R {
        let mut own = self.0[bands.worker()].try_lock().expect("a thread uses its own scratch, once at a time");
        work(&mut own)
    }
}

impl<T: Heap> Heap for Scratch<T> {
    fn heap(&self) -> Memory {
        let one =
            |piece: &Mutex<T>| piece.lock().map_or_else(|poisoned| poisoned.get_ref().heap(), |piece| piece.heap());
        self.0.iter().map(one).fold(Memory::default(), |sum, piece| sum + piece)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_every_row_once() {
        for threads in [1, 2, 5] {
            let bands = Bands::new(threads, SimdLevel::best(), false);
            for height in (1..200).step_by(if cfg!(miri) { 33 } else { 1 }) {
                let mut data = vec![0.0; height * 3];
                bands.over(height, Rows { data: &mut data, stride: 3 }, |range, mut rows| {
                    for y in 0..range.len() {
                        rows.row(y).iter_mut().for_each(|value| *value += (range.start + y) as f32 + 1.0);
                    }
                });
                for (y, row) in data.chunks(3).enumerate() {
                    assert!(row.iter().all(|value| *value == y as f32 + 1.0));
                }
            }
        }
    }
}
