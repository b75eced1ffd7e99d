//! What the paper's experiments on uniform backgrounds must show, on frames just large enough.
//!
//! Tuning is a property of E, so attention is off there (it feeds E back into the luminance, and at 0.1 px/frame it
//! more than doubles E); so is rejection, which on plain white has nothing to tell targets by.

use apgstmd_core::params::{Localise, RejectionMode};
use apgstmd_core::{DIRECTIONS, Detector, Params, Size, Stage};
use apgstmd_tests::stimulus::{Background, Scene, Target};
use ndarray::{Array2, Array3, Axis};

const DEFAULT_SPEED: f64 = 0.25;

fn params() -> Params {
    let mut params = Params::default();
    params.rejection.mode = RejectionMode::Off;
    params.attention.enabled = false;
    params
}

/// Where only E is asked for: prediction without attention does not change it.
fn up_to_e() -> Params {
    let mut params = params();
    params.prediction.enabled = false;
    params
}

fn white(size: Size, target: Target) -> Scene {
    Scene { size, background: Background::uniform(1.0), targets: vec![target] }
}

/// A black target that runs to the right along row `AXIS`.
fn runner(speed: f64, size: (f64, f64)) -> Target {
    Target { start: (12.0, AXIS as f64), velocity: (speed, 0.0), size, luminance: 0.0 }
}

const AXIS: usize = 17;
const LANE: Size = Size::new(2 * AXIS + 1, 64);

/// Runs a scene; `look` sees E and Q of every frame.
fn watch(scene: &Scene, params: &Params, frames: usize, mut look: impl FnMut(usize, &Array3<f32>, &Array3<f32>)) {
    // One thread: the frames are small.
    let mut detector = Detector::with_threads(scene.size, params, 1).expect("valid parameters");
    let mut response = detector.make_response();
    for t in 0..frames {
        detector.process_into(scene.luminance(t).view(), &mut response).expect("a valid frame");
        let [e, q] = [Stage::E, Stage::Q].map(|stage| detector.probe().stage(stage).expect("apg-STMD has it"));
        look(t, &e, &q);
    }
}

fn most<'a>(values: impl IntoIterator<Item = &'a f32>) -> f64 {
    f64::from(values.into_iter().fold(0.0, |a: f32, b| a.max(*b)))
}

/// Largest E over space, directions and time.
fn strongest(scene: &Scene, params: &Params, frames: usize) -> f64 {
    let mut strongest: f64 = 0.0;
    watch(scene, params, frames, |_, e, _| strongest = strongest.max(most(e)));
    strongest
}

/// Largest E on the path's axis.
fn strongest_on_axis(target: Target, frames: usize) -> f64 {
    let mut strongest: f64 = 0.0;
    watch(&white(LANE, target), &up_to_e(), frames, |_, e, _| {
        strongest = strongest.max(most(e.index_axis(Axis(1), AXIS)));
    });
    strongest
}

/// The argument for which `value` is largest, and that value.
fn best(arguments: &[f64], value: impl Fn(f64) -> f64) -> (f64, f64) {
    let values = arguments.iter().map(|&argument| (argument, value(argument)));
    values.max_by(|a, b| a.1.total_cmp(&b.1)).expect("arguments")
}

#[test]
fn size_of_the_response() {
    // The figure in the specification, 8.65e-4, is for a target whose edges lie in the middle of pixels across the
    // path (an odd height in a frame of even height); with edges between pixels it is 1.00e-3. The maximum comes
    // shortly after onset and depends on where the target starts by half a percent.
    let target = Target { start: (12.0, 16.5), ..runner(DEFAULT_SPEED, (5.0, 5.0)) };
    let response = strongest(&white(Size::new(34, 56), target), &up_to_e(), 90);
    assert!((response / 8.65e-4 - 1.0).abs() < 0.01, "{response:e}");
}

#[test]
fn contrast() {
    let at = |luminance: f64, params: &Params| {
        let target = Target { luminance, ..runner(DEFAULT_SPEED, (5.0, 5.0)) };
        strongest(&white(LANE, target), params, 80)
    };
    // E is homogeneous of degree 3 in contrast, attention included: its region is relative to the strongest prediction.
    let mut attentive = params();
    attentive.attention.enabled = true;
    for params in [up_to_e(), attentive] {
        let ratio = at(0.5, &params) / at(0.0, &params);
        assert!((ratio / 0.125 - 1.0).abs() < 0.01, "E(0.5) / E(1) = {ratio}");
    }
    let curve: Vec<f64> = [0.9, 0.7, 0.5, 0.3, 0.1, 0.0].iter().map(|&luminance| at(luminance, &up_to_e())).collect();
    assert!(curve.is_sorted_by(|a, b| a < b), "{curve:?}");
}

