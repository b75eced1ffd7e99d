//! `apgstmd tune`: the score that so many false alarms a frame have in a clip without targets, as a parameter file.

use std::cell::RefCell;
use std::rc::Rc;

use apgstmd_core::FalseAlarms;
use apgstmd_core::alarms::{self, Tuned};

use super::pipeline::{Options, drive};
use super::run::LEAST_ALARMS;
use crate::Outcome;
use crate::args::TuneArgs;
use crate::failure::Failure;
use crate::interrupt;
use crate::settings::{RunSettings, readers};
use crate::sink::{Seen, Sink, beside};

/// Score and trace of everything that was found.
#[derive(Clone, Default)]
struct Rows(Rc<RefCell<Vec<(f32, u64)>>>);

impl Sink for Rows {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        self.0.borrow_mut().extend(seen.detections.iter().map(|found| (found.score, found.trace)));
        Ok(())
    }
}

pub(crate) fn main(args: &TuneArgs) -> Outcome {
    interrupt::listen();
    let rate = args.false_alarms;
    if !(FalseAlarms::LOWEST..=FalseAlarms::HIGHEST).contains(&rate) {
        return Err(Failure::usage(format_args!(
            "--false-alarms is {rate}, but it must be between {} and {} a frame",
            FalseAlarms::LOWEST,
            FalseAlarms::HIGHEST
        )));
    }
    if args.out.is_dir() {
        return Err(Failure::usage(format_args!("--out {} is a folder, but a file is needed", args.out.display())));
    }
    if args.out.exists() && !args.force {
        return Err(Failure::failed(format_args!("{} is there already", args.out.display()))
            .hint("choose another file with --out, or replace it with --force"));
    }
    let mut settings = RunSettings::resolve(args.as_run(), None)?;
    // The score that is looked for is that of everything.
    settings.params.detection.least_score = 0.0;
    if let Some(bank) = &mut settings.bank {
        bank.base.detection.least_score = 0.0;
    }
    let source = &settings.source;
    let sources = source.open(settings.span, settings.selection.as_ref(), None, readers(settings.machine.threads))?;
    let options = Options {
        params: &settings.params,
        bank: settings.bank.as_ref(),
        false_alarms: None,
        machine: settings.machine.clone(),
        look_in: settings.look_in.as_ref(),
        on_error: settings.on_error,
        dump: None,
        response: false,
        tracks: false,
        quiet: settings.quiet,
        live: false,
        span: settings.span,
        checkpoints: None,
    };
    let rows = Rows::default();
    let report = drive(sources, &options, None, |_| Ok(vec![Box::new(rows.clone()) as Box<dyn Sink>]));
    match report.failure {
        Some(_) if report.empty && source.count() > 0 => return Err(settings.span.nothing_left(source.count())),
        Some(failure) => return Err(failure),
        None if report.interrupted => return Err(Failure::Interrupted),
        None => {}
    }
    let needed = (LEAST_ALARMS / rate).ceil() as usize;
    if report.frames < needed {
        return Err(Failure::failed(format_args!(
            "{} has {} frames, but {rate} false alarms a frame take {needed} to be measured: {LEAST_ALARMS} must be expected",
            source.shown(),
            report.frames
        ))
        .hint("take a longer clip, or a higher --false-alarms"));
    }
    let tuned = alarms::tune(&mut rows.0.borrow_mut(), report.frames, rate);
    let text = file(&mut settings, &tuned, report.frames, rate);
    beside::write(&args.out, text)?;
    if !settings.quiet {
        for line in said(&tuned, report.frames, rate) {
            super::run::eprint_line(&line);
        }
        super::run::eprint_line(&format!("wrote {}", args.out.display()));
    }
    Ok(())
}

/// What is known of the threshold, and how well.
fn said(tuned: &Tuned, frames: usize, rate: f64) -> [String; 2] {
    let Tuned { least_score, rows, traces, between: (low, high) } = tuned;
    [
        format!("least score {least_score:.6} for {rate} false alarms a frame, by {frames} frames without targets"),
        format!(
            "{rows} rows of {traces} traces reach it; with 95 % there are {low:.2e} to {high:.2e} a frame, traces being independent"
        ),
    ]
}

fn file(settings: &mut RunSettings, tuned: &Tuned, frames: usize, rate: f64) -> String {
    let score = f64::from(tuned.least_score);
    let text = match &mut settings.bank {
        Some(bank) => {
            bank.base.detection.least_score = score;
            bank.to_toml()
        }
        None => {
            settings.params.detection.least_score = score;
            settings.params.to_toml()
        }
    };
    let shown = settings.source.shown();
    let clip: String = shown.chars().filter(|c| !c.is_control()).collect();
    let [first, second] = said(tuned, frames, rate);
    format!("# detection.least_score was set by `apgstmd tune {clip}`:\n# {first}.\n# {second}.\n\n{text}")
}
