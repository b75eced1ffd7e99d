//! PNG files with our mark in them, so that `--force` can tell them from the user's own.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use png::{BitDepth, ColorType};

use super::beside;
use crate::Outcome;

const MARK: &str = concat!("apgstmd ", env!("CARGO_PKG_VERSION"));

/// Writes samples row by row, the high byte first, into a file that is not there yet.
pub(super) fn write(
    path: &Path,
    (width, height): (u32, u32),
    (color, depth): (ColorType, BitDepth),
    samples: &[u8],
) -> Outcome {
    beside::create(path, |out| {
        let mut encoder = png::Encoder::new(out, width, height);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.set_compression(png::Compression::Fast);
        encoder.add_text_chunk("Software".to_owned(), MARK.to_owned()).map_err(io::Error::from)?;
        let mut writer = encoder.write_header()?;
        writer.write_image_data(samples)?;
        Ok(writer.finish()?)
    })
}

/// Whether this program wrote a file.
pub(super) fn is_ours(path: &Path) -> bool {
    const ENOUGH: u64 = 256;
    let mut head = Vec::new();
    File::open(path).is_ok_and(|file| file.take(ENOUGH).read_to_end(&mut head).is_ok()) && begins_as_ours(&head)
}

/// The mark stands right behind the header.
fn begins_as_ours(head: &[u8]) -> bool {
    const TEXT: &[u8] = b"tEXtSoftware\0apgstmd ";
    head.starts_with(b"\x89PNG") && head.windows(TEXT.len()).any(|window| window == TEXT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_pictures_are_known() {
        let path = std::env::temp_dir().join(format!("apgstmd-mark-{}.png", std::process::id()));
        write(&path, (20, 10), (ColorType::Grayscale, BitDepth::Sixteen), &[1; 400]).unwrap();
        let ours = is_ours(&path);
        let bytes = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert!(ours);
        assert!(!begins_as_ours(b"\x89PNG and nothing else"));
        let picture = image::load_from_memory(&bytes).unwrap().into_luma16();
        assert_eq!((picture.width(), picture.get_pixel(3, 3).0), (20, [257]));
    }
}
