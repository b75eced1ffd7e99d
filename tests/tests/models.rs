//! What each model beside apg-STMD must show, on frames just large enough.

use apgstmd_core::params::{Localise, RejectionMode};
use apgstmd_core::{DIRECTIONS, Detector, MissingStage, Model, Params, Preset, Response, Size, Stage};
use apgstmd_tests::stimulus::{Background, Scene, Target};
use ndarray::{Axis, s};

const RELATIVES: [Model; 4] = [Model::StmdPlus, Model::Dstmd, Model::Cascaded, Model::Estmd];
const SPEED: f64 = 0.25;
const MIDDLE: f64 = 24.0;

/// The model without rejection, which on plain white has nothing to tell targets by.
fn accepting(model: Model) -> Params {
    let mut params = Params::for_model(model);
    params.rejection.mode = RejectionMode::Off;
    params
}

fn white(targets: Vec<Target>) -> Scene {
    Scene { size: Size::new(49, 49), background: Background::uniform(1.0), targets }
}

/// A target that meets the middle in frame 60.
fn through_the_middle(angle: f64, speed: f64, size: (f64, f64), luminance: f64) -> Target {
    let velocity = (speed * angle.cos(), -speed * angle.sin());
    let start = (MIDDLE - 60.0 * velocity.0, MIDDLE - 60.0 * velocity.1);
    Target { start, velocity, size, luminance }
}

fn watch(params: &Params, scene: &Scene, frames: usize, mut look: impl FnMut(usize, &Detector, &Response)) {
    // One thread: the frames are small.
    let mut detector = Detector::with_threads(scene.size, params, 1).expect("valid parameters");
    let mut response = detector.make_response();
    for t in 0..frames {
        detector.process_into(scene.luminance(t).view(), &mut response).expect("a valid frame");
        look(t, &detector, &response);
    }
}

fn most<'a>(values: impl IntoIterator<Item = &'a f32>) -> f64 {
    f64::from(values.into_iter().fold(0.0, |a: f32, b| a.max(*b)))
}

/// Largest response over time on the rows around the middle, once the first frames are over.
fn strongest(params: &Params, target: Target) -> f64 {
    let mut strongest: f64 = 0.0;
    watch(params, &white(vec![target]), 105, |t, _, response| {
        if t > 25 {
            strongest = strongest.max(most(response.map.slice(s![MIDDLE as usize - 4..=MIDDLE as usize + 4, ..])));
        }
    });
    strongest
}

#[test]
fn each_has_its_stages_and_names_them_when_asked_for_others() {
    for &model in Model::ALL {
        let detector = Detector::with_threads(Size::new(16, 20), &Params::for_model(model), 1).expect("valid");
        let probe = detector.probe();
        assert_eq!(probe.stages(), model.stages());
        for &stage in Stage::ALL {
            match probe.stage(stage) {
                Ok(maps) => {
                    assert!(model.stages().contains(&stage), "{model} has {stage}");
                    assert_eq!(maps.dim(), (stage.planes(), 16, 20));
                }
                Err(missing) => {
                    assert!(!model.stages().contains(&stage), "{model} has no {stage}");
                    assert_eq!(missing, MissingStage { stage, model });
                    let text = missing.to_string();
                    assert!(text.contains(model.name()) && text.contains("P, C, "), "{text}");
                }
            }
        }
    }
}

#[test]
fn stmd_plus_is_apg_stmd_without_attention_and_prediction() {
    let scene = Scene::lively(Size::new(50, 70), 1.0, 3);
    for mode in [RejectionMode::Off, RejectionMode::Contrast, RejectionMode::Motion] {
        let mut plus = Params::for_model(Model::StmdPlus).for_speed(1.0).expect("a valid speed");
        plus.rejection.mode = mode;
        plus.rejection.contrast_deviation = 0.01;
        // What it ignores may be anything.
        let apg = Params { model: Model::ApgStmd, ..plus.clone() };
        assert!(!apg.attention.enabled && !apg.prediction.enabled);
        (plus.attention.enabled, plus.prediction.enabled) = (true, true);
        let [mut plus, mut apg] = [plus, apg].map(|params| Detector::with_threads(scene.size, &params, 1).unwrap());
        assert_eq!(plus.lag(), apg.lag());
        let mut found = 0;
        for t in 0..40 {
            let [a, b] = [&mut plus, &mut apg].map(|detector| detector.process(scene.frame(t).view()).unwrap());
            for &stage in Model::StmdPlus.stages() {
                let [a, b] = [&plus, &apg].map(|d| d.probe().stage(stage).expect("both have it").mapv(f32::to_bits));
                assert!(a == b, "{mode:?}, frame {t}: {stage}");
            }
            assert_eq!(a.map, b.map, "{mode:?}, frame {t}");
            assert!(a.direction.mapv(f32::to_bits) == b.direction.mapv(f32::to_bits), "{mode:?}, frame {t}");
            assert_eq!((&a.detections, a.background_shift), (&b.detections, b.background_shift));
            found += a.detections.len();
        }
        assert!(found > 0, "{mode:?}: nothing was found, so little was compared");
    }
}

