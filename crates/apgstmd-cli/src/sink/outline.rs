//! The border of the region in which targets are looked for, to be drawn upon pictures.

use apgstmd_core::{Region, Size};
use serde::Serialize;

/// Lines at most: the border of a mask of specks is drawn coarsely.
const MOST: usize = 20_000;

/// Lines along the edges of pixels, each from (x, y) to (x, y), px from the corner of the picture. The picture's own border is
/// none of them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Outline(pub Vec<[usize; 4]>);

impl Outline {
    /// Of a region.
    pub fn of(region: &Region) -> Self {
        let mut coarse = 1;
        loop {
            let lines = lines(region, coarse);
            if lines.len() <= MOST {
                return Self(lines);
            }
            coarse *= 2;
        }
    }
}

/// With squares of `coarse` pixels, which are inside where any of their pixels is.
fn lines(region: &Region, coarse: usize) -> Vec<[usize; 4]> {
    let Size { height, width } = region.size();
    let (rows, columns) = (height.div_ceil(coarse), width.div_ceil(coarse));
    let mut inside = vec![false; rows * columns];
    for y in 0..height {
        for x in 0..width {
            inside[y / coarse * columns + x / coarse] |= region.contains(x as f32, y as f32);
        }
    }
    let inside = |x: usize, y: usize| inside[y * columns + x];
    let mut lines = Vec::new();
    for y in 1..rows {
        for run in runs(columns, |x| inside(x, y) != inside(x, y - 1)) {
            lines.push([run.0 * coarse, y * coarse, (run.1 * coarse).min(width), y * coarse]);
        }
    }
    for x in 1..columns {
        for run in runs(rows, |y| inside(x, y) != inside(x - 1, y)) {
            lines.push([x * coarse, run.0 * coarse, x * coarse, (run.1 * coarse).min(height)]);
        }
    }
    lines
}

/// From where to where something is so without a gap.
fn runs(length: usize, so: impl Fn(usize) -> bool) -> Vec<(usize, usize)> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for place in (0..length).filter(|place| so(*place)) {
        match runs.last_mut() {
            Some((_, end)) if *end == place => *end += 1,
            _ => runs.push((place, place + 1)),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use apgstmd_core::Rectangle;
    use ndarray::Array2;

    fn of(rectangles: &[Rectangle]) -> Vec<[usize; 4]> {
        Outline::of(&Region::from_rectangles(Size::new(20, 30), rectangles).unwrap()).0
    }

    #[test]
    fn edges_inside_the_picture() {
        let corner = Rectangle { x: 0, y: 0, width: 12, height: 5 };
        assert_eq!(of(&[corner]), [[0, 5, 12, 5], [12, 0, 12, 5]]);
        let middle = Rectangle { x: 20, y: 8, width: 4, height: 6 };
        let sides = [[20, 8, 24, 8], [20, 14, 24, 14], [20, 8, 20, 14], [24, 8, 24, 14]];
        assert_eq!(of(&[middle]), sides);
        assert_eq!(of(&[Rectangle { x: 0, y: 0, width: 99, height: 99 }]), [[0; 4]; 0]);
    }

    #[test]
    fn lines_are_bounded() {
        let specks = Array2::from_shape_fn((400, 403), |(y, x)| (x * 7 + y * 13) % 5 < 2);
        let outline = Outline::of(&Region::from_mask(specks.view()).unwrap());
        assert!(outline.0.len() <= MOST, "{}", outline.0.len());
        assert!(outline.0.iter().all(|[x, y, u, v]| *u <= 403 && *v <= 400 && x <= u && y <= v));
    }
}
