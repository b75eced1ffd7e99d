//! NumPy arrays as frames: borrowed as they lie in memory, with any strides, never copied, converted or rescaled.

use apgstmd_cli::source::{Picture, Pixels};
use apgstmd_core::{Frame, Samples};
use ndarray::{Array3, ArrayView3, ArrayViewD, Axis, Ix3};
use numpy::{Element, PyArrayDescrMethods, PyArrayDyn, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::errors::Error;

const ACCEPTED: &str = "uint8, uint16, float32 or float64 (or bool)";

/// A frame that Python owns.
pub enum Borrowed<'py> {
    U8(PyReadonlyArrayDyn<'py, u8>, u32),
    U16(PyReadonlyArrayDyn<'py, u16>, u32),
    F32(PyReadonlyArrayDyn<'py, f32>),
    F64(PyReadonlyArrayDyn<'py, f64>),
}

impl<'py> Borrowed<'py> {
    /// Borrows `frame`, whose integers have `bits` significant bits (all of them where it is `None`).
    pub fn new(frame: &Bound<'py, PyAny>, bits: Option<u32>) -> PyResult<Self> {
        let Ok(array) = frame.cast::<PyUntypedArray>() else {
            let kind = frame.get_type().name()?;
            return Err(Error::Type(format!(
                "a frame must be a NumPy array of {ACCEPTED}, not {kind}: use numpy.asarray(frame)"
            ))
            .into());
        };
        if !matches!(array.ndim(), 2 | 3) {
            return Err(Error::Value(format!(
                "a frame has the shape (height, width) or (height, width, 3 or 4), but this array has {:?}",
                array.shape()
            ))
            .into());
        }
        let itemsize = array.dtype().itemsize() as isize;
        if !array.is_aligned() || array.strides().iter().any(|stride| stride % itemsize != 0) {
            return Err(Error::Value("the frame lies misaligned in memory: pass frame.copy()".into()).into());
        }
        if let Some(array) = readonly::<bool>(frame)? {
            let bytes = array.call_method1("view", ("uint8",))?;
            return Ok(Self::U8(bytes.extract()?, 1));
        }
        if let Some(array) = readonly::<u8>(frame)? {
            let bits = bits.unwrap_or(8);
            if bits > 8 {
                return Err(Error::Value(format!("bit_depth is {bits}, but a uint8 frame holds 8 bits")).into());
            }
            return Ok(Self::U8(array, bits));
        }
        if let Some(array) = readonly::<u16>(frame)? {
            return Ok(Self::U16(array, bits.unwrap_or(16)));
        }
        if let Some(array) = readonly::<f32>(frame)? {
            return Ok(Self::F32(array));
        }
        if let Some(array) = readonly::<f64>(frame)? {
            return Ok(Self::F64(array));
        }
        let dtype = array.dtype();
        Err(Error::Type(format!(
            "a frame must be {ACCEPTED} in native byte order, not {}: scale it to one of these and convert it with \
             frame.astype(...); nothing is rescaled for you",
            dtype.str()?
        ))
        .into())
    }

    pub fn frame(&self) -> Frame<'_> {
        match self {
            Self::U8(array, bits) => Frame::new(Samples::U8(with_channels(array.as_array()))).with_bits(*bits),
            Self::U16(array, bits) => Frame::new(Samples::U16(with_channels(array.as_array()))).with_bits(*bits),
            Self::F32(array) => Frame::new(Samples::F32(with_channels(array.as_array()))),
            Self::F64(array) => Frame::new(Samples::F64(with_channels(array.as_array()))),
        }
    }

    /// A copy that outlives the array, for what is read ahead.
    pub fn picture(&self) -> Picture {
        fn owned<T: Clone>(view: ArrayViewD<'_, T>) -> Array3<T> {
            with_channels(view).as_standard_layout().into_owned()
        }
        let (pixels, bits) = match self {
            Self::U8(array, bits) => (Pixels::U8(owned(array.as_array())), Some(*bits)),
            Self::U16(array, bits) => (Pixels::U16(owned(array.as_array())), Some(*bits)),
            Self::F32(array) => (Pixels::F32(owned(array.as_array())), None),
            Self::F64(array) => (Pixels::F64(owned(array.as_array())), None),
        };
        Picture { pixels, bits }
    }
}

fn readonly<'py, T: Element>(frame: &Bound<'py, PyAny>) -> PyResult<Option<PyReadonlyArrayDyn<'py, T>>> {
    match frame.cast::<PyArrayDyn<T>>() {
        Ok(_) => frame.extract().map(Some),
        Err(_) => Ok(None),
    }
}

fn with_channels<T>(view: ArrayViewD<'_, T>) -> ArrayView3<'_, T> {
    let view = if view.ndim() == 2 { view.insert_axis(Axis(2)) } else { view };
    view.into_dimensionality::<Ix3>().expect("two or three axes were checked when the array was borrowed")
}
