//! The frame loop: sources -> detector -> sinks, side by side. Threads read ahead, one computes, the caller's writes;
//! bounded queues lie between. Keeps time and counts; decides nothing else.

mod ahead;
mod compute;

use std::collections::HashSet;
use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::{self, Builder};
use std::time::{Duration, Instant};

use apgstmd_core::{Machine, Params, Size};
use indicatif::{ProgressBar, ProgressStyle};

use self::ahead::ReadAhead;
use self::compute::{Compute, Computed, Left};
use crate::Outcome;
use crate::args::OnError;
use crate::failure::{Failure, reason};
use crate::settings::DumpSettings;
use crate::sink::Sink;
use crate::sink::run_json::{Busy, Found, Skipped, Statistic, Timing};
use crate::source::FrameSource;

/// Computed frames that may wait for the sinks.
const WAITING: usize = 2;

/// How to drive.
pub(super) struct Options<'a> {
    pub params: &'a Params,
    pub machine: Machine,
    pub on_error: OnError,
    /// Inner maps that the sinks will write.
    pub dump: Option<&'a DumpSettings>,
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
    readers: usize,
    decode: Vec<f64>,
    compute: Vec<f64>,
    write: Vec<f64>,
}

impl Report {
    pub fn timing(&self) -> Timing {
        let total: Vec<f64> =
            self.decode.iter().zip(&self.compute).zip(&self.write).map(|((d, c), w)| d + c + w).collect();
        let wall = self.wall.as_secs_f64();
        let share = |spent: &[f64], threads: usize| spent.iter().sum::<f64>() / (wall * threads as f64).max(1e-9);
        let busy = Busy {
            decode: share(&self.decode, self.readers.max(1)),
            compute: share(&self.compute, 1),
            write: share(&self.write, 1),
        };
        Timing {
            decode: Statistic::of(&self.decode),
            compute: Statistic::of(&self.compute),
            write: Statistic::of(&self.write),
            total: Statistic::of(&total),
            wall: wall / self.frames.max(1) as f64,
            limited_by: busy.largest(),
            busy,
        }
    }
}

/// Takes one frame from each of `sources` in turn, to their end, an error or Ctrl-C. `open` makes the sinks once the
/// first frame is accepted.
pub(super) fn drive<'s>(
    sources: Vec<Box<dyn FrameSource + '_>>,
    options: &Options<'_>,
    open: impl FnOnce() -> Outcome<Vec<Box<dyn Sink + 's>>>,
) -> Report {
    let expected = sources.iter().map(|source| source.expected()).sum();
    let mut report = Report { readers: sources.len(), ..Report::default() };
    let bar = progress_bar(expected, options.quiet);
    let begin = Instant::now();
    let mut sinks = Vec::new();
    let mut outcome = feed(sources, options, open, &mut sinks, &mut report, &bar);
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
    sources: Vec<Box<dyn FrameSource + '_>>,
    options: &Options<'_>,
    open: impl FnOnce() -> Outcome<Vec<Box<dyn Sink + 's>>>,
    sinks: &mut Vec<Box<dyn Sink + 's>>,
    report: &mut Report,
    bar: &ProgressBar,
) -> Outcome {
    thread::scope(|scope| {
        let ahead = ReadAhead::start(scope, sources)?;
        let (sender, results) = sync_channel(WAITING);
        let compute = Compute::new(options, bar, sender);
        let computing = Builder::new()
            .name("apgstmd-compute".to_owned())
            .spawn_scoped(scope, move || compute.run(ahead))
            .map_err(|error| Failure::failed(format_args!("cannot start a thread: {}", reason(&error))))?;
        let written = write(results, open, sinks, report, bar);
        // Whoever still waits to hand something on has been told by now.
        let (Left { skipped, interrupted }, computed) = computing.join().unwrap_or_else(|panic| resume_unwind(panic));
        report.skipped = skipped;
        report.interrupted = interrupted;
        // What failed to be written came before what failed to be computed.
        written.and(computed)
    })
}

fn write<'s>(
    results: Receiver<Computed>,
    open: impl FnOnce() -> Outcome<Vec<Box<dyn Sink + 's>>>,
    sinks: &mut Vec<Box<dyn Sink + 's>>,
    report: &mut Report,
    bar: &ProgressBar,
) -> Outcome {
    let mut open = Some(open);
    let mut traces = HashSet::new();
    for Computed { seen, size, decode, compute, copy } in results {
        let begin = Instant::now();
        if let Some(open) = open.take() {
            *sinks = open()?;
            report.size = Some(size);
        }
        for sink in sinks.iter_mut() {
            sink.frame(&seen)?;
        }
        report.decode.push(decode.as_secs_f64());
        report.compute.push(compute.as_secs_f64());
        report.write.push((copy + begin.elapsed()).as_secs_f64());

        report.frames += 1;
        report.found.detections += seen.detections.len();
        report.found.frames_with_detections += usize::from(!seen.detections.is_empty());
        traces.extend(seen.detections.iter().map(|detection| detection.trace));
        report.found.traces = traces.len();
        bar.set_message(format!("{} detections", report.found.detections));
    }
    Ok(())
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
pub(in crate::commands) fn progress_bar(expected: Option<usize>, quiet: bool) -> ProgressBar {
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
