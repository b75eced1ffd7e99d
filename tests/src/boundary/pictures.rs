//! Bytes that are, or claim to be, pictures.

use apgstmd_cli::boundary::{ffmpeg_log, picture as decode, pipe_raw, pipe_y4m};
use apgstmd_cli::source::{Picture, RawFormat};
use arbitrary::Unstructured;

use super::whole;

/// Small, so that what claims more is found out, and fast.
const MOST_PIXELS: usize = 1 << 16;

/// What is decoded can be given to a detector, or is refused by it for what its samples are.
fn is_usable(picture: &Picture) {
    let size = picture.size();
    assert!(size.area() <= MOST_PIXELS, "{size}");
    if let Ok(luminance) = picture.frame().luminance() {
        assert!(luminance.iter().all(|value| (-0.01..=1.01).contains(value)));
    }
}

/// A picture file. The first byte chooses a bit depth.
pub fn picture(bytes: &[u8]) {
    let Some((first, bytes)) = bytes.split_first() else { return };
    let bit_depth = (9..=16).contains(first).then_some(u32::from(*first));
    match decode(bytes, bit_depth, MOST_PIXELS) {
        Ok(picture) => is_usable(&picture),
        Err(reason) => assert!(!reason.is_empty()),
    }
}

/// A pipe: YUV4MPEG2, or raw frames of a format that the first bytes tell.
pub fn pipe(bytes: &[u8]) {
    let (pictures, _) = pipe_y4m(bytes, MOST_PIXELS);
    pictures.iter().for_each(is_usable);
    let mut input = Unstructured::new(bytes);
    let (width, height) = (whole(&mut input, 1..=40), whole(&mut input, 1..=40));
    let format = ["gray", "gray10le", "gray12le", "gray14le", "gray16le"][whole(&mut input, 0..=4) as usize];
    let raw: RawFormat = format!("{width}x{height}:{format}").parse().expect("a raw format");
    let rest = input.take_rest();
    let (pictures, cut) = pipe_raw(raw, rest);
    let frame = width as usize * height as usize * if format == "gray" { 1 } else { 2 };
    assert_eq!((pictures.len(), cut.is_some()), (rest.len() / frame, !rest.len().is_multiple_of(frame)));
    pictures.iter().for_each(is_usable);
}

/// What ffmpeg says on stderr: times of frames are numbers or not known.
pub fn ffmpeg(bytes: &[u8]) {
    let (times, _) = ffmpeg_log(bytes);
    assert!(times.iter().flatten().all(|time| time.is_finite()), "{times:?}");
}
