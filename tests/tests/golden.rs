//! Naive model and fast core against golden data, stage by stage, neither helped by the other.

use std::fs;

use apgstmd_core::params::RejectionMode;
use apgstmd_core::{Detector, Model, Params, SimdLevel, Size, Stage};
use apgstmd_tests::compare::{Floors, RELATIVE, difference, maps};
use apgstmd_tests::golden::{Golden, own_params};
use apgstmd_tests::naive::Naive;
use apgstmd_tests::naive::map::{Map, peak};
use apgstmd_tests::outputs;
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
        let e = maps(&fast.probe().stage(Stage::E).expect("apg-STMD has it"));
        let floor = floors.of(&seen, &e);
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

/// What `apgstmd run` finds is what it found when the tables were kept.
#[test]
fn outputs_are_those_of_this_version() {
    let mut told = String::new();
    for (name, flags) in outputs::RUNS {
        // The others are held together by `agreement` and the suite `machine`.
        let levels = SimdLevel::available().filter(|level| name == "practical" || *level == SimdLevel::best());
        for level in levels {
            let tables = outputs::tables(flags, Some(level.name())).unwrap();
            for (table, now) in outputs::TABLES.iter().zip(&tables) {
                let before = fs::read_to_string(outputs::folder().join(format!("{name}.{table}.csv"))).unwrap();
                assert!(before.lines().count() > 10, "{name}: there is something to compare");
                let changes = outputs::changes(&before, now);
                if !changes.is_empty() {
                    told += &format!("{name}, {table}, {level}: {} rows, such as\n", changes.len());
                    changes.iter().take(5).for_each(|change| told += &format!("    {change}\n"));
                }
            }
        }
    }
    assert!(
        told.is_empty(),
        "numbers have changed:\n{told}If they were meant to: cargo run -p apgstmd-tests --bin make-golden -- outputs, and a line under \
         Numerics in CHANGELOG.md"
    );
}

/// What is told of a change: the number, before and now; rounding is none.
#[test]
fn changes_of_outputs_are_told() {
    let head = "frame,name,time_s,x,y,score,direction_rad,trace,speed,size,contrast";
    let before = format!("{head}\n80,a,0.8,10.0,20.0,0.5,3.14159,4,1,5,\n80,a,0.8,50.0,20.0,0.2,0,7,1,5,\n");
    assert_eq!(
        outputs::changes(&before, &before.replace("10.0,20.0,0.5,3.14159,4", "10.001,20.0,0.5002,-3.14159,9")),
        [""; 0]
    );
    let told = outputs::changes(&before, &before.replace("0.5,3.14", "0.6,3.14"));
    assert_eq!(told, ["frame 80 at (10.0, 20.0): score 0.5 -> 0.6"]);
    let told = outputs::changes(&before, &before.replace("50.0,", "40.0,"));
    assert!(
        told.len() == 2 && told[0].starts_with("no longer there: 80,a,0.8,50.0") && told[1].starts_with("new: "),
        "{told:?}"
    );
    assert!(outputs::changes(&before, &before.replace(",size", ",side"))[0].starts_with("the columns were frame,"));
}
