//! The bank: calibration, sizes, places of dark and light targets, one detection a target, the same bits however it runs.

use std::f64::consts::TAU;

use apgstmd_core::evaluation::{Options, Scored, TruthBox, evaluate};
use apgstmd_core::stimulus::{self, Path, Renderer, Shade};
use apgstmd_core::{Bank, BankParams, Detection, Machine, Params, Preset, Response, Size};
use apgstmd_tests::stimulus::{Background, Scene, Target};

fn bank(size: Size, speeds: &[f64], sizes: &[f64]) -> Bank {
    let params = BankParams::with_members(Params::preset(Preset::Practical), speeds, sizes);
    Bank::new(size, &params).expect("valid parameters")
}

/// A square that moves to the right through the middle of a picture of 72 rows, from x = 20 on.
fn crossing(side: f64, speed: f64, luminance: f64, background: f64, frames: usize) -> Scene {
    let width = (60.0 + speed * frames as f64).ceil() as usize;
    let target = Target { start: (20.0, 36.0), velocity: (speed, 0.0), size: (side, side), luminance };
    Scene { size: Size::new(72, width), background: Background::uniform(background), targets: vec![target] }
}

/// What a bank finds in each frame of a scene.
fn run(bank: &mut Bank, scene: &Scene, frames: usize) -> Vec<Vec<Detection>> {
    let mut response = bank.make_response();
    let frame = |t: usize| {
        // 16 bits: the fainter targets are not made of a few grey levels.
        scene.luminance(t).mapv(|value| (value * 65535.0).round() as u16)
    };
    (0..frames)
        .map(|t| {
            bank.process_into(frame(t).view(), &mut response).expect("a valid frame");
            response.detections.clone()
        })
        .collect()
}

fn distance(found: &Detection, (x, y): (f64, f64)) -> f64 {
    (f64::from(found.x) - x).hypot(f64::from(found.y) - y)
}

/// The ideal target, 5 x 5 px and dark on white at a member's speed, has its own contrast, and after 60 points its score
/// is that. 5 %: sub-pixel places, and faint targets lose what falls below the floors of the model.
#[test]
fn the_score_of_the_ideal_target_is_its_contrast() {
    for (speed, frames) in [(0.25, 480), (0.5, 240), (1.0, 150), (2.0, 110), (4.0, 100)] {
        for contrast in [0.1, 0.4, 1.0] {
            let scene = crossing(5.0, speed, 1.0 - contrast, 1.0, frames);
            let found = run(&mut bank(scene.size, &[speed], &[5.0]), &scene, frames);
            let last = found[frames - 1].first().unwrap_or_else(|| panic!("nothing at {speed}, {contrast}"));
            for value in [last.contrast, last.score] {
                assert!((f64::from(value) / contrast - 1.0).abs() < 0.05, "{speed} px/frame, {contrast}: {last:?}");
            }
            assert!(last.points >= 60 && last.straightness > 0.99, "{last:?}");
        }
    }
}

/// Its member looks at every fourth frame.
#[test]
fn a_slow_target_is_there_in_every_frame() {
    let frames = 240;
    let scene = crossing(5.0, 0.125, 0.2, 0.8, frames);
    let mut bank = bank(scene.size, &[0.125], &[5.0]);
    assert_eq!(bank.members().map(|member| member.exposure()).collect::<Vec<_>>(), [4]);
    let found = run(&mut bank, &scene, frames);
    for t in 160..frames {
        let [last] = found[t][..] else { panic!("frame {t}: {:?}", found[t]) };
        let off = distance(&last, scene.targets[0].center(t));
        assert!(off < 0.5, "frame {t}: {off} px off, {last:?}");
        let [before] = found[t - 1][..] else { panic!("frame {}: {:?}", t - 1, found[t - 1]) };
        assert_eq!(last.points - before.points, u32::from(t % 4 == 1), "frame {t}");
        if t % 4 != 1 {
            let (moved, held) = (f64::from(last.x - before.x), (last.y, last.score));
            assert!((moved - 0.125).abs() < 0.01 && held == (before.y, before.score), "frame {t}: {last:?}");
        }
    }
}

#[test]
fn each_size_has_its_member() {
    for (side, scale) in [(4.0, 1.0), (10.0, 2.0), (20.0, 4.0)] {
        let frames = 90;
        let scene = crossing(side, 2.0, 0.2, 0.8, frames);
        let found = run(&mut bank(scene.size, &[2.0], &[5.0, 10.0, 20.0]), &scene, frames);
        let last = found[frames - 1].first().expect("a target as plain as can be");
        assert_eq!((last.size, last.speed), (5.0 * scale, 2.0), "side {side}: {last:?}");
        assert!(distance(last, scene.targets[0].center(frames - 1)) < scale as f64 + 0.5, "side {side}: {last:?}");
    }
}

/// Also where they are slower or faster than the member: how far behind the response lies is not assumed.
#[test]
fn dark_and_light_targets_are_where_they_are() {
    for luminance in [0.2, 0.8] {
        for speed in [0.5, 1.0, 2.0] {
            let frames = 80;
            let scene = crossing(5.0, speed, luminance, 0.5, frames);
            let found = run(&mut bank(scene.size, &[1.0], &[5.0]), &scene, frames);
            let last = found[frames - 1].first().unwrap_or_else(|| panic!("nothing of {luminance} at {speed}"));
            let off = distance(last, scene.targets[0].center(frames - 1));
            assert!(off < 1.0, "luminance {luminance}, {speed} px/frame: {off} px off, {last:?}");
        }
    }
}

