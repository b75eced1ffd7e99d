//! The spot that moves with a response: where on the line of motion the target is, and how much it differs from its surround.
//!
//! How far the response peaks behind a target depends on what the bank is for: the target's speed against the member's, and
//! whether it is dark or light (a light one is seen at its leading edge where it is slow, and by its rebound, far behind,
//! where it is fast). So it is not assumed but looked at: P along the direction of motion through the response, as its
//! difference from what lies around, averaged over the trace. The background passes and averages out; what stays at
//! one distance from the response is the target.
//!
//! The difference is what all orientations agree on, as in attention: with each of four orientations the mean of the two
//! points `RING` px to either side is what lies around; it is the smallest of the four differences where all have one
//! sign, else 0. Edges and lines give nothing.

use serde::{Deserialize, Serialize};

use crate::memory::heap;
use crate::model::lag::{SIDE, covered};
use crate::params::RetinaParams;
use crate::plane::Plane;
use crate::row::bands::Bands;
use crate::stage::retina::Retina;

/// From the centre of the spot to its surround, px.
const RING: f32 = 4.5;
/// First place looked at: px ahead of the response.
const FIRST: i32 = -4;
/// Farthest place looked at beyond the lag of a dark target.
const BEYOND: f32 = 7.0;
/// Most places.
pub(super) const MOST: usize = 25;
/// Points of a trace over which differences are averaged.
const MEMORY: f32 = 30.0;

/// Differences from the surround along the direction of motion, one a pixel, averaged over a trace.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Profile {
    values: [f32; MOST],
    count: f32,
}

heap!(Profile);

/// Where the target is, and what it looks like.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// Distance ahead of the response, px.
    pub ahead: f32,
    /// Difference from the surround, luminance; negative where the target is dark.
    pub difference: f32,
}

/// Places to look at for a lag, FIRST on.
pub(super) fn places(lag: f32) -> usize {
    ((lag + BEYOND).ceil().max(1.0) as i32 - FIRST + 1).clamp(3, MOST as i32) as usize
}

/// How far from the response a target can be put, px.
pub(super) fn farthest(lag: f32) -> usize {
    (places(lag) as i32 + FIRST).max(-FIRST) as usize + 1
}

impl Profile {
    pub const EMPTY: Self = Self { values: [0.0; MOST], count: 0.0 };

    pub fn is_sound(&self) -> bool {
        self.values.iter().chain([&self.count]).all(|value| value.is_finite())
    }

    /// Adds what is seen along `direction` from (x, y).
    pub fn add(&mut self, p: &Plane, (x, y): (f32, f32), direction: f32, places: usize) {
        self.count += 1.0;
        let share = (1.0 / self.count).max(1.0 / MEMORY);
        let (dx, dy) = if direction.is_nan() { (0.0, 0.0) } else { (direction.cos(), -direction.sin()) };
        for (value, ahead) in self.values[..places].iter_mut().zip(FIRST..) {
            let ahead = ahead as f32;
            *value += share * (difference(p, x + ahead * dx, y + ahead * dy) - *value);
        }
    }

    /// The largest difference, none where it lies at an end: what goes on there is no spot. Without directions the response
    /// itself is the place.
    pub fn spot(&self, places: usize, directed: bool) -> Option<Spot> {
        let values = &self.values[..places];
        if !directed {
            return Some(Spot { ahead: 0.0, difference: values[0] });
        }
        let size = |index: usize| values[index].abs();
        // The first of equal ones.
        let best = (1..places).fold(0, |best, index| if size(index) > size(best) { index } else { best });
        if best == 0 || best == places - 1 {
            return None;
        }
        let (before, here, after) = (size(best - 1), size(best), size(best + 1));
        let bend = before - 2.0 * here + after;
        let between = if bend < 0.0 { ((before - after) / (2.0 * bend)).clamp(-0.5, 0.5) } else { 0.0 };
        Some(Spot { ahead: (FIRST + best as i32) as f32 + between, difference: values[best] })
    }
}

/// P at (x, y) against its surround.
fn difference(p: &Plane, x: f32, y: f32) -> f32 {
    const DIAGONAL: f32 = RING * std::f32::consts::FRAC_1_SQRT_2;
    const AROUND: [(f32, f32); 4] = [(RING, 0.0), (DIAGONAL, DIAGONAL), (0.0, RING), (-DIAGONAL, DIAGONAL)];
    let here = at(p, x, y);
    let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
    for (dx, dy) in AROUND {
        let surround = 0.5 * (at(p, x + dx, y + dy) + at(p, x - dx, y - dy));
        (least, most) = (least.min(surround), most.max(surround));
    }
    if here > most {
        here - most
    } else if here < least {
        here - least
    } else {
        0.0
    }
}

