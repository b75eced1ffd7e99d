//! Where the response says that a hidden target is.
//!
//! While nothing is detected, Q = E' + facilitation by earlier predictions still has a maximum where prediction expects
//! the target, the model's lag behind it.

use super::Observation;
use super::motion::Motion;

/// Standard deviations of the expected place within which the maximum is looked for, besides the lag: a target that
/// vanishes is detected for some frames where it vanished, which holds its track back by about so much.
const REACH: f64 = 2.0;
/// Greatest such distance, px.
const MOST: f64 = 8.0;
/// A maximum this close to a detection, px, is that one's.
const CLAIMED: f64 = 6.0;

/// The place of the target that the largest response around its expected place tells of, and that response; none where
/// the response has no peak there.
pub(super) fn response_near(expected: &Motion, shift: (f64, f64), seen: &Observation<'_>) -> Option<((f64, f64), f32)> {
    let map = seen.map?;
    let ahead = ahead(expected, shift, f64::from(seen.lag));
    let center = (expected.place.0 - ahead.0, expected.place.1 - ahead.1);
    let radius = (REACH * expected.variance().sqrt()).min(MOST) + ahead.0.hypot(ahead.1);
    let (height, width) = map.dim();
    let range = |center: f64, side: usize| {
        let end = ((center + radius).floor() + 1.0).clamp(0.0, side as f64) as usize;
        ((center - radius).ceil().clamp(0.0, side as f64) as usize)..end
    };
    let mut best: Option<(f32, usize, usize)> = None;
    for y in range(center.1, height) {
        for x in range(center.0, width) {
            let value = map[[y, x]];
            if value.is_finite() && value > best.map_or(0.0, |(most, ..)| most) {
                best = Some((value, y, x));
            }
        }
    }
    let (value, y, x) = best?;
    // The flank of something farther off is no peak.
    let around = (y.saturating_sub(1)..(y + 2).min(height))
        .flat_map(|v| (x.saturating_sub(1)..(x + 2).min(width)).map(move |u| map[[v, u]]));
    if around.into_iter().any(|neighbour| neighbour > value) {
        return None;
    }
    let place = (x as f64 + ahead.0, y as f64 + ahead.1);
    let near = |d: &crate::Detection| (f64::from(d.x) - place.0).hypot(f64::from(d.y) - place.1) < CLAIMED;
    (!seen.detections.iter().any(near)).then_some((place, value))
}

/// How far a target is ahead of its response.
fn ahead(motion: &Motion, shift: (f64, f64), lag: f64) -> (f64, f64) {
    let (vx, vy) = (motion.velocity.0 + shift.0, motion.velocity.1 + shift.1);
    let speed = vx.hypot(vy);
    if speed > 0.0 && lag.is_finite() { (lag * vx / speed, lag * vy / speed) } else { (0.0, 0.0) }
}

#[cfg(test)]
mod tests {
    use ndarray::Array2;

    use super::*;
    use crate::Detection;
    use crate::tracking::motion::Noise;

    fn expected(x: f64, y: f64) -> Motion {
        let noise = Noise::new(&crate::Params::default().tracking, 1.0);
        Motion::begin((x, y), (1.0, 0.0), &noise)
    }

    #[test]
    fn the_peak_behind_the_expected_place_tells_where_the_target_is() {
        let mut map = Array2::<f32>::zeros((40, 50));
        map[[21, 17]] = 0.5;
        map[[20, 17]] = 0.4;
        let seen = Observation { map: Some(map.view()), lag: 4.0, ..Observation::new(0, &[]) };
        assert_eq!(response_near(&expected(20.0, 20.0), (0.0, 0.0), &seen), Some(((21.0, 21.0), 0.5)));
        assert_eq!(response_near(&expected(40.0, 20.0), (0.0, 0.0), &seen), None, "too far off");
        let other = Detection { x: 22.0, y: 21.0, score: 1.0, direction: 0.0, ..Detection::default() };
        let claimed = Observation { detections: &[other], ..seen };
        assert_eq!(response_near(&expected(20.0, 20.0), (0.0, 0.0), &claimed), None, "another one's");
        for (x, y) in [(-500.0, 20.0), (f64::MAX, f64::MIN), (f64::NAN, 20.0)] {
            assert_eq!(response_near(&expected(x, y), (0.0, 0.0), &seen), None);
        }
    }

    #[test]
    fn a_flank_is_no_peak() {
        let map = Array2::from_shape_fn((40, 50), |(_, x)| x as f32);
        let seen = Observation { map: Some(map.view()), ..Observation::new(0, &[]) };
        assert_eq!(response_near(&expected(20.0, 20.0), (0.0, 0.0), &seen), None);
        let nothing = Array2::from_elem((40, 50), f32::NAN);
        let seen = Observation { map: Some(nothing.view()), ..seen };
        assert_eq!(response_near(&expected(20.0, 20.0), (0.0, 0.0), &seen), None);
    }
}
