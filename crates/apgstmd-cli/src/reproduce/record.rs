//! What recorders keep, and how conclusions find it again.

use std::ops::Range;

use apgstmd_core::stimulus::Renderer;
use apgstmd_core::{DIRECTIONS, Detector, Probe, Size, Stage};
use ndarray::{Array2, Array3, Axis, s};

use super::condition::{Condition, Recorder, Region, What};
use crate::interrupt;

/// What a recorder kept.
#[derive(Clone, Debug)]
pub enum Recording {
    /// Largest E and Q.
    Peaks(Peaks),
    /// E and Q at a pixel: (frame, E, Q).
    Course(Vec<(usize, f64, f64)>),
    /// Signals along a row.
    Line(Vec<(&'static str, Vec<f64>)>),
    /// E and Q in a rectangle whose first pixel is `corner` (x, y).
    Map {
        /// (x, y) of its first pixel.
        corner: (usize, usize),
        /// Unfacilitated.
        e: Array2<f64>,
        /// Facilitated.
        q: Array2<f64>,
    },
    /// A frame.
    Picture(Array2<f64>),
}

/// Largest E and Q of each direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peaks {
    /// Unfacilitated.
    pub e: [f64; DIRECTIONS],
    /// Facilitated.
    pub q: [f64; DIRECTIONS],
}

impl Peaks {
    /// Largest E.
    pub fn e(&self) -> f64 {
        self.e.iter().copied().fold(0.0, f64::max)
    }

    /// Largest Q.
    pub fn q(&self) -> f64 {
        self.q.iter().copied().fold(0.0, f64::max)
    }
}

/// What was kept of a condition.
pub struct Record {
    /// As the condition has them.
    pub factors: Vec<(&'static str, f64)>,
    /// By the names of the recorders.
    pub kept: Vec<(&'static str, Recording)>,
}

/// What was kept of all conditions of an experiment, in their order.
pub struct Records(pub Vec<Record>);

impl Record {
    /// A number of the condition.
    pub fn factor(&self, name: &str) -> f64 {
        self.factors.iter().find(|factor| factor.0 == name).map_or(f64::NAN, |factor| factor.1)
    }

    fn has(&self, factors: &[(&str, f64)]) -> bool {
        factors.iter().all(|(name, value)| self.factor(name) == *value)
    }

    fn kept(&self, name: &str) -> &Recording {
        let found = self.kept.iter().find(|kept| kept.0 == name);
        &found.unwrap_or_else(|| panic!("no recorder is called {name}")).1
    }

    /// What a recorder of [`What::Peaks`] kept.
    pub fn peaks(&self, name: &str) -> Peaks {
        let Recording::Peaks(peaks) = self.kept(name) else { panic!("{name} records no peaks") };
        *peaks
    }

    /// What a recorder of [`What::Course`] kept.
    pub fn course(&self, name: &str) -> &[(usize, f64, f64)] {
        let Recording::Course(course) = self.kept(name) else { panic!("{name} records no course") };
        course
    }

    /// A signal that a recorder of [`What::Line`] kept.
    pub fn line(&self, name: &str, signal: &str) -> &[f64] {
        let Recording::Line(lines) = self.kept(name) else { panic!("{name} records no lines") };
        let found = lines.iter().find(|line| line.0 == signal);
        &found.unwrap_or_else(|| panic!("{name} records no {signal}")).1
    }

    /// What a recorder of [`What::Map`] kept: the corner, E and Q.
    pub fn map(&self, name: &str) -> ((usize, usize), &Array2<f64>, &Array2<f64>) {
        let Recording::Map { corner, e, q } = self.kept(name) else { panic!("{name} records no map") };
        (*corner, e, q)
    }

    /// What a recorder of [`What::Picture`] kept.
    pub fn picture(&self, name: &str) -> &Array2<f64> {
        let Recording::Picture(picture) = self.kept(name) else { panic!("{name} records no picture") };
        picture
    }
}

impl Records {
    /// The conditions with these numbers.
    pub fn all<'a>(&'a self, factors: &'a [(&str, f64)]) -> impl Iterator<Item = &'a Record> {
        self.0.iter().filter(|record| record.has(factors))
    }

    /// The condition with these numbers.
    pub fn one(&self, factors: &[(&str, f64)]) -> &Record {
        self.0.iter().find(|record| record.has(factors)).unwrap_or_else(|| panic!("there is no condition {factors:?}"))
    }

    /// A value of each condition over one of its numbers.
    pub fn curve(&self, factor: &str, value: impl Fn(&Record) -> f64) -> Vec<(f64, f64)> {
        self.0.iter().map(|record| (record.factor(factor), value(record))).collect()
    }
}

/// Shows a condition to the model. None when the user asked for the end meanwhile; `tick` is called after each frame.
pub fn run(condition: &Condition, tick: impl Fn()) -> Option<Record> {
    let Condition { factors, scene, params, recorders } = condition;
    // The experiments are part of the program, and a test looks at all of them.
    let renderer = Renderer::new(scene).expect("a valid scene");
    let mut detector =
        Detector::with_threads(Size::new(scene.height, scene.width), params, 1).expect("valid parameters");
    let (mut frame, mut response) = (renderer.make_frame(), detector.make_response());
    let mut kept: Vec<Recording> = recorders.iter().map(Recording::empty).collect();
    for t in 0..scene.frames {
        if interrupt::asked() {
            return None;
        }
        renderer.frame_into(t, &mut frame);
        detector.process_into(frame.view(), &mut response).expect("a frame of the scene's size");
        let mut now = Now { t, seconds: t as f64 / scene.rate, frame: &frame, probe: detector.probe(), eq: None };
        for (recorder, kept) in recorders.iter().zip(&mut kept) {
            if recorder.frames.contains(&t) {
                kept.take(recorder, &mut now);
            }
        }
        tick();
    }
    let names = recorders.iter().map(|recorder| recorder.name);
    Some(Record { factors: factors.clone(), kept: names.zip(kept).collect() })
}

/// What there is to be seen in a frame.
struct Now<'a> {
    t: usize,
    seconds: f64,
    frame: &'a Array2<f32>,
    probe: Probe<'a>,
    /// E and Q, fetched when first asked for.
    eq: Option<[Array3<f32>; 2]>,
}

impl Now<'_> {
    fn stage(&self, stage: Stage) -> Array3<f32> {
        self.probe.stage(stage).expect("apg-STMD has every stage that is recorded")
    }

