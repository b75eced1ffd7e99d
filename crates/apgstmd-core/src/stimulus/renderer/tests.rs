use super::*;
use crate::stimulus::Path;

fn natural_scene(velocity: [f64; 2]) -> Scene {
    let background = Background::Natural { mean: 0.5, contrast: 0.15, velocity };
    Scene { width: 96, height: 64, rate: 60.0, frames: 40, background, ..Scene::default() }
}

fn straight(start: [f64; 2], speed: f64) -> Path {
    Path::Straight { start, speed, direction: 0.0 }
}

#[test]
fn background_moves_by_whole_pixels_and_returns() {
    let renderer = Renderer::new(&natural_scene([120.0, -60.0])).unwrap();
    let (now, next) = (renderer.frame(7), renderer.frame(8));
    assert!((1..64).all(|y| (0..94).all(|x| next[[y - 1, x + 2]] == now[[y, x]])));
    // The period is 128 x 64 px.
    assert_eq!(renderer.frame(0), renderer.frame(64));
    assert_ne!(renderer.frame(0), renderer.frame(63));
}

#[test]
fn background_moves_smoothly_between_pixels() {
    let renderer = Renderer::new(&natural_scene([6.0, 0.0])).unwrap();
    let step = |t: usize| {
        let difference = renderer.frame(t + 1) - renderer.frame(t);
        difference.mapv(|v| v * v).mean().unwrap().sqrt()
    };
    let steps: Vec<f32> = (0..10).map(step).collect();
    let mean = steps.iter().sum::<f32>() / 10.0;
    // Linear interpolation would show a step of every size from 0.7 to 1.3 of the mean here.
    assert!(steps.iter().all(|s| (s / mean - 1.0).abs() < 0.05), "{steps:?}");
}
