//! What the page of `--report` says of a run.

use apgstmd_core::params::{BackgroundMotion, RejectionMode};
use apgstmd_core::{Size, Timing as Stages};

use super::count;
use super::pipeline::Report;
use crate::Outcome;
use crate::footage::Warning;
use crate::settings::RunSettings;
use crate::sink::report::{About, Fact, Gathered, LEAST_SHIFT, Mark, Share};
use crate::sink::run_json::RegionRecord;

pub(super) fn write(gathered: &Gathered, settings: &RunSettings, report: &Report, warnings: &[Warning]) -> Outcome {
    // Without a first frame nothing was opened, and nothing is left behind.
    let Some(size) = report.size else { return Ok(()) };
    let params = settings.params.to_toml();
    let mut notes = gathered.limits();
    if gathered.pictures() < report.frames {
        notes.push(format!(
            "{} of {} are kept as pictures; other frames show the nearest of them, with their own detections.",
            gathered.pictures(),
            count(report.frames, "frame")
        ));
    }
    let region = settings.look_in.as_ref().and_then(|look_in| RegionRecord::of(look_in, size));
    if let Some(RegionRecord { share, .. }) = region {
        let share = 100.0 * share;
        notes.push(format!(
            "Targets were looked for within the thin line only, in {share:.1} % of the picture (--roi, --mask)."
        ));
    }
    if report.interrupted {
        notes.push("The run was interrupted: this is what came until then.".to_owned());
    }
    if let Some(error) = report.failure.as_ref().and_then(crate::failure::Failure::text) {
        notes.push(format!("The run ended early: {error}."));
    }
    let rate = settings.source.rate();
    let told = match rate {
        Some(rate) => format!(", {} a second", short(rate)),
        None => String::new(),
    };
    let about = About {
        title: settings.source.shown(),
        subtitle: format!("{} of {} x {} px{told}", count(report.frames, "frame"), size.width, size.height),
        facts: facts(gathered, report),
        warnings: warnings.iter().map(sentences).collect(),
        still: still(settings, report, size),
        notes,
        stages: stages(&report.stages, report.frames),
        stages_note: stages_note(settings),
        work: work(report),
        work_note: format!("Work of a frame, median; side by side, and {} limits", limit(report)),
        members: members(settings),
        params,
        score_marks: score_marks(settings, report),
        contrast_marks: contrast_marks(settings),
        rate,
    };
    gathered.write(&about)
}

fn facts(gathered: &Gathered, report: &Report) -> Vec<Fact> {
    let found = report.found;
    let seconds = report.wall.as_secs_f64();
    let fact = |value: String, name: &str, remark: String| Fact { value, name: name.to_owned(), remark };
    let share = 100.0 * found.frames_with_detections as f64 / report.frames.max(1) as f64;
    let tracks = found.tracks.unwrap_or(0);
    let strong = gathered.strong_tracks();
    let weak = match tracks.saturating_sub(strong) {
        0 => "confirmed by several detections".to_owned(),
        weak => format!("{weak} of them far weaker than the best"),
    };
    let mut facts = vec![
        fact(tracks.to_string(), "tracks", weak),
        fact(
            found.detections.to_string(),
            "detections",
            format!("{:.1} a frame, clutter included", found.detections as f64 / report.frames.max(1) as f64),
        ),
        fact(
            format!("{share:.0} %"),
            "frames with detections",
            format!("{} of {}", found.frames_with_detections, report.frames),
        ),
        fact(
            format!("{} frames/s", rate(report.frames as f64 / seconds.max(1e-9))),
            "computed at",
            format!("{} in {seconds:.1} s", count(report.frames, "frame")),
        ),
    ];
    let background = &report.background;
    if let Some((frame, shift)) = gathered.largest_shift() {
        let degrees = background.largest_rotation.to_degrees();
        let turned = if degrees >= 0.01 { format!("; turned by up to {degrees:.2} deg") } else { String::new() };
        let zoom = 100.0 * background.largest_zoom;
        let zoomed = if zoom >= 0.01 { format!("; zoomed by up to {zoom:.2} %") } else { String::new() };
        facts.push(fact(
            format!("{shift:.1} px"),
            "largest camera motion",
            format!("a frame, into frame {frame}{turned}{zoomed}"),
        ));
    }
    if let Some(first) = background.cuts.first() {
        facts.push(fact(background.cut_count.to_string(), "cuts", format!("the first before frame {first}")));
    }
    if let Some(live) = report.live {
        facts.push(fact(live.dropped.to_string(), "frames dropped", "live: always the newest".to_owned()));
    }
    facts
}

