//! The stream's contract: outputs may be used again dirty, `reset` forgets everything, an error changes nothing.

use apgstmd_core::params::RejectionMode;
use apgstmd_core::{
    Detection, Detector, Frame, FrameError, Model, Params, Preset, Rectangle, Region, Response, Size, Stage,
};
use apgstmd_tests::long;
use apgstmd_tests::stimulus::Scene;
use ndarray::{Array2, Array3};

const FRAMES: usize = 30;
const SIZE: Size = Size::new(37, 45);

/// A model, and where it looks.
#[derive(Clone)]
struct Setting {
    params: Params,
    region: Option<Region>,
}

fn settings() -> Vec<Setting> {
    let fast = |preset| Params::preset(preset).for_speed(1.0).expect("a valid speed");
    let mut contrast = fast(Preset::Paper);
    contrast.rejection.contrast_deviation = 0.01;
    let mut off = fast(Preset::Paper);
    off.rejection.mode = RejectionMode::Off;
    let models = Model::ALL.iter().map(|model| Params::for_model(*model).for_speed(1.0).expect("a valid speed"));
    let all = [fast(Preset::Practical), contrast, off].into_iter().chain(models);
    let part = Rectangle { x: 7, y: 5, width: 27, height: 19 };
    let region = Some(Region::from_rectangles(SIZE, &[part]).expect("not empty"));
    let bound = Setting { params: fast(Preset::Practical), region };
    all.map(|params| Setting { params, region: None }).chain([bound]).collect()
}

fn frames() -> Vec<Array2<u8>> {
    let scene = Scene::lively(SIZE, 1.0, 11);
    (0..FRAMES).map(|t| scene.frame(t)).collect()
}

fn detector(setting: &Setting) -> Detector {
    let mut detector = Detector::with_threads(SIZE, &setting.params, 2).expect("valid parameters");
    detector.look_in(setting.region.as_ref()).expect("of the same size");
    detector
}

/// Equal to the last bit, NaN included.
fn assert_same(a: &Response, b: &Response, what: &str) {
    let bits = |map: &Array2<f32>| map.mapv(f32::to_bits);
    assert_eq!(bits(&a.map), bits(&b.map), "{what}: map");
    assert_eq!(bits(&a.direction), bits(&b.direction), "{what}: direction");
    let bits = |found: &Detection| ([found.x, found.y, found.score, found.direction].map(f32::to_bits), found.trace);
    assert!(a.detections.iter().map(bits).eq(b.detections.iter().map(bits)), "{what}: detections");
    assert_eq!(a.background_shift, b.background_shift, "{what}: background shift");
}

fn stages(detector: &Detector) -> Vec<Array3<u32>> {
    let probe = detector.probe();
    let stage = |&stage: &Stage| probe.stage(stage).expect("the model says it has it").mapv(f32::to_bits);
    probe.stages().iter().map(stage).collect()
}

#[test]
fn a_dirty_output_is_as_good_as_a_fresh_one() {
    for setting in settings() {
        let (mut fresh, mut reused) = (detector(&setting), detector(&setting));
        let mut response = reused.make_response();
        let mut found = 0;
        for (t, frame) in frames().iter().enumerate() {
            response.map.fill(-7.0);
            response.direction.fill(3.0);
            response.background_shift = (9.0, 9.0);
            let junk = Detection { x: 1.0, y: 2.0, score: 3.0, direction: 4.0, trace: 5, ..Detection::default() };
            response.detections.extend([junk; 7]);
            reused.process_into(frame.view(), &mut response).expect("a valid frame");
            let truth = fresh.process(frame.view()).expect("a valid frame");
            assert_same(&truth, &response, &format!("frame {t}"));
            found += truth.detections.len();
        }
        assert!(found > 0, "nothing was detected, so little was compared");
        assert_eq!(stages(&fresh), stages(&reused));
    }
}

#[test]
fn a_reset_detector_is_a_new_one() {
    for setting in settings() {
        let (mut new, mut used) = (detector(&setting), detector(&setting));
        let other = Scene::lively(SIZE, 1.0, 99);
        // Any number of frames: rings stand at any position.
        for frames_before in [1, 7, 29] {
            for t in 0..frames_before {
                used.process(other.frame(t).view()).expect("a valid frame");
            }
            used.reset();
            assert_eq!(used.frames(), 0);
            assert!(stages(&used).iter().flatten().all(|bits| f32::from_bits(*bits) == 0.0));
            new.reset();
            for (t, frame) in frames().iter().enumerate() {
                let (a, b) = (new.process(frame.view()).unwrap(), used.process(frame.view()).unwrap());
                assert_same(&a, &b, &format!("after {frames_before}, frame {t}"));
            }
            assert_eq!(stages(&new), stages(&used));
        }
    }
}