#[test]
fn velocity() {
    // Slow targets need time to reach their full response: 25 px of path, at most 300 frames.
    let at = |speed: f64| strongest_on_axis(runner(speed, (5.0, 5.0)), ((25.0 / speed) as usize).clamp(60, 300));
    let (speed, response) = best(&[0.15, 0.2, 0.225, 0.25, 0.275, 0.3, 0.4, 0.5], at);
    assert!((0.2..=0.275).contains(&speed), "the maximum is at {speed} px/frame");
    for (speed, share) in [(0.1, 0.2), (0.8, 0.02)] {
        let other = at(speed);
        assert!(other < share * response, "at {speed} px/frame: {other:e} of {response:e}");
    }
}

#[test]
fn width_and_height() {
    let sides = [2.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 11.0];
    let width = |width: f64| strongest_on_axis(runner(DEFAULT_SPEED, (width, 5.0)), 90);
    let (side, response) = best(&sides, width);
    assert!((5.0..=8.0).contains(&side), "the maximum is at width {side}");
    let wide = width(18.0);
    assert!(wide < 0.08 * response, "at width 18: {wide:e} of {response:e}");

    let height = |height: f64| strongest_on_axis(runner(DEFAULT_SPEED, (5.0, height)), 90);
    let (side, response) = best(&sides, height);
    assert!((5.0..=7.0).contains(&side), "the maximum is at height {side}");
    let high = height(13.0);
    assert!(high < 0.06 * response, "at height 13: {high:e} of {response:e}");
}

#[test]
fn direction() {
    let mut maxima = [0.0; DIRECTIONS];
    for (motion, maximum) in maxima.iter_mut().enumerate() {
        let (sin, cos) = (motion as f64 * std::f64::consts::FRAC_PI_4).sin_cos();
        let velocity = (DEFAULT_SPEED * cos, -DEFAULT_SPEED * sin);
        let start = (24.0 - 40.0 * velocity.0, 24.0 - 40.0 * velocity.1);
        let scene = white(Size::new(49, 49), Target { start, velocity, size: (5.0, 5.0), luminance: 0.0 });
        let mut curve = [0.0f64; DIRECTIONS];
        watch(&scene, &up_to_e(), 85, |_, e, _| {
            for (preferred, response) in curve.iter_mut().enumerate() {
                *response = response.max(most(e.index_axis(Axis(0), preferred)));
            }
        });
        let (preferred, response) = (0..DIRECTIONS).map(|k| (k, curve[k])).max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert_eq!(preferred, motion, "{curve:?}");
        let opposite = curve[(motion + 4) % DIRECTIONS];
        assert!(opposite < 0.1 * response, "motion {motion}: opposite {opposite:e} of {response:e}");
        *maximum = response;
    }
    for axis in [0, 2, 4, 6] {
        // The same picture, turned: only the order of sums differs.
        assert!((maxima[axis] / maxima[0] - 1.0).abs() < 1e-4, "{maxima:?}");
    }
    for diagonal in [1, 3, 5, 7] {
        // In each diagonal the target meets the pixel grid alike.
        assert!((maxima[diagonal] / maxima[1] - 1.0).abs() < 1e-4, "{maxima:?}");
    }
}

/// Diagonals against axes. A square at an integer place lies on the grid in the way that is best for the axes (edges
/// between pixels all along the path); half a pixel across it is the worst. Between the two lie the diagonals.
#[test]
fn diagonals_are_near_the_axes() {
    let at = |velocity: (f64, f64), offset: f64| {
        let start = (24.0 - 40.0 * velocity.0, 24.0 - 40.0 * velocity.1 + offset);
        strongest(
            &white(Size::new(49, 49), Target { start, velocity, size: (5.0, 5.0), luminance: 0.0 }),
            &up_to_e(),
            85,
        )
    };
    let half = DEFAULT_SPEED * std::f64::consts::FRAC_1_SQRT_2;
    let mean =
        |velocity: (f64, f64)| [0.0, 0.25, 0.5, 0.75].iter().map(|&offset| at(velocity, offset)).sum::<f64>() / 4.0;
    let (axis, diagonal) = (mean((DEFAULT_SPEED, 0.0)), mean((half, -half)));
    assert!((diagonal / axis - 1.0).abs() < 0.1, "diagonal {diagonal:e}, axis {axis:e}");
}

