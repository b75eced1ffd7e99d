//! One picture on its way in: any sample type, any strides, grey, RGB or RGBA; checked and converted once.
//!
//! Integers are divided by their full scale, colour becomes 0.299 R + 0.587 G + 0.114 B, alpha is left out.

use std::fmt;

use ndarray::{Array2, ArrayView2, ArrayView3, Axis};

use crate::error::FrameError;
use crate::plane::Plane;

/// Rows and columns of a picture, px.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Size {
    /// Rows.
    pub height: usize,
    /// Columns.
    pub width: usize,
}

impl Size {
    /// Rows first, as in an array's shape.
    pub const fn new(height: usize, width: usize) -> Self {
        Self { height, width }
    }

    /// Pixels.
    pub const fn area(self) -> usize {
        self.height * self.width
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} x {}", self.height, self.width)
    }
}

/// Samples of a frame, borrowed: (rows, columns, channels) with any strides.
#[derive(Clone, Copy, Debug)]
pub enum Samples<'a> {
    /// 8-bit integers.
    U8(ArrayView3<'a, u8>),
    /// 16-bit integers.
    U16(ArrayView3<'a, u16>),
    /// Luminance in [0, 1].
    F32(ArrayView3<'a, f32>),
    /// Luminance in [0, 1].
    F64(ArrayView3<'a, f64>),
}

/// A borrowed frame.
///
/// ```
/// use apgstmd_core::Frame;
/// use ndarray::Array2;
/// let picture = Array2::<u8>::zeros((48, 64));
/// let frame = Frame::from(picture.view());
/// assert_eq!(frame.size().height, 48);
/// let thermal = Array2::<u16>::zeros((48, 64));
/// let frame = Frame::from(thermal.view()).with_bits(14);
/// # let _ = frame;
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    samples: Samples<'a>,
    full_scale: f64,
}

/// Floats this far outside [0, 1] are taken for rounding.
const SLACK: f64 = 1e-3;

impl<'a> Frame<'a> {
    /// A frame of (rows, columns, channels) samples; channels is 1 (grey), 3 (RGB) or 4 (RGBA).
    pub fn new(samples: Samples<'a>) -> Self {
        let full_scale = match samples {
            Samples::U8(_) => 255.0,
            Samples::U16(_) => 65535.0,
            Samples::F32(_) | Samples::F64(_) => 1.0,
        };
        Self { samples, full_scale }
    }

    /// Declares the bit depth of integer samples: white is 2^bits - 1 (10, 12 and 14 bits come in 16-bit samples).
    /// Floats are luminance already: for them this changes nothing.
    pub fn with_bits(mut self, bits: u32) -> Self {
        if matches!(self.samples, Samples::U8(_) | Samples::U16(_)) {
            self.full_scale = 2f64.powi(bits as i32) - 1.0;
        }
        self
    }

    /// Rows and columns.
    pub fn size(&self) -> Size {
        let (height, width, _) = self.dim();
        Size { height, width }
    }

    /// The luminance in [0, 1] that the detector sees, (rows, columns).
    ///
    /// # Errors
    /// Samples that are no luminance, another number of channels than 1, 3 or 4.
    pub fn luminance(&self) -> Result<Array2<f32>, FrameError> {
        let mut plane = Plane::new(self.size());
        self.write_luminance(&mut plane)?;
        Ok(plane.view().to_owned())
    }

    fn dim(&self) -> (usize, usize, usize) {
        match &self.samples {
            Samples::U8(view) => view.dim(),
            Samples::U16(view) => view.dim(),
            Samples::F32(view) => view.dim(),
            Samples::F64(view) => view.dim(),
        }
    }

    /// Checks every sample and writes luminance in [0, 1] into `into`. On error `into` holds no usable picture.
    pub(crate) fn write_luminance(&self, into: &mut Plane) -> Result<(), FrameError> {
        if self.size() != into.size() {
            return Err(FrameError::Size { given: self.size(), expected: into.size() });
        }
        let channels = self.dim().2;
        if !matches!(channels, 1 | 3 | 4) {
            return Err(FrameError::Channels { channels });
        }
        match self.samples {
            Samples::U8(view) => self.write_integers(view, into),
            Samples::U16(view) => self.write_integers(view, into),
            Samples::F32(view) => write_floats(view, into),
            Samples::F64(view) => write_floats(view, into),
        }
    }

    fn write_integers<T: Copy + Ord + Into<f64> + Into<f32>>(
        &self,
        view: ArrayView3<'_, T>,
        into: &mut Plane,
    ) -> Result<(), FrameError> {
        let scale = (1.0 / self.full_scale) as f32;
        write_luminance(view, into, |sample: T| {
            let sample: f32 = sample.into();
            sample * scale
        });
        // Grey and colour alike: no mixture of samples within full scale exceeds it.
        let over = |sample: &T| <T as Into<f64>>::into(*sample) > self.full_scale;
        let largest = match view.as_slice() {
            Some(samples) => samples.iter().max(),
            None => view.iter().max(),
        };
        let wrong = largest.is_some_and(over).then(|| view.indexed_iter().find(|(_, sample)| over(sample))).flatten();
        match wrong {
            Some(((y, x, _), value)) => {
                Err(FrameError::AboveFullScale { x, y, value: (*value).into(), full_scale: self.full_scale })
            }
            None => Ok(()),
        }
    }
}

fn write_floats<T: Copy + Into<f64>>(view: ArrayView3<'_, T>, into: &mut Plane) -> Result<(), FrameError> {
    let usable = |sample: T| {
        let sample: f64 = sample.into();
        (-SLACK..=1.0 + SLACK).contains(&sample)
    };
    let colours = view.dim().2.min(3);
    if any(view, |sample| !usable(sample))
        && let Some(((y, x, _), value)) =
            view.indexed_iter().find(|((_, _, channel), sample)| *channel < colours && !usable(**sample))
    {
        let value: f64 = (*value).into();
        return Err(if value.is_finite() {
            FrameError::OutOfRange { x, y, value }
        } else {
            FrameError::NotFinite { x, y, value }
        });
    }
    write_luminance(view, into, |sample: T| <T as Into<f64>>::into(sample) as f32);
    Ok(())
}

/// Whether any sample, of alpha as well, is `bad`: without stopping at it, which is faster where none is.
fn any<T: Copy>(view: ArrayView3<'_, T>, bad: impl Fn(T) -> bool) -> bool {
    match view.as_slice() {
        Some(samples) => samples.iter().fold(false, |any, sample| any | bad(*sample)),
        None => view.iter().any(|sample| bad(*sample)),
    }
}

fn write_luminance<T: Copy>(view: ArrayView3<'_, T>, into: &mut Plane, unit: impl Fn(T) -> f32) {
    let grey = view.dim().2 == 1;
    for (y, row) in view.axis_iter(Axis(0)).enumerate() {
        let out = into.row_mut(y);
        if grey {
            let row = row.index_axis(Axis(1), 0);
            match row.as_slice() {
                Some(row) => out.iter_mut().zip(row).for_each(|(out, sample)| *out = unit(*sample)),
                None => out.iter_mut().zip(row).for_each(|(out, sample)| *out = unit(*sample)),
            }
        } else {
            for (out, rgb) in out.iter_mut().zip(row.axis_iter(Axis(0))) {
                *out = 0.299 * unit(rgb[0]) + 0.587 * unit(rgb[1]) + 0.114 * unit(rgb[2]);
            }
        }
    }
}

macro_rules! from_views {
    ($($sample:ty => $variant:ident),*) => { $(
        impl<'a> From<ArrayView2<'a, $sample>> for Frame<'a> {
            fn from(view: ArrayView2<'a, $sample>) -> Self {
                Self::new(Samples::$variant(view.insert_axis(Axis(2))))
            }
        }
        impl<'a> From<ArrayView3<'a, $sample>> for Frame<'a> {
            fn from(view: ArrayView3<'a, $sample>) -> Self {
                Self::new(Samples::$variant(view))
            }
        }
    )* };
}
from_views!(u8 => U8, u16 => U16, f32 => F32, f64 => F64);

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array2, Array3, s};

    fn luminance<'a>(frame: impl Into<Frame<'a>>) -> Result<Vec<f32>, FrameError> {
        frame.into().luminance().map(|seen| seen.iter().copied().collect())
    }

    #[test]
    fn a_frame_without_pixels_has_no_luminance() {
        for shape in [(0, 7), (7, 0), (0, 0)] {
            assert_eq!(Frame::from(Array2::<u8>::zeros(shape).view()).luminance().unwrap().dim(), shape);
        }
    }

    #[test]
    fn integers_are_divided_by_their_full_scale() {
        assert_eq!(luminance(Array2::from_elem((2, 3), 255u8).view()).unwrap(), [1.0; 6]);
        assert_eq!(luminance(Array2::from_elem((2, 3), 65535u16).view()).unwrap(), [1.0; 6]);
        let deep = Array2::from_elem((2, 3), 16383u16);
        assert_eq!(luminance(Frame::from(deep.view()).with_bits(14)).unwrap(), [1.0; 6]);
        let error = luminance(Frame::from(deep.view()).with_bits(12)).unwrap_err();
        assert!(matches!(error, FrameError::AboveFullScale { x: 0, y: 0, .. }));
    }

    #[test]
    fn colour_is_weighted_and_alpha_left_out() {
        let mut picture = Array3::<u8>::zeros((1, 3, 4));
        for channel in 0..3 {
            picture[[0, channel, channel]] = 255;
        }
        picture.slice_mut(s![.., .., 3]).fill(9);
        assert_eq!(luminance(picture.view()).unwrap(), [0.299, 0.587, 0.114]);
        let mut float = Array3::<f32>::zeros((1, 1, 4));
        float[[0, 0, 3]] = f32::NAN;
        assert_eq!(luminance(float.view()).unwrap(), [0.0]);
        assert_eq!(luminance(Array3::<u8>::zeros((2, 2, 2)).view()), Err(FrameError::Channels { channels: 2 }));
    }

    #[test]
    fn any_strides() {
        let picture = Array2::from_shape_fn((6, 8), |(y, x)| (10 * y + x) as f64 / 100.0);
        let seen = luminance(picture.slice(s![..;-2, 1..;3]).t()).unwrap();
        assert_eq!(seen, [0.51, 0.31, 0.11, 0.54, 0.34, 0.14, 0.57, 0.37, 0.17]);
    }

    #[test]
    fn floats_must_be_luminance() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut picture = Array2::<f32>::zeros((4, 5));
            picture[[2, 3]] = bad;
            assert!(matches!(luminance(picture.view()), Err(FrameError::NotFinite { x: 3, y: 2, .. })));
        }
        let bright = Array2::from_elem((4, 5), 255.0f64);
        assert_eq!(luminance(bright.view()), Err(FrameError::OutOfRange { x: 0, y: 0, value: 255.0 }));
    }
}
