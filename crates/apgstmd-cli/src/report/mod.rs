//! An evaluation for people: a table, and a page with its curves.

pub(crate) mod chart;
mod figure;
mod json;
mod page;
mod table;

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use apgstmd_core::evaluation::{Evaluation, OperatingPoint, TrackEvaluation};

use crate::Outcome;
use crate::judge::{Judgement, Origin};
use crate::sink::beside;

pub use json::json;
pub use page::page;
pub use table::{align, text};

/// What is reported.
pub struct Report {
    /// The file or folder of the detections.
    pub detections: PathBuf,
    /// The file or folder of the truth.
    pub truth: PathBuf,
    /// The result.
    pub judgement: Judgement,
    /// First and last judged frame.
    pub frames: RangeInclusive<usize>,
    /// What told how many.
    pub origin: Origin,
    /// The run ended before its last frame.
    pub ended_early: bool,
    /// Farthest a true detection may lie from the centre, px.
    pub radius: f64,
    /// How far beyond the box, px.
    pub margin: f64,
}

/// Writes the page, as a whole or not at all.
///
/// # Errors
/// Writing failed.
pub fn write_page(report: &Report, path: &Path) -> Outcome {
    beside::write(path, page(report))
}

/// A row of the operating points.
pub(crate) struct Row<'a> {
    pub name: String,
    pub point: &'a OperatingPoint,
}

impl Report {
    fn evaluation(&self) -> &Evaluation {
        &self.judgement.evaluation
    }

    /// Everything but the operating points: what, how much, and a remark.
    fn facts(&self) -> Vec<[String; 3]> {
        let e = self.evaluation();
        let detections = e.true_detections + e.false_detections + e.neutral_detections;
        let neutral = match e.neutral_detections {
            0 => String::new(),
            n => format!(", {n} on what is hidden or ignored"),
        };
        let best = e.best_f1.point.map_or([String::new(), "nothing was found".to_owned()], |point| {
            let remark = format!("precision {:.3}, score of at least {}", point.precision, score(point.threshold));
            [format!("{:.3}", point.f1), remark]
        });
        let [best, best_remark] = best;
        vec![
            ["frames".into(), e.frames.to_string(), self.frames_remark()],
            ["visible targets".into(), e.targets.to_string(), String::new()],
            [
                "detections".into(),
                detections.to_string(),
                format!("{} true, {} false{neutral}", e.true_detections, e.false_detections),
            ],
            ["area".into(), format!("{:.3}", e.area), "under the detection rate over 0..1 false alarms a frame".into()],
            ["average precision".into(), format!("{:.3}", e.average_precision), String::new()],
            ["best F1".into(), if best.is_empty() { "-".into() } else { best }, best_remark],
        ]
    }

    fn tracks(&self) -> Option<&TrackEvaluation> {
        self.judgement.tracks.as_ref()?.as_ref().ok()
    }

    /// What is known of the tracks, as [`Report::facts`].
    fn track_facts(&self) -> Vec<[String; 3]> {
        let Some(e) = self.tracks() else { return Vec::new() };
        let (clear, identity, hota) = (&e.clear, &e.identity, &e.hota);
        let neutral = match e.neutral_points {
            0 => String::new(),
            n => format!(", {n} more on what is hidden or ignored"),
        };
        let row = |name: &str, value: String, remark: String| [name.to_owned(), value, remark];
        vec![
            row("tracks", e.tracks.to_string(), format!("of {} points{neutral}; {} targets", e.points, e.identities)),
            row(
                "MOTA",
                format!("{:.3}", clear.mota),
                format!("{} misses, {} false, {} switches", clear.misses, clear.false_positives, clear.id_switches),
            ),
            row(
                "MOTP",
                pixels(clear.motp),
                format!("mean distance of {} matched points from their targets", clear.matched),
            ),
            row(
                "IDF1",
                format!("{:.3}", identity.idf1),
                format!("precision {:.3}, recall {:.3}", identity.id_precision, identity.id_recall),
            ),
            row(
                "HOTA",
                format!("{:.3}", hota.hota),
                format!("detection {:.3}, association {:.3}; mean over 19 distances", hota.det_a, hota.ass_a),
            ),
            row(
                "fragmentations",
                clear.fragmentations.to_string(),
                format!(
                    "{} targets mostly tracked, {} partly, {} mostly lost",
                    clear.mostly_tracked, clear.partly_tracked, clear.mostly_lost
                ),
            ),
        ]
    }

    fn frames_remark(&self) -> String {
        let range = format!("{} to {}", self.frames.start(), self.frames.end());
        match &self.origin {
            Origin::Run(path) => format!("{range}, of {}", path.display()),
            Origin::Given => range,
            Origin::Named => format!("{range}, the last one named: say with --frames if there were more"),
        }
    }

    fn operating_points(&self) -> Vec<Row<'_>> {
        let e = self.evaluation();
        let limits = e.at.iter().map(|point| Row { name: point.limit.unwrap_or_default().to_string(), point });
        let rest = [("best F1", &e.best_f1), ("all", &e.all)];
        limits.chain(rest.map(|(name, point)| Row { name: name.to_owned(), point })).collect()
    }

    /// What the reader should know besides.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        let Judgement { evaluation, tracks, detections_outside, truth_outside } = &self.judgement;
        if *detections_outside > 0 || *truth_outside > 0 {
            notes.push(format!(
                "{detections_outside} detections and {truth_outside} boxes of the truth lie in other frames and do not count"
            ));
        }
        if let Some(Err(error)) = tracks {
            notes.push(format!("the tracks are not judged: {error}"));
        }
        if self.ended_early {
            notes.push("the run ended early: only the frames that it processed are judged".to_owned());
        }
        if evaluation.targets == 0 {
            notes.push("the truth has no visible target in these frames: rates are 0 whatever was found".to_owned());
        }
        notes
    }
}

fn score(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        format!("{value:.4}").trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{value:.3e}")
    }
}

fn pixels(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |px| format!("{px:.2} px"))
}

fn degrees(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |radians| format!("{:.1} deg", radians.to_degrees()))
}
