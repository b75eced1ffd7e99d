//! A picture file to samples, at the precision the file has.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use apgstmd_core::MOST_PIXELS;
use image::codecs::pnm::PnmDecoder;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use ndarray::{Array3, s};
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

use super::{Picture, Pixels};
use crate::failure::reason;

/// A file may claim any size in its header: this much memory is the most a picture gets.
const MOST_BYTES: u64 = 1 << 31;

/// Reads a picture; the error says why it cannot be used.
pub(super) fn read(path: &Path, bit_depth: Option<u32>) -> Result<Picture, String> {
    let length = fs::metadata(path).map_err(|error| reason(&error))?.len();
    if length > MOST_BYTES {
        return Err(format!("the file has {length} bytes, more than a picture may"));
    }
    let bytes = fs::read(path).map_err(|error| reason(&error))?;
    if bytes.is_empty() {
        return Err("the file is empty".to_owned());
    }
    let format = image::guess_format(&bytes).map_err(|_| "it is no PNG, JPEG, TIFF, BMP, PGM or PPM".to_owned())?;
    let (pixels, scaled) = match format {
        ImageFormat::Tiff => (tiff(&bytes)?, false),
        ImageFormat::Pnm => pnm(&bytes)?,
        ImageFormat::Jpeg if is_cut_short(&bytes) => return Err("the file is truncated".to_owned()),
        _ => (with_image(&bytes, format)?, false),
    };
    let bits = match (&pixels, bit_depth) {
        (Pixels::U8(_), Some(bits)) => {
            return Err(format!("its samples have 8 bits, but --bit-depth {bits} was given: leave that out"));
        }
        (Pixels::U16(_), Some(_)) if !scaled => bit_depth,
        _ => None,
    };
    Ok(Picture { pixels, bits })
}

fn with_image(bytes: &[u8], format: ImageFormat) -> Result<Pixels, String> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits());
    let decoder = reader.into_decoder().map_err(explain)?;
    check_size(decoder.dimensions())?;
    samples(DynamicImage::from_decoder(decoder).map_err(explain)?)
}

/// PGM and PPM state their own maximum: `image` scales samples to it, so the bit depth is known already.
fn pnm(bytes: &[u8]) -> Result<(Pixels, bool), String> {
    let decoder = PnmDecoder::new(Cursor::new(bytes)).map_err(explain)?;
    check_size(decoder.dimensions())?;
    let scaled = decoder.header().maximal_sample() != u32::from(u16::MAX);
    Ok((samples(DynamicImage::from_decoder(decoder).map_err(explain)?)?, scaled))
}

fn tiff(bytes: &[u8]) -> Result<Pixels, String> {
    let failed = |error: tiff::TiffError| tiff_reason(&error);
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(failed)?;
    check_size(decoder.dimensions().map_err(failed)?)?;
    if decoder.more_images() {
        return Err("it holds several pages: give each page a file of its own (tiffsplit does that)".to_owned());
    }
    const IEEE_FLOAT: u16 = 3;
    let formats = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat).map_err(failed)?.unwrap_or_default();
    if !formats.contains(&IEEE_FLOAT) {
        return with_image(bytes, ImageFormat::Tiff);
    }
    let (width, height) = decoder.dimensions().map_err(failed)?;
    let channels = match decoder.colortype().map_err(failed)? {
        ColorType::Gray(_) => 1,
        ColorType::RGB(_) => 3,
        ColorType::RGBA(_) => 4,
        other => return Err(format!("a float TIFF must be grey, RGB or RGBA, this is {other:?}")),
    };
    const PLANES_APART: u32 = 2;
    let layout = decoder.find_tag_unsigned::<u32>(Tag::PlanarConfiguration).map_err(failed)?;
    if channels > 1 && layout == Some(PLANES_APART) {
        return Err("a float TIFF with its colours in separate planes is not read".to_owned());
    }
    let mut limits = tiff::decoder::Limits::default();
    limits.decoding_buffer_size = MOST_BYTES as usize;
    let shape = (height as usize, width as usize, channels);
    match decoder.with_limits(limits).read_image().map_err(failed)? {
        DecodingResult::F16(samples) => array(shape, samples.into_iter().map(f32::from).collect()).map(Pixels::F32),
        DecodingResult::F32(samples) => array(shape, samples).map(Pixels::F32),
        DecodingResult::F64(samples) => array(shape, samples).map(Pixels::F64),
        _ => Err("its samples are neither integers nor floats".to_owned()),
    }
}

