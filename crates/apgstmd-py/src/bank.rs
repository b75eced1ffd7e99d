//! One stream's bank of detectors. The GIL is released while it computes; two threads at once are an error, not a wait.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, TryLockError};

use apgstmd_core::{BankParams, Detection, Machine, Params, Region, Size};
use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::Borrowed;
use crate::detector::{Ego, ego};
use crate::errors::Error;
use crate::maps::{Kept, Map, Maps};
use crate::state;

pub(crate) type Column<'py, T> = Bound<'py, PyArray1<T>>;
/// x, y, score, direction, speed, size, contrast; then trace.
pub(crate) type Columns<'py> = (Vec<Column<'py, f32>>, Column<'py, i64>);
/// Response, direction, detections, background shift, its rotation and zoom, whether the scene was cut.
type Output<'py> = (Map<'py>, Map<'py>, Columns<'py>, (f32, f32), Ego, bool);

#[pyclass(module = "apgstmd._core", frozen)]
pub struct Bank {
    bank: Mutex<apgstmd_core::Bank>,
    kept: Kept,
    size: Size,
    #[pyo3(get)]
    bit_depth: Option<u32>,
    /// Threads do not survive a fork: a copy in a child process would wait for them for ever.
    process: u32,
    #[pyo3(get)]
    params: String,
    /// All of its parameters, as a file.
    #[pyo3(get)]
    file: String,
    #[pyo3(get)]
    threads: usize,
    #[pyo3(get)]
    latency: usize,
    /// Speed, px/frame, and size, px, of each.
    #[pyo3(get)]
    members: Vec<(f64, f64)>,
}

#[pymethods]
impl Bank {
    #[new]
    #[expect(clippy::too_many_arguments, reason = "called from one place, by position")]
    fn new(
        height: usize,
        width: usize,
        params: &str,
        file: Option<&str>,
        speeds: Option<Vec<f64>>,
        sizes: Option<Vec<f64>>,
        contrast: Option<f32>,
        threads: Option<usize>,
        bit_depth: Option<u32>,
    ) -> PyResult<Self> {
        if let Some(bits) = bit_depth.filter(|bits| !(1..=16).contains(bits)) {
            return Err(Error::Value(format!("bit_depth is {bits}, but it must lie between 1 and 16")).into());
        }
        let base = Params::from_toml(params).map_err(Error::from)?;
        let file = file.map(BankParams::from_toml).transpose().map_err(Error::from)?.flatten();
        let mut bank = match file {
            Some(file) if speeds.is_none() && sizes.is_none() => BankParams { base, ..file },
            _ => BankParams::choose(base, speeds.as_deref(), sizes.as_deref()),
        };
        if let Some(contrast) = contrast {
            bank.contrast = contrast;
        }
        let machine = threads.map_or_else(Machine::default, Machine::with_threads);
        let made = apgstmd_core::Bank::with_options(Size::new(height, width), &bank, &machine).map_err(Error::from)?;
        let size = bank.base.target_size();
        Ok(Self {
            bit_depth,
            kept: Kept::default(),
            size: made.size(),
            file: bank.to_toml(),
            process: std::process::id(),
            params: params.to_owned(),
            threads: made.threads(),
            latency: made.latency(),
            members: made.members().map(|member| (member.speed, size * member.scale as f64)).collect(),
            bank: Mutex::new(made),
        })
    }

    #[pyo3(signature = (frame, out=None))]
    fn process<'py>(
        &self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Output<'py>> {
        let borrowed = Borrowed::new(frame, self.bit_depth)?;
        let maps = Maps::new(out, self.size)?;
        let (frame, room) = (borrowed.frame(), maps.room(&self.kept));
        let (done, mut response) = self.run(py, move |bank| {
            let mut response = room.unwrap_or_else(|| bank.make_response());
            (bank.process_into(frame, &mut response), response)
        })?;
        done.map_err(Error::from)?;
        let (detections, cut) = (columns(py, &response.detections), response.cut);
        let (shift, motion) = (response.background_shift, ego(response.ego_motion));
        response.detections.clear();
        let (map, direction) = maps.fill(py, response, &self.kept);
        Ok((map, direction, detections, shift, motion, cut))
    }

    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        state::to_dict(py, &self.run(py, apgstmd_core::Bank::state)?)
    }

    fn restore(&self, py: Python<'_>, given: &Bound<'_, PyDict>) -> PyResult<()> {
        let given = state::from_dict(given)?;
        Ok(self.run(py, |bank| bank.restore(&given))?.map_err(Error::from)?)
    }

    fn look_in(&self, py: Python<'_>, mask: Option<PyReadonlyArray2<'_, bool>>) -> PyResult<()> {
        let region = mask.map(|mask| Region::from_mask(mask.as_array())).transpose().map_err(Error::from)?;
        Ok(self.run(py, |bank| bank.look_in(region.as_ref()))?.map_err(Error::from)?)
    }

    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        Ok(self.run(py, apgstmd_core::Bank::reset)?)
    }

    fn frames(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.run(py, |bank| bank.frames())?)
    }
}

impl Bank {
    /// The one gate to the core: no GIL inside, one thread at a time, and no panic gets out.
    fn run<T: Send>(&self, py: Python<'_>, work: impl Send + FnOnce(&mut apgstmd_core::Bank) -> T) -> Result<T, Error> {
        if self.process != std::process::id() {
            return Err(Error::State("this bank was made before a fork: make one in the new process".into()));
        }
        py.detach(|| {
            catch_unwind(AssertUnwindSafe(|| match self.bank.try_lock() {
                Ok(mut bank) => Ok(work(&mut bank)),
                Err(TryLockError::WouldBlock) => {
                    Err(Error::State("this bank is at work in another thread: make one bank for each stream".into()))
                }
                Err(TryLockError::Poisoned(_)) => {
                    Err(Error::State("this bank failed in an earlier call: make a new one".into()))
                }
            }))
            .unwrap_or_else(|_| Err(Error::State("apgstmd has a defect, please report it with the lines above".into())))
        })
    }
}

pub(crate) fn columns<'py>(py: Python<'py>, detections: &[Detection]) -> Columns<'py> {
    let values: [fn(&Detection) -> f32; 7] = [
        |found| found.x,
        |found| found.y,
        |found| found.score,
        |found| found.direction,
        |found| found.speed,
        |found| found.size,
        |found| found.contrast,
    ];
    let columns = values.map(|value| PyArray1::from_iter(py, detections.iter().map(value)));
    (columns.into(), PyArray1::from_iter(py, detections.iter().map(|found| found.trace as i64)))
}
