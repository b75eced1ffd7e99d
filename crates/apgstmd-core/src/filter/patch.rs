//! A rectangle of a map with its halo, copied out: the one place where borders are decided.

use crate::memory::heap;
use crate::plane::{Buffer, LANES, Plane};

/// What stands outside the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Border {
    /// The nearest pixel.
    Replicate,
    /// Nothing.
    Zero,
}

/// Scratch for a rectangle, rows padded so that kernels may write and read whole vectors.
pub(crate) struct Patch {
    buffer: Buffer,
    rows: usize,
    pub stride: usize,
}

/// Floats a patch row needs for `columns` columns, read up to a vector too far.
pub(crate) const fn patch_stride(columns: usize) -> usize {
    columns.next_multiple_of(LANES) + LANES
}

heap!(Patch { buffer });

impl Patch {
    /// Space for patches up to this size.
    pub fn with_capacity(rows: usize, columns: usize) -> Self {
        Self { buffer: Buffer::zeros(rows * patch_stride(columns)), rows: 0, stride: 0 }
    }

    /// Takes a size; what it holds is to be overwritten.
    pub fn shape(&mut self, rows: usize, columns: usize) {
        self.stride = patch_stride(columns);
        self.rows = rows;
        if self.buffer.len() < rows * self.stride {
            self.buffer = Buffer::zeros(rows * self.stride);
        }
    }

    pub fn data(&self) -> &[f32] {
        &self.buffer[..self.rows * self.stride]
    }

    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.buffer[..self.rows * self.stride]
    }

    pub fn row(&self, y: usize) -> &[f32] {
        &self.buffer[y * self.stride..(y + 1) * self.stride]
    }

    pub fn row_mut(&mut self, y: usize) -> &mut [f32] {
        &mut self.buffer[y * self.stride..(y + 1) * self.stride]
    }

    /// Row `y` and all below it.
    pub fn below(&self, y: usize) -> &[f32] {
        &self.data()[y * self.stride..]
    }

    /// Copies `rows` x `columns` pixels of `plane` whose first is (top, left), which may lie outside.
    pub fn gather(&mut self, plane: &Plane, top: isize, left: isize, rows: usize, columns: usize, border: Border) {
        self.shape(rows, columns);
        let (height, width) = (plane.size().height as isize, plane.size().width as isize);
        let before = (-left).clamp(0, columns as isize) as usize;
        let first = left.clamp(0, width);
        let last = (left + columns as isize).clamp(first, width);
        let inside = (last - first) as usize;
        for row in 0..rows {
            let y = top + row as isize;
            let out = self.row_mut(row);
            if border == Border::Zero && !(0..height).contains(&y) {
                out.fill(0.0);
                continue;
            }
            let src = plane.row(y.clamp(0, height - 1) as usize);
            let (left_edge, right_edge) = match border {
                Border::Replicate => (src[0], src[width as usize - 1]),
                Border::Zero => (0.0, 0.0),
            };
            out[..before].fill(left_edge);
            out[before..before + inside].copy_from_slice(&src[first as usize..first as usize + inside]);
            out[before + inside..].fill(right_edge);
        }
    }
}

/// Columns a spatial stage works on at a time, so that its scratch stays in the cache however wide the picture is.
pub(crate) const STRIP: usize = 256;

/// First column and number of columns of each strip.
pub(crate) fn strips(width: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..width).step_by(STRIP).map(move |left| (left, STRIP.min(width - left)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Size;

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn borders_on_every_side() {
        let size = Size::new(4, 5);
        let mut plane = Plane::new(size);
        for y in 0..4 {
            plane.row_mut(y).iter_mut().enumerate().for_each(|(x, value)| *value = (10 * y + x + 1) as f32);
        }
        let mut patch = Patch::with_capacity(1, 1);
        for border in [Border::Replicate, Border::Zero] {
            for top in -9..9 {
                for left in -9..9 {
                    patch.gather(&plane, top, left, 6, 7, border);
                    for row in 0..6 {
                        for column in 0..7 {
                            let (y, x) = (top + row, left + column);
                            let inside = (0..4).contains(&y) && (0..5).contains(&x);
                            let expected = if inside || border == Border::Replicate {
                                (10 * y.clamp(0, 3) + x.clamp(0, 4) + 1) as f32
                            } else {
                                0.0
                            };
                            assert_eq!(patch.row(row as usize)[column as usize], expected);
                        }
                    }
                }
            }
        }
    }
}