fn array<T>(shape: (usize, usize, usize), samples: Vec<T>) -> Result<Array3<T>, String> {
    Array3::from_shape_vec(shape, samples).map_err(|_| "it holds another number of samples than it claims".to_owned())
}

fn samples(picture: DynamicImage) -> Result<Pixels, String> {
    let shape = |channels| (picture.height() as usize, picture.width() as usize, channels);
    let (one, two, three, four) = (shape(1), shape(2), shape(3), shape(4));
    match picture {
        DynamicImage::ImageLuma8(image) => array(one, image.into_raw()).map(Pixels::U8),
        DynamicImage::ImageLumaA8(image) => array(two, image.into_raw()).map(|all| Pixels::U8(without_alpha(&all))),
        DynamicImage::ImageRgb8(image) => array(three, image.into_raw()).map(Pixels::U8),
        DynamicImage::ImageRgba8(image) => array(four, image.into_raw()).map(Pixels::U8),
        DynamicImage::ImageLuma16(image) => array(one, image.into_raw()).map(Pixels::U16),
        DynamicImage::ImageLumaA16(image) => array(two, image.into_raw()).map(|all| Pixels::U16(without_alpha(&all))),
        DynamicImage::ImageRgb16(image) => array(three, image.into_raw()).map(Pixels::U16),
        DynamicImage::ImageRgba16(image) => array(four, image.into_raw()).map(Pixels::U16),
        DynamicImage::ImageRgb32F(image) => array(three, image.into_raw()).map(Pixels::F32),
        DynamicImage::ImageRgba32F(image) => array(four, image.into_raw()).map(Pixels::F32),
        _ => Err("its sample type is not read".to_owned()),
    }
}

fn without_alpha<T: Clone>(grey_and_alpha: &Array3<T>) -> Array3<T> {
    grey_and_alpha.slice(s![.., .., ..1]).to_owned()
}

fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_alloc = Some(MOST_BYTES);
    limits
}

fn check_size((width, height): (u32, u32)) -> Result<(), String> {
    if u64::from(width) * u64::from(height) > MOST_PIXELS as u64 {
        return Err(format!(
            "it claims to be {height} x {width} (height x width): at most {MOST_PIXELS} pixels are read"
        ));
    }
    Ok(())
}

/// The JPEG decoder fills what is missing with grey and says nothing, so look for the end marker behind the last scan.
/// (Neither marker can occur inside the coded data.)
fn is_cut_short(bytes: &[u8]) -> bool {
    let last = |marker: [u8; 2]| bytes.windows(2).rposition(|pair| pair == marker);
    last([0xff, 0xd9]) < last([0xff, 0xda])
}

fn explain(error: image::ImageError) -> String {
    match &error {
        image::ImageError::IoError(inner) => io_reason(inner),
        image::ImageError::Limits(_) => "its header claims a size beyond the limit of what is read".to_owned(),
        _ if error.to_string().contains("end of") => "the file is truncated".to_owned(),
        _ => error.to_string(),
    }
}

fn tiff_reason(error: &tiff::TiffError) -> String {
    match error {
        tiff::TiffError::IoError(inner) => io_reason(inner),
        tiff::TiffError::LimitsExceeded => "its header claims a size beyond the limit of what is read".to_owned(),
        _ => error.to_string(),
    }
}

fn io_reason(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::UnexpectedEof => "the file is truncated".to_owned(),
        _ => reason(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_jpeg_without_its_end_is_cut_short() {
        let whole = [0xff, 0xd8, 0xff, 0xda, 1, 2, 3, 0xff, 0xd9];
        assert!(!is_cut_short(&whole));
        assert!(is_cut_short(&whole[..7]));
        let thumbnail = [0xff, 0xd8, 0xff, 0xda, 1, 0xff, 0xd9, 0xff, 0xda, 1];
        assert!(is_cut_short(&thumbnail));
    }
}
