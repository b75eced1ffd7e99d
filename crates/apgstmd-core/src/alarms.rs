//! How high scores must be for so many false alarms a frame, found from the detections of the clip itself.
//!
//! Clutter makes many traces that are above a threshold for some frames each, a target one or a few that stay above it. So
//! rows are counted from the best score downward, and a trace that has been counted more often than `LASTING` allows is
//! taken for a target and no longer counts: the threshold for a rate R is the score at which the rest comes to R rows a
//! frame. What is rarer than a window of frames can show is extrapolated: log-scores of clutter have an exponential tail.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::detection::Detection;
use crate::frame::Size;
use crate::memory::heap;
use crate::state::{Origin, Remember, State, StateError, Visit, is_count};

/// Frames that are remembered.
const WINDOW: u64 = 1000;
/// Rows of a frame that are, the strongest.
const MOST_ROWS: usize = 32;
/// A trace with more rows than this above a threshold is a target.
const LASTING: u32 = 20;
/// In the first frames of a clip, as a share of their number, and at least so many.
const LASTING_SHARE: f64 = 1.0 / 3.0;
const LEAST_LASTING: u32 = 6;
/// Targets are told apart at this rate where a lower one is asked for: a target's first rows are few beside so many.
const APART: f64 = 1.0;
/// A threshold that fewer rows than this lie above is extrapolated, from the tail of `TAIL` times as many.
const LEAST_ROWS: f64 = 10.0;
const TAIL: f64 = 5.0;

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Row {
    frame: u64,
    trace: u64,
    score: f32,
    /// Its trace, counted from 0.
    index: u32,
}

heap!(Row);

/// Scores of the last frames, targets and clutter. Allocates nothing after construction.
///
/// ```
/// use apgstmd_core::{Detection, FalseAlarms};
///
/// let mut alarms = FalseAlarms::new();
/// for t in 0..300u64 {
///     // One target all the time, and in each frame ten specks of other places and scores.
///     let target = Detection { score: 0.5, trace: 0, ..Detection::default() };
///     let specks = (0..10u64).map(|i| Detection {
///         score: 0.001 * (1 + (7 * t + 31 * i) % 100) as f32,
///         trace: 1 + 10 * t + i,
///         ..Detection::default()
///     });
///     let detections: Vec<Detection> = [target].into_iter().chain(specks).collect();
///     alarms.add(&detections);
/// }
/// // A tenth of the specks has scores above 0.09.
/// assert!((alarms.least_score(1.0) - 0.09).abs() < 0.002);
/// ```
#[derive(Clone, Debug)]
pub struct FalseAlarms {
    frames: u64,
    window: VecDeque<Row>,
    sorted: Vec<Row>,
    counts: Vec<u32>,
}

/// Of its states.
const KIND: &str = "alarms";

fn origin() -> Origin {
    Origin::here(KIND, Size::new(0, 0), String::new())
}

impl Remember for FalseAlarms {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        visit.part("frames", &mut self.frames)?;
        let most = WINDOW as usize * MOST_ROWS;
        let of_row = |row: &Row| row.score.is_finite() && is_count(row.frame);
        let sound = |rows: &Vec<Row>| rows.len() <= most && rows.iter().all(of_row);
        if let Some(rows) = visit.record("window", || self.window.iter().copied().collect(), sound)? {
            self.window.clear();
            self.window.extend(rows);
        }
        Ok(())
    }
}

impl Default for FalseAlarms {
    fn default() -> Self {
        Self::new()
    }
}

impl FalseAlarms {
    /// Frames from which on there is something to go by.
    pub const FIRST: u64 = 10;
    /// Lowest rate that can be asked for, false alarms a frame.
    pub const LOWEST: f64 = 0.001;
    /// Highest rate.
    pub const HIGHEST: f64 = 10.0;

    /// Nothing seen yet.
    pub fn new() -> Self {
        let rows = WINDOW as usize * MOST_ROWS;
        Self {
            frames: 0,
            window: VecDeque::with_capacity(rows),
            sorted: Vec::with_capacity(rows),
            counts: Vec::with_capacity(rows),
        }
    }

    /// Frames seen.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Adds a frame's detections, strongest first.
    pub fn add(&mut self, detections: &[Detection]) {
        let frame = self.frames;
        self.frames += 1;
        while self.window.front().is_some_and(|row| row.frame + WINDOW <= frame) {
            self.window.pop_front();
        }
        let usable = detections.iter().filter(|found| found.score > 0.0 && found.score.is_finite());
        self.window.extend(usable.take(MOST_ROWS).map(|found| Row {
            frame,
            trace: found.trace,
            score: found.score,
            index: 0,
        }));
    }

