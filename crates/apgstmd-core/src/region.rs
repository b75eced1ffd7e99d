//! Where in the picture targets are looked for.

use std::ops::Range;

use ndarray::ArrayView2;
use thiserror::Error;

use crate::frame::Size;
use crate::memory::heap;

/// A rectangle of pixels: columns `x..x + width` of rows `y..y + height`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rectangle {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// Pixels in which targets are looked for. Nothing is reported outside, and what is far outside is not computed.
///
/// ```
/// use apgstmd_core::{Rectangle, Region, Size};
///
/// let sky = Rectangle { x: 0, y: 0, width: 640, height: 200 };
/// let region = Region::from_rectangles(Size::new(480, 640), &[sky])?;
/// assert!(region.contains(639.0, 199.4) && !region.contains(10.0, 200.0));
/// # Ok::<(), apgstmd_core::RegionError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Region {
    size: Size,
    inside: Vec<bool>,
}

heap!(Region { inside });

/// A region that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum RegionError {
    /// Nothing is inside.
    #[error("nothing of the picture, {size} (height x width), is inside the region")]
    Empty {
        /// Size of the picture.
        size: Size,
    },
    /// A rectangle beside the picture.
    #[error(
        "the rectangle of {} x {} px at column {}, row {} has nothing of the picture, {size} (height x width)",
        .rectangle.width, .rectangle.height, .rectangle.x, .rectangle.y
    )]
    Beside {
        /// The rectangle.
        rectangle: Rectangle,
        /// Size of the picture.
        size: Size,
    },
    /// Of another size than the frames.
    #[error("the region is {given} (height x width), but frames are {expected}")]
    Size {
        /// Size of the region.
        given: Size,
        /// Size of the frames.
        expected: Size,
    },
}

impl Region {
    /// The pixels that are `true` in a mask, (rows, columns).
    ///
    /// # Errors
    /// No pixel is `true`.
    pub fn from_mask(mask: ArrayView2<'_, bool>) -> Result<Self, RegionError> {
        let (height, width) = mask.dim();
        Self::new(Size::new(height, width), mask.iter().copied().collect())
    }

    /// All pixels of some rectangles, as far as they lie in a picture of `size`.
    ///
    /// # Errors
    /// One has nothing of the picture.
    pub fn from_rectangles(size: Size, rectangles: &[Rectangle]) -> Result<Self, RegionError> {
        let mut inside = vec![false; size.area()];
        for &rectangle in rectangles {
            let Rectangle { x, y, width, height } = rectangle;
            let columns = x.min(size.width)..x.saturating_add(width).min(size.width);
            let rows = y.min(size.height)..y.saturating_add(height).min(size.height);
            if columns.is_empty() || rows.is_empty() {
                return Err(RegionError::Beside { rectangle, size });
            }
            for row in rows {
                inside[row * size.width..][columns.clone()].fill(true);
            }
        }
        Self::new(size, inside)
    }

    /// What lies in both.
    ///
    /// # Errors
    /// Nothing does; they are of different sizes.
    pub fn and(&self, other: &Self) -> Result<Self, RegionError> {
        if self.size != other.size {
            return Err(RegionError::Size { given: other.size, expected: self.size });
        }
        Self::new(self.size, self.inside.iter().zip(&other.inside).map(|(a, b)| *a && *b).collect())
    }

    fn new(size: Size, inside: Vec<bool>) -> Result<Self, RegionError> {
        if inside.contains(&true) { Ok(Self { size, inside }) } else { Err(RegionError::Empty { size }) }
    }

    /// Size of the picture.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Pixels inside.
    pub fn area(&self) -> usize {
        self.inside.iter().filter(|inside| **inside).count()
    }

    /// Whether the pixel nearest to a place is inside; of places beside the picture, too.
    pub fn contains(&self, x: f32, y: f32) -> bool {
        let nearest = |place: f32, side: usize| place.round().clamp(0.0, side as f32 - 1.0) as usize;
        x.is_finite() && y.is_finite() && self.at(nearest(x, self.size.width), nearest(y, self.size.height))
    }

    pub(crate) fn at(&self, x: usize, y: usize) -> bool {
        self.inside[y * self.size.width + x]
    }

    /// With all that lies within `radius` pixels along both axes.
    pub(crate) fn dilated(&self, radius: usize) -> Self {
        let Size { height, width } = self.size;
        let mut across = vec![false; height * width];
        for (row, out) in self.inside.chunks_exact(width).zip(across.chunks_exact_mut(width)) {
            spread(row, radius, out);
        }
        let mut inside = vec![false; height * width];
        let (mut column, mut out) = (vec![false; height], vec![false; height]);
        for x in 0..width {
            (0..height).for_each(|y| column[y] = across[y * width + x]);
            spread(&column, radius, &mut out);
            (0..height).for_each(|y| inside[y * width + x] = out[y]);
        }
        Self { size: self.size, inside }
    }

    /// In a picture reduced by `scale`: a pixel is inside where any of its pixels is. Rows and columns left over at the end belong
    /// to the last ones.
    pub(crate) fn reduced(&self, scale: usize) -> Self {
        let size = Size::new(self.size.height / scale, self.size.width / scale);
        let place = |full: usize, side: usize| (full / scale).min(side - 1);
        let mut inside = vec![false; size.area()];
        for y in 0..self.size.height {
            for x in 0..self.size.width {
                inside[place(y, size.height) * size.width + place(x, size.width)] |= self.at(x, y);
            }
        }
        Self { size, inside }
    }

