//! A camera that rolls, zooms and shakes before the background.

use serde::{Deserialize, Serialize};

use super::random::Random;

/// Streams of random numbers for the shaking; the noise of frames has those below.
const STREAM: u64 = 1 << 40;

/// How the camera moves the background, besides its velocity. Targets, objects and occluders keep their paths in the
/// picture, as if the camera followed them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Camera {
    /// Rotation of the picture about its middle, radians a second, counter-clockwise on the screen.
    pub roll: f64,
    /// Growth of the picture about its middle: its size is exp(zoom s) after s seconds.
    pub zoom: f64,
    /// Seconds after which roll and zoom are back where they began: forth for the first half, back for the other; 0: never.
    pub period: f64,
    /// Standard deviation of the place of each frame, in x and in y, px.
    pub shake: f64,
}

/// Where the background of a frame lies: turned and enlarged about the middle of the picture, then shifted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pose {
    /// Radians, counter-clockwise on the screen.
    pub angle: f64,
    pub zoom: f64,
    /// (right, down), px.
    pub shift: (f64, f64),
}

impl Pose {
    /// Where something at (u, v) from the middle at rest is.
    pub fn apply(&self, (u, v): (f64, f64)) -> (f64, f64) {
        let (cos, sin) = (self.zoom * libm::cos(self.angle), self.zoom * libm::sin(self.angle));
        (cos * u + sin * v + self.shift.0, cos * v - sin * u + self.shift.1)
    }

    /// Where at rest, from the middle, what is at (u, v) now lies.
    pub fn undo(&self, (u, v): (f64, f64)) -> (f64, f64) {
        let (cos, sin) = (libm::cos(self.angle) / self.zoom, libm::sin(self.angle) / self.zoom);
        let (u, v) = (u - self.shift.0, v - self.shift.1);
        (cos * u - sin * v, sin * u + cos * v)
    }
}

impl Camera {
    pub(super) fn is_still(&self) -> bool {
        *self == Self::default()
    }

    /// Frame `t`, `seconds` after the first.
    pub(super) fn pose(&self, seed: u64, t: usize, seconds: f64) -> Pose {
        let elapsed = if self.period > 0.0 {
            let phase = seconds.rem_euclid(self.period);
            phase.min(self.period - phase)
        } else {
            seconds
        };
        let shift = if self.shake > 0.0 {
            let mut random = Random::new(seed, STREAM + t as u64);
            (self.shake * random.normal(), self.shake * random.normal())
        } else {
            (0.0, 0.0)
        };
        Pose { angle: self.roll * elapsed, zoom: libm::exp(self.zoom * elapsed), shift }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forth_and_back() {
        let camera = Camera { roll: 2.0, zoom: 1.0, period: 1.0, shake: 0.0 };
        let angle = |seconds| camera.pose(1, 0, seconds).angle;
        assert_eq!([0.0, 0.25, 0.5, 0.75, 1.0].map(angle), [0.0, 0.5, 1.0, 0.5, 0.0]);
        let pose = Pose { shift: (3.0, -1.0), ..camera.pose(1, 0, 0.4) };
        let (u, v) = pose.undo(pose.apply((7.0, 5.0)));
        assert!((u - 7.0).abs() < 1e-12 && (v - 5.0).abs() < 1e-12);
        assert!((camera.pose(1, 0, 0.25).zoom - 0.25f64.exp()).abs() < 1e-12);
        let shaken = Camera { shake: 2.0, ..Camera::default() };
        assert_eq!(shaken.pose(1, 5, 0.1), shaken.pose(1, 5, 0.1));
        assert_ne!(shaken.pose(1, 5, 0.1).shift, shaken.pose(1, 6, 0.1).shift);
    }
}