    /// The least score that `rate` false alarms a frame have, 0 where there are not that many.
    ///
    /// Over the last 1000 frames at most. Before the tenth frame nothing is known, and it is 0.
    pub fn least_score(&mut self, rate: f64) -> f32 {
        let frames = self.frames.min(WINDOW);
        if self.frames < Self::FIRST {
            return 0.0;
        }
        let Self { window, sorted, counts, .. } = self;
        sorted.clear();
        sorted.extend(window.iter());
        sorted.sort_unstable_by_key(|row| row.trace);
        let (mut index, mut last) = (0, sorted.first().map_or(0, |row| row.trace));
        for row in &mut *sorted {
            index += u32::from(row.trace != last);
            (row.index, last) = (index, row.trace);
        }
        sorted.sort_unstable_by(|a, b| {
            b.score.total_cmp(&a.score).then(a.index.cmp(&b.index)).then(b.frame.cmp(&a.frame))
        });
        counts.clear();
        counts.resize(index as usize + 1, 0);
        let lasting = ((frames as f64 * LASTING_SHARE) as u32).clamp(LEAST_LASTING, LASTING);
        take_out_targets(sorted, counts, lasting, rate.max(APART) * frames as f64);
        sorted.retain(|row| counts[row.index as usize] <= lasting);
        at_rate(sorted, rate * frames as f64)
    }

    /// All that it remembers: see [`crate::Detector::state`].
    pub fn state(&mut self) -> State {
        State::of(origin(), self)
    }

    /// Takes up a state.
    ///
    /// # Errors
    /// As [`crate::Detector::restore`].
    pub fn restore(&mut self, state: &State) -> Result<(), StateError> {
        state.check(&origin(), self)?;
        state.load(self);
        Ok(())
    }

    /// As before the first frame.
    pub fn reset(&mut self) {
        self.frames = 0;
        self.window.clear();
    }
}

/// Counts rows of each trace from the best downward, until those of traces that do not last come to more than `most`.
fn take_out_targets(sorted: &[Row], counts: &mut [u32], lasting: u32, most: f64) {
    let mut counted = 0u32;
    for row in sorted {
        let count = &mut counts[row.index as usize];
        if *count > lasting {
            continue;
        }
        *count += 1;
        counted += 1;
        if *count > lasting {
            counted -= *count;
        }
        if f64::from(counted) > most {
            break;
        }
    }
}

/// The score that `wanted` of these rows, best first, lie above.
fn at_rate(sorted: &[Row], wanted: f64) -> f32 {
    let score = |rank: f64| sorted.get(rank as usize).map_or(0.0, |row| row.score);
    if wanted >= LEAST_ROWS || sorted.len() < 2 {
        return score(wanted);
    }
    // As many as there are, at most.
    let rank = LEAST_ROWS.min((sorted.len() - 1) as f64);
    if wanted >= rank {
        return score(wanted);
    }
    let deep = (TAIL * rank).min((sorted.len() - 1) as f64);
    let (near, far) = (f64::from(score(rank)), f64::from(score(deep)));
    let slope = if deep > rank { (near / far).ln() / (deep / rank).ln() } else { 0.0 };
    (near * (rank / wanted).powf(slope)) as f32
}

/// What a clip without targets says of a threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tuned {
    /// Least score for the rate asked for.
    pub least_score: f32,
    /// Rows of the clip with that score or more.
    pub rows: usize,
    /// Traces they are of.
    pub traces: usize,
    /// Within these false alarms a frame the true rate lies, with 95 %, if traces come independently.
    pub between: (f64, f64),
}

/// The threshold for `rate` false alarms a frame on a clip of `frames` frames in which everything found is one: (score,
/// trace) of each row. Exact, nothing is taken for a target.
pub fn tune(rows: &mut [(f32, u64)], frames: usize, rate: f64) -> Tuned {
    rows.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let wanted = (rate * frames as f64) as usize;
    let least_score = match (wanted.checked_sub(1).and_then(|last| rows.get(last)), rows.get(wanted)) {
        (_, None) => 0.0,
        // Nothing that is equal to the first one too many.
        (None, Some((first, _))) => first.next_up(),
        (Some((inside, _)), Some((outside, _))) => (0.5 * (inside + outside)).max(outside.next_up()),
    };
    let count = rows.partition_point(|(score, _)| *score >= least_score);
    let mut traces: Vec<u64> = rows[..count].iter().map(|(_, trace)| *trace).collect();
    traces.sort_unstable();
    traces.dedup();
    let each = count as f64 / traces.len().max(1) as f64 / frames.max(1) as f64;
    let (low, high) = poisson(traces.len());
    Tuned {
        least_score,
        rows: count,
        traces: traces.len(),
        between: (low * each, high * each.max(1.0 / frames.max(1) as f64)),
    }
}

