//! Tracks: detections of the same target linked from frame to frame, with ids that stay, through crossings, misses and
//! occlusions.
//!
//! Each track is a constant-velocity Kalman filter relative to the background, whose motion (shift, rotation and zoom) the
//! detector reports; a cut of the scene ends all tracks. In each frame the tracks that are established choose among the detections first, then the new ones among the rest; each time
//! the matching with the greatest total likelihood is taken, among pairs within the gate. The likelihood knows the
//! distance, the direction of the detection and whether the detector linked it to the track's last one. A detection that is
//! weaker than the track's usual ones is trusted less about the place, in proportion. What is left begins tracks. A track without a detection coasts; while it does, the maximum of the response Q near where it is
//! expected, which is what prediction makes of a hidden target, guides it.
//!
//! **Points come when they are certain, and never change.** Those of a new track are reported, from its first detection
//! on, in the frame in which it has `birth_hits` detections within `birth_window` frames. Those of a track that coasts
//! are reported in the frame in which it is detected again; of a track that is not, the last point is its last
//! detection. [`Tracker::living`] tells where every track is at this very frame.
//!
//! ```
//! use apgstmd_core::{Detection, Params, Size, Tracker};
//! use apgstmd_core::tracking::Observation;
//!
//! let mut tracker = Tracker::new(Size::new(100, 100), &Params::default().for_speed(1.0)?)?;
//! let mut points = Vec::new();
//! for frame in 0..10 {
//!     let target = Detection { x: 20.0 + frame as f32, y: 50.0, score: 1.0, ..Detection::default() };
//!     tracker.process_into(&Observation::new(frame, &[target]), &mut points);
//! }
//! let last = points[0];
//! assert_eq!((last.track, last.frame, last.age), (0, 9, 9));
//! assert!((last.x - 29.0).abs() < 0.1 && (last.vx - 1.0).abs() < 0.1);
//! # Ok::<(), apgstmd_core::ParamError>(())
//! ```

mod association;
mod guide;
mod motion;
mod track;

use ndarray::ArrayView2;
use serde::{Deserialize, Serialize};

use crate::detection::{Detection, EgoMotion, Response};
use crate::error::ParamError;
use crate::frame::Size;
use crate::params::{Params, TrackingParams};
use crate::stage::background::Motion as Ego;
use crate::state::{Origin, Remember, State, StateError, Visit};
use association::Association;
use motion::{Motion, Noise};
use track::Track;

/// A track in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrackPoint {
    /// The frame as it was given.
    pub frame: usize,
    /// Its time as it was given, seconds.
    pub time: Option<f64>,
    /// Number of the track, counted from 0 in the order in which tracks were confirmed.
    pub track: u64,
    /// Column, px, pixel centres at integers: the filter's estimate.
    pub x: f64,
    /// Row, px, downward.
    pub y: f64,
    /// Velocity along x relative to the background, px/frame.
    pub vx: f64,
    /// Velocity along y relative to the background, px/frame, downward.
    pub vy: f64,
    /// Score of the detection; of a coasting track the response that guided it, 0 where none did.
    pub score: f32,
    /// Whether there was a detection.
    pub state: TrackState,
    /// Steps since its first detection.
    pub age: u32,
}

/// What a point of a track rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum TrackState {
    /// A detection.
    Confirmed,
    /// The track's own motion, and the response where it guided it.
    Coasting,
}

impl TrackState {
    /// Name in files and in Python.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Confirmed => "confirmed",
            Self::Coasting => "coasting",
        }
    }
}

/// What a detector saw in one frame.
#[derive(Clone, Copy, Debug)]
pub struct Observation<'a> {
    /// Number of the frame; points repeat it.
    pub frame: usize,
    /// Its time, seconds, where known; points repeat it.
    pub time: Option<f64>,
    /// Steps since the frame before: 1, and one more for each frame that was left out in between. Velocities are those of a
    /// step.
    pub steps: u32,
    /// The detections, in any order.
    pub detections: &'a [Detection],
    /// Shift of the background since the frame before, in all of these steps together, (x, y) px.
    pub background_shift: (f32, f32),
    /// Its rotation and zoom about the middle of the picture besides, in all of these steps together.
    pub ego_motion: EgoMotion,
    /// Whether the scene was cut before this frame: all tracks end, and ids go on.
    pub cut: bool,
    /// Whether the directions of the detections are relative to the background: [`Response::in_world`].
    pub in_world: bool,
    /// The response Q, (rows, columns), to guide tracks that coast.
    pub map: Option<ArrayView2<'a, f32>>,
    /// How far the response peaks behind a target, px: [`crate::Detector::lag`].
    pub lag: f32,
    /// Least score of a detection that begins a track, where that is more than the parameter `tracking.birth_score`.
    pub birth_score: f32,
}

