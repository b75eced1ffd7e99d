//! Which detection is which target: greedy, best score first, within each frame.

use std::collections::HashMap;

use super::track::{Tracks, turn};
use super::{Options, Scored, TruthBox};

/// What became of a detection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// On a target: distance from its centre, px, and from its direction, radians, where both are known.
    True { distance: f64, turn: Option<f64> },
    /// On nothing.
    False,
    /// On something that counts for nothing.
    Neutral,
}

/// A score and what became of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Outcome {
    pub score: f64,
    pub verdict: Verdict,
}

/// One outcome for each detection in the judged frames, best score first.
pub(super) fn outcomes(detections: &[Scored], truth: &[TruthBox], options: &Options) -> Vec<Outcome> {
    let tracks = Tracks::new(truth);
    let mut boxes: HashMap<usize, Vec<usize>> = HashMap::new();
    for (index, b) in truth.iter().enumerate() {
        boxes.entry(b.frame).or_default().push(index);
    }
    let mut order: Vec<&Scored> = detections.iter().filter(|d| options.frames.contains(&d.frame)).collect();
    order.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut taken = vec![false; truth.len()];
    let judge = |detection: &Scored| {
        let here = boxes.get(&detection.frame).map_or(&[][..], Vec::as_slice);
        let near = here.iter().filter(|i| matches(detection, &truth[**i], options));
        let free = near.clone().filter(|i| truth[**i].counts() && !taken[**i]);
        let nearest = free.min_by(|a, b| distance(detection, &truth[**a]).total_cmp(&distance(detection, &truth[**b])));
        let verdict = match nearest {
            Some(&index) => {
                taken[index] = true;
                let known = detection.direction.zip(tracks.direction(&truth[index]));
                let turn = known.map(|(found, expected)| turn(found, expected));
                Verdict::True { distance: distance(detection, &truth[index]), turn }
            }
            None if near.clone().any(|i| !truth[*i].counts()) => Verdict::Neutral,
            None => Verdict::False,
        };
        Outcome { score: detection.score, verdict }
    };
    order.into_iter().map(judge).collect()
}

/// From the centre of the box, px.
pub(super) fn distance(detection: &Scored, target: &TruthBox) -> f64 {
    let (x, y) = target.center();
    (detection.x - x).hypot(detection.y - y)
}

/// Whether a detection lies on a box; borders belong to it.
pub(super) fn matches(detection: &Scored, target: &TruthBox, options: &Options) -> bool {
    let (x, y) = target.center();
    let inside = |offset: f64, side: f64| offset.abs() <= side / 2.0 + options.margin;
    distance(detection, target) <= options.radius
        || (inside(detection.x - x, target.width) && inside(detection.y - y, target.height))
}
