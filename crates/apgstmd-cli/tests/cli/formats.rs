//! Every picture format, written here, read by the program: the moving square is found in each.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::Path;

use crate::common::{HEIGHT, WIDTH, apgstmd, assert_found, csv_rows, picture, results};
use image::{DynamicImage, GrayAlphaImage, GrayImage, ImageBuffer, Luma, Rgb, RgbImage, RgbaImage};
use tiff::encoder::{TiffEncoder, colortype};

const FRAMES: usize = 36;

/// Writes all frames with `write`, runs, checks the place. `flags` go to the program.
fn found_in(ending: &str, flags: &str, write: impl Fn(&GrayImage, &Path)) {
    let folder = tempfile::tempdir().unwrap();
    for frame in 0..FRAMES {
        write(&picture(frame), &folder.path().join(format!("f{frame}.{ending}")));
    }
    let (_parent, out) = results();
    let ran = apgstmd(&format!("run {{in}} --out {{out}} --speed 1 {flags}"), folder.path(), &out);
    let ran = ran.ok();
    assert!(ran.stdout.is_empty(), "{}", ran.stdout);
    let rows = csv_rows(&out.join("detections.csv"));
    assert_found(&rows, FRAMES - 1);
    assert_eq!(rows.last().unwrap().name, format!("f{}.{ending}", FRAMES - 1));
}

fn wide(grey: &GrayImage, scale: u16) -> ImageBuffer<Luma<u16>, Vec<u16>> {
    ImageBuffer::from_fn(WIDTH, HEIGHT, |x, y| Luma([u16::from(grey.get_pixel(x, y).0[0]) * scale]))
}

fn colour(grey: &GrayImage) -> RgbImage {
    DynamicImage::from(grey.clone()).into_rgb8()
}

fn tiff<C: colortype::ColorType>(path: &Path, samples: &[C::Inner])
where
    [C::Inner]: tiff::encoder::TiffValue,
{
    let mut encoder = TiffEncoder::new(BufWriter::new(File::create(path).unwrap())).unwrap();
    encoder.write_image::<C>(WIDTH, HEIGHT, samples).unwrap();
}

#[test]
fn png_grey_8() {
    found_in("png", "", |grey, path| grey.save(path).unwrap());
}

#[test]
fn png_grey_16() {
    found_in("png", "", |grey, path| wide(grey, 257).save(path).unwrap());
}

#[test]
fn png_grey_12_in_16() {
    found_in("png", "--bit-depth 12", |grey, path| wide(grey, 16).save(path).unwrap());
}

#[test]
fn png_grey_with_alpha() {
    found_in("png", "", |grey, path| {
        GrayAlphaImage::from_fn(WIDTH, HEIGHT, |x, y| image::LumaA([grey.get_pixel(x, y).0[0], x as u8]))
            .save(path)
            .unwrap();
    });
}

#[test]
fn png_rgb() {
    found_in("png", "", |grey, path| colour(grey).save(path).unwrap());
}

#[test]
fn png_rgb_16() {
    found_in("png", "", |grey, path| DynamicImage::from(grey.clone()).into_rgb16().save(path).unwrap());
}

#[test]
fn png_rgba() {
    found_in("png", "", |grey, path| {
        let pixel = |x, y| {
            let level = grey.get_pixel(x, y).0[0];
            image::Rgba([level, level, level, (x + y) as u8])
        };
        RgbaImage::from_fn(WIDTH, HEIGHT, pixel).save(path).unwrap();
    });
}

#[test]
fn png_palette() {
    found_in("png", "", |grey, path| {
        let mut encoder = png::Encoder::new(BufWriter::new(File::create(path).unwrap()), WIDTH, HEIGHT);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_palette(vec![220, 220, 220, 20, 20, 20]);
        let indices: Vec<u8> = grey.as_raw().iter().map(|level| u8::from(*level < 100)).collect();
        encoder.write_header().unwrap().write_image_data(&indices).unwrap();
    });
}

#[test]
fn jpeg() {
    found_in("jpg", "", |grey, path| colour(grey).save(path).unwrap());
    found_in("JPEG", "", |grey, path| grey.save_with_format(path, image::ImageFormat::Jpeg).unwrap());
}

