//! What is wrong with the footage, and what to do about it: measured on every frame as it passes, told in run.json, in
//! the summary and on the page of `--report`. State is a few sums and the frame before.

mod comb;
mod levels;
mod repeats;
mod speeds;

use serde::{Deserialize, Serialize};

use self::comb::Comb;
use self::levels::Levels;
use self::repeats::Repeats;
use self::speeds::Speeds;
pub use self::speeds::Tuned;
use crate::sink::Seen;
use crate::source::Picture;

/// Something the user should know.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Warning {
    /// One word: what it is about.
    pub about: &'static str,
    /// What was seen.
    pub text: String,
    /// What to do.
    pub advice: String,
}

impl Warning {
    /// Puts them together.
    pub fn new(about: &'static str, text: impl Into<String>, advice: impl Into<String>) -> Self {
        Self { about, text: text.into(), advice: advice.into() }
    }
}

/// Fewer frames than this tell nothing.
const FEWEST: usize = 3;

/// What has been seen so far.
#[derive(Serialize, Deserialize)]
pub struct Footage {
    before: Option<Picture>,
    repeats: Repeats,
    levels: Levels,
    comb: Comb,
    speeds: Speeds,
}

impl Footage {
    /// Before the first frame.
    pub fn new(tuned: Tuned) -> Self {
        let (repeats, levels, comb) = (Repeats::default(), Levels::default(), Comb::default());
        Self { before: None, repeats, levels, comb, speeds: Speeds::new(tuned) }
    }

    /// Takes the next frame.
    pub fn take(&mut self, seen: Seen) {
        self.speeds.add(&seen);
        let same = self.before.as_ref().is_some_and(|before| *before == seen.picture);
        self.repeats.add(same);
        if !same {
            let sample = levels::Sample::of(&seen.picture);
            self.levels.add(&sample);
            self.comb.add(sample);
        }
        self.before = Some(seen.picture);
    }

    /// What there is to say.
    pub fn warnings(&self) -> Vec<Warning> {
        let found = [self.repeats.warning(), self.comb.warning(), self.levels.warning(), self.speeds.warning()];
        found.into_iter().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::Pixels;
    use ndarray::Array3;

    /// A textured square that moves 3 px a frame before grey, drawn at the time of each row.
    fn frame(time: impl Fn(usize) -> f64) -> Picture {
        let level = |y: usize, x: usize| {
            let x = x as f64 - 10.0 - 3.0 * time(y);
            let inside = (0.0..40.0).contains(&x) && (20..60).contains(&y);
            if inside { 60 + (x * 1.3 + 0.3 * y as f64).sin().mul_add(40.0, 40.0) as u8 } else { 200 }
        };
        let pixels = Pixels::U8(Array3::from_shape_fn((80, 120, 1), |(y, x, _)| level(y, x)));
        Picture { pixels, bits: None }
    }

    fn warnings(pictures: impl IntoIterator<Item = Picture>) -> Vec<&'static str> {
        let mut footage = Footage::new(Tuned { slowest: 1.0, fastest: 1.0 });
        for (frame, picture) in pictures.into_iter().enumerate() {
            footage.take(Seen::bare(frame, picture));
        }
        footage.warnings().iter().map(|warning| warning.about).collect()
    }

    #[test]
    fn progressive_footage_is_fine() {
        assert!(warnings((0..20).map(|t| frame(|_| f64::from(t)))).is_empty());
    }

    #[test]
    fn interlaced_footage_is_known() {
        let fields = |t: i32| move |y: usize| f64::from(t) + 0.5 * (y % 2) as f64;
        assert_eq!(warnings((0..20).map(|t| frame(fields(t)))), ["interlaced"]);
    }

    #[test]
    fn every_frame_twice() {
        let mut footage = Footage::new(Tuned { slowest: 1.0, fastest: 1.0 });
        for t in 0..20 {
            footage.take(Seen::bare(t, frame(|_| (t / 2) as f64)));
        }
        let warnings = footage.warnings();
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].text.starts_with("10 of 20") && warnings[0].advice.contains("--step 2"), "{warnings:?}");
    }

    #[test]
    fn a_camera_that_hangs() {
        let mut footage = Footage::new(Tuned { slowest: 1.0, fastest: 1.0 });
        for t in 0..60usize {
            footage.take(Seen::bare(t, frame(|_| t.min(30) as f64)));
        }
        let warnings = footage.warnings();
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].text.starts_with("29 of 60") && warnings[0].about == "still", "{warnings:?}");
    }

    #[test]
    fn clipped_skies_are_told() {
        let clipped = |t| {
            let mut picture = frame(|_| f64::from(t));
            if let Pixels::U8(samples) = &mut picture.pixels {
                samples.slice_mut(ndarray::s![..20, .., ..]).fill(255);
            }
            picture
        };
        assert_eq!(warnings((0..5).map(clipped)), ["saturated"]);
    }
}
