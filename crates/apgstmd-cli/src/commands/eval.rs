//! `apgstmd eval`: detections against truth, as a table, JSON, CSV or a page.

use std::path::{Path, PathBuf};

use apgstmd_core::evaluation::{Evaluation, EvaluationError};

use super::print;
use crate::Outcome;
use crate::args::EvalArgs;
use crate::failure::Failure;
use crate::judge::{Found, Frames, judge, read_detections, read_truth};
use crate::report::{Report, json, text, write_page};
use crate::sink::beside;

pub(crate) fn main(args: &EvalArgs) -> Outcome {
    let Found { file, detections, tracks, run } = read_detections(&args.detections)?;
    let truth = read_truth(&args.truth)?;
    check_outputs(args, &file)?;
    let frames = Frames::resolve(run.as_ref(), args.frames, (args.start, args.stop), &detections, &truth)?;
    let judgement = judge(&detections, tracks.as_deref(), &truth, &frames, args.radius, args.margin).map_err(
        |error| match error {
            EvaluationError::Distance { .. } => Failure::usage(format_args!("--{error}")),
            _ => Failure::failed(error),
        },
    )?;
    let report = Report {
        detections: args.detections.clone(),
        truth: args.truth.clone(),
        judgement,
        frames: frames.first()..=frames.last(),
        origin: frames.origin().clone(),
        ended_early: run.is_some_and(|run| run.ended_early),
        radius: args.radius,
        margin: args.margin,
    };
    if let Some(path) = &args.csv {
        beside::write(path, curve(&report.judgement.evaluation))?;
    }
    if let Some(path) = &args.html {
        write_page(&report, path)?;
    }
    if args.json {
        return print(&json(&report));
    }
    if args.quiet { Ok(()) } else { print(&text(&report)) }
}

/// What is written must not replace what is read, nor each other.
fn check_outputs(args: &EvalArgs, detections: &Path) -> Outcome {
    let full = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let outputs = [("--csv", &args.csv), ("--html", &args.html)];
    let given: Vec<(&str, &PathBuf)> =
        outputs.iter().filter_map(|(flag, path)| Some((*flag, path.as_ref()?))).collect();
    for (flag, path) in &given {
        if path.as_os_str() == "-" || path.as_os_str().is_empty() {
            return Err(Failure::usage(format_args!("{flag} needs the name of a file; --json prints to stdout")));
        }
        for input in [detections, &args.detections, &args.truth] {
            if full(path) == full(input) {
                return Err(Failure::usage(format_args!("{flag} {} would replace what is judged", path.display())));
            }
        }
    }
    match given[..] {
        [(_, csv), (_, html)] if full(csv) == full(html) => {
            Err(Failure::usage(format_args!("--csv and --html are both {}", csv.display())))
        }
        _ => Ok(()),
    }
}

/// A row for each point.
fn curve(evaluation: &Evaluation) -> String {
    let mut text = "threshold,true_detections,false_detections,detection_rate,false_alarms,precision,f1\n".to_owned();
    for p in &evaluation.curve {
        text += &format!(
            "{},{},{},{},{},{},{}\n",
            p.threshold, p.true_detections, p.false_detections, p.detection_rate, p.false_alarms, p.precision, p.f1
        );
    }
    text
}
