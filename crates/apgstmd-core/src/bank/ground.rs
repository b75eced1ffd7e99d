//! What is new in the picture: P less its mean over the last frames, where the world stands still.
//!
//! The spot that moves with a response is looked for here ([`super::spot`]), where nothing of a background at rest is left, however
//! rich it is. A target takes part in the mean while it is there, so that slow ones are looked for in longer means.
//!
//! State: the mean, and of how many frames it is.

use crate::frame::Size;
use crate::memory::heap;
use crate::plane::Plane;
use crate::row::bands::{Bands, Rows};
use crate::scroll::Scroll;
use crate::state::remember;

/// Fewest frames of a mean.
const SHORTEST: f64 = 32.0;
/// A target moves by so many px in them: one of 5 px loses a twentieth to the mean before its middle has come.
const FAR: f64 = 50.0;
/// Share of them that the first frame counts for.
const FIRST: f64 = 0.25;

/// Frames of the mean for targets of `speed` px/frame.
pub(super) fn length(speed: f64) -> f64 {
    (FAR / speed).max(SHORTEST)
}

pub(super) struct Ground {
    /// Frames in the mean at most: after these the older count less and less.
    pub length: f64,
    mean: Plane,
    frames: f64,
    /// What is new in the last frame.
    pub new: Plane,
}

heap!(Ground { mean, new });
remember!(Ground { mean, frames });

impl Ground {
    pub fn new(size: Size, length: f64) -> Self {
        Self { length, mean: Plane::new(size), frames: 0.0, new: Plane::new(size) }
    }

    /// Takes the next frame, before which the mean moves; of what comes into the picture nothing is new.
    pub fn take(&mut self, bands: &Bands, scroll: &Scroll<'_>) {
        let Self { length, mean, frames, new } = self;
        if *frames == 0.0 {
            mean.data_mut().copy_from_slice(scroll.p.data());
            *frames = FIRST * *length;
        } else {
            mean.scroll(scroll, 1.0);
        }
        *frames = (*frames + 1.0).min(*length);
        let share = (1.0 / *frames) as f32;
        let (height, stride) = (new.size().height, new.stride());
        let out = [new, mean].map(|plane| Rows { data: plane.data_mut(), stride });
        bands.over(height, out, |range, [mut new, mut mean]| {
            for (row, y) in range.enumerate() {
                let values = new.row(row).iter_mut().zip(mean.row(row)).zip(scroll.p.padded_row(y));
                for ((new, mean), p) in values {
                    *new = p - *mean;
                    *mean += share * *new;
                }
            }
        });
    }

    pub fn reset(&mut self) {
        self.frames = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Size = Size { height: 3, width: 40 };

    fn row(value: impl Fn(isize) -> f32) -> Plane {
        let mut p = Plane::new(SIZE);
        (0..3).for_each(|y| (0..).zip(p.row_mut(y)).for_each(|(x, out)| *out = value(x)));
        p
    }

    /// A background as rich as may be, seen from a camera that moves, is not new; a target before it is, and it alone.
    #[test]
    fn what_stands_still_in_the_world_is_not_new() {
        let texture = |u: isize| 0.5 + 0.05 * ((u * u * 7 + u).rem_euclid(11) as f32 - 5.0);
        let mut ground = Ground::new(SIZE, length(2.0));
        for t in 0..36 {
            // To the right by two, then twice to the left by one.
            let (by, scrolled) = [(-1, 0), (2, 2), (-1, 1)][t as usize % 3];
            let target = 38 - t;
            let p = row(|x| texture(x - scrolled) + if (x - target).abs() <= 1 { -0.4 } else { 0.0 });
            ground.take(&Bands::single(), &Scroll { by: (by, 0), ..Scroll::none(&p) });
            for (x, new) in (0..).zip(ground.new.row(1)).skip(2).take(32) {
                let expected = if (x - target).abs() <= 1 { -0.4 } else { 0.0 };
                // The mean has kept some of the target, which was at a place for up to five of its 28 frames or more.
                assert!(t < 20 || (new - expected).abs() < 0.4 * 5.0 / 28.0, "frame {t}, {x}: {new}, not {expected}");
            }
        }
    }

    #[test]
    fn the_first_frame_is_old_and_after_a_reset_so_is_the_next() {
        let mut ground = Ground::new(SIZE, length(1.0));
        let new = |ground: &mut Ground, value: f32| {
            ground.take(&Bands::single(), &Scroll::none(&row(|_| value)));
            ground.new.row(0)[7]
        };
        assert_eq!(new(&mut ground, 0.75), 0.0);
        assert_eq!(new(&mut ground, 0.25), -0.5);
        ground.reset();
        assert_eq!(new(&mut ground, 0.25), 0.0);
    }

    #[test]
    fn the_slower_the_longer() {
        assert_eq!([0.125, 0.5, 1.0, 8.0].map(length), [400.0, 100.0, 50.0, 32.0]);
    }
}