/// At a place on the path: E comes and peaks within 7 to 8 frames, Q builds up long before.
#[test]
fn facilitation_over_time() {
    let place = [0, AXIS, 38];
    let (mut e, mut q) = (Vec::new(), Vec::new());
    watch(&white(LANE, runner(DEFAULT_SPEED, (5.0, 5.0))), &params(), 150, |_, e_map, q_map| {
        e.push(f64::from(e_map[place]));
        q.push(f64::from(q_map[place]));
    });
    let rise = |curve: &[f64]| {
        let highest = curve.iter().copied().fold(0.0, f64::max);
        let onset = curve.iter().position(|v| *v > 0.01 * highest).expect("a response");
        let at = curve.iter().position(|v| *v == highest).expect("a response");
        (highest, at - onset)
    };
    let ((e_most, e_rise), (q_most, q_rise)) = (rise(&e), rise(&q));
    assert!((7..=8).contains(&e_rise), "E rises over {e_rise} frames");
    assert!(q_rise >= 40, "Q rises over {q_rise} frames");
    assert!((2.0..=2.3).contains(&(q_most / e_most)), "Q / E = {}", q_most / e_most);
}

/// Nothing moves: exactly nothing is answered, from the first frame on.
#[test]
fn a_static_scene_gives_nothing() {
    let background = Background { luminance: 0.5, texture: 0.3, velocity: (0.0, 0.0), seed: 5 };
    let still = Target { velocity: (0.0, 0.0), ..runner(0.0, (5.0, 5.0)) };
    let scene = Scene { size: LANE, background, targets: vec![still] };
    let mut attentive = params();
    attentive.attention.enabled = true;
    for base in [params(), attentive] {
        let params = base.for_speed(1.0).expect("a valid speed");
        watch(&scene, &params, 40, |t, e, q| assert_eq!((most(e), most(q)), (0.0, 0.0), "frame {t}"));
    }
}

/// The light goes on, off, on and off and flickers: E stays exactly 0 wherever the picture is uniform.
#[test]
fn a_change_of_light_gives_nothing() {
    let lights: [fn(usize) -> f64; 4] = [
        |t| if t < 10 { 0.8 } else { 0.2 },
        |t| if t < 10 { 0.2 } else { 0.8 },
        |t| if (10..30).contains(&t) { 0.1 } else { 0.9 },
        |t| 0.5 + 0.4 * (0.2 * t as f64).sin(),
    ];
    let mut strongest: f64 = 0.0;
    for light in lights {
        let mut detector = Detector::new(Size::new(20, 30), &params()).expect("valid parameters");
        let mut delayed: f64 = 0.0;
        for t in 0..90 {
            let response = detector.process(Array2::from_elem((20, 30), light(t)).view()).expect("a valid frame");
            assert!(response.map.iter().all(|v| *v == 0.0) && response.detections.is_empty(), "frame {t}");
            assert!(response.direction.iter().all(|v| v.is_nan()), "frame {t}: no response has no direction");
            delayed = delayed.max(most(&detector.probe().stage(Stage::D).expect("apg-STMD has it")));
        }
        strongest = strongest.max(delayed);
    }
    // Inhibition says nothing, not blindness: after dark comes light, and D responds.
    assert!(strongest > 1e-4, "D reached only {strongest:e}");
}

/// `lag` against the truth: how far behind the target, its middle, the response of an ideal target peaks.
#[test]
fn lag_of_an_ideal_target() {
    for speed in [0.25, 0.5, 1.0, 2.0, 4.0] {
        let mut params = params().for_speed(speed).expect("a valid speed");
        let frames = (40.0 / speed) as usize;
        let scene = white(LANE, runner(speed, (5.0, 5.0)));
        let mut behind = Vec::new();
        for localise in [Localise::Response, Localise::Target] {
            params.detection.localise = localise;
            let mut detector = Detector::new(LANE, &params).expect("valid parameters");
            let mut offsets = Vec::new();
            for t in 0..frames {
                let response = detector.process(scene.luminance(t).view()).expect("a valid frame");
                // Once the response has settled, over whole pixels of path.
                if t >= frames * 7 / 10 {
                    let first = response.detections.first().expect("an ideal target is detected");
                    assert!((f64::from(first.y) - AXIS as f64).abs() < 0.1 && first.direction.abs() < 0.1, "{first:?}");
                    offsets.push(scene.targets[0].center(t).0 - f64::from(first.x));
                }
            }
            behind.push(offsets.iter().sum::<f64>() / offsets.len() as f64);
            if localise == Localise::Target {
                // 5.1 px at the default speed; the few frames averaged here lie on other fractions of a pixel.
                let lag = f64::from(detector.lag());
                assert!((lag - behind[0]).abs() < 0.25, "speed {speed}: lag {lag}, truth {}", behind[0]);
            }
        }
        assert!(behind[1].abs() < 0.25, "speed {speed}: the detection is {} px behind the target", behind[1]);
    }
}
