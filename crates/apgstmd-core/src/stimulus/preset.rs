//! Ready-made scenes.

use std::f64::consts::PI;

use super::path::Path;
use super::scene::{Background, Scene, Shade, Target};

impl Scene {
    /// The paper's default stimulus: a black target of 5 x 5 px that crosses a white field of 500 x 250 px to the right
    /// at 250 px/s, filmed at 1000 Hz (0.25 px/frame).
    pub fn paper() -> Self {
        let path = Path::Straight { start: [2.0, 125.0], speed: 250.0, direction: 0.0 };
        Self { targets: vec![Target::new(path)], ..Self::default() }
    }

    /// Four small targets, dark and light, that move at about one pixel a frame before a slowly panning background of
    /// natural-scene statistics: 320 x 240 px, 150 frames.
    pub fn demo() -> Self {
        let rate = 60.0;
        let target = |width, height, shade, path| Target { width, height, shade, ..Target::new(path) };
        Self {
            width: 320,
            height: 240,
            rate,
            frames: 150,
            seed: 5,
            noise: 0.004,
            background: Background::Natural { mean: 0.5, contrast: 0.15, velocity: [-9.0, 3.0] },
            targets: vec![
                target(5.0, 5.0, Shade::Dark(0.4), Path::Straight { start: [60.0, 70.0], speed: rate, direction: 0.0 }),
                target(
                    4.0,
                    4.0,
                    Shade::Light(0.35),
                    Path::Straight { start: [280.0, 205.0], speed: 1.1 * rate, direction: 0.75 * PI },
                ),
                target(
                    6.0,
                    4.0,
                    Shade::Dark(0.3),
                    Path::Sinusoidal {
                        start: [250.0, 40.0],
                        speed: 0.95 * rate,
                        direction: PI,
                        amplitude: 8.0,
                        frequency: 0.5,
                    },
                ),
                target(
                    4.0,
                    5.0,
                    Shade::Dark(0.35),
                    Path::Circular { center: [100.0, 165.0], radius: 45.0, speed: rate, angle: -0.5 * PI },
                ),
            ],
            ..Self::default()
        }
    }
}
