//! States: what goes on from one is to the bit what was never stopped, and what is none is refused with the reason.

use std::collections::BTreeMap;

use apgstmd_core::params::{BackgroundMotion, Gate, RejectionMode, Support, TemporalEngine};
use apgstmd_core::state::{Array, Origin, Values};
use apgstmd_core::tracking::Observation;
use apgstmd_core::{
    Bank, BankParams, Detector, FalseAlarms, Frame, Machine, Model, Params, Preset, Response, Size, State, StateError,
    Tracker,
};
use apgstmd_tests::stimulus::{Background, Scene, Target};
use ndarray::Array2;

const SIZE: Size = Size::new(66, 67);
const FRAMES: usize = 50;

/// A lively scene that is cut in the middle.
fn frames() -> Vec<Array2<u8>> {
    let (first, second) = (Scene::lively(SIZE, 1.0, 11), Scene::lively(SIZE, 1.0, 12));
    (0..FRAMES).map(|t| if t < 36 { first.frame(t) } else { second.frame(t).mapv(|value| 255 - value) }).collect()
}

/// Every part that remembers, in every form.
fn settings() -> Vec<Params> {
    let practical = Params::preset(Preset::Practical).for_speed(1.0).expect("a valid speed");
    let with = |change: fn(&mut Params)| {
        let mut params = practical.clone();
        change(&mut params);
        params
    };
    let models = Model::ALL.iter().map(|model| Params::for_model(*model).for_speed(1.0).expect("a valid speed"));
    let variants = [
        with(|_| ()),
        with(|params| params.engine.temporal = TemporalEngine::Fir),
        with(|params| params.rejection.background = BackgroundMotion::Translation),
        with(|params| params.rejection.background = BackgroundMotion::Off),
        with(|params| params.rejection.mode = RejectionMode::Contrast),
        with(|params| params.rejection.mode = RejectionMode::Off),
        with(|params| params.attention.gate = Gate::Luminance),
        with(|params| (params.attention.gate, params.attention.support) = (Gate::Luminance, Support::Masked)),
        with(|params| params.attention.enabled = false),
        with(|params| params.prediction.enabled = false),
    ];
    variants.into_iter().chain(models).collect()
}

/// Everything a frame gives, bit by bit.
fn bits(response: &Response) -> (Vec<u32>, String) {
    let maps = response.map.iter().chain(&response.direction).map(|value| value.to_bits()).collect();
    let rest = (&response.detections, response.background_shift, response.ego_motion, response.cut);
    (maps, format!("{rest:?}"))
}

/// To the bit: -0 is not 0.
fn assert_alike(a: &State, b: &State, what: &str) {
    for (name, array) in a.arrays() {
        let other = &b.arrays()[name];
        let (a, b) = (format!("{array:?}"), format!("{other:?}"));
        let at = a.bytes().zip(b.bytes()).take_while(|(a, b)| a == b).count();
        let near = |text: &str| text[at.saturating_sub(40)..(at + 60).min(text.len())].to_owned();
        assert!(a == b, "{what}: {name} at {at} of {}: {} and {}", a.len(), near(&a), near(&b));
    }
    assert!(a.arrays().len() == b.arrays().len() && a.to_bytes() == b.to_bytes(), "{what}");
}

fn machine(threads: usize, together: usize) -> Machine {
    Machine { together, ..Machine::with_threads(threads) }
}

#[test]
fn a_detector_goes_on_to_the_bit() {
    let frames = frames();
    for params in settings() {
        let new = |machine: Machine| Detector::with_options(SIZE, &params, &machine).expect("valid parameters");
        let mut whole = new(machine(2, 1));
        let truth: Vec<_> = frames.iter().map(|frame| bits(&whole.process(frame.view()).unwrap())).collect();
        let found = truth.iter().filter(|(_, rest)| !rest.starts_with("([]")).count();
        assert!(found > FRAMES / 4, "{}: something was found in {found} frames only", params.model);
        for stop in [0, 20, 36, 37] {
            let mut before = new(machine(1, 4));
            let all: Vec<Frame<'_>> = frames[..stop].iter().map(|frame| frame.view().into()).collect();
            let mut responses: Vec<Response> = all.iter().map(|_| before.make_response()).collect();
            before.process_block(&all, &mut responses).unwrap();
            let state = before.state();
            let read = State::from_bytes(&state.to_bytes()).expect("what was written can be read");
            assert_alike(&read, &state, "read");
            // It has seen other things, and its rings stand elsewhere.
            let mut after = new(machine(2, 3));
            (0..7).for_each(|t| drop(after.process(frames[3 * t].view()).unwrap()));
            after.restore(&read).expect("of the same size and parameters");
            assert_eq!(after.frames(), stop as u64);
            assert_alike(&after.state(), &state, "taken up");
            for (t, frame) in frames.iter().enumerate().skip(stop) {
                let (a, b) = (&truth[t], bits(&after.process(frame.view()).unwrap()));
                assert!(*a == b, "{}, stopped at {stop}, frame {t}", params.model);
            }
            assert_alike(&after.state(), &whole.state(), &format!("{}, stopped at {stop}", params.model));
        }
    }
}

