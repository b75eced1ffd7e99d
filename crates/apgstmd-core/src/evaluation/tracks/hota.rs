//! HOTA: detection and association in balance, over thresholds of similarity.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{Candidate, Moment, Scenario};
use crate::assignment::{Assignment, Pair};

/// Number of thresholds of similarity: 0.05, 0.1 ... 0.95.
const THRESHOLDS: usize = 19;

/// HOTA at one threshold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct HotaPoint {
    /// Least similarity of a match: distances up to (1 - this) of the limit.
    pub similarity: f64,
    /// sqrt(DetA AssA).
    pub hota: f64,
    /// TP / (TP + FN + FP).
    pub det_a: f64,
    /// Mean over true points of the Jaccard index of their track and target.
    pub ass_a: f64,
}

/// HOTA: the mean over the thresholds.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Hota {
    /// sqrt(DetA AssA).
    pub hota: f64,
    /// Detection accuracy.
    pub det_a: f64,
    /// Association accuracy.
    pub ass_a: f64,
    /// At each threshold.
    pub hota_at: Vec<HotaPoint>,
}

/// Of a target and a track, by their numbers.
type OfPairs<T> = BTreeMap<(usize, usize), T>;

impl Hota {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let alignment = alignment(scenario);
        let mut assignment = Assignment::exact();
        let mut matched: Vec<OfPairs<usize>> = vec![OfPairs::new(); THRESHOLDS];
        for moment in &scenario.moments {
            // Of all matchings the one that serves the association over all frames best.
            let worth = |c: &Candidate| alignment[&pair_of(moment, c)] * c.similarity;
            let pairs: Vec<Pair> = moment.candidates.iter().map(|c| Pair::new(c.target, c.point, worth(c))).collect();
            assignment.solve(moment.targets.len(), moment.points.len(), &pairs);
            for c in moment.candidates.iter().filter(|c| assignment.of_row[c.target] == Some(c.point)) {
                for (i, matched) in matched.iter_mut().enumerate() {
                    if c.similarity >= threshold(i) - f64::EPSILON {
                        *matched.entry(pair_of(moment, c)).or_default() += 1;
                    }
                }
            }
        }
        let hota_at: Vec<HotaPoint> =
            matched.iter().enumerate().map(|(i, matched)| HotaPoint::new(threshold(i), matched, scenario)).collect();
        let mean = |value: fn(&HotaPoint) -> f64| hota_at.iter().map(value).sum::<f64>() / THRESHOLDS as f64;
        Self { hota: mean(|p| p.hota), det_a: mean(|p| p.det_a), ass_a: mean(|p| p.ass_a), hota_at }
    }
}

impl HotaPoint {
    fn new(similarity: f64, matched: &OfPairs<usize>, scenario: &Scenario) -> Self {
        let targets: usize = scenario.target_boxes.iter().sum();
        let points: usize = scenario.track_points.iter().sum();
        let hits: usize = matched.values().sum();
        if hits == 0 {
            return Self { similarity, ..Self::default() };
        }
        let jaccard = |(&(target, track), &common): (&(usize, usize), &usize)| {
            let either = scenario.target_boxes[target] + scenario.track_points[track] - common;
            common as f64 * common as f64 / either as f64
        };
        let det_a = hits as f64 / (targets + points - hits) as f64;
        let ass_a = matched.iter().map(jaccard).sum::<f64>() / hits as f64;
        Self { similarity, hota: (det_a * ass_a).sqrt(), det_a, ass_a }
    }
}

fn threshold(index: usize) -> f64 {
    0.05 + 0.05 * index as f64
}

fn pair_of(moment: &Moment, c: &Candidate) -> (usize, usize) {
    (moment.targets[c.target], moment.points[c.point])
}

/// Jaccard index of targets and tracks over all frames before anything is matched: each frame adds what of the pair's
/// similarity is not shared with others.
fn alignment(scenario: &Scenario) -> OfPairs<f64> {
    let mut together = OfPairs::<f64>::new();
    for moment in &scenario.moments {
        let (mut of_target, mut of_point) = (vec![0.0; moment.targets.len()], vec![0.0; moment.points.len()]);
        for c in &moment.candidates {
            of_target[c.target] += c.similarity;
            of_point[c.point] += c.similarity;
        }
        for c in &moment.candidates {
            let either = of_target[c.target] + of_point[c.point] - c.similarity;
            let share = if either > f64::EPSILON { c.similarity / either } else { 0.0 };
            *together.entry(pair_of(moment, c)).or_default() += share;
        }
    }
    for (&(target, track), value) in &mut together {
        *value /= (scenario.target_boxes[target] + scenario.track_points[track]) as f64 - *value;
    }
    together
}
