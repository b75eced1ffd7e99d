//! The command line as typed. What the flags mean together is decided in [`crate::settings`].

mod batch;
mod bench;
mod run;
mod tune;

use std::path::PathBuf;
use std::str::FromStr;
use std::sync::LazyLock;

use apgstmd_core::{FalseAlarms, SimdLevel};
use clap::{Args, Parser, Subcommand, ValueEnum};

pub use batch::{BatchArgs, Flag};
pub use bench::BenchArgs;
pub use run::{BankArgs, ChildArgs, FrameArgs, RegionArgs, Roi, RunArgs};
pub use tune::TuneArgs;

/// Finds tiny, low-contrast moving targets in video: the apg-STMD model of the insect visual system.
#[derive(Debug, Parser)]
#[command(name = "apgstmd", version, long_version = VERSION.as_str(), about, after_help = EXAMPLES, max_term_width = 110)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What `--version` prints; `-V` stops after the number.
static VERSION: LazyLock<String> = LazyLock::new(|| {
    let available: Vec<&str> = SimdLevel::available().map(SimdLevel::name).collect();
    format!(
        "{}\ninstruction set: {} (this machine has {})",
        env!("CARGO_PKG_VERSION"),
        SimdLevel::best(),
        available.join(", ")
    )
});

const EXAMPLES: &str = "\
Examples:
  apgstmd demo                                     a made-up scene, found against the truth
  apgstmd run sky.mp4 --out found                  targets of unknown speed and size in a video
  apgstmd run frames/ --speed 1 --start 100        those that move about 1 pixel a frame
  apgstmd run 'cam0/*.tif' --bit-depth 14 --overlay
  apgstmd batch 'clips/*.mp4' --out all            many videos, side by side; again with --resume for the rest
  apgstmd tune empty.mp4 --out quiet.toml          0.1 false alarms a frame, by a clip without targets
  apgstmd params --preset paper > paper.toml       every parameter with its meaning
  apgstmd synth --demo --out scene                 a scene as pictures with ground truth
  apgstmd eval found scene --html report.html      detections judged against the truth
  apgstmd reproduce --quick                        the paper's experiments, computed, drawn and judged
  apgstmd bench --size 1920x1080                   how fast this machine is, stage by stage";

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Detect targets in pictures, a video, a camera, a stream or a scene.
    Run(Box<RunArgs>),
    /// Run over many videos, a process each: a manifest with checksums, a page over all, and going on where it ended.
    Batch(Box<BatchArgs>),
    /// Find the score that so many false alarms a frame have in a clip without targets; write it into a parameter file.
    Tune(Box<TuneArgs>),
    /// Make a scene, detect its targets, compare with the truth.
    Demo(DemoArgs),
    /// Print the full parameter file, every value with its meaning and range.
    Params(ModelArgs),
    /// Draw a scene with moving targets as pictures, with its ground truth.
    Synth(SynthArgs),
    /// Judge detections against ground truth.
    Eval(EvalArgs),
    /// Compute the experiments of the paper, draw its figures and judge them.
    Reproduce(ReproduceArgs),
    /// Measure speed, latency and memory on this machine.
    Bench(Box<BenchArgs>),
}

/// A ready-made parameter set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PresetArg {
    /// For real footage.
    Practical,
    /// The constants of the paper.
    Paper,
}

/// A model of small-target motion detection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ModelArg {
    /// Attention and prediction around an STMD (Wang et al. 2022).
    ApgStmd,
    /// STMD with rejection by contrast (Wang et al. 2019).
    StmdPlus,
    /// Directional STMD behind lateral inhibition (Wang et al. 2018).
    Dstmd,
    /// Motion detectors over ESTMDs (Wiederman & O'Carroll 2013).
    Cascaded,
    /// Elementary STMD, without direction (Wiederman et al. 2008).
    Estmd,
}

/// How false positives are told from targets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RejectionArg {
    /// Every peak of the response is a detection.
    Off,
    /// The paper's rule: contrast along the trace varies.
    Contrast,
    /// The trace moves relative to the background.
    Motion,
}

/// Which point of the moving thing is named.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LocaliseArg {
    /// The peak of the response, some pixels behind the target.
    Response,
    /// The target itself.
    Target,
}

/// What to do about a picture that cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum OnError {
    /// End with an error that names it.
    Stop,
    /// Go on with the next one; the model does not see the gap. run.json lists what was skipped.
    Skip,
}

/// Yes or no.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    /// Yes.
    Yes,
    /// No.
    No,
}

/// Table of detections.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// detections.csv.
    Csv,
    /// detections.jsonl, one object a line.
    Jsonl,
}

