//! A bank: detectors of several speeds and sizes on one stream, for targets of which neither is known.
//!
//! The members of a scale see the frame reduced by it, by area averaging, and share what the retina makes of it and the
//! background's motion: a member of 2 px/frame and 5 px at scale 2 sees
//! targets of 4 px/frame and 10 px. They look through a window that stays with the background ([`window`]), so that speeds and
//! directions are those in the world. Their detections are put onto the spot that moves with the response ([`spot`]), made
//! comparable as equivalent contrasts ([`member`]), and those of one target become one ([`merge`]), which counts less
//! where others were found before ([`clutter`]).
//!
//! State: that of the members, of the background, of the windows and of what was seen through them ([`ground`]), what the spots of their traces looked like so far, maps and
//! candidates that stand for several frames ([`exposure`]), and where something was found.

mod clutter;
mod exposure;
mod file;
mod ground;
mod member;
mod merge;
mod params;
mod pyramid;
mod spot;
mod window;

use crate::detection::Response;
use crate::detector::{ALWAYS_THERE, LEAST_SIDE, MOST_PIXELS};
use crate::error::{FrameError, ParamError};
use crate::frame::{Frame, Size};
use crate::memory::{Heap, Memory, ask_for};
use crate::model::lag;
use crate::region::{Region, RegionError};
use crate::row::bands::{Rows, Slice};
use crate::row::machine::{Machine, SimdLevel};
use crate::row::workers::Workers;
use crate::stage::background::{Background, Finding};
use crate::stage::readout;
use crate::state::{Angles, Origin, Remember, State, StateError, Visit};
use crate::timing::{Clock, Part, Timing};
use member::Running;
use merge::Merge;
use pyramid::Level;
use spot::Ideal;

pub use params::{BankParams, Member, SCALES};

/// Finds small moving targets of unknown speed and size.
///
/// Its members see the world at rest: the background's shift is taken out of the picture before them, and what they remember moves along.
/// Speeds and directions are relative to the background.
///
/// Scores are comparable between members, clips and settings, 0 to 1: the equivalent contrast, times
/// - straightness^2 x sqrt(points / 60) of the trace,
/// - sqrt(displacement / 20 px): what sways comes less far,
/// - s / (s + 20 c), of the score s so far and the clutter c at the place: the mean over the last 300 frames of the scores of other
///   numbers found there, each times a Gaussian of its distance (5 px),
/// - 0.3 for what lies within 30 px of something with more than twice its score, of which it may be an echo;
///
/// each of these 1 at most.
///
/// Everything is allocated by `new`; [`Bank::process_into`] allocates nothing. Members run beside each other, one thread
/// a member; the numbers do not depend on the number of threads.
///
/// ```
/// use apgstmd_core::{Bank, BankParams, Size};
/// use ndarray::Array2;
///
/// let mut bank = Bank::new(Size::new(64, 96), &BankParams::default())?;
/// let mut response = bank.make_response();
/// for t in 0..40 {
///     let frame = Array2::from_shape_fn((64, 96), |(y, x)| {
///         if x.abs_diff(10 + t) < 3 && y.abs_diff(32) < 3 { 0 } else { 255u8 }
///     });
///     bank.process_into(frame.view(), &mut response)?;
/// }
/// let target = response.detections[0];
/// assert!((target.x - 49.0).abs() < 1.0 && (target.y - 32.0).abs() < 1.0);
/// assert!(target.score > 0.5 && target.score <= 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Bank {
    params: BankParams,
    frames: u64,
    /// Where targets are reported, if not anywhere.
    region: Option<Region>,
    levels: Vec<Level>,
    /// The background of the finest level that is looked at, which is the most exact.
    background: Background,
    finest: usize,
    members: Vec<Running>,
    /// What the members saw.
    seen: Vec<Response>,
    merge: Merge,
    /// Of the last frame, what the members share.
    timing: Timing,
    workers: Workers,
}

/// Shifts of the background that are noise, or so slow that the filters do not answer, px/frame.
const STILL: f64 = 0.03;

/// Of its states.
const KIND: &str = "bank";

