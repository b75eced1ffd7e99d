//! run.json: what was run, on what, how fast, and what was found.

use std::collections::BTreeMap;
use std::path::Path;

use apgstmd_core::stimulus::Scene;
use apgstmd_core::{BankParams, EgoMotion, Params, Rectangle, Size};
use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

use crate::Outcome;
use crate::failure::Failure;
use crate::footage::Warning;
use crate::settings::LookIn;
use crate::sink::Seen;
use crate::sink::beside::Beside;

/// Raised when a field changes its meaning or goes away.
pub const SCHEMA_VERSION: u32 = 1;

/// Of so many frames that something happened to there is more than the number: a camera may run for months.
const MOST_LISTED: usize = 1000;

/// The whole record.
#[derive(Debug, Serialize)]
pub struct RunRecord<'a> {
    /// See [`SCHEMA_VERSION`].
    pub schema_version: u32,
    /// This program.
    pub program: &'static str,
    /// Its version.
    pub version: &'static str,
    /// `run` or `demo`.
    pub command: &'static str,
    /// What went in.
    pub input: Input<'a>,
    /// Size of the frames.
    pub size: SizeRecord,
    /// Threads that computed.
    pub threads: usize,
    /// Instruction set.
    pub simd: &'static str,
    /// Frames processed.
    pub frames: usize,
    /// Of these, frames that were there when the run was last resumed: times are of the others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resumed_after: Option<usize>,
    /// SHA-256 of what the results depend on besides the pictures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settings_sha256: Option<String>,
    /// What was dropped, and how late the rows are, where only the newest frames were computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub live: Option<Live>,
    /// Pictures left out, and why: the first thousand.
    pub skipped: &'a [Skipped],
    /// How many there are in all.
    pub frames_skipped: usize,
    /// The user ended it early.
    pub interrupted: bool,
    /// What ended it early.
    pub error: Option<String>,
    /// What was found.
    pub found: Found,
    /// How the background moved.
    pub background: &'a Background,
    /// Time spent.
    pub seconds_per_frame: Timing,
    /// Seconds a frame of each stage of the model; of a bank, of all its members together.
    pub stage_seconds_per_frame: BTreeMap<&'static str, f64>,
    /// What is wrong with the footage, and what to do.
    pub warnings: &'a [Warning],
    /// Wall time from the first picture to the last.
    pub seconds: f64,
    /// Processor time of the whole process and of the programs it started, so far; null where the system does not tell.
    pub processor_seconds: Option<f64>,
    /// Speed the parameters were scaled to by `--speed`, px/frame.
    pub speed: Option<f64>,
    /// Scores asked of detections by the end of the run, where the clip itself set them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold: Option<Threshold>,
    /// Where targets were looked for, if not everywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region: Option<RegionRecord>,
    /// The bank, where it was one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bank: Option<BankRecord>,
    /// All parameters, ready to be used again; of a bank those that its members have in common.
    pub params: &'a Params,
    /// What the demo's scene holds and how much of it was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub evaluation: Option<serde_json::Value>,
}

/// Scores that so many false alarms a frame have, as known at the end of the run: over its last 1000 frames.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Threshold {
    /// False alarms a frame, as asked for; null where none were left out.
    pub false_alarms: Option<f64>,
    /// How it was found.
    pub from: &'static str,
    /// Least score of a detection that is listed.
    pub least_score: f32,
    /// Least score of a detection that begins a track; null where the parameters say so, or there are no tracks.
    pub birth_score: Option<f32>,
}

/// Where targets were looked for.
#[derive(Debug, Serialize)]
pub struct RegionRecord {
    /// Rectangles, as `--roi` has them.
    pub roi: Vec<String>,
    /// File of the mask.
    pub mask: Option<String>,
    /// Share of the picture that is inside.
    pub share: f64,
}

impl RegionRecord {
    /// In frames of `size`.
    pub fn of(look_in: &LookIn, size: Size) -> Option<Self> {
        let roi = |Rectangle { x, y, width, height }: &Rectangle| format!("{width}x{height}+{x}+{y}");
        Some(Self {
            roi: look_in.rectangles.iter().map(roi).collect(),
            mask: look_in.mask.as_ref().map(|(path, _)| path.display().to_string()),
            share: look_in.region(size).ok()?.area() as f64 / size.area() as f64,
        })
    }
}

/// Detectors of several speeds and sizes.
#[derive(Debug, Serialize)]
pub struct BankRecord {
    /// Each one.
    pub members: Vec<MemberRecord>,
    /// Least equivalent contrast of a detection.
    pub contrast: f32,
}

