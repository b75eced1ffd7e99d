//! The readers of pictures, pipes and names as functions of bytes: see [`crate::boundary`].

use std::path::{Path, PathBuf};

use super::listing::{Numbered, sort};
use super::y4m::Header;
use super::{Limit, Picture, RawFormat, decode, raw};

/// A picture file.
///
/// # Errors
/// Why it cannot be used.
pub fn picture(bytes: &[u8], bit_depth: Option<u32>, most_pixels: usize) -> Result<Picture, String> {
    decode::from_bytes(bytes, bit_depth, Limit::of_pixels(most_pixels))
}

/// YUV4MPEG2 from a pipe.
pub fn pipe_y4m(mut bytes: &[u8], most_pixels: usize) -> (Vec<Picture>, Option<String>) {
    match Header::read(&mut bytes, Limit::of_pixels(most_pixels)) {
        Ok(Some(header)) => all(|| header.next(&mut bytes)),
        Ok(None) => (Vec::new(), None),
        Err(reason) => (Vec::new(), Some(reason)),
    }
}

/// Raw frames from a pipe.
pub fn pipe_raw(format: RawFormat, mut bytes: &[u8]) -> (Vec<Picture>, Option<String>) {
    all(|| raw::next(format, &mut bytes))
}

fn all(mut next: impl FnMut() -> Result<Option<Picture>, String>) -> (Vec<Picture>, Option<String>) {
    let mut pictures = Vec::new();
    loop {
        match next() {
            Ok(Some(picture)) => pictures.push(picture),
            Ok(None) => return (pictures, None),
            Err(reason) => return (pictures, Some(reason)),
        }
    }
}

/// Sorts names as frames are taken: 2 before 10.
pub fn in_natural_order(files: &mut [PathBuf]) {
    sort(files);
}

/// Whether a printf pattern such as `f_%05d.png` takes a file; none where it is no such pattern.
pub fn printf_pattern(pattern: &Path, file: &Path) -> Option<bool> {
    Numbered::parse(pattern).map(|pattern| pattern.matches(file))
}
