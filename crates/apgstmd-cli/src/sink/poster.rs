//! One small picture of a run, for a list of many: the frame with the strongest detection, ringed.

use std::path::{Path, PathBuf};

use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;
use image::imageops::{FilterType, resize};

use super::overlay::annotate::colour;
use super::overlay::canvas::Canvas;
use super::overlay::tone::Tone;
use super::{Seen, Sink};
use crate::Outcome;
use crate::failure::Failure;

/// Longest side, px.
const SIDE: u32 = 240;
/// Of JPEG.
const QUALITY: u8 = 75;
/// How much stronger a detection must be to be worth another picture: scores rise for many frames.
const STRONGER: f32 = 1.1;
/// Share of the strongest score from which on a detection is ringed.
const RINGED: f32 = 0.3;
/// Radius of a ring and width of its line, px of the small picture.
const RING: f32 = 8.0;
const LINE: f32 = 1.6;

/// Keeps the picture and writes it at the end.
pub struct Poster {
    path: PathBuf,
    tone: Option<Tone>,
    best: f32,
    kept: Option<Canvas>,
}

impl Poster {
    /// To be written there.
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), tone: None, best: 0.0, kept: None }
    }
}

impl Sink for Poster {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        let score = seen.detections.iter().map(|found| found.score).fold(0.0, f32::max);
        if self.kept.is_some() && score <= STRONGER * self.best {
            return Ok(());
        }
        self.best = score;
        let picture = self.tone.get_or_insert_with(|| Tone::of(&seen.picture)).render(&seen.picture);
        let (width, height) = picture.dimensions();
        let scale = (SIDE as f32 / width.max(height) as f32).min(1.0);
        let side = |length: u32| ((scale * length as f32).round() as u32).max(1);
        let mut canvas = Canvas::new(side(width), side(height));
        canvas.paste(&resize(&picture, side(width), side(height), FilterType::Triangle), 0, 0);
        for found in seen.detections.iter().filter(|found| found.score >= RINGED * score) {
            let (x, y) = (scale * (found.x + 0.5), scale * (found.y + 0.5));
            canvas.ring(x, y, RING, LINE, colour(found.trace), 1.0);
        }
        self.kept = Some(canvas);
        Ok(())
    }

    fn finish(&mut self) -> Outcome {
        let Some(canvas) = &self.kept else { return Ok(()) };
        let mut jpeg = Vec::new();
        JpegEncoder::new_with_quality(&mut jpeg, QUALITY)
            .encode(&canvas.rgb(), canvas.width(), canvas.height(), ExtendedColorType::Rgb8)
            .expect("memory takes every picture, and JPEG every size up to 65,535");
        std::fs::write(&self.path, jpeg).map_err(|error| Failure::write(&self.path, error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{Picture, Pixels};
    use apgstmd_core::Detection;

    #[test]
    fn the_strongest_frame_is_shown_with_its_target() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poster.jpg");
        let mut poster = Poster::new(&path);
        for (frame, (grey, score)) in [(40, 0.0), (90, 0.5), (200, 0.2)].into_iter().enumerate() {
            let pixels = Pixels::U8(ndarray::Array3::from_elem((300, 480, 1), grey));
            let mut seen = Seen::bare(frame, Picture { pixels, bits: None });
            if score > 0.0 {
                seen.detections.push(Detection { x: 240.0, y: 150.0, score, ..Detection::default() });
            }
            poster.frame(&seen).unwrap();
        }
        poster.finish().unwrap();
        let picture = image::open(&path).unwrap().into_rgb8();
        assert_eq!(picture.dimensions(), (240, 150));
        let grey = |x, y| picture.get_pixel(x, y).0.map(i32::from);
        assert!(grey(10, 10).iter().all(|sample| (sample - 90).abs() < 4), "{:?}", grey(10, 10));
        assert!(grey(128, 75)[0] > 150, "{:?} is on the ring", grey(128, 75));
        assert!((grey(120, 75)[0] - 90).abs() < 12, "{:?} is the target", grey(120, 75));
    }
}
