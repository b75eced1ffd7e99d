//! The grid of square tiles on which attention and prediction are sparse.

use std::ops::Range;

use crate::frame::Size;
use crate::row::bands::Split;

/// Side of a tile, px: whole vectors of every instruction set, and fine enough to follow the outline of a prediction.
pub(crate) const TILE: usize = 16;

/// How a picture is cut into tiles, counted row by row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    size: Size,
    pub across: usize,
    pub down: usize,
}

/// The pixels of one tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Area {
    pub top: usize,
    pub left: usize,
    pub rows: usize,
    pub columns: usize,
}

impl Area {
    pub fn whole(size: Size) -> Self {
        Self { top: 0, left: 0, rows: size.height, columns: size.width }
    }

    /// Its rows.
    pub fn down(&self) -> Range<usize> {
        self.top..self.top + self.rows
    }

    /// Its columns.
    pub fn across(&self) -> Range<usize> {
        self.left..self.left + self.columns
    }

    /// What of it stays in the picture when it moves to the right and down.
    pub fn moved(&self, (right, down): (isize, isize), size: Size) -> Self {
        let side = |Range { start, end }: Range<usize>, by: isize, all: usize| {
            let place = |end: usize| (end as isize).saturating_add(by).clamp(0, all as isize) as usize;
            (place(start), place(end) - place(start))
        };
        let (top, rows) = side(self.down(), down, size.height);
        let (left, columns) = side(self.across(), right, size.width);
        Self { top, left, rows, columns }
    }

    /// The smallest that both lie in; nothing lies anywhere.
    pub fn with(&self, other: &Self) -> Self {
        if self.rows * self.columns == 0 {
            return *other;
        }
        if other.rows * other.columns == 0 {
            return *self;
        }
        let (top, left) = (self.top.min(other.top), self.left.min(other.left));
        let (bottom, right) = (self.down().end.max(other.down().end), self.across().end.max(other.across().end));
        Self { top, left, rows: bottom - top, columns: right - left }
    }
}

impl Grid {
    pub fn new(size: Size) -> Self {
        Self { size, across: size.width.div_ceil(TILE), down: size.height.div_ceil(TILE) }
    }

    pub fn count(&self) -> usize {
        self.across * self.down
    }

    pub fn area(&self, tile: usize) -> Area {
        let (top, left) = (tile / self.across * TILE, tile % self.across * TILE);
        Area { top, left, rows: TILE.min(self.size.height - top), columns: TILE.min(self.size.width - left) }
    }

    /// Where the pixels of a tile come to lie that stay in the picture when it moves to the right and down.
    pub fn moved(&self, tile: usize, by: (isize, isize)) -> Option<Area> {
        Some(self.area(tile).moved(by, self.size)).filter(|moved| moved.rows > 0 && moved.columns > 0)
    }

    /// The tile that holds pixel (x, y).
    pub fn holding(&self, x: usize, y: usize) -> usize {
        y / TILE * self.across + x / TILE
    }

    /// The tiles of which an area, which is not empty, has pixels.
    pub fn touching(&self, area: &Area) -> impl Iterator<Item = usize> + use<> {
        let (across, side) = (self.across, |first: usize, length: usize| first / TILE..(first + length).div_ceil(TILE));
        let columns = side(area.left, area.columns);
        side(area.top, area.rows).flat_map(move |row| columns.clone().map(move |column| row * across + column))
    }

    /// The tiles within `reach` pixels of a tile, itself among them.
    pub fn around(&self, tile: usize, reach: usize) -> impl Iterator<Item = usize> + use<> {
        let (row, column) = (tile / self.across, tile % self.across);
        let span = reach.div_ceil(TILE);
        let rows = row.saturating_sub(span)..=(row + span).min(self.down - 1);
        let (first, last, across) = (column.saturating_sub(span), (column + span).min(self.across - 1), self.across);
        rows.flat_map(move |row| (first..=last).map(move |column| row * across + column))
    }
}

/// Copies a row of a tile; a whole one in the fewest instructions.
#[inline]
pub(crate) fn copy_columns(from: &[f32], into: &mut [f32]) {
    match (<&[f32; TILE]>::try_from(from), <&mut [f32; TILE]>::try_from(&mut *into)) {
        (Ok(from), Ok(into)) => *into = *from,
        _ => into.copy_from_slice(from),
    }
}

/// One value a tile, cut with the rows of pixels where a band ends between two rows of tiles.
pub(crate) struct PerTile<'a, T> {
    pub values: &'a mut [T],
    pub across: usize,
}

impl<T: Send> Split for PerTile<'_, T> {
    fn split(self, rows: usize) -> (Self, Self) {
        debug_assert!(rows.is_multiple_of(TILE));
        let (head, tail) = self.values.split_at_mut(rows / TILE * self.across);
        (Self { values: head, across: self.across }, Self { values: tail, across: self.across })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_cover_the_picture_once() {
        for size in [Size::new(16, 16), Size::new(33, 95), Size::new(64, 64)] {
            let grid = Grid::new(size);
            let mut seen = vec![0; size.area()];
            for tile in 0..grid.count() {
                let Area { top, left, rows, columns } = grid.area(tile);
                for y in top..top + rows {
                    for x in left..left + columns {
                        seen[y * size.width + x] += 1;
                        assert_eq!(grid.holding(x, y), tile);
                    }
                }
            }
            assert!(seen.iter().all(|times| *times == 1));
        }
    }

    #[test]
    fn touching_is_what_an_area_has_pixels_of() {
        let grid = Grid::new(Size::new(5 * TILE, 5 * TILE));
        let area = |top, left, rows, columns| Area { top, left, rows, columns };
        assert_eq!(grid.touching(&area(TILE - 1, TILE, 2, TILE)).collect::<Vec<_>>(), [1, 6]);
        assert_eq!(grid.touching(&area(0, 3, TILE, TILE - 2)).collect::<Vec<_>>(), [0, 1]);
    }

    #[test]
    fn around_reaches_far_enough_and_stops_at_the_edge() {
        let grid = Grid::new(Size::new(5 * TILE, 5 * TILE));
        assert_eq!(grid.around(0, TILE - 3).collect::<Vec<_>>(), [0, 1, 5, 6]);
        assert_eq!(grid.around(12, TILE + 1).count(), 25);
        assert_eq!(grid.around(12, 0).collect::<Vec<_>>(), [12]);
    }
}
