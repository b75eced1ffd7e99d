//! What this machine's ffmpeg can encode with.

use std::process::Stdio;

use crate::Outcome;
use crate::failure::Failure;
use crate::source::ffmpeg::process::{Process, ended};

/// An encoder with its flags.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Codec {
    name: &'static str,
    /// Good to look at: a ring of 1 px stays a ring.
    pub(super) flags: &'static [&'static str],
}

/// The best first. Builds without the GPL have no libx264.
const CODECS: [Codec; 3] = [
    Codec { name: "libx264", flags: &["-c:v", "libx264", "-preset", "veryfast", "-crf", "19", "-g", "60"] },
    Codec { name: "libopenh264", flags: &["-c:v", "libopenh264", "-b:v", "8M", "-g", "60"] },
    Codec { name: "mpeg4", flags: &["-c:v", "mpeg4", "-q:v", "3", "-g", "60"] },
];

impl Codec {
    /// Asks ffmpeg.
    ///
    /// # Errors
    /// It is not there, or has none of them.
    pub fn choose() -> Outcome<Self> {
        let arguments = ["-hide_banner", "-loglevel", "error", "-encoders"].map(Into::into);
        let mut process = Process::spawn("ffmpeg", &arguments, Stdio::null(), "--video")?;
        let mut text = String::new();
        if let Some(mut stdout) = process.0.stdout.take() {
            // A program that says nothing has no encoders.
            let _ = std::io::Read::read_to_string(&mut stdout, &mut text);
        }
        let has = |codec: &&Codec| text.lines().any(|line| line.split_whitespace().nth(1) == Some(codec.name));
        CODECS.iter().find(has).copied().ok_or_else(|| {
            let status = process.end().filter(|status| !status.success());
            let why = status.map_or_else(String::new, |status| format!(" ({})", ended("ffmpeg", status)));
            let names = CODECS.map(|codec| codec.name).join(", ");
            Failure::failed(format_args!("--video needs an ffmpeg that has one of the encoders {names}{why}"))
                .hint("`ffmpeg -encoders` lists those of yours; builds with libx264 are what most systems install")
        })
    }
}
