//! YUV4MPEG2, as `ffmpeg -f yuv4mpegpipe` writes it: a header line, then for each frame a line and its planes. The Y
//! plane is used, the others are read over.

use std::io::{BufRead, Read};

use apgstmd_core::Size;

use super::Limit;
use super::samples::Layout;
use super::stream::{Parsed, read_frame};

const MAGIC: &[u8] = b"YUV4MPEG2";
/// Longer lines are no header.
const LONGEST: u64 = 4096;

/// What the header says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub size: Size,
    pub layout: Layout,
    /// Frames a second, where it tells.
    pub rate: Option<f64>,
    /// Bytes of a frame besides the Y plane.
    rest: usize,
}

impl Header {
    /// Reads the first line; none where nothing comes at all.
    ///
    /// # Errors
    /// It is none of ours, or of a kind that is not read.
    pub fn read(input: &mut impl BufRead, limit: Limit) -> Result<Option<Self>, String> {
        let Some(line) = line(input)? else { return Ok(None) };
        let text = line.strip_prefix(MAGIC).ok_or_else(|| {
            let start: String = String::from_utf8_lossy(&line[..line.len().min(16)]).escape_debug().collect();
            format!("expected YUV4MPEG2, but it begins with `{start}`")
        })?;
        Self::parse(&String::from_utf8_lossy(text), limit).map(Some)
    }

    fn parse(text: &str, limit: Limit) -> Result<Self, String> {
        let (mut width, mut height, mut rate, mut colour, mut range) = (None, None, None, "420jpeg", None);
        for word in text.split_ascii_whitespace() {
            let Some((tag, value)) = word.split_at_checked(1) else { continue };
            match tag {
                "W" => width = value.parse().ok(),
                "H" => height = value.parse().ok(),
                "F" => rate = ratio(value),
                "C" => colour = value,
                "X" => range = value.strip_prefix("COLORRANGE=").or(range),
                _ => {}
            }
        }
        let (Some(width), Some(height)) = (width, height) else {
            return Err("its YUV4MPEG2 header has no width and height".to_owned());
        };
        let size = Size { height, width };
        limit.check(size)?;
        let (bits, chroma) = planes(colour, size)?;
        // Grey has always been full range, and so it is written to files; YUV is limited where nothing else is said.
        let limited = match range {
            Some("FULL") => false,
            Some("LIMITED") => true,
            _ => !colour.starts_with("mono"),
        };
        let layout = Layout { limited, ..Layout::grey(bits) };
        layout.bytes(size)?;
        Ok(Self { size, layout, rate, rest: chroma * layout.depth() })
    }

    /// The next frame.
    pub fn next(&self, input: &mut impl BufRead) -> Parsed {
        let Some(line) = line(input)? else { return Ok(None) };
        if !line.starts_with(b"FRAME") {
            return Err("expected the line FRAME where a frame begins: bytes are missing or too many".to_owned());
        }
        let cut = || "it ends behind the line FRAME".to_owned();
        let luma = read_frame(input, self.layout.bytes(self.size)?)?.ok_or_else(cut)?;
        let skipped = std::io::copy(&mut input.take(self.rest as u64), &mut std::io::sink());
        match skipped {
            Ok(skipped) if skipped == self.rest as u64 => self.layout.picture(self.size, luma).map(Some),
            Ok(skipped) => Err(format!("it ends in the middle of a frame: {skipped} of {} bytes of colour", self.rest)),
            Err(error) => Err(crate::failure::reason(&error)),
        }
    }
}

/// Bits of a sample, and samples besides Y.
fn planes(colour: &str, size: Size) -> Result<(u32, usize), String> {
    let unknown =
        || format!("its samples are of the kind `{colour}`, but mono, 420, 422, 444 and 411 of 8 to 16 bits are read");
    let half = |length: usize| length.div_ceil(2);
    let number = |text: &str| if text.is_empty() { Some(8) } else { text.parse().ok() };
    let (bits, chroma) = if let Some(bits) = colour.strip_prefix("mono") {
        (number(bits), Some(0))
    } else {
        let (kind, rest) = colour.split_at_checked(3).ok_or_else(unknown)?;
        // 420jpeg, 420mpeg2 and 420paldv differ in where the colour samples lie.
        let named = matches!((kind, rest), ("420", "jpeg" | "mpeg2" | "paldv") | ("444", "alpha"));
        let bits = if named { Some(8) } else { rest.strip_prefix('p').map_or_else(|| number(rest), number) };
        let Size { height, width } = size;
        let plane = match kind {
            "420" => half(width).checked_mul(half(height)),
            "422" => half(width).checked_mul(height),
            "411" => width.div_ceil(4).checked_mul(height),
            "444" => width.checked_mul(height),
            _ => return Err(unknown()),
        };
        let planes = if rest == "alpha" { 3 } else { 2 };
        (bits, plane.and_then(|plane| plane.checked_mul(planes)))
    };
    match (bits.filter(|bits| (8..=16).contains(bits)), chroma.filter(|chroma| *chroma < 1 << 40)) {
        (Some(bits), Some(chroma)) => Ok((bits, chroma)),
        _ => Err(unknown()),
    }
}

