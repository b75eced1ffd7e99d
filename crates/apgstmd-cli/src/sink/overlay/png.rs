//! PNG files with our mark in them, so that `--force` can tell them from the user's own.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::canvas::Canvas;

const MARK: &str = concat!("apgstmd ", env!("CARGO_PKG_VERSION"));

/// Writes the canvas without its alpha.
pub(super) fn write(path: &Path, canvas: &Canvas) -> io::Result<()> {
    let mut out = BufWriter::new(File::create(path)?);
    let mut encoder = png::Encoder::new(&mut out, canvas.width(), canvas.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    encoder.add_text_chunk("Software".to_owned(), MARK.to_owned()).map_err(io::Error::from)?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&canvas.rgb())?;
    writer.finish()?;
    out.flush()
}

/// Whether a file that begins like this is one of ours. The mark stands right behind the header.
pub fn is_overlay(head: &[u8]) -> bool {
    const TEXT: &[u8] = b"tEXtSoftware\0apgstmd ";
    head.starts_with(b"\x89PNG") && head.windows(TEXT.len()).any(|window| window == TEXT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_pictures_are_known() {
        let path = std::env::temp_dir().join(format!("apgstmd-mark-{}.png", std::process::id()));
        write(&path, &Canvas::new(20, 10)).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert!(is_overlay(&bytes[..bytes.len().min(256)]));
        assert!(!is_overlay(b"\x89PNG and nothing else"));
        assert_eq!(image::load_from_memory(&bytes).unwrap().width(), 20);
    }
}
