//! Every size from 16 x 16 to 20 x 20: rows that no vector width divides, kernels wider than the image.

use apgstmd_core::params::{BackgroundMotion, Gate, RejectionMode, Support};
use apgstmd_core::{Detector, Model, ParamError, Params, Preset, Size};
use apgstmd_tests::compare::Pair;
use apgstmd_tests::stimulus::Scene;

/// At 4 px/frame the prediction looks 2 frames ahead: every stage is at work within a few frames.
const SPEED: f64 = 4.0;
const FRAMES: usize = 8;

fn every_size(params: &Params) -> usize {
    let mut attended = 0;
    for height in 16..=20 {
        for width in 16..=20 {
            let size = Size::new(height, width);
            let scene = Scene::lively(size, 2.0, (height * width) as u64);
            let mut pair = Pair::new(size, params, 2);
            for t in 0..FRAMES {
                if let Err(what) = pair.step(scene.frame(t).view()) {
                    panic!("{size}, frame {t}: {what}");
                }
            }
            attended += usize::from(pair.attended > 0);
        }
    }
    attended
}

#[test]
fn paper_without_rejection() {
    let mut params = Params::default().for_speed(SPEED).expect("a valid speed");
    params.rejection.mode = RejectionMode::Off;
    assert_eq!(every_size(&params), 25, "attention must have been at work");
}

#[test]
fn practical() {
    let mut params = Params::preset(Preset::Practical).for_speed(SPEED).expect("a valid speed");
    // Few frames: points are judged from the second on.
    params.rejection.motion_min_points = 2;
    params.rejection.motion_distance = 0.5;
    // In the smallest pictures the target is most of what there is to see: a similarity takes it for the background.
    every_size(&params);
    params.rejection.background = BackgroundMotion::Translation;
    assert!(every_size(&params) > 12, "attention must have been at work");
    (params.attention.support, params.attention.gate) = (Support::Masked, Gate::Luminance);
    assert!(every_size(&params) > 12, "attention must have been at work");
}

#[test]
fn other_models() {
    for &model in &Model::ALL[1..] {
        let mut params = Params::for_model(model).for_speed(SPEED).expect("a valid speed");
        params.rejection.mode = RejectionMode::Off;
        every_size(&params);
    }
}

/// The widest kernels that parameters allow, in the smallest frame.
#[test]
fn kernels_wider_than_the_frame() {
    let mut params = Params::default().for_speed(SPEED).expect("a valid speed");
    params.retina.sigma = 5.0;
    params.attention.scales = vec![8.0, 0.5];
    params.lobula.radius = 24;
    params.lobula.spacing = 20.0;
    params.lobula.surround_sigma = 8.0;
    params.rejection.mode = RejectionMode::Contrast;
    params.rejection.contrast_deviation = 0.0;
    params.rejection.contrast_min_points = 1;
    params.rejection.contrast_offset = 20.0;
    params.detection.peak_radius = 64;
    params.prediction.ring_width = 10.0;
    params.prediction.v_opt = 12.0;
    params.lamina_inhibition.radius = 24;
    params.lamina_inhibition.surround_sigma = 8.0;
    params.emd.spacing = 20.0;
    for &model in Model::ALL {
        params.model = model;
        let scene = Scene::lively(Size::new(16, 17), 2.0, 5);
        let mut pair = Pair::new(scene.size, &params, 2);
        for t in 0..FRAMES {
            if let Err(what) = pair.step(scene.frame(t).view()) {
                panic!("{model}, frame {t}: {what}");
            }
        }
    }
}

#[test]
fn smaller_is_refused() {
    for (height, width) in [(15, 40), (40, 15), (0, 0)] {
        let refused = Detector::new(Size::new(height, width), &Params::default());
        assert!(matches!(refused.err(), Some(ParamError::TooSmall { least: 16, .. })));
    }
}
