//! Frames that are the same as the one before: a few in a row where a rate was raised, many where nothing comes any more.

use serde::{Deserialize, Serialize};

use super::{FEWEST, Warning};

/// From this share of the frames on it is worth a word.
const SHARE: f64 = 0.05;
/// Repeats in a row that no conversion of a rate makes.
const MANY: usize = 8;
/// How far the share may be from that of every frame twice, three times...
const EVEN: f64 = 0.03;

#[derive(Default, Serialize, Deserialize)]
pub(super) struct Repeats {
    frames: usize,
    /// Repeats in short runs, and in long ones.
    doubled: usize,
    still: usize,
    /// Of the run that goes on.
    run: usize,
}

impl Repeats {
    pub fn add(&mut self, same: bool) {
        self.frames += 1;
        if same {
            self.run += 1;
        } else {
            (self.doubled, self.still) = self.so_far();
            self.run = 0;
        }
    }

    fn so_far(&self) -> (usize, usize) {
        match self.run {
            run if run >= MANY => (self.doubled, self.still + run),
            run => (self.doubled + run, self.still),
        }
    }

    pub fn warning(&self) -> Option<Warning> {
        let (doubled, still) = self.so_far();
        let moving = self.frames - still;
        let share = |count: usize, of: usize| count as f64 / of.max(1) as f64;
        let text = |count: usize, of: usize, what: &str| {
            format!(
                "{count} of {of} frames are identical to the one before ({:.0} %): {what}",
                100.0 * share(count, of)
            )
        };
        if doubled >= FEWEST && share(doubled, moving) >= SHARE {
            let times = share(moving, moving - doubled).round();
            let even = (share(doubled, moving) - (1.0 - times.recip())).abs() < EVEN && times >= 2.0;
            let advice = match even {
                true => format!("use each frame once, with --step {times}: motion is then even"),
                false => "let the video be converted back to its true rate, as with ffmpeg -vf mpdecimate".to_owned(),
            };
            return Some(Warning::new(
                "duplicates",
                text(doubled, moving, "video of a lower rate stored at a higher one"),
                advice,
            ));
        }
        (share(still, self.frames) >= SHARE).then(|| {
            let what = format!("more than {MANY} in a row, a camera that hangs or a picture that is made");
            Warning::new("still", text(still, self.frames, &what), "nothing can be found there: look at the source")
        })
    }
}