#[test]
fn a_bank_goes_on_to_the_bit() {
    go_on_with(&[0.5, 1.0], &frames(), &[0, 30, 40]);
}

/// Members take two, four and eight frames as one, and hold what they found between.
#[test]
fn a_bank_of_slow_members_goes_on_to_the_bit() {
    let target = Target { start: (20.0, 33.0), velocity: (0.125, 0.0), size: (5.0, 5.0), luminance: 0.2 };
    let scene = Scene { size: SIZE, background: Background::uniform(0.8), targets: vec![target] };
    let frames: Vec<Array2<u8>> = (0..140).map(|t| scene.frame(t)).collect();
    go_on_with(&[0.25, 0.125, 0.0625], &frames, &[3, 120, 121, 122, 123]);
}

fn go_on_with(speeds: &[f64], frames: &[Array2<u8>], stops: &[usize]) {
    let params = BankParams::with_members(Params::preset(Preset::Practical), speeds, &[5.0, 10.0]);
    let new = || Bank::new(SIZE, &params).expect("valid parameters");
    let mut whole = new();
    let truth: Vec<_> = frames.iter().map(|frame| bits(&whole.process(frame.view()).unwrap())).collect();
    assert!(truth.last().is_some_and(|(_, found)| found.contains("Detection {")), "nothing is found");
    for &stop in stops {
        let mut before = new();
        frames[..stop].iter().for_each(|frame| drop(before.process(frame.view()).unwrap()));
        let file = before.state().to_bytes();
        let mut after = new();
        (0..7).for_each(|t| drop(after.process(frames[5 * t].view()).unwrap()));
        after.restore(&State::from_bytes(&file).unwrap()).unwrap();
        for (t, frame) in frames.iter().enumerate().skip(stop) {
            assert!(truth[t] == bits(&after.process(frame.view()).unwrap()), "stopped at {stop}, frame {t}");
        }
        assert_alike(&after.state(), &whole.state(), &format!("stopped at {stop}"));
    }
}

/// The tracker and the threshold, which are fed by a detector.
#[test]
fn tracks_and_thresholds_go_on_to_the_bit() {
    let frames = frames();
    let params = Params::preset(Preset::Practical).for_speed(1.0).unwrap();
    let mut detector = Detector::new(SIZE, &params).unwrap();
    let seen: Vec<Response> = frames.iter().map(|frame| detector.process(frame.view()).unwrap()).collect();
    let new = || (Tracker::new(SIZE, &params).unwrap(), FalseAlarms::new());
    let step = |(tracker, alarms): &mut (Tracker, FalseAlarms), t: usize| {
        let mut points = Vec::new();
        tracker.process_into(&Observation::of(t, &seen[t], detector.lag()), &mut points);
        alarms.add(&seen[t].detections);
        (points, alarms.least_score(1.0).to_bits())
    };
    let mut whole = new();
    let truth: Vec<_> = (0..FRAMES).map(|t| step(&mut whole, t)).collect();
    assert!(truth.iter().map(|(points, _)| points.len()).sum::<usize>() > FRAMES / 2);
    for stop in [0, 3, 25, 35, 36, 45] {
        let mut before = new();
        (0..stop).for_each(|t| drop(step(&mut before, t)));
        let mut after = new();
        (0..9).for_each(|t| drop(step(&mut after, t)));
        after.0.restore(&before.0.state()).unwrap();
        after.1.restore(&State::from_bytes(&before.1.state().to_bytes()).unwrap()).unwrap();
        for (t, expected) in truth.iter().enumerate().skip(stop) {
            assert_eq!(step(&mut after, t), *expected, "stopped at {stop}, frame {t}");
        }
    }
}

fn detector(size: Size, params: &Params) -> Detector {
    Detector::with_threads(size, params, 1).unwrap()
}

