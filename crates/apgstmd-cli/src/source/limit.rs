//! How large a frame may be that a file, a pipe or a video claims to have. A few bytes can claim gigabytes.

use apgstmd_core::{MOST_PIXELS, Size};

/// The most pixels of a frame that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit(usize);

impl Default for Limit {
    /// 64 million: larger than cameras are, and 2 GiB of the largest samples there are.
    fn default() -> Self {
        Self::of_millions(Self::USUAL)
    }
}

impl Limit {
    /// Millions of pixels where nothing is said.
    pub const USUAL: u32 = 64;
    /// The most that can be asked for.
    pub const HIGHEST: u32 = (MOST_PIXELS / 1_000_000) as u32;

    /// So many million pixels.
    pub fn of_millions(millions: u32) -> Self {
        Self::of_pixels(millions as usize * 1_000_000)
    }

    /// So many pixels, at most as many as a detector takes.
    pub fn of_pixels(pixels: usize) -> Self {
        Self(pixels.min(MOST_PIXELS))
    }

    /// The number of pixels.
    pub fn pixels(self) -> usize {
        self.0
    }

    /// Memory that the samples of a picture may take: four channels of eight bytes, 2 GiB at most.
    pub fn bytes(self) -> u64 {
        (32 * self.0 as u64).min(1 << 31)
    }

    /// Whether a frame of this size is read.
    ///
    /// # Errors
    /// It is not; says what to do.
    pub fn check(self, size: Size) -> Result<(), String> {
        match size.height.checked_mul(size.width) {
            Some(0) => Err(format!("it claims to be {size} (height x width), which holds no pixel")),
            Some(pixels) if pixels <= self.0 => Ok(()),
            _ => Err(format!("it claims to be {size} (height x width), but {}", self.rule())),
        }
    }

    /// In words, with the flag that raises it.
    pub fn rule(self) -> String {
        let most = self.0 as f64 / 1e6;
        if self.0 < Self::HIGHEST as usize * 1_000_000 {
            format!("at most {most} million pixels are read: raise --largest-frame if that is right")
        } else {
            format!("at most {most} million pixels are read")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_is_named_with_the_flag_that_raises_it() {
        let limit = Limit::default();
        assert_eq!(limit.check(Size::new(8000, 8000)), Ok(()));
        let error = limit.check(Size::new(65535, 65535)).unwrap_err();
        assert_eq!(
            error,
            "it claims to be 65535 x 65535 (height x width), but at most 64 million pixels are read: raise \
             --largest-frame if that is right"
        );
        assert!(limit.check(Size::new(0, 7)).unwrap_err().contains("0 x 7 (height x width), which holds no pixel"));
        let highest = Limit::of_millions(Limit::HIGHEST);
        assert_eq!(highest.check(Size::new(16000, 16000)), Ok(()));
        assert!(!highest.check(Size::new(usize::MAX, 2)).unwrap_err().contains("--largest-frame"));
        assert_eq!((Limit::of_pixels(usize::MAX), highest.bytes()), (Limit(MOST_PIXELS), 1 << 31));
    }
}
