//! The scene that is measured: natural clutter that moves, as in the demo, and targets that circle before it.

use std::f64::consts::TAU;
use std::num::NonZero;
use std::thread;

use apgstmd_core::Size;
use apgstmd_core::stimulus::{Background, Path, Renderer, Scene, Shade, Target};
use ndarray::Array2;

use crate::Outcome;
use crate::failure::Failure;
use crate::interrupt;

/// Most frames that are drawn; they are played to and fro, so that nothing jumps.
const FRAMES: usize = 240;
/// Fewer where they would take more than this, bytes.
const BUDGET: usize = 256 << 20;
const FEWEST: usize = 8;

/// How many targets a scene has unless something else is asked for.
pub(super) const TARGETS: usize = 4;

/// Frames of a scene, 8 bit grey.
pub(super) struct Clip {
    frames: Vec<Array2<u8>>,
}

impl Clip {
    /// Targets that move at `speed` px/frame. No more frames are drawn than are `wanted`.
    ///
    /// # Errors
    /// A size that no scene can have; Ctrl-C.
    pub fn new(size: Size, speed: f64, targets: usize, wanted: usize) -> Outcome<Self> {
        let frames = (BUDGET / size.area().max(1)).min(wanted).clamp(FEWEST, FRAMES);
        let scene = scene(size, speed, targets, frames);
        let renderer = Renderer::new(&scene).map_err(|error| Failure::usage(format_args!("--size: {error}")))?;
        let threads = thread::available_parallelism().map_or(1, NonZero::get);
        let mut drawn: Vec<Array2<u8>> = vec![Array2::default((0, 0)); frames];
        thread::scope(|scope| {
            for (part, chunk) in drawn.chunks_mut(frames.div_ceil(threads)).enumerate() {
                let (renderer, first) = (&renderer, part * frames.div_ceil(threads));
                scope.spawn(move || {
                    for (t, frame) in chunk.iter_mut().enumerate().take_while(|_| !interrupt::asked()) {
                        *frame = renderer.frame(first + t).mapv(|value| (255.0 * value).round() as u8);
                    }
                });
            }
        });
        if interrupt::asked() { Err(Failure::Interrupted) } else { Ok(Self { frames: drawn }) }
    }

    /// The n-th frame of the endless clip.
    pub fn frame(&self, n: usize) -> &Array2<u8> {
        let last = self.frames.len() - 1;
        let place = n % (2 * last);
        &self.frames[place.min(2 * last - place)]
    }
}

fn scene(size: Size, speed: f64, targets: usize, frames: usize) -> Scene {
    let demo = Scene::demo();
    let mut background = demo.background.clone();
    if let Background::Natural { velocity, .. } = &mut background {
        // The demo's is made for targets of 1 px/frame.
        velocity.iter_mut().for_each(|v| *v *= speed);
    }
    let (width, height) = (size.width as f64, size.height as f64);
    // A grid of about square cells, one target circling in each.
    let across = (targets as f64 * width / height).sqrt().ceil().max(1.0);
    let down = (targets as f64 / across).ceil().max(1.0);
    let radius = (0.35 * (width / across).min(height / down)).min(40.0);
    let target = |n: usize| {
        let (column, row) = (n as f64 % across, (n as f64 / across).floor());
        let center = [(column + 0.5) * width / across, (row + 0.5) * height / down];
        // Golden-ratio angles: no two of them in step.
        let angle = TAU * (0.618 * n as f64).fract();
        let path = Path::Circular { center, radius, speed: speed * demo.rate, angle };
        Target { shade: Shade::Dark(0.4), ..Target::new(path) }
    };
    Scene {
        width: size.width,
        height: size.height,
        frames,
        background,
        targets: (0..targets).map(target).collect(),
        ..demo
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clips_go_to_and_fro() {
        for (wanted, drawn) in [(1, FEWEST), (20, 20), (9999, FRAMES)] {
            let clip = Clip::new(Size::new(32, 48), 1.0, TARGETS, wanted).unwrap();
            assert_eq!(clip.frames.len(), drawn);
            assert_eq!(clip.frame(0), clip.frame(2 * (drawn - 1)));
            assert_eq!(clip.frame(drawn), clip.frame(drawn - 2));
            assert_ne!(clip.frame(0), clip.frame(1));
        }
    }

    #[test]
    fn every_target_is_in_the_picture() {
        for (size, targets) in [(Size::new(16, 16), 1), (Size::new(270, 480), 64), (Size::new(200, 90), 7)] {
            let scene = scene(size, 1.0, targets, 8);
            let renderer = Renderer::new(&scene).unwrap();
            assert_eq!(renderer.truth(3).len(), targets, "{size}");
        }
    }
}
