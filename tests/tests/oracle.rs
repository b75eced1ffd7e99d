//! The fast core against the naive model on random sizes, parameters and scenes.

use std::cell::Cell;

use apgstmd_core::params::{
    AttentionParams, BackgroundMotion, DetectionParams, EmdParams, EstmdParams, Gate, LaminaInhibitionParams,
    LobulaParams, Localise, PredictionParams, RejectionMode, RejectionParams, RetinaParams, Speckles, Support,
    TemporalEngine,
};
use apgstmd_core::{Model, Params, Preset, Size};
use apgstmd_tests::compare::Pair;
use apgstmd_tests::stimulus::Scene;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestRng, TestRunner};

const FRAMES: usize = 36;

prop_compose! {
    /// A preset at a random speed, or the default with random gamma kernels, most of which share no pole.
    fn temporal()(
        speed in 0.8f64..5.0,
        preset in select(vec![Preset::Paper, Preset::Practical]),
        orders in proptest::option::of([1u32..5, 1..9, 1..6, 1..8, 1..13]),
        taus in [0.4f64..3.0, 0.8..5.0, 0.5..5.0, 1.0..8.0, 1.5..12.0],
        engine in select(vec![TemporalEngine::Cascade, TemporalEngine::Cascade, TemporalEngine::Fir]),
    ) -> (Params, f64) {
        let mut params = Params::preset(preset).for_speed(speed).expect("a valid speed");
        if let Some([fast, slow, mi1, tm1_4, tm1_5]) = orders {
            (params.lamina.fast_order, params.lamina.slow_order) = (fast, slow);
            (params.lamina.fast_tau, params.lamina.slow_tau) = (taus[0], taus[0] + taus[1]);
            (params.medulla.mi1_order, params.medulla.mi1_tau) = (mi1, taus[2]);
            (params.medulla.tm1_4_order, params.medulla.tm1_4_tau) = (tm1_4, taus[3]);
            (params.medulla.tm1_5_order, params.medulla.tm1_5_tau) = (tm1_5, taus[4]);
        }
        params.engine.temporal = engine;
        (params, speed)
    }
}

prop_compose! {
    fn attention()(
        enabled in prop::bool::weighted(0.9),
        alpha in 0.0f64..2.0,
        scales in vec(1.0f64..4.0, 1..5),
        threshold in 0.01f64..0.6,
        (support, gate) in select(vec![
            (Support::Full, Gate::Luminance),
            (Support::Full, Gate::Change),
            (Support::Masked, Gate::Luminance),
        ]),
        speckles in select(vec![Speckles::Light, Speckles::Both]),
        ramp in prop_oneof![Just(1.0), 1.0f64..15.0],
    ) -> AttentionParams {
        AttentionParams { enabled, alpha, scales, threshold, support, speckles, gate, ramp, ..AttentionParams::default() }
    }
}

prop_compose! {
    fn space()(
        sigma in 0.5f64..2.0,
        spacing in prop_oneof![Just(3.0), 0.0f64..6.0],
        weights in prop_oneof![Just((1.0, 3.5, 1.2)), (0.5f64..2.0, 0.5f64..4.0, 0.5f64..1.5)],
        sigmas in prop_oneof![Just((1.25, 2.5)), (0.8f64..2.0, 2.0f64..4.0)],
        offset in prop_oneof![Just(0.0), -0.005f64..0.005],
        radius in prop_oneof![Just(7u32), 1u32..12],
        directional in prop_oneof![Just((1.5, 3.0)), (0.5f64..2.0, 2.0f64..6.0)],
    ) -> (RetinaParams, LobulaParams) {
        let mut lobula = LobulaParams { spacing, offset, radius, ..LobulaParams::default() };
        (lobula.excitation, lobula.inhibition, lobula.surround_weight) = weights;
        (lobula.center_sigma, lobula.surround_sigma) = sigmas;
        (lobula.direction_center_sigma, lobula.direction_surround_sigma) = directional;
        (RetinaParams { sigma }, lobula)
    }
}

prop_compose! {
    fn rejection()(
        mode in select(vec![RejectionMode::Off, RejectionMode::Contrast, RejectionMode::Motion]),
        background in select(vec![BackgroundMotion::Off, BackgroundMotion::Translation, BackgroundMotion::Similarity]),
        (gate, gate_frames) in (1.0f64..9.0, prop_oneof![Just(0.0), 0.0f64..3.0]),
        max_missed in 0u32..4,
        keep_radius in 0u32..9,
        contrast in (0.8f64..2.5, 1.0f64..5.0, 3u32..20, 1u32..4, 0.005f64..0.08),
        motion in (2u32..6, 2.0f64..12.0, 0.5f64..4.0, 0.1f64..0.9),
        peaks in (prop_oneof![Just(0.0), Just(1e-7)], 1u32..30, 1u32..7),
        localise in select(vec![Localise::Response, Localise::Target]),
    ) -> (RejectionParams, DetectionParams) {
        let mut rejection = RejectionParams { mode, background, gate, gate_frames, max_missed, keep_radius, ..RejectionParams::default() };
        (rejection.contrast_sigma, rejection.contrast_offset) = (contrast.0, contrast.1);
        (rejection.contrast_window, rejection.contrast_min_points) = (contrast.2, contrast.3);
        rejection.contrast_deviation = contrast.4;
        (rejection.motion_min_points, rejection.motion_path) = (motion.0, motion.1);
        (rejection.motion_distance, rejection.motion_straightness) = (motion.2, motion.3);
        let (threshold, max_peaks, peak_radius) = peaks;
        (rejection, DetectionParams { threshold, max_peaks, peak_radius, localise, least_score: 0.0 })
    }
}

