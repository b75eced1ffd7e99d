//! Levels of a picture, each half as large as the one before, and the samples of the last picture on each.

use std::ops::Add;

use fearless_simd::Level;

use crate::frame::Size;
use crate::memory::{Heap, Memory, heap};
use crate::plane::{Plane, padded};
use crate::row::warp::{Line, OUTSIDE, Picture, SUMS, compare, disagreement, halve, normal};
use crate::stage::background::Motion;
use crate::state::{Remember, StateError, Visit};

/// A level is halved while its shorter side is at least this, px.
const HALVED_FROM: usize = 48;
/// Left out at every border of the full picture, px.
const MARGIN: usize = 4;
/// Where |g_x| + |g_y| is above this there is structure, luminance / px: a quarter of a step of 8 bits.
const STEEP: f32 = 1.0 / 1024.0;
/// Share of the samples that have structure before a background; less is enough where so many of the columns have any.
const MUCH: f64 = 0.2;
const SOME: f64 = 0.02;
const BROAD: f64 = 0.5;

pub(crate) struct Scale {
    size: Size,
    /// How often P is halved.
    pub level: usize,
    step: usize,
    pub margin: usize,
    pub rows: usize,
    pub columns: usize,
    /// Columns with the padding behind them.
    pub padded: usize,
    /// The middle of the full picture, px of this level.
    pub middle: (f64, f64),
    /// Half of the longer side, the unit of u and v, px of this level.
    pub half: f64,
    /// u of the samples of a row.
    across: Vec<f32>,
    /// The last picture at the samples, and its gradient.
    pub last: Vec<f32>,
    gradient: [Vec<f32>; 2],
    /// |g_x| + |g_y|: how much a sample can tell of motion; 0 in the padding.
    pub steepness: Vec<f32>,
}

heap!(Scale { across, last, gradient, steepness });

impl Remember for Scale {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        visit.part("last", &mut self.last)?;
        visit.part("gradient", &mut self.gradient)?;
        visit.part("steepness", &mut self.steepness)
    }
}

/// The levels of a picture, the finest first: at most `finest` samples there and `between` on the others. Last comes the
/// coarsest, with all its pixels; where the picture is not halved at all, it is the finest once more.
pub(crate) fn scales(size: Size, (finest, between): (usize, usize)) -> Vec<Scale> {
    let coarsest = (0..).take_while(|level| size.height.min(size.width) >> level >= HALVED_FROM).count();
    let finer = (0..coarsest.max(1)).map(|level| Scale::new(size, level, if level == 0 { finest } else { between }));
    finer.chain([Scale::new(size, coarsest, usize::MAX)]).collect()
}

/// A picture at half its size, again and again.
pub(crate) struct Pyramid {
    /// From half the size on.
    halves: Vec<(Size, Vec<f32>)>,
}

impl Heap for Pyramid {
    fn heap(&self) -> Memory {
        self.halves.iter().map(|(_, half)| half.heap()).fold(Memory::default(), Add::add)
    }
}

impl Pyramid {
    /// With so many levels below the full picture.
    pub fn new(full: Size, levels: usize) -> Self {
        let half = |level: usize| {
            let size = Size::new(full.height >> level, full.width >> level);
            (size, vec![0.0; size.height * size.width])
        };
        Self { halves: (1..=levels).map(half).collect() }
    }

    pub fn build(&mut self, level: Level, p: &Plane) {
        for index in 0..self.halves.len() {
            let (finer, coarser) = self.halves.split_at_mut(index);
            let from = finer.last().map_or_else(|| whole(p), view);
            let (size, half) = &mut coarser[0];
            for (y, out) in half.chunks_exact_mut(size.width).enumerate() {
                let (above, below) = from.data[2 * y * from.stride..].split_at(from.stride);
                halve(level, above, below, out);
            }
        }
    }

    /// A level, of which the first is the full picture.
    pub fn level<'a>(&'a self, p: &'a Plane, level: usize) -> Picture<'a> {
        if level == 0 { whole(p) } else { view(&self.halves[level - 1]) }
    }
}

fn whole(p: &Plane) -> Picture<'_> {
    Picture { data: p.data(), stride: p.stride(), width: p.size().width, height: p.size().height }
}

fn view((size, data): &(Size, Vec<f32>)) -> Picture<'_> {
    Picture { data, stride: size.width, width: size.width, height: size.height }
}

impl Scale {
    fn new(full: Size, level: usize, most: usize) -> Self {
        let size = Size::new(full.height >> level, full.width >> level);
        let margin = (MARGIN >> level).max(1);
        let (height, width) = (size.height - 2 * margin, size.width - 2 * margin);
        let step = ((height * width) as f64 / most as f64).sqrt().ceil().max(1.0) as usize;
        let (rows, columns) = (height.div_ceil(step), width.div_ceil(step));
        let shrunk = f64::from(1u32 << level);
        let middle = |side: usize| side as f64 / 2.0 / shrunk - 0.5;
        let middle = (middle(full.width), middle(full.height));
        let half = size.height.max(size.width) as f64 / 2.0;
        let padded = padded(columns);
        let u = |column: usize| (((margin + column * step) as f64 - middle.0) / half) as f32;
        Self {
            size,
            level,
            step,
            margin,
            rows,
            columns,
            padded,
            middle,
            half,
            across: (0..padded).map(u).collect(),
            last: vec![0.0; rows * padded],
            gradient: [vec![0.0; rows * padded], vec![0.0; rows * padded]],
            steepness: vec![0.0; rows * padded],
        }
    }

