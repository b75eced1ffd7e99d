//! Which frames are judged: those that the detector saw, as far as anything tells.

use std::collections::HashSet;
use std::fs;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

use apgstmd_core::evaluation::{Options, Scored, TruthBox};
use serde::Deserialize;

use crate::Outcome;
use crate::failure::{Failure, reason};
use crate::settings::parse_range;
use crate::sink::results::{CAMERA, RUN};

/// Most frames that are taken one by one: 1 GiB of them.
const MOST_LISTED: usize = 1 << 27;

/// What told how many frames there were.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// This run.json.
    Run(PathBuf),
    /// The caller.
    Given,
    /// Nothing: they reach to the last frame that is named.
    Named,
}

/// Frames that are judged, in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frames {
    /// Frames start, start + step, ... below stop, but for those skipped.
    start: usize,
    stop: usize,
    step: usize,
    skipped: Vec<usize>,
    origin: Origin,
}

impl Frames {
    /// The frames that `run`, or else `given`, or else the lists themselves tell of; of them those from `start` up to
    /// `stop`.
    ///
    /// # Errors
    /// No frame is left; `run` and `given` contradict each other.
    pub fn resolve(
        run: Option<&RunFrames>,
        given: Option<usize>,
        (start, stop): (usize, Option<usize>),
        found: &[Scored],
        truth: &[TruthBox],
    ) -> Outcome<Self> {
        if let Some(stop) = stop.filter(|stop| *stop <= start) {
            return Err(Failure::usage(format_args!("--stop {stop} is not above --start {start}")));
        }
        let whole = |stop, origin| Self { start: 0, stop, step: 1, skipped: Vec::new(), origin };
        let mut frames = match (run, given) {
            (Some(run), given) => {
                run.agrees_with(given)?;
                run.frames.clone()
            }
            (None, Some(0)) => return Err(Failure::usage("--frames is 0, but it must be at least 1")),
            (None, Some(count)) => whole(count, Origin::Given),
            (None, None) => match stop {
                Some(stop) => whole(stop, Origin::Given),
                None => whole(Options::spanning(found, truth).frames.end, Origin::Named),
            },
        };
        let (first, end) = (frames.start, frames.stop);
        if start > first {
            frames.start = first + (start - first).div_ceil(frames.step) * frames.step;
        }
        frames.stop = stop.map_or(end, |stop| stop.min(end));
        frames.skipped.retain(|frame| (frames.start..frames.stop).contains(frame));
        if frames.start >= frames.stop || frames.count() == 0 {
            return Err(Failure::usage(match (end > first, &frames.origin) {
                (false, Origin::Named) => "neither the detections nor the truth name a frame: say how many there were \
                                           with --frames"
                    .to_owned(),
                _ => format!(
                    "there is no frame to judge from --start {start} on: there are frames {first} to {}",
                    end - 1
                ),
            }));
        }
        Ok(frames)
    }

    /// The first one.
    pub fn first(&self) -> usize {
        self.start
    }

    /// The last one.
    pub fn last(&self) -> usize {
        self.start + (self.stop - 1 - self.start) / self.step * self.step
    }

    /// How many.
    pub fn count(&self) -> usize {
        self.stop.saturating_sub(self.start).div_ceil(self.step) - self.skipped.len()
    }

    /// Who told.
    pub fn origin(&self) -> &Origin {
        &self.origin
    }

    /// Whether some frames between the first and the last are left out.
    pub fn has_gaps(&self) -> bool {
        self.step > 1 || !self.skipped.is_empty()
    }

    /// Number of a frame among those that are judged.
    pub fn rank(&self, frame: usize) -> Option<usize> {
        let inside = (self.start..self.stop).contains(&frame) && (frame - self.start).is_multiple_of(self.step);
        match (inside, self.skipped.binary_search(&frame)) {
            (true, Err(before)) => Some((frame - self.start) / self.step - before),
            _ => None,
        }
    }
}

/// The frames that a run processed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunFrames {
    frames: Frames,
    /// Frames of its input, used or not.
    available: usize,
    /// Whether it ended before its last frame.
    pub ended_early: bool,
}

#[derive(Deserialize)]
struct Record {
    frames: usize,
    skipped: Vec<Skipped>,
    /// As many as are listed, where it is not said.
    frames_skipped: Option<usize>,
    interrupted: bool,
    error: Option<String>,
    input: Input,
}

#[derive(Deserialize)]
struct Skipped {
    frame: usize,
}

#[derive(Deserialize)]
struct Input {
    pictures: usize,
    start: usize,
    stop: usize,
    step: usize,
    /// Dropped live, or passed over by time.
    #[serde(default)]
    left_out: String,
    /// As many as are listed, where it is not said.
    frames_left_out: Option<usize>,
}