/// How fast targets move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Speed {
    /// Not known: a bank.
    Auto,
    /// Pixels per frame.
    PerFrame(f64),
    /// Pixels per second.
    PerSecond(f64),
}

impl FromStr for Speed {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let number = |text: &str| text.trim_end().parse().ok();
        let speed = match text.strip_suffix("px/s") {
            Some(text) => number(text).map(Self::PerSecond),
            None => number(text.strip_suffix("px/frame").unwrap_or(text)).map(Self::PerFrame),
        };
        speed.ok_or_else(|| "expected px/frame such as 1.5, px/s such as 40px/s, or auto".to_owned())
    }
}

/// How many false alarms are listed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FalseAlarmsArg {
    /// So many a frame.
    Rate(f64),
    /// All that the model finds.
    Off,
}

impl FromStr for FalseAlarmsArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "off" {
            return Ok(Self::Off);
        }
        match text.parse() {
            Ok(rate) if (FalseAlarms::LOWEST..=FalseAlarms::HIGHEST).contains(&rate) => Ok(Self::Rate(rate)),
            _ => Err(format!(
                "expected false alarms a frame between {} and {}, such as 0.1, or off",
                FalseAlarms::LOWEST,
                FalseAlarms::HIGHEST
            )),
        }
    }
}

/// Flags that choose parameters. They apply in this order: model and preset or file, then speed, then single values.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Model")]
pub struct ModelArgs {
    /// Model [default: apg-stmd]; the others are there to compare with
    #[arg(long, value_name = "NAME", conflicts_with = "params")]
    pub model: Option<ModelArg>,
    /// Ready-made parameters [default: practical; paper for the models to compare with]
    #[arg(long, value_name = "NAME", conflicts_with = "params")]
    pub preset: Option<PresetArg>,
    /// Parameter file, as `apgstmd params` prints it; what it leaves out is as in the paper
    #[arg(long, value_name = "FILE.toml")]
    pub params: Option<PathBuf>,
    /// Speed of the targets, pixels per frame, or per second as 40px/s: scales every time constant of the preset or file.
    /// For `run` also auto, the default where no other flag of this group is given: a bank of 0.25 to 8 px/frame
    #[arg(long, value_name = "SPEED", allow_negative_numbers = true)]
    pub speed: Option<Speed>,
    /// How false positives are told from targets
    #[arg(long, value_name = "MODE")]
    pub rejection: Option<RejectionArg>,
    /// Which point a detection names: the peak of the response or the target ahead of it
    #[arg(long, value_name = "POINT")]
    pub localise: Option<LocaliseArg>,
    /// Least response E at a detection's peak (an absolute value, the same for all frames)
    #[arg(long, value_name = "X", allow_negative_numbers = true)]
    pub threshold: Option<f64>,
}

/// Flags of `apgstmd demo`.
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Folder for the results, made if missing
    #[arg(short, long, value_name = "DIR", default_value = "apgstmd-demo")]
    pub out: PathBuf,
    /// Seed of the made-up scene
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Threads [default: one per core]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// Replace results that DIR already holds (only files that this program wrote)
    #[arg(long)]
    pub force: bool,
    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

const SYNTH_EXAMPLES: &str = "\
Examples:
  apgstmd synth --print > scene.toml               an example with every key, to be changed
  apgstmd synth scene.toml --out scene             writes scene/scene_000000.png ..., truth.csv, scene.toml
  apgstmd synth --paper --out paper --bit-depth 16
  apgstmd run scene.toml --speed 1                 the same frames straight into the model

truth.csv has the columns frame,id,x,y,w,h,visible,contrast: frames count from 0; x, y is the upper left edge of the
target's part inside the picture, pixel i lying between edge i and edge i + 1, so that its centre as an array index is
x + w/2 - 0.5; visible is 0 when less than half of it can be seen; contrast is Weber's, against the 10 px around it.";

