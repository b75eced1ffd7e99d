//! A run as it goes on: one frame after the other, with what was found in it.

use std::ffi::OsString;
use std::sync::mpsc::SyncSender;
use std::sync::{Mutex, TryLockError};

use apgstmd_cli::failure::Failure;
use apgstmd_cli::sink::{Seen, Sink};
use apgstmd_core::tracking::TrackPoint;
use apgstmd_core::{Detection, EgoMotion};
use numpy::{Element, PyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyIterator, PyList};

use crate::bank;
use crate::detector::{Ego, ego};
use crate::errors::Error;
use crate::program::{Event, Program, Watch};

type Column<'py, T> = Bound<'py, PyArray1<T>>;
/// frame, track, age; seconds, x, y, vx, vy; score; state.
type Tracks<'py> = (Vec<Column<'py, i64>>, Vec<Column<'py, f64>>, Column<'py, f32>, Bound<'py, PyList>);
/// Frame, name, seconds, detections, tracks, background shift, its rotation and zoom, whether the scene was cut.
type Output<'py> = (usize, String, Option<f64>, bank::Columns<'py>, Tracks<'py>, (f32, f32), Ego, bool);

/// What is kept of a frame.
pub struct Rows {
    frame: usize,
    name: String,
    time: Option<f64>,
    detections: Vec<Detection>,
    tracks: Vec<TrackPoint>,
    background_shift: (f32, f32),
    ego_motion: EgoMotion,
    cut: bool,
}

/// Hands on what it sees, and ends the run where nobody takes it.
pub struct Eye(pub SyncSender<Event>);

impl Sink for Eye {
    fn frame(&mut self, seen: &Seen) -> apgstmd_cli::Outcome {
        let rows = Rows {
            frame: seen.frame,
            name: seen.name.clone(),
            time: seen.time,
            detections: seen.detections.clone(),
            tracks: seen.tracks.clone(),
            background_shift: seen.background_shift,
            ego_motion: seen.ego_motion,
            cut: seen.cut,
        };
        self.0.send(Event::Seen(Box::new(rows))).map_err(|_| Failure::Interrupted)
    }
}

/// `apgstmd run` at work, to be taken frame by frame.
#[pyclass(module = "apgstmd._core", frozen)]
pub struct Running(Mutex<Option<Program>>);

#[pymethods]
impl Running {
    #[new]
    fn new(
        argv: Vec<OsString>,
        frames: Option<Py<PyIterator>>,
        bit_depth: Option<u32>,
        tables: bool,
    ) -> PyResult<Self> {
        let frames = frames.map(|frames| (frames, bit_depth));
        let program = Program::start(argv, frames, Some(Watch { tables }))?;
        Ok(Self(Mutex::new(Some(program))))
    }

    fn next<'py>(&self, py: Python<'py>) -> PyResult<Option<Output<'py>>> {
        let mut place = match self.0.try_lock() {
            Ok(place) => place,
            Err(TryLockError::WouldBlock) => {
                return Err(Error::State("this run is waited for in another thread already".into()).into());
            }
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
        };
        let Some(program) = place.as_mut() else { return Ok(None) };
        match program.next(py) {
            Ok(Some(rows)) => Ok(Some(output(py, *rows)?)),
            end => {
                // Its thread has said its last word.
                place.take();
                end.map(|_| None)
            }
        }
    }

    fn close(&self, py: Python<'_>) {
        let program = self.0.try_lock().ok().and_then(|mut place| place.take());
        py.detach(|| program.map(Program::close));
    }
}

fn output(py: Python<'_>, rows: Rows) -> PyResult<Output<'_>> {
    let Rows { frame, name, time, detections, tracks, background_shift, ego_motion, cut } = rows;
    let detections = bank::columns(py, &detections);
    let whole: [fn(&TrackPoint) -> i64; 3] =
        [|point| point.frame as i64, |point| point.track as i64, |point| i64::from(point.age)];
    let real: [fn(&TrackPoint) -> f64; 5] =
        [|point| point.time.unwrap_or(f64::NAN), |point| point.x, |point| point.y, |point| point.vx, |point| point.vy];
    let tracks = (
        whole.map(|value| column(py, &tracks, value)).into(),
        real.map(|value| column(py, &tracks, value)).into(),
        column(py, &tracks, |point| point.score),
        PyList::new(py, tracks.iter().map(|point| point.state.name()))?,
    );
    Ok((frame, name, time, detections, tracks, background_shift, ego(ego_motion), cut))
}

fn column<'py, T: Element>(py: Python<'py>, points: &[TrackPoint], value: fn(&TrackPoint) -> T) -> Column<'py, T> {
    PyArray1::from_iter(py, points.iter().map(value))
}
