//! A target on a circle that passes behind an occluder.

use std::f64::consts::{PI, TAU};

use apgstmd_core::stimulus::{Object, Path, Scene, Target};

use ndarray::Array2;

use super::check::{Check, Wanted};
use super::condition::{Condition, FRAMES_PER_PX, Recorder, Region, SPEED, What, Zone, params, steps, white};
use super::record::{Record, Records};
use super::{Experiment, Extent, Work};
use crate::plot::{Axis, Colors, Curves, Figure, Grid, Map, Panel, Plot, Series};

pub const EXPERIMENT: Experiment = Experiment {
    name: "occlusion",
    title: "Pursuit of an occluded target",
    paper: "Behind the occluder the plain response dies, while the facilitated one spreads on into the gap. What of it reaches \
            the far end falls as the gap widens and as the circle grows.",
    method: "A black 5 x 5 px target on white runs counter-clockwise on a circle at 250 px/s; a white occluder covers an angle at \
             the top. The peaks before the gap; in the gap, 6 px and more from its ends, while the target is hidden; and the \
             largest Q within 8 px of the far end, 3 px before the target comes out. Attention off.",
    caption: "(a) Plain and (b) facilitated response, summed over one round of a circle of 50 px with a gap of 30° (square root, \
              as in the paper). Lines: the ends of the gap; the round begins and ends at the bottom. Q at the far end over (c) the angle of the gap and (d) the radius.",
    work: Work::Scenes { conditions, conclude },
};

/// Radius, px, and angle, degrees, of which the maps are shown, and about which one of both is changed.
const CENTER: (f64, f64) = (50.0, 30.0);
/// Between the circle and the border of the picture, px.
const MARGIN: f64 = 16.0;
/// Path before the gap, px.
const APPROACH: f64 = 60.0;

/// A circle with an occluder at its top.
struct Circle {
    radius: f64,
    gap_degrees: f64,
}

impl Circle {
    fn center(&self) -> [f64; 2] {
        [self.radius + MARGIN, self.radius + MARGIN]
    }

    /// Half the gap, radians.
    fn half(&self) -> f64 {
        self.gap_degrees.to_radians() / 2.0
    }

    /// Half the width of the gap, px.
    fn reach(&self) -> f64 {
        self.radius * self.half().sin()
    }

    /// Where the gap ends: the target comes from the right.
    fn exit(&self) -> [f64; 2] {
        let [x, y] = self.center();
        [x - self.reach(), y - self.radius * self.half().cos()]
    }

    fn scene(&self, start: f64, frames: usize) -> Scene {
        let [x, y] = self.center();
        let path = Path::Circular { center: [x, y], radius: self.radius, speed: SPEED, angle: start };
        // Deep enough for the target at the ends of the gap, and above it at the top.
        let depth = self.radius * (1.0 - self.half().cos());
        let occluder = Object {
            width: 2.0 * self.reach(),
            height: depth + 12.0,
            luminance: 1.0,
            path: Path::Straight { start: [x, y - self.radius + depth / 2.0], speed: 0.0, direction: 0.0 },
            start: 0,
            stop: None,
        };
        let side = (2.0 * x) as usize;
        Scene { occluders: vec![occluder], ..white(side, side, frames, vec![Target::new(path)]) }
    }

    fn factors(&self, round: bool) -> Vec<(&'static str, f64)> {
        vec![("radius", self.radius), ("angle", self.gap_degrees), ("round", f64::from(u8::from(round)))]
    }

    /// Through the gap, from [`APPROACH`] before it to 3 px before its end.
    fn passage(&self) -> Condition {
        let frames_to = |px: f64| (px * FRAMES_PER_PX).round() as usize;
        let enters = frames_to(APPROACH);
        let frames = frames_to(APPROACH + 2.0 * self.half() * self.radius - 3.0);
        let mut scene = self.scene(TAU / 4.0 - self.half() - APPROACH / self.radius, frames);
        // What the target does not come near is left away.
        scene.height = scene.height.min((self.center()[1] + 24.0) as usize);
        let [x, y] = self.center();
        let gap = Zone::fixed([x, y - self.radius], [self.reach() - 6.0, self.radius]);
        let far = Zone::fixed(self.exit(), [8.0, 8.0]);
        Condition {
            factors: self.factors(false),
            scene,
            params: params(false),
            recorders: vec![
                Recorder::peaks("before", enters - 40..enters, Region::Everywhere),
                Recorder::peaks("gap", enters..frames, Region::Inside(vec![gap])),
                Recorder::peaks("far end", frames - 1..frames, Region::Inside(vec![far])),
            ],
        }
    }

