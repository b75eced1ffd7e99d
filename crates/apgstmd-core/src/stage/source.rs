//! What prediction spreads: mu E' + (1 - mu) F(t - dt), 8 directions.
//!
//! Input: E' and the memorizer's F(t - dt). Output: maps with a halo of zeros, and by tile what is not zero in them. Kept
//! from frame to frame: the maps, so that only tiles that hold something, or did, are written.

use std::ops::Range;

use crate::DIRECTIONS;
use crate::memory::heap;
use crate::plane::{Buffer, Plane, padded};
use crate::row::bands::{Bands, Rows};
use crate::row::tile::mix_tile;
use crate::stage::memorizer::Gains;
use crate::tiles::{Grid, PerTile, TILE};

pub(crate) struct Source {
    mu: f32,
    /// Rows above and below the picture; columns left and right of it are whole vectors.
    radius: usize,
    halo: usize,
    stride: usize,
    grid: Grid,
    maps: [Buffer; DIRECTIONS],
    /// Directions of E' that are not zero, by tile.
    pub fresh: Vec<u8>,
    tiles: Vec<Tile>,
}

/// What a tile of the source holds.
#[derive(Clone, Copy, Default)]
struct Tile {
    /// Directions that are not zero.
    mask: u8,
    /// Sums over its quarters, row by row, in each direction.
    sums: [[f32; DIRECTIONS]; 4],
    /// Bit x: column x of this row of the tile is not zero.
    columns: [[u16; TILE]; DIRECTIONS],
}

heap!(Tile);
heap!(Source { maps, fresh, tiles });

impl Source {
    pub fn new(grid: &Grid, mu: f32, radius: usize) -> Self {
        let halo = padded(radius);
        let stride = grid.across * TILE + 2 * halo;
        let rows = grid.down * TILE + 2 * radius;
        Self {
            mu,
            radius,
            halo,
            stride,
            grid: *grid,
            maps: std::array::from_fn(|_| Buffer::zeros(rows * stride)),
            fresh: vec![0; grid.count()],
            tiles: vec![Tile::default(); grid.count()],
        }
    }

    /// Takes E', zero but for the tiles `near`, and, where there is prediction, F(t - dt).
    pub fn gather(&mut self, bands: &Bands, kept: &[Plane; DIRECTIONS], near: &[bool], past: Option<&Gains>) {
        let Self { mu, radius, halo, stride, grid, maps, fresh, tiles } = self;
        let (mu, halo, stride, grid) = (*mu, *halo, *stride, *grid);
        let rows = grid.down * TILE;
        let inside = *radius * stride..(*radius + rows) * stride;
        let maps = maps.each_mut().map(|map| Rows { data: &mut map[inside.clone()], stride });
        let across = grid.across;
        let tiles = (PerTile { values: fresh, across }, PerTile { values: tiles, across });
        bands.over_tiles(rows, (maps, tiles), |range, (maps, (fresh, tiles))| {
            for (column, (fresh, tile)) in fresh.values.iter_mut().zip(tiles.values).enumerate() {
                let index = grid.holding(column * TILE, range.start);
                *fresh = if near[index] { directions_present(kept, &grid, index) } else { 0 };
                let Some(past) = past else { continue };
                let mask = *fresh | past.mask[index];
                let area = grid.area(index);
                for k in (0..DIRECTIONS).filter(|k| (mask | tile.mask) >> k & 1 == 1) {
                    let block = past.tile(index).filter(|_| past.mask[index] >> k & 1 == 1);
                    // E' of the tile, zero outside the picture.
                    let mut e = [0.0; TILE * TILE];
                    if *fresh >> k & 1 == 1 {
                        for (y, e) in e.chunks_exact_mut(TILE).enumerate().take(area.rows) {
                            e[..area.columns]
                                .copy_from_slice(&kept[k].row(area.top + y)[area.left..area.left + area.columns]);
                        }
                    }
                    let f = block.map_or(&[0.0; TILE * TILE][..], |block| block.f(k));
                    let out = &mut maps[k].data[halo + area.left..];
                    let sums;
                    (tile.columns[k], sums) = mix_tile(bands.level(), [mu, 1.0 - mu], [&e, f], out, stride);
                    for (quarter, sum) in tile.sums.iter_mut().zip(sums) {
                        quarter[k] = sum;
                    }
                }
                tile.mask = mask;
            }
        });
    }

