//! What prediction adds: at a pixel over time, and in the plane.

use ndarray::{Array2, s};

use super::check::{Check, Wanted};
use super::condition::{Condition, FRAMES_PER_PX, Recorder, SPEED, What, params, straight, white};
use super::record::Records;
use super::{Experiment, Extent, Work};
use crate::plot::{Axis, Colors, Curves, Figure, Grid, Look, Map, Panel, Plot, Series};

pub const TIME: Experiment = Experiment {
    name: "facilitation-time",
    title: "Facilitation over time",
    paper: "At a pixel the plain response comes and peaks within 7 to 8 ms; with prediction it builds up over about 50 ms and \
            becomes twice as strong.",
    method: "A black 5 x 5 px target on white at 250 px/s; E and Q for motion to the right, at one pixel of its path. A \
             response has begun at 1 % of its maximum. Attention off: E is what the target alone gives.",
    caption: "The plain response E and the facilitated response Q at a pixel of the path.",
    work: Work::Scenes { conditions: over_time, conclude: of_time },
};

pub const SPACE: Experiment = Experiment {
    name: "facilitation-space",
    title: "Facilitation in space",
    paper: "Prediction strengthens the response in a broad region ahead of the target.",
    method: "The same target; E and Q for motion to the right in the plane, at 320 ms. Ahead: more than 2 px beyond the place \
             where E is largest. Attention off.",
    caption: "(a) Plain and (b) facilitated response in the plane, in the same colours. Ring: the target.",
    work: Work::Scenes { conditions: in_space, conclude: of_space },
};

const AXIS: usize = 20;
/// Where the target starts, px.
const START: f64 = 10.0;
/// The pixel that is watched.
const PIXEL: usize = 56;
/// The frame that is shown, 320 ms.
const SHOWN: usize = 320;

fn over_time(_: Extent) -> Vec<Condition> {
    let frames = 280;
    vec![Condition {
        factors: vec![],
        scene: white(100, 2 * AXIS + 1, frames, vec![straight([START, AXIS as f64], SPEED, 0.0, 0.0)]),
        params: params(false),
        recorders: vec![Recorder {
            name: "pixel",
            frames: 0..frames,
            what: What::Course { x: PIXEL, y: AXIS, direction: 0 },
        }],
    }]
}

fn of_time(records: &Records) -> (Figure, Vec<Check>) {
    let course = records.one(&[]).course("pixel");
    let e: Vec<f64> = course.iter().map(|seen| seen.1).collect();
    let q: Vec<f64> = course.iter().map(|seen| seen.2).collect();
    let ((e_most, e_rise), (q_most, q_rise)) = (rise(&e), rise(&q));
    let checks = vec![
        Check::new("E from onset to peak", e_rise, "frames", Wanted::Between(7.0, 8.0)),
        Check::new("Q from onset to peak", q_rise, "frames", Wanted::AtLeast(40.0)),
        Check::new("largest Q over largest E", q_most / e_most, "", Wanted::Between(2.0, 2.3)),
    ];
    // From well before the first response until all is over.
    let shown = |values: &[f64]| course.iter().zip(values).map(|(seen, v)| (seen.0 as f64, *v)).collect();
    let series = vec![
        Series { name: "E, plain".into(), points: shown(&e), look: Look::Line, ..Series::default() },
        Series { name: "Q, facilitated".into(), points: shown(&q), look: Look::Line, ..Series::default() },
    ];
    let curves = Curves {
        x: Axis { label: "time, ms".into(), range: Some((120.0, 280.0)), ..Axis::default() },
        y: Axis { label: "response".into(), ..Axis::default() },
        series,
        marks: vec![(FRAMES_PER_PX * (PIXEL as f64 - START), "target passes".into())],
        ..Curves::default()
    };
    (Figure { columns: 1, panels: vec![Panel::new("E and Q at a pixel", Plot::Curves(curves))] }, checks)
}

/// The largest value, and the frames from 1 % of it to itself.
fn rise(curve: &[f64]) -> (f64, f64) {
    let most = curve.iter().copied().fold(0.0, f64::max);
    let onset = curve.iter().position(|v| *v > 0.01 * most);
    let peak = curve.iter().position(|v| *v == most);
    let frames = onset.zip(peak).map_or(f64::NAN, |(onset, peak)| peak as f64 - onset as f64);
    (most, frames)
}

/// The part of the picture that is shown.
const COLUMNS: std::ops::Range<usize> = 64..114;
const ROWS: std::ops::Range<usize> = 5..36;

fn in_space(_: Extent) -> Vec<Condition> {
    vec![Condition {
        factors: vec![],
        scene: white(124, 2 * AXIS + 1, SHOWN + 1, vec![straight([START, AXIS as f64], SPEED, 0.0, 0.0)]),
        params: params(false),
        recorders: vec![Recorder {
            name: "plane",
            frames: SHOWN..SHOWN + 1,
            what: What::Map { x: COLUMNS, y: ROWS, direction: Some(0) },
        }],
    }]
}

fn of_space(records: &Records) -> (Figure, Vec<Check>) {
    let ((left, top), e, q) = records.one(&[]).map("plane");
    let largest = |map: &Array2<f64>| map.iter().copied().fold(0.0, f64::max);
    let most = largest(e);
    let peak = e.indexed_iter().max_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |((_, x), _)| x);
    let gain = q - e;
    let side = |part: ndarray::ArrayView2<'_, f64>| 100.0 * part.iter().copied().fold(0.0, f64::max) / most;
    let ahead = side(gain.slice(s![.., peak + 3..]));
    let behind = side(gain.slice(s![.., ..peak.saturating_sub(2)]));
    // The target's front edge lies 2.5 px before its middle.
    let front = (START + SHOWN as f64 / FRAMES_PER_PX + 2.5).ceil() as usize - left;
    let wide = gain.slice(s![.., front..]).iter().filter(|v| **v > 0.01 * most).count();
    let checks = vec![
        Check::new("Q - E ahead of the response, of the largest E", ahead, "%", Wanted::Above(20.0)),
        Check::new("the same over that behind it", ahead / behind, "times", Wanted::Above(1.3)),
        Check::new("pixels ahead of the target itself where it is above 1 %", wide as f64, "", Wanted::Above(0.0)),
    ];
    let target = START + SHOWN as f64 / FRAMES_PER_PX;
    let panel = |title: &str, values: &Array2<f64>| {
        let map = Map {
            values: values.clone(),
            x: Grid { label: "x, px".into(), first: left as f64, step: 1.0 },
            y: Grid { label: "y, px".into(), first: top as f64, step: 1.0 },
            label: "response".into(),
            colors: Colors::Viridis,
            range: Some((0.0, largest(q))),
            marks: vec![(target, AXIS as f64, String::new())],
            lines: vec![],
        };
        Panel::new(title, Plot::Map(map))
    };
    (
        Figure { columns: 2, panels: vec![panel("(a) plain response E", e), panel("(b) facilitated response Q", q)] },
        checks,
    )
}
