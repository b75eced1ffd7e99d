//! `--roi` and `--mask`: where targets are looked for.

use std::path::{Path, PathBuf};

use apgstmd_core::{Rectangle, Region, RegionError, Size};
use ndarray::{Array2, Axis};
use sha2::{Digest, Sha256};

use crate::Outcome;
use crate::args::RegionArgs;
use crate::failure::Failure;
use crate::source::{Picture, Pixels, read_picture};

/// The flags, with the mask read. What they mean depends on the size of the frames.
#[derive(Clone, Debug, PartialEq)]
pub struct LookIn {
    /// Any of these; everywhere if there are none.
    pub rectangles: Vec<Rectangle>,
    /// And in this.
    pub mask: Option<(PathBuf, Array2<bool>)>,
}

impl LookIn {
    /// Reads the mask. None where neither flag is given.
    ///
    /// # Errors
    /// The picture cannot be read, or is black.
    pub(super) fn resolve(args: &RegionArgs) -> Outcome<Option<Self>> {
        let mask = args.mask.as_deref().map(read).transpose()?;
        let given = mask.is_some() || !args.roi.is_empty();
        let rectangles = args.roi.iter().map(|roi| roi.0).collect();
        Ok(given.then_some(Self { rectangles, mask }))
    }

    /// The region of frames of `size`.
    ///
    /// # Errors
    /// A rectangle beside the frames, a mask of another size, nothing left.
    pub fn region(&self, size: Size) -> Outcome<Region> {
        let rectangles = match self.rectangles.is_empty() {
            true => None,
            false => Some(
                Region::from_rectangles(size, &self.rectangles).map_err(|e| Failure::usage(format!("--roi: {e}")))?,
            ),
        };
        let Some((path, mask)) = &self.mask else {
            return rectangles.ok_or_else(|| Failure::usage("--roi and --mask are both missing"));
        };
        let wrong = |error: RegionError| Failure::usage(format_args!("--mask {}: {error}", path.display()));
        let mask = Region::from_mask(mask.view()).map_err(wrong)?;
        if mask.size() != size {
            return Err(wrong(RegionError::Size { given: mask.size(), expected: size }));
        }
        rectangles
            .map_or(Ok(mask.clone()), |rectangles| rectangles.and(&mask))
            .map_err(|_| Failure::usage(format_args!("--roi and --mask {} have nothing in common", path.display())))
    }

    /// What results depend on, in words.
    pub fn described(&self) -> String {
        let mask = self.mask.as_ref().map(|(_, mask)| {
            let bytes: Vec<u8> = mask.iter().map(|inside| u8::from(*inside)).collect();
            Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect::<String>()
        });
        format!("{:?}, mask {mask:?}", self.rectangles)
    }
}

/// Where any of the colours is not 0. Transparency does not count.
fn read(path: &Path) -> Outcome<(PathBuf, Array2<bool>)> {
    let Picture { pixels, .. } =
        read_picture(path).map_err(|reason| Failure::usage(format_args!("--mask {}: {reason}", path.display())))?;
    fn lit<T: Copy + PartialEq + Default>(samples: &ndarray::Array3<T>) -> Array2<bool> {
        let colours = samples.dim().2.min(3);
        samples.map_axis(Axis(2), |pixel| pixel.iter().take(colours).any(|value| *value != T::default()))
    }
    let mask = match &pixels {
        Pixels::U8(samples) => lit(samples),
        Pixels::U16(samples) => lit(samples),
        Pixels::F32(samples) => lit(samples),
        Pixels::F64(samples) => lit(samples),
    };
    Ok((path.to_owned(), mask))
}
