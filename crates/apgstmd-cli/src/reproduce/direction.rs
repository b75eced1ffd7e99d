//! Direction tuning: eight motions, eight preferred directions.

use std::f64::consts::FRAC_PI_4;

use apgstmd_core::DIRECTIONS;

use super::check::{Check, Wanted};
use super::condition::{Condition, Recorder, Region, SPEED, params, straight, white};
use super::record::Records;
use super::{Experiment, Extent, Work};
use crate::plot::{Figure, Panel, Plot, Polar};

pub const EXPERIMENT: Experiment = Experiment {
    name: "direction-tuning",
    title: "Direction tuning",
    paper: "A neuron answers most to motion along its preferred direction, clearly less to its neighbours' and not at all to \
            the opposite one.",
    method: "A black 5 x 5 px target on white at 250 px/s in each of the eight directions; the largest E of each preferred \
             direction. Across the path a square lies better or worse on the grid of pixels, so each is the mean over places \
             between two pixels. Attention off.",
    caption: "Largest E of the eight preferred directions: (a) for motion to the right, (b) for all eight motions. Each ring \
              is a quarter.",
    work: Work::Scenes { conditions, conclude },
};

/// Side of the picture, px.
const SIDE: usize = 49;
const FRAMES: usize = 85;

fn conditions(extent: Extent) -> Vec<Condition> {
    let places = extent.pick(4, 8);
    let conditions = (0..DIRECTIONS).flat_map(|motion| {
        (0..places).map(move |place| {
            let angle = motion as f64 * FRAC_PI_4;
            let offset = place as f64 / places as f64;
            // Through the middle after 40 frames; shifted up by a part of a pixel, or to the right when it moves up or down.
            let before = 40.0 * SPEED / 1000.0;
            let shift = if motion % 4 == 2 { [offset, 0.0] } else { [0.0, -offset] };
            let start = [24.0 - before * angle.cos() + shift[0], 24.0 + before * angle.sin() + shift[1]];
            let mut params = params(false);
            params.prediction.enabled = false;
            Condition {
                factors: vec![("motion_deg", 45.0 * motion as f64), ("offset_px", offset)],
                scene: white(SIDE, SIDE, FRAMES, vec![straight(start, SPEED, angle, 0.0)]),
                params,
                recorders: vec![Recorder::peaks("response", 0..FRAMES, Region::Everywhere)],
            }
        })
    });
    conditions.collect()
}

fn conclude(records: &Records) -> (Figure, Vec<Check>) {
    // curves[motion][preferred]
    let curves: [[f64; DIRECTIONS]; DIRECTIONS] = std::array::from_fn(|motion| {
        let factor = [("motion_deg", 45.0 * motion as f64)];
        let seen: Vec<[f64; DIRECTIONS]> = records.all(&factor).map(|record| record.peaks("response").e).collect();
        std::array::from_fn(|k| seen.iter().map(|e| e[k]).sum::<f64>() / seen.len() as f64)
    });
    let own: [f64; DIRECTIONS] = std::array::from_fn(|motion| curves[motion][motion]);
    let matched = (0..DIRECTIONS).filter(|motion| curves[*motion].iter().all(|e| *e <= own[*motion])).count();
    let opposite = (0..DIRECTIONS).map(|motion| curves[motion][(motion + 4) % DIRECTIONS] / own[motion]);
    let axes = [0, 2, 4, 6].map(|k: usize| own[k]);
    let mean = axes.iter().sum::<f64>() / 4.0;
    let farthest = |values: &[f64]| values.iter().map(|v| 100.0 * (v / mean - 1.0).abs()).fold(0.0, f64::max);
    let checks = vec![
        Check::new("motions whose maximum is at their own direction", matched as f64, "of 8", Wanted::Exactly(8.0)),
        // Equal but for the order of f32 sums.
        Check::new("axes: farthest from their mean", farthest(&axes), "%", Wanted::Below(0.01)),
        Check::new(
            "diagonals: farthest from the axes",
            farthest(&[1, 3, 5, 7].map(|k: usize| own[k])),
            "%",
            Wanted::Below(10.0),
        ),
        Check::new(
            "opposite direction, of the maximum",
            100.0 * opposite.fold(0.0, f64::max),
            "%",
            Wanted::Below(10.0),
        ),
    ];
    let polar = |title: &str, series, arrow| Panel::new(title, Plot::Polar(Polar { series, full: None, arrow }));
    let all = (0..DIRECTIONS).map(|motion| (format!("{}°", 45 * motion), curves[motion])).collect();
    let panels = vec![
        polar("(a) motion to the right", vec![(String::new(), curves[0])], Some(0.0)),
        polar("(b) each direction of motion", all, None),
    ];
    (Figure { columns: 2, panels }, checks)
}
