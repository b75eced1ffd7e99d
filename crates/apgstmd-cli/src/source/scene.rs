//! A made-up scene as a stream of frames, drawn as they are asked for.

use std::vec::IntoIter;

use apgstmd_core::stimulus::Renderer;
use ndarray::Axis;

use super::{Arrival, FrameSource, Picture, Pixels, Selection};

/// The frames of a renderer's scene.
pub struct SceneFrames<'a> {
    renderer: &'a Renderer,
    frames: IntoIter<usize>,
}

impl<'a> SceneFrames<'a> {
    /// Some of them.
    pub fn new(renderer: &'a Renderer, selection: Selection) -> Self {
        Self { renderer, frames: selection.into_frames() }
    }
}

/// What a frame of a scene is called in tables and, with an ending, on disk.
pub(crate) fn frame_name(frame: usize) -> String {
    format!("scene_{frame:06}")
}

impl FrameSource for SceneFrames<'_> {
    fn expected(&self) -> Option<usize> {
        Some(self.frames.len())
    }

    fn next_frame(&mut self) -> Option<Arrival> {
        let frame = self.frames.next()?;
        let pixels = Pixels::F32(self.renderer.frame(frame).insert_axis(Axis(2)));
        Some(Arrival {
            frame,
            name: frame_name(frame),
            origin: format!("frame {frame} of the scene"),
            time: Some(frame as f64 / self.renderer.scene().rate),
            picture: Ok(Picture { pixels, bits: None }),
        })
    }
}
