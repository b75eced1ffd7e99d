//! Curves over all thresholds, and the numbers read from them.

use std::ops::Range;

use serde::Serialize;

use super::matching::{Outcome, Verdict};

/// Numbers of false alarms per frame at which the detection rate is reported.
pub const FALSE_ALARM_LIMITS: [f64; 5] = [0.1, 0.5, 1.0, 5.0, 10.0];

/// What the detections with at least one score are worth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Least score that is reported.
    pub threshold: f64,
    /// True detections.
    pub true_detections: usize,
    /// False detections.
    pub false_detections: usize,
    /// True detections / visible targets, which is also the recall; 0 without targets.
    pub detection_rate: f64,
    /// False detections / frames.
    pub false_alarms: f64,
    /// True detections / all that are true or false.
    pub precision: f64,
    /// Harmonic mean of precision and recall.
    pub f1: f64,
}

/// A threshold someone may choose, and what it gives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OperatingPoint {
    /// Most false alarms per frame that were allowed, where that was the choice.
    pub limit: Option<f64>,
    /// The best point within it; none when even the highest threshold gives more.
    pub point: Option<Point>,
    /// True detections / visible targets there; 0 without a point.
    pub detection_rate: f64,
    /// Median distance of its true detections from the centres of their targets, px.
    pub localisation_error: Option<f64>,
    /// Median angle between its true detections and their targets' tracks, radians; needs directions and ids.
    pub direction_error: Option<f64>,
}

/// How good detections are.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evaluation {
    /// First judged frame.
    pub first_frame: usize,
    /// Number of judged frames.
    pub frames: usize,
    /// Targets that count, over all frames.
    pub targets: usize,
    /// True detections among all.
    pub true_detections: usize,
    /// False detections among all.
    pub false_detections: usize,
    /// Detections that count for nothing.
    pub neutral_detections: usize,
    /// Area under the detection rate over 0..1 false alarms per frame. At each place the rate is that of the lowest
    /// threshold within so many false alarms: a step curve, integrated exactly.
    pub area: f64,
    /// Average precision: sum over thresholds of precision times the recall that it adds.
    pub average_precision: f64,
    /// At each of [`FALSE_ALARM_LIMITS`].
    pub at: Vec<OperatingPoint>,
    /// Where F1 is greatest (the highest such threshold).
    pub best_f1: OperatingPoint,
    /// With every detection.
    pub all: OperatingPoint,
    /// One point for each distinct score that is true or false, highest first. Equal scores stand or fall together.
    pub curve: Vec<Point>,
}

impl Evaluation {
    /// From outcomes ordered by score, best first.
    pub(super) fn new(frames: Range<usize>, targets: usize, outcomes: Vec<Outcome>) -> Self {
        let curve = curve(&outcomes, targets, frames.len());
        let operating = |limit: Option<f64>, point: Option<&Point>| OperatingPoint {
            limit,
            point: point.copied(),
            detection_rate: point.map_or(0.0, |p| p.detection_rate),
            localisation_error: point.and_then(|p| median_of(&outcomes, p.threshold, |distance, _| Some(distance))),
            direction_error: point.and_then(|p| median_of(&outcomes, p.threshold, |_, turn| turn)),
        };
        // Of equal F1 the first, that is the highest threshold.
        let best = curve.iter().rev().max_by(|a, b| a.f1.total_cmp(&b.f1));
        let last = curve.last();
        Self {
            first_frame: frames.start,
            frames: frames.len(),
            targets,
            true_detections: last.map_or(0, |p| p.true_detections),
            false_detections: last.map_or(0, |p| p.false_detections),
            neutral_detections: outcomes.iter().filter(|o| o.verdict == Verdict::Neutral).count(),
            area: area(&curve, 1.0),
            average_precision: average_precision(&curve),
            at: FALSE_ALARM_LIMITS.iter().map(|limit| operating(Some(*limit), within(&curve, *limit))).collect(),
            best_f1: operating(None, best),
            all: operating(None, last),
            curve,
        }
    }

    /// Detection rate at the lowest threshold that gives at most so many false alarms per frame.
    pub fn detection_rate_at(&self, false_alarms: f64) -> f64 {
        within(&self.curve, false_alarms).map_or(0.0, |point| point.detection_rate)
    }
}

fn curve(outcomes: &[Outcome], targets: usize, frames: usize) -> Vec<Point> {
    let (mut hits, mut alarms) = (0, 0);
    let mut points: Vec<Point> = Vec::new();
    for outcome in outcomes {
        match outcome.verdict {
            Verdict::True { .. } => hits += 1,
            Verdict::False => alarms += 1,
            Verdict::Neutral => continue,
        }
        let share = |part: usize, whole: usize| if whole == 0 { 0.0 } else { part as f64 / whole as f64 };
        let point = Point {
            threshold: outcome.score,
            true_detections: hits,
            false_detections: alarms,
            detection_rate: share(hits, targets),
            false_alarms: share(alarms, frames),
            precision: share(hits, hits + alarms),
            f1: share(2 * hits, hits + alarms + targets),
        };
        match points.last_mut() {
            Some(last) if last.threshold == point.threshold => *last = point,
            _ => points.push(point),
        }
    }
    points
}

/// The last point with at most so many false alarms per frame.
fn within(curve: &[Point], false_alarms: f64) -> Option<&Point> {
    curve[..curve.partition_point(|point| point.false_alarms <= false_alarms)].last()
}

fn area(curve: &[Point], until: f64) -> f64 {
    let (mut area, mut from, mut rate) = (0.0, 0.0, 0.0);
    for point in curve.iter().take_while(|point| point.false_alarms < until) {
        area += rate * (point.false_alarms - from);
        (from, rate) = (point.false_alarms, point.detection_rate);
    }
    area + rate * (until - from)
}

fn average_precision(curve: &[Point]) -> f64 {
    let mut recall = 0.0;
    let mut sum = 0.0;
    for point in curve {
        sum += (point.detection_rate - recall) * point.precision;
        recall = point.detection_rate;
    }
    sum
}

/// Median over the true detections with at least this score; of an even number the mean of the middle two.
fn median_of(outcomes: &[Outcome], threshold: f64, value: impl Fn(f64, Option<f64>) -> Option<f64>) -> Option<f64> {
    let kept = outcomes.iter().take_while(|outcome| outcome.score >= threshold);
    let mut values: Vec<f64> = kept
        .filter_map(|outcome| match outcome.verdict {
            Verdict::True { distance, turn } => value(distance, turn),
            _ => None,
        })
        .collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        n if n % 2 == 1 => Some(values[middle]),
        _ => Some((values[middle - 1] + values[middle]) / 2.0),
    }
}
