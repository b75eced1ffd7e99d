//! The streaming detector: made once for a frame size, fed frame by frame.

use std::slice::{from_mut, from_ref};

use crate::detection::{Detection, Response};
use crate::error::{FrameError, ParamError};
use crate::filter::temporal::MOST_TOGETHER;
use crate::frame::{Frame, Size};
use crate::memory::{Heap, Memory, ask_for, owned};
use crate::model::{Wiring, lag, latency, memory, wire};
use crate::params::Params;
use crate::plane::Plane;
use crate::probe::Probe;
use crate::region::{Region, RegionError};
use crate::row::bands::Bands;
use crate::row::machine::{Machine, SimdLevel};
use crate::row::workers::Workers;
use crate::scroll::Scroll;
use crate::stage::background::Finding;
use crate::state::{Origin, Remember, State, StateError, Visit};
use crate::timing::Timing;

/// Attention reads what prediction said a horizon ago: within it nothing waits for anything later.
fn together(params: &Params, machine: &Machine) -> usize {
    machine.together.clamp(1, MOST_TOGETHER.min(params.horizon()))
}

/// Of its states.
const KIND: &str = "detector";

impl Remember for Detector {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        visit.part("processed", &mut self.frames)?;
        self.model.show(visit)
    }
}

/// Fewest rows and columns of a frame.
pub const LEAST_SIDE: usize = 16;
/// Most pixels of a frame.
pub const MOST_PIXELS: usize = 1 << 28;
/// Pixels of a frame that there is memory for wherever this program runs: some tens of megabytes.
pub(crate) const ALWAYS_THERE: usize = 1 << 16;
/// Most threads of a detector.
pub const MOST_THREADS: usize = 256;

/// Finds small moving targets in a stream of frames of one size.
///
/// Everything is allocated by `new`; [`Detector::process_into`] allocates nothing. The numbers do not depend on the
/// number of threads.
///
/// ```
/// use apgstmd_core::{Detector, Params, Preset, Size};
/// use ndarray::Array2;
///
/// let params = Params::preset(Preset::Practical).for_speed(1.0)?;
/// let mut detector = Detector::new(Size::new(64, 96), &params)?;
/// let mut response = detector.make_response();
/// for t in 0..40 {
///     let frame = Array2::from_shape_fn((64, 96), |(y, x)| {
///         if x.abs_diff(10 + t) < 3 && y.abs_diff(32) < 3 { 0 } else { 255u8 }
///     });
///     detector.process_into(frame.view(), &mut response)?;
/// }
/// let target = response.detections[0];
/// assert!((target.x - 49.0).abs() < 2.0 && (target.y - 32.0).abs() < 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Detector {
    params: Params,
    frames: u64,
    /// How far behind a target its response peaks, px.
    lag: f32,
    /// Speed, px/frame, and size, px, of the targets it is tuned to.
    tuning: (f32, f32),
    /// Where targets are reported, if not anywhere.
    region: Option<Region>,
    luminance: Vec<Plane>,
    model: Box<dyn Wiring>,
    workers: Workers,
}

impl Detector {
    /// A detector for frames of `size`, using as many threads as the machine has cores.
    ///
    /// # Errors
    /// Parameters out of range, frames below 16 x 16, more memory than the system gives.
    pub fn new(size: Size, params: &Params) -> Result<Self, ParamError> {
        Self::with_options(size, params, &Machine::default())
    }

    /// As [`Detector::new`] with a number of threads. With 1, everything runs on the calling thread.
    ///
    /// # Errors
    /// As `new`; also when the threads cannot be started.
    pub fn with_threads(size: Size, params: &Params, threads: usize) -> Result<Self, ParamError> {
        Self::with_options(size, params, &Machine::with_threads(threads))
    }

    /// As [`Detector::new`] with a choice of threads and instruction set.
    ///
    /// # Errors
    /// As `with_threads`. An instruction set that the machine does not have is none: see [`SimdLevel::clamped`].
    pub fn with_options(size: Size, params: &Params, machine: &Machine) -> Result<Self, ParamError> {
        params.validate()?;
        if size.height < LEAST_SIDE || size.width < LEAST_SIDE {
            return Err(ParamError::TooSmall { size, least: LEAST_SIDE });
        }
        if size.height.checked_mul(size.width).is_none_or(|area| area > MOST_PIXELS) {
            return Err(ParamError::TooLarge { size, most: MOST_PIXELS });
        }
        let workers = Workers::new(machine)?;
        if size.area() > ALWAYS_THERE {
            ask_for(size, Self::needs(size, params, machine))?;
        }
        Ok(Self::made(size, params, machine, workers))
    }

