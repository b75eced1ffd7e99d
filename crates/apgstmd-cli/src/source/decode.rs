//! A picture file to samples, at the precision the file has.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use apgstmd_core::Size;
use image::codecs::pnm::PnmDecoder;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use ndarray::{Array3, s};
use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

use super::{Limit, Picture, Pixels};
use crate::failure::reason;

/// Reads a picture; the error says why it cannot be used.
pub(super) fn read(path: &Path, bit_depth: Option<u32>, limit: Limit) -> Result<Picture, String> {
    let file = fs::metadata(path).map_err(|error| reason(&error))?;
    // A device or a pipe may never end.
    if !file.is_file() {
        return Err("it is no file".to_owned());
    }
    let length = file.len();
    if length > limit.bytes() {
        return Err(format!("the file has {length} bytes, but {}", limit.rule()));
    }
    from_bytes(&fs::read(path).map_err(|error| reason(&error))?, bit_depth, limit)
}

/// The picture that the bytes of a file are.
pub(super) fn from_bytes(bytes: &[u8], bit_depth: Option<u32>, limit: Limit) -> Result<Picture, String> {
    if bytes.is_empty() {
        return Err("the file is empty".to_owned());
    }
    let format = image::guess_format(bytes).map_err(|_| "it is no PNG, JPEG, TIFF, BMP, PGM or PPM".to_owned())?;
    let (pixels, scaled) = match format {
        ImageFormat::Tiff => (tiff(bytes, limit)?, false),
        ImageFormat::Pnm => pnm(bytes, limit)?,
        ImageFormat::Jpeg if is_cut_short(bytes) => return Err("the file is truncated".to_owned()),
        _ => (with_image(bytes, format, limit)?, false),
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

fn with_image(bytes: &[u8], format: ImageFormat, limit: Limit) -> Result<Pixels, String> {
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limits(limit));
    let decoder = reader.into_decoder().map_err(|error| explain(error, limit))?;
    check_size(decoder.dimensions(), limit)?;
    samples(DynamicImage::from_decoder(decoder).map_err(|error| explain(error, limit))?)
}

/// PGM and PPM state their own maximum: `image` scales samples to it, so the bit depth is known already.
fn pnm(bytes: &[u8], limit: Limit) -> Result<(Pixels, bool), String> {
    let decoder = PnmDecoder::new(Cursor::new(bytes)).map_err(|error| explain(error, limit))?;
    check_size(decoder.dimensions(), limit)?;
    let scaled = decoder.header().maximal_sample() != u32::from(u16::MAX);
    Ok((samples(DynamicImage::from_decoder(decoder).map_err(|error| explain(error, limit))?)?, scaled))
}

fn tiff(bytes: &[u8], limit: Limit) -> Result<Pixels, String> {
    let failed = |error: tiff::TiffError| tiff_reason(&error, limit);
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(failed)?;
    check_size(decoder.dimensions().map_err(failed)?, limit)?;
    if decoder.more_images() {
        return Err("it holds several pages: give each page a file of its own (tiffsplit does that)".to_owned());
    }
    const IEEE_FLOAT: u16 = 3;
    let formats = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat).map_err(failed)?.unwrap_or_default();
    if !formats.contains(&IEEE_FLOAT) {
        return with_image(bytes, ImageFormat::Tiff, limit);
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
    limits.decoding_buffer_size = limit.bytes() as usize;
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

fn limits(limit: Limit) -> Limits {
    let mut limits = Limits::default();
    limits.max_alloc = Some(limit.bytes());
    limits
}

fn check_size((width, height): (u32, u32), limit: Limit) -> Result<(), String> {
    limit.check(Size::new(height as usize, width as usize))
}

/// The JPEG decoder fills what is missing with grey and says nothing, so look for the end marker behind the last scan.
/// (Neither marker can occur inside the coded data.)
fn is_cut_short(bytes: &[u8]) -> bool {
    let last = |marker: [u8; 2]| bytes.windows(2).rposition(|pair| pair == marker);
    last([0xff, 0xd9]) < last([0xff, 0xda])
}

fn explain(error: image::ImageError, limit: Limit) -> String {
    match &error {
        image::ImageError::IoError(inner) => io_reason(inner),
        image::ImageError::Limits(_) => format!("it takes more memory than a picture may: {}", limit.rule()),
        _ if error.to_string().contains("end of") => "the file is truncated".to_owned(),
        _ => error.to_string(),
    }
}

fn tiff_reason(error: &tiff::TiffError, limit: Limit) -> String {
    match error {
        tiff::TiffError::IoError(inner) => io_reason(inner),
        tiff::TiffError::LimitsExceeded => format!("it takes more memory than a picture may: {}", limit.rule()),
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
