//! Small pictures, spread evenly over the run: every frame's, then every second's, so that they stay few however long it
//! is. With each comes a piece around the strongest target, in the pixels of the source.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::{FilterType, crop_imm, resize};
use image::{ExtendedColorType, RgbImage};
use serde::Serialize;

use super::super::overlay::tone::Tone;
use crate::sink::Seen;

/// Longest side, px.
const SIDE: u32 = 640;
/// Pictures, and bytes of them, that are kept at most. In the page they take a third more.
const MOST: usize = 400;
const BYTES: usize = 6 << 20;
/// Side of the piece, px of the source.
const PIECE: u32 = 41;
/// Of JPEG.
const QUALITY: u8 = 78;

struct Thumbnail {
    frame: usize,
    picture: Vec<u8>,
    piece: Option<Piece>,
}

struct Piece {
    left: u32,
    top: u32,
    side: u32,
    picture: Vec<u8>,
}

pub(super) struct Thumbnails {
    kept: Vec<Thumbnail>,
    bytes: usize,
    every: usize,
    came: usize,
    tone: Option<Tone>,
}

/// As the page takes it.
#[derive(Serialize)]
pub(super) struct Columns {
    frame: Vec<usize>,
    image: Vec<String>,
    piece: Vec<Option<PieceRecord>>,
}

#[derive(Serialize)]
struct PieceRecord {
    left: u32,
    top: u32,
    side: u32,
    image: String,
}

impl Thumbnails {
    pub fn new() -> Self {
        Self { kept: Vec::new(), bytes: 0, every: 1, came: 0, tone: None }
    }

    pub fn add(&mut self, seen: &Seen) {
        self.came += 1;
        if !(self.came - 1).is_multiple_of(self.every) {
            return;
        }
        let tone = self.tone.get_or_insert_with(|| Tone::of(&seen.picture));
        let picture = tone.render(&seen.picture);
        let piece = seen.detections.first().map(|found| piece(&picture, found.x, found.y));
        let thumbnail = Thumbnail { frame: seen.frame, picture: jpeg(&small(picture), QUALITY), piece };
        self.bytes += thumbnail.bytes();
        self.kept.push(thumbnail);
        while self.kept.len() > MOST || (self.bytes > BYTES && self.kept.len() > 1) {
            self.every *= 2;
            let mut index = 0;
            self.kept.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.bytes = self.kept.iter().map(Thumbnail::bytes).sum();
        }
    }

    pub fn count(&self) -> usize {
        self.kept.len()
    }

    pub fn columns(&self) -> Columns {
        let record = |piece: &Piece| PieceRecord {
            left: piece.left,
            top: piece.top,
            side: piece.side,
            image: address(&piece.picture),
        };
        Columns {
            frame: self.kept.iter().map(|kept| kept.frame).collect(),
            image: self.kept.iter().map(|kept| address(&kept.picture)).collect(),
            piece: self.kept.iter().map(|kept| kept.piece.as_ref().map(record)).collect(),
        }
    }
}

impl Thumbnail {
    fn bytes(&self) -> usize {
        self.picture.len() + self.piece.as_ref().map_or(0, |piece| piece.picture.len())
    }
}

fn address(jpeg: &[u8]) -> String {
    format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg))
}

fn jpeg(picture: &RgbImage, quality: u8) -> Vec<u8> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, quality)
        .encode(picture.as_raw(), picture.width(), picture.height(), ExtendedColorType::Rgb8)
        .expect("memory takes every picture, and JPEG every size up to 65,535");
    bytes
}

fn small(picture: RgbImage) -> RgbImage {
    let (width, height) = picture.dimensions();
    let longest = width.max(height);
    if longest <= SIDE {
        return picture;
    }
    let side = |length: u32| (length * SIDE / longest).max(1);
    resize(&picture, side(width), side(height), FilterType::Triangle)
}

fn piece(picture: &RgbImage, x: f32, y: f32) -> Piece {
    let side = PIECE.min(picture.width()).min(picture.height());
    let start = |centre: f32, length: u32| {
        let start = centre.round() - (side / 2) as f32;
        start.clamp(0.0, (length - side) as f32) as u32
    };
    let (left, top) = (start(x, picture.width()), start(y, picture.height()));
    let piece = crop_imm(picture, left, top, side, side).to_image();
    Piece { left, top, side, picture: jpeg(&piece, 92) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{Picture, Pixels};

    #[test]
    fn few_and_evenly_spread() {
        for frames in [1, 20, 400, 401, 5000] {
            let mut thumbnails = Thumbnails::new();
            for frame in 0..frames {
                let pixels = Pixels::U8(ndarray::Array3::from_elem((8, 8, 1), 90));
                thumbnails.add(&Seen::bare(frame, Picture { pixels, bits: None }));
            }
            let columns = thumbnails.columns();
            assert!(columns.frame.len() == frames.min(MOST) || (MOST / 2..=MOST).contains(&columns.frame.len()));
            assert!(columns.frame.iter().enumerate().all(|(index, frame)| *frame == index * thumbnails.every));
        }
    }

    #[test]
    fn bytes_are_bounded() {
        let mut thumbnails = Thumbnails::new();
        let noise = |x: usize, y: usize| ((x * 7919 + y * 104_729) % 251) as u8;
        for frame in 0..60 {
            let pixels = Pixels::U8(ndarray::Array3::from_shape_fn((400, 640, 1), |(y, x, _)| noise(x, y)));
            thumbnails.add(&Seen::bare(frame, Picture { pixels, bits: None }));
            assert!(thumbnails.bytes <= BYTES);
        }
        assert!(thumbnails.every > 1 && thumbnails.count() > 5);
    }
}