/// Between the pixels; beyond the border, what is at it.
fn at(p: &Plane, x: f32, y: f32) -> f32 {
    let (width, height) = (p.size().width, p.size().height);
    let (x, y) = (x.clamp(0.0, (width - 1) as f32), y.clamp(0.0, (height - 1) as f32));
    let (left, top) = ((x as usize).min(width - 2), (y as usize).min(height - 2));
    let (fx, fy) = (x - left as f32, y - top as f32);
    let (above, below) = (&p.row(top)[left..left + 2], &p.row(top + 1)[left..left + 2]);
    let upper = above[0] + fx * (above[1] - above[0]);
    let lower = below[0] + fx * (below[1] - below[0]);
    upper + fy * (lower - upper)
}

/// What the ideal target looks like.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ideal {
    /// Its difference from the surround at contrast 1.
    pub difference: f32,
}

impl Ideal {
    pub fn new(params: &RetinaParams) -> Self {
        const CENTER: usize = 20;
        let size = crate::frame::Size::new(2 * CENTER + 1, 2 * CENTER + 1);
        let (mut luminance, mut p) = (Plane::new(size), Plane::new(size));
        let share = |place: usize| covered(place as f64, CENTER as f64);
        debug_assert!(SIDE < CENTER as f64);
        for y in 0..size.height {
            for (x, value) in luminance.row_mut(y).iter_mut().enumerate() {
                *value = 1.0 - (share(x) * share(y)) as f32;
            }
        }
        Retina::new(params, 1).process(&Bands::single(), &luminance, &mut p);
        Self { difference: difference(&p, CENTER as f32, CENTER as f32).abs() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Size;

    fn picture(value: impl Fn(f32, f32) -> f32) -> Plane {
        let mut p = Plane::new(Size::new(48, 64));
        for y in 0..48 {
            for (x, out) in p.row_mut(y).iter_mut().enumerate() {
                *out = value(x as f32, y as f32);
            }
        }
        p
    }

    #[test]
    fn spots_differ_and_edges_do_not() {
        let bump = |x: f32, y: f32| (-((x - 30.0).powi(2) + (y - 20.0).powi(2)) / 8.0).exp();
        assert!((difference(&picture(|x, y| 0.2 + 0.5 * bump(x, y)), 30.0, 20.0) - 0.46).abs() < 0.01);
        assert!((difference(&picture(|x, y| 0.8 - 0.5 * bump(x, y)), 30.0, 20.0) + 0.46).abs() < 0.01);
        assert_eq!(difference(&picture(|x, _| if x < 30.0 { 0.1 } else { 0.9 }), 30.0, 20.0), 0.0);
        assert_eq!(difference(&picture(|x, _| if x == 30.0 { 0.1 } else { 0.9 }), 30.0, 20.0), 0.0);
        assert_eq!(difference(&picture(|_, _| 0.4), -5.0, 99.0), 0.0);
    }

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn the_target_is_found_ahead_dark_or_light_and_clutter_passes() {
        for sign in [-1.0, 1.0] {
            let mut profile = Profile::EMPTY;
            let places = places(5.1);
            let mut found = None;
            for t in 0..40 {
                let target = 12.0 + t as f32;
                // Specks at rest, as strong as the target, on its way.
                let p = picture(|x, y| {
                    let speck = |u: f32| (-((x - u).powi(2) + (y - 20.0).powi(2)) / 6.0).exp();
                    0.5 + sign * 0.2 * speck(target) + 0.2 * (speck(24.0) - speck(37.0))
                });
                profile.add(&p, (target - 7.3, 20.0), 0.0, places);
                found = profile.spot(places, true);
            }
            let spot = found.unwrap();
            assert!((spot.ahead - 7.3).abs() < 0.5, "{spot:?}");
            assert!(spot.difference * sign > 0.1, "{spot:?}");
        }
    }

    #[test]
    fn what_is_brightest_at_an_end_is_no_spot() {
        let mut profile = Profile::EMPTY;
        let p = picture(|x, y| 0.5 + 0.3 * (-((x - 10.0).powi(2) + (y - 20.0).powi(2)) / 8.0).exp());
        profile.add(&p, (14.5, 20.0), 0.0, places(5.1));
        assert!(profile.spot(places(5.1), true).is_none());
    }
}