impl<'a> Observation<'a> {
    /// Detections alone, before a still background.
    pub fn new(frame: usize, detections: &'a [Detection]) -> Self {
        Self {
            frame,
            time: None,
            steps: 1,
            detections,
            background_shift: (0.0, 0.0),
            ego_motion: EgoMotion::default(),
            cut: false,
            in_world: false,
            map: None,
            lag: 0.0,
            birth_score: 0.0,
        }
    }

    /// Everything that a detector with this [`crate::Detector::lag`] reports.
    pub fn of(frame: usize, response: &'a Response, lag: f32) -> Self {
        Self {
            background_shift: response.background_shift,
            ego_motion: response.ego_motion,
            cut: response.cut,
            in_world: response.in_world,
            map: Some(response.map.view()),
            lag,
            ..Self::new(frame, &response.detections)
        }
    }
}

/// Links detections to tracks, frame by frame. Times are counted in steps: one a frame, more where
/// [`Observation::steps`] says so. Frames that were left out bear no witness: they move a track on and let it coast, but
/// whether it is confirmed depends on the frames it was given.
///
/// The same frames give the same tracks to the bit. Once it has seen as many tracks as there ever are, it allocates only
/// where several tracks compete for several detections.
#[derive(Debug)]
pub struct Tracker {
    size: Size,
    params: TrackingParams,
    v_opt: f64,
    /// Share of the newest shift in `drift`.
    newest: f64,
    /// Mean shift of the background over the memory of the model, which its directions are of.
    drift: (f64, f64),
    noise: Noise,
    association: Association,
    /// The established ones before those that are not, each in the order of their birth.
    living: Vec<Track>,
    /// Ended tracks, kept for the memory of their points.
    spare: Vec<Track>,
    next_id: u64,
    births: u64,
}

/// Of its states.
const KIND: &str = "tracker";

impl Remember for Tracker {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        visit.part("drift", &mut self.drift)?;
        visit.part("next_id", &mut self.next_id)?;
        visit.part("births", &mut self.births)?;
        let sound = |living: &Vec<Track>| living.iter().all(Track::is_sound);
        if let Some(living) = visit.record("living", || self.living.clone(), sound)? {
            self.living = living;
        }
        Ok(())
    }
}

impl Tracker {
    /// For frames of `size`, with the parameters `tracking` and `prediction.v_opt`.
    ///
    /// # Errors
    /// Parameters out of range.
    pub fn new(size: Size, params: &Params) -> Result<Self, ParamError> {
        params.validate()?;
        let (tracking, v_opt) = (params.tracking.clone(), params.prediction.v_opt);
        Ok(Self {
            size,
            noise: Noise::new(&tracking, v_opt),
            association: Association::new(&tracking, v_opt),
            params: tracking,
            v_opt,
            newest: 1.0 / params.horizon().max(1) as f64,
            drift: (0.0, 0.0),
            living: Vec::new(),
            spare: Vec::new(),
            next_id: 0,
            births: 0,
        })
    }

