//! What prediction does for a target on white: ahead of it, after a primer, and behind an occluder.
//!
//! Attention and rejection are off, so that E is what the target alone gives.

use std::f64::consts::{FRAC_PI_4, TAU};

use apgstmd_core::params::RejectionMode;
use apgstmd_core::stimulus::{Object, Path, Renderer, Scene, Shade, Target};
use apgstmd_core::{DIRECTIONS, Detector, Params, Size, Stage};
use ndarray::Array3;

/// 0.25 px/frame at the paper's 1000 Hz.
const SPEED: f64 = 250.0;
const FRAMES_PER_PX: f64 = 4.0;

/// Runs a scene; `look` sees E and Q of every frame from `from` on.
fn watch(scene: &Scene, from: usize, mut look: impl FnMut(usize, &Array3<f32>, &Array3<f32>)) {
    let mut params = Params::default();
    params.rejection.mode = RejectionMode::Off;
    params.attention.enabled = false;
    let renderer = Renderer::new(scene).expect("a valid scene");
    let mut detector =
        Detector::with_threads(Size::new(scene.height, scene.width), &params, 1).expect("valid parameters");
    let (mut frame, mut response) = (renderer.make_frame(), detector.make_response());
    for t in 0..scene.frames {
        renderer.frame_into(t, &mut frame);
        detector.process_into(frame.view(), &mut response).expect("a valid frame");
        if t >= from {
            look(t, &detector.probe().stage(Stage::E), &detector.probe().stage(Stage::Q));
        }
    }
}

fn straight(start: [f64; 2], direction: f64, luminance: f64) -> Target {
    let path = Path::Straight { start, speed: SPEED, direction };
    Target { shade: Shade::Luminance(luminance), ..Target::new(path) }
}

/// Largest value among the pixels that `counts` (x, y).
fn most(maps: &Array3<f32>, counts: impl Fn(f64, f64) -> bool) -> f64 {
    let inside = maps.indexed_iter().filter(|((_, y, x), _)| counts(*x as f64, *y as f64));
    f64::from(inside.map(|(_, value)| *value).fold(0.0, f32::max))
}

#[test]
fn ahead_of_the_target() {
    let scene = Scene {
        width: 90,
        height: 40,
        frames: 200,
        targets: vec![straight([14.0, 20.0], 0.0, 0.0)],
        ..Scene::default()
    };
    watch(&scene, 199, |t, e, q| {
        let target = 14.0 + t as f64 / FRAMES_PER_PX;
        // The response is about 5 px behind the target; what prediction adds lies before it.
        let gain = q - e;
        let peak = target - 5.0;
        let (ahead, behind) =
            (most(&gain, |x, _| x > peak + 2.0 && x < peak + 14.0), most(&gain, |x, _| x < peak - 2.0));
        assert!(ahead > 0.2 * most(e, |_, _| true), "Q exceeds E ahead of the target: {ahead}");
        // Gains of the last dt frames are summed, so those the target has passed count too.
        assert!(ahead > 1.3 * behind, "and less behind it: {ahead} {behind}");
    });
}

#[test]
fn primer_of_another_contrast() {
    let (switch, x0) = (120, 14.0 + 30.0);
    for probe in [0.7, 0.4] {
        let seen: Vec<(f64, f64)> = [1.0, 0.6, 0.3, 0.0]
            .into_iter()
            .map(|primer| {
                let first = Target { stop: Some(switch), ..straight([14.0, 20.0], 0.0, primer) };
                let second = Target { start: switch, ..straight([x0, 20.0], 0.0, probe) };
                let frames = switch + 100;
                let scene = Scene { width: 96, height: 40, frames, targets: vec![first, second], ..Scene::default() };
                let mut peaks = (0.0, 0.0);
                watch(&scene, frames - 12, |_, e, q| {
                    // Farther than the reach of retina, correlation and inhibition from what the primer ever covered.
                    let beyond = |x: f64, _: f64| x >= x0 + 17.0;
                    peaks = (f64::max(peaks.0, most(e, beyond)), f64::max(peaks.1, most(q, beyond)));
                });
                peaks
            })
            .collect();
        for pair in seen.windows(2) {
            assert!((pair[1].0 / pair[0].0 - 1.0).abs() < 1e-5, "E does not know the primer: {seen:?}");
            assert!(pair[1].1 > pair[0].1, "Q grows with the primer's contrast: {seen:?}");
        }
        // The cube of the contrast: the black primer adds at least some percent.
        assert!(seen[3].1 > 1.02 * seen[0].1, "{seen:?}");
    }
}

