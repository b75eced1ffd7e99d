//! Samples to colours on a screen. 8-bit pictures stay as they are; deeper ones that use little of their range (thermal
//! cameras) are stretched, by one rule for the whole run so that nothing flickers.

use image::{Rgb, RgbImage};
use ndarray::ArrayView3;

use crate::source::{Picture, Pixels};

/// A linear map of samples to [0, 1].
#[derive(Clone, Copy, Debug)]
pub(in crate::sink) struct Tone {
    black: f64,
    white: f64,
}

/// Share of pixels that may be clipped at either end.
const CLIPPED: f64 = 0.001;

impl Tone {
    /// From the first picture of a run.
    pub fn of(picture: &Picture) -> Self {
        match &picture.pixels {
            Pixels::U8(_) => Self { black: 0.0, white: 255.0 },
            Pixels::U16(samples) => Self::stretch(samples.view(), 2f64.powi(picture.bits.unwrap_or(16) as i32) - 1.0),
            Pixels::F32(samples) => Self::stretch(samples.view(), 1.0),
            Pixels::F64(samples) => Self::stretch(samples.view(), 1.0),
        }
    }

    fn stretch<T: Copy + Into<f64>>(samples: ArrayView3<'_, T>, full_scale: f64) -> Self {
        let colours = samples.dim().2.min(3);
        let mut values: Vec<f64> =
            samples.indexed_iter().filter(|((_, _, c), _)| *c < colours).map(|(_, v)| (*v).into()).collect();
        values.sort_by(f64::total_cmp);
        let (Some(lowest), Some(highest)) = (values.first(), values.last()) else {
            return Self { black: 0.0, white: full_scale };
        };
        let clip = (CLIPPED * values.len() as f64) as usize;
        let (low, high) = (values[clip], values[values.len() - 1 - clip]);
        // A lone dark target on white must not be clipped away: then the clipped range is nearly nothing.
        let (low, high) = if high - low < 0.25 * (highest - lowest) { (*lowest, *highest) } else { (low, high) };
        if high - low > 0.5 * full_scale || high <= low {
            return Self { black: 0.0, white: full_scale };
        }
        let margin = 0.05 * (high - low);
        Self { black: low - margin, white: high + margin }
    }

    /// As RGB at its own size.
    pub fn render(self, picture: &Picture) -> RgbImage {
        match &picture.pixels {
            Pixels::U8(samples) => self.paint(samples.view()),
            Pixels::U16(samples) => self.paint(samples.view()),
            Pixels::F32(samples) => self.paint(samples.view()),
            Pixels::F64(samples) => self.paint(samples.view()),
        }
    }

    fn paint<T: Copy + Into<f64>>(self, samples: ArrayView3<'_, T>) -> RgbImage {
        let (height, width, channels) = samples.dim();
        let level = |value: T| (255.0 * (value.into() - self.black) / (self.white - self.black)).round() as u8;
        RgbImage::from_fn(width as u32, height as u32, |x, y| {
            let at = |channel: usize| level(samples[[y as usize, x as usize, channel]]);
            if channels < 3 { Rgb([at(0); 3]) } else { Rgb([at(0), at(1), at(2)]) }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array3;

    #[test]
    fn eight_bits_stay_and_thermal_is_stretched() {
        let picture = Picture { pixels: Pixels::U8(Array3::from_elem((4, 4, 1), 77)), bits: None };
        assert_eq!(Tone::of(&picture).render(&picture).get_pixel(0, 0).0, [77; 3]);
        let thermal = Array3::from_shape_fn((40, 40, 1), |(y, x, _)| 8000 + (x + y) as u16);
        let picture = Picture { pixels: Pixels::U16(thermal), bits: Some(14) };
        let drawn = Tone::of(&picture).render(&picture);
        assert!(drawn.get_pixel(0, 0).0[0] < 30 && drawn.get_pixel(39, 39).0[0] > 225);
    }

    #[test]
    fn a_lone_target_is_not_clipped() {
        let mut white = Array3::from_elem((100, 100, 1), 1.0f32);
        white[[50, 50, 0]] = 0.8;
        let picture = Picture { pixels: Pixels::F32(white), bits: None };
        let drawn = Tone::of(&picture).render(&picture);
        assert!(drawn.get_pixel(50, 50).0[0] + 100 < drawn.get_pixel(0, 0).0[0]);
    }
}
