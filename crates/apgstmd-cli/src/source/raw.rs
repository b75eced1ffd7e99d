//! `--raw WxH[:FORMAT]`: grey frames one after the other, and nothing else.

use std::io::Read;
use std::str::FromStr;

use apgstmd_core::Size;

use super::samples::Layout;
use super::stream::{Parsed, read_frame};

/// Formats with their bits, named as `ffmpeg -pix_fmt` has them.
const FORMATS: [(&str, u32); 5] = [("gray", 8), ("gray10le", 10), ("gray12le", 12), ("gray14le", 14), ("gray16le", 16)];

/// What raw bytes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawFormat {
    /// Rows and columns.
    pub(super) size: Size,
    pub(super) layout: Layout,
}

impl FromStr for RawFormat {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = FORMATS.map(|(name, _)| name).join(", ");
        let (size, format) = text.split_once(':').unwrap_or((text, "gray"));
        let bits = FORMATS.iter().find(|(name, _)| *name == format).map(|(_, bits)| *bits);
        let bits = bits.ok_or_else(|| format!("there is no raw format `{format}`, but {names}"))?;
        let layout = Layout::grey(bits);
        let size = size.split_once('x').and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
        let (width, height) = size.ok_or("expected width x height and perhaps a format, such as 640x512:gray16le")?;
        let size = Size { height, width };
        layout.bytes(size)?;
        Ok(Self { size, layout })
    }
}

/// The next frame.
pub(super) fn next(format: RawFormat, input: &mut impl Read) -> Parsed {
    let bytes = format.layout.bytes(format.size)?;
    match read_frame(input, bytes)? {
        Some(samples) => format.layout.picture(format.size, samples).map(Some),
        None => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats() {
        let format: RawFormat = "640x512:gray14le".parse().unwrap();
        assert_eq!((format.size, format.layout), (Size::new(512, 640), Layout::grey(14)));
        assert_eq!("4x3".parse::<RawFormat>().unwrap().layout, Layout::grey(8));
        for bad in ["", "640", "640x", "x512", "640x512:", "640x512:rgb24", "0x5", "-1x5", "99999999x99999999"] {
            assert!(bad.parse::<RawFormat>().is_err(), "{bad}");
        }
    }

    #[test]
    fn frames_and_a_piece() {
        let format: RawFormat = "2x2:gray16le".parse().unwrap();
        let bytes = [0u8; 20];
        let mut input = &bytes[..];
        assert!(next(format, &mut input).unwrap().is_some() && next(format, &mut input).unwrap().is_some());
        let error = next(format, &mut input).unwrap_err();
        assert!(error.contains("4 of 8 bytes"), "{error}");
        assert_eq!(next(format, &mut &bytes[..0]).unwrap(), None);
    }
}
