//! What E is tuned to: contrast, velocity, width and height of a target that crosses white to the right.

use apgstmd_core::stimulus::Target;

use super::check::{Check, Wanted};
use super::condition::{Condition, Recorder, Region, SPEED, params, steps, straight, white};
use super::record::{Record, Records};
use super::{Experiment, Extent, Work};
use crate::plot::{Axis, Curves, Figure, Look, Panel, Plot, Series};

pub const CONTRAST: Experiment = Experiment {
    name: "contrast-tuning",
    title: "Contrast tuning",
    paper: "The more a target differs from its background, the stronger the response; it is strongest at Weber contrast 1.",
    method: "A 5 x 5 px target on white at 250 px/s, one run for each contrast; the largest E anywhere. Three signals, each \
             proportional to contrast, are multiplied, so E must follow its cube. Attention off.",
    caption: "Largest E over Weber contrast. Dashed: the cube of the contrast.",
    work: Work::Scenes { conditions: contrasts, conclude: of_contrast },
};

pub const VELOCITY: Experiment = Experiment {
    name: "velocity-tuning",
    title: "Velocity tuning",
    paper: "The response lives between 100 and 800 px/s and is largest at 250 px/s.",
    method: "A black 5 x 5 px target on white, one run for each velocity, at least 25 px of path; the largest E on its axis. \
             Attention off.",
    caption: "Largest E over velocity.",
    work: Work::Scenes { conditions: velocities, conclude: of_velocity },
};

pub const WIDTH: Experiment = Experiment {
    name: "width-tuning",
    title: "Width tuning",
    paper: "Targets up to 18 px wide are answered; 5 px is best.",
    method: "A black target 5 px high on white at 250 px/s, one run for each width; the largest E on its axis. Attention off.",
    caption: "Largest E over the target's width.",
    work: Work::Scenes { conditions: widths, conclude: of_width },
};

pub const HEIGHT: Experiment = Experiment {
    name: "height-tuning",
    title: "Height tuning",
    paper: "Targets up to 13 px high are answered; 5 px is best.",
    method: "A black target 5 px wide on white at 250 px/s, one run for each height; the largest E on its axis. Attention off.",
    caption: "Largest E over the target's height.",
    work: Work::Scenes { conditions: heights, conclude: of_height },
};

/// Where targets start, px.
const START: f64 = 12.0;
/// Row of the path: high targets have their surround inside the picture.
const AXIS: usize = 30;

fn contrasts(extent: Extent) -> Vec<Condition> {
    let conditions = steps(0.1, 1.0, extent.pick(0.1, 0.05)).into_iter().map(|contrast| {
        // Between two rows: the upper and lower edges of the target cut pixels in half, as they do on average.
        let target = straight([START, 16.5], SPEED, 0.0, 1.0 - contrast);
        condition("contrast", contrast, (56, 34), target, 90, Region::Everywhere)
    });
    conditions.collect()
}

fn velocities(extent: Extent) -> Vec<Condition> {
    let speeds = extent.pick(
        [vec![50.0], steps(100.0, 350.0, 25.0), steps(400.0, 800.0, 100.0)].concat(),
        [steps(25.0, 400.0, 12.5), steps(425.0, 1000.0, 25.0)].concat(),
    );
    let conditions = speeds.into_iter().map(|speed| {
        // Slow ones need time to reach their full response, fast ones room until it comes.
        let frames = (25e3 / speed).clamp(60.0, 1000.0) as usize;
        let width = (2.0 * START + speed / 1000.0 * frames as f64).ceil().max(64.0) as usize;
        let target = straight([START, AXIS as f64], speed, 0.0, 0.0);
        condition("velocity", speed, (width, 2 * AXIS + 1), target, frames, Region::Row(AXIS))
    });
    conditions.collect()
}

fn widths(extent: Extent) -> Vec<Condition> {
    sides("width", extent, |width, target| target.width = width)
}

fn heights(extent: Extent) -> Vec<Condition> {
    sides("height", extent, |height, target| target.height = height)
}

fn sides(factor: &'static str, extent: Extent, set: fn(f64, &mut Target)) -> Vec<Condition> {
    let conditions = steps(1.0, 20.0, extent.pick(1.0, 0.5)).into_iter().map(|side| {
        let mut target = straight([START, AXIS as f64], SPEED, 0.0, 0.0);
        set(side, &mut target);
        condition(factor, side, (64, 2 * AXIS + 1), target, 100, Region::Row(AXIS))
    });
    conditions.collect()
}

