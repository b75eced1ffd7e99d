//! The background's motion on pictures large enough for a pyramid: the fast core against the naive model, on P of the
//! fast core, and what a cut does to everything that remembers.

use apgstmd_core::params::{BackgroundMotion, RejectionMode};
use apgstmd_core::{Bank, BankParams, Detector, Frame, Machine, Model, Params, Preset, Response, Size, Stage};
use apgstmd_tests::compare::maps;
use apgstmd_tests::naive::motion::{Background, Motion, middle};
use ndarray::Array2;

/// Waves of 6 to 300 px, longer ones stronger.
fn waves(x: f64, y: f64, seed: u64) -> f64 {
    let wave = |k: u64| {
        let hash = (seed * 64 + k).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let part = |shift: u32| f64::from((hash >> shift) as u16) / 65536.0;
        let length = 6.0 * 50f64.powf(part(0));
        let (sin, cos) = (std::f64::consts::TAU * part(16)).sin_cos();
        0.05 * (length / 60.0).sqrt() * (std::f64::consts::TAU * ((cos * x + sin * y) / length + part(32))).sin()
    };
    (0.5 + (0..30).map(wave).sum::<f64>()).clamp(0.0, 1.0)
}

/// A camera that shifts, turns and zooms more and more, with a dark target of 5 x 5 px before it.
fn frame(size: Size, seed: u64, t: usize) -> Array2<u8> {
    let s = t as f64;
    taken(size, seed, t, (0.2 * s * s, 2.0 * s), 0.003 * s * s, 1.01f64.powf(s))
}

/// A background that has moved by `shift`, turned by `angle` and grown by `zoom`.
fn taken(size: Size, seed: u64, t: usize, shift: (f64, f64), angle: f64, zoom: f64) -> Array2<u8> {
    let (cos, sin) = (angle.cos() / zoom, angle.sin() / zoom);
    let (mx, my) = middle((size.height, size.width));
    Array2::from_shape_fn((size.height, size.width), |(y, x)| {
        if x.abs_diff(20 + t) < 3 && y.abs_diff(40) < 3 {
            return 0;
        }
        let (u, v) = (x as f64 - mx - shift.0, y as f64 - my - shift.1);
        (255.0 * waves(cos * u - sin * v, sin * u + cos * v, seed)).round() as u8
    })
}

fn params(model: Model) -> Params {
    let mut params = Params::for_model(model).with_preset(Preset::Practical).for_speed(1.0).expect("a valid speed");
    params.rejection.mode = RejectionMode::Motion;
    params.rejection.background = BackgroundMotion::Similarity;
    params
}

#[test]
fn similarity_as_the_naive_model_has_it() {
    for (height, width) in [(50, 70), (100, 130), (150, 200), (270, 320)] {
        let size = Size::new(height, width);
        let params = params(Model::StmdPlus);
        let mut detector = Detector::with_threads(size, &params, 1).expect("valid parameters");
        let mut naive = Background::default();
        let (mut cuts, mut worst) = (0, 0.0f64);
        for t in 0..14 {
            // A cut before frame 10.
            let response = detector.process(Frame::from(frame(size, u64::from(t >= 10), t).view())).expect("a frame");
            let p = maps(&detector.probe().stage(Stage::P).expect("it has P")).swap_remove(0);
            let truth = naive.step(&p, &params);
            let ego = response.ego_motion;
            let (dx, dy) = response.background_shift;
            let given = Motion::new((f64::from(dx), f64::from(dy)), f64::from(ego.rotation), f64::from(ego.zoom));
            let shift = (given.shift.0 - truth.motion.shift.0).hypot(given.shift.1 - truth.motion.shift.1);
            let turn = (given.stretch - truth.motion.stretch).hypot(given.turn - truth.motion.turn);
            let error = shift.max(turn * width.max(height) as f64 / 2.0);
            // Steps below 1e-3 px end the search, and f32 may take one more or less.
            assert!(error < 2e-3, "{size:?}, frame {t}: {given:?} {truth:?}");
            assert_eq!((ego.unexplained, response.cut), (truth.unexplained, truth.cut), "{size:?}, frame {t}");
            assert!((f64::from(ego.residual) - truth.residual).abs() < 1e-4, "{ego:?} {truth:?}");
            cuts += usize::from(response.cut);
            assert_eq!(response.cut, t == 10, "{size:?}, frame {t}");
            // And as it is.
            if t > 0 && t != 10 && height >= 150 {
                let s = t as f64;
                let truth = Motion::new((0.2 * (2.0 * s - 1.0), 2.0), 0.003 * (2.0 * s - 1.0), 1.01);
                worst = worst.max((given.turn - truth.turn).hypot(given.stretch - truth.stretch));
            }
        }
        assert_eq!(cuts, 1);
        assert!(worst < 2e-3, "{size:?}: rotation and zoom are off by {worst}");
    }
}

