//! The frame loop: sources -> detector -> sinks, side by side. Threads read ahead, one computes, the caller's writes;
//! bounded queues lie between. Keeps time and counts; decides nothing else.

mod ahead;
mod checkpoint;
mod compute;
mod engine;
mod latest;
mod limit;
mod traces;

use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::panic::resume_unwind;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::{self, Builder};
use std::time::{Duration, Instant};

use apgstmd_core::{BankParams, Machine, Params, Size, Timing as Stages};
use indicatif::{ProgressBar, ProgressStyle};

use self::ahead::ReadAhead;
pub(super) use self::checkpoint::{Checkpoint, Checkpoints, remove};
use self::checkpoint::{Writing, lengths};
use self::compute::{Compute, Computed, Message};
pub(super) use self::engine::birth_score;
use self::traces::Traces;
use crate::Outcome;
use crate::args::OnError;
use crate::failure::{Failure, reason};
use crate::footage::{Footage, Tuned, Warning};
use crate::settings::{DumpSettings, LookIn};
use crate::sink::Sink;
use crate::sink::run_json::{Background, Busy, First, Found, Live, Skipped, Spread, Threshold, Timing};
use crate::source::{FrameSource, Span};

/// Computed frames that may wait for the sinks; live, none: the frame after would be old before it is computed.
const WAITING: usize = 2;

/// How to drive.
pub(super) struct Options<'a> {
    pub params: &'a Params,
    /// Several detectors.
    pub bank: Option<&'a BankParams>,
    /// False alarms a frame that are listed, by the clip itself; without it, all that the model finds.
    pub false_alarms: Option<f64>,
    pub machine: Machine,
    /// Where targets are looked for, if not everywhere.
    pub look_in: Option<&'a LookIn>,
    pub on_error: OnError,
    /// Inner maps that the sinks will write.
    pub dump: Option<&'a DumpSettings>,
    /// Whether the sinks want tracks.
    pub tracks: bool,
    /// Whether they want the response.
    pub response: bool,
    pub quiet: bool,
    /// Only the newest frame is computed, the others are dropped.
    pub live: bool,
    /// Which frames of the source are used: those between are no gaps.
    pub span: Span,
    /// Where the run is kept, should it end early.
    pub checkpoints: Option<&'a Checkpoints>,
}

impl Options<'_> {
    /// Whether the parameters say which detections begin tracks.
    fn fixed_births(&self) -> bool {
        self.bank.map_or(self.params, |bank| &bank.base).tracking.birth_score > 0.0
    }
}

/// What happened. `size` is there once a first frame was accepted, and with it the sinks.
#[derive(Default)]
pub(super) struct Report {
    pub size: Option<Size>,
    pub frames: usize,
    /// Of these, frames of an earlier run that this one goes on from.
    pub resumed_after: Option<usize>,
    pub skipped: First<Skipped>,
    pub found: Found,
    pub background: Background,
    pub interrupted: bool,
    pub failure: Option<Failure>,
    pub wall: Duration,
    /// First frame that came.
    pub first: Option<usize>,
    /// Last one.
    pub last: Option<usize>,
    /// Frames after it that were not given to the model.
    pub left_out: First<RangeInclusive<usize>>,
    /// Live.
    pub live: Option<Live>,
    /// Scores that were asked for at the end.
    pub threshold: Option<Threshold>,
    /// The source ended, and none of its frames was used.
    pub empty: bool,
    /// What the stages of the model took, of all frames; of a bank, in all members.
    pub stages: Stages,
    /// What is wrong with the footage.
    pub warnings: Vec<Warning>,
    readers: usize,
    decode: Spread,
    compute: Spread,
    write: Spread,
    total: Spread,
}

impl Report {
    /// Frames that this run computed itself.
    pub fn frames_now(&self) -> usize {
        self.frames - self.resumed_after.unwrap_or(0)
    }

