//! A made-up scene: any frame on demand, and its truth as columns.

use std::path::{Path, PathBuf};

use apgstmd_cli::source::{Overrides, SceneFile};
use apgstmd_core::stimulus::{self, Truth};
use numpy::{Element, IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use toml::{Table, Value};

use crate::errors::Error;
use crate::params::to_toml;

type Column<'py, T> = Bound<'py, PyArray1<T>>;

/// frame, id, x, y, w, h, visible, contrast.
type TruthColumns<'py> = (
    Column<'py, i64>,
    Column<'py, i64>,
    Column<'py, f64>,
    Column<'py, f64>,
    Column<'py, f64>,
    Column<'py, f64>,
    Column<'py, bool>,
    Column<'py, f64>,
);

#[pyclass(module = "apgstmd._core", frozen)]
pub struct Scene(SceneFile);

#[pymethods]
impl Scene {
    #[new]
    fn new(scene: Source<'_>, frames: Option<usize>, seed: Option<u64>) -> PyResult<Self> {
        let overrides = Overrides { frames, seed };
        let here = Path::new("scene");
        let file = match scene {
            Source::Table(table) => {
                let table = to_table(&table, "scene")?;
                let text = toml::to_string(&table).map_err(|error| Error::Value(error.to_string()))?;
                SceneFile::parse(&text, here, overrides)
            }
            Source::Named(kind, text) => match kind.as_str() {
                "text" => SceneFile::parse(&text, here, overrides),
                "file" => SceneFile::read_with(&PathBuf::from(text), overrides),
                "demo" => SceneFile::new(stimulus::Scene::demo(), here, overrides),
                _ => SceneFile::new(stimulus::Scene::paper(), here, overrides),
            },
        };
        Ok(Self(file.map_err(Error::from)?))
    }

    #[getter]
    fn toml(&self) -> String {
        self.0.scene().to_toml()
    }

    #[getter]
    fn shape(&self) -> (usize, usize) {
        (self.0.scene().height, self.0.scene().width)
    }

    #[getter]
    fn rate(&self) -> f64 {
        self.0.scene().rate
    }

    #[getter]
    fn frames(&self) -> usize {
        self.0.scene().frames
    }

    fn frame<'py>(&self, py: Python<'py>, index: usize) -> Bound<'py, PyArray2<f32>> {
        py.detach(|| self.0.renderer().frame(index)).into_pyarray(py)
    }

    fn truth<'py>(&self, py: Python<'py>) -> TruthColumns<'py> {
        let renderer = self.0.renderer();
        let rows: Vec<Truth> = py.detach(|| (0..self.frames()).flat_map(|t| renderer.truth(t)).collect());
        (
            column(py, &rows, |row| row.frame as i64),
            column(py, &rows, |row| row.id as i64),
            column(py, &rows, |row| row.x),
            column(py, &rows, |row| row.y),
            column(py, &rows, |row| row.width),
            column(py, &rows, |row| row.height),
            column(py, &rows, |row| row.visible),
            column(py, &rows, |row| row.contrast),
        )
    }
}

/// A dict, or what the text is ("text", "file", "demo", "paper") and the text.
#[derive(FromPyObject)]
enum Source<'py> {
    Table(Bound<'py, PyDict>),
    Named(String, String),
}

fn column<'py, T: Element>(py: Python<'py>, rows: &[Truth], value: fn(&Truth) -> T) -> Column<'py, T> {
    PyArray1::from_iter(py, rows.iter().map(value))
}

/// None stands for a key that is left out.
fn to_table(table: &Bound<'_, PyDict>, place: &str) -> PyResult<Table> {
    let mut into = Table::new();
    for (key, value) in table {
        let key: String = key.extract()?;
        if !value.is_none() {
            let value = to_value(&value, &format!("{place}.{key}"))?;
            into.insert(key, value);
        }
    }
    Ok(into)
}

fn to_value(value: &Bound<'_, PyAny>, place: &str) -> PyResult<Value> {
    if let Ok(table) = value.cast::<PyDict>() {
        return to_table(table, place).map(Value::Table);
    }
    if value.hasattr("__fspath__")? {
        return Ok(Value::String(value.extract::<PathBuf>()?.to_string_lossy().into_owned()));
    }
    if let Some(plain) = to_toml(value) {
        return Ok(plain);
    }
    let items = value.try_iter().map_err(|_| {
        let kind = value.get_type().to_string();
        Error::Type(format!("{place} must be a number, a string, a bool, a list or a dict, not {kind}"))
    })?;
    let items = items.enumerate().map(|(i, item)| to_value(&item?, &format!("{place}[{i}]")));
    items.collect::<PyResult<_>>().map(Value::Array)
}
