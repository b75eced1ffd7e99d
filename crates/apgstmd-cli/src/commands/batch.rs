//! `apgstmd batch`: many videos, a process each.

use std::collections::VecDeque;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread;
use std::time::Instant;

use super::count;
use super::run::eprint_line;
use crate::Outcome;
use crate::args::BatchArgs;
use crate::batch::{Batch, CLIPS, FAILED, Finished, Job, MANIFEST, PAGE, Record, process, share};
use crate::failure::Failure;
use crate::interrupt;

pub(crate) fn main(args: &BatchArgs) -> Outcome {
    let records = run(args)?;
    let mut failed = records.iter().filter(|record| !record.is_done());
    let Some(first) = failed.next() else { return Ok(()) };
    let out = args.out.display();
    Err(Failure::failed(format_args!(
        "{} of {} failed, the first {}: {}",
        1 + failed.count(),
        count(records.len(), "clip"),
        first.name,
        first.error.as_deref().unwrap_or_default()
    ))
    .hint(format_args!("what each said is in {out}/{FAILED}/*/stderr.txt; --resume tries them again")))
}

/// Does all of it, and returns what became of each clip, in the order given. A failed one is no error here.
///
/// # Errors
/// What keeps a batch from beginning; the folder can no longer be written; interrupted.
pub fn run(args: &BatchArgs) -> Outcome<Vec<Record>> {
    interrupt::listen();
    let begin = Instant::now();
    let mut batch = Batch::open(args)?;
    let (side_by_side, threads) = share(args.jobs, args.threads, batch.jobs().len())?;
    let all = batch.jobs().len();
    let mut tally = Tally::default();
    let ended = attend(&mut batch, side_by_side, |finished| {
        tally.add(finished);
        if !args.quiet {
            eprint_line(&line(finished, tally.clips, all));
        }
    });
    let interrupted = matches!(ended, Err(Failure::Interrupted));
    let records = batch.finish(interrupted);
    if !args.quiet {
        let seconds = begin.elapsed().as_secs_f64();
        eprint_line(&tally.summary(all, seconds));
        let parallel = format!("{} at a time, {} each", count(side_by_side, "clip"), count(threads, "thread"));
        let out = args.out.display();
        eprint_line(&format!("{parallel}; wrote {out}/{CLIPS}, {out}/{MANIFEST}, {out}/{PAGE}"));
        if interrupted {
            eprint_line("interrupted: what was done is whole; the same command with --resume goes on");
        }
    }
    ended?;
    records
}

/// Works through the jobs, so many side by side, until they are done or one cannot go on.
fn attend(batch: &mut Batch, side_by_side: usize, mut tell: impl FnMut(&Finished)) -> Outcome {
    let waiting: Mutex<VecDeque<Job>> = Mutex::new(batch.jobs().iter().cloned().collect());
    let over = AtomicBool::new(false);
    let stop = || interrupt::asked() || over.load(Ordering::Relaxed);
    let (done, news) = channel();
    thread::scope(|scope| {
        for _ in 0..side_by_side {
            let (done, waiting) = (done.clone(), &waiting);
            scope.spawn(move || {
                while !stop() {
                    let Some(job) = waiting.lock().ok().and_then(|mut jobs| jobs.pop_front()) else { break };
                    if done.send(process(&job, &stop)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(done);
        let mut ended = Ok(());
        for outcome in news {
            let noted = outcome.and_then(|finished| {
                tell(&finished);
                batch.add(finished.record)
            });
            if let (Ok(()), Err(failure)) = (&ended, noted) {
                over.store(true, Ordering::Relaxed);
                ended = Err(failure);
            }
        }
        match interrupt::asked() {
            true => Err(Failure::Interrupted),
            false => ended,
        }
    })
}

#[derive(Default)]
struct Tally {
    clips: usize,
    before: usize,
    failed: usize,
    frames: u64,
}

impl Tally {
    fn add(&mut self, finished: &Finished) {
        self.clips += 1;
        self.before += usize::from(finished.before);
        self.failed += usize::from(!finished.record.is_done());
        if !finished.before {
            self.frames += finished.record.frames.unwrap_or(0);
        }
    }

    fn summary(&self, all: usize, seconds: f64) -> String {
        let now = self.clips - self.before - self.failed;
        let rest = [(self.before, "done before"), (self.failed, "failed"), (all - self.clips, "not tried")];
        let rest: String = rest.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!(", {n} {what}")).collect();
        let frames = usize::try_from(self.frames).unwrap_or(usize::MAX);
        let rate = self.frames as f64 / seconds.max(1e-9);
        format!(
            "{} of {} done{rest}: {} in {seconds:.1} s, {rate:.0} frames/s",
            now,
            count(all, "clip"),
            count(frames, "frame")
        )
    }
}

/// One line about a clip.
fn line(finished: &Finished, number: usize, all: usize) -> String {
    let record = &finished.record;
    let width = all.to_string().len();
    let what = match (&record.error, finished.before) {
        (Some(error), _) => format!("failed: {error}"),
        (None, true) => "done before".to_owned(),
        (None, false) => {
            let whole = |n: Option<u64>| usize::try_from(n.unwrap_or(0)).unwrap_or(usize::MAX);
            let size = record.size.map_or_else(String::new, |size| format!(" of {} x {}", size.width, size.height));
            let tracks =
                record.tracks.map_or_else(String::new, |_| format!(", {}", count(whole(record.tracks), "track")));
            format!(
                "{}{size} in {:.1} s: {:.0} frames/s, {}{tracks}",
                count(whole(record.frames), "frame"),
                record.wall_seconds,
                record.rate().unwrap_or(0.0),
                count(whole(record.detections), "detection"),
            )
        }
    };
    format!("{number:width$}/{all} {}: {what}", record.name)
}
