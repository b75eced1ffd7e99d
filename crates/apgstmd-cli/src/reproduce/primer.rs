//! Primer and probe: one target leads to a place and vanishes, another goes on from there.

use std::f64::consts::FRAC_PI_4;
use std::ops::Range;

use apgstmd_core::DIRECTIONS;
use apgstmd_core::stimulus::Target;
use ndarray::Array2;

use super::check::{Check, Wanted};
use super::condition::{Condition, FRAMES_PER_PX, Recorder, Region, SPEED, Zone, params, steps, straight, white};
use super::record::{Record, Records};
use super::{Experiment, Extent, Work};
use crate::plot::{Axis, Colors, Curves, Figure, Grid, Map, Panel, Plot, Polar, Series};

pub const CONTRAST: Experiment = Experiment {
    name: "primer-contrast",
    title: "Primer and probe: contrast",
    paper: "The plain response to the probe does not depend on the primer. With prediction it grows with the primer's \
            contrast, whatever the probe's.",
    method: "On white at 250 px/s: a primer for 30 px, then at once a probe on the same line. The largest Q beyond the primer's \
             end while its gain is fresh (44 to 51 frames later), the largest E 22 to 25 px later, farther from the primer's path \
             than retina, correlation and inhibition reach. Attention off.",
    caption: "Plain and facilitated response to the probe over both contrasts: (a, b) as maps, in the same colours, and (c, d) as \
              curves over the primer's contrast.",
    work: Work::Scenes { conditions: contrasts, conclude: of_contrast },
};

pub const DIRECTION: Experiment = Experiment {
    name: "primer-direction",
    title: "Primer and probe: direction",
    paper: "The plain response is the same for all directions of the probe. With prediction it is largest along the primer's \
            direction.",
    method: "Two black targets on white at 250 px/s: a primer for 30 px, then from its last place a probe in each of the eight \
             directions. The largest Q while the primer's gain is fresh (44 to 51 frames later), the largest E when a probe that \
             turns back no longer meets the primer's wake (76 to 83 frames). Axes and diagonals are compared among themselves: \
             the 3 px between correlated pixels are rounded to whole ones in each. Attention off.",
    caption: "Plain (E) and facilitated response (Q) to the probe over its direction; the arrow is the primer's. E and Q share \
              a scale.",
    work: Work::Scenes { conditions: directions, conclude: of_direction },
};

/// The first frame of the probe.
const SWITCH: usize = 120;
/// When the primer's gain is fresh, and the response to the probe is there.
const FRESH: Range<usize> = SWITCH + 44..SWITCH + 52;
/// Where the probe begins: 30 px from the primer's start.
const LENGTH: f64 = SWITCH as f64 / FRAMES_PER_PX;

/// Something that was recorded of a condition.
type Value = fn(&Record) -> f64;

/// The primer and what follows it.
fn pair(primer: Target, probe: Target) -> Vec<Target> {
    vec![Target { stop: Some(SWITCH), ..primer }, Target { start: SWITCH, ..probe }]
}

fn contrasts(extent: Extent) -> Vec<Condition> {
    let frames = SWITCH + 100;
    let corner = 14.0 + LENGTH;
    let probes = steps(0.2, 1.0, extent.pick(0.4, 0.2));
    let primers = steps(0.0, 1.0, extent.pick(0.25, 0.1));
    let mut conditions = Vec::new();
    for &probe in &probes {
        for &primer in &primers {
            let targets = pair(
                straight([14.0, 20.0], SPEED, 0.0, 1.0 - primer),
                straight([corner, 20.0], SPEED, 0.0, 1.0 - probe),
            );
            let beyond = Zone::fixed([corner + 17.0 + 50.0, 20.0], [50.0, 50.0]);
            conditions.push(Condition {
                factors: vec![("probe", probe), ("primer", primer)],
                scene: white(96, 40, frames, targets),
                params: params(false),
                recorders: vec![
                    Recorder::peaks(
                        "fresh",
                        FRESH,
                        Region::Inside(vec![Zone::fixed([corner + 50.0, 20.0], [50.0, 50.0])]),
                    ),
                    Recorder::peaks("late", frames - 12..frames, Region::Inside(vec![beyond])),
                ],
            });
        }
    }
    conditions
}