    /// What each stage of the model took, a frame.
    pub fn stage_seconds(&self) -> BTreeMap<&'static str, f64> {
        let each = |spent: Duration| spent.as_secs_f64() / self.frames_now().max(1) as f64;
        self.stages.parts().map(|(name, spent)| (name, each(spent))).filter(|(_, seconds)| *seconds > 0.0).collect()
    }

    pub fn timing(&self) -> Timing {
        let wall = self.wall.as_secs_f64();
        let share = |spent: &Spread, threads: usize| spent.sum() / (wall * threads as f64).max(1e-9);
        let busy = Busy {
            decode: share(&self.decode, self.readers.max(1)),
            compute: share(&self.compute, 1),
            write: share(&self.write, 1),
        };
        Timing {
            decode: self.decode.statistic(),
            compute: self.compute.statistic(),
            write: self.write.statistic(),
            total: self.total.statistic(),
            wall: wall / self.frames_now().max(1) as f64,
            limited_by: busy.largest(),
            busy,
        }
    }
}

/// Takes one frame from each of `sources` in turn, to their end, an error or Ctrl-C. `open` makes the sinks, for frames of
/// a size, once the first one is accepted. `from` is where an earlier run came to, of which the frames are left out by the sources.
pub(super) fn drive<'s>(
    sources: Vec<Box<dyn FrameSource + '_>>,
    options: &Options<'_>,
    from: Option<Checkpoint>,
    open: impl FnOnce(Size) -> Outcome<Vec<Box<dyn Sink + 's>>>,
) -> Report {
    let expected = sources.iter().map(|source| source.expected()).sum();
    let mut report = Report { readers: sources.len(), ..Report::default() };
    let bar = progress_bar(expected, options.quiet);
    let begin = Instant::now();
    let mut sinks = Vec::new();
    let mut outcome = feed(sources, options, from, open, &mut sinks, &mut report, &bar);
    for sink in &mut sinks {
        let finished = sink.finish();
        outcome = outcome.and(finished);
    }
    report.wall = begin.elapsed();
    bar.finish_and_clear();
    if outcome.is_ok() && report.frames == 0 && !report.interrupted {
        report.empty = report.skipped.count() == 0;
        outcome = Err(nothing_usable(&report.skipped));
    }
    report.failure = match outcome {
        // Whoever looked at the results has seen enough.
        Err(Failure::Interrupted) => {
            report.interrupted = true;
            None
        }
        outcome => outcome.err(),
    };
    report
}

fn feed<'s>(
    sources: Vec<Box<dyn FrameSource + '_>>,
    options: &Options<'_>,
    from: Option<Checkpoint>,
    open: impl FnOnce(Size) -> Outcome<Vec<Box<dyn Sink + 's>>>,
    sinks: &mut Vec<Box<dyn Sink + 's>>,
    report: &mut Report,
    bar: &ProgressBar,
) -> Outcome {
    thread::scope(|scope| {
        let start = if options.live { ReadAhead::start_live } else { ReadAhead::start };
        let ahead = start(scope, sources)?;
        let (sender, results) = sync_channel(if options.live { 0 } else { WAITING });
        let (size, resumed, writing) = match from {
            Some(Checkpoint { size, states, computing, writing }) => {
                (Some(size), Some((states, computing)), Some(writing))
            }
            None => (None, None, None),
        };
        report.size = size;
        let compute = Compute::new(options, bar, sender, resumed);
        let computing = Builder::new()
            .name("apgstmd-compute".to_owned())
            .spawn_scoped(scope, move || compute.run(ahead))
            .map_err(|error| Failure::failed(format_args!("cannot start a thread: {}", reason(&error))))?;
        let mut delays = Spread::default();
        let written = write(results, open, sinks, report, options, bar, writing, &mut delays);
        // Whoever still waits to hand something on has been told by now.
        let (left, computed) = computing.join().unwrap_or_else(|panic| resume_unwind(panic));
        report.skipped = left.skipped;
        report.interrupted = left.interrupted;
        report.first = left.first;
        report.last = left.last;
        report.left_out = left.left_out;
        report.stages = left.stages;
        report.threshold = left.threshold;
        report.live = left.dropped.map(|dropped| Live { dropped, delay: delays.delay() });
        // What failed to be written came before what failed to be computed.
        written.and(computed)
    })
}

