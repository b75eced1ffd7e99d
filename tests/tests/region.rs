//! Regions: nothing outside, inside what there was, and less work.

use std::collections::HashSet;

use apgstmd_core::params::RejectionMode;
use apgstmd_core::{
    Bank, BankParams, Detection, Detector, Machine, Model, Params, Preset, Rectangle, Region, RegionError, Response,
    Size, Timing,
};
use apgstmd_tests::compare::Pair;
use apgstmd_tests::stimulus::{Background, Scene, Target};
use ndarray::Array2;

const SIZE: Size = Size::new(150, 170);
const FRAMES: usize = 44;

fn practical() -> Params {
    Params::preset(Preset::Practical).for_speed(1.0).expect("a valid speed")
}

fn detector(params: &Params) -> Detector {
    Detector::with_options(SIZE, params, &Machine { together: 3, ..Machine::with_threads(2) })
        .expect("valid parameters")
}

/// Four targets in four corners before a texture that moves.
fn scene() -> Scene {
    let target =
        |x: f64, y: f64, vx: f64| Target { start: (x, y), velocity: (vx, 0.1), size: (4.0, 4.0), luminance: 0.0 };
    let targets =
        vec![target(20.0, 25.0, 1.0), target(150.0, 30.0, -1.0), target(20.0, 120.0, 1.0), target(150.0, 115.0, -1.0)];
    let background = Background { luminance: 0.6, texture: 0.05, velocity: (0.3, 0.1), seed: 4 };
    Scene { size: SIZE, background, targets }
}

/// The upper left corner, and a disc below on the right: no multiples of anything.
fn region() -> Region {
    let mask = Array2::from_shape_fn((SIZE.height, SIZE.width), |(y, x)| {
        let disc = (x as f64 - 121.0).hypot(y as f64 - 117.0) < 33.0;
        (x < 83 && y < 59) || disc
    });
    Region::from_mask(mask.view()).expect("not empty")
}

fn everywhere() -> Region {
    let all = Rectangle { x: 0, y: 0, width: SIZE.width, height: SIZE.height };
    Region::from_rectangles(SIZE, &[all]).expect("not empty")
}

fn bits(response: &Response) -> (Vec<u32>, String) {
    let maps = response.map.iter().chain(&response.direction).map(|value| value.to_bits()).collect();
    (maps, format!("{:?}", (&response.detections, response.background_shift, response.ego_motion)))
}

/// To the bit, in all models, also where nothing is rejected; and taking a region away again is having none.
#[test]
fn a_region_of_everything_is_none() {
    let mut off = practical();
    off.rejection.mode = RejectionMode::Off;
    let models = Model::ALL.iter().map(|model| Params::for_model(*model).with_preset(Preset::Practical));
    let models = models.map(|params| params.for_speed(1.0).unwrap());
    for params in models.chain([off]) {
        let (mut free, mut bound) = (detector(&params), detector(&params));
        for t in 0..FRAMES {
            bound.look_in((t % 20 < 10).then(everywhere).as_ref()).unwrap();
            let frame = scene().frame(t);
            let (a, b) = (free.process(frame.view()).unwrap(), bound.process(frame.view()).unwrap());
            assert!(bits(&a) == bits(&b), "{}, frame {t}", params.model);
        }
    }
}

