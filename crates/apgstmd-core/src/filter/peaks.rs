//! Peaks of a map: maxima of their square neighbourhood.

use std::ops::Range;

use crate::frame::Size;
use crate::memory::heap;
use crate::plane::Plane;
use crate::region::Region;
use crate::row::bands::{Bands, Table};

/// A peak of the response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Peak {
    pub x: usize,
    pub y: usize,
    pub value: f32,
    /// Place of the maximum between the pixels, from a parabola along each axis.
    pub sub_x: f32,
    pub sub_y: f32,
}

heap!(Peak);

/// Most peaks a map can have: one in each square of radius + 1.
pub(crate) fn most(size: Size, radius: usize) -> usize {
    size.height.div_ceil(radius + 1) * size.width.div_ceil(radius + 1)
}

/// Finds the peaks of maps of one size.
pub(crate) struct PeakFinder {
    radius: usize,
    threshold: f32,
    count: usize,
    /// Squares of radius + 1 across the map.
    across: usize,
    /// Where peaks may lie, if not anywhere.
    pub region: Option<Region>,
    /// The largest value of each square above the threshold, else 0.
    squares: Vec<f32>,
    /// The squares that have one, not yet looked at.
    open: Vec<(f32, usize)>,
    /// The strongest ones, strongest first.
    pub peaks: Vec<Peak>,
}

heap!(PeakFinder { region, squares, open, peaks });

/// Rows of a band of squares.
const PEAK_ROWS: usize = 32;
/// Columns looked at together, at most.
const COLUMNS: usize = 256;

impl PeakFinder {
    /// For the `count` strongest values above `threshold` that no value within `radius` exceeds. Of equal values the
    /// first in reading order is the peak.
    pub fn new(size: Size, radius: usize, threshold: f32, count: usize) -> Self {
        let most = most(size, radius);
        let across = size.width.div_ceil(radius + 1);
        let (squares, open, peaks) = (vec![0.0; most], Vec::with_capacity(most), Vec::with_capacity(most));
        Self { radius, threshold: threshold.max(0.0), count, across, region: None, squares, open, peaks }
    }

    pub fn radius(&self) -> usize {
        self.radius
    }

    pub fn find(&mut self, bands: &Bands, map: &Plane) {
        let Self { radius, threshold, across, squares, .. } = self;
        let side = *radius + 1;
        let (size, down) = (map.size(), squares.len() / *across);
        let out = Table { values: squares, stride: *across };
        bands.over_long(down, PEAK_ROWS.div_ceil(side), out, |range, out| {
            for (squares, top) in out.values.chunks_exact_mut(out.stride).zip(range.map(|row| row * side)) {
                let rows = top..(top + side).min(size.height);
                let per = COLUMNS / side;
                for (squares, left) in squares.chunks_mut(per).zip((0..size.width).step_by(per * side)) {
                    // The largest of each column: most squares need no more than a look at these.
                    let mut most = [0.0f32; COLUMNS];
                    let most = &mut most[..(per * side).min(size.width - left)];
                    for y in rows.clone() {
                        let row = &map.row(y)[left..left + most.len()];
                        most.iter_mut().zip(row).for_each(|(most, value)| *most = most.max(*value));
                    }
                    for (square, most) in squares.iter_mut().zip(most.chunks(side)) {
                        let value = most.iter().copied().fold(0.0, f32::max);
                        *square = if value > *threshold { value } else { 0.0 };
                    }
                }
            }
        });
        self.take_strongest(map);
    }

    /// Looks at the squares from the largest value on until there are enough peaks.
    fn take_strongest(&mut self, map: &Plane) {
        let Self { radius, count, across, region, squares, open, peaks, .. } = self;
        let (size, side) = (map.size(), *radius + 1);
        open.clear();
        open.extend(
            squares.iter().enumerate().filter(|(_, value)| **value > 0.0).map(|(square, value)| (*value, square)),
        );
        peaks.clear();
        let mut open = &mut open[..];
        while let Some(&(largest, _)) = open.iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
            // Equal values are all looked at: the first ones in reading order are kept.
            if peaks.len() >= *count && peaks.iter().filter(|peak: &&Peak| peak.value > largest).count() >= *count {
                break;
            }
            let next = count.saturating_mul(2).clamp(1, open.len());
            if next < open.len() {
                open.select_nth_unstable_by(next, |a, b| b.0.total_cmp(&a.0));
            }
            let (head, tail) = open.split_at_mut(next);
            peaks.extend(head.iter().filter_map(|&(value, square)| {
                let (top, left) = (square / *across * side, square % *across * side);
                let columns = left..(left + side).min(size.width);
                peak_of(map, top..(top + side).min(size.height), columns, *radius, value)
                    .filter(|peak| region.as_ref().is_none_or(|region| region.at(peak.x, peak.y)))
            }));
            open = tail;
        }
        peaks.sort_unstable_by(|a, b| b.value.total_cmp(&a.value).then((a.y, a.x).cmp(&(b.y, b.x))));
        peaks.truncate(*count);
    }
}