/// `30000:1001`; 0:0 is not known.
fn ratio(text: &str) -> Option<f64> {
    let (above, below) = text.split_once(':')?;
    let rate = above.parse::<f64>().ok()? / below.parse::<f64>().ok()?;
    (rate.is_finite() && rate > 0.0).then_some(rate)
}

/// Without its end; none at the end of the input.
fn line(input: &mut impl BufRead) -> Result<Option<Vec<u8>>, String> {
    let mut line = Vec::new();
    input.take(LONGEST).read_until(b'\n', &mut line).map_err(|error| crate::failure::reason(&error))?;
    if line.last() == Some(&b'\n') {
        line.pop();
    }
    Ok(if line.is_empty() && input.fill_buf().is_ok_and(<[u8]>::is_empty) { None } else { Some(line) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(text: &str) -> Result<Header, String> {
        Header::read(&mut format!("YUV4MPEG2 {text}\n").as_bytes(), Limit::default()).map(Option::unwrap)
    }

    #[test]
    fn headers_as_ffmpeg_writes_them() {
        let grey = header("W94 H62 F30000:1001 Ip A1:1 Cmono XCOLORRANGE=FULL").unwrap();
        assert_eq!((grey.size, grey.layout, grey.rest), (Size::new(62, 94), Layout::grey(8), 0));
        assert!((grey.rate.unwrap() - 29.97).abs() < 1e-3);
        let limited = |bits| Layout { limited: true, ..Layout::grey(bits) };
        for (text, layout, rest) in [
            ("C420jpeg XYSCSS=420JPEG", limited(8), 2 * 3 * 2),
            ("C420mpeg2 XCOLORRANGE=FULL", Layout::grey(8), 12),
            ("", limited(8), 12),
            ("C420p10 XYSCSS=420P10 XCOLORRANGE=LIMITED", limited(10), 24),
            ("C422", limited(8), 2 * 3 * 3),
            ("C444p12", limited(12), 60),
            ("C411", limited(8), 2 * 2 * 3),
            ("C444alpha", limited(8), 45),
            ("Cmono10", Layout::grey(10), 0),
            ("Cmono16 XCOLORRANGE=FULL", Layout::grey(16), 0),
            ("Cmono XCOLORRANGE=LIMITED", limited(8), 0),
        ] {
            let header = header(&format!("W5 H3 F0:0 {text}")).unwrap();
            assert_eq!((header.layout, header.rest, header.rate), (layout, rest, None), "{text}");
        }
    }

    #[test]
    fn headers_that_are_none() {
        for bad in [
            "W5",
            "H3",
            "W0 H3",
            "W-1 H3",
            "W5 H3 C410",
            "W5 H3 C420p7",
            "W5 H3 Cmono17",
            "W5 H3 Cx",
            "W9999999 H9999999",
        ] {
            assert!(header(bad).is_err(), "{bad}");
        }
        assert_eq!(Header::read(&mut &b""[..], Limit::default()), Ok(None));
        let error = Header::read(&mut &b"\x89PNG\r\n..."[..], Limit::default()).unwrap_err();
        assert!(error.contains("PNG") && error.contains("YUV4MPEG2"), "{error}");
        assert!(Header::read(&mut &[b'x'; 10_000][..], Limit::default()).is_err());
    }

    #[test]
    fn frames_and_their_colour() {
        let text = b"YUV4MPEG2 W2 H2 F25:1 C420 XCOLORRANGE=FULL\nFRAME\n\x01\x02\x03\x04uvFRAME Ip\n\x05\x06\x07\x08uvFRAME\n\x01\x02\x03\x04u";
        let mut input = &text[..];
        let header = Header::read(&mut input, Limit::default()).unwrap().unwrap();
        for first in [1, 5] {
            let picture = header.next(&mut input).unwrap().unwrap();
            assert_eq!(picture, header.layout.picture(header.size, (first..first + 4).collect()).unwrap());
        }
        assert!(header.next(&mut input).unwrap_err().contains("in the middle"));
        assert!(header.next(&mut &b"FRAM"[..]).is_err());
        assert!(header.next(&mut &b"FRAME\n"[..]).is_err());
        assert!(header.next(&mut &b"FRAME\n\x01"[..]).is_err());
        assert_eq!(header.next(&mut &b""[..]), Ok(None));
    }
}
