//! IDF1: one track for one target, over all frames.

use std::collections::BTreeMap;

use serde::Serialize;

use super::Scenario;
use crate::assignment::{Assignment, Pair};

/// IDF1: what is right when each target has one track for good.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Identity {
    /// 2 IDTP / (2 IDTP + IDFP + IDFN); 0 where there is nothing.
    pub idf1: f64,
    /// IDTP / (IDTP + IDFP).
    pub id_precision: f64,
    /// IDTP / (IDTP + IDFN).
    pub id_recall: f64,
    /// IDTP: points of tracks that match their own target.
    pub id_true: usize,
    /// IDFP: points that do not.
    pub id_false: usize,
    /// IDFN: targets that their own track does not match.
    pub id_missed: usize,
}

impl Identity {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let mut together: BTreeMap<(usize, usize), i64> = BTreeMap::new();
        for moment in &scenario.moments {
            for c in &moment.candidates {
                *together.entry((moment.targets[c.target], moment.points[c.point])).or_default() += 1;
            }
        }
        let pairs: Vec<Pair> = together.iter().map(|(&(row, column), &weight)| Pair { row, column, weight }).collect();
        let mut assignment = Assignment::exact();
        assignment.solve(scenario.target_boxes.len(), scenario.track_points.len(), &pairs);
        let matched = |pair: &&Pair| assignment.of_row[pair.row] == Some(pair.column);
        let id_true = pairs.iter().filter(matched).map(|pair| pair.weight as usize).sum();
        let targets: usize = scenario.target_boxes.iter().sum();
        let points: usize = scenario.track_points.iter().sum();
        let share = |whole: usize| if whole == 0 { 0.0 } else { id_true as f64 / whole as f64 };
        Self {
            idf1: 2.0 * share(targets + points),
            id_precision: share(points),
            id_recall: share(targets),
            id_true,
            id_false: points - id_true,
            id_missed: targets - id_true,
        }
    }
}