/// The peak in a square of radius + 1, if there is one: a peak is the maximum of its square, so only the first place of
/// that is looked at (Neubeck & Van Gool, 2006).
fn peak_of(map: &Plane, rows: Range<usize>, columns: Range<usize>, radius: usize, value: f32) -> Option<Peak> {
    let Size { height, width } = map.size();
    let place =
        |y: usize| map.row(y)[columns.clone()].iter().position(|other| *other == value).map(|x| (columns.start + x, y));
    let (x, y) = rows.into_iter().find_map(place)?;
    is_peak(map, x, y, radius).then(|| {
        let (row, column) = (map.row(y), |y: usize| map.row(y)[x]);
        let sub_x = if x > 0 && x + 1 < width { vertex(row[x - 1], value, row[x + 1]) } else { 0.0 };
        let sub_y = if y > 0 && y + 1 < height { vertex(column(y - 1), value, column(y + 1)) } else { 0.0 };
        Peak { x, y, value, sub_x: x as f32 + sub_x, sub_y: y as f32 + sub_y }
    })
}

fn is_peak(map: &Plane, x: usize, y: usize, radius: usize) -> bool {
    let value = map.row(y)[x];
    let (left, right) = (x.saturating_sub(radius), (x + radius + 1).min(map.size().width));
    (y.saturating_sub(radius)..(y + radius + 1).min(map.size().height)).all(|row| {
        map.row(row)[left..right].iter().enumerate().all(|(column, &other)| {
            let earlier = (row, left + column) < (y, x);
            other < value || (other == value && !earlier)
        })
    })
}

/// Where the parabola through three values, the middle one largest, has its vertex: -0.5..0.5.
fn vertex(before: f32, middle: f32, after: f32) -> f32 {
    let bend = before - 2.0 * middle + after;
    if bend < 0.0 { ((before - after) / (2.0 * bend)).clamp(-0.5, 0.5) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_by_definition() {
        let size = Size::new(23, 31);
        let mut map = Plane::new(size);
        let mut seed = 7u32;
        for y in 0..size.height {
            map.row_mut(y).iter_mut().for_each(|value| {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                // Few levels: many ties.
                *value = (seed >> 28) as f32;
            });
        }
        for radius in [1, 2, 5] {
            let mut finder = PeakFinder::new(size, radius, 3.0, usize::MAX);
            finder.find(&Bands::single(), &map);
            let peaks = &finder.peaks;
            let mut expected: Vec<(usize, usize)> = (0..size.height)
                .flat_map(|y| (0..size.width).map(move |x| (y, x)))
                .filter(|&(y, x)| map.row(y)[x] > 3.0 && is_peak(&map, x, y, radius))
                .collect();
            let mut found: Vec<_> = peaks.iter().map(|peak| (peak.y, peak.x)).collect();
            assert!(peaks.is_sorted_by(|a, b| a.value >= b.value));
            expected.sort_unstable();
            found.sort_unstable();
            assert_eq!(found, expected);
            assert!(peaks.len() <= most(size, radius));
        }
    }

    #[test]
    fn between_pixels() {
        let mut map = Plane::new(Size::new(16, 16));
        for y in 0..16 {
            for x in 0..16 {
                map.row_mut(y)[x] = 100.0 - (x as f32 - 6.3).powi(2) - (y as f32 - 8.8).powi(2);
            }
        }
        let mut finder = PeakFinder::new(map.size(), 5, 0.0, 1);
        finder.find(&Bands::single(), &map);
        let peaks = &finder.peaks;
        assert!((peaks[0].sub_x - 6.3).abs() < 1e-4 && (peaks[0].sub_y - 8.8).abs() < 1e-4);
    }
}
