//! Raw frames as video programs hand them over, to pictures: what white and black are, and which samples are luminance.
//!
//! Of YUV the Y plane is taken as it was coded, and limited range (16 to 235 of 8 bits) is spread to [0, 1] in floating
//! point: rounding it to 8 bits again, as a conversion to grey pictures does, would make steps of 1 and of 2 levels of
//! what was even. Below black and above white is black and white.

use apgstmd_core::{MOST_PIXELS, Size};
use ndarray::Array3;

use super::{Picture, Pixels};

/// What a sample is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// Luminance alone.
    Grey,
    /// Red, green, blue, interleaved.
    Rgb,
}

/// How the samples of a frame lie in its bytes: rows without gaps, samples of more than 8 bits in two bytes, the lower first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Grey or colour.
    pub colour: Colour,
    /// Bits of a sample, 8 to 16.
    pub bits: u32,
    /// Black is 16 and white 235 (of 8 bits), not the ends of the scale.
    pub limited: bool,
}

impl Layout {
    /// Grey over the full scale.
    pub fn grey(bits: u32) -> Self {
        Self { colour: Colour::Grey, bits, limited: false }
    }

    /// Bytes of a sample.
    pub fn depth(self) -> usize {
        if self.bits > 8 { 2 } else { 1 }
    }

    /// Bytes of a frame.
    ///
    /// # Errors
    /// It is larger than any that can be used.
    pub fn bytes(self, size: Size) -> Result<usize, String> {
        match size.height.checked_mul(size.width) {
            Some(0) => Err(format!("its frames are {size} (height x width): there is nothing in them")),
            Some(pixels) if pixels <= MOST_PIXELS => Ok(pixels * self.channels() * self.depth()),
            _ => Err(format!("its frames claim to be {size} (height x width): at most {MOST_PIXELS} pixels are read")),
        }
    }

    fn channels(self) -> usize {
        match self.colour {
            Colour::Grey => 1,
            Colour::Rgb => 3,
        }
    }

    /// What `--bit-depth` makes of it.
    ///
    /// # Errors
    /// It contradicts what is known.
    pub fn with_bit_depth(self, bit_depth: Option<u32>) -> Result<Self, String> {
        match bit_depth {
            Some(bits) if self.bits == 16 && !self.limited => Ok(Self { bits, ..self }),
            Some(bits) if bits != self.bits => {
                Err(format!("its samples have {} bits, but --bit-depth {bits} was given: leave that out", self.bits))
            }
            _ => Ok(self),
        }
    }

    /// A frame's bytes as a picture; as many as [`Layout::bytes`] says.
    pub fn picture(self, size: Size, bytes: Vec<u8>) -> Result<Picture, String> {
        let shape = (size.height, size.width, self.channels());
        let wide = || bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
        let pixels = match (self.limited, self.depth()) {
            (false, 1) => array(shape, bytes).map(Pixels::U8),
            (false, _) => array(shape, wide().collect()).map(Pixels::U16),
            (true, 1) => {
                let table: Vec<f32> = (0..256).map(|sample| self.spread(sample as u16)).collect();
                array(shape, bytes.iter().map(|sample| table[usize::from(*sample)]).collect()).map(Pixels::F32)
            }
            (true, _) => array(shape, wide().map(|sample| self.spread(sample)).collect()).map(Pixels::F32),
        };
        let bits = (9..16).contains(&self.bits).then_some(self.bits).filter(|_| !self.limited);
        Ok(Picture { pixels: pixels?, bits })
    }

    /// Luminance of a limited-range sample.
    fn spread(self, sample: u16) -> f32 {
        let unit = f64::from(1u32 << (self.bits - 8));
        ((f64::from(sample) / unit - 16.0) / 219.0).clamp(0.0, 1.0) as f32
    }
}

fn array<T>(shape: (usize, usize, usize), samples: Vec<T>) -> Result<Array3<T>, String> {
    Array3::from_shape_vec(shape, samples).map_err(|_| "it holds another number of samples than it claims".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(layout: Layout, bytes: &[u8]) -> Vec<f32> {
        let size = Size::new(1, bytes.len() / layout.bytes(Size::new(1, 1)).unwrap());
        layout.picture(size, bytes.to_vec()).unwrap().frame().luminance().unwrap().into_raw_vec_and_offset().0
    }

    #[test]
    fn black_and_white_at_every_depth() {
        for bits in [8, 9, 10, 12, 14, 16] {
            for limited in [false, true] {
                let layout = Layout { limited, ..Layout::grey(bits) };
                let (black, white) = if limited { (16 << (bits - 8), 235 << (bits - 8)) } else { (0, (1 << bits) - 1) };
                let bytes: Vec<u8> = [black, white]
                    .iter()
                    .flat_map(|sample: &u32| sample.to_le_bytes()[..layout.depth()].to_vec())
                    .collect();
                assert_eq!(luminance(layout, &bytes), [0.0, 1.0], "{layout:?}");
            }
        }
    }

    #[test]
    fn limited_range_is_spread_evenly_and_ends() {
        let layout = Layout { limited: true, ..Layout::grey(8) };
        let seen = luminance(layout, &[0, 15, 16, 17, 18, 126, 235, 255]);
        assert_eq!((seen[0], seen[1], seen[2], seen[6], seen[7]), (0.0, 0.0, 0.0, 1.0, 1.0));
        assert!((seen[3] - 1.0 / 219.0).abs() < 1e-7 && (seen[4] - 2.0 / 219.0).abs() < 1e-7);
        assert!((seen[5] - 110.0 / 219.0).abs() < 1e-7);
    }

    #[test]
    fn colour_is_that_of_pictures() {
        let layout = Layout { colour: Colour::Rgb, ..Layout::grey(8) };
        assert_eq!(luminance(layout, &[255, 0, 0, 0, 255, 0, 0, 0, 255]), [0.299, 0.587, 0.114]);
        let layout = Layout { bits: 16, ..layout };
        assert_eq!(luminance(layout, &[255, 255, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255]), [0.299, 0.114]);
    }

    #[test]
    fn depths_that_contradict() {
        assert_eq!(Layout::grey(16).with_bit_depth(Some(14)), Ok(Layout::grey(14)));
        assert_eq!(Layout::grey(12).with_bit_depth(Some(12)), Ok(Layout::grey(12)));
        assert_eq!(Layout::grey(8).with_bit_depth(None), Ok(Layout::grey(8)));
        assert!(Layout::grey(8).with_bit_depth(Some(12)).is_err());
        assert!(Layout::grey(10).with_bit_depth(Some(12)).is_err());
        assert!(Layout { limited: true, ..Layout::grey(16) }.with_bit_depth(Some(12)).is_err());
    }

    #[test]
    fn sizes_that_cannot_be() {
        let layout = Layout::grey(16);
        assert_eq!(layout.bytes(Size::new(3, 5)), Ok(30));
        for size in [Size::new(0, 5), Size::new(usize::MAX, 2), Size::new(1 << 15, 1 << 15)] {
            assert!(layout.bytes(size).is_err());
        }
    }
}