    /// All of it has been checked, and there is memory.
    pub(crate) fn made(size: Size, params: &Params, machine: &Machine, workers: Workers) -> Self {
        let together = together(params, machine);
        Self {
            params: params.clone(),
            frames: 0,
            lag: lag::measure(params, workers.simd(), 1),
            tuning: (lag::tuned_speed(params) as f32, params.target_size() as f32),
            region: None,
            luminance: (0..together).map(|_| Plane::new(size)).collect(),
            model: wire(size, params, machine.threads, together),
            workers,
        }
    }

    /// What it will hold, about: its parameters are valid.
    pub(crate) fn needs(size: Size, params: &Params, machine: &Machine) -> Memory {
        let together = together(params, machine);
        owned(together * Plane::bytes(size)) + memory(size, params, machine.threads, together)
    }

    /// Looks for targets in a region only, from the next frame on, or again everywhere. What it remembers stays.
    ///
    /// Detections outside are not reported; the inhibition of the lobula, which costs most, is computed only where a target
    /// inside could be seen, and attention and prediction follow what is seen. The camera's motion is found from all of the
    /// picture. Detections inside are those of a detector without a region as far as nothing that is outside had a part in
    /// them. A region is no part of [`Detector::state`].
    ///
    /// # Errors
    /// A region of another size.
    pub fn look_in(&mut self, region: Option<&Region>) -> Result<(), RegionError> {
        if let Some(given) = region.map(Region::size).filter(|given| *given != self.size()) {
            return Err(RegionError::Size { given, expected: self.size() });
        }
        // A target is reported ahead of the peak of its response, or not at all.
        let behind = self.lag.abs().ceil() as usize + 1;
        self.model.look_in(region.map(|region| region.dilated(behind)).as_ref());
        self.region = region.cloned();
        Ok(())
    }

    /// Size of the frames it takes.
    pub fn size(&self) -> Size {
        self.luminance[0].size()
    }

    /// Its parameters.
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// Its number of threads.
    pub fn threads(&self) -> usize {
        self.workers.threads()
    }

    /// The instruction set it uses.
    pub fn simd(&self) -> SimdLevel {
        self.workers.simd()
    }

    /// The memory it holds: maps, states, memorizer, scratch. Outputs are the caller's; the stacks of its threads and some
    /// kilobytes of kernels are not counted.
    pub fn memory(&self) -> Memory {
        self.luminance.heap() + self.model.heap()
    }

    /// Frames that [`Detector::process_block`] computes together: [`Machine::together`], 8 at most, and no more than the
    /// horizon of the prediction.
    pub fn block_len(&self) -> usize {
        self.luminance.len()
    }

    /// Frames processed since construction or the last reset.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// How many frames after the onset of a matched target its facilitated response is complete: the peak of E plus
    /// the horizon of the prediction. Detections come earlier; none of a frame is ever delayed.
    pub fn latency(&self) -> usize {
        latency(&self.params)
    }

    /// How far detections are moved forward along their direction, px: with `localise = target` the distance by which
    /// the response peaks behind the target, else 0.
    pub fn lag(&self) -> f32 {
        self.lag
    }

    /// An output of the right size, to be used for every frame.
    pub fn make_response(&self) -> Response {
        Response::new(self.size(), self.params().detection.max_peaks as usize)
    }

