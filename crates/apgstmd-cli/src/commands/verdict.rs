//! The demo's detections against the truth, target by target.

use std::f64::consts::PI;

use apgstmd_core::evaluation::{EvaluationError, Options, Scored, TruthBox, evaluate};
use apgstmd_core::stimulus::Truth;
use serde::Serialize;

use crate::report::align;

/// False alarms a frame that the threshold is chosen for.
const ALARMS: f64 = 0.1;

/// What was found, at the lowest threshold that gives at most [`ALARMS`].
#[derive(Debug, Serialize)]
pub(super) struct Verdict {
    /// Score from which on a detection counts; none when no threshold keeps to the limit.
    pub threshold: Option<f64>,
    /// Limit the threshold was chosen for, false alarms a frame.
    pub limit: f64,
    /// False alarms a frame at that threshold.
    pub false_alarms: f64,
    /// True detections / visible targets at that threshold.
    pub detection_rate: f64,
    /// Area under the detection rate over 0..1 false alarms a frame, over all thresholds.
    pub area: f64,
    /// With every detection, whatever its score.
    pub everything: Everything,
    /// One by one.
    pub targets: Vec<TargetVerdict>,
}

/// Without a threshold.
#[derive(Debug, Serialize)]
pub(super) struct Everything {
    pub detection_rate: f64,
    pub false_alarms: f64,
}

/// One target.
#[derive(Debug, Serialize)]
pub(super) struct TargetVerdict {
    pub target: usize,
    pub width: f64,
    pub height: f64,
    /// Mean Weber contrast.
    pub contrast: f64,
    /// Mean speed, px/frame.
    pub speed: f64,
    /// Direction in degrees where it keeps one.
    pub direction_deg: Option<f64>,
    /// Frames from its first visible one to the first that it is found in.
    pub first_found_after: Option<usize>,
    /// Frames found / frames visible.
    pub frames_found: f64,
    /// Median distance from its centre, px.
    pub position_error: Option<f64>,
    /// Median angle from its track, degrees.
    pub direction_error_deg: Option<f64>,
}

impl Verdict {
    pub fn new(found: &[Scored], truth: &[Truth], boxes: &[TruthBox], frames: usize) -> Result<Self, EvaluationError> {
        let options = Options::new(0..frames);
        let overall = evaluate(found, boxes, &options)?;
        let within = overall.curve.iter().take_while(|point| point.false_alarms <= ALARMS).last().copied();
        let threshold = within.map(|point| point.threshold);
        let kept: Vec<Scored> =
            found.iter().filter(|d| threshold.is_some_and(|least| d.score >= least)).copied().collect();
        let mut ids: Vec<usize> = truth.iter().map(|row| row.id).collect();
        ids.sort_unstable();
        ids.dedup();
        let targets = ids
            .into_iter()
            .map(|id| TargetVerdict::new(id, &kept, truth, boxes, &options))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            threshold,
            limit: ALARMS,
            false_alarms: within.map_or(0.0, |point| point.false_alarms),
            detection_rate: within.map_or(0.0, |point| point.detection_rate),
            area: overall.area,
            everything: Everything {
                detection_rate: overall.all.detection_rate,
                false_alarms: overall.false_detections as f64 / frames as f64,
            },
            targets,
        })
    }

    /// For people.
    pub fn table(&self) -> String {
        let header = [
            "target",
            "size px",
            "contrast",
            "px/frame",
            "direction",
            "found after",
            "frames found",
            "off by",
            "direction off by",
        ];
        let mut rows = vec![header.map(str::to_owned)];
        for target in &self.targets {
            rows.push([
                target.target.to_string(),
                format!("{:.0} x {:.0}", target.width, target.height),
                format!("{:.2}", target.contrast),
                format!("{:.2}", target.speed),
                target.direction_deg.map_or("turning".to_owned(), |deg| format!("{deg:.0} deg")),
                target.first_found_after.map_or("never".to_owned(), |n| format!("{n} frames")),
                format!("{:.0} %", 100.0 * target.frames_found),
                target.position_error.map_or("-".to_owned(), |px| format!("{px:.1} px")),
                target.direction_error_deg.map_or("-".to_owned(), |deg| format!("{deg:.0} deg")),
            ]);
        }
        let mut text = align(&rows);
        text += &match self.threshold {
            Some(threshold) => format!(
                "\n{:.0} % of all targets in all frames at {:.2} false alarms a frame (score of at least {threshold:.1e}, \
                 the lowest that keeps to {})\n",
                100.0 * self.detection_rate,
                self.false_alarms,
                self.limit,
            ),
            None => format!("\nno threshold keeps to {} false alarms a frame\n", self.limit),
        };
        text += &format!(
            "{:.0} % at {:.1} false alarms a frame with every detection, whatever its score\n",
            100.0 * self.everything.detection_rate,
            self.everything.false_alarms,
        );
        text
    }
}

