//! No NaN and no infinity ever leaves: each parameter at each end of its range, and luminance at the ends of what floats hold.

use apgstmd_core::{Detector, Frame, FrameError, Model, Params, Preset, Response, Size};
use apgstmd_tests::boundary::is_finite;
use apgstmd_tests::stimulus::Scene;
use ndarray::Array2;

const SIZE: Size = Size::new(18, 21);

fn models() -> Vec<Params> {
    let practical = Params::preset(Preset::Practical);
    let all = Model::ALL.iter().map(|model| Params::for_model(*model));
    all.chain([practical]).map(|params| params.for_speed(1.0).expect("a valid speed")).collect()
}

/// One setting in so many is tried, where EXTREMES_EVERY asks for no other: all of them take some minutes. A prime, so that every
/// parameter has its turn in some model.
const EVERY: usize = 13;

/// The ends of a parameter's range, as its rule has them.
fn ends(rule: &str) -> Option<[f64; 2]> {
    let (_, rest) = rule.split_once("between ")?;
    let (low, high) = rest.split_once(" and ")?;
    Some([low.parse().ok()?, high.parse().ok()?])
}

#[test]
fn every_parameter_at_each_end() {
    let every = std::env::var("EXTREMES_EVERY").map_or(EVERY, |every| every.parse().expect("a number"));
    let scene = Scene::lively(SIZE, 1.0, 3);
    let (mut met, mut tried) = (0, 0);
    for params in models() {
        for field in Params::fields().filter(|field| field.section != "tracking") {
            for end in ends(&(field.rule)()).into_iter().flatten() {
                let mut all = toml::Table::try_from(&params).unwrap();
                let value = &mut all[field.section][field.name];
                *value = match value {
                    toml::Value::Integer(_) => toml::Value::Integer(end as i64),
                    toml::Value::Float(_) => toml::Value::Float(end),
                    _ => toml::Value::Array(vec![toml::Value::Float(end)]),
                };
                // Rules between parameters forbid some ends.
                let Ok(params) = Params::from_table(&all) else { continue };
                met += 1;
                if !usize::is_multiple_of(met, every) {
                    continue;
                }
                tried += 1;
                let mut detector = Detector::with_threads(SIZE, &params, 1).unwrap();
                let mut response = detector.make_response();
                for t in 0..12 {
                    detector.process_into(scene.frame(t).view(), &mut response).unwrap();
                    is_finite(&response);
                }
            }
        }
    }
    assert!(met > 700 && tried == met / every, "{tried} of {met}");
}

/// Responses are cubes of luminance, and small ones fall out of f32: to zero, not to NaN.
#[test]
fn luminance_of_any_magnitude() {
    let scene = Scene::lively(SIZE, 1.0, 3);
    for params in models() {
        let mut detector = Detector::with_threads(SIZE, &params, 1).unwrap();
        let mut response = detector.make_response();
        for scale in [0.0, 1e-45, 1e-30, 1e-9, 1.0] {
            for t in 0..8 {
                let frame = scene.luminance(t).mapv(|value| value as f32 * scale);
                detector.process_into(frame.view(), &mut response).unwrap();
                is_finite(&response);
            }
        }
    }
}

/// What is no luminance is refused, and leaves no trace.
#[test]
fn what_is_no_luminance() {
    let scene = Scene::lively(SIZE, 1.0, 3);
    let bits = |response: &Response| response.map.mapv(f32::to_bits);
    for params in models() {
        let [mut disturbed, mut other] = [0, 1].map(|_| Detector::with_threads(SIZE, &params, 1).unwrap());
        let mut response = disturbed.make_response();
        for t in 0..10 {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e30, -1e30, 1.01, -0.01] {
                let mut frame = scene.luminance(t);
                frame[[t, 20 - t]] = bad;
                for frame in [frame, Array2::from_elem((18, 21), bad)] {
                    let error = disturbed.process_into(Frame::from(frame.view()), &mut response).unwrap_err();
                    assert!(matches!(error, FrameError::NotFinite { .. } | FrameError::OutOfRange { .. }), "{error}");
                }
            }
            let frame = scene.frame(t);
            disturbed.process_into(frame.view(), &mut response).unwrap();
            assert_eq!(bits(&response), bits(&other.process(frame.view()).unwrap()), "frame {t}");
        }
    }
}
