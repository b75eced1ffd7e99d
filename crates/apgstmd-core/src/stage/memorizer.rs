//! Memorizer: F and M of the last dt frames, and of the present one, as tiles: what is zero is not stored.
//!
//! A ring of dt + 1 frames. Each holds room for every tile, but the pages of tiles that were never needed are never
//! touched, so memory follows the largest part of the picture that was predicted in at once.

use crate::DIRECTIONS;
use crate::frame::Size;
use crate::memory::{Heap, Memory, heap};
use crate::plane::Buffer;
use crate::scroll::{Scroll, Scrolls};
use crate::state::{Remember, StateError, Visit};
use crate::tiles::{Area, Grid, TILE};

/// Values of one tile of one map.
pub(crate) const TILE_AREA: usize = TILE * TILE;
/// Values of a block: F in 8 directions, then M.
pub(crate) const BLOCK: usize = (DIRECTIONS + 1) * TILE_AREA;

const ABSENT: u32 = u32::MAX;

/// F and M of one frame.
pub(crate) struct Gains {
    /// Block of each tile, or `ABSENT`.
    block: Vec<u32>,
    /// Bit k: direction k is not zero everywhere in this tile.
    pub mask: Vec<u8>,
    data: Buffer,
    /// Largest M.
    pub peak: f32,
    /// Most blocks ever in use: the others were never written to.
    touched: usize,
}

heap!(Memorizer { ring });

impl Remember for Memorizer {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        visit.index("now", &mut self.now, self.ring.len())?;
        self.ring.iter_mut().enumerate().try_for_each(|(index, gains)| visit.part(&index.to_string(), gains))
    }
}

impl Remember for Gains {
    /// Blocks are given by tile, those that there are by their values.
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        let tiles = self.block.len();
        let used = |mask: &[u8]| mask.iter().filter(|mask| **mask != 0).count();
        visit.part("peak", &mut self.peak)?;
        let mut there = 0;
        let count = |mask: &[u8]| {
            there = used(mask);
            mask.len() == tiles
        };
        let mask = visit.some_values("mask", tiles, || self.mask.clone(), count)?;
        let blocks = || {
            let of = |tile: usize| self.tile(tile).map(|block| block.0);
            (0..tiles).filter_map(of).flatten().copied().collect()
        };
        let data = visit.some_values("blocks", tiles * BLOCK, blocks, |data| data.len() == there * BLOCK)?;
        let (Some(mask), Some(data)) = (mask, data) else { return Ok(()) };
        self.blocks(used(mask)).copy_from_slice(data);
        let mut next = 0;
        for (tile, mask) in mask.iter().enumerate() {
            self.set(tile, next, *mask);
            next += usize::from(*mask != 0);
        }
        Ok(())
    }
}

impl Scrolls for Memorizer {
    /// The oldest frame is not read again: each goes where the one before it was.
    fn scroll(&mut self, scroll: &Scroll<'_>) {
        if scroll.by == (0, 0) {
            return;
        }
        let frames = self.ring.len();
        for into in 0..frames - 1 {
            let into = (self.now + 1 + into) % frames;
            let from = (into + 1) % frames;
            let (head, tail) = self.ring.split_at_mut(into.max(from));
            let (from, into) = if from > into { (&tail[0], &mut head[into]) } else { (&head[from], &mut tail[0]) };
            into.take_moved(&self.grid, from, scroll.by);
        }
        self.now = (self.now + frames - 1) % frames;
    }
}

impl Heap for Gains {
    fn heap(&self) -> Memory {
        let bytes = |floats: usize| floats * size_of::<f32>();
        let data = Memory { bound: self.data.heap().bound, resident: bytes(self.touched * BLOCK) };
        self.block.heap() + self.mask.heap() + data
    }
}

/// One tile that has predictions.
#[derive(Clone, Copy)]
pub(crate) struct Block<'a>(&'a [f32]);

impl<'a> Block<'a> {
    pub fn f(self, direction: usize) -> &'a [f32] {
        &self.0[direction * TILE_AREA..(direction + 1) * TILE_AREA]
    }

    pub fn m(self) -> &'a [f32] {
        self.f(DIRECTIONS)
    }
}

impl Gains {
    fn new(tiles: usize) -> Self {
        Self {
            block: vec![ABSENT; tiles],
            mask: vec![0; tiles],
            data: Buffer::zeros(tiles * BLOCK),
            peak: 0.0,
            touched: 0,
        }
    }

