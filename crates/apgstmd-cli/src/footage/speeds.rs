//! Whether targets move as fast as the detectors are tuned to.

use apgstmd_core::tracking::TrackState;
use serde::{Deserialize, Serialize};

use super::Warning;
use crate::sink::Seen;

/// Speeds that there are detectors for, px/frame.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Tuned {
    /// The slowest.
    pub slowest: f64,
    /// The fastest.
    pub fastest: f64,
}

/// Detections of a bank below this score are mostly clutter.
const CLUTTER: f32 = 0.01;
/// Detections and points of tracks that must have been seen.
const FEWEST: usize = 20;
/// Share of all scores that the detector at the end of the bank must have won.
const MAJORITY: f64 = 0.5;
/// A track this many times faster than the fastest detector, or slower than the slowest, is seen weakly.
const OFF: f64 = 1.7;
/// Bins an octave, and octaves from 2^-LOW on, of speeds of tracks.
const FINE: f64 = 16.0;
const LOW: f64 = 8.0;
const BINS: usize = 256;

#[derive(Serialize, Deserialize)]
pub(super) struct Speeds {
    tuned: Tuned,
    /// Scores of all, and of what the slowest and the fastest saw best.
    all: f64,
    slow: f64,
    fast: f64,
    count: usize,
    /// Scores of tracks by their speed.
    tracks: Vec<f64>,
    points: usize,
}

impl Speeds {
    pub fn new(tuned: Tuned) -> Self {
        Self { tuned, all: 0.0, slow: 0.0, fast: 0.0, count: 0, tracks: vec![0.0; BINS], points: 0 }
    }

    pub fn add(&mut self, seen: &Seen) {
        let Tuned { slowest, fastest } = self.tuned;
        let is = |speed: f32, tuned: f64| (f64::from(speed) - tuned).abs() < 1e-3 * tuned;
        for detection in seen.detections.iter().filter(|detection| detection.score >= CLUTTER) {
            let score = f64::from(detection.score);
            self.count += 1;
            self.all += score;
            self.slow += if is(detection.speed, slowest) { score } else { 0.0 };
            self.fast += if is(detection.speed, fastest) { score } else { 0.0 };
        }
        for point in seen.tracks.iter().filter(|point| point.state == TrackState::Confirmed) {
            let bin = FINE * (point.vx.hypot(point.vy).max(1e-9).log2() + LOW);
            self.tracks[(bin.max(0.0) as usize).min(BINS - 1)] += f64::from(point.score);
            self.points += 1;
        }
    }

    /// Speed of tracks, the median by score, px/frame.
    fn median(&self) -> Option<f64> {
        let total: f64 = self.tracks.iter().sum();
        let mut sum = 0.0;
        let bin = self.tracks.iter().position(|score| {
            sum += score;
            sum > 0.5 * total
        })?;
        (self.points >= FEWEST).then(|| ((bin as f64 + 0.5) / FINE - LOW).exp2())
    }

    pub fn warning(&self) -> Option<Warning> {
        const SLOWER: &str = "--step 2 makes everything twice as fast from one used frame to the next";
        let Tuned { slowest, fastest } = self.tuned;
        if slowest < fastest && self.count >= FEWEST {
            let share = |part: f64| 100.0 * part / self.all;
            if self.fast > MAJORITY * self.all {
                return Some(Warning::new(
                    "fast",
                    format!(
                        "{:.0} % of what was found is seen best by the fastest detector, {fastest} px/frame: targets may \
                         be faster",
                        share(self.fast)
                    ),
                    format!("add faster ones, as in --speeds {},{fastest},{}", 0.5 * fastest, 2.0 * fastest),
                ));
            }
            if self.slow > MAJORITY * self.all {
                return Some(Warning::new(
                    "slow",
                    format!(
                        "{:.0} % of what was found is seen best by the slowest detector, {slowest} px/frame: targets may \
                         be slower",
                        share(self.slow)
                    ),
                    SLOWER,
                ));
            }
        }
        let speed = self.median()?;
        let short = |speed: f64| if speed < 1.0 { format!("{speed:.2}") } else { format!("{speed:.1}") };
        let text = |tuned: f64| {
            format!("tracks move about {} px/frame, but detectors are tuned to {}", short(speed), short(tuned))
        };
        if speed > OFF * fastest {
            Some(Warning::new(
                "fast",
                text(fastest),
                format!("say so with --speed {}, or leave --speed out", short(speed)),
            ))
        } else if speed < slowest / OFF {
            Some(Warning::new("slow", text(slowest), format!("say so with --speed {}; {SLOWER}", short(speed))))
        } else {
            None
        }
    }
}
