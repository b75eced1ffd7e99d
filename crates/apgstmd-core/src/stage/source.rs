//! What prediction spreads: mu E' + (1 - mu) F(t - dt), 8 directions.
//!
//! Input: E' and the memorizer's F(t - dt). Output: maps with a halo of zeros, and by tile what is not zero in them. Kept
//! from frame to frame: the maps, so that only tiles that hold something, or did, are written.

use std::ops::Range;

use fearless_simd::Level;

use crate::DIRECTIONS;
use crate::memory::heap;
use crate::plane::{Buffer, Plane, padded};
use crate::row::bands::{Bands, Rows, Table};
use crate::row::tile::{PATCHES, TileRows, anything, mix_tile};
use crate::stage::memorizer::Gains;
use crate::tiles::{Area, Grid, PerTile, TILE};

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
    /// Bit x: column x of a tile is not zero in this row; tile by tile along the rows of each direction.
    occupied: [Vec<u16>; DIRECTIONS],
}

/// What a tile of the source holds.
#[derive(Clone, Copy, Default)]
struct Tile {
    /// Directions that are not zero.
    mask: u8,
    /// Sums over its patches, row by row, in each direction.
    patches: [[f32; DIRECTIONS]; PATCHES * PATCHES],
}

heap!(Tile);
heap!(Source { maps, fresh, tiles, occupied });

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
            occupied: std::array::from_fn(|_| vec![0; grid.count() * TILE]),
        }
    }

    /// Takes E', zero but for the tiles `near`, and, where there is prediction, F(t - dt).
    pub fn gather(&mut self, bands: &Bands, kept: &[Plane; DIRECTIONS], near: &[bool], past: Option<&Gains>) {
        let Self { mu, radius, halo, stride, grid, maps, fresh, tiles, occupied } = self;
        let (mu, halo, stride, grid) = (*mu, *halo, *stride, *grid);
        let rows = grid.down * TILE;
        let inside = *radius * stride..(*radius + rows) * stride;
        let maps = maps.each_mut().map(|map| Rows { data: &mut map[inside.clone()], stride });
        let across = grid.across;
        let tiles = (PerTile { values: fresh, across }, PerTile { values: tiles, across });
        let occupied = occupied.each_mut().map(|values| Table { values, stride: across });
        bands.over_tiles(rows, ((maps, occupied), tiles), |range, ((maps, occupied), (fresh, tiles))| {
            let mut edge = [0.0; TILE * TILE];
            for (column, (fresh, tile)) in fresh.values.iter_mut().zip(tiles.values).enumerate() {
                let index = grid.holding(column * TILE, range.start);
                *fresh = if near[index] { directions_present(bands.level(), kept, &grid, index) } else { 0 };
                let Some(past) = past else { continue };
                let mask = *fresh | past.mask[index];
                let area = grid.area(index);
                for k in (0..DIRECTIONS).filter(|k| (mask | tile.mask) >> k & 1 == 1) {
                    let block = past.tile(index).filter(|_| past.mask[index] >> k & 1 == 1);
                    let e = (*fresh >> k & 1 == 1).then(|| tile_rows(&kept[k], &area, &mut edge));
                    let out = &mut maps[k].data[halo + area.left..];
                    let f = block.map(|block| block.f(k));
                    let (columns, patches) = mix_tile(bands.level(), [mu, 1.0 - mu], (e, f), out, stride);
                    for (y, columns) in columns.into_iter().enumerate() {
                        occupied[k].values[y * across + column] = columns;
                    }
                    tile.patches.iter_mut().zip(patches).for_each(|(patch, sum)| patch[k] = sum);
                }
                tile.mask = mask;
            }
        });
    }

    /// Whether anything lies within the radius of a tile.
    pub fn anything_around(&self, tile: usize) -> bool {
        self.grid.around(tile, self.radius).any(|near| self.tiles[near].mask != 0)
    }

    /// Sums over the patch in (row, column) of patches, in each direction; none outside the picture.
    pub fn patch(&self, row: isize, column: isize) -> Option<&[f32; DIRECTIONS]> {
        let (row, column) = (usize::try_from(row).ok()?, usize::try_from(column).ok()?);
        let inside = row < PATCHES * self.grid.down && column < PATCHES * self.grid.across;
        inside.then(|| {
            let tile = &self.tiles[row / PATCHES * self.grid.across + column / PATCHES];
            &tile.patches[row % PATCHES * PATCHES + column % PATCHES]
        })
    }

    /// The largest sum over a quarter of a tile, all directions together.
    pub fn largest_sum(&self) -> f32 {
        let quarter = |tile: &Tile, first: usize| {
            let patches = [0, 1, PATCHES, PATCHES + 1].map(|next| &tile.patches[first + next]);
            patches.into_iter().flatten().sum::<f32>()
        };
        let firsts = [0, 2, 2 * PATCHES, 2 * PATCHES + 2];
        let quarters = |tile: &Tile| firsts.map(|first| quarter(tile, first)).into_iter().fold(0.0, f32::max);
        self.tiles.iter().filter(|tile| tile.mask != 0).map(quarters).fold(0.0, f32::max)
    }

    /// A map from `radius` rows above and columns left of a tile on, and its stride.
    pub fn window(&self, tile: usize, k: usize) -> (&[f32], usize) {
        let area = self.grid.area(tile);
        let at = area.top * self.stride + self.halo + area.left - self.radius;
        (&self.maps[k][at..], self.stride)
    }

    /// Row by row of this window, the columns outside which it is zero, counted from its left edge.
    pub fn spans(&self, tile: usize, k: usize, spans: &mut [Range<usize>]) {
        let Grid { across, down, .. } = self.grid;
        let area = self.grid.area(tile);
        let side = TILE + 2 * self.radius;
        let (left, top) = (area.left as isize - self.radius as isize, area.top as isize - self.radius as isize);
        let (first, last) = (left.max(0) as usize / TILE, ((left + side as isize - 1) as usize / TILE).min(across - 1));
        for (y, span) in spans.iter_mut().enumerate() {
            *span = side..0;
            let y = top + y as isize;
            if y < 0 || y as usize >= down * TILE {
                continue;
            }
            let row = y as usize * across;
            let tiles = &self.occupied[k][row + first..=row + last];
            let Some(one) = tiles.iter().position(|columns| *columns != 0) else { continue };
            let other = tiles.iter().rposition(|columns| *columns != 0).unwrap_or(one);
            let column = |tile: usize| ((first + tile) * TILE) as isize - left;
            let start = column(one) + tiles[one].trailing_zeros() as isize;
            let end = column(other) + TILE as isize - tiles[other].leading_zeros() as isize;
            *span = start.max(0) as usize..end.clamp(0, side as isize) as usize;
        }
    }

    pub fn reset(&mut self) {
        self.maps.iter_mut().for_each(|map| map.fill(0.0));
        self.fresh.fill(0);
        self.tiles.fill(Tile::default());
        self.occupied.iter_mut().for_each(|rows| rows.fill(0));
    }
}

/// Which directions of E' are not zero in a tile, as bits.
fn directions_present(level: Level, kept: &[Plane; DIRECTIONS], grid: &Grid, tile: usize) -> u8 {
    let area = grid.area(tile);
    let mut edge = [0.0; TILE * TILE];
    let present = |(k, plane)| u8::from(anything(level, tile_rows(plane, &area, &mut edge))) << k;
    kept.iter().enumerate().map(present).fold(0, |mask, bit| mask | bit)
}

/// A tile of a map. Where the picture ends inside it, the padding, which holds anything, is left out on the way by `edge`.
fn tile_rows<'a>(plane: &'a Plane, area: &Area, edge: &'a mut [f32; TILE * TILE]) -> TileRows<'a> {
    let Area { top, left, rows, columns } = *area;
    if columns == TILE {
        return TileRows { data: &plane.data()[top * plane.stride() + left..], stride: plane.stride(), rows };
    }
    for (y, edge) in edge.chunks_exact_mut(TILE).enumerate().take(rows) {
        edge[..columns].copy_from_slice(&plane.row(top + y)[left..left + columns]);
    }
    TileRows { data: edge, stride: TILE, rows }
}
