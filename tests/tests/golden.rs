//! Naive model and fast core against golden data, stage by stage, neither helped by the other.

use apgstmd_core::params::RejectionMode;
use apgstmd_core::{Detector, Model, Params, Size, Stage};
use apgstmd_tests::compare::{Floors, RELATIVE, difference, maps};
use apgstmd_tests::golden::{Golden, own_params};
use apgstmd_tests::naive::Naive;
use apgstmd_tests::naive::map::{Map, peak};
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

/// Both models over the golden's frames; each is compared with the golden where it has stages.
fn agree(golden: &Golden, params: &Params) {
    let (_, height, width) = golden.frames.dim();
    let mut naive = Naive::new(params, 0.0);
    let mut fast = Detector::new(Size::new(height, width), params).expect("valid parameters");
    let mut response = fast.make_response();
    let mut floors = Floors::new(params);
    for t in 0..=*golden.stages.keys().last().expect("a golden has stages") {
        let seen = naive.step(&golden.luminance(t));
        fast.process_into(golden.frames.index_axis(Axis(0), t), &mut response).expect("a valid frame");
        let floor = floors.of(&seen);
        for (stage, truth) in golden.stages.get(&t).into_iter().flatten() {
            // float64 both; the golden is stored in f32, which rounds by 6e-8 of the value. 5e-7 was reached; no pixel
            // is excused.
            check(t, *stage, truth, &seen[*stage], |most| (1e-6 * most).max(NOTHING), 0.0);
            // The specification's bound. A pixel at the very edge of the attended region may fall on the other side in
            // f32: it excuses 0.5 % of the pixels.
            let given = maps(&fast.probe().stage(*stage).expect("apg-STMD has it"));
            check(t, *stage, truth, &given, |most| (RELATIVE * most).max(floor(*stage)), 0.005);
        }
    }
}

#[test]
fn independent() {
    match Golden::independent() {
        Some(golden) => agree(&golden, &independent_params()),
        None => println!("../shared/golden is not beside this checkout: nothing to compare with"),
    }
}

#[test]
fn own() {
    let golden = Golden::own();
    assert_eq!(golden.stages.values().map(Vec::len).sum::<usize>(), 2 * Model::ApgStmd.stages().len());
    // Attention and rejection must have had something to do, or the golden would show nothing of them.
    let (_, late) = golden.stages.last_key_value().expect("two frames");
    let most =
        |wanted: Stage| late.iter().filter(|(stage, _)| *stage == wanted).map(|(_, s)| peak(&maps(s))).sum::<f64>();
    let [a, kept] = [Stage::A, Stage::Ep].map(most);
    assert!(a > 1e-3 && kept > 1e-6, "A {a:e}, E' {kept:e}");
    agree(&golden, &own_params());
}
