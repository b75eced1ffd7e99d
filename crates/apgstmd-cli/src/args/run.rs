//! Flags of `apgstmd run`, and the groups of them that other commands have too.

use std::path::PathBuf;
use std::str::FromStr;

use apgstmd_core::{Rectangle, SimdLevel};
use clap::Args;

use super::{FalseAlarmsArg, Format, ModelArgs, OnError, Switch};
use crate::source::{Limit, Place, RawFormat};

const EXAMPLES: &str = "\
Examples:
  apgstmd run frames/                              writes detections.csv, tracks.csv, run.json into ./frames-apgstmd
  apgstmd run sky.mp4 --report found.html --video found.mp4   a page and a video to look at
  apgstmd run 'frames/f_%05d.tif' --overlay        annotated pictures and a contact strip as well
  apgstmd run frames/ --out - --format jsonl | jq .score
  apgstmd run clip.mp4 --start 10s --stop 15s      five seconds of a video; every row has its time
  apgstmd run rtsp://cam/1 --out - --format jsonl  a camera: always the newest frame, rows as they are found
  ffmpeg -i X -f yuv4mpegpipe -strict -1 - | apgstmd run - --out found
  apgstmd run frames/ --mot tracks.txt --coco tracks.json --box-size 8
  apgstmd run sky.mp4 --roi 1920x600+0+0           the upper 600 rows; --mask sky.png for any shape
  apgstmd run scene.toml --speed 0.25              a made-up scene, without pictures on disk
  apgstmd run long.mp4 --out found --checkpoint 1000 --resume   again and again, until it is through
  apgstmd run frames/ --dump E,Q --dump-frames 60,120..130 --out inside

Without flags a bank of detectors looks for targets of 0.25 to 8 px/frame and 3 to 20 px; its scores, 0 to 1, compare
between clips. Who knows the speed computes less with --speed: one detector is tuned to one speed, and sees little below
half and above twice of it. With --step N a target moves N times as far from one used frame to the next.
Exit codes: 0 done, 1 failed, 2 wrong arguments or parameters, 130 interrupted (files are complete up to there).";

/// Flags of a bank.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Bank")]
pub struct BankArgs {
    /// Speeds of a bank, px/frame, instead of its own [default: 0.25,0.5,1,2,4,8]
    #[arg(long, value_name = "LIST", value_delimiter = ',', allow_negative_numbers = true)]
    pub speeds: Vec<f64>,
    /// Sizes of targets that a bank looks for, px: 5 sees 3 to 6 px, 10 and 20 see as many times more in reduced frames
    /// [default: 5,10,20; 5 with --speeds or a --speed]
    #[arg(long, alias = "size", value_name = "LIST", value_delimiter = ',', allow_negative_numbers = true)]
    pub sizes: Vec<f64>,
    /// Least contrast of a bank's detections, 0 to 1: that of a black 5 x 5 target on white that looks as strong
    /// [default: 0.003]
    #[arg(long, value_name = "C", allow_negative_numbers = true)]
    pub contrast: Option<f32>,
}

/// Which frames are used, and how they are read.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Input")]
pub struct FrameArgs {
    /// First frame to use, counted from 0; or the first from this time on, as in the column time_s: 2.5s
    #[arg(long, value_name = "N|SECONDS", default_value = "0")]
    pub start: Place,
    /// Stop before this frame or time [default: after the last]
    #[arg(long, value_name = "N|SECONDS")]
    pub stop: Option<Place>,
    /// Use every N-th frame, or one each so many seconds: 0.1s
    #[arg(long, value_name = "N|SECONDS", default_value = "1")]
    pub step: Place,
    /// Frames a second of what tells no times, pictures and raw frames, or in place of a wrong rate: time_s is then the
    /// frame's number over this
    #[arg(long, value_name = "RATE", allow_negative_numbers = true)]
    pub fps: Option<f64>,
    /// Standard input is raw frames of this size, one after the other; FORMAT: gray, gray10le, gray12le, gray14le,
    /// gray16le [default: gray]
    #[arg(long, value_name = "WxH[:FORMAT]")]
    pub raw: Option<RawFormat>,
    /// Bits that 16-bit samples really use, 9 to 16 (10, 12, 14 for many cameras)
    #[arg(long, value_name = "B")]
    pub bit_depth: Option<u32>,
    /// Most pixels of a frame that is read, in millions, 1 to 268: what claims to be larger is refused before it takes
    /// memory
    #[arg(
        long,
        value_name = "MILLIONS",
        default_value_t = Limit::USUAL,
        value_parser = clap::value_parser!(u32).range(1..=i64::from(Limit::HIGHEST))
    )]
    pub largest_frame: u32,
    /// What to do about a picture that cannot be used
    #[arg(long, value_name = "WHAT", default_value = "stop")]
    pub on_error: OnError,
}

/// A rectangle as `--roi` has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Roi(pub Rectangle);

impl FromStr for Roi {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "expected WxH+X+Y, as in 640x200+0+40: columns, rows, first column, first row".to_owned();
        let numbers: Result<Vec<usize>, _> = text.split(['x', '+']).map(str::parse).collect();
        let marks: String = text.chars().filter(|c| !c.is_ascii_digit()).collect();
        match (numbers.as_deref(), &*marks) {
            (Ok(&[width, height, x, y]), "x++") if width > 0 && height > 0 => {
                Ok(Self(Rectangle { x, y, width, height }))
            }
            _ => Err(wrong()),
        }
    }
}

