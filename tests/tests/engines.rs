//! The recursive gamma cascade against the weighted sums over past frames.

use apgstmd_core::params::{RejectionMode, TemporalEngine};
use apgstmd_core::{Detector, Params, Probe, Size, Stage};
use apgstmd_tests::compare::{LUMINANCE_ROUNDING, difference, maps};
use apgstmd_tests::naive::map::{Map, peak};
use apgstmd_tests::stimulus::Scene;

const TEMPORAL: [Stage; 6] = [Stage::L, Stage::Tm3, Stage::Tm2, Stage::Mi1, Stage::Tm1_4, Stage::Tm1_5];

fn seen(probe: &Probe<'_>, stage: Stage) -> Vec<Map> {
    maps(&probe.stage(stage).expect("apg-STMD has it"))
}

fn agree(params: &Params, speed: f64, frames: usize, what: &str) {
    let scene = Scene::lively(Size::new(32, 48), speed, 21);
    let mut engines = [TemporalEngine::Cascade, TemporalEngine::Fir].map(|engine| {
        let mut params = params.clone();
        params.engine.temporal = engine;
        Detector::with_threads(scene.size, &params, 2).expect("valid parameters")
    });
    let mut most_l: f64 = 0.0;
    for t in 0..frames {
        for detector in &mut engines {
            detector.process(scene.frame(t).view()).expect("a valid frame");
        }
        let [cascade, fir] = [&engines[0], &engines[1]].map(|engine| engine.probe());
        for stage in TEMPORAL {
            let (a, b) = (seen(&fir, stage), seen(&cascade, stage));
            // Asked for: 1e-5 of the maximum. In the first frames, where hardly anything has moved yet, the rounding
            // of P_e itself (each engine sums it in its own order) is more than that.
            let tolerance = (1e-5 * peak(&a)).max(2.0 * LUMINANCE_ROUNDING);
            let off = difference(&a, &b, tolerance);
            assert_eq!(off.beyond, 0, "{what}, frame {t}, stage {stage}, maximum {:e}: {off:?}", peak(&a));
        }
        most_l = most_l.max(peak(&seen(&fir, Stage::L)));
    }
    // The bound above must have been the relative one for most of the time.
    assert!(most_l > 0.05, "{what}: L reached only {most_l}");
}

/// Without attention: with it, one last bit of M may switch a pixel of the attended region.
fn plain() -> Params {
    let mut params = Params::default();
    params.attention.enabled = false;
    params.rejection.mode = RejectionMode::Off;
    params
}

#[test]
fn at_every_speed() {
    for speed in [0.25, 0.4, 0.5, 1.0, 1.7, 2.0, 4.0, 8.0] {
        let params = plain().for_speed(speed).expect("a valid speed");
        // Three times the slowest delay, and a target that stays in the picture meanwhile.
        let frames = ((30.0 / speed) as usize).clamp(12, 120);
        agree(&params, speed, frames, &format!("speed {speed}"));
    }
}

#[test]
fn no_shared_poles() {
    let mut params = plain();
    (params.lamina.fast_order, params.lamina.fast_tau) = (3, 1.3);
    (params.lamina.slow_order, params.lamina.slow_tau) = (4, 7.0);
    (params.medulla.mi1_order, params.medulla.mi1_tau) = (1, 4.0);
    (params.medulla.tm1_4_order, params.medulla.tm1_4_tau) = (12, 9.0);
    (params.medulla.tm1_5_order, params.medulla.tm1_5_tau) = (24, 30.0);
    agree(&params, 0.5, 60, "no shared poles");
    // Half of them shared: n / tau is 1 for both, and for Mi1 and one Tm1.
    (params.lamina.fast_order, params.lamina.fast_tau) = (2, 2.0);
    (params.lamina.slow_order, params.lamina.slow_tau) = (6, 6.0);
    (params.medulla.mi1_order, params.medulla.mi1_tau) = (4, 8.0);
    (params.medulla.tm1_5_order, params.medulla.tm1_5_tau) = (6, 12.0);
    agree(&params, 0.5, 60, "some shared poles");
}
