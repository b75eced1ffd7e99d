//! The response map as a picture, beside the annotated one.

use apgstmd_core::Size;
use image::imageops::{FilterType, resize};
use image::{Rgb, RgbImage};
use ndarray::Array2;

use crate::sink::overlay::annotate::repeat;
use crate::sink::overlay::canvas::{Canvas, FAINT, GROUND, INK};

/// Dark to bright, of even steps to the eye, also to one that is colour-blind: after matplotlib's magma.
const MAGMA: [[f32; 3]; 9] = [
    [0.0, 0.0, 4.0],
    [28.0, 16.0, 68.0],
    [79.0, 18.0, 123.0],
    [129.0, 37.0, 129.0],
    [181.0, 54.0, 122.0],
    [229.0, 80.0, 100.0],
    [251.0, 135.0, 97.0],
    [254.0, 194.0, 135.0],
    [252.0, 253.0, 191.0],
];

/// Draws response maps, all of a run on one scale.
pub(super) struct ResponseMap {
    /// The largest value so far.
    largest: f32,
    /// 1/3 where the response is cubic in contrast: colours are then even in contrast.
    exponent: f32,
    caption: &'static str,
}

impl ResponseMap {
    /// That of a bank, which is contrast itself, or of one detector.
    pub fn new(bank: bool) -> Self {
        match bank {
            true => Self { largest: 0.0, exponent: 1.0, caption: "response, equivalent contrast" },
            false => Self { largest: 0.0, exponent: 1.0 / 3.0, caption: "response Q, cube root" },
        }
    }

    /// `annotated` with the map to its right.
    pub fn beside(&mut self, annotated: &Canvas, map: &Array2<f32>, size: Size) -> Canvas {
        self.largest = map.iter().copied().fold(self.largest, f32::max);
        let scale = annotated.width() as f32 / size.width as f32;
        let (width, height) = (annotated.width(), (scale * size.height as f32).round() as u32);
        let small = RgbImage::from_fn(size.width as u32, size.height as u32, |x, y| {
            let value = map[[y as usize, x as usize]] / self.largest.max(f32::MIN_POSITIVE);
            Rgb(colour(value.max(0.0).powf(self.exponent)))
        });
        let enlarged = match scale {
            whole if whole.fract() == 0.0 => repeat(&small, whole as u32),
            _ => resize(&small, width, height, FilterType::Triangle),
        };
        let gap = 4;
        let mut sheet = Canvas::new(2 * width + gap, annotated.height());
        sheet.paste_canvas(annotated, 0, 0);
        sheet.paste(&enlarged, width + gap, 0);
        sheet.rectangle(
            (width + gap) as f32,
            height as f32,
            width as f32,
            (annotated.height() - height.min(annotated.height())) as f32,
            GROUND,
            1.0,
        );
        let letters = (0.024 * width as f32).clamp(11.0, 18.0);
        let middle = 0.5 * (height + annotated.height()) as f32;
        let left = (width + gap) as f32 + 0.6 * letters;
        let used = sheet.text(self.caption, left, middle, letters, INK);
        let most = format!("brightest {:.2e} so far", self.largest);
        sheet.text(&most, left + used + letters, middle, letters, FAINT);
        sheet
    }
}

fn colour(level: f32) -> [u8; 3] {
    let place = level.clamp(0.0, 1.0) * (MAGMA.len() - 1) as f32;
    let below = (place as usize).min(MAGMA.len() - 2);
    let part = place - below as f32;
    std::array::from_fn(|c| (MAGMA[below][c] * (1.0 - part) + MAGMA[below + 1][c] * part).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_grow_brighter() {
        let light = |level: f32| colour(level).iter().map(|c| u32::from(*c)).sum::<u32>();
        assert_eq!((colour(0.0), colour(1.0)), ([0, 0, 4], [252, 253, 191]));
        assert!((0..100).all(|step| light(step as f32 / 100.0) <= light((step + 1) as f32 / 100.0)));
    }
}
