//! A folder or pattern of pictures as a stream of frames.

use std::vec::IntoIter;

use super::{Arrival, FrameSource, InputFlags, Listing, Selection, decode};

/// Picture files in natural order; the frame's number is its place in that order.
pub struct PictureFiles<'a> {
    listing: &'a Listing,
    frames: IntoIter<usize>,
    flags: InputFlags,
}

impl<'a> PictureFiles<'a> {
    /// The selected pictures of a listing.
    pub fn new(listing: &'a Listing, selection: Selection, flags: InputFlags) -> Self {
        Self { listing, frames: selection.into_frames(), flags }
    }
}

impl FrameSource for PictureFiles<'_> {
    fn expected(&self) -> Option<usize> {
        Some(self.frames.len())
    }

    fn next_frame(&mut self) -> Option<Arrival> {
        let frame = self.frames.next()?;
        let path = self.listing.files.get(frame)?;
        Some(Arrival {
            frame,
            name: self.listing.name(path),
            origin: path.display().to_string(),
            time: self.flags.fps.map(|fps| frame as f64 / fps),
            picture: decode::read(path, self.flags.bit_depth, self.flags.limit),
        })
    }
}
