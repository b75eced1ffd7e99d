//! Peaks of a map: maxima of their square neighbourhood.

use crate::memory::heap;
use crate::plane::Plane;

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
pub(crate) fn most(size: crate::frame::Size, radius: usize) -> usize {
    size.height.div_ceil(radius + 1) * size.width.div_ceil(radius + 1)
}

/// The `count` strongest values above `threshold` that no value within `radius` exceeds, strongest first. Of equal
/// values the first in reading order is the peak. `peaks` must have room for [`most`].
pub(crate) fn find(map: &Plane, radius: usize, threshold: f32, count: usize, peaks: &mut Vec<Peak>) {
    let size = map.size();
    let threshold = threshold.max(0.0);
    peaks.clear();
    // A peak is the maximum of its square of radius + 1, so only those are looked at (Neubeck & Van Gool, 2006).
    for top in (0..size.height).step_by(radius + 1) {
        let bottom = (top + radius + 1).min(size.height);
        // Rows in which nothing exceeds the threshold, of which there may be many, cost one look.
        if !(top..bottom).any(|y| map.row(y).iter().fold(false, |any, value| any | (*value > threshold))) {
            continue;
        }
        for left in (0..size.width).step_by(radius + 1) {
            let right = (left + radius + 1).min(size.width);
            let mut best = (threshold, 0, 0);
            for y in top..bottom {
                for (x, &value) in map.row(y)[left..right].iter().enumerate() {
                    if value > best.0 {
                        best = (value, left + x, y);
                    }
                }
            }
            let (value, x, y) = best;
            if value > threshold && is_peak(map, x, y, radius) {
                let row = map.row(y);
                let column = |y: usize| map.row(y)[x];
                let sub_x = if x > 0 && x + 1 < size.width { vertex(row[x - 1], value, row[x + 1]) } else { 0.0 };
                let sub_y =
                    if y > 0 && y + 1 < size.height { vertex(column(y - 1), value, column(y + 1)) } else { 0.0 };
                peaks.push(Peak { x, y, value, sub_x: x as f32 + sub_x, sub_y: y as f32 + sub_y });
            }
        }
    }
    peaks.sort_unstable_by(|a, b| b.value.total_cmp(&a.value).then((a.y, a.x).cmp(&(b.y, b.x))));
    peaks.truncate(count);
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
    use crate::frame::Size;

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
            let mut peaks = Vec::with_capacity(most(size, radius));
            find(&map, radius, 3.0, usize::MAX, &mut peaks);
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
        let mut peaks = Vec::new();
        find(&map, 5, 0.0, 1, &mut peaks);
        assert!((peaks[0].sub_x - 6.3).abs() < 1e-4 && (peaks[0].sub_y - 8.8).abs() < 1e-4);
    }
}