fn distinct(records: &Records, factor: &str) -> Vec<f64> {
    let mut values: Vec<f64> = records.0.iter().map(|record| record.factor(factor)).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

fn of_contrast(records: &Records) -> (Figure, Vec<Check>) {
    let (probes, primers) = (distinct(records, "probe"), distinct(records, "primer"));
    let across = |probe: f64, value: Value| -> Vec<f64> {
        primers.iter().map(|primer| value(records.one(&[("probe", probe), ("primer", *primer)]))).collect()
    };
    let (e, fresh, late): (Value, Value, Value) =
        (|seen| seen.peaks("late").e(), |seen| seen.peaks("fresh").q(), |seen| seen.peaks("late").q());
    let uneven = probes.iter().map(|probe| 100.0 * spread(&across(*probe, e))).fold(0.0, f64::max);
    let growth = |q: Value| {
        let steps = probes.iter().flat_map(|probe| {
            let q = across(*probe, q);
            q.windows(2).map(|pair| 100.0 * (pair[1] / pair[0] - 1.0)).collect::<Vec<f64>>()
        });
        steps.fold(f64::INFINITY, f64::min)
    };
    let checks = vec![
        // Equal but for f32: the probe's E is far from where the primer was.
        Check::new("E to the probe: spread over primers", uneven, "%", Wanted::Below(0.01)),
        Check::new("Q to the probe: least growth between primers", growth(fresh), "%", Wanted::Above(0.0)),
        Check::new("the same as late as E", growth(late), "%", Wanted::Above(0.0)),
    ];
    let most = records.0.iter().map(fresh).fold(0.0, f64::max);
    let map = |title: &str, value: Value| {
        // The largest contrast at the top. The cube root is proportional to contrast.
        let rows: Vec<f64> = probes.iter().rev().flat_map(|probe| across(*probe, value)).map(f64::cbrt).collect();
        let step = |values: &[f64]| (values[values.len() - 1] - values[0]) / (values.len() - 1) as f64;
        let map = Map {
            values: Array2::from_shape_vec((probes.len(), primers.len()), rows).expect("a value for each pair"),
            x: Grid { label: "contrast of the primer".into(), first: primers[0], step: step(&primers) },
            y: Grid { label: "contrast of the probe".into(), first: probes[probes.len() - 1], step: -step(&probes) },
            label: "cube root of the response".into(),
            colors: Colors::Viridis,
            range: Some((0.0, most.cbrt())),
            marks: vec![],
            lines: vec![],
        };
        Panel::new(title, Plot::Map(map))
    };
    let curves = |title: &str, value: Value| {
        let series = probes.iter().map(|probe| {
            let points = primers.iter().copied().zip(across(*probe, value)).collect();
            Series { name: format!("probe {probe}"), points, ..Series::default() }
        });
        let curves = Curves {
            x: Axis { label: "contrast of the primer".into(), ..Axis::default() },
            y: Axis { label: "response".into(), logarithmic: true, ..Axis::default() },
            series: series.collect(),
            ..Curves::default()
        };
        Panel::new(title, Plot::Curves(curves))
    };
    let panels = vec![
        map("(a) plain response E", e),
        map("(b) facilitated response Q", fresh),
        curves("(c) plain response E", e),
        curves("(d) facilitated response Q", fresh),
    ];
    (Figure { columns: 2, panels }, checks)
}

fn spread(values: &[f64]) -> f64 {
    let (least, largest) = values.iter().fold((f64::INFINITY, 0.0f64), |(a, b), v| (a.min(*v), b.max(*v)));
    largest / least - 1.0
}

fn directions(extent: Extent) -> Vec<Condition> {
    let (frames, corner) = (SWITCH + 84, [50.0, 50.0]);
    let conditions = (0..extent.pick(2, 4)).flat_map(|primer| {
        (0..DIRECTIONS).map(move |probe| {
            let [before, after] = [primer, probe].map(|k| k as f64 * FRAC_PI_4);
            let start = [corner[0] - LENGTH * before.cos(), corner[1] + LENGTH * before.sin()];
            Condition {
                factors: vec![("primer_deg", 45.0 * primer as f64), ("probe_deg", 45.0 * probe as f64)],
                scene: white(
                    101,
                    101,
                    frames,
                    pair(straight(start, SPEED, before, 0.0), straight(corner, SPEED, after, 0.0)),
                ),
                params: params(false),
                recorders: vec![
                    Recorder::peaks("fresh", FRESH, Region::Everywhere),
                    Recorder::peaks("late", frames - 8..frames, Region::Everywhere),
                ],
            }
        })
    });
    conditions.collect()
}

fn of_direction(records: &Records) -> (Figure, Vec<Check>) {
    let primers = distinct(records, "primer_deg").len();
    let over_probes = |primer: usize, value: Value| -> [f64; DIRECTIONS] {
        std::array::from_fn(|probe| {
            value(records.one(&[("primer_deg", 45.0 * primer as f64), ("probe_deg", 45.0 * probe as f64)]))
        })
    };
    let e = |record: &Record| record.peaks("late").e();
    let q = |record: &Record| record.peaks("fresh").q();
    let gain = |record: &Record| record.peaks("fresh").q() / record.peaks("late").e();
    // Over axes, and over diagonals.
    let kinds =
        |values: [f64; DIRECTIONS]| [0, 1].map(|first| values.into_iter().skip(first).step_by(2).collect::<Vec<f64>>());
    let uneven = (0..primers).flat_map(|primer| kinds(over_probes(primer, e)).map(|kind| 100.0 * spread(&kind)));
    let lead = |value: Value, apart: usize| {
        let leads = (0..primers).map(|primer| {
            let values = over_probes(primer, value);
            let others = (0..DIRECTIONS).filter(|k| *k != primer && k.abs_diff(primer) % apart == 0);
            100.0 * (values[primer] / others.map(|k| values[k]).fold(0.0, f64::max) - 1.0)
        });
        leads.fold(f64::INFINITY, f64::min)
    };
    let checks = vec![
        // What is left of the corner 80 frames on, and the turn itself.
        Check::new("E: spread over directions of the probe", uneven.fold(0.0, f64::max), "%", Wanted::Below(2.0)),
        Check::new("Q along the primer, above the next best of its kind", lead(q, 2), "%", Wanted::Above(0.0)),
        Check::new("Q / E along the primer, above the next best of all", lead(gain, 1), "%", Wanted::Above(0.0)),
        // Below 0 for primers on a diagonal: E itself is smaller there than on the axes beside it.
        Check::new("Q along the primer, above the next best of all", lead(q, 1), "%", Wanted::Told),
    ];
    let panels = (0..primers).map(|primer| {
        let polar = Polar {
            series: vec![("E".into(), over_probes(primer, e)), ("Q".into(), over_probes(primer, q))],
            full: None,
            arrow: Some(primer as f64 * FRAC_PI_4),
        };
        Panel::new(format!("({}) primer at {}°", ["a", "b", "c", "d"][primer], 45 * primer), Plot::Polar(polar))
    });
    (Figure { columns: 2, panels: panels.collect() }, checks)
}
