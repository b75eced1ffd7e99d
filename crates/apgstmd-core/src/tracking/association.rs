//! Which detection continues which track: the likeliest one-to-one matching within the gates.
//!
//! A pair costs d^2 / S + ln(S / S_0) + w (1 - cos(turn)) - trace, with S the variance of the distance: twice the
//! negative logarithm of its likelihood, as far as the terms differ between pairs. Leaving out a pair that could be
//! matched costs more than any pair: what can be continued is.

use super::track::Track;
use crate::assignment::{Assignment, Pair};
use crate::detection::Detection;
use crate::params::TrackingParams;

/// So many tracks that compete, each with several detections of so many, are matched greedily: the time of the optimal
/// matching grows with the cube of their number, and a picture in which that many targets are within reach of each
/// other is noise.
const MOST: usize = 400;
/// Share of v_opt below which a track has no direction to compare with.
const SLOW: f64 = 0.2;

#[derive(Debug)]
pub(super) struct Association {
    gate: f64,
    limit: f64,
    noise: f64,
    direction_weight: f64,
    trace_weight: f64,
    slow: f64,
    /// Detections by column.
    by_x: Vec<(f64, usize)>,
    used: Vec<bool>,
    pairs: Vec<Pair>,
    costs: Vec<f64>,
    assignment: Assignment,
    /// Detection of each track, in the order in which they were linked.
    pub found: Vec<Option<usize>>,
}

impl Association {
    pub fn new(params: &TrackingParams, v_opt: f64) -> Self {
        Self {
            gate: params.gate,
            limit: params.gate_limit,
            noise: params.noise.powi(2),
            direction_weight: params.direction_weight,
            trace_weight: params.trace_weight,
            slow: SLOW * v_opt,
            by_x: Vec::new(),
            used: Vec::new(),
            pairs: Vec::new(),
            costs: Vec::new(),
            assignment: Assignment::with_most(MOST),
            found: Vec::new(),
        }
    }

    /// A new frame.
    pub fn begin(&mut self, detections: &[Detection]) {
        self.found.clear();
        self.used.clear();
        let is_number = |d: &Detection| [d.x, d.y, d.score].iter().all(|value| value.is_finite());
        self.used.extend(detections.iter().map(|d| !is_number(d)));
        self.by_x.clear();
        let usable = detections.iter().enumerate().filter(|(index, _)| !self.used[*index]);
        self.by_x.extend(usable.map(|(index, d)| (f64::from(d.x), index)));
        self.by_x.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    /// Detections that continue nothing, in the order given.
    pub fn free(&self) -> impl Iterator<Item = usize> {
        self.used.iter().enumerate().filter(|(_, used)| !**used).map(|(index, _)| index)
    }

    /// Gives these tracks their detections among those still free. `moves`: how far the background at a track moves in a step, where
    /// directions are in the picture.
    pub fn link(&mut self, tracks: &[Track], detections: &[Detection], moves: impl Fn(&Track) -> (f64, f64)) {
        self.pairs.clear();
        self.costs.clear();
        for (row, track) in tracks.iter().enumerate() {
            let spread = track.motion.variance() + self.noise;
            let reach = (self.gate * spread.sqrt()).min(self.limit);
            let (x, y) = track.motion.place;
            let first = self.by_x.partition_point(|(column, _)| *column < x - reach);
            for &(_, index) in self.by_x[first..].iter().take_while(|(column, _)| *column <= x + reach) {
                let detection = &detections[index];
                let distance = (f64::from(detection.x) - x).hypot(f64::from(detection.y) - y);
                if self.used[index] || distance > reach {
                    continue;
                }
                let mut cost = distance.powi(2) / spread + (spread / self.noise).ln();
                cost += self.direction_weight * self.turn(detection, track, moves(track));
                if detection.trace == track.trace {
                    cost -= self.trace_weight;
                }
                self.costs.push(cost);
                self.pairs.push(Pair { row, column: index, weight: 0 });
            }
        }
        let dearest = self.costs.iter().fold(0.0f64, |most, cost| most.max(*cost));
        let least = self.costs.iter().fold(0.0f64, |least, cost| least.min(*cost));
        // Any two matches are then worth more than any one.
        let full = 2.0 * dearest - least + 1.0;
        for (pair, cost) in self.pairs.iter_mut().zip(&self.costs) {
            *pair = Pair::new(pair.row, pair.column, full - cost);
        }
        self.assignment.solve(tracks.len(), detections.len(), &self.pairs);
        for found in &self.assignment.of_row {
            found.iter().for_each(|index| self.used[*index] = true);
            self.found.push(*found);
        }
    }

    /// 1 - cos of the angle between the detection's direction (counter-clockwise on the screen) and the track's motion
    /// (y downward), in the picture by `shift`; 1, as for one at random, where either has none.
    fn turn(&self, detection: &Detection, track: &Track, shift: (f64, f64)) -> f64 {
        let (vx, vy) = (track.motion.velocity.0 + shift.0, track.motion.velocity.1 + shift.1);
        let (direction, speed) = (f64::from(detection.direction), vx.hypot(vy));
        if !direction.is_finite() || speed <= self.slow {
            return 1.0;
        }
        1.0 - (direction.cos() * vx - direction.sin() * vy) / speed
    }
}
