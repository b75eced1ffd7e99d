//! Detections against truth, from files or columns; the result as JSON.

use std::path::{Path, PathBuf};

use apgstmd_cli::judge::{Found, Frames, RunFrames, judge, read_detections, read_truth};
use apgstmd_cli::report::{Report, json, write_page};
use apgstmd_core::evaluation::{Scored, Tracked, TruthBox};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

use crate::errors::Error;

type Whole<'py> = PyReadonlyArray1<'py, i64>;
type Real<'py> = PyReadonlyArray1<'py, f64>;
type Flag<'py> = PyReadonlyArray1<'py, bool>;

/// The columns frame, track, x, y.
type TrackColumns<'py> = (Whole<'py>, Whole<'py>, Real<'py>, Real<'py>);

/// A path, or the columns frame, x, y, score, direction (NaN: unknown) and the run.json that tells of their frames.
#[derive(FromPyObject)]
pub enum Detections<'py> {
    Columns(Whole<'py>, Real<'py>, Real<'py>, Real<'py>, Real<'py>, Option<String>),
    File(PathBuf),
}

/// A path, or the columns frame, id, x, y, w, h, visible, ignore.
#[derive(FromPyObject)]
pub enum Truth<'py> {
    Columns(Whole<'py>, Option<Whole<'py>>, Real<'py>, Real<'py>, Real<'py>, Real<'py>, Flag<'py>, Flag<'py>),
    File(PathBuf),
}

/// Judges `detections` in the frames that run.json, `frames` or they themselves tell of, from `start` to `stop`.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub fn evaluate(
    py: Python<'_>,
    detections: Detections<'_>,
    tracks: Option<TrackColumns<'_>>,
    truth: Truth<'_>,
    frames: Option<usize>,
    start: usize,
    stop: Option<usize>,
    radius: f64,
    margin: f64,
    html: Option<PathBuf>,
) -> PyResult<String> {
    let (name, found, of_file, run) = detections.read()?;
    let tracks = tracks.as_ref().map(tracked).or(of_file);
    let (truth_name, boxes) = truth.read()?;
    let report = py.detach(|| {
        let judged = Frames::resolve(run.as_ref(), frames, (start, stop), &found, &boxes)?;
        let judgement = judge(&found, tracks.as_deref(), &boxes, &judged, radius, margin)
            .map_err(|error| Error::Value(error.to_string()))?;
        Ok::<_, Error>(Report {
            detections: name,
            truth: truth_name,
            judgement,
            frames: judged.first()..=judged.last(),
            origin: judged.origin().clone(),
            ended_early: run.is_some_and(|run| run.ended_early),
            radius,
            margin,
        })
    })?;
    if let Some(path) = html {
        write_page(&report, &path).map_err(Error::from)?;
    }
    Ok(json(&report))
}

fn tracked((frame, track, x, y): &TrackColumns<'_>) -> Vec<Tracked> {
    let (track, x, y) = (track.as_array(), x.as_array(), y.as_array());
    let row = |(i, frame): (usize, &i64)| Tracked { frame: *frame as usize, track: track[i], x: x[i], y: y[i] };
    frame.as_array().iter().enumerate().map(row).collect()
}

/// Where from, detections, tracks, and which frames there were.
type Read = (PathBuf, Vec<Scored>, Option<Vec<Tracked>>, Option<RunFrames>);

impl Detections<'_> {
    fn read(self) -> Result<Read, Error> {
        match self {
            Self::File(path) => {
                let Found { detections, tracks, run, .. } = read_detections(&path)?;
                Ok((path, detections, tracks, run))
            }
            Self::Columns(frame, x, y, score, direction, run) => {
                let (x, y, score, direction) = (x.as_array(), y.as_array(), score.as_array(), direction.as_array());
                let row = |(i, frame): (usize, &i64)| Scored {
                    frame: *frame as usize,
                    x: x[i],
                    y: y[i],
                    score: score[i],
                    direction: Some(direction[i]).filter(|angle| !angle.is_nan()),
                };
                let found = frame.as_array().iter().enumerate().map(row).collect();
                let run = run.map(|text| RunFrames::parse(&text, Path::new("the run"))).transpose()?.flatten();
                Ok(("detections".into(), found, None, run))
            }
        }
    }
}

impl Truth<'_> {
    fn read(self) -> Result<(PathBuf, Vec<TruthBox>), Error> {
        match self {
            Self::File(path) => {
                let boxes = read_truth(&path)?;
                Ok((path, boxes))
            }
            Self::Columns(frame, id, x, y, w, h, visible, ignore) => {
                let (x, y, w, h) = (x.as_array(), y.as_array(), w.as_array(), h.as_array());
                let (visible, ignore) = (visible.as_array(), ignore.as_array());
                let id = id.as_ref().map(|id| id.as_array());
                let row = |(i, frame): (usize, &i64)| TruthBox {
                    id: id.map(|id| id[i]),
                    visible: visible[i],
                    ignore: ignore[i],
                    ..TruthBox::new(*frame as usize, [x[i], y[i], w[i], h[i]])
                };
                Ok(("truth".into(), frame.as_array().iter().enumerate().map(row).collect()))
            }
        }
    }
}
