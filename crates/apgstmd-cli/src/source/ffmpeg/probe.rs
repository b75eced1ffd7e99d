//! What ffprobe tells of a video before it is decoded: which samples it has, how many frames, how fast.

use std::ffi::OsString;
use std::time::Duration;

use serde::Deserialize;

use apgstmd_core::Size;

use super::Location;
use super::log::ratio;
use super::process::output;
use crate::Outcome;
use crate::failure::Failure;
use crate::source::samples::{Colour, Layout};

/// What is known of a video.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Probed {
    pub format: Format,
    /// Frames a second, on average.
    pub rate: Option<f64>,
    /// Frames, about.
    pub frames: Option<usize>,
    /// Frames that its header says it has.
    pub claimed: Option<usize>,
    /// Of a frame, as its header says.
    pub size: Option<Size>,
}

/// How its frames are to be handed over.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Format {
    pub layout: Layout,
    /// ffmpeg's name of the layout.
    pub pixels: String,
    /// The filter that makes it, without touching a sample of grey or Y.
    pub filter: String,
}

#[derive(Deserialize)]
struct Told {
    #[serde(default)]
    streams: Vec<Stream>,
    #[serde(default)]
    format: Container,
}

#[derive(Deserialize)]
struct Stream {
    width: Option<usize>,
    height: Option<usize>,
    pix_fmt: Option<String>,
    color_range: Option<String>,
    avg_frame_rate: Option<String>,
    r_frame_rate: Option<String>,
    nb_frames: Option<String>,
    duration: Option<String>,
}

#[derive(Default, Deserialize)]
struct Container {
    format_name: Option<String>,
    format_long_name: Option<String>,
    duration: Option<String>,
}

/// Asks ffprobe.
///
/// # Errors
/// There is no ffprobe; it cannot read this; there is no video in it.
pub(super) fn probe(location: &Location, limit: Option<Duration>) -> Outcome<Probed> {
    let entries = "stream=width,height,pix_fmt,color_range,avg_frame_rate,r_frame_rate,nb_frames,duration:\
         format=format_name,format_long_name,duration";
    let mut arguments: Vec<OsString> =
        ["-hide_banner", "-loglevel", "repeat+level+error", "-of", "json"].map(OsString::from).into();
    // V: a cover of a music file is no video.
    arguments.extend(["-select_streams", "V:0", "-show_entries", entries].map(OsString::from));
    arguments.extend(location.arguments());
    let unusable = || Failure::failed(format_args!("cannot read {}: ffprobe said nothing of use", location.shown()));
    let told: Told =
        serde_json::from_slice(&output("ffprobe", &arguments, location, limit)?).map_err(|_| unusable())?;
    only_what_was_named(location, told.format.format_name.as_deref().unwrap_or_default())?;
    let Some(stream) = told.streams.first() else {
        let kind = told.format.format_long_name.map_or(String::new(), |kind| format!(" (it is {kind})"));
        return Err(Failure::failed(format_args!("there is no video in {}{kind}", location.shown())));
    };
    let pixels = stream.pix_fmt.as_deref().ok_or_else(|| {
        Failure::failed(format_args!("cannot read {}: ffmpeg cannot tell what its pixels are", location.shown()))
    })?;
    let rate = [&stream.avg_frame_rate, &stream.r_frame_rate].into_iter().flatten().find_map(|rate| ratio(rate));
    let number = |text: &Option<String>| text.as_ref().and_then(|text| text.parse::<f64>().ok());
    let duration = number(&stream.duration).or_else(|| number(&told.format.duration));
    // Only headers say so: they may claim anything.
    let usable = |frames: f64| (1.0..1e8).contains(&frames).then_some(frames.round() as usize);
    let claimed = number(&stream.nb_frames).and_then(usable);
    let frames = claimed.or_else(|| duration.zip(rate).and_then(|(duration, rate)| usable(duration * rate)));
    let size = stream.height.zip(stream.width).map(|(height, width)| Size { height, width });
    Ok(Probed { format: Format::of(pixels, stream.color_range.as_deref()), rate, frames, claimed, size })
}

/// A file that names other files is no video: who was sent one does not know what it opens.
fn only_what_was_named(location: &Location, format: &str) -> Outcome {
    const NAME_OTHERS: [&str; 8] = ["hls", "concat", "dash", "sdp", "rtsp", "imf", "image2", "lavfi"];
    let Location::File(file) = location else { return Ok(()) };
    match format.split(',').find(|name| NAME_OTHERS.contains(name)) {
        None => Ok(()),
        Some(name) => Err(Failure::failed(format_args!(
            "{} is a list of other files ({name}), but only a file that you name is opened",
            file.display()
        ))
        .hint("name the video itself; ffmpeg joins parts: ffmpeg -i LIST -c copy VIDEO.mkv")),
    }
}