/// All models and a bank: nothing is reported outside, and the two targets inside are found where they were.
#[test]
fn nothing_outside_and_the_same_inside() {
    let region = region();
    let bank = BankParams::with_members(Params::preset(Preset::Practical), &[1.0], &[5.0, 10.0]);
    let models = Model::ALL.iter().map(|model| Params::for_model(*model).with_preset(Preset::Practical));
    let mut settings: Vec<Option<Params>> = models.map(|params| Some(params.for_speed(1.0).unwrap())).collect();
    settings.push(None);
    for params in settings {
        type Step = Box<dyn FnMut(&Array2<u8>) -> Vec<Detection>>;
        let made = |region: Option<&Region>| -> Step {
            match &params {
                Some(params) => {
                    let mut detector = detector(params);
                    detector.look_in(region).unwrap();
                    Box::new(move |frame| detector.process(frame.view()).unwrap().detections)
                }
                None => {
                    let mut bank = Bank::new(SIZE, &bank).unwrap();
                    bank.look_in(region).unwrap();
                    Box::new(move |frame| bank.process(frame.view()).unwrap().detections)
                }
            }
        };
        let name = params.as_ref().map_or("bank", |params| params.model.name());
        let (mut free, mut bound) = (made(None), made(Some(&region)));
        let (mut inside, mut missing, mut outside) = (0, 0, 0);
        for t in 0..FRAMES {
            let frame = scene().frame(t);
            let (all, found) = (free(&frame), bound(&frame));
            assert!(found.iter().all(|found| region.contains(found.x, found.y)), "{name}, frame {t}");
            outside += all.iter().filter(|found| !region.contains(found.x, found.y)).count();
            // What is well inside.
            let targets = scene().targets.into_iter().map(|target| target.center(t));
            for (x, y) in targets.filter(|(x, y)| (*x < 70.0 && *y < 50.0) || (x - 121.0).hypot(y - 117.0) < 22.0) {
                // Without directions there is no telling how far ahead a target is.
                let reach = if name == "estmd" { 16.0 } else { 4.0 };
                let near = |found: &&Detection| f64::from(found.x - x as f32).hypot(f64::from(found.y) - y) < reach;
                let place = |list: &[Detection]| list.iter().find(near).map(|found| (found.x, found.y, found.score));
                inside += usize::from(place(&all).is_some());
                // Attention to what is outside has a small part in it.
                let same = match (place(&all), place(&found)) {
                    (Some(a), Some(b)) => (a.0 - b.0).hypot(a.1 - b.1) < 0.1 && (a.2 / b.2 - 1.0).abs() < 0.05,
                    (a, b) => a.is_none() == b.is_none(),
                };
                missing += usize::from(!same);
            }
        }
        assert!(inside > 40 && outside > 20, "{name}: {inside} found inside, {outside} outside");
        assert!(missing <= inside / 20, "{name}: {missing} of {inside} are not found as without a region");
    }
}

/// What is outside and does not move has no part in anything: every bit is that of a detector without a region.
#[test]
fn where_nothing_moves_outside_every_bit_is_the_same() {
    let target = |x: f64, y: f64| Target { start: (x, y), velocity: (0.9, 0.2), size: (4.0, 4.0), luminance: 0.0 };
    let background = Background { luminance: 0.6, texture: 0.05, velocity: (0.0, 0.0), seed: 4 };
    let scene = Scene { size: SIZE, background, targets: vec![target(40.0, 60.0), target(60.0, 85.0)] };
    // Farther than what moves reaches: 21 px of lateral inhibition, and rings of prediction.
    let part = Rectangle { x: 11, y: 27, width: 120, height: 96 };
    let region = Region::from_rectangles(SIZE, &[part]).unwrap();
    let models = Model::ALL.iter().map(|model| Params::for_model(*model).with_preset(Preset::Practical));
    for params in models.map(|params| params.for_speed(1.0).unwrap()) {
        let (mut free, mut bound) = (detector(&params), detector(&params));
        bound.look_in(Some(&region)).unwrap();
        let mut found = 0;
        for t in 0..FRAMES {
            let frame = scene.frame(t);
            let (a, b) = (free.process(frame.view()).unwrap(), bound.process(frame.view()).unwrap());
            assert!(bits(&a) == bits(&b), "{}, frame {t}", params.model);
            found += b.detections.len();
        }
        assert!(found > 40, "{}: {found}", params.model);
    }
    let bank = BankParams::with_members(Params::preset(Preset::Practical), &[1.0], &[5.0, 10.0]);
    let (mut free, mut bound) = (Bank::new(SIZE, &bank).unwrap(), Bank::new(SIZE, &bank).unwrap());
    bound.look_in(Some(&region)).unwrap();
    let mut found = 0;
    for t in 0..FRAMES {
        let frame = scene.frame(t);
        let (a, b) = (free.process(frame.view()).unwrap(), bound.process(frame.view()).unwrap());
        assert!(bits(&a) == bits(&b), "bank, frame {t}");
        found += b.detections.len();
    }
    assert!(found > 40, "bank: {found}");
}