impl Remember for Bank {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        visit.part("processed", &mut self.frames)?;
        visit.part("merge", &mut self.merge)?;
        visit.part("background", &mut self.background)?;
        for level in &mut self.levels {
            visit.part(&format!("window{}", level.scale), &mut level.window)?;
            for (index, ground) in level.grounds.iter_mut().enumerate() {
                visit.part(&format!("ground{}.{index}", level.scale), ground)?;
            }
        }
        for (index, (running, seen)) in self.members.iter_mut().zip(&mut self.seen).enumerate() {
            visit.part(&index.to_string(), running)?;
            if running.holds() {
                visit.part(&format!("held{index}.map"), &mut seen.map)?;
                visit.part(&format!("held{index}.direction"), &mut Angles(&mut seen.direction))?;
            }
        }
        Ok(())
    }
}

/// Of the members of a scale, in px/frame of its own.
fn speeds(members: &[Member], scale: usize) -> impl Iterator<Item = f64> {
    members.iter().filter(move |member| member.scale == scale).map(Member::own_speed)
}

impl Bank {
    /// A bank for frames of `size`, using as many threads as the machine has cores.
    ///
    /// # Errors
    /// Parameters out of range, frames below 16 x 16, more memory than the system gives.
    pub fn new(size: Size, params: &BankParams) -> Result<Self, ParamError> {
        Self::with_options(size, params, &Machine::default())
    }

    /// As [`Bank::new`] with a choice of threads and instruction set.
    ///
    /// Members of scales that `size` is too small for are left out, all but those of scale 1.
    ///
    /// # Errors
    /// As `new`; also when the threads cannot be started.
    pub fn with_options(size: Size, params: &BankParams, machine: &Machine) -> Result<Self, ParamError> {
        params.validate()?;
        if size.height.checked_mul(size.width).is_none_or(|area| area > MOST_PIXELS) {
            return Err(ParamError::TooLarge { size, most: MOST_PIXELS });
        }
        let fits = |scale: usize| size.height / scale >= LEAST_SIDE && size.width / scale >= LEAST_SIDE;
        let used: Vec<Member> = params.members.iter().copied().filter(|member| fits(member.scale)).collect();
        let Some(largest) = used.iter().map(|member| member.scale).max() else {
            let least = LEAST_SIDE * params.members.iter().map(|member| member.scale).min().unwrap_or(1);
            return Err(ParamError::TooSmall { size, least });
        };
        // Frames come one by one.
        let machine = &Machine { together: 1, ..*machine };
        let workers = Workers::new(machine)?;
        if size.area() > ALWAYS_THERE {
            ask_for(size, Self::needs(size, params, &used, machine)?)?;
        }
        let levels = SCALES.iter().filter(|scale| **scale <= largest);
        let levels: Vec<Level> = levels
            .map(|scale| Level::new(size, *scale, &params.base, machine.threads, speeds(&used, *scale)))
            .collect();
        let finest = used.iter().map(|member| member.scale).min().unwrap_or(1);
        let finest = levels.iter().position(|level| level.scale == finest).expect("every scale has its level");
        let background = Background::new(levels[finest].luminance.size(), &params.base, 1);
        let ideal = Ideal::new(&params.base.retina);
        let mut members: Vec<Running> = Vec::with_capacity(used.len());
        for member in used {
            let alike = members.iter().find(|other| other.own_speed() == member.own_speed()).map(Running::calibration);
            members.push(Running::new(member, size, params, machine, ideal, alike)?);
        }
        let seen = members.iter().map(Running::make_response).collect();
        let candidates = members.len() * params.base.detection.max_peaks as usize;
        let merge = Merge::new(candidates, params.most);
        Ok(Self {
            params: params.clone(),
            frames: 0,
            region: None,
            levels,
            background,
            finest,
            members,
            seen,
            merge,
            timing: Timing::default(),
            workers,
        })
    }

    /// What it will hold with the members that are `used`, about.
    fn needs(size: Size, params: &BankParams, used: &[Member], machine: &Machine) -> Result<Memory, ParamError> {
        let of_members = used.iter().map(|member| Running::needs(member, size, params, machine));
        let scales = SCALES.iter().filter(|scale| used.iter().any(|member| member.scale >= **scale));
        let of_levels = scales.map(|scale| Ok(Level::needs(size, *scale, speeds(used, *scale))));
        of_members.chain(of_levels).try_fold(Memory::default(), |all, one| Ok(all + one?))
    }

