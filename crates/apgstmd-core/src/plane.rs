//! Storage of maps: rows of f32, padded to whole SIMD blocks. The only index arithmetic of the crate.

use std::ops::{Deref, DerefMut};

use ndarray::{ArrayView2, ArrayView3, ShapeBuilder};

use crate::frame::Size;
use crate::memory::heap;

/// Floats a row is padded to: the widest vector, so that no row kernel needs a tail.
pub(crate) const LANES: usize = 16;

/// Columns of a padded row.
pub(crate) const fn padded(width: usize) -> usize {
    width.next_multiple_of(LANES)
}

/// Floats that begin on a cache line, with a vector of slack before and behind them: whole vectors may be read from
/// any place inside.
#[derive(Clone, Debug)]
pub(crate) struct Buffer {
    data: Vec<f32>,
    start: usize,
    len: usize,
}

heap!(Buffer { data });

impl Buffer {
    pub fn zeros(len: usize) -> Self {
        let data = vec![0.0f32; len + 3 * LANES];
        // Whole vectors, should the address not tell.
        let start = LANES + data[LANES..].as_ptr().align_offset(LANES * size_of::<f32>()).min(LANES);
        Self { data, start, len }
    }

    /// `len` floats from `at` on, which may lie up to a vector outside.
    pub fn around(&self, at: isize, len: usize) -> &[f32] {
        let first = self.start.checked_add_signed(at).expect("at most a vector before the first");
        &self.data[first..first + len]
    }
}

impl Deref for Buffer {
    type Target = [f32];
    fn deref(&self) -> &[f32] {
        &self.data[self.start..self.start + self.len]
    }
}

impl DerefMut for Buffer {
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut self.data[self.start..self.start + self.len]
    }
}

/// One map, `size.height` rows of `size.width` values. The padding behind each row holds anything finite.
#[derive(Clone, Debug)]
pub(crate) struct Plane {
    size: Size,
    data: Buffer,
}

heap!(Plane { data });

impl Plane {
    pub fn new(size: Size) -> Self {
        Self { size, data: Buffer::zeros(size.height * padded(size.width)) }
    }

    /// Bytes that one of `size` owns.
    pub fn bytes(size: Size) -> usize {
        (size.height * padded(size.width) + 3 * LANES) * size_of::<f32>()
    }

    pub fn size(&self) -> Size {
        self.size
    }

    pub fn stride(&self) -> usize {
        padded(self.size.width)
    }

    /// The values of a row, without padding.
    pub fn row(&self, y: usize) -> &[f32] {
        &self.padded_row(y)[..self.size.width]
    }

    pub fn row_mut(&mut self, y: usize) -> &mut [f32] {
        let start = y * self.stride();
        &mut self.data[start..start + self.size.width]
    }

    pub fn padded_row(&self, y: usize) -> &[f32] {
        let start = y * self.stride();
        &self.data[start..start + self.stride()]
    }

    /// `len` values of row `y` from column `x` on. Up to a vector may lie left of the row, or right of its padding:
    /// what stands there is anything finite.
    pub fn around(&self, y: usize, x: isize, len: usize) -> &[f32] {
        self.data.around((y * self.stride()) as isize + x, len)
    }

    /// Copies row `y` from column `x` on, zero outside the picture.
    pub fn copy_row(&self, y: isize, x: isize, out: &mut [f32]) {
        let Size { height, width } = self.size;
        let first = (-x).clamp(0, out.len() as isize) as usize;
        let last = (width as isize - x).clamp(first as isize, out.len() as isize) as usize;
        if !(0..height as isize).contains(&y) {
            out.fill(0.0);
            return;
        }
        out[..first].fill(0.0);
        let from = (x + first as isize) as usize;
        out[first..last].copy_from_slice(&self.row(y as usize)[from.min(width)..from.min(width) + last - first]);
        out[last..].fill(0.0);
    }

    /// All rows with their padding.
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// All rows with their padding, for row bands.
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    pub fn fill(&mut self, value: f32) {
        self.data.fill(value);
    }

    pub fn view(&self) -> ArrayView2<'_, f32> {
        let shape = (self.size.height, self.size.width);
        // Strides have no meaning in a frame without pixels, and are refused.
        if self.size.area() == 0 {
            return ArrayView2::from_shape(shape, &[]).expect("nothing of nothing");
        }
        let shape = shape.strides((self.stride(), 1));
        ArrayView2::from_shape(shape, &self.data[..]).expect("rows lie inside the plane")
    }

    /// As one map of a stack.
    pub fn view3(&self) -> ArrayView3<'_, f32> {
        self.view().insert_axis(ndarray::Axis(0))
    }
}

/// A map of frames that are computed together, and of the frame before them.
#[derive(Clone, Debug)]
pub(crate) struct Series {
    maps: Vec<Plane>,
    before: Plane,
    count: usize,
}

heap!(Series { maps, before });

impl Series {
    /// Of `together` frames at most.
    pub fn new(size: Size, together: usize) -> Self {
        Self { maps: (0..together).map(|_| Plane::new(size)).collect(), before: Plane::new(size), count: 1 }
    }

    /// Begins the next `count` frames, whose maps are to be written.
    pub fn begin(&mut self, count: usize) {
        std::mem::swap(&mut self.before, &mut self.maps[self.count - 1]);
        self.count = count;
    }

    /// Lets go of all but the first `count` frames.
    pub fn keep(&mut self, count: usize) {
        self.count = count;
    }

    pub fn maps(&self) -> &[Plane] {
        &self.maps[..self.count]
    }

    pub fn maps_mut(&mut self) -> &mut [Plane] {
        &mut self.maps[..self.count]
    }

    /// The map of the frame before `frame`.
    pub fn before(&self, frame: usize) -> &Plane {
        if frame == 0 { &self.before } else { &self.maps[frame - 1] }
    }

    /// The map of the last frame.
    pub fn last(&self) -> &Plane {
        &self.maps[self.count - 1]
    }

    pub fn fill(&mut self, value: f32) {
        self.maps.iter_mut().chain([&mut self.before]).for_each(|plane| plane.fill(value));
    }
}