impl TargetVerdict {
    fn new(
        id: usize,
        kept: &[Scored],
        truth: &[Truth],
        boxes: &[TruthBox],
        options: &Options,
    ) -> Result<Self, EvaluationError> {
        // The others are neither rewarded nor punished: what remains is this target's own record.
        let own_id = Some(id as i64);
        let alone: Vec<TruthBox> =
            boxes.iter().map(|b| TruthBox { ignore: b.ignore || b.id != own_id, ..*b }).collect();
        let evaluation = evaluate(kept, &alone, options)?;
        let rows: Vec<&Truth> = truth.iter().filter(|row| row.id == id).collect();
        let track = Track::new(&rows);
        let first = rows.iter().find(|row| row.visible).map(|row| row.frame);
        let hit = |row: &&&Truth| {
            let (x, y) = row.center();
            kept.iter().any(|d| d.frame == row.frame && (d.x - x).hypot(d.y - y) <= options.radius)
        };
        let first_hit = rows.iter().filter(|row| row.visible).find(hit).map(|row| row.frame);
        Ok(Self {
            target: id,
            width: rows.iter().map(|row| row.width).fold(0.0, f64::max),
            height: rows.iter().map(|row| row.height).fold(0.0, f64::max),
            contrast: mean(rows.iter().map(|row| row.contrast)),
            speed: track.speed,
            direction_deg: track.direction.map(|direction| (direction.to_degrees() + 360.0).round() % 360.0),
            first_found_after: first_hit.zip(first).map(|(hit, first)| hit - first),
            frames_found: evaluation.all.detection_rate,
            position_error: evaluation.all.localisation_error,
            direction_error_deg: evaluation.all.direction_error.map(f64::to_degrees),
        })
    }
}

/// How a target moves, from the truth.
struct Track {
    speed: f64,
    direction: Option<f64>,
}

impl Track {
    fn new(rows: &[&Truth]) -> Self {
        // Boxes cut by the picture's edge have their centre elsewhere.
        let whole = |row: &Truth| {
            let most = rows.iter().fold((0.0f64, 0.0f64), |m, r| (m.0.max(r.width), m.1.max(r.height)));
            row.width > 0.99 * most.0 && row.height > 0.99 * most.1
        };
        let steps: Vec<(f64, f64)> = rows
            .windows(2)
            .filter(|pair| pair[1].frame == pair[0].frame + 1 && whole(pair[0]) && whole(pair[1]))
            .map(|pair| {
                let (from, to) = (pair[0].center(), pair[1].center());
                (to.0 - from.0, to.1 - from.1)
            })
            .collect();
        let speed = mean(steps.iter().map(|(dx, dy)| dx.hypot(*dy)));
        let (dx, dy) = steps.iter().fold((0.0, 0.0), |sum, step| (sum.0 + step.0, sum.1 + step.1));
        let path: f64 = steps.iter().map(|(dx, dy)| dx.hypot(*dy)).sum();
        // A path that is one part in a thousand longer than its chord turns by some degrees.
        let straight = path > 0.0 && dx.hypot(dy) > 0.999 * path;
        Self { speed, direction: straight.then(|| (-dy).atan2(dx)).map(|a| if a <= -PI { PI } else { a }) }
    }
}

/// Speed the model should be tuned to: the mean over targets, px/frame.
pub(super) fn speed_of_targets(truth: &[Truth]) -> f64 {
    let mut ids: Vec<usize> = truth.iter().map(|row| row.id).collect();
    ids.sort_unstable();
    ids.dedup();
    let speeds = ids.iter().map(|id| {
        let rows: Vec<&Truth> = truth.iter().filter(|row| row.id == *id).collect();
        Track::new(&rows).speed
    });
    (100.0 * mean(speeds)).round() / 100.0
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0usize, 0.0), |(count, sum), value| (count + 1, sum + value));
    if count == 0 { 0.0 } else { sum / count as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truth(frames: usize) -> Vec<Truth> {
        let row = |frame: usize| Truth {
            frame,
            id: 0,
            x: 10.0 + frame as f64,
            y: 20.0,
            width: 5.0,
            height: 5.0,
            visible: true,
            contrast: 0.5,
        };
        (0..frames).map(row).collect()
    }

    #[test]
    fn numbers_are_those_of_the_detections() {
        let truth = truth(40);
        let boxes: Vec<TruthBox> = truth.iter().map(|row| (*row).into()).collect();
        // Found from frame 10 on, 1 px too far left; one strong and one weak false alarm.
        let mut found: Vec<Scored> = (10..40).map(|f| Scored::new(f, 11.0 + f as f64, 22.0, 1.0)).collect();
        found.push(Scored::new(5, 90.0, 90.0, 2.0));
        found.extend((0..40).map(|f| Scored::new(f, 90.0, 90.0, 0.1)));
        let verdict = Verdict::new(&found, &truth, &boxes, 40).unwrap();
        assert_eq!(verdict.threshold, Some(1.0));
        assert_eq!((verdict.detection_rate, verdict.false_alarms), (0.75, 0.025));
        let target = &verdict.targets[0];
        assert_eq!((target.first_found_after, target.frames_found), (Some(10), 0.75));
        assert_eq!((target.speed, target.direction_deg), (1.0, Some(0.0)));
        assert_eq!(target.position_error, Some(1.0));
        assert_eq!(speed_of_targets(&truth), 1.0);
    }

    #[test]
    fn nothing_found_is_said() {
        let truth = truth(20);
        let boxes: Vec<TruthBox> = truth.iter().map(|row| (*row).into()).collect();
        let verdict = Verdict::new(&[], &truth, &boxes, 20).unwrap();
        assert_eq!((verdict.threshold, verdict.detection_rate), (None, 0.0));
        assert!(verdict.table().contains("never"));
    }
}
