//! `--report`: what is kept of a run while it goes on, within bounds however long it is, and the page that shows it.

mod bins;
mod camera;
mod frames;
mod histogram;
mod page;
mod paths;
mod thumbnails;

use std::path::{Path, PathBuf};
use std::rc::Rc;

use apgstmd_core::Size;

use self::bins::Bins;
use self::frames::Frames;
use self::histogram::Histogram;
pub use self::histogram::Mark;
pub use self::page::{About, Fact, Share};
use self::paths::Paths;
use self::thumbnails::Thumbnails;
use super::beside::Beside;
use super::outline::Outline;
use super::{Seen, Sink};
use crate::Outcome;

/// Shift of the background that is worth a word, px.
pub const LEAST_SHIFT: f32 = 0.05;

/// What is kept of a run.
pub struct Gathered {
    path: PathBuf,
    /// Once there is a first frame.
    beside: Option<Beside>,
    size: Option<Size>,
    frames: Frames,
    thumbnails: Thumbnails,
    bins: Bins,
    paths: Paths,
    scores: Histogram,
    contrasts: Histogram,
    /// Frame with the largest shift of the background, and that, px.
    largest_shift: Option<(usize, f32)>,
    /// The border of the region.
    pub outline: Option<Rc<Outline>>,
}

impl Gathered {
    /// Of a run whose page will be at `path`.
    pub fn new(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            beside: None,
            size: None,
            frames: Frames::new(),
            thumbnails: Thumbnails::new(),
            bins: Bins::new(),
            paths: Paths::default(),
            scores: Histogram::default(),
            contrasts: Histogram::default(),
            largest_shift: None,
            outline: None,
        }
    }

    /// Sees at the first frame whether the page can be written.
    ///
    /// # Errors
    /// It cannot.
    pub fn open(&mut self) -> Outcome {
        self.beside = Some(Beside::new(&self.path)?);
        Ok(())
    }

    /// Writes the page, if it was opened.
    ///
    /// # Errors
    /// Writing failed.
    pub fn write(&self, about: &About) -> Outcome {
        self.beside.as_ref().map_or(Ok(()), |beside| beside.write(page::page(self, about)))
    }

    /// Frame with the largest shift of the background since the one before, and that, px.
    pub fn largest_shift(&self) -> Option<(usize, f32)> {
        self.largest_shift.filter(|(_, shift)| *shift >= LEAST_SHIFT)
    }

    /// What had to be left away, in words.
    pub fn limits(&self) -> Vec<String> {
        let mut limits = Vec::new();
        if self.frames.every() > 1 {
            limits.push(format!(
                "The run is long: one of {} frames is kept here with its detections. Charts and sums count all.",
                self.frames.every()
            ));
        }
        if self.paths.left_out() > 0 {
            limits.push(format!("{} tracks that were seen shortest are left out here.", self.paths.left_out()));
        }
        limits
    }

    /// Tracks that are not far weaker than the best.
    pub fn strong_tracks(&self) -> usize {
        self.paths.strong()
    }

    /// Pictures that are kept.
    pub fn pictures(&self) -> usize {
        self.thumbnails.count()
    }
}

/// Gathers.
pub struct Gather<'a>(pub &'a mut Gathered);

impl Sink for Gather<'_> {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        let Gathered { size, frames, thumbnails, bins, paths, scores, contrasts, largest_shift, .. } = &mut *self.0;
        size.get_or_insert_with(|| seen.picture.size());
        frames.add(seen);
        thumbnails.add(seen);
        bins.add(seen);
        paths.add(&seen.tracks);
        for found in &seen.detections {
            scores.add(found.score);
            contrasts.add(found.contrast);
        }
        let shift = seen.background_shift.0.hypot(seen.background_shift.1);
        if largest_shift.is_none_or(|(_, largest)| shift > largest) {
            *largest_shift = Some((seen.frame, shift));
        }
        Ok(())
    }
}

/// To so many places after the point: what is written must not be longer than what is known.
fn rounded(value: f64, places: i32) -> f64 {
    let unit = 10f64.powi(places);
    (value * unit).round() / unit
}

/// To four digits.
fn significant(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return 0.0;
    }
    let unit = 10f64.powi(3 - value.abs().log10().floor() as i32);
    // Dividing by a power of ten is exact to the last place where multiplying by its inverse is not.
    if unit.is_finite() && unit > 0.0 { (value * unit).round() / unit } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_short_as_they_may_be() {
        assert_eq!((rounded(12.3456, 1), significant(0.012_345_6), significant(98765.4)), (12.3, 0.01235, 98770.0));
        assert_eq!((significant(0.0), significant(f64::NAN)), (0.0, 0.0));
        assert!((significant(1.234_567e-30) - 1.235e-30).abs() < 1e-40);
    }
}