/// Flags of `apgstmd synth`.
#[derive(Debug, Args)]
#[command(after_help = SYNTH_EXAMPLES)]
pub struct SynthArgs {
    /// Scene file; the picture of a panorama is looked for beside it
    #[arg(value_name = "SCENE.toml")]
    pub scene: Option<PathBuf>,
    /// The scene of `apgstmd demo` instead
    #[arg(long, conflicts_with_all = ["scene", "paper"])]
    pub demo: bool,
    /// The paper's default stimulus instead: a black square of 5 px before white, 0.25 px/frame
    #[arg(long, conflicts_with = "scene")]
    pub paper: bool,
    /// Folder for the pictures and their truth, made if missing
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Number of frames, in place of the scene's
    #[arg(long, value_name = "N")]
    pub frames: Option<usize>,
    /// Seed of background and noise, in place of the scene's
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Bits of the grey PNG files, 8 or 16
    #[arg(long, value_name = "B", default_value_t = 8)]
    pub bit_depth: u32,
    /// Print the scene and draw nothing; without a scene, an example with every key
    #[arg(long)]
    pub print: bool,
    /// Replace the scene that DIR already holds (only files that this program wrote)
    #[arg(long)]
    pub force: bool,
    /// Threads [default: one per core]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

const REPRODUCE_EXAMPLES: &str = "\
Examples:
  apgstmd reproduce --quick                        all of them with fewer points and smaller scenes, about a minute
  apgstmd reproduce velocity-tuning occlusion --out here
  apgstmd reproduce all --force                    everything again, over earlier results

Writes into DIR: index.html, one page with each figure beside what the paper says, the number measured and its rule; for
each experiment its figure as SVG and PNG and its numbers as CSV; summary.json.
Exit codes: 0 all is as it must be, 1 something is not, 2 wrong arguments, 130 interrupted (what is there is complete).";

/// Flags of `apgstmd reproduce`.
#[derive(Debug, Args)]
#[command(after_help = REPRODUCE_EXAMPLES)]
pub struct ReproduceArgs {
    /// Names of experiments, or `all` [default: all]
    #[arg(value_name = "NAME")]
    pub names: Vec<String>,
    /// Print the names and what each shows, and compute nothing
    #[arg(long)]
    pub list: bool,
    /// Folder for the results, made if missing
    #[arg(short, long, value_name = "DIR", default_value = "apgstmd-reproduce")]
    pub out: PathBuf,
    /// The same experiments with fewer points and smaller scenes
    #[arg(long)]
    pub quick: bool,
    /// Threads [default: one per core]; the numbers found do not depend on it
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// Replace results that DIR already holds (only files that this program wrote)
    #[arg(long)]
    pub force: bool,
    /// Print nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}

const EVAL_EXAMPLES: &str = "\
Examples:
  apgstmd eval found/ scene/                       results of `run` against the truth of `synth`
  apgstmd eval found/ boxes.csv --html report.html
  apgstmd eval found/tracks.csv scene/             the points of the tracks in place of all detections
  apgstmd eval tracker.txt gt.txt --frames 750 --json > numbers.json

A detection is true when it lies within 5 px of the centre of a visible target or inside its box grown by 2 px, one to
one, best score first. Targets that are not visible and boxes to ignore neither reward nor punish. Box files have the
columns frame,x,y,w,h and perhaps visible, id, ignore, contrast; frames count from 0, x, y is the upper left edge. In
MOTChallenge text (no header; frame,id,left,top,width,height,conf,...) frames and pixels count from 1.

Tracks are judged where the truth tells its targets apart: those of tracks.csv in a results folder, a file with the
columns frame,track,x,y, MOTChallenge text with ids. MOTA, MOTP and IDF1 match by the same distances; HOTA is the mean over
19 of them, 0.95 to 0.05 of how far a true detection may lie, 4.75 to 0.25 px for small targets.";

/// Flags of `apgstmd eval`.
#[derive(Debug, Args)]
#[command(after_help = EVAL_EXAMPLES)]
pub struct EvalArgs {
    /// Results folder of `run`, its detections.csv, detections.jsonl or tracks.csv, or MOTChallenge text
    pub detections: PathBuf,
    /// Folder of `synth`, truth.csv, another box CSV, MOTChallenge text, or SCENE.toml
    pub truth: PathBuf,

    /// Write one page with the table and both curves, complete in itself
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub html: Option<PathBuf>,
    /// Print everything as JSON in place of the table
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Write the curve, a row for each threshold
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub csv: Option<PathBuf>,
    /// Print nothing but errors and what --json asks for
    #[arg(short, long, help_heading = "Output")]
    pub quiet: bool,

    /// How many frames the detector saw, counted from 0 [default: as run.json beside the detections says, else up to
    /// the last frame that is named]
    #[arg(long, value_name = "N", help_heading = "Judging")]
    pub frames: Option<usize>,
    /// First frame to judge
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Judging")]
    pub start: usize,
    /// Stop before this frame
    #[arg(long, value_name = "N", help_heading = "Judging")]
    pub stop: Option<usize>,
    /// Farthest a true detection may lie from the centre of its target
    #[arg(long, value_name = "PX", default_value_t = 5.0, allow_negative_numbers = true, help_heading = "Judging")]
    pub radius: f64,
    /// How far beyond the box of its target a true detection may lie
    #[arg(long, value_name = "PX", default_value_t = 2.0, allow_negative_numbers = true, help_heading = "Judging")]
    pub margin: f64,
}