#[test]
fn one_target_is_one_detection_of_one_trace() {
    let frames = 90;
    let scene = crossing(6.0, 1.5, 0.1, 0.9, frames);
    let mut bank = Bank::new(scene.size, &BankParams::default()).expect("valid parameters");
    let found = run(&mut bank, &scene, frames);
    let mut traces = Vec::new();
    for (t, found) in found.iter().enumerate().skip(30) {
        let near: Vec<&Detection> =
            found.iter().filter(|found| distance(found, scene.targets[0].center(t)) < 6.0).collect();
        assert_eq!(near.len(), 1, "frame {t}: {found:?}");
        traces.push(near[0].trace);
    }
    traces.dedup();
    assert_eq!(traces.len(), 1, "{traces:?}");
}

#[test]
fn the_numbers_do_not_depend_on_threads_or_what_was_before() {
    let scene = Scene::lively(Size::new(70, 90), 1.0, 3);
    let bits = |response: &Response| {
        let map = |map: &ndarray::Array2<f32>| map.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        (map(&response.map), map(&response.direction), format!("{:?}", response.detections))
    };
    let all = |bank: &mut Bank| -> Vec<_> {
        (0..40).map(|t| bits(&bank.process(scene.frame(t).view()).expect("a valid frame"))).collect()
    };
    let with = |threads| {
        Bank::with_options(scene.size, &BankParams::default(), &Machine::with_threads(threads)).expect("valid")
    };
    let mut first = with(1);
    let truth = all(&mut first);
    assert!(truth.iter().any(|(_, _, found)| found != "[]"));
    first.reset();
    assert!(all(&mut first) == truth, "after a reset");
    for threads in [2, 5] {
        assert!(all(&mut with(threads)) == truth, "{threads} threads");
    }
}

#[test]
fn frames_that_do_not_fit_change_nothing() {
    let scene = crossing(5.0, 1.0, 0.0, 1.0, 30);
    let (mut plain, mut disturbed) =
        (bank(scene.size, &[1.0, 2.0], &[5.0, 10.0]), bank(scene.size, &[1.0, 2.0], &[5.0, 10.0]));
    let wrong = ndarray::Array2::<u8>::zeros((20, 20));
    for t in 0..30 {
        assert!(disturbed.process(wrong.view()).is_err());
        let (a, b) = (plain.process(scene.frame(t).view()), disturbed.process(scene.frame(t).view()));
        assert_eq!(a.expect("valid").detections, b.expect("valid").detections);
    }
    assert_eq!(disturbed.frames(), 30);
    let members = |size| bank(size, &[1.0], &[5.0, 10.0, 20.0]).members().count();
    assert_eq!((members(Size::new(20, 200)), members(Size::new(40, 200)), members(Size::new(64, 200))), (1, 2, 3));
    assert!(Bank::new(Size::new(15, 200), &BankParams::default()).is_err());
}

/// Before moving clutter, dark and light, at speeds and sizes that the bank is not told: the area under the
/// detection rate over 0..1 false alarms a frame, found to be 0.82, 0.86, 0.91 and 0.96; the rule leaves room for changes.
#[test]
fn unknown_speeds_and_sizes_before_clutter() {
    for (row, (speed, side, shade)) in [
        (0.5, 4.0, Shade::Dark(0.4)),
        (1.0, 5.0, Shade::Light(0.4)),
        (2.0, 8.0, Shade::Dark(0.4)),
        (4.0, 5.0, Shade::Dark(0.6)),
    ]
    .into_iter()
    .enumerate()
    {
        let path = Path::Circular { center: [120.0, 90.0], radius: 60.0, speed: 30.0 * speed, angle: 0.1 * TAU };
        let target = stimulus::Target { width: side, height: side, shade, ..stimulus::Target::new(path) };
        let scene = stimulus::Scene {
            width: 240,
            height: 180,
            rate: 30.0,
            frames: 90,
            seed: 20 + row as u64,
            noise: 0.004,
            background: stimulus::Background::Natural { mean: 0.5, contrast: 0.1, velocity: [-9.0, 3.0] },
            targets: vec![target],
            ..stimulus::Scene::default()
        };
        let renderer = Renderer::new(&scene).expect("a valid scene");
        let mut bank = Bank::new(Size::new(180, 240), &BankParams::default()).expect("valid parameters");
        let (mut found, mut truth) = (Vec::new(), Vec::new());
        for t in 0..scene.frames {
            let seen = bank.process(renderer.frame(t).view()).expect("a valid frame");
            found.extend(
                seen.detections
                    .iter()
                    .map(|found| Scored::new(t, f64::from(found.x), f64::from(found.y), f64::from(found.score))),
            );
            truth.extend(
                renderer.truth(t).iter().map(|seen| TruthBox::new(t, [seen.x, seen.y, seen.width, seen.height])),
            );
        }
        let area = evaluate(&found, &truth, &Options::new(0..scene.frames)).expect("valid").area;
        println!("{speed} px/frame, {side} px, {shade:?}: {area:.3}");
        assert!(area > 0.6, "{speed} px/frame, {side} px, {shade:?}: {area}");
    }
}