/// 95 % interval of the mean of which `count` is a Poisson sample (Wilson & Hilferty).
fn poisson(count: usize) -> (f64, f64) {
    const Z: f64 = 1.96;
    let of = |n: f64, z: f64| n * (1.0 - 1.0 / (9.0 * n) + z / (3.0 * n.sqrt())).powi(3);
    let low = if count == 0 { 0.0 } else { of(count as f64, -Z) };
    (low, of(count as f64 + 1.0, Z))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clutter of exponential log-scores, in traces of one to nine frames; targets, stronger, in traces of 60.
    fn clip(frames: u64, targets: u64, seed: u64) -> (FalseAlarms, Vec<f32>) {
        let mut state = seed;
        let mut uniform = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) as f64 + 0.5) / (1u64 << 31) as f64
        };
        let mut alarms = FalseAlarms::new();
        let mut clutter = Vec::new();
        let mut living = vec![(0, 0, 0.0f32); 12];
        let mut next = 1000;
        for t in 0..frames {
            let mut found = Vec::new();
            for (trace, until, score) in &mut living {
                if *until <= t {
                    (*trace, *until) = (next, t + 1 + (9.0 * uniform()) as u64);
                    *score = 0.004 * uniform().powf(-0.3) as f32;
                    next += 1;
                }
                clutter.push(*score);
                found.push(Detection { score: *score, trace: *trace, ..Detection::default() });
            }
            for target in 0..targets {
                let score = 0.03 + 0.02 * target as f32;
                found.push(Detection { score, trace: 100 * target + t / 60, ..Detection::default() });
            }
            found.sort_unstable_by(|a, b| b.score.total_cmp(&a.score));
            alarms.add(&found);
        }
        (alarms, clutter)
    }

    /// Rates are kept, whether targets are in view or not: within a third where the clip shows them.
    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn targets_do_not_count() {
        for targets in [0, 1, 5] {
            let (mut alarms, clutter) = clip(600, targets, 7 + targets);
            for rate in [0.1, 0.5, 1.0, 3.0] {
                let least = alarms.least_score(rate);
                let achieved = clutter.iter().filter(|score| **score >= least).count() as f64 / 600.0;
                assert!((achieved / rate).ln().abs() < 0.3, "{targets} targets, {rate}: {achieved}");
            }
            // What is rarer than the clip can show, one trace in all of it: the right order.
            let least = f64::from(alarms.least_score(0.01));
            let truth = 0.004 * (12.0f64 / 0.01).powf(0.3);
            assert!((least / truth).ln().abs() < 0.8, "{targets} targets: {least} for {truth}");
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn rare_alarms_need_higher_scores() {
        let (mut alarms, _) = clip(100, 2, 3);
        let scores: Vec<f32> = [0.001, 0.01, 0.1, 1.0, 10.0].map(|rate| alarms.least_score(rate)).into();
        assert!(scores.is_sorted_by(|a, b| a > b), "{scores:?}");
    }

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn little_is_known_of_little() {
        let mut alarms = FalseAlarms::new();
        let target = Detection { score: 0.5, ..Detection::default() };
        (0..9).for_each(|_| alarms.add(&[target]));
        assert_eq!(alarms.least_score(0.1), 0.0);
        (0..50).for_each(|_| alarms.add(&[target]));
        // A target alone is no false alarm.
        assert_eq!(alarms.least_score(0.1), 0.0);
        (0..5000).for_each(|_| alarms.add(&[target; 40]));
        assert!(alarms.window.len() <= WINDOW as usize * MOST_ROWS);
        alarms.reset();
        assert_eq!((alarms.frames(), alarms.least_score(1.0)), (0, 0.0));
    }

    #[test]
    fn an_empty_clip_is_counted_out() {
        let mut rows: Vec<(f32, u64)> = (0..1000).map(|i| (i as f32 / 1000.0, i / 4)).collect();
        let tuned = tune(&mut rows, 400, 0.1);
        assert_eq!((tuned.rows, tuned.traces), (40, 10));
        assert!(tuned.least_score > 0.959 && tuned.least_score < 0.96);
        // 10 traces: 4.8 to 18.4.
        assert!((tuned.between.0 - 0.048).abs() < 0.002 && (tuned.between.1 - 0.184).abs() < 0.002, "{tuned:?}");
        assert_eq!(tune(&mut rows[..30], 400, 0.1).least_score, 0.0);
        assert!(tune(&mut [(0.5, 1), (0.5, 2)], 10, 0.1).least_score > 0.5);
        assert_eq!(tune(&mut [], 10, 0.1).rows, 0);
    }
}
