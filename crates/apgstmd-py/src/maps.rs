//! Maps that a frame is answered with: the caller's own arrays, or new ones.

use std::sync::Mutex;

use apgstmd_core::{Response, Size};
use ndarray::Array2;
use numpy::{
    BorrowError, IntoPyArray, PyArray2, PyArrayDescrMethods, PyArrayMethods, PyReadwriteArray2, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::errors::Error;

pub type Map<'py> = Bound<'py, PyArray2<f32>>;

/// A response from an earlier frame, with all the room it needs.
pub type Kept = Mutex<Option<Response>>;

/// Where response and direction go.
pub struct Maps<'py>([Option<PyReadwriteArray2<'py, f32>>; 2]);

impl<'py> Maps<'py> {
    /// `out` is a pair of arrays, each of which may be None. Nothing may borrow them already: the frame must not overlap.
    pub fn new(out: Option<&Bound<'py, PyAny>>, size: Size) -> PyResult<Self> {
        let Some(out) = out else { return Ok(Self([None, None])) };
        let pair: (Option<Bound<'py, PyAny>>, Option<Bound<'py, PyAny>>) = out.extract().map_err(|_| {
            Error::Type("out must be a pair of arrays (response, direction), either of which may be None".into())
        })?;
        let of = |name, array: Option<Bound<'py, PyAny>>| array.map(|array| writable(name, &array, size)).transpose();
        Ok(Self([of("out[0] (response)", pair.0)?, of("out[1] (direction)", pair.1)?]))
    }

    /// What the next frame is to be written into: one that was kept where the caller has arrays for its maps.
    pub fn room(&self, kept: &Kept) -> Option<Response> {
        if self.0.iter().all(Option::is_none) {
            return None;
        }
        kept.lock().ok().and_then(|mut kept| kept.take())
    }

    /// Writes the maps into the caller's arrays, or hands them over. What was copied from is kept for the next frame.
    pub fn fill(self, py: Python<'py>, response: Response, kept: &Kept) -> (Map<'py>, Map<'py>) {
        match self.0 {
            [None, None] => (response.map.into_pyarray(py), response.direction.into_pyarray(py)),
            [map, direction] => {
                let maps = (written(py, map, &response.map), written(py, direction, &response.direction));
                if let Ok(mut kept) = kept.lock() {
                    *kept = Some(response);
                }
                maps
            }
        }
    }
}

fn written<'py>(py: Python<'py>, given: Option<PyReadwriteArray2<'py, f32>>, values: &Array2<f32>) -> Map<'py> {
    match given {
        None => values.clone().into_pyarray(py),
        Some(mut given) => {
            given.as_array_mut().assign(values);
            let array: &Map<'py> = &given;
            array.clone()
        }
    }
}

fn writable<'py>(name: &str, array: &Bound<'py, PyAny>, size: Size) -> PyResult<PyReadwriteArray2<'py, f32>> {
    let wanted = format!("a C-contiguous array of float32 and the shape ({}, {})", size.height, size.width);
    let Ok(plain) = array.cast::<PyUntypedArray>() else {
        let kind = array.get_type().name()?;
        return Err(Error::Type(format!("{name} must be {wanted}, not {kind}")).into());
    };
    let dtype = plain.dtype();
    if !dtype.is_equiv_to(&numpy::dtype::<f32>(array.py())) {
        return Err(Error::Type(format!("{name} must be {wanted}, but it is of {}", dtype.str()?)).into());
    }
    if plain.shape() != [size.height, size.width] {
        return Err(Error::Value(format!("{name} must be {wanted}, but its shape is {:?}", plain.shape())).into());
    }
    if !plain.is_c_contiguous() || !plain.is_aligned() {
        return Err(Error::Value(format!(
            "{name} must be {wanted}, but it is a view with gaps: numpy.empty makes one"
        ))
        .into());
    }
    let array = array.cast::<PyArray2<f32>>().map_err(PyErr::from)?;
    array.try_readwrite().map_err(|error| {
        let text = match error {
            BorrowError::NotWriteable => format!("{name} is read-only, but the map is to be written into it"),
            _ => format!("{name} overlaps the frame or the other map: each needs memory of its own"),
        };
        Error::Value(text).into()
    })
}
