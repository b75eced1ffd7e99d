//! The frame loop: source -> detector -> sinks. Keeps time and counts; decides nothing else.

use std::collections::HashSet;
use std::time::{Duration, Instant};

use apgstmd_core::{Detector, ParamError, Params, Size};
use indicatif::{ProgressBar, ProgressStyle};

use crate::Outcome;
use crate::args::OnError;
use crate::failure::Failure;
use crate::interrupt;
use crate::sink::run_json::{Found, Skipped, Statistic, Timing};
use crate::sink::{Seen, Sink};
use crate::source::{Arrival, FrameSource, Picture};

/// How to drive.
pub(super) struct Options<'a> {
    pub params: &'a Params,
    pub threads: usize,
    pub on_error: OnError,
    pub quiet: bool,
}

/// What happened. `size` is there once a first frame was accepted, and with it the sinks.
#[derive(Default)]
pub(super) struct Report {
    pub size: Option<Size>,
    pub frames: usize,
    pub skipped: Vec<Skipped>,
    pub found: Found,
    pub interrupted: bool,
    pub failure: Option<Failure>,
    pub wall: Duration,
    decode: Vec<f64>,
    compute: Vec<f64>,
    write: Vec<f64>,
}

impl Report {
    pub fn timing(&self) -> Timing {
        let total: Vec<f64> =
            self.decode.iter().zip(&self.compute).zip(&self.write).map(|((d, c), w)| d + c + w).collect();
        Timing {
            decode: Statistic::of(&self.decode),
            compute: Statistic::of(&self.compute),
            write: Statistic::of(&self.write),
            total: Statistic::of(&total),
        }
    }
}

/// Runs `source` to its end, an error or Ctrl-C. `open` makes the sinks once the first frame is accepted.
pub(super) fn drive<'s>(
    source: &mut dyn FrameSource,
    options: &Options<'_>,
    open: impl FnOnce() -> Outcome<Vec<Box<dyn Sink + 's>>>,
) -> Report {
    let mut report = Report::default();
    let bar = progress_bar(source.expected(), options.quiet);
    let begin = Instant::now();
    let mut sinks = Vec::new();
    let mut outcome = feed(source, options, open, &mut sinks, &mut report, &bar);
    for sink in &mut sinks {
        let finished = sink.finish();
        outcome = outcome.and(finished);
    }
    report.wall = begin.elapsed();
    bar.finish_and_clear();
    if outcome.is_ok() && report.frames == 0 && !report.interrupted {
        outcome = Err(nothing_usable(&report.skipped));
    }
    report.failure = outcome.err();
    report
}

fn feed<'s>(
    source: &mut dyn FrameSource,
    options: &Options<'_>,
    open: impl FnOnce() -> Outcome<Vec<Box<dyn Sink + 's>>>,
    sinks: &mut Vec<Box<dyn Sink + 's>>,
    report: &mut Report,
    bar: &ProgressBar,
) -> Outcome {
    let mut open = Some(open);
    let mut model: Option<(Detector, apgstmd_core::Response, String)> = None;
    let mut traces = HashSet::new();
    loop {
        if interrupt::asked() {
            report.interrupted = true;
            return Ok(());
        }
        let begin = Instant::now();
        let Some(Arrival { frame, name, origin, picture }) = source.next_frame() else { return Ok(()) };
        let decode = begin.elapsed();

        let begin = Instant::now();
        let accepted = picture.and_then(|picture| {
            same_size(&picture, model.as_ref().map(|(detector, _, first)| (detector.size(), first.as_str())))?;
            Ok(picture)
        });
        let processed = match accepted {
            Err(reason) => Err(reason),
            Ok(picture) => {
                let (detector, response, _) = match &mut model {
                    Some(model) => model,
                    none => {
                        let detector = new_detector(&picture, &origin, options)?;
                        let response = detector.make_response();
                        none.insert((detector, response, origin.clone()))
                    }
                };
                match detector.process_into(picture.frame(), response) {
                    Ok(()) => Ok((picture, &*detector, &*response)),
                    Err(error) => Err(error.to_string()),
                }
            }
        };
        let compute = begin.elapsed();
        bar.inc(1);

        let (picture, detector, response) = match (processed, options.on_error) {
            (Ok(processed), _) => processed,
            (Err(reason), OnError::Stop) => {
                return Err(Failure::failed(format_args!("cannot use {origin}: {reason}"))
                    .hint("--on-error skip leaves out pictures that cannot be used"));
            }
            (Err(reason), OnError::Skip) => {
                report.skipped.push(Skipped { frame, name, reason });
                continue;
            }
        };

        let begin = Instant::now();
        if let Some(open) = open.take() {
            *sinks = open()?;
            report.size = Some(detector.size());
        }
        let seen = Seen { frame, name: &name, picture: &picture, response, probe: detector.probe() };
        for sink in sinks.iter_mut() {
            sink.frame(&seen)?;
        }
        report.decode.push(decode.as_secs_f64());
        report.compute.push(compute.as_secs_f64());
        report.write.push(begin.elapsed().as_secs_f64());

        report.frames += 1;
        report.found.detections += response.detections.len();
        report.found.frames_with_detections += usize::from(!response.detections.is_empty());
        traces.extend(response.detections.iter().map(|detection| detection.trace));
        report.found.traces = traces.len();
        bar.set_message(format!("{} detections", report.found.detections));
    }
}

fn same_size(picture: &Picture, expected: Option<(Size, &str)>) -> Result<(), String> {
    match expected {
        Some((size, first)) if size != picture.size() => Err(format!(
            "it is {} (height x width), but {first} is {size}: all pictures must have one size",
            picture.size()
        )),
        _ => Ok(()),
    }
}

fn new_detector(picture: &Picture, origin: &str, options: &Options<'_>) -> Outcome<Detector> {
    Detector::with_threads(picture.size(), options.params, options.threads).map_err(|error| match error {
        ParamError::TooSmall { .. } | ParamError::TooLarge { .. } => {
            Failure::failed(format_args!("cannot use {origin}: {error}"))
        }
        ParamError::ThreadStart { .. } => Failure::failed(error),
        _ => Failure::usage(error),
    })
}

fn nothing_usable(skipped: &[Skipped]) -> Failure {
    match skipped.first() {
        None => Failure::failed("there are no frames"),
        Some(first) => Failure::failed(format_args!(
            "none of {} pictures can be used; the first, {}: {}",
            skipped.len(),
            first.name,
            first.reason
        )),
    }
}

/// Hidden when `quiet`; drawn on stderr otherwise.
pub(super) fn progress_bar(expected: Option<usize>, quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    // indicatif draws to stderr and only where that is a terminal.
    let (bar, template) = match expected {
        Some(frames) => (
            ProgressBar::new(frames as u64),
            "{bar:32.cyan/blue} {pos}/{len} frames, {per_sec:.dim}, {eta} left  {msg}",
        ),
        None => (ProgressBar::new_spinner(), "{spinner} {pos} frames, {per_sec}  {msg}"),
    };
    bar.with_style(ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()))
}