impl Format {
    /// For ffmpeg's name of a pixel format and what the stream says of its range.
    fn of(pixels: &str, range: Option<&str>) -> Self {
        let name = pixels.strip_suffix("le").or_else(|| pixels.strip_suffix("be")).unwrap_or(pixels);
        let grey = |bits: u32| if bits == 8 { "gray".to_owned() } else { format!("gray{bits}le") };
        let plain = |layout, pixels: String| Self { layout, filter: format!("format=pix_fmts={pixels}"), pixels };
        let depth = bits(name);
        if name.starts_with("gray") && !name.starts_with("grayf") {
            // Like a grey picture: the full scale, unless the stream says otherwise.
            let layout = Layout { limited: range == Some("tv"), ..Layout::grey(depth) };
            return plain(layout, grey(depth));
        }
        if matches!(name, "monow" | "monob") {
            return plain(Layout::grey(8), grey(8));
        }
        let with_alpha = name.starts_with("ya") && depth != 0;
        if with_alpha || is_yuv(name) {
            let full = with_alpha || name.starts_with("yuvj") || range == Some("pc");
            let layout = Layout { limited: !full, ..Layout::grey(depth) };
            return Self { layout, filter: "extractplanes=planes=y".to_owned(), pixels: grey(depth) };
        }
        let (bits, pixels) = if depth > 8 { (16, "rgb48le") } else { (8, "rgb24") };
        plain(Layout { colour: Colour::Rgb, ..Layout::grey(bits) }, pixels.to_owned())
    }
}

fn is_yuv(name: &str) -> bool {
    let packed = ["yuyv422", "uyvy422", "yvyu422", "uyyvyy411", "vuya", "vuyx", "ayuv", "y210", "y212", "xv30", "xv36"];
    let two_planes = [
        "nv12", "nv16", "nv20", "nv21", "nv24", "nv42", "p010", "p012", "p016", "p210", "p212", "p216", "p410", "p412",
        "p416",
    ];
    name.starts_with("yuv") || packed.iter().any(|kind| name.starts_with(kind)) || two_planes.contains(&name)
}

/// Bits of a sample.
fn bits(name: &str) -> u32 {
    let digits = |text: &str| text.chars().take_while(char::is_ascii_digit).collect::<String>().parse::<u32>().ok();
    let known = match name {
        "nv20" | "p010" | "p210" | "p410" | "y210" | "xv30" | "x2rgb10" | "x2bgr10" => Some(10),
        "p012" | "p212" | "p412" | "y212" | "xv36" | "xyz12" => Some(12),
        "p016" | "p216" | "p416" | "ayuv64" | "rgb48" | "bgr48" | "rgba64" | "bgra64" => Some(16),
        "grayf32" => Some(16),
        _ if name.starts_with("gbr") && name.contains("pf") => Some(16),
        _ if name.starts_with("bayer_") => name.ends_with("16").then_some(16),
        _ => None,
    };
    let after = |mark: &str| name.split_once(mark).and_then(|(_, rest)| digits(rest));
    // gray12, ya16, yuv420p10, yuva444p12, gbrp14, gbrap16.
    let written = after("gray").or_else(|| name.strip_prefix("ya").and_then(digits)).or_else(|| {
        name.rsplit_once('p')
            .filter(|(kind, _)| kind.starts_with("yuv") || kind.starts_with("gbr"))
            .and_then(|(_, rest)| digits(rest))
    });
    known.or(written).filter(|bits| (8..=16).contains(bits)).unwrap_or(8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_by_name() {
        let limited = |bits| Layout { limited: true, ..Layout::grey(bits) };
        let rgb = |bits| Layout { colour: Colour::Rgb, ..Layout::grey(bits) };
        for (name, range, layout, pixels, y) in [
            ("gray", None, Layout::grey(8), "gray", false),
            ("gray", Some("pc"), Layout::grey(8), "gray", false),
            ("gray", Some("tv"), limited(8), "gray", false),
            ("gray10le", None, Layout::grey(10), "gray10le", false),
            ("gray14be", None, Layout::grey(14), "gray14le", false),
            ("gray16le", Some("pc"), Layout::grey(16), "gray16le", false),
            ("ya8", None, Layout::grey(8), "gray", true),
            ("ya16be", None, Layout::grey(16), "gray16le", true),
            ("yuv420p", None, limited(8), "gray", true),
            ("yuv420p", Some("tv"), limited(8), "gray", true),
            ("yuv420p", Some("pc"), Layout::grey(8), "gray", true),
            ("yuvj422p", Some("pc"), Layout::grey(8), "gray", true),
            ("yuv422p10le", Some("tv"), limited(10), "gray10le", true),
            ("yuva444p12be", None, limited(12), "gray12le", true),
            ("yuv420p16le", Some("pc"), Layout::grey(16), "gray16le", true),
            ("nv12", None, limited(8), "gray", true),
            ("p010le", Some("tv"), limited(10), "gray10le", true),
            ("yuyv422", None, limited(8), "gray", true),
            ("rgb24", None, rgb(8), "rgb24", false),
            ("bgra", None, rgb(8), "rgb24", false),
            ("pal8", None, rgb(8), "rgb24", false),
            ("gbrp", None, rgb(8), "rgb24", false),
            ("gbrp10le", None, rgb(16), "rgb48le", false),
            ("rgb48be", None, rgb(16), "rgb48le", false),
            ("monob", None, Layout::grey(8), "gray", false),
            ("grayf32le", None, rgb(16), "rgb48le", false),
            ("something new", None, rgb(8), "rgb24", false),
        ] {
            let format = Format::of(name, range);
            assert_eq!((format.layout, &*format.pixels), (layout, pixels), "{name}");
            assert_eq!(format.filter.contains("extractplanes"), y, "{name}");
        }
    }
}
