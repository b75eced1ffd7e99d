//! The command line as typed. What the flags mean together is decided in [`crate::settings`].

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

/// Finds tiny, low-contrast moving targets in video: the apg-STMD model of the insect visual system.
#[derive(Debug, Parser)]
#[command(name = "apgstmd", version, about, after_help = EXAMPLES, max_term_width = 110)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

const EXAMPLES: &str = "\
Examples:
  apgstmd demo                                     a made-up scene, found against the truth
  apgstmd run frames/ --speed 1 --out found        targets that move about 1 pixel a frame
  apgstmd run 'cam0/*.tif' --bit-depth 14 --overlay
  apgstmd params --preset paper > paper.toml       every parameter with its meaning";

const RUN_EXAMPLES: &str = "\
Examples:
  apgstmd run frames/ --speed 1                    writes ./frames-apgstmd/detections.csv and run.json
  apgstmd run 'frames/f_%05d.tif' --overlay        annotated pictures and a contact strip as well
  apgstmd run frames/ --out - --format jsonl | jq .score
  apgstmd run frames/ --dump E,Q --dump-frames 60,120..130 --out inside

Speed is what matters most: the model is tuned to one, and sees little below half and above twice of it. With --step N
a target moves N times as far from one used frame to the next.
Exit codes: 0 done, 1 failed, 2 wrong arguments or parameters, 130 interrupted (files are complete up to there).";

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Detect targets in a folder or pattern of pictures.
    Run(Box<RunArgs>),
    /// Make a scene, detect its targets, compare with the truth.
    Demo(DemoArgs),
    /// Print the full parameter file, every value with its meaning and range.
    Params(ModelArgs),
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

/// Table of detections.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// detections.csv.
    Csv,
    /// detections.jsonl, one object a line.
    Jsonl,
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
    /// Speed of the targets, pixels per frame: scales every time constant of the preset or file
    #[arg(long, value_name = "PX_PER_FRAME", allow_negative_numbers = true)]
    pub speed: Option<f64>,
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

/// Flags of `apgstmd run`.
#[derive(Debug, Args)]
#[command(after_help = RUN_EXAMPLES)]
pub struct RunArgs {
    /// Folder of pictures, or a quoted pattern ('frames/*.png', 'f_%05d.tif'): PNG, JPEG, TIFF, BMP, PGM or PPM, taken in
    /// natural order (2 before 10)
    pub input: PathBuf,

    #[command(flatten)]
    pub model: ModelArgs,

    /// First picture to use, counted from 0 in natural order
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Input")]
    pub start: usize,
    /// Stop before this picture [default: after the last]
    #[arg(long, value_name = "N", help_heading = "Input")]
    pub stop: Option<usize>,
    /// Use every N-th picture
    #[arg(long, value_name = "N", default_value_t = 1, help_heading = "Input")]
    pub step: usize,
    /// Bits that 16-bit samples really use, 9 to 16 (10, 12, 14 for many cameras)
    #[arg(long, value_name = "B", help_heading = "Input")]
    pub bit_depth: Option<u32>,
    /// What to do about a picture that cannot be used
    #[arg(long, value_name = "WHAT", default_value = "stop", help_heading = "Input")]
    pub on_error: OnError,

    /// Folder for the results, made if missing; `-` writes the detections to stdout and nothing else
    /// [default: INPUT's name + "-apgstmd" in the current folder]
    #[arg(short, long, value_name = "DIR", help_heading = "Output")]
    pub out: Option<PathBuf>,
    /// Tables to write: csv, jsonl or both with a comma
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "csv", help_heading = "Output")]
    pub format: Vec<Format>,
    /// Write overlay/NAME.png, one annotated picture a frame, and strip.png, a sheet of twelve
    #[arg(long, help_heading = "Output")]
    pub overlay: bool,
    /// Replace results that DIR already holds (only files that this program wrote)
    #[arg(long, help_heading = "Output")]
    pub force: bool,

    /// Inner maps to write as float32 .npy: P C A Pe L Tm3 Tm2 Mi1 Tm1_4 Tm1_5 D E Ep F M Q (of other models also L1 ON
    /// OFF OFFd Y Yd), or ALL that the model has
    #[arg(long, value_name = "LIST", help_heading = "Inner maps")]
    pub dump: Option<String>,
    /// Frames to dump, with both ends: 60,120..130 [default: all]
    #[arg(long, value_name = "LIST", requires = "dump", help_heading = "Inner maps")]
    pub dump_frames: Option<String>,
    /// Where to dump [default: DIR/dump]
    #[arg(long, value_name = "DIR", requires = "dump", help_heading = "Inner maps")]
    pub dump_dir: Option<PathBuf>,

    /// Threads [default: one per core]; the numbers found do not depend on it
    #[arg(long, value_name = "N", help_heading = "Running")]
    pub threads: Option<usize>,
    /// Print nothing but errors
    #[arg(short, long, help_heading = "Running")]
    pub quiet: bool,
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
