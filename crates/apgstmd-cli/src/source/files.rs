//! A folder or pattern of pictures as a stream of frames.

use super::{Arrival, FrameSource, Listing, Selection, decode};

/// Picture files in natural order; the frame's number is its place in that order.
pub struct PictureFiles<'a> {
    listing: &'a Listing,
    selection: Selection,
    bit_depth: Option<u32>,
    next: usize,
}

impl<'a> PictureFiles<'a> {
    /// The selected pictures of a listing.
    pub fn new(listing: &'a Listing, selection: Selection, bit_depth: Option<u32>) -> Self {
        Self { listing, selection, bit_depth, next: selection.start }
    }
}

impl FrameSource for PictureFiles<'_> {
    fn expected(&self) -> Option<usize> {
        Some(self.selection.frames().len())
    }

    fn next_frame(&mut self) -> Option<Arrival> {
        let frame = self.next;
        if !self.selection.contains(frame) {
            return None;
        }
        let path = self.listing.files.get(frame)?;
        self.next += self.selection.step;
        Some(Arrival {
            frame,
            name: self.listing.name(path),
            origin: path.display().to_string(),
            picture: decode::read(path, self.bit_depth),
        })
    }
}