    /// Runs of rows in which any of `columns` is inside, each from an even row on. Rows up to `gap` between two runs are
    /// taken in.
    pub(crate) fn runs(&self, columns: Range<usize>, gap: usize) -> Vec<Range<usize>> {
        let mut runs: Vec<Range<usize>> = Vec::new();
        for (y, row) in self.inside.chunks_exact(self.size.width).enumerate() {
            if !row[columns.clone()].contains(&true) {
                continue;
            }
            match runs.last_mut() {
                Some(last) if y <= last.end + gap => last.end = y + 1,
                _ => runs.push(y & !1..y + 1),
            }
        }
        runs
    }
}

/// True where anything within `radius` is.
fn spread(values: &[bool], radius: usize, out: &mut [bool]) {
    let mut last = None;
    for (index, (value, out)) in values.iter().zip(&mut *out).enumerate() {
        last = if *value { Some(index) } else { last };
        *out = last.is_some_and(|last| index - last <= radius);
    }
    let mut next = None;
    for (index, (value, out)) in values.iter().zip(out).enumerate().rev() {
        next = if *value { Some(index) } else { next };
        *out |= next.is_some_and(|next| next - index <= radius);
    }
}

#[cfg(test)]
mod tests {
    use ndarray::Array2;

    use super::*;

    fn speckled(size: Size, every: usize) -> Region {
        let mask = Array2::from_shape_fn((size.height, size.width), |(y, x)| (7 * x + 13 * y + x * y) % every == 0);
        Region::from_mask(mask.view()).unwrap()
    }

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn dilation_is_that_of_a_square() {
        let size = Size::new(19, 23);
        let region = speckled(size, 31);
        for radius in [0, 1, 3, 40] {
            let dilated = region.dilated(radius);
            for y in 0..size.height {
                for x in 0..size.width {
                    let near = (0..size.height).any(|v| {
                        (0..size.width).any(|u| region.at(u, v) && u.abs_diff(x) <= radius && v.abs_diff(y) <= radius)
                    });
                    assert_eq!(dilated.at(x, y), near, "{radius}: {x}, {y}");
                }
            }
        }
    }

    #[test]
    fn reduction_keeps_what_has_any_pixel() {
        let size = Size::new(19, 23);
        let region = speckled(size, 57);
        let reduced = region.reduced(4);
        assert_eq!(reduced.size(), Size::new(4, 5));
        for y in 0..4 {
            for x in 0..5 {
                // 3 rows and 3 columns are left over.
                let (bottom, right) = (if y == 3 { 19 } else { 4 * y + 4 }, if x == 4 { 23 } else { 4 * x + 4 });
                let any = (4 * y..bottom).any(|v| (4 * x..right).any(|u| region.at(u, v)));
                assert_eq!(reduced.at(x, y), any, "{x}, {y}");
            }
        }
        // Beside another part, the last row of one column and the last column of one row.
        for (sliver, place) in [((6, 18, 1, 1), (1, 3)), ((22, 5, 1, 1), (4, 1)), ((22, 18, 9, 9), (4, 3))] {
            let (x, y, width, height) = sliver;
            let parts = [Rectangle { x: 0, y: 0, width: 2, height: 2 }, Rectangle { x, y, width, height }];
            let reduced = Region::from_rectangles(size, &parts).unwrap().reduced(4);
            assert!(reduced.area() == 2 && reduced.at(place.0, place.1), "{sliver:?}");
        }
    }

    #[test]
    fn runs_hold_all_rows_and_begin_even() {
        let region = speckled(Size::new(64, 40), 83);
        for gap in [0, 3, 16] {
            let runs = region.runs(5..21, gap);
            for y in 0..64 {
                let needed = (5..21).any(|x| region.at(x, y));
                assert!(!needed || runs.iter().any(|run| run.contains(&y)), "{y}");
            }
            assert!(runs.iter().all(|run| run.start % 2 == 0));
            assert!(runs.windows(2).all(|two| two[0].end <= two[1].start));
        }
    }

    #[test]
    fn what_is_no_region_is_told() {
        let size = Size::new(10, 20);
        let beside = Rectangle { x: 20, y: 0, width: 5, height: 5 };
        let error = Region::from_rectangles(size, &[beside]).unwrap_err();
        assert!(error.to_string().contains("5 x 5 px at column 20, row 0") && error.to_string().contains("10 x 20"));
        assert!(Region::from_mask(Array2::from_elem((3, 3), false).view()).is_err());
        let left = Region::from_rectangles(size, &[Rectangle { x: 0, y: 0, width: 3, height: 99 }]).unwrap();
        let right = Region::from_rectangles(size, &[Rectangle { x: 9, y: 0, width: 3, height: 3 }]).unwrap();
        assert_eq!((left.area(), left.and(&right)), (30, Err(RegionError::Empty { size })));
        assert!(left.contains(-7.0, 1.0) && left.contains(2.4, 12.0) && !left.contains(2.6, 1.0));
        assert!(!left.contains(f32::NAN, 1.0));
    }
}
