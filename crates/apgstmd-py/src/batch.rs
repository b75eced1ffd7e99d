//! Many videos: all of them here, or one by one wherever Python sends them.

use std::collections::BTreeMap;
use std::ffi::OsString;

use apgstmd_cli::args::{Arguments, BatchArgs, Command};
use apgstmd_cli::batch::{Job, Record, process};
use apgstmd_cli::failure::Failure;
use clap::Parser;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

use crate::errors::Error;
use crate::program::attended;

/// Name, input, folder of the batch, flags, sums of the files they name, threads: as Python can send it elsewhere.
type Sent = (String, OsString, OsString, Vec<OsString>, BTreeMap<String, String>, usize);

/// A folder of results and what is to be done in it.
#[pyclass(module = "apgstmd._core")]
pub struct Batch {
    inner: apgstmd_cli::batch::Batch,
}

#[pymethods]
impl Batch {
    #[new]
    fn new(py: Python<'_>, argv: Vec<OsString>) -> PyResult<Self> {
        let args = arguments(argv)?;
        let inner = py.detach(|| apgstmd_cli::batch::Batch::open(&args)).map_err(raised)?;
        Ok(Self { inner })
    }

    #[getter]
    fn jobs(&self) -> Vec<Sent> {
        let sent = |job: &Job| {
            let Job { name, input, out, flags, flag_files, threads } = job.clone();
            (name, input.into(), out.into(), flags, flag_files, threads)
        };
        self.inner.jobs().iter().map(sent).collect()
    }

    fn add(&mut self, record: &str) -> PyResult<()> {
        Record::parse(record).and_then(|record| self.inner.add(record)).map_err(raised)
    }

    fn lost(&mut self, name: &str, why: &str) -> PyResult<()> {
        self.inner.lost(name, why).map_err(raised)
    }

    fn finish(&mut self, interrupted: bool) -> PyResult<Vec<String>> {
        self.inner.finish(interrupted).map(texts).map_err(raised)
    }
}

/// Does one job and returns its record.
#[pyfunction]
pub fn clip(py: Python<'_>, job: Sent) -> PyResult<String> {
    let (name, input, out, flags, flag_files, threads) = job;
    let job = Job { name, input: input.into(), out: out.into(), flags, flag_files, threads };
    let finished = py.detach(|| process(&job, &|| false)).map_err(raised)?;
    Ok(finished.record.text())
}

/// All of them on this machine; returns the records.
#[pyfunction]
pub fn batch(py: Python<'_>, argv: Vec<OsString>) -> PyResult<Vec<String>> {
    let args = arguments(argv)?;
    attended(py, move || apgstmd_cli::commands::batch::run(&args))?.map(texts).map_err(raised)
}

fn texts(records: Vec<Record>) -> Vec<String> {
    records.iter().map(Record::text).collect()
}

fn arguments(argv: Vec<OsString>) -> PyResult<BatchArgs> {
    match Arguments::try_parse_from(argv).map_err(|error| raised(error.into()))?.command {
        Command::Batch(args) => Ok(*args),
        _ => Err(Error::Value("these are no arguments of `apgstmd batch`".into()).into()),
    }
}

fn raised(failure: Failure) -> PyErr {
    match failure {
        Failure::Interrupted => PyKeyboardInterrupt::new_err(()),
        failure => Error::from(failure).into(),
    }
}
