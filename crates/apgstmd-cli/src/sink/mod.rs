//! Where results go: each sink sees every processed frame once, in order.

pub mod dump;
pub mod overlay;
mod png;
pub mod results;
pub mod run_json;
pub mod scene_folder;
pub mod table;

use apgstmd_core::{Probe, Response};

use crate::Outcome;
use crate::source::Picture;

/// One processed frame.
pub struct Seen<'a> {
    /// Number of the frame in its source.
    pub frame: usize,
    /// Its name.
    pub name: &'a str,
    /// What went in.
    pub picture: &'a Picture,
    /// What came out.
    pub response: &'a Response,
    /// What happened inside.
    pub probe: Probe<'a>,
}

/// A receiver of results.
pub trait Sink {
    /// Takes a frame; what it writes is on its way to the disk when this returns.
    ///
    /// # Errors
    /// Writing failed.
    fn frame(&mut self, seen: &Seen<'_>) -> Outcome;

    /// The last frame is through, or the run ends early.
    ///
    /// # Errors
    /// Writing failed.
    fn finish(&mut self) -> Outcome {
        Ok(())
    }
}
