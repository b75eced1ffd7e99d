//! The detector with arbitrary parameters and frames, the tracker, and their states.

use std::cell::RefCell;
use std::collections::BTreeMap;

use apgstmd_core::params::{BackgroundMotion, Localise, TemporalEngine};
use apgstmd_core::state::{Array, StateError, Values};
use apgstmd_core::tracking::{Observation, TrackPoint};
use apgstmd_core::{
    Bank, BankParams, Detection, Detector, EgoMotion, Frame, Machine, Model, Params, Preset, Response, Size, State,
    Tracker,
};
use arbitrary::Unstructured;
use ndarray::Array2;

use super::{any_float, real, text_of, whole};
use crate::compare::Pair;

/// Half a circle, and what f32 rounds it to.
const ANGLE: f32 = std::f32::consts::PI + 1e-3;

/// What of a rule's words bounds a parameter.
fn bounds(rule: &str) -> Option<(f64, f64)> {
    let (_, rest) = rule.split_once("between ")?;
    let (low, high) = rest.split_once(" and ")?;
    Some((low.parse().ok()?, high.parse().ok()?))
}

/// Changes some parameters to what their rules allow: anything, or, `tamely`, up to half and twice of what they were.
fn change(params: &Params, input: &mut Unstructured<'_>, tamely: bool) -> Params {
    let mut all = toml::Table::try_from(params).expect("parameters are plain tables");
    let fields: Vec<_> = Params::fields().collect();
    for _ in 0..whole(input, 0..=8) {
        let field = fields[whole(input, 0..=fields.len() as u32 - 1) as usize];
        let rule = (field.rule)();
        let value = &mut all[field.section][field.name];
        let number = |input: &mut Unstructured<'_>, now: f64| {
            let (low, high) = bounds(&rule).expect("numbers have bounds");
            if tamely { (now * real(input, (0.5, 2.0))).clamp(low, high) } else { real(input, (low, high)) }
        };
        match value {
            toml::Value::Boolean(value) => *value = input.arbitrary().unwrap_or_default(),
            toml::Value::Float(value) => *value = number(input, *value),
            toml::Value::Integer(value) => *value = number(input, *value as f64).round() as i64,
            toml::Value::String(value) => {
                let names: Vec<&str> = rule.split('"').skip(1).step_by(2).collect();
                *value = names[whole(input, 0..=names.len() as u32 - 1) as usize].to_owned();
            }
            toml::Value::Array(values) => {
                let scales = (0..whole(input, 1..=4)).map(|_| toml::Value::Float(number(input, 2.5)));
                *values = scales.collect();
            }
            _ => unreachable!("no parameter is of another kind"),
        }
    }
    let text = toml::to_string(&all).expect("a plain table");
    // Rules between parameters may forbid it.
    Params::from_toml(&text).unwrap_or_else(|_| params.clone())
}

fn base(input: &mut Unstructured<'_>) -> Params {
    let speed = f64::from(whole(input, 8..=40)) / 10.0;
    let params = match whole(input, 0..=6) {
        0..=1 => Params::preset(Preset::Practical),
        2 => Params::preset(Preset::Paper),
        other => Params::for_model(Model::ALL[(other as usize - 2).min(Model::ALL.len() - 1)]),
    };
    params.for_speed(speed).expect("a valid speed")
}

/// Where detections are moved onto the target, a detector begins by following an ideal one, over many times the pixels of all
/// frames here: a few inputs have that, where the filters settle soon. `tests/extremes.rs` has it for every parameter.
fn seldom_moved(params: &mut Params, input: &mut Unstructured<'_>) {
    const SOON: f64 = 20.0;
    let Params { lamina, lamina_inhibition, medulla, estmd, emd, .. } = &*params;
    let inhibition = lamina_inhibition.excitation_tau.max(lamina_inhibition.inhibition_tau);
    let delays = [medulla.mi1_tau, medulla.tm1_4_tau, medulla.tm1_5_tau, estmd.off_tau, emd.tau, inhibition];
    let slowest = delays.into_iter().fold(lamina.slow_tau, f64::max);
    if whole(input, 0..=7) > 0 || slowest > SOON {
        params.detection.localise = Localise::Response;
    }
}

fn size(input: &mut Unstructured<'_>) -> Size {
    Size::new(whole(input, 16..=24) as usize, whole(input, 16..=24) as usize)
}

