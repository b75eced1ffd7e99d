//! Storage of maps: rows of f32, padded to whole SIMD blocks. The only index arithmetic of the crate.

use ndarray::{ArrayView2, ArrayView3, ShapeBuilder};

use crate::frame::Size;
use crate::memory::heap;

/// Floats a row is padded to: the widest vector, so that no row kernel needs a tail.
pub(crate) const LANES: usize = 16;

/// Columns of a padded row.
pub(crate) const fn padded(width: usize) -> usize {
    width.next_multiple_of(LANES)
}

/// One map, `size.height` rows of `size.width` values. The padding behind each row holds anything finite.
#[derive(Clone, Debug)]
pub(crate) struct Plane {
    size: Size,
    data: Vec<f32>,
}

heap!(Plane { data });

impl Plane {
    pub fn new(size: Size) -> Self {
        Self { size, data: vec![0.0; size.height * padded(size.width)] }
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

    /// All rows with their padding, for row bands.
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    pub fn fill(&mut self, value: f32) {
        self.data.fill(value);
    }

    pub fn view(&self) -> ArrayView2<'_, f32> {
        let shape = (self.size.height, self.size.width).strides((self.stride(), 1));
        ArrayView2::from_shape(shape, &self.data).expect("rows lie inside the plane")
    }

    /// As one map of a stack.
    pub fn view3(&self) -> ArrayView3<'_, f32> {
        self.view().insert_axis(ndarray::Axis(0))
    }
}