impl RunFrames {
    /// From run.json in the folder of `file`; none where there is no such file, or it is another program's.
    ///
    /// # Errors
    /// It is ours and cannot be used.
    pub fn beside(file: &Path) -> Outcome<Option<Self>> {
        let path = file.parent().unwrap_or(Path::new("")).join(RUN);
        match fs::read_to_string(&path) {
            Ok(text) => Self::parse(&text, &path),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(unusable(&path, &reason(&error))),
        }
    }

    /// From the text of run.json; `path` names it.
    ///
    /// # Errors
    /// As [`RunFrames::beside`].
    pub fn parse(text: &str, path: &Path) -> Outcome<Option<Self>> {
        let failed = |what: &str| unusable(path, what);
        let value: serde_json::Value = serde_json::from_str(text).map_err(|error| failed(&error.to_string()))?;
        if value["program"] != "apgstmd" {
            return Ok(None);
        }
        let record: Record = serde_json::from_value(value).map_err(|error| failed(&error.to_string()))?;
        let Input { pictures, start, stop, step, left_out, frames_left_out } = record.input;
        let frames_skipped = record.frames_skipped.unwrap_or(record.skipped.len());
        let seen = record.frames.saturating_add(frames_skipped);
        if step == 0 || start >= stop || seen == 0 {
            return Err(failed("it holds no frames"));
        }
        let mut left_out = ranges(&left_out, start..stop).ok_or_else(|| failed("left_out names no frames of it"))?;
        left_out.retain(|frame| (frame - start).is_multiple_of(step));
        let frames_left_out = frames_left_out.unwrap_or(left_out.len());
        let taken = seen.saturating_add(frames_left_out);
        // A run that ended early used the first so many.
        let stop = stop.min(start.saturating_add((taken - 1).saturating_mul(step)).saturating_add(1));
        let all_listed = frames_skipped == record.skipped.len() && frames_left_out == left_out.len();
        let mut skipped = match all_listed {
            true => record.skipped.into_iter().map(|skipped| skipped.frame).chain(left_out).collect(),
            false if path.is_file() => others(&path.with_file_name(CAMERA), start..stop, step)?,
            false => return Err(failed("it lists the first of the frames that were left out, but not all")),
        };
        skipped.sort_unstable();
        let frames = Frames { start, stop, step, skipped, origin: Origin::Run(path.to_owned()) };
        Ok(Some(Self { frames, available: pictures, ended_early: record.interrupted || record.error.is_some() }))
    }

    fn agrees_with(&self, given: Option<usize>) -> Outcome {
        match (given, &self.frames.origin) {
            (Some(given), Origin::Run(path)) if given != self.available && given != self.frames.count() => {
                Err(Failure::usage(format_args!(
                    "--frames is {given}, but {} says {}: leave it out, or judge a part with --start and --stop",
                    path.display(),
                    self.available
                )))
            }
            _ => Ok(()),
        }
    }
}

/// Of these frames, those that have no row in camera.csv, which has one for each that was processed.
fn others(camera: &Path, range: Range<usize>, step: usize) -> Outcome<Vec<usize>> {
    let failed = |what: &str| unusable(camera, what);
    if range.len() / step > MOST_LISTED {
        return Err(failed("it would have more rows than can be read"));
    }
    let text = fs::read_to_string(camera).map_err(|error| failed(&reason(&error)))?;
    // A run that was killed may leave a part of a row.
    let rows = text.split_inclusive('\n').skip(1).filter(|row| row.ends_with('\n'));
    let processed: Option<HashSet<usize>> = rows.map(|row| row.split(',').next()?.parse().ok()).collect();
    let processed = processed.ok_or_else(|| failed("its first column holds no frames"))?;
    Ok(range.step_by(step).filter(|frame| !processed.contains(frame)).collect())
}

/// `3..5,9`, all of them inside, and not more than a list of them may hold.
fn ranges(text: &str, inside: Range<usize>) -> Option<Vec<usize>> {
    let mut frames = Vec::new();
    for item in text.split(',').filter(|item| !item.is_empty()) {
        let range = parse_range(item)?;
        let longest = MOST_LISTED.saturating_sub(frames.len());
        if !inside.contains(range.start()) || !inside.contains(range.end()) || range.end() - range.start() >= longest {
            return None;
        }
        frames.extend(range);
    }
    Some(frames)
}

fn unusable(path: &Path, what: &str) -> Failure {
    Failure::failed(format_args!("cannot use {}, which tells which frames were processed: {what}", path.display()))
        .hint("move it away and say how many frames there were with --frames")
}
