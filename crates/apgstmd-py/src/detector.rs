//! One stream's detector. The GIL is released while it computes; two threads at once are an error, not a wait.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, TryLockError};

use apgstmd_core::{Detection, EgoMotion, Model, Params, Region, Size, Stage};
use ndarray::Axis;
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arrays::Borrowed;
use crate::errors::Error;
use crate::maps::{Kept, Map, Maps};
use crate::state;

type Column<'py, T> = Bound<'py, PyArray1<T>>;
/// rotation, zoom, residual, unexplained.
pub(crate) type Ego = (f32, f32, f32, bool);
/// Response, direction, detections, background shift, its rotation and zoom, whether the scene was cut.
type Output<'py> = (Map<'py>, Map<'py>, Columns<'py>, (f32, f32), Ego, bool);
/// x, y, score, direction, trace.
type Columns<'py> = (Column<'py, f32>, Column<'py, f32>, Column<'py, f32>, Column<'py, f32>, Column<'py, i64>);

#[pyclass(module = "apgstmd._core", frozen)]
pub struct Detector {
    detector: Mutex<apgstmd_core::Detector>,
    kept: Kept,
    size: Size,
    #[pyo3(get)]
    bit_depth: Option<u32>,
    /// Threads do not survive a fork: a copy in a child process would wait for them for ever.
    process: u32,
    #[pyo3(get)]
    params: String,
    #[pyo3(get)]
    threads: usize,
    #[pyo3(get)]
    latency: usize,
    #[pyo3(get)]
    lag: f32,
    model: Model,
}

#[pymethods]
impl Detector {
    #[new]
    fn new(
        height: usize,
        width: usize,
        params: &str,
        threads: Option<usize>,
        bit_depth: Option<u32>,
    ) -> PyResult<Self> {
        if let Some(bits) = bit_depth.filter(|bits| !(1..=16).contains(bits)) {
            return Err(Error::Value(format!("bit_depth is {bits}, but it must lie between 1 and 16")).into());
        }
        let size = Size::new(height, width);
        let read = Params::from_toml(params).map_err(Error::from)?;
        let detector = match threads {
            Some(threads) => apgstmd_core::Detector::with_threads(size, &read, threads),
            None => apgstmd_core::Detector::new(size, &read),
        }
        .map_err(Error::from)?;
        Ok(Self {
            bit_depth,
            kept: Kept::default(),
            size,
            process: std::process::id(),
            params: params.to_owned(),
            threads: detector.threads(),
            latency: detector.latency(),
            lag: detector.lag(),
            model: read.model,
            detector: Mutex::new(detector),
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
        let (done, mut response) = self.run(py, move |detector| {
            let mut response = room.unwrap_or_else(|| detector.make_response());
            (detector.process_into(frame, &mut response), response)
        })?;
        done.map_err(Error::from)?;
        let (detections, cut) = (columns(py, &response.detections), response.cut);
        let (shift, motion) = (response.background_shift, ego(response.ego_motion));
        response.detections.clear();
        let (map, direction) = maps.fill(py, response, &self.kept);
        Ok((map, direction, detections, shift, motion, cut))
    }

    #[getter]
    fn model(&self) -> &'static str {
        self.model.name()
    }

    #[getter]
    fn stages<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.model.stages().iter().map(|stage| stage.name()))
    }

    fn stage<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let stage: Stage = name.parse().map_err(Error::from)?;
        let maps = self.run(py, |detector| detector.probe().stage(stage))?.map_err(Error::from)?;
        Ok(match stage.planes() {
            1 => maps.index_axis_move(Axis(0), 0).into_pyarray(py).into_any(),
            _ => maps.into_pyarray(py).into_any(),
        })
    }

    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        state::to_dict(py, &self.run(py, apgstmd_core::Detector::state)?)
    }

    fn restore(&self, py: Python<'_>, given: &Bound<'_, PyDict>) -> PyResult<()> {
        let given = state::from_dict(given)?;
        Ok(self.run(py, |detector| detector.restore(&given))?.map_err(Error::from)?)
    }

    fn look_in(&self, py: Python<'_>, mask: Option<PyReadonlyArray2<'_, bool>>) -> PyResult<()> {
        let region = mask.map(|mask| Region::from_mask(mask.as_array())).transpose().map_err(Error::from)?;
        Ok(self.run(py, |detector| detector.look_in(region.as_ref()))?.map_err(Error::from)?)
    }

    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        Ok(self.run(py, apgstmd_core::Detector::reset)?)
    }

    fn frames(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.run(py, |detector| detector.frames())?)
    }
}

impl Detector {
    /// The one gate to the core: no GIL inside, one thread at a time, and no panic gets out.
    fn run<T: Send>(
        &self,
        py: Python<'_>,
        work: impl Send + FnOnce(&mut apgstmd_core::Detector) -> T,
    ) -> Result<T, Error> {
        if self.process != std::process::id() {
            return Err(Error::State("this detector was made before a fork: make one in the new process".into()));
        }
        py.detach(|| {
            catch_unwind(AssertUnwindSafe(|| match self.detector.try_lock() {
                Ok(mut detector) => Ok(work(&mut detector)),
                Err(TryLockError::WouldBlock) => Err(Error::State(
                    "this detector is at work in another thread: make one detector for each stream".into(),
                )),
                Err(TryLockError::Poisoned(_)) => {
                    Err(Error::State("this detector failed in an earlier call: make a new one".into()))
                }
            }))
            .unwrap_or_else(|_| Err(Error::State("apgstmd has a defect, please report it with the lines above".into())))
        })
    }
}

fn columns<'py>(py: Python<'py>, detections: &[Detection]) -> Columns<'py> {
    let column = |value: fn(&Detection) -> f32| PyArray1::from_iter(py, detections.iter().map(value));
    (
        column(|found| found.x),
        column(|found| found.y),
        column(|found| found.score),
        column(|found| found.direction),
        PyArray1::from_iter(py, detections.iter().map(|found| found.trace as i64)),
    )
}

pub(crate) fn ego(EgoMotion { rotation, zoom, residual, unexplained }: EgoMotion) -> Ego {
    (rotation, zoom, residual, unexplained)
}
