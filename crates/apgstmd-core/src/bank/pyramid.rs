//! A level of the picture pyramid: luminance reduced by area averaging, and what its members share: P of it, and the
//! background's motion in its pixels.

use super::ground::{self, Ground};
use super::window::Window;
use crate::frame::Size;
use crate::memory::{Memory, heap, owned};
use crate::params::Params;
use crate::plane::Plane;
use crate::row::bands::{Bands, Rows};
use crate::stage::background::{Finding, Motion};
use crate::stage::retina::Retina;

pub(super) struct Level {
    pub scale: usize,
    pub luminance: Plane,
    pub p: Plane,
    /// About the background, by the finest level that is looked at.
    pub found: Finding,
    pub window: Window,
    pub grounds: Vec<Ground>,
    retina: Retina,
}

heap!(Level { luminance, p, window, grounds, retina });

/// Of frames of `size`. Rows and columns left over at the end are not seen.
pub(super) fn reduced(size: Size, scale: usize) -> Size {
    Size::new(size.height / scale, size.width / scale)
}

/// Frames of the means that members of `speeds` need.
fn lengths(speeds: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut lengths = Vec::new();
    for length in speeds.map(ground::length) {
        if !lengths.contains(&length) {
            lengths.push(length);
        }
    }
    lengths
}

impl Level {
    /// Its members have targets of `speeds`, in px/frame of its own.
    pub fn new(size: Size, scale: usize, params: &Params, threads: usize, speeds: impl Iterator<Item = f64>) -> Self {
        let size = reduced(size, scale);
        let plane = || Plane::new(size);
        let retina = Retina::new(&params.retina, threads);
        let window = Window::new(size, scale, threads);
        let grounds = lengths(speeds).into_iter().map(|length| Ground::new(size, length)).collect();
        Self { scale, luminance: plane(), p: plane(), found: Finding::nothing(size), window, grounds, retina }
    }

    /// What it will hold, about: its luminance, P, the window and two maps for each mean.
    pub fn needs(size: Size, scale: usize, speeds: impl Iterator<Item = f64>) -> Memory {
        owned((3 + 2 * lengths(speeds).len()) * Plane::bytes(reduced(size, scale)))
    }

    /// Goes along with the background, which was `found` to move, or, where that is too little to tell, to stand `still`.
    pub fn follow(&mut self, bands: &Bands, found: &Finding, still: bool) {
        let shift = if still { (0.0, 0.0) } else { found.motion.shift };
        self.window.follow(bands, &self.p, shift, found.cut);
        let scroll = self.window.scroll();
        for ground in &mut self.grounds {
            if found.cut {
                ground.reset();
            }
            ground.take(bands, &scroll);
        }
        self.found = *found;
    }

    pub fn reset(&mut self) {
        self.window.reset();
        self.grounds.iter_mut().for_each(Ground::reset);
    }

    /// What is new for a member whose targets have a speed.
    pub fn new_for(&self, speed: f64) -> &Plane {
        let length = ground::length(speed);
        let ground = self.grounds.iter().find(|ground| ground.length == length);
        &ground.expect("every member's speed has its mean").new
    }

    /// What the background does as they see it.
    pub fn told(&self) -> Finding {
        let (right, down) = self.window.scroll().by;
        let motion = Motion { shift: (right as f64, down as f64), ..self.found.motion };
        Finding { motion, ..self.found }
    }

    /// Reduces the next finer level by two, and blurs. The finest has its luminance already.
    pub fn process(&mut self, bands: &Bands, finer: Option<&Self>) {
        let Self { luminance, p, retina, .. } = self;
        if let Some(Self { luminance: finer, .. }) = finer {
            let (Size { height, width }, stride) = (luminance.size(), luminance.stride());
            bands.over(height, Rows { data: luminance.data_mut(), stride }, |range, mut out| {
                for (row, y) in range.enumerate() {
                    let (above, below) = (finer.row(2 * y).chunks_exact(2), finer.row(2 * y + 1).chunks_exact(2));
                    for ((out, above), below) in out.row(row)[..width].iter_mut().zip(above).zip(below) {
                        *out = 0.25 * ((above[0] + above[1]) + (below[0] + below[1]));
                    }
                }
            });
        }
        retina.process(bands, luminance, p);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_area_means() {
        let size = Size::new(50, 71);
        let mut levels = [1, 2, 4].map(|scale| Level::new(size, scale, &Params::default(), 1, std::iter::empty()));
        for y in 0..size.height {
            for (x, value) in levels[0].luminance.row_mut(y).iter_mut().enumerate() {
                *value = ((7 * x + 13 * y) % 32) as f32 / 32.0;
            }
        }
        for index in 0..3 {
            let (finer, level) = levels.split_at_mut(index);
            level[0].process(&Bands::single(), finer.last());
        }
        assert_eq!(levels[2].luminance.size(), Size::new(12, 17));
        for (y, x) in [(0, 0), (5, 9), (11, 16)] {
            let values = (0..16).map(|i| levels[0].luminance.row(4 * y + i / 4)[4 * x + i % 4]);
            // Multiples of 1/32: exact.
            assert_eq!(levels[2].luminance.row(y)[x], values.sum::<f32>() / 16.0);
        }
    }
}
