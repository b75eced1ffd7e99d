//! The same bits for any number of threads, in every stage and every output.

use apgstmd_core::params::{RejectionMode, Support, TemporalEngine};
use apgstmd_core::{Detection, Detector, Model, Params, Preset, Rectangle, Region, Size, Stage};
use apgstmd_tests::stimulus::Scene;

fn identical(params: &Params, size: Size, frames: usize) {
    identical_in(params, size, None, frames);
}

fn identical_in(params: &Params, size: Size, region: Option<&Region>, frames: usize) {
    let scene = Scene::lively(size, 1.0, 4);
    let mut detectors: Vec<Detector> =
        [1, 2, 5].map(|threads| Detector::with_threads(size, params, threads).expect("valid parameters")).into();
    detectors.iter_mut().for_each(|detector| detector.look_in(region).expect("of the same size"));
    assert_eq!(detectors.iter().map(Detector::threads).collect::<Vec<_>>(), [1, 2, 5]);
    let (mut found, mut attended) = (0, false);
    for t in 0..frames {
        let frame = scene.frame(t);
        let responses: Vec<_> = detectors.iter_mut().map(|d| d.process(frame.view()).expect("a valid frame")).collect();
        for (detector, response) in detectors.iter().zip(&responses).skip(1) {
            let threads = detector.threads();
            for &stage in params.model.stages() {
                let [a, b] =
                    [&detectors[0], detector].map(|d| d.probe().stage(stage).expect("its own").mapv(f32::to_bits));
                assert!(a == b, "{size}, frame {t}, stage {stage}: {threads} threads differ from 1");
            }
            let bits = |map: &ndarray::Array2<f32>| map.mapv(f32::to_bits);
            assert!(bits(&responses[0].map) == bits(&response.map), "frame {t}: map, {threads} threads");
            assert!(bits(&responses[0].direction) == bits(&response.direction), "frame {t}: direction");
            let found = [&responses[0], response].map(|response| bits_of(&response.detections));
            assert_eq!(found[0], found[1], "frame {t}, {threads} threads");
            assert_eq!(responses[0].background_shift, response.background_shift, "frame {t}, {threads} threads");
        }
        found += responses[0].detections.len();
        // What has no attention has nothing to wait for.
        attended |= detectors[0].probe().stage(Stage::A).map_or(true, |a| a.iter().any(|a| *a != 0.0));
    }
    assert!(found > 0 && attended, "nothing happened: {found} detections, attention {attended}");
}

/// NaN, the direction of a model that has none, included.
fn bits_of(detections: &[Detection]) -> Vec<([u32; 4], u64)> {
    detections.iter().map(|d| ([d.x, d.y, d.score, d.direction].map(f32::to_bits), d.trace)).collect()
}

#[test]
fn other_models() {
    for &model in &Model::ALL[1..] {
        let mut params = Params::for_model(model).for_speed(1.0).unwrap();
        params.rejection.contrast_deviation = 0.01;
        identical(&params, Size::new(61, 83), 40);
        params.rejection.mode = RejectionMode::Off;
        params.engine.temporal = TemporalEngine::Fir;
        params.emd.spacing = 18.0;
        identical(&params, Size::new(17, 300), 25);
    }
}

#[test]
fn practical() {
    let (params, size) = (Params::preset(Preset::Practical).for_speed(1.0).unwrap(), Size::new(61, 83));
    identical(&params, size, 40);
    // Two parts, of which one ends in the middle of bands and strips.
    let parts = [(13, 9, 41, 23), (70, 40, 13, 21)];
    let parts = parts.map(|(x, y, width, height)| Rectangle { x, y, width, height });
    identical_in(&params, size, Some(&Region::from_rectangles(size, &parts).unwrap()), 40);
}

/// Fewer rows than some bands would like, and a width that no vector divides.
#[test]
fn smallest() {
    let mut params = Params::default().for_speed(2.0).unwrap();
    params.rejection.mode = RejectionMode::Off;
    identical(&params, Size::new(16, 19), 16);
}

#[test]
fn masked_fir_contrast() {
    let mut params = Params::default().for_speed(1.0).unwrap();
    params.attention.support = Support::Masked;
    params.engine.temporal = TemporalEngine::Fir;
    params.rejection.contrast_deviation = 0.01;
    params.lobula.offset = 1e-3;
    identical(&params, Size::new(97, 40), 40);
}

/// Large enough for every loop to be divided.
#[test]
fn larger() {
    let mut params = Params::default().for_speed(4.0).unwrap();
    params.rejection.mode = RejectionMode::Off;
    identical(&params, Size::new(203, 317), 8);
}
