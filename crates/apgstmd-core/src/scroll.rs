//! What is remembered of places, moved along with the world that a detector looks at.
//!
//! A camera that pans moves everything through the filters of a detector, which answer to whatever moves. A detector whose memory
//! moves along answers to what moves in the world only.

use std::ops::Range;

use crate::frame::Size;
use crate::plane::{LANES, Plane, Series};
use crate::tiles::Area;

/// A movement of all that is remembered, before the next frame.
pub(crate) struct Scroll<'a> {
    /// Whole pixels to the right and down.
    pub by: (isize, isize),
    /// P of the next frame.
    pub p: &'a Plane,
    /// What of it was seen before, as it lies now, and what has been seen now. What was not has been so ever since.
    pub before: Area,
    pub seen: Area,
}

impl<'a> Scroll<'a> {
    /// Nothing moves.
    #[cfg(test)]
    pub fn none(p: &'a Plane) -> Self {
        let whole = Area::whole(p.size());
        Self { by: (0, 0), p, before: whole, seen: whole }
    }

    /// Whether nothing moves, and nothing is seen for the first time.
    pub fn is_none(&self) -> bool {
        self.by == (0, 0) && self.before == self.seen
    }
}

pub(crate) trait Scrolls {
    /// Moves it. Where nothing is remembered of a place, the filters are at rest.
    fn scroll(&mut self, scroll: &Scroll<'_>);
}

/// Types that remember places through the fields named.
macro_rules! scrolls {
    ($name:ident { $($field:ident),* }) => {
        impl $crate::scroll::Scrolls for $name {
            fn scroll(&mut self, scroll: &$crate::scroll::Scroll<'_>) {
                $($crate::scroll::Scrolls::scroll(&mut self.$field, scroll);)*
            }
        }
    };
}
pub(crate) use scrolls;

/// Of `length` places those that come in when all move by so many.
pub(crate) fn came_in(by: isize, length: usize) -> Range<usize> {
    let count = by.unsigned_abs().min(length);
    if by < 0 { length - count..length } else { 0..count }
}

/// Moves `maps` maps by whole pixels; zero comes in. In each row lie `LANES` columns of all of them, one map after the other, then the
/// next columns, as [`crate::row::recurse::cascade`] has its states; of one map that is a plane.
pub(crate) fn scroll_maps(data: &mut [f32], size: Size, maps: usize, by: (isize, isize)) {
    let Size { height, width } = size;
    let ((right, down), blocks) = (by, width.div_ceil(LANES));
    let row = blocks * maps * LANES;
    if by == (0, 0) {
        return;
    }
    if right.unsigned_abs() >= width || down.unsigned_abs() >= height {
        data.fill(0.0);
        return;
    }
    let block = |y: usize, block: usize, map: usize| {
        let first = y * row + (block * maps + map) * LANES;
        first..first + LANES
    };
    let mut move_into = |y: usize| {
        let Some(from) = y.checked_add_signed(-down).filter(|from| *from < height) else {
            data[y * row..(y + 1) * row].fill(0.0);
            return;
        };
        let mut move_block = |into: usize| {
            let first = (into * LANES) as isize - right;
            let (left, within) = (first.div_euclid(LANES as isize), first.rem_euclid(LANES as isize) as usize);
            for map in 0..maps {
                let mut both = [0.0; 2 * LANES];
                for (part, index) in both.chunks_exact_mut(LANES).zip(left..) {
                    if let Some(index) = usize::try_from(index).ok().filter(|index| *index < blocks) {
                        part.copy_from_slice(&data[block(from, index, map)]);
                    }
                }
                data[block(y, into, map)].copy_from_slice(&both[within..within + LANES]);
            }
        };
        // What is still to be moved must not be written to, here and below.
        if right > 0 {
            (0..blocks).rev().for_each(&mut move_block)
        } else {
            (0..blocks).for_each(&mut move_block)
        }
        if right < 0 {
            // Behind the last column the padding came in.
            for x in came_in(right, width) {
                (0..maps).for_each(|map| data[block(y, x / LANES, map)][x % LANES] = 0.0);
            }
        }
    };
    if down > 0 { (0..height).rev().for_each(&mut move_into) } else { (0..height).for_each(&mut move_into) }
}

impl Plane {
    /// Moves; what comes in or is seen for the first time is `times` as much as of the next frame.
    pub fn scroll(&mut self, scroll: &Scroll<'_>, times: f32) {
        let Scroll { by, p, before, seen } = *scroll;
        let size = self.size();
        scroll_maps(self.data_mut(), size, 1, by);
        let (rows, columns) = (came_in(by.1, size.height), came_in(by.0, size.width));
        for y in 0..size.height {
            let (into, p) = (self.row_mut(y), p.row(y));
            let mut take = |columns: Range<usize>| {
                into[columns.clone()].iter_mut().zip(&p[columns]).for_each(|(into, p)| *into = times * p);
            };
            if rows.contains(&y) {
                take(0..size.width);
                continue;
            }
            take(columns.clone());
            if seen.down().contains(&y) {
                let known = if before.down().contains(&y) { before.across() } else { 0..0 };
                let Range { start, end } = seen.across();
                take(start..known.start.clamp(start, end));
                take(known.end.clamp(start, end)..end);
            }
        }
    }
}

impl Scrolls for Series {
    /// The last frame, which comes before the next ones.
    fn scroll(&mut self, scroll: &Scroll<'_>) {
        let last = self.maps_mut().last_mut().filter(|last| last.size() == scroll.p.size());
        if let Some(last) = last {
            last.scroll(scroll, 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Movements of three maps, beside the definition.
    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn maps_move_and_zero_comes_in() {
        let (size, maps) = (Size::new(5, 37), 3);
        let value = |map: usize, y: usize, x: usize| (1 + map * 1000 + y * 100 + x) as f32;
        let place = |map: usize, y: usize, x: usize| ((y * 3 + x / LANES) * maps + map) * LANES + x % LANES;
        let each = || (0..maps * 5 * 37).map(|index| (index / 185, index / 37 % 5, index % 37));
        let mut movements = vec![(isize::MIN, isize::MAX), (37, 0), (0, -5)];
        movements.extend((-36..37).flat_map(|right| [-4, -1, 0, 2].map(|down| (right, down))));
        for by in movements {
            let mut data = vec![f32::MAX; 5 * 3 * LANES * maps];
            each().for_each(|(map, y, x)| data[place(map, y, x)] = value(map, y, x));
            scroll_maps(&mut data, size, maps, by);
            for (map, y, x) in each() {
                let from = (y as i128 - by.1 as i128, x as i128 - by.0 as i128);
                let inside = (0..5).contains(&from.0) && (0..37).contains(&from.1);
                let expected = if inside { value(map, from.0 as usize, from.1 as usize) } else { 0.0 };
                assert_eq!(data[place(map, y, x)], expected, "{by:?}: map {map}, ({y}, {x})");
            }
        }
    }

    #[test]
    fn what_is_seen_for_the_first_time_has_always_been_so() {
        let size = Size::new(4, 6);
        let (mut series, mut p) = (Series::new(size, 1), Plane::new(size));
        p.fill(2.0);
        series.fill(1.0);
        // Of what came in on the left and below, and what is seen besides, above and on the right.
        let before = Area { top: 1, left: 2, rows: 2, columns: 3 };
        let seen = Area { top: 0, left: 2, rows: 4, columns: 4 };
        series.scroll(&Scroll { by: (2, -1), p: &p, before, seen });
        let rows: Vec<&[f32]> = (0..4).map(|y| series.last().row(y)).collect();
        let known = [2.0, 2.0, 1.0, 1.0, 1.0, 2.0];
        assert_eq!(rows, [[2.0; 6], known, known, [2.0; 6]]);
        series.fill(1.0);
        assert!(Scroll::none(&p).is_none());
        series.scroll(&Scroll::none(&p));
        assert!(series.last().view().iter().all(|value| *value == 1.0));
    }
}
