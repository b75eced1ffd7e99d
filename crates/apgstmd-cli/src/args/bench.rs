//! Flags of `apgstmd bench`.

use std::path::PathBuf;

use apgstmd_core::{SimdLevel, Size};
use clap::Args;

use super::{ModelArg, PresetArg, RejectionArg};

const EXAMPLES: &str = "\
Examples:
  apgstmd bench                                    480 x 270, all cores, best instruction set
  apgstmd bench --size 480x270,1920x1080 --threads 1,2 --simd avx2,avx512
  apgstmd bench --frames 10000 --json > speed.json
  apgstmd bench --scaling curves                   threads, pixels, active tiles, instruction sets: CSV and SVG

The scene is made on the spot: natural clutter that moves, four targets circling before it. Frames are streamed one by
one from memory; what is timed is the detector alone. Every list is combined with every other.

G FMA/s and GB/s count what the model asks for, in the tiles that were active: multiply-adds (one counts once) and bytes of
maps and states that pass between stages. Beside them stands what this machine was just measured to give at most: multiply-adds
out of registers, and bytes read and written by copying memory. More than the peak is possible: for bytes that stay in a
cache, and for a stage that skips the zeros of an active tile.";

/// Flags of `apgstmd bench`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct BenchArgs {
    /// Frames of width x height, px
    #[arg(long, value_name = "WxH,...", value_delimiter = ',', default_value = "480x270", value_parser = parse_size, help_heading = "What")]
    pub size: Vec<Size>,
    /// Threads [default: one per core]
    #[arg(long, value_name = "N,...", value_delimiter = ',', help_heading = "What")]
    pub threads: Vec<usize>,
    /// Widest instruction sets to use: scalar, sse2, sse4.2, neon, avx2, avx512 [default: the best there is]
    #[arg(long, value_name = "LEVEL,...", value_delimiter = ',', help_heading = "What")]
    pub simd: Vec<SimdLevel>,
    /// Models [default: apg-stmd]; operations are counted for this one only
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', help_heading = "What")]
    pub model: Vec<ModelArg>,
    /// Ready-made parameters [default: practical; paper for the models to compare with]
    #[arg(long, value_name = "NAME", help_heading = "What")]
    pub preset: Option<PresetArg>,
    /// How false positives are told from targets; off predicts everywhere, the most expensive
    #[arg(long, value_name = "MODE", help_heading = "What")]
    pub rejection: Option<RejectionArg>,
    /// Speed that the model is tuned to, and at which the targets of the scene move, pixels per frame
    #[arg(
        long,
        value_name = "PX_PER_FRAME",
        default_value_t = 1.0,
        allow_negative_numbers = true,
        help_heading = "What"
    )]
    pub speed: f64,
    /// Frames to measure, after as many as fill every memory
    #[arg(long, value_name = "N", default_value_t = 1000, help_heading = "What")]
    pub frames: usize,

    /// Print JSON in place of the table
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Write the JSON there as well
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub out: Option<PathBuf>,
    /// A line to keep with the numbers: a commit, what was changed
    #[arg(long, value_name = "TEXT", help_heading = "Output")]
    pub label: Option<String>,
    /// Measure how time grows with threads, pixels, active tiles and instruction sets instead: a CSV and an SVG each
    #[arg(long, value_name = "DIR", conflicts_with_all = ["size", "threads", "simd", "model", "rejection", "json", "out"], help_heading = "Output")]
    pub scaling: Option<PathBuf>,
    /// Leave out sizes of more pixels than this from the curves
    #[arg(long, value_name = "WxH", requires = "scaling", value_parser = parse_size, help_heading = "Output")]
    pub largest: Option<Size>,
}

fn parse_size(text: &str) -> Result<Size, String> {
    let size = text.split_once(['x', 'X']).and_then(|(width, height)| {
        Some(Size { width: width.trim().parse().ok()?, height: height.trim().parse().ok()? })
    });
    size.ok_or_else(|| "it must be WIDTHxHEIGHT, such as 480x270".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn width_comes_first() {
        assert_eq!(parse_size("480x270"), Ok(Size::new(270, 480)));
        for bad in ["480", "480x", "x270", "480x-1", "axb", ""] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }
}