/// One detector of a bank.
#[derive(Debug, Serialize)]
pub struct MemberRecord {
    /// Speed it is tuned to, px/frame.
    pub speed: f64,
    /// Size it is tuned to, px.
    pub size: f64,
}

impl BankRecord {
    /// What was asked for.
    pub fn of(bank: &BankParams) -> Self {
        let size = bank.base.target_size();
        let members = bank.members.iter();
        let members = members.map(|member| MemberRecord { speed: member.speed, size: size * member.scale as f64 });
        Self { members: members.collect(), contrast: bank.contrast }
    }
}

/// What went in.
#[derive(Debug, Serialize)]
pub struct Input<'a> {
    /// INPUT as given, but for a password.
    pub path: String,
    /// Pictures there, frames of the scene, or frames of a stream that came.
    pub pictures: usize,
    /// First used.
    pub start: usize,
    /// One past the last candidate.
    pub stop: usize,
    /// Distance between used ones.
    pub step: usize,
    /// Of these, frames that the model was not given: dropped live, or between those that --step in seconds chose. In
    /// the form of --dump-frames, the first thousand ranges.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub left_out: String,
    /// How many there are in all.
    pub frames_left_out: usize,
    /// Frames a second, where that was known beforehand.
    pub fps: Option<f64>,
    /// Declared bits of 16-bit samples.
    pub bit_depth: Option<u32>,
    /// The scene, where it was no pictures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<&'a Scene>,
}

/// Rows and columns.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SizeRecord {
    /// Rows.
    pub height: usize,
    /// Columns.
    pub width: usize,
}

impl From<Size> for SizeRecord {
    fn from(size: Size) -> Self {
        Self { height: size.height, width: size.width }
    }
}

/// What `--live` did.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Live {
    /// Frames that came while others were computed.
    pub dropped: usize,
    /// From when a frame was there to when its rows were written.
    pub delay: Delay,
}

/// Seconds, over frames.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Delay {
    /// Median.
    pub median: f64,
    /// Longest.
    pub most: f64,
}

/// The first of what may be very many, and the number of all.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct First<T> {
    listed: Vec<T>,
    count: usize,
}

impl<T> Default for First<T> {
    fn default() -> Self {
        Self { listed: Vec::new(), count: 0 }
    }
}

impl<T> First<T> {
    /// Takes note of one more, which stands for so many.
    pub fn add(&mut self, item: T, of: usize) {
        if self.listed.len() < MOST_LISTED {
            self.listed.push(item);
        }
        self.count += of;
    }

    /// The first ones.
    pub fn listed(&self) -> &[T] {
        &self.listed
    }

    /// How many there are in all.
    pub fn count(&self) -> usize {
        self.count
    }
}

/// A picture that was left out.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Skipped {
    /// Its number.
    pub frame: usize,
    /// Its name.
    pub name: String,
    /// Why.
    pub reason: String,
}

/// How the background moved from frame to frame, with the rejection `motion`.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Background {
    /// Frames before which the scene is cut: the first thousand.
    pub cuts: Vec<usize>,
    /// How many there are in all.
    pub cut_count: usize,
    /// Frames of which the picture does not tell how the camera moved: it is taken to stand still.
    pub unexplained: usize,
    /// Largest shift in the middle of the picture, px a frame.
    pub largest_shift: f32,
    /// Largest rotation either way, radians a frame.
    pub largest_rotation: f32,
    /// Largest zoom in or out, as a factor above 1 a frame less 1.
    pub largest_zoom: f32,
    /// Largest residual: 1.5 times the median absolute change that the motion leaves, luminance.
    pub largest_residual: f32,
}

impl Background {
    /// Takes note of a frame.
    pub fn add(&mut self, seen: &Seen) {
        let EgoMotion { rotation, zoom, residual, unexplained } = seen.ego_motion;
        let (x, y) = seen.background_shift;
        if seen.cut {
            self.cut_count += 1;
            if self.cuts.len() < MOST_LISTED {
                self.cuts.push(seen.frame);
            }
        }
        self.unexplained += usize::from(unexplained);
        self.largest_shift = self.largest_shift.max(x.hypot(y));
        self.largest_rotation = self.largest_rotation.max(rotation.abs());
        self.largest_zoom = self.largest_zoom.max(zoom.max(1.0 / zoom) - 1.0);
        self.largest_residual = self.largest_residual.max(residual);
    }
}