    pub fn pixels(&self) -> usize {
        self.size.height * self.size.width
    }

    pub fn shorter(&self) -> f64 {
        self.size.height.min(self.size.width) as f64
    }

    /// Keeps what the next picture is compared with.
    pub fn remember(&mut self, picture: Picture<'_>) {
        let Picture { data, stride, width, .. } = picture;
        let Self { step, margin, columns, padded, last, gradient: [gx, gy], steepness, .. } = self;
        let rows = [last, gx, gy, steepness].map(|samples| samples.chunks_exact_mut(*padded));
        let [last, gx, gy, steepness] = rows;
        for (row, (((last, gx), gy), steepness)) in last.zip(gx).zip(gy).zip(steepness).enumerate() {
            let y = *margin + row * *step;
            let row = |y: usize| &data[y * stride..][..width];
            let (above, here, below) = (row(y - 1), row(y), row(y + 1));
            for column in 0..*columns {
                let x = *margin + column * *step;
                last[column] = here[x];
                gx[column] = 0.5 * (here[x + 1] - here[x - 1]);
                gy[column] = 0.5 * (below[x] - above[x]);
                steepness[column] = gx[column].abs() + gy[column].abs();
            }
        }
    }

    /// Whether the last picture had enough structure to be a background, and not a bird in an empty sky: much, or some that is spread
    /// out.
    pub fn has_structure(&self) -> bool {
        let steep = |sample: usize| self.steepness[sample] > STEEP;
        // The padding is even.
        let share = (0..self.steepness.len()).filter(|sample| steep(*sample)).count() as f64
            / (self.rows * self.columns) as f64;
        let with_any = |column: &usize| (0..self.rows).any(|row| steep(row * self.padded + column));
        let broad = || (0..self.columns).filter(with_any).count() as f64 >= BROAD * self.columns as f64;
        share >= MUCH || (share >= SOME && broad())
    }

    /// Residuals of all samples under a motion, in rows with their padding, which is left alone. Returns how many
    /// samples stay inside the picture.
    pub fn compare(
        &self,
        level: Level,
        picture: Picture<'_>,
        motion: &Motion,
        offset: f32,
        residuals: &mut [f32],
    ) -> usize {
        let step = ((1.0 + motion.stretch) * self.step as f64, motion.turn * self.step as f64);
        let step = (step.0 as f32, step.1 as f32);
        let mut inside = 0;
        for row in 0..self.rows {
            let place = motion.carry((self.margin as f64, (self.margin + row * self.step) as f64));
            let line = Line { start: (place.0 as f32, place.1 as f32), step };
            let samples = row * self.padded..row * self.padded + self.columns;
            inside += compare(level, picture, line, offset, &self.last[samples.clone()], &mut residuals[samples]);
        }
        inside
    }

    /// Mean absolute residual under a whole shift, where every pixel is a sample.
    pub fn disagreement(&self, level: Level, picture: Picture<'_>, offset: f32, (dx, dy): (isize, isize)) -> f64 {
        let margin = self.margin as isize;
        let first = (-margin - dx).max(0);
        let columns = (self.columns as isize).min(picture.width as isize - margin - dx) - first;
        let (mut sum, mut rows) = (0.0, 0);
        for row in 0..self.rows {
            let y = row as isize + margin + dy;
            if (0..picture.height as isize).contains(&y) {
                let now = y as usize * picture.stride + (first + margin + dx) as usize;
                let last = row * self.padded + first as usize;
                let (now, last) = (&picture.data[now..][..columns as usize], &self.last[last..][..columns as usize]);
                sum += f64::from(disagreement(level, now, last, offset));
                rows += 1;
            }
        }
        sum / (rows * columns) as f64
    }

    /// Sums up the normal equations of Gauss-Newton. The padding of the residuals holds [`OUTSIDE`].
    pub fn normal(&self, level: Level, scale: f32, residuals: &[f32], sums: &mut [f64; SUMS]) {
        debug_assert!(self.padded == self.columns || residuals[self.columns] == OUTSIDE);
        for row in 0..self.rows {
            let v = ((self.margin + row * self.step) as f64 - self.middle.1) / self.half;
            let samples = row * self.padded..(row + 1) * self.padded;
            let [gx, gy] = self.gradient.each_ref().map(|gradient| &gradient[samples.clone()]);
            normal(level, scale, (&self.across, v as f32), [&residuals[samples.clone()], gx, gy], sums);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_and_samples() {
        let scales = scales(Size::new(270, 480), (8192, 4096));
        let shapes: Vec<_> = scales.iter().map(|s| (s.size.height, s.size.width, s.step, s.margin)).collect();
        assert_eq!(shapes, [(270, 480, 4, 4), (135, 240, 3, 2), (67, 120, 2, 1), (33, 60, 1, 1)]);
        assert_eq!(scales[0].middle, (239.5, 134.5));
        assert_eq!(scales[3].middle, (29.5, 16.375));
        for (height, width) in [(16, 16), (16, 300), (47, 64), (64, 47), (48, 48)] {
            let levels = super::scales(Size::new(height, width), (8192, 4096));
            let levels: Vec<usize> = levels.iter().map(|scale| scale.level).collect();
            assert_eq!(levels, if height.min(width) < 48 { [0, 0] } else { [0, 1] });
        }
    }
}
