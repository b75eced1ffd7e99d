//! Synthetic scenes with ground truth: a [`Scene`] describes, a [`Renderer`] draws any frame of it on its own.
//!
//! Drawing order: background, large objects, targets, occluders, noise, clipping to [0, 1]. Positions are those of the
//! detector: x = column to the right, y = row downward, pixel centres at integers; directions are radians,
//! counter-clockwise on the screen. The same scene is the same picture on every machine: every transcendental function
//! comes from `libm`, every random number from SplitMix64.
//!
//! ```
//! use apgstmd_core::stimulus::{Renderer, Scene};
//! let scene = Scene::from_toml(
//!     "width = 64\nheight = 48\nframes = 10\n[[target]]\npath = { kind = 'straight', start = [10, 20], speed = 500 }",
//! )?;
//! let renderer = Renderer::new(&scene)?;
//! let mut frame = renderer.make_frame();
//! for t in 0..scene.frames {
//!     renderer.frame_into(t, &mut frame);
//!     assert_eq!(renderer.truth(t).len(), 1);
//! }
//! # Ok::<(), apgstmd_core::stimulus::SceneError>(())
//! ```

mod background;
mod camera;
mod draw;
mod error;
mod fourier;
mod path;
mod preset;
mod random;
mod renderer;
mod scene;
mod texture;
mod truth;
mod validate;

pub use camera::Camera;
pub use error::SceneError;
pub use path::Path;
pub use renderer::Renderer;
pub use scene::{Background, Object, Scene, Shade, Target};
pub use truth::{NEIGHBOURHOOD, Truth, truth_from_csv, truth_to_csv};
