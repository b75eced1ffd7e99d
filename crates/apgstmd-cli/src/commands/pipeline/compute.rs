//! The model over what was read, in blocks of what is there: a block gives the same bits as its frames one by one.

use std::ops::RangeInclusive;
use std::sync::mpsc::SyncSender;
use std::time::{Duration, Instant};

use apgstmd_core::tracking::Observation;
use apgstmd_core::{
    Detection, EgoMotion, FalseAlarms, Frame, Machine, ParamError, Response, Size, Stage, State, StateError, Timing,
    Tracker,
};
use indicatif::ProgressBar;
use ndarray::{Array2, Array3};

use super::Options;
use super::ahead::{Read, ReadAhead, room};
use super::checkpoint::{Computing, States};
use super::engine::{Engine, tracked};
use super::limit::Limit;
use crate::Outcome;
use crate::args::OnError;
use crate::failure::Failure;
use crate::interrupt;
use crate::sink::Seen;
use crate::sink::run_json::{First, Skipped, Threshold};
use crate::source::{Arrival, Picture};

/// A computed frame on its way to the sinks.
pub(super) struct Computed {
    pub seen: Seen,
    pub size: Size,
    pub decode: Duration,
    pub compute: Duration,
    /// Copying the inner maps that are to be written.
    pub copy: Duration,
    /// When its picture was there.
    pub came: Instant,
}

/// What goes to the one that writes.
pub(super) enum Message {
    Frame(Box<Computed>),
    /// All frames before it are out: with their rows, this is where the run can be resumed.
    Checkpoint(Box<(States, Computing)>),
}

/// What became of the frames that left no result, and where the time went.
#[derive(Default)]
pub(super) struct Left {
    pub skipped: First<Skipped>,
    pub interrupted: bool,
    /// Live: those dropped.
    pub dropped: Option<usize>,
    /// The first and last frame that came, and those between that did not, as ranges.
    pub first: Option<usize>,
    pub last: Option<usize>,
    pub left_out: First<RangeInclusive<usize>>,
    /// What the stages of the model took, of all frames.
    pub stages: Timing,
    /// The thresholds at the end.
    pub threshold: Option<Threshold>,
}

impl Left {
    /// A frame comes; those between it and the last one, `stride` apart, were left out.
    fn came(&mut self, frame: usize, stride: usize) {
        self.first.get_or_insert(frame);
        if let Some(last) = self.last.replace(frame)
            && frame > last + stride
        {
            let left_out = last + stride..=frame - stride;
            let frames = 1 + (left_out.end() - left_out.start()) / stride;
            self.left_out.add(left_out, frames);
        }
    }
}

/// The receiver of results has gone, with an error of its own.
struct Gone;

/// Why computing ends before the last frame.
enum End {
    Failed(Failure),
    Gone,
}

impl From<Gone> for End {
    fn from(_: Gone) -> Self {
        Self::Gone
    }
}

impl From<Failure> for End {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

/// A frame with what was found in it.
struct Found {
    accepted: Accepted,
    detections: Vec<Detection>,
    /// Shift of the background, motion of the camera, whether the scene was cut.
    camera: ((f32, f32), EgoMotion, bool),
    maps: Vec<(Stage, Array3<f32>)>,
    /// Where the sinks want it.
    response: Option<Array2<f32>>,
    compute: Duration,
    copy: Duration,
}

struct Model {
    detector: Engine,
    limit: Option<Limit>,
    /// As many as frames are computed together.
    responses: Vec<Response>,
    tracker: Option<Tracker>,
    /// The last frame computed, with its time.
    last: Option<(usize, Option<f64>)>,
    /// Where its first picture came from.
    first: String,
}

impl Model {
    /// Takes up what an earlier run remembered.
    fn resume(&mut self, (states, computing): (States, Computing)) -> Outcome {
        let Computing { origin, last, limits, .. } = computing;
        let mut take = || -> Result<(), StateError> {
            self.detector.restore(&State::from_bytes(&states.engine)?)?;
            if let (Some(tracker), Some(state)) = (&mut self.tracker, &states.tracker) {
                tracker.restore(&State::from_bytes(state)?)?;
            }
            if let (Some(limit), Some(state)) = (&mut self.limit, &states.alarms) {
                limit.restore(&State::from_bytes(state)?, limits)?;
            }
            Ok(())
        };
        take().map_err(|error| Failure::failed(format_args!("cannot go on from the checkpoint: {error}")))?;
        (self.first, self.last) = (origin, last);
        Ok(())
    }
}

/// A picture that fits the detector.
struct Accepted {
    frame: usize,
    name: String,
    origin: String,
    time: Option<f64>,
    picture: Picture,
    decode: Duration,
    came: Instant,
}

pub(super) struct Compute<'a> {
    options: &'a Options<'a>,
    bar: &'a ProgressBar,
    results: SyncSender<Message>,
    model: Option<Model>,
    /// What an earlier run remembered, until there is a model to take it up.
    resumed: Option<(States, Computing)>,
    /// Frames since the last checkpoint.
    since: usize,
    /// Held back, and how many are to be.
    held: Vec<Found>,
    hold: usize,
    left: Left,
}

