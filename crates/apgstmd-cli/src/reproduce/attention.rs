//! Attention before clutter: what it does for a target, and signals along a row with and without it.

use apgstmd_core::Stage;
use apgstmd_core::params::RejectionMode;
use apgstmd_core::stimulus::{Background, Object, Path, Scene, Shade, Target};

use super::check::{Check, Wanted};
use super::condition::{Condition, RATE, Recorder, Region, SPEED, What, Zone, params};
use super::record::{Record, Records};
use super::{Experiment, Extent, Work};
use crate::plot::{Axis, Colors, Curves, Figure, Grid, Look, Map, Panel, Plot, Series};

pub const EXPERIMENT: Experiment = Experiment {
    name: "attention",
    title: "Attention on clutter",
    paper: "Of two small targets before a moving background, the faint one (A) that moves against it is strengthened by \
            attention in every signal up to the STMD's. The clear one (B) that rests on the background is taken for a part of \
            it and stays as it is. A large object gives no response.",
    method: "Natural clutter at 250 px/s to the left, a black band as wide as a tree moving with it; A (Weber contrast 0.2) \
             moves to the right at 250 px/s, B (black) rests on the clutter. And the same clutter at rest, with A and a square of \
             40 px moving to the right. Each with and without attention, rejection by motion, largest E over the last 200 \
             frames; of several seeds the worst counts (three in the full set; one, in a smaller picture, in the quick one). \
             Near a target: within 12 px. Off everything: more than 36 px from A, where its predictions do not reach, 20 px \
             from B and 8 px from the large object. No response: below a tenth of A's, as for opposite directions.",
    caption: "(a) The frame, with the row that is shown below; (b) luminance, (c) retina with attention, (d) lamina, (e-h) \
              medulla, (i) STMD, each along that row. Peaks of (i) elsewhere are clutter that passes for a target.",
    work: Work::Scenes { conditions, conclude },
};

/// What is shown along the row: name in the model, title of the panel.
const SIGNALS: [(&str, &str); 8] = [
    ("I", "(b) luminance I"),
    ("Pe", "(c) retina, P + A"),
    ("L", "(d) lamina, LMC"),
    ("Tm3", "(e) medulla, Tm3"),
    ("Mi1", "(f) medulla, Mi1"),
    ("Tm1_4", "(g) medulla, Tm1, shorter delay"),
    ("Tm1_5", "(h) medulla, Tm1, longer delay"),
    ("E", "(i) STMD, largest E"),
];
const STAGES: &[Stage] = &[Stage::Pe, Stage::L, Stage::Tm3, Stage::Mi1, Stage::Tm1_4, Stage::Tm1_5, Stage::E];

/// Sizes and places, px, at the first frame.
struct Layout {
    width: usize,
    height: usize,
    /// The frame that is shown, the last one.
    shown: usize,
    row: f64,
    a: f64,
    b: f64,
    band: f64,
}

const QUICK: Layout = Layout { width: 288, height: 80, shown: 400, row: 50.0, a: 100.0, b: 350.0, band: 130.0 };
/// The paper's size, and its frame at 760 ms.
const FULL: Layout = Layout { width: 500, height: 250, shown: 760, row: 190.0, a: 130.0, b: 620.0, band: 230.0 };

fn along(start: [f64; 2], speed: f64) -> Path {
    Path::Straight { start, speed, direction: 0.0 }
}

fn around(path: &Path, half: f64) -> Zone {
    Zone { path: path.clone(), half: [half, half] }
}

impl Layout {
    fn condition(&self, seed: u64, moving: bool, attention: bool) -> Condition {
        let drift = if moving { -SPEED } else { 0.0 };
        let (a, b) = (along([self.a, self.row], SPEED), along([self.b, self.row], drift));
        let (width, height, path) = if moving {
            // From below the picture to above it: no ends to be seen.
            (50.0, 2.0 * self.height as f64, along([self.band, self.height as f64 / 2.0], drift))
        } else {
            (40.0, 40.0, along([self.a + 60.0, self.row - 30.0], SPEED))
        };
        let object = Object { width, height, luminance: 0.1, path: path.clone(), start: 0, stop: None };
        let itself = Zone { path: path.clone(), half: [width / 2.0, height / 2.0] };
        let off =
            vec![around(&a, 36.0), around(&b, 20.0), Zone { path, half: [width / 2.0 + 8.0, height / 2.0 + 8.0] }];
        let frames = self.shown - 200..self.shown + 1;
        let peaks = |name, region| Recorder::peaks(name, frames.clone(), region);
        let recorders = vec![
            peaks("target A", Region::Inside(vec![around(&a, 12.0)])),
            peaks("target B", Region::Inside(vec![around(&b, 12.0)])),
            peaks("large object", Region::Inside(vec![itself])),
            peaks("off everything", Region::Outside(off)),
            Recorder { name: "row", frames: frames.clone(), what: What::Line { y: self.row as usize, stages: STAGES } },
            Recorder { name: "frame", frames: frames.clone(), what: What::Picture },
        ];
        let mut params = params(attention);
        params.rejection.mode = RejectionMode::Motion;
        let number = |yes: bool| f64::from(u8::from(yes));
        Condition {
            factors: vec![("seed", seed as f64), ("moving", number(moving)), ("attention", number(attention))],
            scene: Scene {
                width: self.width,
                height: self.height,
                frames: self.shown + 1,
                rate: RATE,
                seed,
                background: Background::Natural { mean: 0.5, contrast: 0.15, velocity: [drift, 0.0] },
                objects: vec![object],
                targets: vec![Target { shade: Shade::Dark(0.2), ..Target::new(a) }, Target::new(b)],
                ..Scene::default()
            },
            params,
            recorders,
        }
    }

