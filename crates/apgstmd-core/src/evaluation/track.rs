//! Directions of targets, from where their boxes were a little before and a little after.

use std::collections::{HashMap, HashSet};
use std::f64::consts::{PI, TAU};

use super::TruthBox;

/// A displacement this long, px, tells the direction well even of boxes drawn by hand.
const ENOUGH: f64 = 4.0;
/// A shorter one than this tells nothing.
const LEAST: f64 = 1.0;
/// Farthest frames that are looked at, before and after.
const FARTHEST: usize = 10;

/// Centres of each target by frame. Boxes without id are one target as long as no frame holds two of them.
pub(super) struct Tracks {
    centers: HashMap<(Option<i64>, usize), (f64, f64)>,
    unknown: HashSet<Option<i64>>,
}

impl Tracks {
    pub fn new(truth: &[TruthBox]) -> Self {
        let mut tracks = Self { centers: HashMap::new(), unknown: HashSet::new() };
        for target in truth.iter().filter(|b| !b.ignore) {
            if tracks.centers.insert((target.id, target.frame), target.center()).is_some() {
                tracks.unknown.insert(target.id);
            }
        }
        tracks
    }

    /// Direction of a target in its frame: the displacement from the box k frames before to the box k frames after,
    /// for the smallest k that makes it 4 px long, at most 10; where a side is missing, the box itself stands in.
    /// None when that is less than 1 px.
    pub fn direction(&self, target: &TruthBox) -> Option<f64> {
        if target.ignore || self.unknown.contains(&target.id) {
            return None;
        }
        let center = |frame: Option<usize>| frame.and_then(|f| self.centers.get(&(target.id, f)));
        let here = target.center();
        let mut best = None;
        for k in 1..=FARTHEST {
            let before = center(target.frame.checked_sub(k));
            let after = center(target.frame.checked_add(k));
            if before.is_none() && after.is_none() {
                continue;
            }
            let (from, to) = (before.unwrap_or(&here), after.unwrap_or(&here));
            let (dx, dy) = (to.0 - from.0, to.1 - from.1);
            let length = dx.hypot(dy);
            if length >= LEAST {
                best = Some((-dy).atan2(dx));
            }
            if length >= ENOUGH {
                break;
            }
        }
        best
    }
}

/// Angle between two directions, radians in [0, pi].
pub(super) fn turn(a: f64, b: f64) -> f64 {
    let difference = (a - b).rem_euclid(TAU);
    if difference > PI { TAU - difference } else { difference }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(frames: usize, place: impl Fn(f64) -> (f64, f64)) -> Vec<TruthBox> {
        (0..frames)
            .map(|frame| {
                let (x, y) = place(frame as f64);
                TruthBox { id: Some(3), ..TruthBox::new(frame, [x, y, 4.0, 4.0]) }
            })
            .collect()
    }

    #[test]
    fn straight_and_round() {
        let truth = track(30, |t| (50.0 + 0.3 * t, 80.0 - 0.3 * t));
        let tracks = Tracks::new(&truth);
        assert!(truth.iter().all(|b| (tracks.direction(b).unwrap() - PI / 4.0).abs() < 1e-9));
        // One radian a second of 40 frames on R = 40: 1 px/frame, upward at the right.
        let truth = track(80, |t| (40.0 * (t / 40.0).cos(), -40.0 * (t / 40.0).sin()));
        let tracks = Tracks::new(&truth);
        for (frame, target) in truth.iter().enumerate() {
            let error = turn(tracks.direction(target).unwrap(), frame as f64 / 40.0 + PI / 2.0);
            // At the ends a chord of 5 px stands in for the tangent: 5 / (2 R) = 0.0625.
            assert!(error < if (5..75).contains(&frame) { 1e-9 } else { 0.063 }, "{frame}: {error}");
        }
    }

    #[test]
    fn standing_or_ambiguous_has_none() {
        let truth = track(30, |_| (5.0, 5.0));
        assert!(truth.iter().all(|b| Tracks::new(&truth).direction(b).is_none()));
        let mut truth = track(30, |t| (t, 5.0));
        truth.push(truth[7]);
        assert!(truth.iter().all(|b| Tracks::new(&truth).direction(b).is_none()));
    }

    #[test]
    fn turns() {
        // 2 pi is not exact in f64.
        for (a, b, expected) in [(0.1, -0.1, 0.2), (PI - 0.1, -PI + 0.1, 0.2), (0.0, PI, PI), (7.0, 7.0 - TAU, 0.0)] {
            assert!((turn(a, b) - expected).abs() < 1e-12 && (turn(b, a) - expected).abs() < 1e-12);
        }
    }
}