/// A detector that has seen something, and its state.
fn used() -> (Detector, State) {
    let mut detector = detector(SIZE, &settings()[0]);
    frames().iter().take(30).for_each(|frame| drop(detector.process(frame.view()).unwrap()));
    let state = detector.state();
    (detector, state)
}

#[test]
fn what_is_no_state_of_it_is_refused() {
    let params = settings().remove(0);
    let (mut detector, state) = used();
    let message = |result: Result<(), StateError>| result.expect_err("it is no state of it").to_string();
    let with = |change: &dyn Fn(&mut Origin)| {
        let mut origin = state.origin().clone();
        change(&mut origin);
        State::new(origin, state.arrays().clone()).unwrap()
    };
    let refused = message(detector.restore(&with(&|origin| origin.version = "0.0.9".into())));
    assert!(refused.contains("0.0.9") && refused.contains(env!("CARGO_PKG_VERSION")), "{refused}");
    let refused = message(detector.restore(&with(&|origin| origin.format = 7)));
    assert!(refused.contains("state format 7"), "{refused}");
    let refused = message(detector.restore(&with(&|origin| origin.of = "bank".into())));
    assert!(refused.contains("of a bank"), "{refused}");
    let other = self::detector(Size::new(66, 68), &params).restore(&state);
    assert!(message(other).contains("66 x 67") && state.arrays().len() > 20);
    let mut params = params;
    params.attention.alpha = 0.25;
    let refused = message(self::detector(SIZE, &params).restore(&state));
    assert!(refused.contains("attention.alpha") && refused.contains("0.25"), "{refused}");
    // None of these has changed it.
    assert_alike(&detector.state(), &state, "after what was refused");
}

/// Each array, left out, of another type, too short, of values that cannot be: refused, and nothing has changed.
#[test]
fn arrays_that_cannot_be_are_refused() {
    let (mut detector, state) = used();
    let mut refused = 0;
    let mut refuse = |name: &str, array: Option<Array>| {
        let mut arrays: BTreeMap<String, Array> = state.arrays().clone();
        arrays.remove(name);
        arrays.extend(array.map(|array| (name.to_owned(), array)));
        let result = detector.restore(&State::new(state.origin().clone(), arrays).unwrap());
        let error = result.expect_err(name);
        assert!(matches!(&error, StateError::Array { name: told, .. } if *told == name), "{name}: {error}");
        refused += 1;
    };
    for (name, array) in state.arrays() {
        refuse(name, None);
        let length = array.values.len();
        let of = |values: Values| Some(Array { shape: vec![values.len()], values });
        refuse(name, of(Values::U32(vec![0; length])));
        if let Values::F32(values) = &array.values
            && !values.is_empty()
        {
            let mut values = values.clone();
            values[length / 2] = f32::NAN;
            refuse(name, Some(Array { shape: array.shape.clone(), values: Values::F32(values) }));
        }
        // What counts could not go on.
        if let Values::U64(values) = &array.values {
            refuse(name, Some(Array { shape: array.shape.clone(), values: Values::U64(vec![u64::MAX; values.len()]) }));
        }
    }
    let of = |values: Values| Some(Array { shape: vec![values.len()], values });
    refuse("memorizer.now", of(Values::U64(vec![1 << 40])));
    refuse("memorizer.0.mask", of(Values::U8(vec![255; 30])));
    refuse("rejection.traces.living", of(Values::U8(vec![255; 9])));
    refuse("rejection.traces.living", of(Values::U8(vec![])));
    refuse("something.else", of(Values::U8(vec![1])));
    assert!(refused > 100, "{refused}");
    assert_alike(&detector.state(), &state, "after what was refused");
}

#[test]
fn a_damaged_file_is_refused() {
    let (_, state) = used();
    let file = state.to_bytes();
    // The header, the checksum, the arrays: every place of a few hundred.
    for at in (0..file.len()).step_by(file.len() / 300) {
        let mut damaged = file.clone();
        damaged[at] ^= 4;
        let error = State::from_bytes(&damaged).expect_err("a bit has changed");
        assert!(!error.to_string().contains('\n'), "{error}");
    }
    for length in [0, 7, 8, 100, file.len() - 1] {
        assert!(matches!(State::from_bytes(&file[..length]), Err(StateError::File { .. })), "{length} bytes");
    }
    let shape = Array { shape: vec![usize::MAX, 3], values: Values::U8(vec![1]) };
    assert!(State::new(state.origin().clone(), BTreeMap::from([("a".to_owned(), shape)])).is_err());
}