/// A target that leaves the region is found up to its border where it is found without one, and no further; one that comes in is
/// found from its second frame there on.
#[test]
fn a_target_that_crosses_the_border() {
    let target =
        |x: f64, y: f64, vx: f64| Target { start: (x, y), velocity: (vx, 0.0), size: (4.0, 4.0), luminance: 0.0 };
    let background = Background { luminance: 0.6, texture: 0.05, velocity: (0.3, 0.1), seed: 4 };
    let scene = Scene { size: SIZE, background, targets: vec![target(45.0, 40.0, 1.0), target(125.0, 100.0, -1.0)] };
    let left = Rectangle { x: 0, y: 0, width: 80, height: SIZE.height };
    let region = Region::from_rectangles(SIZE, &[left]).unwrap();
    let params = practical();
    let (mut free, mut bound) = (detector(&params), detector(&params));
    bound.look_in(Some(&region)).unwrap();
    let (mut leaving, mut gone, mut came) = (0, 0, Vec::new());
    for t in 0..100 {
        let frame = scene.frame(t);
        let (all, found) = (free.process(frame.view()).unwrap(), bound.process(frame.view()).unwrap());
        let near = |list: &[Detection], (x, y): (f64, f64)| {
            let distance = |found: &Detection| f64::from(found.x - x as f32).hypot(f64::from(found.y) - y);
            list.iter().find(|found| distance(found) < 4.0).copied()
        };
        let [first, second] = [0, 1].map(|index| scene.targets[index].center(t));
        match near(&all.detections, first) {
            Some(one) if region.contains(one.x, one.y) => {
                let same = near(&found.detections, first).unwrap_or_else(|| panic!("frame {t}: lost inside"));
                assert!((same.x - one.x).hypot(same.y - one.y) < 0.05, "frame {t}: {same:?} {one:?}");
                leaving += 1;
            }
            Some(_) => {
                assert!(near(&found.detections, first).is_none(), "frame {t}");
                gone += 1;
            }
            None => {}
        }
        if let Some(one) = near(&all.detections, second).filter(|one| region.contains(one.x, one.y)) {
            let apart = |same: Detection| (same.x - one.x).hypot(same.y - one.y);
            came.push(near(&found.detections, second).map_or(f32::INFINITY, apart));
        }
    }
    assert!(leaving > 15 && gone > 15, "{leaving}, {gone}");
    // Predictions, which move a place by a part of a pixel, come up as for a target that has just come into the picture.
    assert!(came.len() > 50 && came[1..].iter().all(|apart| *apart < 0.5), "{came:?}");
    assert!(came[20..].iter().all(|apart| *apart < 0.05), "{came:?}");
}

/// The naive model, in which peaks outside are none, gives the same in every stage.
#[test]
fn it_is_the_naive_model_without_peaks_outside() {
    let mut pair = Pair::new(SIZE, &practical(), 2);
    pair.look_in(&region());
    for t in 0..36 {
        pair.step(scene().frame(t).view()).unwrap_or_else(|error| panic!("frame {t}: {error}"));
    }
    assert!(pair.detections > 20, "{}", pair.detections);
}

/// A region of a sixteenth of the picture costs the lobula a share of that order, its margin included.
#[test]
fn what_is_far_outside_costs_nothing() {
    let size = Size::new(400, 480);
    let params = practical();
    let frames: Vec<Array2<u8>> = (0..20)
        .map(|t| Array2::from_shape_fn((400, 480), |(y, x)| ((x + t) * 31 + y * 17 + (x + t) * y % 97) as u8))
        .collect();
    let tiles = |region: Option<Rectangle>| {
        let mut detector = Detector::with_threads(size, &params, 1).unwrap();
        let region = region.map(|region| Region::from_rectangles(size, &[region]).unwrap());
        detector.look_in(region.as_ref()).unwrap();
        let (mut response, mut timing) = (detector.make_response(), Timing::default());
        frames.iter().for_each(|frame| detector.process_timed(frame.view(), &mut response, &mut timing).unwrap());
        let traces: HashSet<u64> = response.detections.iter().map(|found| found.trace).collect();
        assert!(traces.len() == response.detections.len());
        (timing.inhibited_tiles(), timing.predicted_tiles())
    };
    let whole = tiles(None);
    let part = tiles(Some(Rectangle { x: 130, y: 150, width: 120, height: 100 }));
    // 120 x 100 px with a margin of some 16 px on each side, in strips of 64 columns: 192 x 132 of 480 x 400.
    assert!(part.0 < 0.2 * whole.0 && part.0 > 0.05 * whole.0, "{part:?} of {whole:?}");
    assert!(part.1 <= whole.1, "{part:?} of {whole:?}");
}

#[test]
fn a_region_of_another_size_is_refused_and_changes_nothing() {
    let mut detector = detector(&practical());
    let small = Rectangle { x: 0, y: 0, width: 5, height: 5 };
    let other = Region::from_rectangles(Size::new(150, 171), &[small]).unwrap();
    let expected = RegionError::Size { given: Size::new(150, 171), expected: SIZE };
    assert_eq!(detector.look_in(Some(&other)), Err(expected.clone()));
    assert!(expected.to_string().contains("150 x 171") && expected.to_string().contains("150 x 170"));
    let mut bank = Bank::new(SIZE, &BankParams::default()).unwrap();
    assert_eq!(bank.look_in(Some(&other)), Err(expected));
}