    pub fn clear(&mut self) {
        self.block.fill(ABSENT);
        self.mask.fill(0);
        self.peak = 0.0;
    }

    /// The first `count` blocks, to be written.
    pub fn blocks(&mut self, count: usize) -> &mut [f32] {
        self.touched = self.touched.max(count);
        &mut self.data[..count * BLOCK]
    }

    /// Names the block that holds a tile.
    pub fn set(&mut self, tile: usize, block: usize, mask: u8) {
        self.block[tile] = if mask == 0 { ABSENT } else { block as u32 };
        self.mask[tile] = mask;
    }

    /// Becomes what another frame remembers, moved by whole pixels.
    fn take_moved(&mut self, grid: &Grid, from: &Self, by: (isize, isize)) {
        self.clear();
        self.peak = from.peak;
        let mut blocks = 0;
        for tile in 0..grid.count() {
            let (Some(block), Some(moved)) = (from.tile(tile), grid.moved(tile, by)) else { continue };
            for target in grid.touching(&moved) {
                if self.block[target] == ABSENT {
                    self.blocks(blocks + 1)[blocks * BLOCK..].fill(0.0);
                    self.block[target] = blocks as u32;
                    blocks += 1;
                }
                self.mask[target] |= from.mask[tile];
                let (here, there) = (grid.area(target), grid.area(tile));
                let (first, last) = (here.left.max(moved.left), here.across().end.min(moved.across().end));
                let source = first.wrapping_add_signed(-by.0) - there.left;
                let into = &mut self.data[self.block[target] as usize * BLOCK..][..BLOCK];
                for y in here.top.max(moved.top)..here.down().end.min(moved.down().end) {
                    let row = (y.wrapping_add_signed(-by.1) - there.top) * TILE + source;
                    let into_row = (y - here.top) * TILE + first - here.left;
                    for (into, from) in into.chunks_exact_mut(TILE_AREA).zip(block.0.chunks_exact(TILE_AREA)) {
                        into[into_row..into_row + last - first].copy_from_slice(&from[row..row + last - first]);
                    }
                }
            }
        }
    }

    pub fn tile(&self, tile: usize) -> Option<Block<'_>> {
        let block = self.block[tile];
        (block != ABSENT).then(|| Block(&self.data[block as usize * BLOCK..(block as usize + 1) * BLOCK]))
    }

    /// Copies map `k` (a direction, or `DIRECTIONS` for M) into whole-picture coordinates.
    pub fn copy_map(&self, grid: &Grid, k: usize, mut into: ndarray::ArrayViewMut2<'_, f32>) {
        for tile in 0..grid.count() {
            if let Some(block) = self.tile(tile) {
                let Area { top, left, rows, columns } = grid.area(tile);
                for y in 0..rows {
                    for x in 0..columns {
                        into[[top + y, left + x]] = block.f(k)[y * TILE + x];
                    }
                }
            }
        }
    }
}

pub(crate) struct Memorizer {
    pub grid: Grid,
    ring: Vec<Gains>,
    /// Place of the present frame.
    now: usize,
}

impl Memorizer {
    pub fn new(size: Size, horizon: usize) -> Self {
        let grid = Grid::new(size);
        Self { grid, ring: (0..=horizon).map(|_| Gains::new(grid.count())).collect(), now: 0 }
    }

    /// Begins a frame: the oldest frame is forgotten, its place becomes the present.
    pub fn advance(&mut self) {
        self.now = (self.now + 1) % self.ring.len();
        self.ring[self.now].clear();
    }

    /// F and M of `frames` ago; 0 is the present, dt the oldest.
    pub fn ago(&self, frames: usize) -> &Gains {
        &self.ring[(self.now + self.ring.len() - frames) % self.ring.len()]
    }

    /// F and M of dt frames ago, to read, and of the present, to write.
    pub fn oldest_and_present(&mut self) -> (&Gains, &mut Gains) {
        let oldest = (self.now + 1) % self.ring.len();
        let (low, high) = (oldest.min(self.now), oldest.max(self.now));
        let (head, tail) = self.ring.split_at_mut(high);
        if self.now == high { (&head[low], &mut tail[0]) } else { (&tail[0], &mut head[low]) }
    }

    pub fn horizon(&self) -> usize {
        self.ring.len() - 1
    }

    pub fn reset(&mut self) {
        self.ring.iter_mut().for_each(Gains::clear);
        self.now = 0;
    }
}