/// Why the page has nothing to show of the camera's motion, where that is so.
fn still(settings: &RunSettings, report: &Report, size: Size) -> Option<String> {
    let rejection = &settings.bank.as_ref().map_or(&settings.params, |bank| &bank.base).rejection;
    if rejection.mode != RejectionMode::Motion || rejection.background == BackgroundMotion::Off {
        return Some(
            "Camera: not followed, which takes the rejection \"motion\" with rejection.background other than \"off\"."
                .to_owned(),
        );
    }
    let background = &report.background;
    // Of a corner of the picture.
    let turned =
        0.5 * (size.width as f32).hypot(size.height as f32) * (background.largest_rotation + background.largest_zoom);
    if background.largest_shift.max(turned) >= LEAST_SHIFT || !background.cuts.is_empty() {
        return None;
    }
    let told = format!("Camera: it did not move, by less than {LEAST_SHIFT} px from frame to frame");
    Some(match background.unexplained {
        0 => format!("{told}."),
        unexplained => format!(
            "{told}; in {} of {} the picture does not tell, and it is taken to stand still.",
            unexplained,
            count(report.frames, "frame")
        ),
    })
}

/// As sentences of their own.
fn sentences(warning: &Warning) -> Warning {
    let sentence = |text: &str| {
        let mut letters = text.chars();
        letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
    };
    Warning { about: warning.about, text: sentence(&warning.text), advice: sentence(&warning.advice) }
}

fn rate(rate: f64) -> String {
    if rate < 10.0 { format!("{rate:.1}") } else { format!("{rate:.0}") }
}

fn milliseconds(seconds: f64) -> String {
    format!("{:.2} ms", 1e3 * seconds)
}

/// Parts with their names, largest as a full bar.
fn shares(parts: Vec<(&str, f64)>) -> Vec<Share> {
    let largest = parts.iter().map(|(_, seconds)| *seconds).fold(1e-12, f64::max);
    let share = |(name, seconds): (&str, f64)| Share {
        name: name.to_owned(),
        value: milliseconds(seconds),
        percent: (1000.0 * seconds / largest).round() / 10.0,
    };
    parts.into_iter().map(share).collect()
}

fn stages(stages: &Stages, frames: usize) -> Vec<Share> {
    let each = |spent: std::time::Duration| spent.as_secs_f64() / frames.max(1) as f64;
    let mut parts: Vec<(&str, f64)> = stages.parts().map(|(name, spent)| (name, each(spent))).collect();
    // What a model does not have takes no time.
    parts.retain(|(_, seconds)| *seconds > 0.0);
    let sum = parts.iter().map(|(_, seconds)| seconds).sum();
    let mut shares = shares(parts);
    shares.push(Share { name: "together".to_owned(), value: milliseconds(sum), percent: 0.0 });
    shares
}

fn stages_note(settings: &RunSettings) -> String {
    match &settings.bank {
        None => "Stages of the model, a frame".to_owned(),
        Some(bank) => {
            format!("Stages of the model, a frame: all {} detectors, which run side by side", bank.members.len())
        }
    }
}

fn work(report: &Report) -> Vec<Share> {
    let timing = report.timing();
    shares(vec![
        ("reading", timing.decode.median),
        ("computing", timing.compute.median),
        ("writing", timing.write.median),
    ])
}

/// What the others waited for.
pub(super) fn limit(report: &Report) -> &'static str {
    match report.timing().limited_by {
        "decode" => "reading",
        "compute" => "computing",
        _ => "writing",
    }
}

fn members(settings: &RunSettings) -> Vec<String> {
    let Some(bank) = &settings.bank else { return Vec::new() };
    let size = bank.base.target_size();
    let name = |speed: f64, scale: usize| format!("{} px/frame and {} px", short(speed), short(size * scale as f64));
    bank.members.iter().map(|member| name(member.speed, member.scale)).collect()
}

fn score_marks(settings: &RunSettings, report: &Report) -> Vec<Mark> {
    let params = &settings.params;
    let mark = |value: f64, text: &str| (value > 0.0).then(|| Mark { value, text: text.to_owned() });
    let threshold = match settings.bank {
        // Members of a bank have thresholds of their own, and its floor is one of contrast.
        Some(_) => None,
        None => mark(params.detection.threshold, "--threshold, least response E of a detection (scores are Q)"),
    };
    let own = |score: f32| (1e6 * f64::from(score)).round() / 1e6;
    let by_clip = report.threshold.filter(|found| found.false_alarms.is_some());
    let listed = by_clip.and_then(|found| mark(own(found.least_score), "--false-alarms, least score at the end"));
    let birth = match (report.threshold.and_then(|found| found.birth_score), &settings.bank) {
        (Some(score), _) => own(score),
        (None, Some(bank)) => super::pipeline::birth_score(bank),
        (None, None) => params.tracking.birth_score,
    };
    [threshold, listed, mark(birth, "least score that begins a track")].into_iter().flatten().collect()
}

fn contrast_marks(settings: &RunSettings) -> Vec<Mark> {
    let floor = settings.bank.as_ref().map(|bank| f64::from(bank.contrast)).filter(|floor| *floor > 0.0);
    let text = "--contrast, the least that is reported".to_owned();
    floor.map(|value| Mark { value: (1e6 * value).round() / 1e6, text }).into_iter().collect()
}

/// Without zeros at the end.
fn short(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
