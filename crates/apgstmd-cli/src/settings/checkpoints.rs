//! `--checkpoint` and `--resume`: what can be resumed, and what its results depend on.

use std::fmt::Debug;

use super::{Destination, LookIn, RunSettings};
use crate::Outcome;
use crate::args::RunArgs;
use crate::failure::Failure;
use crate::source::Input;

/// Refuses what cannot be cut back to a frame, or read again.
pub(super) fn check(args: &RunArgs, source: &Input, destination: &Destination) -> Outcome {
    if args.checkpoint.is_none() && !args.resume {
        return Ok(());
    }
    let flag = if args.checkpoint.is_some() { "--checkpoint" } else { "--resume" };
    if *destination == Destination::Stdout {
        return Err(Failure::usage(format_args!("{flag} needs a folder, but --out - has none")));
    }
    if source.is_live() {
        return Err(Failure::usage(format_args!(
            "{flag} is for what can be read again, but {} is live",
            source.shown()
        ))
        .hint("a video file that is played live can be run with --live=no"));
    }
    let Some(every) = args.checkpoint else { return Ok(()) };
    if every == 0 {
        return Err(Failure::usage("--checkpoint is 0, but it must be at least 1 frame"));
    }
    let whole = [
        ("--overlay", args.overlay),
        ("--video", args.video.is_some()),
        ("--report", args.report.is_some()),
        ("--coco", args.coco.is_some()),
        ("--dump", args.dump.is_some()),
    ];
    match whole.iter().find(|(_, given)| *given) {
        Some((other, _)) => Err(Failure::usage(format_args!(
            "--checkpoint is for tables, which can be cut back to a frame: {other} cannot"
        ))
        .hint(format_args!("without --checkpoint, --resume makes a run with {other} anew where it was not through"))),
        None => Ok(()),
    }
}

impl RunSettings {
    /// What the results depend on besides the pictures, TOML.
    pub fn described(&self) -> String {
        let mut table = toml::Table::new();
        let mut say = |name: &str, value: &dyn Debug| {
            table.insert(name.to_owned(), format!("{value:?}").into());
        };
        say("INPUT", &self.source.shown());
        say("--start", &self.span.start);
        say("--stop", &self.span.stop);
        say("--step", &self.span.step);
        say("--fps, --raw, --bit-depth, --live", &self.source.flags());
        say("--on-error", &self.on_error);
        say("--roi, --mask", &self.look_in.as_ref().map(LookIn::described));
        say("--false-alarms", &self.false_alarms);
        say("--format", &self.formats);
        say(
            "tracks, --mot, --coco",
            &[self.tracks.csv.is_some(), self.tracks.mot.is_some(), self.tracks.coco.is_some()],
        );
        say("--box-size", &self.tracks.box_size);
        say("--overlay", &self.overlay);
        say("--video, --report", &self.pictures);
        say("--dump", &self.dump);
        say("--simd", &self.machine.level());
        let parameters = self.bank.as_ref().map_or_else(|| self.params.to_toml(), |bank| bank.to_toml());
        table.extend(parameters.parse::<toml::Table>().expect("what is written can be read"));
        table.to_string()
    }
}
