//! Where things move: the centre of a rectangle as a function of time.

use serde::{Deserialize, Serialize};

/// A path, in pixels (pixel centres at integers) and seconds since the thing's first frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum Path {
    /// A straight line at constant speed. Speed 0 (the default) stands still.
    Straight {
        /// Centre at the first frame, (x, y) px.
        start: [f64; 2],
        /// Speed, px/s.
        #[serde(default)]
        speed: f64,
        /// Direction, radians counter-clockwise on the screen: 0 = right, pi/2 = up.
        #[serde(default)]
        direction: f64,
    },
    /// A straight line with a sinusoidal sideways displacement, first to the left of the direction.
    Sinusoidal {
        /// Centre at the first frame, (x, y) px.
        start: [f64; 2],
        /// Speed along the line, px/s.
        speed: f64,
        /// Direction of the line, radians counter-clockwise on the screen.
        #[serde(default)]
        direction: f64,
        /// Greatest sideways displacement, px.
        amplitude: f64,
        /// Swings per second, Hz.
        frequency: f64,
    },
    /// A circle at constant speed.
    Circular {
        /// Centre of the circle, (x, y) px.
        center: [f64; 2],
        /// Radius, px.
        radius: f64,
        /// Speed, px/s: positive runs counter-clockwise on the screen, negative clockwise.
        speed: f64,
        /// Where on the circle it starts, radians counter-clockwise on the screen: 0 = right of the centre.
        #[serde(default)]
        angle: f64,
    },
    /// Straight lines from point to point at constant speed; it stays at the last one.
    Waypoints {
        /// The points, (x, y) px.
        points: Vec<[f64; 2]>,
        /// Speed, px/s.
        speed: f64,
        /// Whether it returns from the last point to the first and goes on.
        #[serde(default)]
        closed: bool,
    },
}

impl Path {
    /// Centre after `seconds`, (x, y) px.
    pub fn at(&self, seconds: f64) -> (f64, f64) {
        match self {
            Self::Straight { start, speed, direction } => {
                let (cos, sin) = unit(*direction);
                (start[0] + speed * seconds * cos, start[1] - speed * seconds * sin)
            }
            Self::Sinusoidal { start, speed, direction, amplitude, frequency } => {
                let (cos, sin) = unit(*direction);
                let along = speed * seconds;
                let left = amplitude * libm::sin(std::f64::consts::TAU * frequency * seconds);
                (start[0] + along * cos - left * sin, start[1] - along * sin - left * cos)
            }
            Self::Circular { center, radius, speed, angle } => {
                let (cos, sin) = unit(angle + speed * seconds / radius);
                (center[0] + radius * cos, center[1] - radius * sin)
            }
            Self::Waypoints { points, speed, closed } => along(points, speed * seconds, *closed),
        }
    }
}

/// (cos, sin), exact on the axes: a target that moves to the right must not drift by 1e-16 px a frame.
fn unit(angle: f64) -> (f64, f64) {
    let quarters = angle / std::f64::consts::FRAC_PI_2;
    let near = quarters.round();
    if (quarters - near).abs() < 1e-12 {
        match near.rem_euclid(4.0) as u8 {
            0 => (1.0, 0.0),
            1 => (0.0, 1.0),
            2 => (-1.0, 0.0),
            _ => (0.0, -1.0),
        }
    } else {
        (libm::cos(angle), libm::sin(angle))
    }
}

fn along(points: &[[f64; 2]], distance: f64, closed: bool) -> (f64, f64) {
    let legs = if closed { points.len() } else { points.len() - 1 };
    let leg = |i: usize| (points[i], points[(i + 1) % points.len()]);
    let length = |(a, b): ([f64; 2], [f64; 2])| libm::hypot(b[0] - a[0], b[1] - a[1]);
    let mut left = distance;
    if closed {
        let round: f64 = (0..legs).map(|i| length(leg(i))).sum();
        left = if round > 0.0 { left.rem_euclid(round) } else { 0.0 };
    }
    for i in 0..legs {
        let (a, b) = leg(i);
        let part = length((a, b));
        if left < part {
            let share = left / part;
            return (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]));
        }
        left -= part;
    }
    let end = if closed { points[0] } else { points[points.len() - 1] };
    (end[0], end[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

    fn close(path: &Path, seconds: f64, expected: (f64, f64)) {
        let (x, y) = path.at(seconds);
        assert!((x - expected.0).abs() < 1e-9 && (y - expected.1).abs() < 1e-9, "({x}, {y}) is not {expected:?}");
    }

    #[test]
    fn straight_is_counter_clockwise_on_the_screen() {
        let path = |direction| Path::Straight { start: [10.0, 20.0], speed: 4.0, direction };
        assert_eq!(path(0.0).at(2.0), (18.0, 20.0));
        assert_eq!(path(FRAC_PI_2).at(2.0), (10.0, 12.0));
        assert_eq!(path(PI).at(2.0), (2.0, 20.0));
        assert_eq!(path(-FRAC_PI_2).at(2.0), (10.0, 28.0));
        close(&path(FRAC_PI_4), 1.0, (10.0 + 8f64.sqrt(), 20.0 - 8f64.sqrt()));
    }

    #[test]
    fn sinusoidal_swings_to_the_left_first() {
        let path = Path::Sinusoidal { start: [0.0, 50.0], speed: 8.0, direction: 0.0, amplitude: 3.0, frequency: 0.25 };
        close(&path, 1.0, (8.0, 47.0));
        close(&path, 2.0, (16.0, 50.0));
        close(&path, 3.0, (24.0, 53.0));
    }

    #[test]
    fn circular_goes_round() {
        let path = Path::Circular { center: [100.0, 80.0], radius: 10.0, speed: 10.0 * PI, angle: 0.0 };
        close(&path, 0.0, (110.0, 80.0));
        close(&path, 0.5, (100.0, 70.0));
        close(&path, 2.0, (110.0, 80.0));
        let clockwise = Path::Circular { center: [100.0, 80.0], radius: 10.0, speed: -10.0 * PI, angle: 0.0 };
        close(&clockwise, 0.5, (100.0, 90.0));
    }

    #[test]
    fn waypoints_stop_or_return() {
        let points = vec![[0.0, 0.0], [3.0, 4.0], [3.0, 10.0]];
        let open = Path::Waypoints { points: points.clone(), speed: 1.0, closed: false };
        close(&open, 2.5, (1.5, 2.0));
        close(&open, 5.0, (3.0, 4.0));
        close(&open, 7.0, (3.0, 6.0));
        close(&open, 99.0, (3.0, 10.0));
        let closed = Path::Waypoints { points, speed: 1.0, closed: true };
        let round = 11.0 + 109f64.sqrt();
        close(&closed, round + 2.5, (1.5, 2.0));
        close(&closed, 11.0 + 0.5 * 109f64.sqrt(), (1.5, 5.0));
    }
}