/// What was found.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Found {
    /// Detections in all frames.
    pub detections: usize,
    /// Different traces.
    pub traces: usize,
    /// Tracks; none where none were asked for.
    pub tracks: Option<usize>,
    /// Frames with at least one detection.
    pub frames_with_detections: usize,
}

/// Seconds a frame, by what was done.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Timing {
    /// Reading and decoding the picture.
    pub decode: Statistic,
    /// The model.
    pub compute: Statistic,
    /// Tables, pictures, inner maps.
    pub write: Statistic,
    /// All of it, one after the other.
    pub total: Statistic,
    /// What passed: wall time of the run over its frames. The three go on side by side.
    pub wall: f64,
    /// Which of the three the others waited for.
    pub limited_by: &'static str,
    /// How much of the wall time each was at work.
    pub busy: Busy,
}

/// Shares of the wall time; of `decode`, the mean over the threads that read.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Busy {
    /// Reading and decoding.
    pub decode: f64,
    /// The model.
    pub compute: f64,
    /// Tables, pictures, inner maps.
    pub write: f64,
}

impl Busy {
    /// Name of the busiest.
    pub fn largest(&self) -> &'static str {
        if self.compute >= self.decode.max(self.write) {
            "compute"
        } else if self.decode >= self.write {
            "decode"
        } else {
            "write"
        }
    }
}

/// Over frames.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Statistic {
    /// Arithmetic mean.
    pub mean: f64,
    /// Median.
    pub median: f64,
}

/// Times of the frames of a run, in memory that does not grow with their number: medians are right to a thousandth.
#[derive(Debug)]
pub struct Spread {
    nanoseconds: Histogram<u64>,
    sum: f64,
}

impl Default for Spread {
    fn default() -> Self {
        Self { nanoseconds: Histogram::new(3).expect("3 digits are allowed"), sum: 0.0 }
    }
}

impl Spread {
    /// Takes note of a frame.
    pub fn add(&mut self, seconds: f64) {
        self.nanoseconds.record((1e9 * seconds) as u64).expect("it grows as needed");
        self.sum += seconds;
    }

    /// Of all frames, seconds.
    pub fn sum(&self) -> f64 {
        self.sum
    }

    /// Mean and median; zero where there are no frames.
    pub fn statistic(&self) -> Statistic {
        let median = 1e-9 * self.nanoseconds.value_at_quantile(0.5) as f64;
        Statistic { mean: self.sum / self.nanoseconds.len().max(1) as f64, median }
    }

    /// Median and longest.
    pub fn delay(&self) -> Delay {
        Delay { median: self.statistic().median, most: 1e-9 * self.nanoseconds.max() as f64 }
    }
}

/// Processor time of this process and of the programs that it started and that have ended.
#[cfg(unix)]
pub fn processor_seconds() -> Option<f64> {
    use nix::sys::resource::{UsageWho, getrusage};
    use nix::sys::time::TimeValLike;
    let mut sum = 0.0;
    for who in [UsageWho::RUSAGE_SELF, UsageWho::RUSAGE_CHILDREN] {
        let usage = getrusage(who).ok()?;
        sum += 1e-6 * (usage.user_time() + usage.system_time()).num_microseconds() as f64;
    }
    Some(sum)
}

/// Not known here.
#[cfg(not(unix))]
pub fn processor_seconds() -> Option<f64> {
    None
}

impl RunRecord<'_> {
    /// Writes the record.
    ///
    /// # Errors
    /// Writing failed.
    pub fn write(&self, path: &Path) -> Outcome {
        let mut text = serde_json::to_string_pretty(self).map_err(|error| Failure::write(path, error))?;
        text.push('\n');
        Beside::new(path)?.write(&text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics() {
        let mut spread = Spread::default();
        assert_eq!((spread.statistic().mean, spread.statistic().median), (0.0, 0.0));
        (1..=1001).for_each(|i| spread.add(f64::from(i) * 1e-4));
        let Statistic { mean, median } = spread.statistic();
        assert!((mean - 0.0501).abs() < 1e-12 && (median / 0.0501 - 1.0).abs() < 1e-3, "{mean} {median}");
        assert!((spread.delay().most / 0.1001 - 1.0).abs() < 1e-3 && (spread.sum() - 50.1501).abs() < 1e-9);
    }

    #[test]
    fn the_busiest_limits() {
        for (decode, compute, write, name) in [
            (0.9, 0.5, 0.1, "decode"),
            (0.9, 0.95, 0.1, "compute"),
            (0.2, 0.3, 0.8, "write"),
            (0.0, 0.0, 0.0, "compute"),
        ] {
            assert_eq!(Busy { decode, compute, write }.largest(), name);
        }
    }
}
