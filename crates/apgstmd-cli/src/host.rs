//! What a program around this one brings to `run`: frames of its own, and an eye on the results.

use crate::sink::Sink;
use crate::source::Frames;

/// Nothing at all, unless said otherwise.
#[derive(Default)]
pub struct Host {
    /// Taken in place of INPUT.
    pub frames: Option<Box<dyn Frames>>,
    /// Sees every frame, after the tables have it.
    pub sink: Option<Box<dyn Sink + Send>>,
    /// Whether `--out` is only to hold what the flags ask for by name, and run.json: no tables.
    pub without_tables: bool,
}