#[expect(clippy::too_many_arguments, reason = "called from one place")]
fn write<'s>(
    results: Receiver<Message>,
    open: impl FnOnce(Size) -> Outcome<Vec<Box<dyn Sink + 's>>>,
    sinks: &mut Vec<Box<dyn Sink + 's>>,
    report: &mut Report,
    options: &Options<'_>,
    bar: &ProgressBar,
    from: Option<Writing>,
    delays: &mut Spread,
) -> Outcome {
    let mut open = Some(open);
    let (mut traces, mut footage) = (Traces::default(), Footage::new(tuned(options)));
    if let Some(writing) = from {
        // What is there is cut back at once, whether frames are left or not.
        if let (Some(open), Some(size)) = (open.take(), report.size) {
            *sinks = open(size)?;
        }
        report.resumed_after = Some(writing.frames);
        Writing { frames: report.frames, found: report.found, background: report.background, traces, footage, .. } =
            writing;
        bar.inc(report.frames as u64);
    }
    let mut outcome = Ok(());
    for message in results {
        let begin = Instant::now();
        let Computed { seen, size, decode, compute, copy, came } = match message {
            Message::Frame(computed) => *computed,
            Message::Checkpoint(reached) => {
                let (states, computing) = *reached;
                let (Some(of), Some(size)) = (options.checkpoints, report.size) else { continue };
                let (frames, found, background) = (report.frames, report.found, report.background.clone());
                let writing = Writing { frames, found, background, traces, footage, files: lengths(sinks)? };
                let checkpoint = Checkpoint { size, states, computing, writing };
                checkpoint.write(of)?;
                Writing { traces, footage, .. } = checkpoint.writing;
                continue;
            }
        };
        if let Some(open) = open.take() {
            *sinks = open(size)?;
            report.size = Some(size);
        }
        outcome = sinks.iter_mut().try_for_each(|sink| sink.frame(&seen));
        if outcome.is_err() {
            break;
        }
        delays.add(came.elapsed().as_secs_f64());
        report.frames += 1;
        report.background.add(&seen);
        report.found.detections += seen.detections.len();
        report.found.frames_with_detections += usize::from(!seen.detections.is_empty());
        report.found.traces = traces.add(seen.detections.iter().map(|detection| detection.trace));
        if options.tracks {
            // Numbered from 0 as they are confirmed.
            let newest = seen.tracks.iter().map(|point| point.track as usize + 1).max();
            report.found.tracks = report.found.tracks.max(newest).or(Some(0));
        }
        bar.set_message(format!("{} detections", report.found.detections));
        footage.take(seen);
        let [decode, compute] = [decode, compute].map(|spent| spent.as_secs_f64());
        let write = (copy + begin.elapsed()).as_secs_f64();
        report.decode.add(decode);
        report.compute.add(compute);
        report.write.add(write);
        report.total.add(decode + compute + write);
    }
    report.warnings = footage.warnings();
    outcome
}

/// Speeds that there are detectors for.
fn tuned(options: &Options<'_>) -> Tuned {
    let speeds = || options.bank.iter().flat_map(|bank| bank.members.iter().map(|member| member.speed));
    let own = options.params.prediction.v_opt;
    Tuned { slowest: speeds().reduce(f64::min).unwrap_or(own), fastest: speeds().reduce(f64::max).unwrap_or(own) }
}

