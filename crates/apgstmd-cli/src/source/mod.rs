//! Where frames come from: pictures, scenes, video and cameras through `ffmpeg`, standard input. Each is a
//! [`FrameSource`].

pub(crate) mod boundary;
mod decode;
pub(crate) mod ffmpeg;
mod files;
mod input;
mod limit;
mod listing;
mod numbering;
mod raw;
mod samples;
mod scene;
mod scene_file;
mod span;
mod stdin;
mod stream;
mod y4m;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use apgstmd_core::{Frame, Size};
use ndarray::Array3;
use serde::{Deserialize, Serialize};

/// Reads a picture file; the error says why it cannot be used.
pub(crate) fn read_picture(path: &std::path::Path) -> Result<Picture, String> {
    decode::read(path, None, Limit::default())
}

pub use files::PictureFiles;
pub use input::{Input, InputFlags};
pub use limit::Limit;
pub use listing::Listing;
pub(crate) use listing::{Numbered, is_picture};
pub use numbering::Missing;
pub use raw::RawFormat;
pub use scene::SceneFrames;
pub(crate) use scene::frame_name;
pub use scene_file::{Overrides, SceneFile, is_scene};
pub use span::{Place, Selection, Span};
pub use stream::{Frames, Timed};

/// A stream of numbered frames. A thread of its own reads it.
pub trait FrameSource: Send {
    /// How many frames will arrive, where that is known beforehand.
    fn expected(&self) -> Option<usize>;
    /// The next frame, readable or not; `None` at the end.
    fn next_frame(&mut self) -> Option<Arrival>;
    /// Makes a source give up that waits for its next frame. None where reading never waits for long.
    fn switch(&self) -> Option<Switch> {
        None
    }
}

/// Told once that no more frames are wanted.
#[derive(Clone, Debug, Default)]
pub struct Switch(Arc<AtomicBool>);

impl Switch {
    /// From now on nobody wants frames.
    pub fn turn_off(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether that was said, or the user asked for the end.
    pub fn is_off(&self) -> bool {
        self.0.load(Ordering::Relaxed) || crate::interrupt::asked()
    }
}

/// One frame as it arrives.
pub struct Arrival {
    /// Number of the frame in its source, from 0.
    pub frame: usize,
    /// Name in the tables: the file's, or the source's with the frame's number.
    pub name: String,
    /// Where it came from, for messages: the file's path.
    pub origin: String,
    /// Seconds since the source's own beginning, where it tells.
    pub time: Option<f64>,
    /// The picture, or why there is none.
    pub picture: Result<Picture, String>,
}

/// A decoded picture: (rows, columns, channels), channels 1 or 3, or 4 with alpha.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Pixels {
    /// 8-bit samples.
    U8(Array3<u8>),
    /// 16-bit samples.
    U16(Array3<u16>),
    /// Luminance in [0, 1].
    F32(Array3<f32>),
    /// Luminance in [0, 1].
    F64(Array3<f64>),
}

/// Pixels and how to read them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// The samples.
    pub pixels: Pixels,
    /// Bits that 16-bit samples really use, where the user said so.
    pub bits: Option<u32>,
}

impl Picture {
    /// As the detector takes it.
    pub fn frame(&self) -> Frame<'_> {
        let frame = match &self.pixels {
            Pixels::U8(samples) => Frame::from(samples.view()),
            Pixels::U16(samples) => Frame::from(samples.view()),
            Pixels::F32(samples) => Frame::from(samples.view()),
            Pixels::F64(samples) => Frame::from(samples.view()),
        };
        match self.bits {
            Some(bits) => frame.with_bits(bits),
            None => frame,
        }
    }

    /// Memory of its samples.
    pub fn bytes(&self) -> usize {
        match &self.pixels {
            Pixels::U8(samples) => samples.len(),
            Pixels::U16(samples) => 2 * samples.len(),
            Pixels::F32(samples) => 4 * samples.len(),
            Pixels::F64(samples) => 8 * samples.len(),
        }
    }

    /// Rows and columns.
    pub fn size(&self) -> Size {
        self.frame().size()
    }
}