    fn responses(&mut self) -> &[Array3<f32>; 2] {
        let fetched = self.eq.take().unwrap_or_else(|| [Stage::E, Stage::Q].map(|stage| self.stage(stage)));
        self.eq.insert(fetched)
    }
}

impl Recording {
    fn empty(recorder: &Recorder) -> Self {
        match &recorder.what {
            What::Peaks(_) => Self::Peaks(Peaks::default()),
            What::Course { .. } => Self::Course(Vec::with_capacity(recorder.frames.len())),
            What::Line { .. } => Self::Line(Vec::new()),
            What::Map { x, y, .. } => {
                let zeros = || Array2::zeros((y.len(), x.len()));
                Self::Map { corner: (x.start, y.start), e: zeros(), q: zeros() }
            }
            What::Picture => Self::Picture(Array2::zeros((0, 0))),
        }
    }

    fn take(&mut self, recorder: &Recorder, now: &mut Now<'_>) {
        let last = now.t + 1 == recorder.frames.end;
        let (t, seconds) = (now.t, now.seconds);
        match (self, &recorder.what) {
            (Self::Peaks(peaks), What::Peaks(region)) => {
                let [e, q] = now.responses();
                for (most, maps) in [(&mut peaks.e, e), (&mut peaks.q, q)] {
                    for (most, map) in most.iter_mut().zip(maps.outer_iter()) {
                        let seen = map.indexed_iter().filter(|(_, value)| f64::from(**value) > *most);
                        let inside = seen.filter(|((y, x), _)| region.holds((*x, *y), seconds));
                        *most = inside.fold(*most, |most, (_, value)| most.max(f64::from(*value)));
                    }
                }
            }
            (Self::Course(course), What::Course { x, y, direction }) => {
                let [e, q] = now.responses().each_ref().map(|maps| f64::from(maps[(*direction, *y, *x)]));
                course.push((t, e, q));
            }
            (Self::Line(lines), What::Line { y, stages }) if last => {
                lines.push(("I", now.frame.row(*y).iter().map(|value| f64::from(*value)).collect()));
                lines.extend(stages.iter().map(|stage| {
                    let maps = now.stage(*stage);
                    let row = maps.slice(s![.., *y, ..]);
                    // Signals like L are negative too: no 0 to start from.
                    let most = row.map_axis(Axis(0), |v| v.fold(f32::NEG_INFINITY, |a, b| a.max(*b)));
                    (stage.name(), most.iter().map(|value| f64::from(*value)).collect())
                }));
            }
            (Self::Map { e, q, .. }, What::Map { x, y, direction }) => {
                for (sum, maps) in [&mut *e, &mut *q].into_iter().zip(now.responses()) {
                    *sum += &part(maps, x, y, *direction);
                }
            }
            (Self::Picture(picture), What::Picture) if last => *picture = now.frame.mapv(f64::from),
            _ => {}
        }
    }
}

fn part(maps: &Array3<f32>, x: &Range<usize>, y: &Range<usize>, direction: Option<usize>) -> Array2<f64> {
    let rectangle = maps.slice(s![.., y.clone(), x.clone()]);
    match direction {
        Some(k) => rectangle.index_axis(Axis(0), k).mapv(f64::from),
        None => rectangle.map_axis(Axis(0), |v| f64::from(v.fold(0.0f32, |a, b| a.max(*b)))),
    }
}

impl Region {
    fn holds(&self, (x, y): (usize, usize), seconds: f64) -> bool {
        match self {
            Self::Everywhere => true,
            Self::Row(row) => y == *row,
            Self::Inside(zones) => zones.iter().any(|zone| zone.holds((x, y), seconds)),
            Self::Outside(zones) => !zones.iter().any(|zone| zone.holds((x, y), seconds)),
        }
    }
}