fn condition(
    factor: &'static str,
    value: f64,
    (width, height): (usize, usize),
    target: Target,
    frames: usize,
    region: Region,
) -> Condition {
    let mut params = params(false);
    // Only E is asked for.
    params.prediction.enabled = false;
    Condition {
        factors: vec![(factor, value)],
        scene: white(width, height, frames, vec![target]),
        params,
        recorders: vec![Recorder::peaks("response", 0..frames, region)],
    }
}

fn e(record: &Record) -> f64 {
    record.peaks("response").e()
}

fn of_contrast(records: &Records) -> (Figure, Vec<Check>) {
    let curve = records.curve("contrast", e);
    let growth = curve.windows(2).map(|pair| pair[1].1 / pair[0].1).fold(f64::INFINITY, f64::min);
    let [half, whole] = [0.5, 1.0].map(|contrast| e(records.one(&[("contrast", contrast)])));
    let checks = vec![
        Check::new("least growth of E from one contrast to the next", growth, "times", Wanted::Above(1.0)),
        // 1 % of 0.125: the curve is homogeneous of degree 3 but for the response floor.
        Check::new("E at contrast 0.5 over E at 1", half / whole, "", Wanted::Between(0.12375, 0.12625)),
        // 1 %: where the target stands within a pixel changes its first, largest response by half a percent.
        Check::new("largest E, black on white", 1e4 * whole, "x 1e-4", Wanted::Between(8.56, 8.74)),
    ];
    let cube = steps(0.0, 1.0, 0.02).into_iter().map(|c| (c, whole * c.powi(3))).collect();
    let series = vec![
        Series { name: "E".into(), points: curve, ..Series::default() },
        Series { name: "cube".into(), points: cube, look: Look::Dashed, color: Some(7), ..Series::default() },
    ];
    (figure("Weber contrast", Some((0.0, 1.0)), series, vec![]), checks)
}

fn of_velocity(records: &Records) -> (Figure, Vec<Check>) {
    let curve = records.curve("velocity", e);
    let (best, most) = maximum(&curve);
    let share = |speed: f64| 100.0 * e(records.one(&[("velocity", speed)])) / most;
    let checks = vec![
        Check::new("velocity of the largest E", best, "px/s", Wanted::Between(200.0, 275.0)),
        Check::new("E at 100 px/s, of the largest", share(100.0), "%", Wanted::Below(20.0)),
        Check::new("E at 800 px/s, of the largest", share(800.0), "%", Wanted::Below(2.0)),
    ];
    let highest = curve.last().map_or(1000.0, |last| last.0);
    let span = vec![(200.0, 275.0, "where the maximum must be".to_owned())];
    (figure("velocity, px/s", Some((0.0, highest)), vec![Series { points: curve, ..Series::default() }], span), checks)
}

fn of_width(records: &Records) -> (Figure, Vec<Check>) {
    of_side(records, "width", (5.0, 8.0), (18.0, 8.0))
}

fn of_height(records: &Records) -> (Figure, Vec<Check>) {
    of_side(records, "height", (5.0, 7.0), (13.0, 6.0))
}

/// `best`: where the maximum must be. `large`: a side, and the share of the maximum in % that E must be below there.
fn of_side(records: &Records, factor: &str, best: (f64, f64), large: (f64, f64)) -> (Figure, Vec<Check>) {
    let curve = records.curve(factor, e);
    let (side, most) = maximum(&curve);
    let share = 100.0 * e(records.one(&[(factor, large.0)])) / most;
    let checks = vec![
        Check::new(format!("{factor} of the largest E"), side, "px", Wanted::Between(best.0, best.1)),
        Check::new(format!("E at {factor} {}, of the largest", large.0), share, "%", Wanted::Below(large.1)),
    ];
    let span = vec![(best.0, best.1, "where the maximum must be".to_owned())];
    let series = vec![Series { points: curve, ..Series::default() }];
    (figure(&format!("{factor}, px"), Some((0.0, 20.0)), series, span), checks)
}

fn maximum(curve: &[(f64, f64)]) -> (f64, f64) {
    curve.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((f64::NAN, f64::NAN))
}

fn figure(x: &str, range: Option<(f64, f64)>, series: Vec<Series>, spans: Vec<(f64, f64, String)>) -> Figure {
    let curves = Curves {
        x: Axis { label: x.to_owned(), range, ..Axis::default() },
        y: Axis { label: "largest E".into(), ..Axis::default() },
        series,
        spans,
        marks: Vec::new(),
    };
    let title = format!("E over {}", x.split(',').next().unwrap_or(x));
    Figure { columns: 1, panels: vec![Panel::new(title, Plot::Curves(curves))] }
}