#[test]
fn directional_models_prefer_the_direction_of_motion() {
    for model in RELATIVES.into_iter().filter(|model| model.is_directional()) {
        for motion in 0..DIRECTIONS {
            let target = through_the_middle(motion as f64 * std::f64::consts::FRAC_PI_4, SPEED, (5.0, 5.0), 0.0);
            let mut curve = [0.0f64; DIRECTIONS];
            watch(&accepting(model), &white(vec![target]), 95, |t, detector, _| {
                // After onset, at which everything appears at once.
                if t > 25 {
                    let e = detector.probe().stage(Stage::E).expect("a directional model has E");
                    for (k, response) in curve.iter_mut().enumerate() {
                        *response = response.max(most(e.index_axis(Axis(0), k)));
                    }
                }
            });
            let best = (0..DIRECTIONS).max_by(|a, b| curve[*a].total_cmp(&curve[*b])).expect("8 directions");
            assert_eq!(best, motion, "{model}: {curve:?}");
            assert!(curve[(motion + 4) % DIRECTIONS] < 0.1 * curve[best], "{model}, motion {motion}: {curve:?}");
        }
    }
}

#[test]
fn estmd_has_no_direction() {
    let params = accepting(Model::Estmd);
    let mut maxima = Vec::new();
    for motion in 0..4 {
        let target = through_the_middle(f64::from(motion) * std::f64::consts::FRAC_PI_2, SPEED, (5.0, 5.0), 0.0);
        let mut found = 0;
        watch(&params, &white(vec![target]), 95, |_, detector, response| {
            assert_eq!(detector.lag(), 0.0);
            assert!(response.direction.iter().all(|direction| direction.is_nan()));
            assert!(response.detections.iter().all(|detection| detection.direction.is_nan()));
            // Without rejection the response is Y, all of it.
            let y = detector.probe().stage(Stage::Y).expect("ESTMD has Y");
            assert_eq!(response.map.view(), y.index_axis(Axis(0), 0));
            found += response.detections.len();
        });
        assert!(found > 50, "{found} detections");
        let mut maximum: f64 = 0.0;
        watch(&params, &white(vec![target]), 95, |_, _, response| maximum = maximum.max(most(&response.map)));
        maxima.push(maximum);
    }
    // The same picture, turned: only the order of sums differs.
    assert!(maxima.iter().all(|maximum| (maximum / maxima[0] - 1.0).abs() < 1e-4), "{maxima:?}");
    assert!(maxima[0] > 1e-4);
}

#[test]
fn localise_moves_what_has_a_direction_and_leaves_the_rest() {
    for model in RELATIVES {
        let mut behind = Vec::new();
        for localise in [Localise::Response, Localise::Target] {
            let mut params = accepting(model);
            params.detection.localise = localise;
            let target = through_the_middle(0.0, SPEED, (5.0, 5.0), 0.0);
            let mut offsets = Vec::new();
            watch(&params, &white(vec![target]), 96, |t, _, response| {
                // Over 9 px of path.
                if t >= 60 {
                    let first = response.detections.first().expect("an ideal target is detected");
                    assert!((f64::from(first.y) - MIDDLE).abs() < 0.1, "{model}: {first:?}");
                    offsets.push(target.center(t).0 - f64::from(first.x));
                }
            });
            behind.push(offsets.iter().sum::<f64>() / offsets.len() as f64);
        }
        assert!((2.0..9.0).contains(&behind[0]), "{model}: the response is {} px behind", behind[0]);
        if model.is_directional() {
            // The few frames averaged here lie on other fractions of a pixel than those of the measured lag.
            assert!(behind[1].abs() < 0.3, "{model}: the detection is {} px behind", behind[1]);
        } else {
            assert_eq!(behind[0], behind[1]);
        }
    }
}