    /// Takes the next frame and writes what it shows into `response`. Allocates nothing.
    ///
    /// # Errors
    /// A frame of another size, samples out of range. The detector's state is then as before the call.
    pub fn process_into<'a>(&mut self, frame: impl Into<Frame<'a>>, response: &mut Response) -> Result<(), FrameError> {
        self.advance(frame.into(), response, None)
    }

    /// As [`Detector::process_into`], adding up the time that each stage takes.
    ///
    /// # Errors
    /// As `process_into`.
    pub fn process_timed<'a>(
        &mut self,
        frame: impl Into<Frame<'a>>,
        response: &mut Response,
        timing: &mut Timing,
    ) -> Result<(), FrameError> {
        self.advance(frame.into(), response, Some(timing))
    }

    /// From now on it is given P and what is known of the background, which it shares with others.
    pub(crate) fn share(&mut self) {
        self.model.share();
    }

    /// The next frame of a detector that shares, on the threads of others: all that it remembers of places moves first.
    pub(crate) fn process_seen(
        &mut self,
        bands: &Bands,
        (scroll, found): (&Scroll<'_>, &Finding),
        response: &mut Response,
        timing: &mut Timing,
    ) {
        if !scroll.is_none() {
            self.model.scroll(scroll);
        }
        self.model.tell(found);
        self.model.block(bands, from_ref(scroll.p), from_mut(response), Some(timing));
        self.report(from_mut(response));
    }

    fn advance(
        &mut self,
        frame: Frame<'_>,
        response: &mut Response,
        timing: Option<&mut Timing>,
    ) -> Result<(), FrameError> {
        self.take(0, frame, response)?;
        self.compute(from_mut(response), timing);
        Ok(())
    }

    /// Takes frame `index` of the next block.
    fn take(&mut self, index: usize, frame: Frame<'_>, response: &Response) -> Result<(), FrameError> {
        if response.size() != self.size() || response.direction.dim() != response.map.dim() {
            return Err(FrameError::Output { given: response.size(), expected: self.size() });
        }
        frame.write_luminance(&mut self.luminance[index])
    }

    /// Computes the frames that were taken, one a response.
    fn compute(&mut self, responses: &mut [Response], timing: Option<&mut Timing>) {
        let Self { model, luminance, .. } = self;
        let (luminance, output) = (&luminance[..responses.len()], &mut *responses);
        self.workers.run(move |bands| model.block(bands, luminance, output, timing));
        self.report(responses);
    }

    /// Makes of peaks what is reported.
    fn report(&mut self, responses: &mut [Response]) {
        self.frames += responses.len() as u64;
        for response in responses {
            for found in &mut response.detections {
                found.move_ahead(self.lag);
                (found.speed, found.size) = self.tuning;
            }
            let least = self.params.detection.least_score as f32;
            let reported =
                |found: &Detection| self.region.as_ref().is_none_or(|region| region.contains(found.x, found.y));
            response.detections.retain(|found| found.score >= least && reported(found));
        }
    }

    /// Takes the next frames, one response each: the same numbers as frame by frame, to the bit. [`Detector::block_len`]
    /// frames at a time are computed together, stage by stage. Allocates nothing.
    ///
    /// # Errors
    /// As `process_into`, of the first frame that cannot be processed. Those before it have been: [`Detector::frames`]
    /// tells how many.
    ///
    /// # Panics
    /// When there are not as many responses as frames.
    pub fn process_block(&mut self, frames: &[Frame<'_>], responses: &mut [Response]) -> Result<(), FrameError> {
        self.advance_block(frames, responses, None)
    }

    /// As [`Detector::process_block`], adding up the time that each stage takes.
    ///
    /// # Errors
    /// As `process_block`.
    ///
    /// # Panics
    /// As `process_block`.
    pub fn process_block_timed(
        &mut self,
        frames: &[Frame<'_>],
        responses: &mut [Response],
        timing: &mut Timing,
    ) -> Result<(), FrameError> {
        self.advance_block(frames, responses, Some(timing))
    }

    fn advance_block(
        &mut self,
        frames: &[Frame<'_>],
        responses: &mut [Response],
        mut timing: Option<&mut Timing>,
    ) -> Result<(), FrameError> {
        assert_eq!(frames.len(), responses.len(), "one response a frame");
        let together = self.block_len();
        for (frames, responses) in frames.chunks(together).zip(responses.chunks_mut(together)) {
            let taken = frames.iter().zip(&*responses).enumerate();
            let refused = taken
                .map(|(index, (frame, response))| (index, self.take(index, *frame, response)))
                .find_map(|(index, taken)| taken.err().map(|error| (index, error)));
            let good = refused.as_ref().map_or(frames.len(), |(index, _)| *index);
            if good > 0 {
                self.compute(&mut responses[..good], timing.as_deref_mut());
            }
            if let Some((_, error)) = refused {
                return Err(error);
            }
        }
        Ok(())
    }

    /// As [`Detector::process_into`] into a fresh [`Response`].
    ///
    /// # Errors
    /// As `process_into`.
    pub fn process<'a>(&mut self, frame: impl Into<Frame<'a>>) -> Result<Response, FrameError> {
        let mut response = self.make_response();
        self.process_into(frame, &mut response)?;
        Ok(response)
    }

    /// The inner stages of the last frame.
    pub fn probe(&self) -> Probe<'_> {
        Probe::new(self.params.model, &*self.model, self.workers.simd())
    }

    /// All that it remembers of the frames so far. It stays as it is: one walk serves saving and restoring, hence `mut`.
    pub fn state(&mut self) -> State {
        State::of(self.origin(), self)
    }

    /// Takes up a state: it goes on to the bit as the detector that the state is of, which may have had other threads. The
    /// inner maps that [`Detector::probe`] shows are zero until the next frame.
    ///
    /// # Errors
    /// A state of another version, kind, frame size or of other parameters, or that holds what cannot be. The detector
    /// is then as before.
    pub fn restore(&mut self, state: &State) -> Result<(), StateError> {
        state.check(&self.origin(), self)?;
        self.reset();
        state.load(self);
        Ok(())
    }

    fn origin(&self) -> Origin {
        Origin::here(KIND, self.size(), self.params.to_toml())
    }

    /// Forgets everything seen: the next frame is a first frame.
    pub fn reset(&mut self) {
        self.frames = 0;
        self.model.reset();
    }
}

#[cfg(test)]
mod tests;
