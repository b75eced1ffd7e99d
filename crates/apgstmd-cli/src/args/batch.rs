//! Flags of `apgstmd batch`: its own, and those of `apgstmd run` that mean something for each of many videos.

use std::any::TypeId;
use std::ffi::OsString;
use std::path::PathBuf;

use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches};

use super::RunArgs;

const EXAMPLES: &str = "\
Examples:
  apgstmd batch 'clips/*.mp4' --out all                  a process a video, as many at a time as there are cores
  apgstmd batch 'clips/*.mp4' --out all --resume         only what is not done yet: new, changed or failed videos
  apgstmd batch @list.txt --out all --jobs 4 --speed 1 --report --video
  apgstmd batch cam0/ cam1/ 'cam2/f_%05d.tif' scene.toml --out all --fps 30
  find /data -name '*.mkv' -print0 > list.txt; apgstmd batch @list.txt --out all

Writes into DIR: clips/NAME, what `apgstmd run` writes for each, complete as soon as it is there; failed/NAME, what a failed
one left, with its stderr.txt; manifest.json, what was done with which checksums; index.html, one page over all.
Exit codes: 0 all are done, 1 some failed or could not start, 2 wrong arguments, 130 interrupted (--resume goes on).";

/// Flags of `apgstmd run` that `apgstmd batch` sets itself, has in another form, or that mean nothing for many videos.
const NOT_HERE: [&str; 16] = [
    "input",
    "out",
    "force",
    "quiet",
    "threads",
    "live",
    "raw",
    "dump_dir",
    "mot",
    "coco",
    "video",
    "report",
    "poster",
    "while_stdin_is_open",
    "checkpoint",
    "resume",
];

/// Flags of `apgstmd batch`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct BatchArgs {
    /// Videos, folders of pictures, SCENE.toml files; quoted patterns, which stand for all that match ('clips/*.mp4'), but
    /// for one clip where pictures match ('cam0/*.png'); @LIST, or LIST.txt, a file with one of these a line (or, as `find
    /// -print0` writes it, before each zero byte)
    #[arg(required = true, value_name = "INPUT")]
    pub inputs: Vec<PathBuf>,

    /// Folder for all results, made if missing
    #[arg(short, long, value_name = "DIR")]
    pub out: PathBuf,
    /// Go on in a DIR that was used before: what is done there, of the same input (by its checksum) and with the same flags,
    /// is left as it is
    #[arg(long)]
    pub resume: bool,
    /// Videos at a time, a process each [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Running")]
    pub jobs: Option<usize>,
    /// Threads that compute each video [default: cores divided by --jobs]; the numbers found do not depend on it
    #[arg(long, value_name = "N", help_heading = "Running")]
    pub threads: Option<usize>,
    /// Print nothing but errors
    #[arg(short, long, help_heading = "Running")]
    pub quiet: bool,

    /// Write tracks.txt for each video, MOTChallenge text
    #[arg(long, help_heading = "Output")]
    pub mot: bool,
    /// Write tracks.json for each video, COCO JSON
    #[arg(long, help_heading = "Output")]
    pub coco: bool,
    /// Write report.html for each video, a page to look at what was found
    #[arg(long, help_heading = "Output")]
    pub report: bool,
    /// Write found.mp4 for each video, every frame annotated
    #[arg(long, help_heading = "Output")]
    pub video: bool,

    #[command(flatten)]
    pub run: RunFlags,
}

/// Flags of `apgstmd run` as they were given, in its order: checked by the same parser, handed on as they are.
#[derive(Debug, Default)]
pub struct RunFlags(pub Vec<Flag>);

/// One of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Flag {
    /// With its dashes.
    pub name: String,
    /// What it was given; lists joined by commas. What may be given several times is several flags.
    pub value: Option<OsString>,
    /// Whether the value names a file.
    pub is_file: bool,
}

impl RunFlags {
    fn all() -> Vec<Arg> {
        let run = RunArgs::augment_args(Command::new("run"));
        run.get_arguments().filter(|arg| !NOT_HERE.contains(&arg.get_id().as_str())).cloned().collect()
    }
}

impl Args for RunFlags {
    fn augment_args(command: Command) -> Command {
        command.args(Self::all())
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for RunFlags {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = |arg: &Arg| matches.value_source(arg.get_id().as_str()) == Some(ValueSource::CommandLine);
        let flags = |arg: Arg| {
            let Some(name) = arg.get_long().map(|long| format!("--{long}")) else { return Vec::new() };
            if matches!(arg.get_action(), ArgAction::SetTrue) {
                return vec![Flag { name, value: None, is_file: false }];
            }
            let values = matches.get_raw(arg.get_id().as_str()).into_iter().flatten().map(OsString::from);
            let is_file = arg.get_value_parser().type_id() == TypeId::of::<PathBuf>();
            let flag = |value| Flag { name: name.clone(), value: Some(value), is_file };
            match arg.get_value_delimiter() {
                Some(_) => vec![flag(values.collect::<Vec<_>>().join(OsString::from(",").as_os_str()))],
                None => values.map(flag).collect(),
            }
        };
        Ok(Self(Self::all().into_iter().filter(given).flat_map(flags).collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Arguments, Command};
    use clap::{CommandFactory, Parser};

    #[test]
    fn flags_of_run_are_handed_on() {
        Arguments::command().debug_assert();
        let words = "apgstmd batch a.mp4 b.mp4 --out all --overlay --speeds 1,2 --params p.toml --report --start 2.5s --jobs 2 \
             --roi 9x9+0+0 --roi 8x8+20+3 --mask m.png";
        let parsed = Arguments::try_parse_from(words.split(' ')).unwrap();
        let Command::Batch(args) = parsed.command else { panic!("{parsed:?}") };
        assert_eq!((args.inputs.len(), args.report, args.jobs), (2, true, Some(2)));
        let shown = |flag: &Flag| (flag.name.clone(), flag.value.clone().map(|value| value.into_string().unwrap()));
        let flags: Vec<_> = args.run.0.iter().map(shown).collect();
        let some = |text: &str| Some(text.to_owned());
        assert_eq!(
            flags,
            [
                ("--params".to_owned(), some("p.toml")),
                ("--speeds".to_owned(), some("1,2")),
                ("--roi".to_owned(), some("9x9+0+0")),
                ("--roi".to_owned(), some("8x8+20+3")),
                ("--mask".to_owned(), some("m.png")),
                ("--start".to_owned(), some("2.5s")),
                ("--overlay".to_owned(), None),
            ]
        );
        let files: Vec<_> = args.run.0.iter().filter(|flag| flag.is_file).map(|flag| &*flag.name).collect();
        assert_eq!(files, ["--params", "--mask"]);
        for wrong in [
            "--force",
            "--raw 3x3",
            "--live",
            "--poster x",
            "--checkpoint 9",
            "--speed fast",
            "--preset x",
            "--dump-frames 1",
        ] {
            let words = format!("apgstmd batch a.mp4 --out all {wrong}");
            assert!(Arguments::try_parse_from(words.split(' ')).is_err(), "{wrong}");
        }
    }
}