/// Where targets are looked for.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Region")]
pub struct RegionArgs {
    /// Look for targets in this rectangle only, columns x rows from column X, row Y on; several times for any of several.
    /// What is far outside is not computed
    #[arg(long, value_name = "WxH+X+Y")]
    pub roi: Vec<Roi>,
    /// Look for targets only where this picture, of the size of the frames, is not black
    #[arg(long, value_name = "FILE")]
    pub mask: Option<PathBuf>,
}

/// What `apgstmd batch` tells the process it starts for a video; nobody types these.
#[derive(Debug, Default, Args)]
pub struct ChildArgs {
    /// Write one small picture, of the frame with the strongest detection.
    #[arg(long, value_name = "FILE", hide = true)]
    pub poster: Option<PathBuf>,
    /// End when standard input does: it is held open by whoever started this, and closed by the system should they die.
    #[arg(long, hide = true)]
    pub while_stdin_is_open: bool,
}

/// Flags of `apgstmd run`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct RunArgs {
    /// Folder of pictures, or a quoted pattern ('frames/*.png', 'f_%05d.tif'): PNG, JPEG, TIFF, BMP, PGM or PPM, taken in
    /// natural order (2 before 10). A video file, /dev/video0, an rtsp:// or http:// address, through the program ffmpeg.
    /// `-`, standard input: YUV4MPEG2, or raw frames with --raw. SCENE.toml, a scene as `apgstmd synth` takes it
    pub input: PathBuf,

    #[command(flatten)]
    pub model: ModelArgs,

    #[command(flatten)]
    pub bank: BankArgs,

    /// List so many false alarms a frame: the least score is set by the clip itself, targets left aside, as it passes.
    /// `apgstmd tune` sets it by a clip without targets instead [default: 2 of a bank, off of a single detector]
    #[arg(long, value_name = "RATE|off", allow_negative_numbers = true, help_heading = "Threshold")]
    pub false_alarms: Option<FalseAlarmsArg>,

    #[command(flatten)]
    pub region: RegionArgs,

    #[command(flatten)]
    pub frames: FrameArgs,
    /// Always take the newest frame; those that come while one is computed are dropped and counted. A video file is
    /// played at its own speed [default: yes for cameras and rtsp, else no]
    #[arg(
        long,
        value_name = "YES|NO",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "yes",
        hide_possible_values = true,
        help_heading = "Input"
    )]
    pub live: Option<Switch>,

    /// Folder for the results, made if missing; `-` writes the detections to stdout and nothing else
    /// [default: INPUT's name + "-apgstmd" in the current folder]
    #[arg(short, long, value_name = "DIR", help_heading = "Output")]
    pub out: Option<PathBuf>,
    /// Tables to write: csv, jsonl or both with a comma
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "csv", help_heading = "Output")]
    pub format: Vec<Format>,
    /// Write no tracks.csv, which links the detections of each target from frame to frame
    #[arg(long, help_heading = "Output")]
    pub no_tracks: bool,
    /// Write the tracks as MOTChallenge text: frames, ids and pixels count from 1
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub mot: Option<PathBuf>,
    /// Write the tracks as COCO JSON, at the end of the run
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub coco: Option<PathBuf>,
    /// Side of the box that stands for a point in MOTChallenge text and COCO JSON [default: the size of target that the
    /// parameters prefer, 5 for those of the paper]
    #[arg(long, value_name = "PX", allow_negative_numbers = true, help_heading = "Output")]
    pub box_size: Option<f64>,
    /// Write overlay/NAME.png, one annotated picture a frame, and strip.png, a sheet of twelve
    #[arg(long, help_heading = "Output")]
    pub overlay: bool,
    /// Write a video with every frame annotated: .mp4 or .mov, .mkv, through the program ffmpeg
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub video: Option<PathBuf>,
    /// Show the response map beside each frame of the video
    #[arg(long, requires = "video", help_heading = "Output")]
    pub video_response: bool,
    /// Write a page to look at what was found, in one file for any browser: .html
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub report: Option<PathBuf>,
    /// Replace results that DIR already holds (only files that this program wrote), and the files named by other flags
    #[arg(long, help_heading = "Output")]
    pub force: bool,

    /// Keep all that is needed to go on in DIR/checkpoint.safetensors, every N frames at least and when interrupted; it is
    /// removed when the run is through. For tables (csv, jsonl, tracks.csv, --mot) of what can be read again
    #[arg(long, value_name = "N", help_heading = "Output")]
    pub checkpoint: Option<usize>,
    /// Go on where the same run left off: from its checkpoint, or from the beginning where there is none. What is through
    /// already stays as it is. The files are then those of a run that was never disturbed
    #[arg(long, conflicts_with = "force", help_heading = "Output")]
    pub resume: bool,

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

    /// Threads that compute [default: one per core]; the numbers found do not depend on it. Reading ahead and writing
    /// have threads of their own besides
    #[arg(long, value_name = "N", help_heading = "Running")]
    pub threads: Option<usize>,
    /// Widest instruction set to use: scalar, sse2, sse4.2, neon, avx2 or avx512 [default: the best there is, as
    /// `apgstmd --version` names it]; what the machine lacks, the next below stands in for. Between two of them numbers
    /// differ by rounding
    #[arg(long, value_name = "LEVEL", help_heading = "Running")]
    pub simd: Option<SimdLevel>,
    /// Print nothing but errors
    #[arg(short, long, help_heading = "Running")]
    pub quiet: bool,

    #[command(flatten)]
    pub child: ChildArgs,
}
