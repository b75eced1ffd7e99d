//! Flags of `apgstmd tune`.

use std::path::PathBuf;

use clap::Args;

use super::{ModelArgs, OnError, RunArgs};
use crate::source::{Place, RawFormat};

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

    /// As for `run`: speeds of a bank, px/frame
    #[arg(long, value_name = "LIST", value_delimiter = ',', allow_negative_numbers = true, help_heading = "Bank")]
    pub speeds: Vec<f64>,
    /// As for `run`: sizes of targets that a bank looks for, px
    #[arg(
        long,
        alias = "size",
        value_name = "LIST",
        value_delimiter = ',',
        allow_negative_numbers = true,
        help_heading = "Bank"
    )]
    pub sizes: Vec<f64>,
    /// As for `run`: least contrast of a bank's detections
    #[arg(long, value_name = "C", allow_negative_numbers = true, help_heading = "Bank")]
    pub contrast: Option<f32>,

    /// First frame to use, or the first from this time on: 2.5s
    #[arg(long, value_name = "N|SECONDS", default_value = "0", help_heading = "Input")]
    pub start: Place,
    /// Stop before this frame or time [default: after the last]
    #[arg(long, value_name = "N|SECONDS", help_heading = "Input")]
    pub stop: Option<Place>,
    /// Use every N-th frame, or one each so many seconds: 0.1s
    #[arg(long, value_name = "N|SECONDS", default_value = "1", help_heading = "Input")]
    pub step: Place,
    /// Frames a second of what tells no times
    #[arg(long, value_name = "RATE", allow_negative_numbers = true, help_heading = "Input")]
    pub fps: Option<f64>,
    /// Standard input is raw frames of this size
    #[arg(long, value_name = "WxH[:FORMAT]", help_heading = "Input")]
    pub raw: Option<RawFormat>,
    /// Bits that 16-bit samples really use, 9 to 16
    #[arg(long, value_name = "B", help_heading = "Input")]
    pub bit_depth: Option<u32>,
    /// What to do about a picture that cannot be used
    #[arg(long, value_name = "WHAT", default_value = "stop", help_heading = "Input")]
    pub on_error: OnError,

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
            speeds: self.speeds.clone(),
            sizes: self.sizes.clone(),
            contrast: self.contrast,
            start: self.start,
            stop: self.stop,
            step: self.step,
            fps: self.fps,
            raw: self.raw,
            bit_depth: self.bit_depth,
            on_error: self.on_error,
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
            dump: None,
            dump_frames: None,
            dump_dir: None,
            simd: None,
        }
    }
}
