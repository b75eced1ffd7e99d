//! Truth from a folder of `apgstmd synth`, a table, MOTChallenge text, or the scene itself.

use std::path::Path;

use apgstmd_core::evaluation::{TruthBox, truth_from_text};

use super::{read_text, unreadable};
use crate::Outcome;
use crate::failure::Failure;
use crate::sink::scene_folder::TRUTH;
use crate::source::{SceneFile, is_scene};

const ORDER: &str = "TRUTH comes second: a table with frame,x,y,w,h, or MOTChallenge text; DETECTIONS comes first";

/// Reads the truth.
///
/// # Errors
/// Names the file, the line, what stands there and what was expected.
pub fn read_truth(path: &Path) -> Outcome<Vec<TruthBox>> {
    if is_scene(path) {
        let file = SceneFile::read(path)?;
        let frames = 0..file.scene().frames;
        return Ok(frames.flat_map(|t| file.renderer().truth(t)).map(TruthBox::from).collect());
    }
    let file = if path.is_dir() { path.join(TRUTH) } else { path.to_owned() };
    if path.is_dir() && !file.is_file() {
        return Err(Failure::failed(format_args!("there is no {TRUTH} in {}", path.display()))
            .hint("TRUTH is a folder of `apgstmd synth`, or a file"));
    }
    truth_from_text(&read_text(&file)?).map_err(|error| unreadable(&file, &error, ORDER))
}