#[test]
fn tiff_8_and_16() {
    found_in("tif", "", |grey, path| grey.save(path).unwrap());
    found_in("tiff", "", |grey, path| wide(grey, 257).save(path).unwrap());
    found_in("tif", "--bit-depth 14", |grey, path| wide(grey, 64).save(path).unwrap());
    found_in("tif", "", |grey, path| colour(grey).save(path).unwrap());
}

#[test]
fn tiff_float() {
    found_in("tif", "", |grey, path| {
        let samples: Vec<f32> = grey.as_raw().iter().map(|level| f32::from(*level) / 255.0).collect();
        tiff::<colortype::Gray32Float>(path, &samples);
    });
    found_in("tif", "", |grey, path| {
        let samples: Vec<f64> = grey.as_raw().iter().map(|level| f64::from(*level) / 255.0).collect();
        tiff::<colortype::Gray64Float>(path, &samples);
    });
    found_in("tif", "", |grey, path| {
        let samples: Vec<f32> = grey.as_raw().iter().flat_map(|level| [f32::from(*level) / 255.0; 3]).collect();
        tiff::<colortype::RGB32Float>(path, &samples);
    });
}

#[test]
fn bmp() {
    found_in("bmp", "", |grey, path| grey.save(path).unwrap());
    found_in("bmp", "", |grey, path| colour(grey).save(path).unwrap());
}

#[test]
fn pgm_and_ppm() {
    found_in("pgm", "", |grey, path| grey.save(path).unwrap());
    found_in("ppm", "", |grey, path| colour(grey).save(path).unwrap());
    found_in("ppm", "", |grey, path| {
        let rgb: ImageBuffer<Rgb<u16>, _> = DynamicImage::from(grey.clone()).into_rgb16();
        let mut bytes = format!("P6 {WIDTH} {HEIGHT} 65535\n").into_bytes();
        bytes.extend(rgb.as_raw().iter().flat_map(|sample| sample.to_be_bytes()));
        fs::write(path, bytes).unwrap();
    });
}

/// The file says what white is; saying it again by --bit-depth changes nothing.
#[test]
fn pgm_16_and_12() {
    let write = |most: u16| {
        move |grey: &GrayImage, path: &Path| {
            let mut bytes = format!("P5\n{WIDTH} {HEIGHT}\n{most}\n").into_bytes();
            let scaled = |level: &u8| (f64::from(*level) / 255.0 * f64::from(most)) as u16;
            bytes.extend(grey.as_raw().iter().flat_map(|level| scaled(level).to_be_bytes()));
            fs::write(path, bytes).unwrap();
        }
    };
    found_in("pgm", "", write(65535));
    found_in("pgm", "", write(4095));
    found_in("pgm", "--bit-depth 12", write(4095));
}

/// The same luminance gives the same numbers, whatever the file: 16-bit, float and palette agree with 8-bit.
#[test]
fn formats_agree_on_luminance() {
    let dump = |write: &dyn Fn(&GrayImage, &Path), ending: &str| {
        let folder = tempfile::tempdir().unwrap();
        write(&picture(3), &folder.path().join(format!("a.{ending}")));
        let (_parent, out) = results();
        apgstmd("run {in} --out {out} --dump P", folder.path(), &out).ok();
        let bytes = fs::read(out.join("dump/P_000000.npy")).unwrap();
        let body = bytes.len() - (WIDTH * HEIGHT * 4) as usize;
        bytes[body..].chunks(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect::<Vec<f32>>()
    };
    let reference = dump(&|grey, path| grey.save(path).unwrap(), "png");
    assert!((reference[0] - 220.0 / 255.0).abs() < 1e-6, "{}", reference[0]);
    let wide_png = dump(&|grey, path| wide(grey, 257).save(path).unwrap(), "png");
    let float = dump(
        &|grey, path| {
            let samples: Vec<f32> = grey.as_raw().iter().map(|level| f32::from(*level) / 255.0).collect();
            tiff::<colortype::Gray32Float>(path, &samples);
        },
        "tif",
    );
    let rgb = dump(&|grey, path| colour(grey).save(path).unwrap(), "bmp");
    for other in [wide_png, float, rgb] {
        let worst = reference.iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-6, "{worst}");
    }
}
