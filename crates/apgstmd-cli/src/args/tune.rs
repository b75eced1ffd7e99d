//! Flags of `apgstmd tune`.

use std::path::PathBuf;

use clap::Args;

use super::{BankArgs, FrameArgs, ModelArgs, RegionArgs, RunArgs};

const EXAMPLES: &str = "\
Examples:
  apgstmd tune empty.mp4 --out quiet.toml                     then: apgstmd run sky.mp4 --params quiet.toml
  apgstmd tune empty/ --false-alarms 0.01 --out quiet.toml    one false alarm in 100 frames; takes 300 frames at least
  apgstmd tune empty.mp4 --speed 1 --out quiet.toml           of a single detector

In the clip there must be no targets, only what may be mistaken for them: the same camera, place and weather.";

/// Flags of `apgstmd tune`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct TuneArgs {
    /// A clip without targets: anything that `apgstmd run` takes
    pub input: PathBuf,
    /// False alarms a frame, 0.001 to 10
    #[arg(long, value_name = "RATE", default_value = "0.1", allow_negative_numbers = true)]
    pub false_alarms: f64,
    /// The parameter file to write
    #[arg(short, long, value_name = "FILE.toml")]
    pub out: PathBuf,
    /// Replace FILE.toml
    #[arg(long)]
    pub force: bool,

    #[command(flatten)]
    pub model: ModelArgs,

    #[command(flatten)]
    pub bank: BankArgs,

    #[command(flatten)]
    pub region: RegionArgs,

    #[command(flatten)]
    pub frames: FrameArgs,

    /// Threads that compute [default: one per core]
    #[arg(long, value_name = "N", help_heading = "Running")]
    pub threads: Option<usize>,
    /// Print nothing but errors
    #[arg(short, long, help_heading = "Running")]
    pub quiet: bool,
}

impl TuneArgs {
    /// A run that writes nothing.
    pub fn as_run(&self) -> RunArgs {
        RunArgs {
            input: self.input.clone(),
            model: self.model.clone(),
            bank: self.bank.clone(),
            region: self.region.clone(),
            frames: self.frames.clone(),
            threads: self.threads,
            quiet: self.quiet,
            no_tracks: true,
            false_alarms: None,
            live: Some(super::Switch::No),
            out: None,
            format: Vec::new(),
            mot: None,
            coco: None,
            box_size: None,
            overlay: false,
            report: None,
            video: None,
            video_response: false,
            force: false,
            checkpoint: None,
            resume: false,
            dump: None,
            dump_frames: None,
            dump_dir: None,
            simd: None,
            child: super::ChildArgs::default(),
        }
    }
}
