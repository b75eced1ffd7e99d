//! A made-up scene as a stream of frames, drawn as they are asked for.

use apgstmd_core::stimulus::Renderer;
use ndarray::Axis;

use super::{Arrival, FrameSource, Picture, Pixels};

/// The frames of a renderer's scene.
pub struct SceneFrames<'a> {
    renderer: &'a Renderer,
    next: usize,
}

impl<'a> SceneFrames<'a> {
    /// From its first frame.
    pub fn new(renderer: &'a Renderer) -> Self {
        Self { renderer, next: 0 }
    }
}

impl FrameSource for SceneFrames<'_> {
    fn expected(&self) -> Option<usize> {
        Some(self.renderer.scene().frames)
    }

    fn next_frame(&mut self) -> Option<Arrival> {
        let frame = self.next;
        if frame >= self.renderer.scene().frames {
            return None;
        }
        self.next += 1;
        let pixels = Pixels::F32(self.renderer.frame(frame).insert_axis(Axis(2)));
        Some(Arrival {
            frame,
            name: format!("scene_{frame:06}"),
            origin: format!("frame {frame} of the scene"),
            picture: Ok(Picture { pixels, bits: None }),
        })
    }
}