/// Frames: a ground with a spot that moves, and what the input makes of some pixels.
fn frame(input: &mut Unstructured<'_>, size: Size, t: usize, speed: f64) -> Array2<u8> {
    let (ground, spot) = (input.arbitrary().unwrap_or(200u8), input.arbitrary().unwrap_or(10u8));
    let at = 4.0 + speed * t as f64;
    let row = size.height as f64 / 2.0;
    let mut frame = Array2::from_shape_fn((size.height, size.width), |(y, x)| {
        let wave = (7 * x + 3 * y) % 16;
        if (x as f64 - at).abs() < 2.0 && (y as f64 - row).abs() < 2.0 {
            spot
        } else {
            ground.saturating_sub(wave as u8)
        }
    });
    for _ in 0..whole(input, 0..=3) {
        let (y, x) = (whole(input, 0..=size.height as u32 - 1), whole(input, 0..=size.width as u32 - 1));
        frame[[y as usize, x as usize]] = input.arbitrary().unwrap_or_default();
    }
    frame
}

/// The same as the naive model, stage by stage, frame by frame.
pub fn detector(bytes: &[u8]) {
    let mut input = Unstructured::new(bytes);
    let params = base(&mut input);
    let mut params = change(&params, &mut input, true);
    // On so few pixels whether a motion explains the picture is a matter of rounding; tests/motion.rs compares it.
    params.rejection.background = BackgroundMotion::Off;
    seldom_moved(&mut params, &mut input);
    let size = size(&mut input);
    let mut pair = Pair::new(size, &params, 1);
    for t in 0..whole(&mut input, 1..=14) as usize {
        let frame = frame(&mut input, size, t, params.prediction.v_opt);
        if let Err(differs) = pair.step(frame.view()) {
            panic!("frame {t}: {differs}\n{}", params.to_toml());
        }
    }
}

/// Everything that leaves is a number; only directions may be NaN, where there is none.
pub fn is_finite(response: &Response) {
    assert!(response.map.iter().all(|value| value.is_finite()), "the response is finite");
    assert!(response.direction.iter().all(|value| value.is_nan() || value.abs() <= ANGLE), "angles");
    for found in &response.detections {
        let Detection { x, y, score, direction, straightness, displacement, velocity, .. } = *found;
        assert!(
            [x, y, score, straightness, displacement, velocity.0, velocity.1].iter().all(|value| value.is_finite()),
            "{found:?}"
        );
        assert!(direction.is_nan() || direction.abs() <= ANGLE, "{found:?}");
    }
    let EgoMotion { rotation, zoom, residual, .. } = response.ego_motion;
    let (dx, dy) = response.background_shift;
    assert!([rotation, zoom, residual, dx, dy].iter().all(|value| value.is_finite()), "{:?}", response.ego_motion);
}

fn bits(response: &Response) -> (Vec<u32>, String) {
    let maps = response.map.iter().chain(&response.direction).map(|value| value.to_bits()).collect();
    let rest = (&response.detections, response.background_shift, response.ego_motion, response.cut);
    (maps, format!("{rest:?}"))
}

/// Any parameters that are valid and any samples at all: frames are refused or give numbers, the same in blocks as one by
/// one, and a frame that is refused leaves no trace.
pub fn extremes(bytes: &[u8]) {
    let mut input = Unstructured::new(bytes);
    let params = base(&mut input);
    let mut params = change(&params, &mut input, false);
    let size = size(&mut input);
    // Weighted sums over thousands of frames are valid, and take minutes.
    params.engine.temporal = TemporalEngine::Cascade;
    seldom_moved(&mut params, &mut input);
    let mut one = Detector::with_threads(size, &params, 1).expect("valid parameters");
    let machine = Machine { threads: 1, together: whole(&mut input, 1..=8) as usize, ..Machine::default() };
    let mut blocks = Detector::with_options(size, &params, &machine).expect("valid parameters");
    let mut frames: Vec<Array2<f32>> = Vec::new();
    let mut expected = Vec::new();
    let mut response = one.make_response();
    for t in 0..whole(&mut input, 1..=16) as usize {
        let mut picture = frame(&mut input, size, t, params.prediction.v_opt).mapv(|value| f32::from(value) / 255.0);
        match whole(&mut input, 0..=9) {
            0 => picture.fill(any_float(&mut input) as f32),
            1 => {
                let odd = any_float(&mut input) as f32;
                picture.iter_mut().step_by(whole(&mut input, 1..=200) as usize).for_each(|value| *value = odd);
            }
            2 => picture.mapv_inplace(|value| value * 1e-30),
            3 => picture.mapv_inplace(|value| if value > 0.5 { 1.0 } else { 0.0 }),
            _ => {}
        }
        let usable = picture.iter().all(|value| (-1e-3..=1.0 + 1e-3).contains(&f64::from(*value)));
        let taken = one.process_into(Frame::from(picture.view()), &mut response);
        assert_eq!(taken.is_ok(), usable, "{taken:?}");
        if usable {
            is_finite(&response);
            expected.push(bits(&response));
            frames.push(picture);
        }
    }
    let views: Vec<Frame<'_>> = frames.iter().map(|frame| Frame::from(frame.view())).collect();
    let mut responses: Vec<Response> = views.iter().map(|_| blocks.make_response()).collect();
    blocks.process_block(&views, &mut responses).expect("they were taken one by one");
    for (t, (response, expected)) in responses.iter().zip(&expected).enumerate() {
        assert!(bits(response) == *expected, "frame {t} differs in a block");
    }
}

