//! One track: its motion, what it has shown so far, and the points that are not certain yet.

use serde::{Deserialize, Serialize};

use super::guide::response_near;
use super::motion::{Motion, Noise};
use super::{Observation, TrackPoint, TrackState};
use crate::detection::Detection;
use crate::frame::Size;
use crate::params::TrackingParams;

/// Share of the newest score in a track's usual one.
const NEWEST: f64 = 0.1;
/// However weak a detection is, the variance of its place grows by no more than this.
const MOST_DOUBT: f64 = 1e3;

/// Beyond the border by more than this, px, a track has left the picture.
const OUTSIDE: f64 = 8.0;

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Track {
    /// From its confirmation on.
    pub id: Option<u64>,
    /// Which one it was to begin.
    pub birth: u64,
    pub motion: Motion,
    /// Steps since its first detection.
    pub age: u32,
    /// Frames since then, that one included.
    pub given: u32,
    /// Detections so far.
    pub hits: u32,
    /// Steps that led to one.
    followed: u32,
    /// Steps since the last one.
    pub missed: u32,
    /// Running mean of its detections' scores.
    usual: f64,
    /// Trace of its last detection.
    pub trace: u64,
    /// Points that wait for its confirmation, or for it to be seen again.
    waiting: Vec<TrackPoint>,
    /// Its point in the last frame.
    latest: Option<TrackPoint>,
}

impl Track {
    pub fn is_sound(&self) -> bool {
        self.motion.is_sound() && self.usual.is_finite()
    }

    pub fn begin(&mut self, birth: u64, motion: Motion, detection: &Detection, seen: &Observation<'_>) {
        (self.id, self.birth) = (None, birth);
        self.motion = motion;
        (self.age, self.given, self.hits, self.followed) = (0, 1, 1, 1);
        (self.missed, self.trace) = (0, detection.trace);
        self.usual = f64::from(detection.score);
        self.waiting.clear();
        self.wait(seen, detection.score, TrackState::Confirmed);
    }

    pub fn follow(&mut self, detection: &Detection, seen: &Observation<'_>, noise: &Noise) {
        // What has just vanished leaves an echo that fades where it was: the weaker, the less it tells.
        let score = f64::from(detection.score);
        let doubt = if score > 0.0 { (self.usual / score).clamp(1.0, MOST_DOUBT) } else { MOST_DOUBT };
        self.motion.update((f64::from(detection.x), f64::from(detection.y)), doubt * noise.detection);
        if score.is_finite() {
            self.usual += NEWEST * (score - self.usual);
        }
        self.hits = self.hits.saturating_add(1);
        self.followed = self.followed.saturating_add(seen.steps.max(1));
        (self.missed, self.trace) = (0, detection.trace);
        self.wait(seen, detection.score, TrackState::Confirmed);
    }

    pub fn coast(&mut self, seen: &Observation<'_>, shift: (f64, f64), noise: &Noise, guided: bool) {
        self.missed = self.missed.saturating_add(seen.steps.max(1));
        let response = if guided { response_near(&self.motion, shift, seen) } else { None };
        if let Some((place, _)) = response {
            self.motion.update(place, noise.guide);
        }
        self.wait(seen, response.map_or(0.0, |(_, value)| value), TrackState::Coasting);
    }

    fn wait(&mut self, seen: &Observation<'_>, score: f32, state: TrackState) {
        let Motion { place: (x, y), velocity: (vx, vy), .. } = self.motion;
        let (frame, time, age) = (seen.frame, seen.time, self.age);
        // The id is known when it is reported.
        let point = TrackPoint { frame, time, track: 0, x, y, vx, vy, score, state, age };
        self.latest = Some(point);
        self.waiting.push(point);
    }

    pub fn lives(&self, params: &TrackingParams, size: Size) -> bool {
        let (x, y) = self.motion.place;
        let within = |value: f64, side: usize| value >= -OUTSIDE && value <= side as f64 - 1.0 + OUTSIDE;
        if self.missed > 0 && !(within(x, size.width) && within(y, size.height)) {
            return false;
        }
        match self.id {
            Some(_) => self.missed <= params.coast.min(self.followed),
            // Frames of its window that are still to come may all bring detections.
            None => self.hits.saturating_add(params.birth_window.saturating_sub(self.given)) >= params.birth_hits,
        }
    }

    /// Its point in the last frame, once it is confirmed.
    pub fn now(&self) -> Option<TrackPoint> {
        Some(TrackPoint { track: self.id?, ..self.latest? })
    }

    /// Hands over what has become certain.
    pub fn report(&mut self, points: &mut Vec<TrackPoint>) {
        if let (Some(track), 0) = (self.id, self.missed) {
            points.extend(self.waiting.drain(..).map(|point| TrackPoint { track, ..point }));
        }
    }
}