#[test]
fn a_static_scene_is_nothing() {
    let background = Background { luminance: 0.5, texture: 0.3, velocity: (0.0, 0.0), seed: 5 };
    let still = Target { start: (20.0, 20.0), velocity: (0.0, 0.0), size: (5.0, 5.0), luminance: 0.0 };
    let scene = Scene { size: Size::new(40, 44), background, targets: vec![still] };
    for &model in Model::ALL {
        watch(&accepting(model), &scene, 40, |t, detector, response| {
            assert!(response.map.iter().all(|v| *v == 0.0) && response.detections.is_empty(), "{model}, frame {t}");
            let l = detector.probe().stage(Stage::L).expect("every model has L");
            assert!(l.iter().all(|l| *l == 0.0), "{model}, frame {t}");
        });
    }
}

#[test]
fn each_is_tuned_to_speed_and_to_small_targets() {
    for model in RELATIVES {
        let params = accepting(model);
        let at = |speed: f64, size: (f64, f64)| strongest(&params, through_the_middle(0.0, speed, size, 0.0));
        let response = at(SPEED, (5.0, 5.0));
        // Fast targets leave the picture early: 105 frames of 0.7 px/frame are still inside.
        for (speed, share) in [(0.08, 0.2), (0.7, 0.2)] {
            let other = at(speed, (5.0, 5.0));
            assert!(other < share * response, "{model} at {speed} px/frame: {other:e} of {response:e}");
        }
        // A bar higher than the picture, whose ends do not show, and a large square.
        // With A = 1, B = 3, e = 1 the lateral kernel is still positive along a thin line: an STMD answers to a bar with
        // two fifths, and only multiplication by ON and OFF that were inhibited themselves does better.
        for (size, share) in [((5.0, 70.0), 0.5), ((24.0, 24.0), 0.1)] {
            let other = at(SPEED, size);
            assert!(other < share * response, "{model}, {size:?} px: {other:e} of {response:e}");
        }
    }
}

/// Each signal that is multiplied in adds a power of contrast.
#[test]
fn degree_in_contrast() {
    for (model, degree) in [(Model::StmdPlus, 3), (Model::Dstmd, 3), (Model::Cascaded, 4), (Model::Estmd, 2)] {
        let at = |luminance| strongest(&accepting(model), through_the_middle(0.0, SPEED, (5.0, 5.0), luminance));
        let (full, half, tenth) = (at(0.0), at(0.5), at(0.9));
        assert!((half / full * 2f64.powi(degree) - 1.0).abs() < 0.01, "{model}: {half:e} of {full:e}");
        assert!((tenth / full * 10f64.powi(degree) - 1.0).abs() < 0.01, "{model}: {tenth:e} of {full:e}");
    }
}

/// Scaled to another speed, with its own rejection, among clutter that moves.
#[test]
fn a_target_is_found_at_the_speed_asked_for() {
    for model in RELATIVES {
        let mut params = Params::for_model(model).for_speed(1.0).expect("a valid speed");
        params.rejection.mode = RejectionMode::Motion;
        let scene = Scene {
            size: Size::new(49, 90),
            background: Background { luminance: 0.6, texture: 0.05, velocity: (-0.1, 0.0), seed: 9 },
            targets: vec![Target { start: (12.0, 24.0), velocity: (1.0, 0.0), size: (5.0, 5.0), luminance: 0.0 }],
        };
        let mut hits = 0;
        watch(&params, &scene, 60, |t, _, response| {
            let (x, y) = scene.targets[0].center(t);
            let near = |x0: f32, y0: f32| (f64::from(x0) - x).hypot(f64::from(y0) - y) < 6.0;
            hits += usize::from(response.detections.first().is_some_and(|first| near(first.x, first.y)));
        });
        assert!(hits >= 35, "{model}: in {hits} of 60 frames");
    }
}

#[test]
fn a_preset_is_of_apg_stmd() {
    assert_eq!(Params::preset(Preset::Paper), Params::for_model(Model::ApgStmd));
    assert_eq!(Params::for_model(Model::StmdPlus).rejection.mode, RejectionMode::Contrast);
    for model in [Model::Dstmd, Model::Cascaded, Model::Estmd] {
        assert_eq!(Params::for_model(model).rejection.mode, RejectionMode::Off);
    }
}
