//! Naive model and fast core against golden data, stage by stage, neither helped by the other.

use apgstmd_core::params::RejectionMode;
use apgstmd_core::{Detector, Params, Size, Stage};
use apgstmd_tests::compare::{Floors, RELATIVE, difference, maps};
use apgstmd_tests::golden::{Golden, own_params};
use apgstmd_tests::naive::map::{Map, peak};
use apgstmd_tests::naive::{Naive, Seen};
use ndarray::{Array3, Axis};

/// Values that rounding makes in the first frame, where L is exactly zero in theory: 1e-15 in float64, and then
/// raised to the third power.
const NOTHING: f64 = 1e-14;

/// The parameters of the independent golden.
fn independent_params() -> Params {
    let mut params = Params::default();
    params.rejection.mode = RejectionMode::Off;
    params
}

fn check(t: usize, stage: Stage, truth: &Array3<f32>, given: &[Map], tolerance: impl Fn(f64) -> f64, spare: f64) {
    let truth = maps(truth);
    let most = peak(&truth);
    let off = difference(&truth, given, tolerance(most));
    assert!(
        off.beyond as f64 <= spare * off.pixels as f64,
        "frame {t}, stage {stage}, maximum {most:e}, tolerance {:e}: {off:?}",
        tolerance(most)
    );
}

/// Runs the naive model over the golden's frames; `look` sees those that have stages.
fn with_naive(golden: &Golden, params: &Params, mut look: impl FnMut(usize, &Seen)) {
    let last = *golden.stages.keys().last().expect("a golden has stages");
    let mut naive = Naive::new(params, 0.0);
    for t in 0..=last {
        let seen = naive.step(&golden.luminance(t));
        look(t, &seen);
    }
}

fn naive_agrees(golden: &Golden, params: &Params) {
    with_naive(golden, params, |t, seen| {
        for (stage, truth) in golden.stages.get(&t).into_iter().flatten() {
            // float64 both; the golden is stored in f32, which rounds by 6e-8 of the value, and D is as small as 1e-40
            // in the first frames, where f32 has no digits. 5e-7 was reached; no pixel is excused.
            check(t, *stage, truth, &seen[*stage], |most| (1e-6 * most).max(NOTHING), 0.0);
        }
    });
}

fn fast_agrees(golden: &Golden, params: &Params) {
    let (_, height, width) = golden.frames.dim();
    let mut fast = Detector::new(Size::new(height, width), params).expect("valid parameters");
    let mut response = fast.make_response();
    let mut floors = Floors::new(params);
    with_naive(golden, params, |t, seen| {
        fast.process_into(golden.frames.index_axis(Axis(0), t), &mut response).expect("a valid frame");
        let floor = floors.of(seen);
        for (stage, truth) in golden.stages.get(&t).into_iter().flatten() {
            let given = maps(&fast.probe().stage(*stage));
            // The specification's bound. A pixel at the very edge of the attended region may fall on the other side in
            // f32: it excuses 0.5 % of the pixels.
            check(t, *stage, truth, &given, |most| (RELATIVE * most).max(floor(*stage)), 0.005);
        }
    });
}

#[test]
fn naive_against_independent() {
    match Golden::independent() {
        Some(golden) => naive_agrees(&golden, &independent_params()),
        None => println!("../shared/golden is not beside this checkout: nothing to compare with"),
    }
}

#[test]
fn fast_against_independent() {
    match Golden::independent() {
        Some(golden) => fast_agrees(&golden, &independent_params()),
        None => println!("../shared/golden is not beside this checkout: nothing to compare with"),
    }
}

#[test]
fn naive_against_own() {
    let golden = Golden::own();
    assert_eq!(golden.stages.values().map(Vec::len).sum::<usize>(), 2 * Stage::ALL.len());
    // Attention and rejection must have had something to do, or the golden would show nothing of them.
    let (_, late) = golden.stages.last_key_value().expect("two frames");
    let most =
        |wanted: Stage| late.iter().filter(|(stage, _)| *stage == wanted).map(|(_, s)| peak(&maps(s))).sum::<f64>();
    let [a, kept] = [Stage::A, Stage::Ep].map(most);
    assert!(a > 1e-3 && kept > 1e-6, "A {a:e}, E' {kept:e}");
    naive_agrees(&golden, &own_params());
}

#[test]
fn fast_against_own() {
    fast_agrees(&Golden::own(), &own_params());
}