prop_compose! {
    fn prediction()(
        enabled in prop::bool::weighted(0.9),
        reach in 1.0f64..9.0,
        horizon in 1u32..12,
        shape in (0.4f64..3.0, 0.0f64..6.0),
        weights in (0.1f64..1.0, 0.0f64..2.0, 0.0f64..0.3),
    ) -> PredictionParams {
        let mut prediction = PredictionParams { enabled, horizon, ..PredictionParams::default() };
        prediction.v_opt = reach / f64::from(horizon);
        (prediction.ring_width, prediction.concentration) = shape;
        (prediction.mu, prediction.beta, prediction.kappa) = weights;
        prediction
    }
}

prop_compose! {
    fn relatives()(
        sigmas in prop_oneof![Just((1.5, 3.0)), (0.5f64..2.5, 1.0f64..5.0)],
        radius in prop_oneof![Just(5u32), 1u32..12],
        taus in (0.05f64..6.0, 0.05f64..12.0),
        off in (1u32..16, 0.5f64..12.0),
        emd in (prop_oneof![Just(3.0), 0.0f64..20.0], 0.05f64..8.0),
    ) -> (LaminaInhibitionParams, EstmdParams, EmdParams) {
        let inhibition = LaminaInhibitionParams {
            center_sigma: sigmas.0,
            surround_sigma: sigmas.1,
            radius,
            excitation_tau: taus.0,
            inhibition_tau: taus.1,
        };
        (inhibition, EstmdParams { off_order: off.0, off_tau: off.1 }, EmdParams { spacing: emd.0, tau: emd.1 })
    }
}

prop_compose! {
    /// Any of the models, with constants of its own or at random.
    fn relative()(
        model in select(Model::ALL[1..].to_vec()),
        own in proptest::option::weighted(0.6, relatives()),
        (mut params, scene, threads) in case(),
    ) -> (Params, Scene, usize) {
        let speed = params.prediction.v_opt.clamp(0.25, 5.0);
        let published = Params::for_model(model).for_speed(speed).expect("a valid speed");
        params.model = model;
        (params.lamina_inhibition, params.estmd, params.emd) =
            own.unwrap_or((published.lamina_inhibition, published.estmd, published.emd));
        (params, scene, threads)
    }
}

prop_compose! {
    fn case()(
        size in (16usize..=40, 16usize..=40),
        (mut params, speed) in temporal(),
        attention in proptest::option::weighted(0.7, attention()),
        space in proptest::option::weighted(0.7, space()),
        rejection in proptest::option::weighted(0.8, rejection()),
        prediction in proptest::option::weighted(0.7, prediction()),
        seed in 0u64..1000,
        threads in 1usize..=3,
    ) -> (Params, Scene, usize) {
        // What is not drawn keeps the preset's values.
        if let Some(attention) = attention { params.attention = attention }
        if let Some(space) = space { (params.retina, params.lobula) = space }
        if let Some(rejection) = rejection { (params.rejection, params.detection) = rejection }
        if let Some(prediction) = prediction { params.prediction = prediction }
        (params, Scene::lively(Size::new(size.0, size.1), speed, seed), threads)
    }
}

/// The same cases every time, so that a failure is the change's and not the day's. PROPTEST_CASES asks for more.
/// Returns the number of cases, of those with attention at work and of those with detections.
fn compare(cases: impl Strategy<Value = (Params, Scene, usize)>) -> [u32; 3] {
    let count = std::env::var("PROPTEST_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(32);
    let config = Config { cases: count, failure_persistence: None, max_shrink_time: 60_000, ..Config::default() };
    let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let (attended, detecting) = (Cell::new(0), Cell::new(0));
    let outcome = TestRunner::new_with_rng(config, rng).run(&cases, |(params, scene, threads)| {
        params.validate().map_err(|error| TestCaseError::reject(error.to_string()))?;
        let mut pair = Pair::new(scene.size, &params, threads);
        for t in 0..FRAMES {
            pair.step(scene.frame(t).view()).map_err(|what| TestCaseError::fail(format!("frame {t}: {what}")))?;
        }
        attended.set(attended.get() + u32::from(pair.attended > 0));
        detecting.set(detecting.get() + u32::from(pair.detections > 0));
        Ok(())
    });
    if let Err(error) = outcome {
        panic!("{error}");
    }
    println!("{count} cases: attention active in {}, detections in {}", attended.get(), detecting.get());
    [count, attended.get(), detecting.get()]
}

// Scenes in which nothing responds would agree without meaning anything.

#[test]
fn any_size_any_parameters() {
    let [cases, attended, detecting] = compare(case());
    assert!(attended * 2 > cases && detecting * 3 > 2 * cases, "{attended} attended, {detecting} detecting");
}

#[test]
fn other_models() {
    let [cases, _, detecting] = compare(relative());
    assert!(detecting * 2 > cases, "{detecting} detecting");
}
