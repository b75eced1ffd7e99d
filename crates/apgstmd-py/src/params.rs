//! Parameters by name: Python values in, the full parameter file out.

use std::f64::consts::FRAC_PI_4;

use apgstmd_core::kernels::{attention, lateral, prediction, temporal};
use apgstmd_core::{BankParams, DIRECTIONS, Model, Params, Preset};
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyString};
use toml::{Table, Value};

use crate::errors::Error;

/// Every parameter in file order: (section, name, documentation, rule).
#[pyfunction]
pub fn fields() -> Vec<(&'static str, &'static str, String, String)> {
    Params::fields()
        .map(|field| {
            let lines: Vec<&str> = field.doc.iter().map(|line| line.trim()).collect();
            (field.section, field.name, lines.join(" "), (field.rule)())
        })
        .collect()
}

/// The full parameter file: `file` (TOML), `table`, or `model` and `preset`, tuned to `speed`, with `overrides` put in
/// last. What a file or a table leaves out is as its model has it.
#[pyfunction]
pub fn resolve(
    model: Option<&str>,
    preset: Option<&str>,
    file: Option<&str>,
    table: Option<&Bound<'_, PyDict>>,
    speed: Option<f64>,
    overrides: &Bound<'_, PyDict>,
) -> PyResult<String> {
    let mut params = match (file, table) {
        (Some(text), _) => match BankParams::from_toml(text).map_err(Error::from)? {
            Some(bank) => bank.base,
            None => Params::from_toml(text).map_err(Error::from)?,
        },
        (None, Some(sections)) => Params::from_table(&to_table(sections)?).map_err(Error::from)?,
        (None, None) => {
            let model = model.map_or(Ok(Model::ApgStmd), str::parse).map_err(Error::from)?;
            match preset {
                Some(preset) => Params::for_model(model).with_preset(parse_preset(preset)?),
                None => Params::usual(model),
            }
        }
    };
    if let Some(speed) = speed {
        params = params.for_speed(speed).map_err(Error::from)?;
    }
    Ok(params.with_table(&to_table(overrides)?).map_err(Error::from)?.to_toml())
}

fn parse_preset(text: &str) -> Result<Preset, Error> {
    match text {
        "practical" => Ok(Preset::Practical),
        "paper" => Ok(Preset::Paper),
        _ => Err(Error::Value(format!("preset is '{text}', but it must be 'practical' or 'paper'"))),
    }
}

fn to_table(sections: &Bound<'_, PyDict>) -> PyResult<Table> {
    let mut table = Table::new();
    for (section, fields) in sections {
        // `model` stands in no section.
        if let Ok(text) = fields.cast::<PyString>() {
            table.insert(section.extract()?, Value::String(text.extract()?));
            continue;
        }
        let mut into = Table::new();
        for (name, value) in fields.cast::<PyDict>()? {
            let name: String = name.extract()?;
            let value = to_toml(&value).ok_or_else(|| {
                let kind = value.get_type().to_string();
                Error::Type(format!("{section}.{name} must be a number, a string, a bool or a list, not {kind}"))
            })?;
            into.insert(name, value);
        }
        table.insert(section.extract()?, Value::Table(into));
    }
    Ok(table)
}

/// Plain and NumPy scalars alike; bool before int, because Python's bool is one.
pub(crate) fn to_toml(value: &Bound<'_, PyAny>) -> Option<Value> {
    if let Ok(text) = value.cast::<PyString>() {
        return text.extract().ok().map(Value::String);
    }
    if value.is_instance_of::<PyBool>() || value.get_type().name().is_ok_and(|name| name == "bool") {
        return value.is_truthy().ok().map(Value::Boolean);
    }
    if let Ok(number) = value.extract::<i64>() {
        return Some(Value::Integer(number));
    }
    if let Ok(number) = value.extract::<f64>() {
        return Some(Value::Float(number));
    }
    if value.is_instance_of::<PyDict>() {
        return None;
    }
    value.try_iter().ok()?.map(|item| to_toml(&item.ok()?)).collect::<Option<Vec<_>>>().map(Value::Array)
}

/// What `kernels` hands out: (scale, orientation, map), (direction, map), the map of lateral inhibition, (name, taps).
type Kernels<'py> = (
    Vec<(f64, f64, Bound<'py, PyArray2<f64>>)>,
    Vec<(f64, Bound<'py, PyArray2<f64>>)>,
    Bound<'py, PyArray2<f64>>,
    Vec<(&'static str, Bound<'py, PyArray1<f64>>)>,
);

/// The kernels that a full parameter file stands for.
#[pyfunction]
pub fn kernels<'py>(py: Python<'py>, params: &str) -> PyResult<Kernels<'py>> {
    let params = Params::from_toml(params).map_err(Error::from)?;
    let turns = |count: usize| (0..count).map(|k| k as f64 * FRAC_PI_4);
    let spots = params.attention.scales.iter().flat_map(|&scale| {
        turns(DIRECTIONS / 2).map(move |angle| (scale, angle, attention(scale, angle).into_pyarray(py)))
    });
    let rings = turns(DIRECTIONS).map(|angle| (angle, prediction(&params, angle).into_pyarray(py)));
    let curves = temporal(&params).map(|(name, taps)| (name, taps.into_pyarray(py)));
    Ok((spots.collect(), rings.collect(), lateral(&params).into_pyarray(py), curves.into()))
}