/// Any detections at all: points that are reported are numbers, ids count from 0 and are never taken back.
pub fn tracker(bytes: &[u8]) {
    let mut input = Unstructured::new(bytes);
    let params = change(&Params::preset(Preset::Practical), &mut input, false);
    let mut tracker = Tracker::new(Size::new(64, 80), &params).expect("valid parameters");
    let wild = whole(&mut input, 0..=2) == 0;
    let number = |input: &mut Unstructured<'_>, most: u32| {
        if wild { any_float(input) as f32 } else { whole(input, 0..=most * 4) as f32 / 4.0 }
    };
    let (mut frame, mut next) = (0, 0);
    let mut last: BTreeMap<u64, usize> = BTreeMap::new();
    for _ in 0..whole(&mut input, 0..=30) {
        let steps = if wild { input.arbitrary().unwrap_or(1) } else { whole(&mut input, 1..=3) };
        frame += steps as usize;
        let detections: Vec<Detection> = (0..whole(&mut input, 0..=5))
            .map(|trace| Detection {
                x: number(&mut input, 80),
                y: number(&mut input, 64),
                score: number(&mut input, 4),
                direction: number(&mut input, 3),
                trace: u64::from(trace),
                ..Detection::default()
            })
            .collect();
        let map = Array2::from_elem((64, 80), number(&mut input, 1));
        let seen = Observation {
            steps,
            background_shift: (number(&mut input, 4), number(&mut input, 4)),
            ego_motion: EgoMotion {
                zoom: if wild { number(&mut input, 2) } else { 1.0 },
                rotation: if wild { number(&mut input, 2) } else { 0.0 },
                ..EgoMotion::default()
            },
            cut: whole(&mut input, 0..=15) == 0,
            map: Some(map.view()).filter(|_| whole(&mut input, 0..=1) == 0),
            lag: if wild { number(&mut input, 3) } else { 1.0 },
            ..Observation::new(frame, &detections)
        };
        let mut points: Vec<TrackPoint> = Vec::new();
        tracker.process_into(&seen, &mut points);
        for point in &points {
            let TrackPoint { x, y, vx, vy, score, .. } = *point;
            assert!([x, y, vx, vy, f64::from(score)].iter().all(|value| value.is_finite()), "{point:?}");
            assert!(point.frame <= frame && point.track <= next, "{point:?}");
            next = next.max(point.track + 1);
            assert!(last.insert(point.track, point.frame).is_none_or(|before| before < point.frame), "{point:?}");
        }
    }
}

/// A detector or a bank.
trait Looks {
    fn process(&mut self, frame: &Array2<u8>, response: &mut Response);
    fn state(&mut self) -> State;
    fn restore(&mut self, state: &State) -> Result<(), StateError>;
    fn reset(&mut self);
    fn frames(&self) -> u64;
    fn response(&self) -> Response;
}