    /// Looks for targets in a region only: see [`crate::Detector::look_in`]. A reduced pixel is inside where any of its pixels is.
    ///
    /// # Errors
    /// A region of another size.
    pub fn look_in(&mut self, region: Option<&Region>) -> Result<(), RegionError> {
        if let Some(given) = region.map(Region::size).filter(|given| *given != self.size()) {
            return Err(RegionError::Size { given, expected: self.size() });
        }
        self.members.iter_mut().try_for_each(|running| running.look_in(region))?;
        self.region = region.cloned();
        Ok(())
    }

    /// Size of the frames it takes.
    pub fn size(&self) -> Size {
        self.levels[0].luminance.size()
    }

    /// Its parameters.
    pub fn params(&self) -> &BankParams {
        &self.params
    }

    /// Its members: those of the parameters that the frames are large enough for.
    pub fn members(&self) -> impl Iterator<Item = Member> {
        self.members.iter().map(|running| running.member)
    }

    /// Its number of threads.
    pub fn threads(&self) -> usize {
        self.workers.threads()
    }

    /// The instruction set it uses.
    pub fn simd(&self) -> SimdLevel {
        self.workers.simd()
    }

    /// The memory it holds, as [`crate::Detector::memory`] counts it, with the maps of its members.
    pub fn memory(&self) -> Memory {
        self.levels.heap() + self.background.heap() + self.members.heap() + self.seen.heap() + self.merge.heap()
    }

    /// Frames processed since construction or the last reset.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// The longest latency of a member, frames: see [`crate::Detector::latency`].
    pub fn latency(&self) -> usize {
        self.members.iter().map(Running::latency).max().unwrap_or(0)
    }

    /// How far the response peaks behind a dark target at the speed and size of a member, px: the mean over its members.
    pub fn lag(&self) -> f32 {
        self.members.iter().map(|running| running.lag() * running.member.scale as f32).sum::<f32>()
            / self.members.len() as f32
    }

    /// An output of the right size, to be used for every frame.
    pub fn make_response(&self) -> Response {
        Response::new(self.size(), self.params.most)
    }