impl<'a> Compute<'a> {
    pub fn new(
        options: &'a Options<'a>,
        bar: &'a ProgressBar,
        results: SyncSender<Message>,
        resumed: Option<(States, Computing)>,
    ) -> Self {
        let mut left = Left::default();
        if let Some((_, Computing { came, left_out, skipped, .. })) = &resumed {
            ((left.first, left.last), left.left_out, left.skipped) = (*came, left_out.clone(), skipped.clone());
        }
        Self { options, bar, results, model: None, resumed, since: 0, held: Vec::new(), hold: 0, left }
    }

    /// Until the last frame, an error, Ctrl-C, or nobody takes the results.
    pub fn run(mut self, mut ahead: ReadAhead) -> (Left, Outcome) {
        let ended = self.blocks(&mut ahead);
        let ended = if self.left.interrupted { ended.and_then(|()| self.checkpoint()) } else { ended };
        // However it ended, what was found is written.
        let released = if matches!(ended, Err(End::Gone)) { Ok(()) } else { self.release() };
        let outcome = match ended.and(released) {
            Ok(()) | Err(End::Gone) => Ok(()),
            Err(End::Failed(failure)) => Err(failure),
        };
        self.left.threshold = self.threshold();
        self.left.dropped = ahead.dropped();
        (self.left, outcome)
    }

    /// The scores that were asked for at the end.
    fn threshold(&mut self) -> Option<Threshold> {
        match (&self.model, self.resumed.take()) {
            (Some(model), _) => model.limit.as_ref().and_then(Limit::record),
            // Nothing came after the checkpoint.
            (None, Some((states, computing))) => {
                let mut limit = self.limit()?;
                let alarms = State::from_bytes(states.alarms.as_deref()?).ok()?;
                limit.restore(&alarms, computing.limits).ok()?;
                limit.record()
            }
            (None, None) => None,
        }
    }

    fn limit(&self) -> Option<Limit> {
        let options = self.options;
        let follows = options.bank.is_some() || options.false_alarms.is_some();
        follows.then(|| {
            Limit::new(options.false_alarms, options.tracks && !options.fixed_births(), options.bank.is_some())
        })
    }

    fn blocks(&mut self, ahead: &mut ReadAhead) -> Result<(), End> {
        loop {
            if interrupt::asked() {
                self.left.interrupted = true;
                return Ok(());
            }
            let Some(read) = ahead.next() else {
                self.left.interrupted = interrupt::asked();
                return Ok(());
            };
            let mut block = Vec::new();
            self.take(read, &mut block)?;
            let most = self.model.as_ref().map_or(1, |model| model.responses.len());
            while block.len() < most
                && let Some(read) = ahead.next_at_hand()
            {
                self.take(read, &mut block)?;
            }
            self.process(block)?;
            let every = self.options.checkpoints.and_then(|checkpoints| checkpoints.every);
            if every.is_some_and(|every| self.since >= every) {
                self.checkpoint()?;
            }
        }
    }

    /// Says what it remembers, between two blocks. While frames are held back, there is nothing to go on from.
    fn checkpoint(&mut self) -> Result<(), End> {
        let wanted = self.options.checkpoints.is_some_and(|checkpoints| checkpoints.every.is_some());
        let Some(model) = self.model.as_mut().filter(|_| wanted && self.held.is_empty()) else { return Ok(()) };
        let (alarms, limits) = model.limit.as_mut().map(Limit::state).unzip();
        let states = States {
            engine: model.detector.state().to_bytes(),
            tracker: model.tracker.as_mut().map(|tracker| tracker.state().to_bytes()),
            alarms: alarms.map(|alarms| alarms.to_bytes()),
        };
        let computing = Computing {
            origin: model.first.clone(),
            last: model.last,
            came: (self.left.first, self.left.last),
            left_out: self.left.left_out.clone(),
            skipped: self.left.skipped.clone(),
            limits: limits.unwrap_or_default(),
        };
        self.since = 0;
        Ok(self.results.send(Message::Checkpoint(Box::new((states, computing)))).map_err(|_| Gone)?)
    }