    /// Once round, beginning opposite to the gap.
    fn round(&self) -> Condition {
        let frames = (TAU * self.radius * FRAMES_PER_PX).round() as usize;
        let scene = self.scene(-PI / 2.0, frames);
        let what = What::Map { x: 0..scene.width, y: 0..scene.height, direction: None };
        Condition {
            factors: self.factors(true),
            scene,
            params: params(false),
            recorders: vec![Recorder { name: "sum", frames: 0..frames, what }],
        }
    }
}

fn conditions(extent: Extent) -> Vec<Condition> {
    let (radius, gap_degrees) = CENTER;
    let angles = extent.pick(vec![10.0, 30.0, 60.0], steps(10.0, 60.0, 5.0));
    let radii = extent.pick(vec![30.0, 100.0], steps(30.0, 100.0, 10.0));
    let by_angle = angles.into_iter().map(|gap_degrees| Circle { radius, gap_degrees });
    let by_radius = radii.into_iter().filter(|r| *r != radius).map(|radius| Circle { radius, gap_degrees });
    let passages = by_angle.chain(by_radius).map(|circle| circle.passage());
    std::iter::once(Circle { radius, gap_degrees }.round()).chain(passages).collect()
}

fn far_end(record: &Record) -> f64 {
    record.peaks("far end").q()
}

fn conclude(records: &Records) -> (Figure, Vec<Check>) {
    let (radius, angle) = CENTER;
    let middle = records.one(&[("radius", radius), ("angle", angle), ("round", 0.0)]);
    let peak = middle.peaks("before").e();
    let curve = |fixed: (&str, f64), over: &str| -> Vec<(f64, f64)> {
        let mut points: Vec<(f64, f64)> =
            records.all(&[fixed, ("round", 0.0)]).map(|record| (record.factor(over), far_end(record))).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    };
    let (by_angle, by_radius) = (curve(("radius", radius), "angle"), curve(("angle", angle), "radius"));
    // The largest step: below 1 where each value is smaller than the last one.
    let step = |curve: &[(f64, f64)]| curve.windows(2).map(|pair| pair[1].1 / pair[0].1).fold(0.0, f64::max);
    let checks = vec![
        Check::new(
            "largest E in the gap, of the peak before it",
            100.0 * middle.peaks("gap").e() / peak,
            "%",
            Wanted::Below(2.0),
        ),
        Check::new(
            "largest Q in the gap, of the same",
            100.0 * middle.peaks("gap").q() / peak,
            "%",
            Wanted::Above(0.0),
        ),
        Check::new("Q at the far end: largest step as the angle grows", step(&by_angle), "times", Wanted::Below(1.0)),
        Check::new("Q at the far end: largest step as the radius grows", step(&by_radius), "times", Wanted::Below(1.0)),
    ];
    let ((left, top), e, q) = records.one(&[("round", 1.0)]).map("sum");
    let most = q.iter().copied().fold(0.0, f64::max).sqrt();
    let circle = Circle { radius, gap_degrees: angle };
    let [x, y] = circle.center();
    let ends = [-1.0, 1.0].map(|side: f64| {
        let at = |r: f64| (x + side * r * circle.half().sin(), y - r * circle.half().cos());
        vec![at(0.55 * radius), at(radius + 13.0)]
    });
    let map = |title: &str, values: &Array2<f64>| {
        let map = Map {
            values: values.mapv(f64::sqrt),
            x: Grid { label: "x, px".into(), first: left as f64, step: 1.0 },
            y: Grid { label: "y, px".into(), first: top as f64, step: 1.0 },
            label: "√ of the sum".into(),
            colors: Colors::Viridis,
            range: Some((0.0, most)),
            marks: vec![],
            lines: ends.to_vec(),
        };
        Panel::new(title, Plot::Map(map))
    };
    let curves = |title: &str, label: &str, points: Vec<(f64, f64)>| {
        let curves = Curves {
            x: Axis { label: label.to_owned(), ..Axis::default() },
            y: Axis { label: "Q at the far end".into(), logarithmic: true, ..Axis::default() },
            series: vec![Series { points, ..Series::default() }],
            ..Curves::default()
        };
        Panel::new(title, Plot::Curves(curves))
    };
    let panels = vec![
        map("(a) plain response E", e),
        map("(b) facilitated response Q", q),
        curves("(c) radius 50 px", "angle of the gap, degrees", by_angle),
        curves("(d) gap of 30°", "radius, px", by_radius),
    ];
    (Figure { columns: 2, panels }, checks)
}
