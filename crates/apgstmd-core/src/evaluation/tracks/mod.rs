//! How good tracks are, against truth with ids, by the distance of centres.
//!
//! A point of a track may be matched with a target where [`super::evaluate`] would call a detection true: within 5 px of
//! its centre or inside its box grown by 2 px. Their similarity is 1 - distance / limit, where limit is how far that
//! region reaches in the direction of the point: 1 at the centre, 0 at the limit. Points that no visible target in their
//! frame can take, but that lie on one that is not visible or is marked `ignore`, count for nothing.
//!
//! - **CLEAR MOT** (Bernardin & Stiefelhagen 2008, *Evaluating multiple object tracking performance: the CLEAR MOT
//!   metrics*): in each frame a target keeps the track that it had in the last frame with both targets and points, as
//!   long as they match; the rest is assigned optimally. MOTA = 1 - (misses + false positives + switches) / targets;
//!   MOTP is the mean distance of what is matched. A switch is a target matched with another track than when it was
//!   last matched; a fragmentation is a target matched again after frames in which it was not.
//! - **IDF1** (Ristani et al. 2016, *Performance measures and a data set for multi-target, multi-camera tracking*):
//!   tracks and targets are assigned once for all frames, so that most of their points match;
//!   IDF1 = 2 IDTP / (2 IDTP + IDFP + IDFN).
//! - **HOTA** (Luiten et al. 2021, *HOTA: a higher order metric for evaluating multi-object tracking*): at each of 19
//!   thresholds of similarity, 0.05 to 0.95, that is at distances of 0.95 to 0.05 of the limit (4.75 to 0.25 px for small
//!   targets), HOTA is the geometric mean of detection accuracy DetA = TP / (TP + FN + FP) and association accuracy
//!   AssA, the mean over true points of the Jaccard index of their track and their target. Reported is the mean over the
//!   thresholds.
//!
//! All follow the reference implementation TrackEval to its choices where the publications leave one.

mod clear;
mod hota;
mod identity;

use std::collections::HashMap;

use serde::Serialize;

use super::matching::{distance, matches};
use super::{EvaluationError, Options, Scored, TruthBox, check};
use crate::assignment::{Assignment, Pair};

pub use clear::Clear;
pub use hota::{Hota, HotaPoint};
pub use identity::Identity;

/// A track in one frame, to be judged.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tracked {
    /// Frame, counted from 0.
    pub frame: usize,
    /// Which track.
    pub track: i64,
    /// Column, px, pixel centres at integers.
    pub x: f64,
    /// Row, px, downward.
    pub y: f64,
}

/// How good tracks are.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrackEvaluation {
    /// Tracks with a point that counts.
    pub tracks: usize,
    /// Points of them.
    pub points: usize,
    /// Points that count for nothing.
    pub neutral_points: usize,
    /// Different targets that are visible in some frame.
    pub identities: usize,
    /// CLEAR MOT.
    #[serde(flatten)]
    pub clear: Clear,
    /// IDF1 and its parts.
    #[serde(flatten)]
    pub identity: Identity,
    /// HOTA and its parts.
    #[serde(flatten)]
    pub hota: Hota,
}

/// Judges tracks against truth.
///
/// Boxes without id are one target, as long as no frame holds two that count.
///
/// ```
/// use apgstmd_core::evaluation::{Options, Tracked, TruthBox, evaluate_tracks};
/// let target = |t: usize| TruthBox { id: Some(1), ..TruthBox::new(t, [10.0 + t as f64, 20.0, 4.0, 4.0]) };
/// let truth: Vec<TruthBox> = (0..10).map(target).collect();
/// // On the centre; in the sixth frame the track breaks and goes on under another id.
/// let point = |t: usize| Tracked { frame: t, track: i64::from(t >= 5), x: 11.5 + t as f64, y: 21.5 };
/// let tracks: Vec<Tracked> = (0..10).map(point).collect();
/// let judged = evaluate_tracks(&tracks, &truth, &Options::new(0..10))?;
/// assert_eq!((judged.clear.id_switches, judged.clear.mota, judged.identity.idf1), (1, 0.9, 0.5));
/// assert_eq!((judged.hota.det_a, judged.hota.ass_a), (1.0, 0.5));
/// # Ok::<(), apgstmd_core::evaluation::EvaluationError>(())
/// ```
///
/// # Errors
/// When there are no frames, a number is not finite, a track or a target is twice in a frame, or targets cannot be told
/// apart.
pub fn evaluate_tracks(
    tracked: &[Tracked],
    truth: &[TruthBox],
    options: &Options,
) -> Result<TrackEvaluation, EvaluationError> {
    let points: Vec<Scored> = tracked.iter().map(|p| Scored::new(p.frame, p.x, p.y, 0.0)).collect();
    check(&points, truth, options)?;
    let scenario = Scenario::new(tracked, truth, options)?;
    Ok(TrackEvaluation {
        tracks: scenario.track_points.len(),
        points: scenario.track_points.iter().sum(),
        neutral_points: scenario.neutral,
        identities: scenario.target_boxes.len(),
        clear: Clear::new(&scenario),
        identity: Identity::new(&scenario),
        hota: Hota::new(&scenario),
    })
}

/// A target and a point of a track, numbered within their frame, that may be matched.
struct Candidate {
    target: usize,
    point: usize,
    distance: f64,
    /// In [0, 1].
    similarity: f64,
}

/// What is to be matched in one frame.
struct Moment {
    /// Number of each target's identity.
    targets: Vec<usize>,
    /// Number of each point's track.
    points: Vec<usize>,
    candidates: Vec<Candidate>,
}