fn nothing_usable(skipped: &First<Skipped>) -> Failure {
    match skipped.listed().first() {
        None => Failure::failed("there are no frames"),
        Some(first) => Failure::failed(format_args!(
            "none of {} pictures can be used; the first, {}: {}",
            skipped.count(),
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

#[cfg(test)]
mod tests {
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::sink::Seen;
    use crate::source::{Arrival, Picture, Pixels};

    /// A camera: a frame each `interval`, whether anybody is ready or not.
    struct Camera {
        next: usize,
        frames: usize,
        interval: Duration,
        begin: Option<Instant>,
        taken: Arc<Mutex<Vec<Instant>>>,
    }

    impl FrameSource for Camera {
        fn expected(&self) -> Option<usize> {
            None
        }

        fn next_frame(&mut self) -> Option<Arrival> {
            let frame = self.next;
            self.next += 1;
            let begin = *self.begin.get_or_insert_with(Instant::now);
            thread::sleep((self.interval * frame as u32).saturating_sub(begin.elapsed()));
            self.taken.lock().unwrap().push(Instant::now());
            let pixels = Pixels::U8(ndarray::Array3::from_elem((32, 32, 1), frame as u8));
            let picture = Ok(Picture { pixels, bits: None });
            let arrival = Arrival { frame, name: String::new(), origin: String::new(), time: None, picture };
            (frame < self.frames).then_some(arrival)
        }
    }

    /// Takes long, and notes how late each frame is when it is done.
    struct Slow {
        work: Duration,
        taken: Arc<Mutex<Vec<Instant>>>,
        late: Arc<Mutex<Vec<(usize, Duration)>>>,
    }

    impl Sink for Slow {
        fn frame(&mut self, seen: &Seen) -> Outcome {
            thread::sleep(self.work);
            let taken = self.taken.lock().unwrap()[seen.frame];
            self.late.lock().unwrap().push((seen.frame, taken.elapsed()));
            Ok(())
        }
    }

    #[test]
    fn live_frames_are_new_and_the_rest_is_counted() {
        const FRAMES: usize = 200;
        let (interval, work) = (Duration::from_millis(5), Duration::from_millis(40));
        let taken = Arc::new(Mutex::new(Vec::new()));
        let late = Arc::new(Mutex::new(Vec::new()));
        let camera = Camera { next: 0, frames: FRAMES, interval, begin: None, taken: Arc::clone(&taken) };
        let params = Params::default();
        let options = Options {
            params: &params,
            bank: None,
            false_alarms: None,
            machine: Machine::with_threads(1),
            look_in: None,
            on_error: OnError::Stop,
            dump: None,
            tracks: false,
            response: false,
            quiet: true,
            live: true,
            span: Span::ALL,
            checkpoints: None,
        };
        let sink = Slow { work, taken, late: Arc::clone(&late) };
        let report = drive(vec![Box::new(camera)], &options, None, |_| Ok(vec![Box::new(sink) as Box<dyn Sink>]));
        assert!(report.failure.is_none() && !report.interrupted);
        let late = late.lock().unwrap();
        let live = report.live.unwrap();
        assert_eq!((late.len(), report.frames + live.dropped), (report.frames, FRAMES));
        assert_eq!(report.left_out.count(), live.dropped);
        let listed = report.left_out.listed().iter().map(|range| range.end() - range.start() + 1);
        assert_eq!(listed.sum::<usize>(), live.dropped);
        assert!(live.dropped > FRAMES / 2, "{} dropped", live.dropped);
        assert_eq!((late[0].0, late[late.len() - 1].0), (0, FRAMES - 1), "the last one is the newest there is");
        // One is written while one waits, computed, for that: two works. The rest is room for a busy machine.
        let most = late.iter().map(|(_, delay)| *delay).max().unwrap();
        assert!(most > work && most < 2 * work + Duration::from_millis(200), "{most:?}");
        let told = live.delay.most;
        assert!((told - most.as_secs_f64()).abs() < 0.05, "{told} {most:?}");
    }

    #[test]
    fn a_fast_machine_drops_nothing() {
        let taken = Arc::new(Mutex::new(Vec::new()));
        let interval = Duration::from_millis(20);
        let camera = Camera { next: 0, frames: 15, interval, begin: None, taken };
        let params = Params::default();
        let options = Options {
            params: &params,
            bank: None,
            false_alarms: None,
            machine: Machine::with_threads(1),
            look_in: None,
            on_error: OnError::Stop,
            dump: None,
            tracks: false,
            response: false,
            quiet: true,
            live: false,
            span: Span::ALL,
            checkpoints: None,
        };
        let report = drive(vec![Box::new(camera)], &options, None, |_| Ok(Vec::new()));
        assert_eq!((report.frames, report.left_out.count()), (15, 0));
        assert!(report.live.is_none());
    }
}