    /// Adds a picture to the block. One that cannot be used comes after those before it have been computed.
    fn take(&mut self, read: Read, block: &mut Vec<Accepted>) -> Result<(), End> {
        let Read { arrival: Arrival { frame, name, origin, time, picture }, spent, came } = read;
        self.left.came(frame, self.options.span.stride());
        match picture.and_then(|picture| self.fits(&picture).map(|()| picture)) {
            Ok(picture) => {
                if self.model.is_none() {
                    let mut model = self.make(&picture, &origin)?;
                    match self.resumed.take() {
                        Some(resumed) => model.resume(resumed)?,
                        None => self.hold = self.to_hold(&picture),
                    }
                    self.model = Some(model);
                }
                block.push(Accepted { frame, name, origin, time, picture, decode: spent, came });
                Ok(())
            }
            Err(reason) => {
                self.process(std::mem::take(block))?;
                Ok(self.refuse(frame, name, &origin, reason)?)
            }
        }
    }

    fn fits(&self, picture: &Picture) -> Result<(), String> {
        match &self.model {
            Some(model) if model.detector.size() != picture.size() => Err(format!(
                "it is {} (height x width), but {} is {}: all pictures must have one size",
                picture.size(),
                model.first,
                model.detector.size()
            )),
            _ => Ok(()),
        }
    }

    fn refuse(&mut self, frame: usize, name: String, origin: &str, reason: String) -> Outcome {
        self.bar.inc(1);
        match self.options.on_error {
            OnError::Stop => Err(Failure::failed(format_args!("cannot use {origin}: {reason}"))
                .hint("--on-error skip leaves out pictures that cannot be used")),
            OnError::Skip => {
                self.left.skipped.add(Skipped { frame, name, reason }, 1);
                Ok(())
            }
        }
    }

    fn make(&self, picture: &Picture, origin: &str) -> Outcome<Model> {
        let mut detector = new_detector(picture, origin, self.options)?;
        if let Some(look_in) = self.options.look_in {
            detector.look_in(&look_in.region(picture.size())?).map_err(Failure::usage)?;
        }
        // A response holds two maps.
        let bytes = picture.bytes() + 2 * size_of::<f32>() * picture.size().area();
        // Only the last frame of a block can be looked into, and live nothing may wait for others.
        let most =
            if self.options.dump.is_some() || self.options.live { 1 } else { detector.block_len().min(room(bytes)) };
        let tracker = self.options.tracks.then(|| match self.options.bank {
            None => Tracker::new(picture.size(), self.options.params),
            Some(bank) => Tracker::new(picture.size(), &tracked(bank)?),
        });
        let tracker = tracker.transpose().map_err(Failure::usage)?;
        let limit = self.limit();
        // Made one by one: a copy has no room for detections.
        let responses = (0..most).map(|_| detector.make_response()).collect();
        Ok(Model { responses, first: origin.to_owned(), detector, limit, tracker, last: None })
    }

    /// How many frames wait until the thresholds are known: live none, and none whose inner maps are written.
    fn to_hold(&self, picture: &Picture) -> usize {
        match self.options.false_alarms.is_some() && !self.options.live && self.options.dump.is_none() {
            true => (HELD_PIXELS / picture.size().area().max(1)).clamp(FalseAlarms::FIRST as usize, HELD),
            false => 0,
        }
    }

    fn process(&mut self, block: Vec<Accepted>) -> Result<(), End> {
        let mut block = block.into_iter();
        while let Some(Model { detector, responses, .. }) = &mut self.model
            && block.len() > 0
        {
            let begin = Instant::now();
            let before = detector.frames();
            let frames: Vec<Frame<'_>> = block.as_slice().iter().map(|accepted| accepted.picture.frame()).collect();
            let processed = detector.process_block(&frames, &mut responses[..frames.len()], &mut self.left.stages);
            let done = (detector.frames() - before) as usize;
            let compute = begin.elapsed() / done.max(1) as u32;
            for (index, accepted) in block.by_ref().take(done).enumerate() {
                self.send(accepted, index, compute)?;
            }
            if let (Err(error), Some(Accepted { frame, name, origin, .. })) = (processed, block.next()) {
                self.refuse(frame, name, &origin, error.to_string())?;
            }
        }
        Ok(())
    }

