//! CLEAR MOT: misses, false positives, switches, frame by frame.

use serde::Serialize;

use super::Scenario;
use crate::assignment::{Assignment, Pair};

/// How much more keeping a track is worth than any other match.
const KEEP: f64 = 1000.0;
/// Share of its frames from which on a target is mostly tracked, and below which it is mostly lost.
const MOSTLY: (f64, f64) = (0.8, 0.2);

/// CLEAR MOT: counts over all frames, and what they come to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Clear {
    /// 1 - (misses + false positives + switches) / targets; 0 without targets. Without bound below.
    pub mota: f64,
    /// Mean distance of matched points from the centres of their targets, px; none where nothing is matched.
    pub motp: Option<f64>,
    /// Points that are matched.
    pub matched: usize,
    /// Targets that are not.
    pub misses: usize,
    /// Points that are not.
    pub false_positives: usize,
    /// How often a target is matched with another track than when it was last matched.
    pub id_switches: usize,
    /// How often a target is matched again after frames in which it was not.
    pub fragmentations: usize,
    /// Targets matched in more than 80 % of the frames in which they are visible.
    pub mostly_tracked: usize,
    /// Targets between mostly tracked and mostly lost.
    pub partly_tracked: usize,
    /// Targets matched in less than 20 % of their frames.
    pub mostly_lost: usize,
}

/// What a match is worth: two are never worth less than one.
pub(super) fn worth(similarity: f64) -> f64 {
    0.5 + 0.5 * similarity
}

/// What is remembered of a target.
#[derive(Clone, Copy, Default)]
struct Memory {
    /// Track it was last matched with.
    last: Option<usize>,
    /// Track it was matched with in the last frame with both targets and points.
    before: Option<usize>,
    /// Frames in which it was matched.
    matched: usize,
    /// How often it began to be matched.
    begun: usize,
}

impl Clear {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let mut clear = Self::default();
        let mut memory = vec![Memory::default(); scenario.target_boxes.len()];
        let mut assignment = Assignment::exact();
        let mut distances = 0.0;
        for moment in &scenario.moments {
            if moment.targets.is_empty() || moment.points.is_empty() {
                clear.misses += moment.targets.len();
                clear.false_positives += moment.points.len();
                continue;
            }
            let pairs: Vec<Pair> = moment
                .candidates
                .iter()
                .map(|c| {
                    let keeps = memory[moment.targets[c.target]].before == Some(moment.points[c.point]);
                    Pair::new(c.target, c.point, worth(c.similarity) + if keeps { KEEP } else { 0.0 })
                })
                .collect();
            assignment.solve(moment.targets.len(), moment.points.len(), &pairs);
            let tracked: Vec<Option<usize>> = memory.iter().map(|m| m.before).collect();
            memory.iter_mut().for_each(|m| m.before = None);
            let mut matched = 0;
            for c in moment.candidates.iter().filter(|c| assignment.of_row[c.target] == Some(c.point)) {
                let (target, track) = (moment.targets[c.target], moment.points[c.point]);
                let m = &mut memory[target];
                clear.id_switches += usize::from(m.last.is_some_and(|last| last != track));
                m.begun += usize::from(tracked[target].is_none());
                (m.last, m.before) = (Some(track), Some(track));
                m.matched += 1;
                matched += 1;
                distances += c.distance;
            }
            clear.matched += matched;
            clear.misses += moment.targets.len() - matched;
            clear.false_positives += moment.points.len() - matched;
        }
        clear.fragmentations = memory.iter().map(|m| m.begun.saturating_sub(1)).sum();
        for (m, boxes) in memory.iter().zip(&scenario.target_boxes) {
            match m.matched as f64 / *boxes as f64 {
                share if share > MOSTLY.0 => clear.mostly_tracked += 1,
                share if share < MOSTLY.1 => clear.mostly_lost += 1,
                _ => clear.partly_tracked += 1,
            }
        }
        let targets = clear.matched + clear.misses;
        if targets > 0 {
            let wrong = clear.misses + clear.false_positives + clear.id_switches;
            clear.mota = 1.0 - wrong as f64 / targets as f64;
        }
        clear.motp = (clear.matched > 0).then(|| distances / clear.matched as f64);
        clear
    }
}