macro_rules! looks {
    ($type:ty) => {
        impl Looks for $type {
            fn process(&mut self, frame: &Array2<u8>, response: &mut Response) {
                self.process_into(frame.view(), response).expect("a frame");
            }
            fn state(&mut self) -> State {
                self.state()
            }
            fn restore(&mut self, state: &State) -> Result<(), StateError> {
                self.restore(state)
            }
            fn reset(&mut self) {
                self.reset();
            }
            fn frames(&self) -> u64 {
                self.frames()
            }
            fn response(&self) -> Response {
                self.make_response()
            }
        }
    };
}

looks!(Detector);
looks!(Bank);

/// A state of what has seen something.
struct Kept {
    looks: Box<dyn Looks>,
    state: State,
    /// What a new one makes of the first frame.
    first: (Vec<u32>, String),
}

impl Kept {
    const SIZE: Size = Size { height: 16, width: 24 };

    /// The same frames whatever the input.
    fn picture(t: usize) -> Array2<u8> {
        frame(&mut Unstructured::new(&[200, 10]), Self::SIZE, t, 0.8)
    }

    fn new(mut looks: Box<dyn Looks>) -> Self {
        let mut response = looks.response();
        looks.process(&Self::picture(0), &mut response);
        let first = bits(&response);
        for t in 1..20 {
            looks.process(&Self::picture(t), &mut response);
        }
        Self { state: looks.state(), first, looks }
    }

    fn of_detector() -> Self {
        let params = Params::preset(Preset::Practical).for_speed(1.0).expect("a valid speed");
        Self::new(Box::new(Detector::with_threads(Self::SIZE, &params, 1).expect("valid parameters")))
    }

    /// Its members hold candidates.
    fn of_bank() -> Self {
        let params = BankParams::with_members(Params::preset(Preset::Practical), &[0.25, 0.125], &[5.0]);
        Self::new(Box::new(
            Bank::with_options(Self::SIZE, &params, &Machine::with_threads(1)).expect("valid parameters"),
        ))
    }
}

thread_local! {
    // Making one takes a hundred times as long as what is done with it here.
    static KEPT: RefCell<[Kept; 2]> = RefCell::new([Kept::of_detector(), Kept::of_bank()]);
}

/// Any file is refused or read; a state with other arrays is refused or goes on to numbers, and one that is refused leaves
/// the detector, or bank, as it was.
pub fn state(bytes: &[u8]) {
    let _ = State::from_bytes(bytes);
    let which = usize::from(bytes.first().is_some_and(|byte| byte % 2 == 1));
    KEPT.with_borrow_mut(|kept| state_with(&mut kept[which], &mut Unstructured::new(bytes)));
}

fn state_with(kept: &mut Kept, input: &mut Unstructured<'_>) {
    let Kept { looks, state, first } = kept;
    let mut arrays = state.arrays().clone();
    let mut names: Vec<String> = arrays.keys().cloned().collect();
    names.push(text_of(input.bytes(4).unwrap_or_default()).into_owned());
    for _ in 0..whole(input, 0..=4) {
        let name = &names[whole(input, 0..=names.len() as u32 - 1) as usize];
        match whole(input, 0..=6) {
            0 => drop(arrays.remove(name)),
            1 => drop(arrays.insert(name.clone(), Array { shape: vec![2], values: Values::F32(vec![1.0, f32::NAN]) })),
            _ => {
                let (at, value) = (input.arbitrary().unwrap_or(0usize), any_float(input));
                let Some(array) = arrays.get_mut(name) else { continue };
                let Some(at) = at.checked_rem(array.values.len()) else { continue };
                match &mut array.values {
                    Values::F32(values) => values[at] = value as f32,
                    Values::F64(values) => values[at] = value,
                    Values::U8(values) => values[at] = value as u8,
                    Values::U32(values) => values[at] = value as u32,
                    Values::U64(values) => values[at] = value as u64,
                }
            }
        }
    }
    let changed = State::new(state.origin().clone(), arrays).expect("shapes are those of before");
    looks.reset();
    let mut response = looks.response();
    let file = State::from_bytes(&changed.to_bytes()).expect("what was written can be read");
    match looks.restore(&file) {
        Err(error) => {
            assert!(!error.to_string().is_empty());
            assert_eq!(looks.frames(), 0);
            looks.process(&Kept::picture(0), &mut response);
            assert!(bits(&response) == *first, "a state that is refused leaves a trace: {error}");
        }
        Ok(()) => {
            for t in 20..24 {
                looks.process(&frame(input, Kept::SIZE, t, 0.8), &mut response);
                is_finite(&response);
            }
        }
    }
}