/// The frames with something in them that counts, in order; identities and tracks are numbered from 0.
struct Scenario {
    moments: Vec<Moment>,
    /// How many boxes each identity has.
    target_boxes: Vec<usize>,
    /// How many points each track has.
    track_points: Vec<usize>,
    neutral: usize,
}

impl Scenario {
    fn new(tracked: &[Tracked], truth: &[TruthBox], options: &Options) -> Result<Self, EvaluationError> {
        let mut frames: HashMap<usize, (Vec<&TruthBox>, Vec<&Tracked>)> = HashMap::new();
        for b in truth.iter().filter(|b| options.frames.contains(&b.frame)) {
            frames.entry(b.frame).or_default().0.push(b);
        }
        for point in tracked.iter().filter(|p| options.frames.contains(&p.frame)) {
            frames.entry(point.frame).or_default().1.push(point);
        }
        let mut order: Vec<usize> = frames.keys().copied().collect();
        order.sort_unstable();
        let mut scenario = Self { moments: Vec::new(), target_boxes: Vec::new(), track_points: Vec::new(), neutral: 0 };
        let (mut identities, mut tracks) = (Numbers::default(), Numbers::default());
        let mut assignment = Assignment::exact();
        for frame in order {
            let (boxes, points) = &frames[&frame];
            check_frame(frame, boxes, points)?;
            let targets: Vec<&TruthBox> = boxes.iter().filter(|b| b.counts()).copied().collect();
            let kept = kept(&targets, boxes, points, options, &mut assignment);
            scenario.neutral += points.len() - kept.len();
            let moment = Moment {
                candidates: candidates(&targets, &kept, options),
                targets: targets.iter().map(|b| identities.of(b.id, &mut scenario.target_boxes)).collect(),
                points: kept.iter().map(|p| tracks.of(p.track, &mut scenario.track_points)).collect(),
            };
            scenario.moments.push(moment);
        }
        Ok(scenario)
    }
}

/// Numbers for names, in the order of their first appearance.
struct Numbers<T>(HashMap<T, usize>);

impl<T> Default for Numbers<T> {
    fn default() -> Self {
        Self(HashMap::new())
    }
}

impl<T: std::hash::Hash + Eq> Numbers<T> {
    /// The number of a name, which is counted.
    fn of(&mut self, name: T, counts: &mut Vec<usize>) -> usize {
        let number = *self.0.entry(name).or_insert_with(|| {
            counts.push(0);
            counts.len() - 1
        });
        counts[number] += 1;
        number
    }
}

/// Nothing is twice in a frame.
fn check_frame(frame: usize, boxes: &[&TruthBox], points: &[&Tracked]) -> Result<(), EvaluationError> {
    let mut ids: Vec<Option<i64>> = boxes.iter().filter(|b| b.counts()).map(|b| b.id).collect();
    ids.sort_unstable();
    match ids.windows(2).find(|pair| pair[0] == pair[1]) {
        Some([Some(id), _]) => return Err(EvaluationError::Twice { what: "the target", id: *id, frame }),
        Some(_) => return Err(EvaluationError::NoIds { frame }),
        None => {}
    }
    let mut ids: Vec<i64> = points.iter().map(|p| p.track).collect();
    ids.sort_unstable();
    match ids.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(EvaluationError::Twice { what: "the track", id: pair[0], frame }),
        None => Ok(()),
    }
}

/// Points that count: those that a target takes, and of the others those that lie on nothing hidden or ignored.
fn kept<'a>(
    targets: &[&TruthBox],
    boxes: &[&TruthBox],
    points: &[&'a Tracked],
    options: &Options,
    assignment: &mut Assignment,
) -> Vec<&'a Tracked> {
    if targets.len() == boxes.len() {
        return points.to_vec();
    }
    let pairs: Vec<Pair> = candidates(targets, points, options)
        .iter()
        .map(|c| Pair::new(c.point, c.target, clear::worth(c.similarity)))
        .collect();
    assignment.solve(points.len(), targets.len(), &pairs);
    let pardoned = |point: &Tracked| boxes.iter().any(|b| !b.counts() && matches(&scored(point), b, options));
    let kept = points.iter().zip(&assignment.of_row).filter(|(point, taken)| taken.is_some() || !pardoned(point));
    kept.map(|(point, _)| *point).collect()
}

fn candidates(targets: &[&TruthBox], points: &[&Tracked], options: &Options) -> Vec<Candidate> {
    let mut all = Vec::new();
    for (target, b) in targets.iter().enumerate() {
        for (point, p) in points.iter().enumerate() {
            let found = scored(p);
            if matches(&found, b, options) {
                let distance = distance(&found, b);
                all.push(Candidate { target, point, distance, similarity: similarity(&found, b, options) });
            }
        }
    }
    all
}

fn scored(point: &Tracked) -> Scored {
    Scored::new(point.frame, point.x, point.y, 0.0)
}

/// 1 - distance / limit: the region of a match is a disc and a box around one centre, and reaches in each direction as
/// far as the farther of the two.
fn similarity(found: &Scored, target: &TruthBox, options: &Options) -> f64 {
    let (x, y) = target.center();
    let share = |offset: f64, reach: f64| if offset == 0.0 { 0.0 } else { offset.abs() / reach };
    let of_box = share(found.x - x, target.width / 2.0 + options.margin)
        .max(share(found.y - y, target.height / 2.0 + options.margin));
    let of_disc = share(distance(found, target), options.radius);
    (1.0 - of_box.min(of_disc)).max(0.0)
}

#[cfg(test)]
mod tests;