    /// Where something that starts at `x` is in the frame that is shown.
    fn shown(&self, x: f64, speed: f64) -> f64 {
        x + speed / RATE * self.shown as f64
    }
}

fn conditions(extent: Extent) -> Vec<Condition> {
    let (layout, seeds) = (extent.pick(QUICK, FULL), extent.pick(1, 3));
    let kinds = [(true, true), (true, false), (false, true), (false, false)];
    (1..=seeds).flat_map(|seed| kinds.map(|(moving, attention)| layout.condition(seed, moving, attention))).collect()
}

fn conclude(records: &Records) -> (Figure, Vec<Check>) {
    let seeds = records.0.iter().map(|record| record.factor("seed")).fold(0.0, f64::max) as usize;
    let at = |seed: usize, moving: f64, attention: f64| {
        records.one(&[("seed", seed as f64), ("moving", moving), ("attention", attention)])
    };
    let e = |record: &Record, name: &str| record.peaks(name).e();
    let gains = |name: &'static str, moving: f64| {
        (1..=seeds).map(move |seed| e(at(seed, moving, 1.0), name) / e(at(seed, moving, 0.0), name))
    };
    let least = |moving: f64| gains("target A", moving).fold(f64::INFINITY, f64::min);
    let most = |name: &'static str| gains(name, 1.0).fold(0.0, f64::max);
    let share = |name: &str, moving: f64, attention: f64| {
        let shares = (1..=seeds).map(|seed| {
            let record = at(seed, moving, attention);
            100.0 * e(record, name) / e(record, "target A")
        });
        shares.fold(0.0, f64::max)
    };
    let none = Wanted::Below(10.0);
    let checks = vec![
        Check::new("moving clutter: E near A, attention on over off", least(1.0), "times", Wanted::Above(1.0)),
        Check::new("clutter at rest: the same", least(0.0), "times", Wanted::Above(1.0)),
        Check::new("band that moves with the clutter, of A's E", share("large object", 1.0, 1.0), "%", none),
        Check::new("large square before clutter at rest, of A's E", share("large object", 0.0, 1.0), "%", none),
        Check::new(
            "clutter at rest off everything, attention off",
            share("off everything", 0.0, 0.0),
            "%",
            Wanted::Exactly(0.0),
        ),
        Check::new("the same, attention on", share("off everything", 0.0, 1.0), "%", none),
        // The paper leaves B as it is. Here it is attended to when a trace comes near it; and so is clutter that moves, for
        // a while, like a target.
        Check::new("moving clutter: E near B, attention on over off", most("target B"), "times", Wanted::Told),
        Check::new("moving clutter off everything, on over off", most("off everything"), "times", Wanted::Told),
    ];
    let (on, off) = (at(1, 1.0, 1.0), at(1, 1.0, 0.0));
    let frame = on.picture("frame");
    let layout = if frame.ncols() == FULL.width { FULL } else { QUICK };
    let (a, b) = (layout.shown(layout.a, SPEED), layout.shown(layout.b, -SPEED));
    let right = frame.ncols() as f64 - 1.0;
    let map = Map {
        values: frame.clone(),
        x: Grid { label: "x, px".into(), first: 0.0, step: 1.0 },
        y: Grid { label: "y, px".into(), first: 0.0, step: 1.0 },
        label: String::new(),
        colors: Colors::Grey,
        range: Some((0.0, 1.0)),
        marks: vec![(a, layout.row, "A".into()), (b, layout.row, "B".into())],
        lines: vec![vec![(0.0, layout.row), (right, layout.row)]],
    };
    let line = |signal: &str, title: &str| {
        let series = |name: &str, record: &Record, color| {
            let points = record.line("row", signal).iter().enumerate().map(|(x, v)| (x as f64, *v)).collect();
            Series { name: name.into(), points, look: Look::Line, color: Some(color), ..Series::default() }
        };
        let with = series("with attention", on, 1);
        let without = series("without", off, 0);
        let curves = Curves {
            x: Axis { label: "x, px".into(), ..Axis::default() },
            y: Axis { label: signal.split('_').next().unwrap_or(signal).to_owned(), ..Axis::default() },
            // Attention changes no luminance.
            series: if signal == "I" { vec![Series { name: String::new(), ..without }] } else { vec![with, without] },
            marks: vec![(a, "A".into()), (b, "B".into())],
            spans: Vec::new(),
        };
        Panel::new(title, Plot::Curves(curves))
    };
    let mut panels = vec![Panel { wide: true, ..Panel::new("(a) frame", Plot::Map(map)) }];
    panels.extend(SIGNALS.map(|(signal, title)| line(signal, title)));
    (Figure { columns: 2, panels }, checks)
}