/// Every kind of wrong frame, and a wrong output, in the middle of a clip.
#[test]
fn an_error_leaves_the_state_as_it_was() {
    let setting = &settings()[0];
    let (mut clean, mut disturbed) = (detector(setting), detector(setting));
    for (t, frame) in frames().iter().enumerate() {
        if t % 5 == 3 {
            let before = stages(&disturbed);
            for (name, result) in wrong(&mut disturbed) {
                let error = result.expect_err(name);
                assert!(!error.to_string().contains('\n'), "{name}: a message is one line: {error}");
            }
            assert_eq!(disturbed.frames(), t as u64);
            assert_eq!(before, stages(&disturbed), "frame {t}");
        }
        let (a, b) = (clean.process(frame.view()).unwrap(), disturbed.process(frame.view()).unwrap());
        assert_same(&a, &b, &format!("frame {t}"));
    }
}

fn wrong(detector: &mut Detector) -> Vec<(&'static str, Result<(), FrameError>)> {
    let Size { height, width } = SIZE;
    let mut response = detector.make_response();
    let mut with = |value: f32| {
        // The last pixel, so that a check on the way would have taken in all the others.
        let mut frame = Array2::<f32>::from_elem((height, width), 0.3);
        frame[[height - 1, width - 1]] = value;
        detector.process_into(frame.view(), &mut response)
    };
    let mut results = vec![
        ("NaN", with(f32::NAN)),
        ("infinity", with(f32::INFINITY)),
        ("above 1", with(200.0)),
        ("below 0", with(-0.5)),
    ];
    let small = Array2::<u8>::zeros((height - 1, width));
    results.push(("another size", detector.process_into(small.view(), &mut response)));
    let turned = Array2::<u8>::zeros((width, height));
    results.push(("turned", detector.process_into(turned.view(), &mut response)));
    let two = Array3::<u8>::zeros((height, width, 2));
    results.push(("two channels", detector.process_into(two.view(), &mut response)));
    let deep = Array2::<u16>::from_elem((height, width), 5000);
    results.push(("too deep", detector.process_into(Frame::from(deep.view()).with_bits(12), &mut response)));
    response.map = Array2::zeros((height, width + 1));
    let good = Array2::<u8>::zeros((height, width));
    results.push(("an output of another size", detector.process_into(good.view(), &mut response)));
    results
}

/// The same picture in every sample type is the same picture.
#[test]
fn sample_types_agree() {
    let setting = &settings()[0];
    let mut detectors: Vec<Detector> = (0..4).map(|_| detector(setting)).collect();
    for frame in frames().iter().take(12) {
        let unit = frame.mapv(|v| f64::from(v) / 255.0);
        let [a, b, c, d] = &mut detectors[..] else { unreachable!() };
        let truth = a.process(frame.view()).unwrap();
        let deep = frame.mapv(|v| u16::from(v) * 257);
        let colour = Array3::from_shape_fn((SIZE.height, SIZE.width, 3), |(y, x, _)| frame[[y, x]]);
        let given =
            [b.process(unit.view()).unwrap(), c.process(deep.view()).unwrap(), d.process(colour.view()).unwrap()];
        let most = truth.map.iter().fold(0.0f32, |a, b| a.max(*b));
        for given in given {
            // v / 255 is rounded once here, v * (1 / 255) twice there: one unit in the last place of luminance, which
            // the third power and the inhibitions raise to some 1e-5 of the strongest response.
            let off = (&given.map - &truth.map).iter().fold(0.0f32, |a, b| a.max(b.abs()));
            assert!(off <= 1e-4 * most.max(1e-8), "{off:e} of {most:e}");
        }
    }
}

/// After thousands of frames a detector is one that has seen only the last of them, to rounding; `make long` goes on for a
/// million.
#[test]
fn nothing_drifts() {
    let params = Params::preset(Preset::Practical).for_speed(1.0).expect("a valid speed");
    let mut samples = Vec::new();
    let drift = long::run(Size::new(24, 32), &params, 8000, 3000, |sample| samples.push(sample));
    assert!(drift.response < 1e-4 && drift.detections > 100 && drift.unmatched == 0, "{drift:?}");
    let grown = samples[9].resident.saturating_sub(samples[1].resident);
    assert!(grown < 2 << 20, "{samples:?}");
}