#[test]
fn primer_in_another_direction() {
    let (switch, corner) = (120, [50.0, 50.0]);
    for primer in [0, 1] {
        let angle = primer as f64 * FRAC_PI_4;
        let start = [corner[0] - 30.0 * angle.cos(), corner[1] + 30.0 * angle.sin()];
        let seen: Vec<(f64, f64)> = (0..DIRECTIONS)
            .map(|k| {
                let first = Target { stop: Some(switch), ..straight(start, angle, 0.0) };
                let second = Target { start: switch, ..straight(corner, k as f64 * FRAC_PI_4, 0.0) };
                let frames = switch + 84;
                let scene = Scene { width: 101, height: 101, frames, targets: vec![first, second], ..Scene::default() };
                let mut peaks = (0.0, 0.0);
                watch(&scene, switch + 44, |t, e, q| {
                    // Q while the primer's gain is fresh; E when a probe that goes back no longer meets the primer's wake.
                    if t < switch + 52 {
                        peaks.1 = f64::max(peaks.1, most(q, |_, _| true));
                    } else if t >= frames - 8 {
                        peaks.0 = f64::max(peaks.0, most(e, |_, _| true));
                    }
                });
                peaks
            })
            .collect();
        for parity in [0, 1] {
            let e = |k: usize| seen[k].0;
            let kind = || (parity..DIRECTIONS).step_by(2);
            let (least, largest) = (kind().map(e).fold(f64::MAX, f64::min), kind().map(e).fold(0.0, f64::max));
            // What is left of the corner, 80 frames on, and the turn itself.
            assert!(largest < 1.02 * least, "E is the same for all probes: {seen:?}");
        }
        for k in (0..DIRECTIONS).filter(|k| *k != primer && k % 2 == primer % 2) {
            assert!(seen[primer].1 > 1.02 * seen[k].1, "Q is largest along the primer: {primer} {k} {seen:?}");
        }
    }
}

/// A target on a circle passes behind a white occluder at its top. Peak of E before it; largest E, and largest Q, more
/// than 6 px inside the gap while the target is behind it; and Q at the far end 3 px before the target comes out.
fn occluded(radius: f64, gap_degrees: f64) -> [f64; 4] {
    let half = gap_degrees.to_radians() / 2.0;
    let approach = 60.0 / radius;
    let center = [radius + 16.0, radius + 16.0];
    let exit = (center[0] + radius * half.sin(), center[1] - radius * half.cos());
    let path = Path::Circular { center, radius, speed: -SPEED, angle: TAU / 4.0 + half + approach };
    let frames_to = |px: f64| (px * FRAMES_PER_PX).round() as usize;
    let (enters, leaves) = (frames_to(60.0), frames_to(60.0 + 2.0 * half * radius));
    let depth = radius * (1.0 - half.cos());
    let occluder = Object {
        width: 2.0 * radius * half.sin(),
        height: depth + 12.0,
        luminance: 1.0,
        start: 0,
        stop: None,
        path: Path::Straight { start: [center[0], center[1] - radius + depth / 2.0], speed: 0.0, direction: 0.0 },
    };
    let scene = Scene {
        width: (2.0 * center[0]) as usize,
        height: (center[1] + 24.0) as usize,
        frames: leaves - frames_to(3.0),
        targets: vec![Target::new(path)],
        occluders: vec![occluder],
        ..Scene::default()
    };
    let deep = |x: f64, _: f64| (x - center[0]).abs() < radius * half.sin() - 6.0;
    let (mut before, mut e_inside, mut q_inside, mut far): (f64, f64, f64, f64) = (0.0, 0.0, 0.0, 0.0);
    watch(&scene, enters - 40, |t, e, q| {
        if t < enters {
            before = before.max(most(e, |_, _| true));
        } else {
            e_inside = e_inside.max(most(e, deep));
            q_inside = q_inside.max(most(q, deep));
            far = most(q, |x, y| (x - exit.0).hypot(y - exit.1) < 8.0);
        }
    });
    [before, e_inside, q_inside, far]
}

#[test]
fn behind_an_occluder() {
    let [before, e, q, middle] = occluded(50.0, 30.0);
    assert!(e < 0.02 * before, "E dies in the gap: {e} of {before}");
    assert!(q > 0.1 * before, "Q goes on into it: {q} of {before}");
    let far = |radius, angle| occluded(radius, angle)[3];
    let by_angle = [far(50.0, 10.0), middle, far(50.0, 60.0)];
    assert!(by_angle.is_sorted_by(|a, b| a > b), "Q at the far end falls as the gap grows: {by_angle:?}");
    let by_radius = [far(30.0, 30.0), middle, far(100.0, 30.0)];
    assert!(by_radius.is_sorted_by(|a, b| a > b), "and as the circle grows: {by_radius:?}");
}
