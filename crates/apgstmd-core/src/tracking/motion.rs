//! Constant velocity with random changes, seen with noise: a Kalman filter in the plane.
//!
//! Place and velocity along x and y obey the same equations with the same noise, so one 2 x 2 covariance serves both.
//! The background's motion is a known displacement: velocities are relative to the background, places are in the picture.

use serde::{Deserialize, Serialize};

use crate::params::TrackingParams;
use crate::stage::background::Motion as Ego;

/// Variances, px and frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    /// Of a detection's place.
    pub detection: f64,
    /// Of the place of a maximum of the response.
    pub guide: f64,
    /// Of the change of velocity in a frame.
    acceleration: f64,
    /// Of the velocity at birth.
    velocity: f64,
}

impl Noise {
    pub fn new(params: &TrackingParams, v_opt: f64) -> Self {
        Self {
            detection: params.noise.powi(2),
            guide: params.guide_noise.powi(2),
            acceleration: (params.acceleration * v_opt).powi(2),
            velocity: (params.velocity_spread * v_opt).powi(2),
        }
    }
}

/// Where something is, how it moves, and how well both are known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Motion {
    pub place: (f64, f64),
    pub velocity: (f64, f64),
    /// Var(place), cov(place, velocity), var(velocity) along each axis.
    covariance: [f64; 3],
}

impl Motion {
    pub fn is_sound(&self) -> bool {
        let pairs = [self.place, self.velocity];
        pairs.iter().flat_map(|(x, y)| [x, y]).chain(&self.covariance).all(|value| value.is_finite())
    }

    pub fn begin(place: (f64, f64), velocity: (f64, f64), noise: &Noise) -> Self {
        Self { place, velocity, covariance: [noise.detection, 0.0, noise.velocity] }
    }

    /// To the frame `steps` later, the background having moved by `ego` in all of them together: it carries the place
    /// along, and the velocity turns and grows with it. Uncertainty is taken not to.
    pub fn predict(&mut self, steps: u32, ego: &Ego, noise: &Noise) {
        let n = f64::from(steps);
        let (x, y) = ego.carry(self.place);
        self.velocity = ego.turned(self.velocity);
        self.place = (x + n * self.velocity.0, y + n * self.velocity.1);
        let [place, both, velocity] = self.covariance;
        // The sum over steps of what [1/4, 1/2, 1] of one step becomes in the steps after it.
        let a = noise.acceleration;
        self.covariance = [
            place + 2.0 * n * both + n * n * velocity + a * (n * (4.0 * n * n - 1.0) / 12.0),
            both + n * velocity + a * n * n / 2.0,
            velocity + a * n,
        ];
    }

    /// Takes in a place that was seen with this variance.
    pub fn update(&mut self, seen: (f64, f64), variance: f64) {
        let [place, both, velocity] = self.covariance;
        let spread = place + variance;
        let (gain, gain_velocity) = (place / spread, both / spread);
        let (dx, dy) = (seen.0 - self.place.0, seen.1 - self.place.1);
        self.place = (self.place.0 + gain * dx, self.place.1 + gain * dy);
        self.velocity = (self.velocity.0 + gain_velocity * dx, self.velocity.1 + gain_velocity * dy);
        self.covariance = [(1.0 - gain) * place, (1.0 - gain) * both, velocity - gain_velocity * both];
    }

    /// Variance of the place along each axis.
    pub fn variance(&self) -> f64 {
        self.covariance[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn still() -> Ego {
        Ego::still(crate::Size::new(101, 201))
    }

    fn noise(acceleration: f64) -> Noise {
        Noise { detection: 4.0, guide: 9.0, acceleration, velocity: 1e6 }
    }

    /// Without acceleration and with nothing known of the velocity it is the straight line of least squares.
    #[test]
    fn is_least_squares_on_a_line() {
        let seen = [3.0, 4.5, 4.0, 7.5, 8.0, 8.5, 11.0];
        let quiet = noise(0.0);
        let mut motion = Motion::begin((seen[0], -seen[0]), (0.0, 0.0), &quiet);
        for x in &seen[1..] {
            motion.predict(1, &still(), &quiet);
            motion.update((*x, -x), quiet.detection);
        }
        let n = seen.len() as f64;
        let t = |i: usize| i as f64 - (n - 1.0) / 2.0;
        let mean = seen.iter().sum::<f64>() / n;
        let spread: f64 = (0..seen.len()).map(|i| t(i).powi(2)).sum();
        let slope = seen.iter().enumerate().map(|(i, x)| t(i) * x).sum::<f64>() / spread;
        let last = mean + slope * t(seen.len() - 1);
        // The prior velocity weighs 4 / 1e6.
        assert!((motion.place.0 - last).abs() < 1e-4 && (motion.velocity.0 - slope).abs() < 1e-4, "{motion:?}");
        assert!((motion.place.1 + last).abs() < 1e-4 && (motion.velocity.1 + slope).abs() < 1e-4);
        let expected = 4.0 * (1.0 / n + t(seen.len() - 1).powi(2) / spread);
        assert!((motion.variance() - expected).abs() < 1e-3, "{} {expected}", motion.variance());
    }

    #[test]
    fn a_shift_moves_the_place_and_not_the_velocity() {
        let noise = noise(0.01);
        let mut calm = Motion::begin((10.0, 20.0), (1.0, -0.5), &noise);
        let mut shaken = calm;
        calm.predict(1, &still(), &noise);
        shaken.predict(1, &Ego { shift: (7.0, -3.0), ..still() }, &noise);
        assert_eq!(shaken.place, (calm.place.0 + 7.0, calm.place.1 - 3.0));
        assert_eq!((shaken.velocity, shaken.covariance), (calm.velocity, calm.covariance));
    }

    #[test]
    fn place_and_velocity_turn_with_the_background() {
        let noise = noise(0.01);
        // A quarter of a turn clockwise about (100, 50), to twice the size.
        let ego = Ego { stretch: -1.0, turn: 2.0, ..still() };
        let mut motion = Motion::begin((110.0, 50.0), (1.0, 0.0), &noise);
        motion.predict(1, &ego, &noise);
        assert_eq!((motion.place, motion.velocity), ((100.0, 72.0), (0.0, 2.0)));
    }

    #[test]
    fn several_steps_are_so_many_single_ones() {
        let noise = noise(0.3);
        for steps in 1..20 {
            let mut single = Motion::begin((10.0, 20.0), (1.0, -0.5), &noise);
            single.predict(1, &still(), &noise);
            let mut several = single;
            let shift = |times: u32| Ego { shift: (0.5 * f64::from(times), -2.0 * f64::from(times)), ..still() };
            (0..steps).for_each(|_| single.predict(1, &shift(1), &noise));
            several.predict(steps, &shift(steps), &noise);
            assert_eq!((several.place, several.velocity), (single.place, single.velocity));
            for (a, b) in several.covariance.iter().zip(single.covariance) {
                assert!((a - b).abs() < 1e-12 * b, "{steps}: {a} {b}");
            }
        }
    }

    #[test]
    fn uncertainty_grows_while_nothing_is_seen() {
        let noise = noise(0.01);
        let mut motion = Motion::begin((0.0, 0.0), (1.0, 0.0), &noise);
        for _ in 0..50 {
            motion.predict(1, &still(), &noise);
            motion.update(motion.place, noise.detection);
        }
        let settled = motion.variance();
        let mut last = settled;
        for _ in 0..30 {
            motion.predict(1, &still(), &noise);
            assert!(motion.variance() > last);
            last = motion.variance();
        }
        assert!(settled < noise.detection && last > 4.0 * settled);
    }
}