fn same(a: &Response, b: &Response, what: &str) {
    assert_eq!(a.map, b.map, "{what}");
    let bits = |response: &Response| response.direction.mapv(f32::to_bits);
    assert_eq!(bits(a), bits(b), "{what}");
    // A direction may be NaN.
    assert_eq!(format!("{:?}", a.detections), format!("{:?}", b.detections), "{what}");
    assert_eq!((a.background_shift, a.ego_motion, a.cut), (b.background_shift, b.ego_motion, b.cut), "{what}");
}

#[test]
fn after_a_cut_everything_is_as_before_the_first_frame() {
    let size = Size::new(100, 130);
    for &model in Model::ALL {
        let params = params(model);
        let mut cut = Detector::with_threads(size, &params, 1).expect("valid parameters");
        let mut fresh = Detector::with_threads(size, &params, 1).expect("valid parameters");
        let mut detections = 0;
        for t in 0..24 {
            let response = cut.process(Frame::from(frame(size, u64::from(t >= 8), t % 8).view())).expect("a frame");
            assert_eq!(response.cut, t == 8, "{model}, frame {t}");
            if t == 8 {
                assert!(response.detections.is_empty());
            }
            if (8..16).contains(&t) {
                let mut expected = fresh.process(Frame::from(frame(size, 1, t % 8).view())).expect("a frame");
                let first = response.detections.iter().map(|found| found.trace).min().unwrap_or(0);
                let own = expected.detections.iter().map(|found| found.trace).min().unwrap_or(0);
                assert!(t == 8 || first >= own);
                // Numbers of traces go on.
                expected.detections.iter_mut().for_each(|found| found.trace += first - own);
                expected.cut = response.cut;
                same(&response, &expected, &format!("{model}, frame {t}"));
            }
            detections += response.detections.len();
        }
        assert!(detections > 0 || model == Model::Cascaded, "{model}");
    }
}

#[test]
fn blocks_are_cut_where_the_scene_is() {
    let size = Size::new(100, 130);
    let params = params(Model::ApgStmd);
    for first in [8, 9, 11, 12] {
        let frames: Vec<_> = (0..24).map(|t| frame(size, u64::from(t >= first), t % first)).collect();
        let machine = Machine { together: 4, ..Machine::with_threads(2) };
        let mut together = Detector::with_options(size, &params, &machine).expect("valid parameters");
        let mut alone = Detector::with_threads(size, &params, 1).expect("valid parameters");
        let views: Vec<_> = frames.iter().map(|frame| Frame::from(frame.view())).collect();
        let mut responses: Vec<_> = views.iter().map(|_| together.make_response()).collect();
        together.process_block(&views, &mut responses).expect("frames");
        assert!(responses[first].cut);
        for (t, (view, response)) in views.iter().zip(&responses).enumerate() {
            same(response, &alone.process(*view).expect("a frame"), &format!("cut at {first}, frame {t}"));
        }
    }
}

#[test]
fn a_bank_tells_what_its_finest_members_find() {
    let size = Size::new(100, 130);
    let base = params(Model::ApgStmd);
    let params = BankParams::with_members(base.clone(), &[1.0, 2.0], &[5.0, 10.0]);
    let mut bank = Bank::new(size, &params).expect("valid parameters");
    let mut alone = Detector::with_threads(size, &base, 1).expect("valid parameters");
    let (mut turned, mut cuts) = (0, 0);
    for t in 0..16 {
        let frame = frame(size, u64::from(t >= 8), t % 8);
        let [seen, expected] =
            [bank.process(frame.view()), alone.process(frame.view())].map(|seen| seen.expect("a frame"));
        assert_eq!(
            (seen.background_shift, seen.ego_motion, seen.cut),
            (expected.background_shift, expected.ego_motion, expected.cut),
            "frame {t}"
        );
        turned += usize::from(seen.ego_motion.rotation != 0.0);
        cuts += usize::from(seen.cut);
    }
    assert!(turned > 8 && cuts == 1, "{turned} frames turned, {cuts} cuts");
}

#[test]
fn a_target_before_a_turning_background_is_found() {
    let size = Size::new(150, 200);
    let detected = |background: BackgroundMotion| {
        let mut params = params(Model::ApgStmd);
        params.rejection.background = background;
        let mut detector = Detector::with_threads(size, &params, 1).expect("valid parameters");
        let (mut hits, mut others) = (0, 0);
        for t in 0..40 {
            let turned = taken(size, 3, t, (0.0, 0.0), 0.015 * t as f64, 1.0);
            let response = detector.process(Frame::from(turned.view())).expect("a frame");
            let near = |x: f32, y: f32| (x - (20 + t) as f32).hypot(y - 40.0) < 5.0;
            hits += response.detections.iter().filter(|found| near(found.x, found.y)).count();
            others += response.detections.iter().filter(|found| !near(found.x, found.y)).count();
        }
        (hits, others)
    };
    let (hits, others) = detected(BackgroundMotion::Similarity);
    let (_, still) = detected(BackgroundMotion::Off);
    assert!(hits >= 20 && 2 * others < still, "{hits} hits, {others} others; {still} others for a still background");
}