    /// Takes the next frame and writes what it shows into `response`. Allocates nothing.
    ///
    /// The map holds equivalent contrasts, the largest over the members, each of the last frame that it looked at
    /// ([`Member::exposure`]); scores are described at
    /// [`crate::Detection::score`].
    ///
    /// # Errors
    /// A frame of another size, samples out of range. The bank's state is then as before the call.
    pub fn process_into<'a>(&mut self, frame: impl Into<Frame<'a>>, response: &mut Response) -> Result<(), FrameError> {
        if response.size() != self.size() || response.direction.dim() != response.map.dim() {
            return Err(FrameError::Output { given: response.size(), expected: self.size() });
        }
        frame.into().write_luminance(&mut self.levels[0].luminance)?;
        let Self { levels, background, finest, members, seen, workers, merge, timing, .. } = self;
        let output = &mut *response;
        *timing = Timing::default();
        let frame = self.frames;
        let mut clock = Clock::start(Some(timing));
        workers.run(|bands| {
            for index in 0..levels.len() {
                let (finer, level) = levels.split_at_mut(index);
                level[0].process(bands, finer.last());
            }
            clock.lap(Part::Retina);
            let Level { p, scale, .. } = &levels[*finest];
            background.look(bands.level(), p, 0);
            background.follow(bands.level(), p, 0);
            let (found, scale) = (*background.found(0), *scale as f64);
            let still = found.motion.shift.0.hypot(found.motion.shift.1) < STILL;
            for level in &mut *levels {
                let found = Finding { motion: found.motion.enlarged(scale / level.scale as f64), ..found };
                level.follow(bands, &found, still);
            }
            clock.lap(Part::Rejection);
            let levels = &*levels;
            bands.each((Slice(&mut *members), Slice(&mut *seen)), |(members, seen)| {
                for (running, seen) in members.0.iter_mut().zip(seen.0.iter_mut()) {
                    running.take(frame, of(running, levels), seen);
                }
            });
            let due = members.iter().filter(|running| running.due).count();
            let first = members.iter_mut().zip(&mut *seen).filter(|(running, _)| running.due);
            for (running, seen) in first.take(before_others(due, bands.threads())) {
                running.process(bands, of(running, levels), seen);
            }
            bands.each((Slice(&mut *members), Slice(&mut *seen)), |(members, seen)| {
                let rest = members.0.iter_mut().zip(seen.0.iter_mut()).filter(|(running, _)| running.due);
                rest.for_each(|(running, seen)| running.process(&bands.alone(), of(running, levels), seen));
            });
            let (members, seen) = (&*members, &*seen);
            let Size { height, width } = levels[0].luminance.size();
            let maps = [&mut output.map, &mut output.direction].map(|map| Rows {
                data: map.as_slice_mut().expect("make_response makes contiguous maps"),
                stride: width,
            });
            bands.over(height, maps, |range, [mut map, mut direction]| {
                for (row, y) in range.enumerate() {
                    member::map_row(members, seen, y, map.row(row), direction.row(row));
                }
            });
        });
        if let Some(region) = &self.region {
            members.iter_mut().for_each(|running| running.report_in(region));
        }
        let found = &levels[0].found;
        merge.process(members, self.params.contrast, found, &mut response.detections);
        let least = self.params.base.detection.least_score as f32;
        response.detections.retain(|found| found.score >= least);
        readout::tell(found, response);
        response.in_world = true;
        self.frames += 1;
        Ok(())
    }

    /// As [`Bank::process_into`], adding up the time that each stage takes in all of its members.
    ///
    /// # Errors
    /// As `process_into`.
    pub fn process_timed<'a>(
        &mut self,
        frame: impl Into<Frame<'a>>,
        response: &mut Response,
        timing: &mut Timing,
    ) -> Result<(), FrameError> {
        self.process_into(frame, response)?;
        *timing += &self.timing;
        self.members.iter().for_each(|running| *timing += &running.timing);
        Ok(())
    }

    /// As [`Bank::process_into`] into a fresh [`Response`].
    ///
    /// # Errors
    /// As `process_into`.
    pub fn process<'a>(&mut self, frame: impl Into<Frame<'a>>) -> Result<Response, FrameError> {
        let mut response = self.make_response();
        self.process_into(frame, &mut response)?;
        Ok(response)
    }

    /// All that it remembers of the frames so far: see [`crate::Detector::state`].
    pub fn state(&mut self) -> State {
        State::of(self.origin(), self)
    }

    /// Takes up a state: it goes on to the bit as the bank that the state is of.
    ///
    /// # Errors
    /// As [`crate::Detector::restore`].
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
        self.background.reset();
        self.levels.iter_mut().for_each(Level::reset);
        self.members.iter_mut().zip(&mut self.seen).for_each(|(running, seen)| running.reset(seen));
        self.merge.reset();
    }
}

/// What a member sees.
fn of<'a>(running: &Running, levels: &'a [Level]) -> &'a Level {
    let level = levels.iter().find(|level| level.scale == running.member.scale);
    level.expect("every scale up to the largest has its level")
}

/// How many of `due` members are processed one after the other by all threads before each of the others has a thread of its own:
/// those that would leave threads idle, where they are so few that this takes less time, a member on n threads being taken for
/// sqrt(n) times as fast as on one (1.6 times on two).
fn before_others(due: usize, threads: usize) -> usize {
    let left = due % threads;
    if left * left <= threads { left } else { 0 }
}

/// Speed that parameters are tuned to, px/frame.
fn tuned(params: &crate::params::Params) -> f64 {
    lag::tuned_speed(params)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn what_is_asked_for_is_what_is_held() {
        let banks =
            [(&[1.0][..], (270, 480)), (&[0.06, 0.25, 2.0], (270, 480)), (&[8.0], (1080, 1920)), (&[], (540, 960))];
        for (speeds, (height, width)) in banks {
            let speeds = Some(speeds).filter(|speeds| !speeds.is_empty());
            let params = BankParams::choose(BankParams::default().base, speeds, None);
            let (size, machine) = (Size::new(height, width), Machine { together: 1, ..Machine::with_threads(2) });
            let needs = Bank::needs(size, &params, &params.members, &machine).unwrap();
            let held = Bank::with_options(size, &params, &machine).unwrap().memory();
            for (needs, held) in [(needs.bound, held.bound), (needs.resident, held.resident)] {
                // Tiles are counted whole.
                let times = needs as f64 / held as f64;
                assert!(times > 0.99 && times < 1.05, "{speeds:?}, {size}: {needs} {held}");
            }
        }
    }
}