    /// Sends a frame on, or holds it back until the thresholds are known.
    fn send(&mut self, accepted: Accepted, index: usize, compute: Duration) -> Result<(), End> {
        let Some(Model { detector, responses, limit, .. }) = &mut self.model else { return Ok(()) };
        let begin = Instant::now();
        if let Some(limit) = limit {
            limit.add(&responses[index].detections);
        }
        let limited = begin.elapsed();
        let begin = Instant::now();
        let wanted = self.options.dump.map_or(&[][..], |dump| dump.stages_of(accepted.frame));
        let probe = detector.probe();
        let copied = wanted.iter().zip(probe.iter().cycle());
        let copied = copied.map(|(&stage, probe)| Ok((stage, probe.stage(stage).map_err(Failure::failed)?)));
        let maps = copied.collect::<Outcome<Vec<_>>>()?;
        let found = &responses[index];
        let response = self.options.response.then(|| found.map.clone());
        let copy = begin.elapsed();
        let detections = found.detections.clone();
        let camera = (found.background_shift, found.ego_motion, found.cut);
        let found = Found { accepted, detections, camera, maps, response, compute: compute + limited, copy };
        if self.held.len() < self.hold {
            self.held.push(found);
            if self.held.len() == self.hold {
                self.release()?;
            }
            return Ok(());
        }
        self.finish(found, Some(index))
    }

    /// The frames that were held back; from now on none are.
    fn release(&mut self) -> Result<(), End> {
        self.hold = 0;
        if let Some(Model { limit: Some(limit), .. }) = &mut self.model {
            limit.look();
        }
        std::mem::take(&mut self.held).into_iter().try_for_each(|found| self.finish(found, None))
    }

    /// Tracks, rows; `index` is that of its response, where that is still there.
    fn finish(&mut self, found: Found, index: Option<usize>) -> Result<(), End> {
        let Some(Model { detector, responses, tracker, last, limit, .. }) = &mut self.model else { return Ok(()) };
        let Found { accepted, mut detections, camera, maps, response, compute, copy } = found;
        let (background_shift, ego_motion, cut) = camera;
        let Accepted { frame, name, time, picture, decode, came, .. } = accepted;
        let begin = Instant::now();
        // Live nothing waits until the clip has told.
        let unknown = self.options.live && limit.as_ref().is_some_and(|limit| !limit.holds());
        if let Some(limit) = limit {
            detections.retain(|found| !unknown && found.score >= limit.least_score());
        }
        let mut tracks = Vec::new();
        if let Some(tracker) = tracker {
            // Frames that were dropped, skipped or could not be used have passed all the same.
            let steps = last.map_or(1, |last| self.options.span.steps(last, (frame, time)));
            let steps = u32::try_from(steps).unwrap_or(u32::MAX);
            let observation = Observation {
                time,
                steps,
                background_shift,
                ego_motion,
                cut,
                in_world: self.options.bank.is_some(),
                map: index.map(|index| responses[index].map.view()),
                lag: detector.lag(),
                birth_score: limit.as_ref().map_or(0.0, Limit::birth_score),
                ..Observation::new(frame, &detections)
            };
            tracker.process_into(&observation, &mut tracks);
        }
        *last = Some((frame, time));
        let compute = compute + begin.elapsed();
        let seen =
            Seen { frame, name, time, picture, detections, tracks, background_shift, ego_motion, cut, maps, response };
        self.bar.inc(1);
        self.since += 1;
        let computed = Computed { seen, size: detector.size(), decode, compute, copy, came };
        Ok(self.results.send(Message::Frame(Box::new(computed))).map_err(|_| Gone)?)
    }
}

/// Most frames that are held back until thresholds are known, and, down to ten frames, most pixels.
const HELD: usize = 30;
const HELD_PIXELS: usize = 32 << 20;

/// Bytes of the maps of frames that are computed together.
const TOGETHER: usize = 24 << 20;

fn new_detector(picture: &Picture, origin: &str, options: &Options<'_>) -> Outcome<Engine> {
    // What is computed together should stay in the caches, and takes memory.
    let size = picture.size();
    let together = (TOGETHER / (7 * size_of::<f32>() * size.area()).max(1)).clamp(1, 4);
    let machine = Machine { together, ..options.machine.clone() };
    Engine::new(size, options, &machine).map_err(|error| match error {
        ParamError::TooSmall { .. } | ParamError::TooLarge { .. } => {
            Failure::failed(format_args!("cannot use {origin}: {error}"))
        }
        ParamError::ThreadStart { .. } | ParamError::Memory { .. } => Failure::failed(error),
        _ => Failure::usage(error),
    })
}