    /// Whether anything lies within the radius of a tile.
    pub fn anything_around(&self, tile: usize) -> bool {
        self.grid.around(tile, self.radius).any(|near| self.tiles[near].mask != 0)
    }

    /// Sums over the quarter of a tile in (row, column) of quarters, in each direction; none outside the picture.
    pub fn quarter(&self, row: isize, column: isize) -> Option<&[f32; DIRECTIONS]> {
        let inside =
            (0..2 * self.grid.down as isize).contains(&row) && (0..2 * self.grid.across as isize).contains(&column);
        inside.then(|| {
            let (row, column) = (row as usize, column as usize);
            &self.tiles[row / 2 * self.grid.across + column / 2].sums[row % 2 * 2 + column % 2]
        })
    }

    /// The largest sum over a quarter of a tile, all directions together.
    pub fn largest_sum(&self) -> f32 {
        let quarters = self.tiles.iter().filter(|tile| tile.mask != 0).flat_map(|tile| &tile.sums);
        quarters.map(|sums| sums.iter().sum()).fold(0.0, f32::max)
    }

    /// A map from `radius` rows above and columns left of a tile on, and its stride.
    pub fn window(&self, tile: usize, k: usize) -> (&[f32], usize) {
        let area = self.grid.area(tile);
        let at = area.top * self.stride + self.halo + area.left - self.radius;
        (&self.maps[k][at..], self.stride)
    }

    /// Row by row of this window, the columns outside which it is zero, counted from its left edge.
    pub fn spans(&self, tile: usize, k: usize, spans: &mut [Range<usize>]) {
        let area = self.grid.area(tile);
        let side = TILE + 2 * self.radius;
        let (left, top) = (area.left as isize - self.radius as isize, area.top as isize - self.radius as isize);
        spans.fill(side..0);
        for near in self.grid.around(tile, self.radius) {
            let held = &self.tiles[near];
            if held.mask >> k & 1 == 0 {
                continue;
            }
            let area = self.grid.area(near);
            let (right, down) = (area.left as isize - left, area.top as isize - top);
            let rows =
                (-down).clamp(0, TILE as isize) as usize..(side as isize - down).clamp(0, TILE as isize) as usize;
            for y in rows {
                let columns = held.columns[k][y];
                if columns != 0 {
                    let span = &mut spans[(down + y as isize) as usize];
                    let first = (right + columns.trailing_zeros() as isize).max(0) as usize;
                    let last = (right + 16 - columns.leading_zeros() as isize).clamp(0, side as isize) as usize;
                    *span = span.start.min(first)..span.end.max(last);
                }
            }
        }
    }

    pub fn reset(&mut self) {
        self.maps.iter_mut().for_each(|map| map.fill(0.0));
        self.fresh.fill(0);
        self.tiles.fill(Tile::default());
    }
}

/// Which directions of E' are not zero in a tile, as bits.
fn directions_present(kept: &[Plane; DIRECTIONS], grid: &Grid, tile: usize) -> u8 {
    let area = grid.area(tile);
    let mut mask = 0;
    for (k, plane) in kept.iter().enumerate() {
        let mut any = 0;
        for y in area.top..area.top + area.rows {
            let row = &plane.row(y)[area.left..area.left + area.columns];
            // Whole rows are of a length that the compiler knows.
            any |= match <&[f32; TILE]>::try_from(row) {
                Ok(row) => row.iter().fold(0, |any, value| any | value.to_bits()),
                Err(_) => row.iter().fold(0, |any, value| any | value.to_bits()),
            };
        }
        mask |= u8::from(any != 0) << k;
    }
    mask
}