    /// Takes the next frame and writes the points that became certain with it into `points`, track by track, each from
    /// the earliest to the latest.
    ///
    /// Detections whose place is not finite are left aside.
    pub fn process_into(&mut self, seen: &Observation<'_>, points: &mut Vec<TrackPoint>) {
        points.clear();
        let steps = seen.steps.max(1);
        if seen.cut {
            self.spare.append(&mut self.living);
            self.drift = (0.0, 0.0);
        }
        let ego = self.ego(seen);
        let a_step = |(x, y): (f64, f64)| (x / f64::from(steps), y / f64::from(steps));
        let shift = a_step(ego.shift);
        let moves = |track: &Track| a_step(ego.at(track.motion.place));
        let drifted = |drift: f64, shift: f64| drift + self.newest * (shift - drift);
        self.drift = (drifted(self.drift.0, shift.0), drifted(self.drift.1, shift.1));
        for track in &mut self.living {
            track.motion.predict(steps, &ego, &self.noise);
            track.age = track.age.saturating_add(steps);
            track.given = track.given.saturating_add(1);
        }
        let established = self.living.partition_point(|track| track.id.is_some());
        self.association.begin(seen.detections);
        let (first, second) = self.living.split_at(established);
        let passes = |track: &Track| if seen.in_world { (0.0, 0.0) } else { moves(track) };
        self.association.link(first, seen.detections, passes);
        self.association.link(second, seen.detections, passes);
        for (track, found) in self.living.iter_mut().zip(&self.association.found) {
            match found {
                Some(detection) => track.follow(&seen.detections[*detection], seen, &self.noise),
                None => track.coast(seen, moves(track), &self.noise, self.params.guide),
            }
        }
        self.end();
        self.give_birth(seen);
        self.confirm(points);
    }

    /// How the background moved since the last frame.
    fn ego(&self, seen: &Observation<'_>) -> Ego {
        let mut ego = Ego { shift: finite(seen.background_shift), ..Ego::still(self.size) };
        let (angle, zoom) = (f64::from(seen.ego_motion.rotation), f64::from(seen.ego_motion.zoom));
        if angle.is_finite() && zoom.is_finite() {
            (ego.stretch, ego.turn) = (zoom * angle.cos() - 1.0, -zoom * angle.sin());
        }
        ego
    }

    /// Ends what was not seen for too long, has left the picture, or can no longer be confirmed in its window.
    fn end(&mut self) {
        let mut kept = 0;
        for index in 0..self.living.len() {
            if self.living[index].lives(&self.params, self.size) {
                self.living.swap(kept, index);
                kept += 1;
            }
        }
        self.spare.extend(self.living.drain(kept..));
    }

    fn confirm(&mut self, points: &mut Vec<TrackPoint>) {
        for track in &mut self.living {
            if track.id.is_none() && track.hits >= self.params.birth_hits {
                track.id = Some(self.next_id);
                self.next_id += 1;
            }
            track.report(points);
        }
        self.living.sort_unstable_by_key(|track| (track.id.unwrap_or(u64::MAX), track.birth));
    }

    fn give_birth(&mut self, seen: &Observation<'_>) {
        let least = self.params.birth_score.max(seen.birth_score.into());
        let free = self.association.free();
        for detection in free.map(|index| &seen.detections[index]) {
            if f64::from(detection.score) < least {
                continue;
            }
            let mut track = self.spare.pop().unwrap_or_default();
            let velocity = match f64::from(detection.direction) {
                direction if direction.is_finite() => {
                    let drift = if seen.in_world { (0.0, 0.0) } else { self.drift };
                    (self.v_opt * direction.cos() - drift.0, -self.v_opt * direction.sin() - drift.1)
                }
                _ => (0.0, 0.0),
            };
            let motion = Motion::begin((f64::from(detection.x), f64::from(detection.y)), velocity, &self.noise);
            track.begin(self.births, motion, detection, seen);
            self.births += 1;
            self.living.push(track);
        }
    }

    /// Where every confirmed track is in the last frame, those that coast included, in the order of their ids.
    pub fn living(&self) -> impl Iterator<Item = TrackPoint> {
        self.living.iter().filter_map(Track::now)
    }

    /// All that it remembers of the frames so far: see [`crate::Detector::state`].
    pub fn state(&mut self) -> State {
        State::of(self.origin(), self)
    }

    /// Takes up a state: it goes on to the bit as the tracker that the state is of.
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
        let mut params = toml::Table::try_from(&self.params).expect("parameters are plain values");
        params.insert("v_opt".to_owned(), self.v_opt.into());
        params.insert("newest".to_owned(), self.newest.into());
        Origin::here(KIND, self.size, params.to_string())
    }

    /// Forgets everything seen: ids begin at 0 again.
    pub fn reset(&mut self) {
        self.spare.append(&mut self.living);
        (self.next_id, self.births, self.drift) = (0, 0, (0.0, 0.0));
    }
}

fn finite((x, y): (f32, f32)) -> (f64, f64) {
    if x.is_finite() && y.is_finite() { (x.into(), y.into()) } else { (0.0, 0.0) }
}

#[cfg(test)]
mod tests;
