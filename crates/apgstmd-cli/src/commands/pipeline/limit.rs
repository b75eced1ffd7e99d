//! Which detections are listed and which may begin tracks: scores that so many false alarms a frame have, found from the
//! clip while it passes.

use apgstmd_core::{Detection, FalseAlarms, State, StateError};

use super::engine::BIRTH_SCORE;
use crate::sink::run_json::Threshold;

/// A track may begin with a detection that so many false alarms a frame reach.
const BIRTHS: f64 = 0.005;
/// Frames from one look at the scores to the next, and as long as there are few.
const EVERY: u64 = 10;
const EVERY_EARLY: u64 = 3;
const EARLY: u64 = 60;

pub(super) struct Limit {
    alarms: FalseAlarms,
    /// False alarms a frame that are listed; all of them without it.
    rate: Option<f64>,
    /// Whether tracks follow the clip, too.
    births: bool,
    least: f32,
    birth: f32,
    least_birth: f32,
}

impl Limit {
    pub fn new(rate: Option<f64>, births: bool, bank: bool) -> Self {
        let least_birth = if births && bank { BIRTH_SCORE as f32 } else { 0.0 };
        Self { alarms: FalseAlarms::new(), rate, births, least: 0.0, birth: 0.0, least_birth }
    }

    /// Takes what was found in the next frame.
    pub fn add(&mut self, found: &[Detection]) {
        self.alarms.add(found);
        let frames = self.alarms.frames();
        let every = if frames < EARLY { EVERY_EARLY } else { EVERY };
        if frames == FalseAlarms::FIRST || frames > FalseAlarms::FIRST && frames.is_multiple_of(every) {
            self.look();
        }
    }

    /// Sets the thresholds by what has been seen up to now.
    pub fn look(&mut self) {
        self.least = self.rate.map_or(0.0, |rate| self.alarms.least_score(rate));
        self.birth = if self.births { self.alarms.least_score(BIRTHS) } else { 0.0 };
    }

    /// The state of the alarms, and the thresholds in force.
    pub fn state(&mut self) -> (State, (f32, f32)) {
        (self.alarms.state(), (self.least, self.birth))
    }

    /// Takes up what `state` gave.
    pub fn restore(&mut self, alarms: &State, (least, birth): (f32, f32)) -> Result<(), StateError> {
        self.alarms.restore(alarms)?;
        (self.least, self.birth) = (least, birth);
        Ok(())
    }

    /// Whether there was enough to go by.
    pub fn holds(&self) -> bool {
        self.alarms.frames() >= FalseAlarms::FIRST
    }

    /// For run.json.
    pub fn record(&self) -> Option<Threshold> {
        self.holds().then(|| Threshold {
            false_alarms: self.rate,
            from: "the clip itself",
            least_score: self.least_score(),
            birth_score: self.births.then(|| self.birth_score()),
        })
    }

    /// Least score of a detection that is listed.
    pub fn least_score(&self) -> f32 {
        self.least
    }

    /// Least score of a detection that begins a track.
    pub fn birth_score(&self) -> f32 {
        self.birth.max(self.least).max(self.least_birth)
    }
}
