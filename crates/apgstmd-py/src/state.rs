//! States as dicts of NumPy arrays.

use std::collections::BTreeMap;

use apgstmd_core::State;
use apgstmd_core::state::{Array, Origin, Values};
use ndarray::{ArrayD, IxDyn};
use numpy::{Element, IntoPyArray, PyArrayDyn, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::errors::Error;

/// Entries of the dict; `arrays` is one of its own.
const ARRAYS: &str = "arrays";

pub fn to_dict<'py>(py: Python<'py>, state: &State) -> PyResult<Bound<'py, PyDict>> {
    let arrays = PyDict::new(py);
    for (name, Array { shape, values }) in state.arrays() {
        let array = match values {
            Values::F32(values) => array(py, shape, values),
            Values::F64(values) => array(py, shape, values),
            Values::U8(values) => array(py, shape, values),
            Values::U32(values) => array(py, shape, values),
            Values::U64(values) => array(py, shape, values),
        };
        arrays.set_item(name, array)?;
    }
    let Origin { format, version, of, height, width, parameters } = state.origin();
    let dict = PyDict::new(py);
    dict.set_item("format", format)?;
    dict.set_item("version", version)?;
    dict.set_item("of", of)?;
    dict.set_item("height", height)?;
    dict.set_item("width", width)?;
    dict.set_item("parameters", parameters)?;
    dict.set_item(ARRAYS, arrays)?;
    Ok(dict)
}

fn array<'py, T: Element + Clone>(py: Python<'py>, shape: &[usize], values: &[T]) -> Bound<'py, PyAny> {
    let array = ArrayD::from_shape_vec(IxDyn(shape), values.to_vec()).expect("as many values as the shape says");
    array.into_pyarray(py).into_any()
}

pub fn from_dict(dict: &Bound<'_, PyDict>) -> PyResult<State> {
    let origin = Origin {
        format: entry(dict, "format")?,
        version: entry(dict, "version")?,
        of: entry(dict, "of")?,
        height: entry(dict, "height")?,
        width: entry(dict, "width")?,
        parameters: entry(dict, "parameters")?,
    };
    let mut arrays = BTreeMap::new();
    for (name, value) in entry::<Bound<'_, PyDict>>(dict, ARRAYS)?.iter() {
        let name: String = name.cast::<PyString>().map_err(PyErr::from)?.extract()?;
        let array = read(&value)?.ok_or_else(|| {
            Error::Type(format!(
                "array {name:?} of the state must be a NumPy array of float32, float64, uint8, uint32 or uint64, as \
                 state_dict() gives it"
            ))
        })?;
        arrays.insert(name, array);
    }
    Ok(State::new(origin, arrays).map_err(Error::from)?)
}

fn entry<'py, T>(dict: &Bound<'py, PyDict>, name: &str) -> PyResult<T>
where
    for<'a> T: FromPyObject<'a, 'py>,
{
    let missing = || Error::Value(format!("the state has no entry {name:?}: give what state_dict() gave"));
    let value = dict.get_item(name)?.ok_or_else(missing)?;
    let wrong = || Error::Type(format!("entry {name:?} of the state is not of its type: give what state_dict() gave"));
    value.extract().map_err(|_| wrong().into())
}

fn read(value: &Bound<'_, PyAny>) -> PyResult<Option<Array>> {
    fn of<T: Element + Copy>(value: &Bound<'_, PyAny>, wrap: fn(Vec<T>) -> Values) -> PyResult<Option<Array>> {
        if value.cast::<PyArrayDyn<T>>().is_err() {
            return Ok(None);
        }
        let array: PyReadonlyArrayDyn<'_, T> = value.extract()?;
        let view = array.as_array();
        Ok(Some(Array { shape: view.shape().to_vec(), values: wrap(view.iter().copied().collect()) }))
    }
    Ok(of(value, Values::F32)?
        .or(of(value, Values::F64)?)
        .or(of(value, Values::U8)?)
        .or(of(value, Values::U32)?)
        .or(of(value, Values::U64)?))
}
