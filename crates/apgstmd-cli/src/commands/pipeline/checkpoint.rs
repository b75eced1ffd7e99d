//! Checkpoints: all that a run needs to go on where it was, in one file that is there whole or not at all.
//!
//! The thread that computes says what it remembers between two blocks of frames; by the time that reaches the one that
//! writes, all rows of these frames are written, and the lengths of the tables belong to it.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Write};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use apgstmd_core::state::{Array, Origin, Values};
use apgstmd_core::{Size, State};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::Outcome;
use crate::failure::{Failure, reason};
use crate::footage::Footage;
use crate::sink::Sink;
use crate::sink::beside::Beside;
use crate::sink::run_json::{Background, First, Found, Skipped};

/// Where checkpoints go, how often, and what they are of.
#[derive(Clone, Debug)]
pub(in crate::commands) struct Checkpoints {
    pub path: PathBuf,
    /// Frames from one to the next at least; none are written without it.
    pub every: Option<usize>,
    /// What the results depend on, TOML: a checkpoint of other settings is refused.
    pub settings: String,
}

/// What computing remembers.
#[derive(Serialize, Deserialize)]
pub(super) struct Computing {
    /// Where the first picture came from.
    pub origin: String,
    /// The last frame that was given to the model, with its time.
    pub last: Option<(usize, Option<f64>)>,
    /// What came: the first and the last frame, what was left out between, what could not be used.
    pub came: (Option<usize>, Option<usize>),
    pub left_out: First<RangeInclusive<usize>>,
    pub skipped: First<Skipped>,
    /// Least scores of detections that are listed, and that begin tracks.
    pub limits: (f32, f32),
}

/// The states of what computes.
pub(super) struct States {
    pub engine: Vec<u8>,
    pub tracker: Option<Vec<u8>>,
    pub alarms: Option<Vec<u8>>,
}

/// What writing remembers.
#[derive(Serialize, Deserialize)]
pub(super) struct Writing {
    pub frames: usize,
    pub found: Found,
    pub background: Background,
    pub traces: super::traces::Traces,
    pub footage: Footage,
    /// Tables by the names of their files, and how long they were.
    pub files: Vec<(String, u64)>,
}

/// A run as it was.
pub(in crate::commands) struct Checkpoint {
    pub(super) size: Size,
    pub(super) states: States,
    pub(super) computing: Computing,
    pub(super) writing: Writing,
}

impl Checkpoint {
    /// Reads it where there is one.
    ///
    /// # Errors
    /// It cannot be read, is damaged, or is of other settings.
    pub fn read(of: &Checkpoints) -> Outcome<Option<Self>> {
        let path = &of.path;
        let bad = |what: String| {
            Failure::failed(format_args!("cannot go on from {}: {what}", path.display()))
                .hint("begin anew with --force, which replaces what is there")
        };
        let bytes = match fs::read(path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(bad(reason(&error))),
        };
        let state = State::from_bytes(&bytes).map_err(|error| bad(error.to_string()))?;
        let size = Size::new(state.origin().height, state.origin().width);
        state.origin().agrees(&origin(size, &of.settings)).map_err(|error| bad(error.to_string()))?;
        let part = |name: &str| match state.arrays().get(name).map(|array| &array.values) {
            Some(Values::U8(bytes)) => Some(bytes.clone()),
            _ => None,
        };
        let states = part(ENGINE).map(|engine| States { engine, tracker: part(TRACKER), alarms: part(ALARMS) });
        let (computing, writing) = (part(COMPUTING), part(WRITING));
        match (states, computing.as_deref().and_then(decode), writing.as_deref().and_then(decode)) {
            (Some(states), Some(computing), Some(writing)) => Ok(Some(Self { size, states, computing, writing })),
            _ => Err(bad("it is not whole".to_owned())),
        }
    }

    /// Writes it beside its place and moves it there. What [`lengths`] told has reached the disk by then.
    ///
    /// # Errors
    /// Writing failed. The checkpoint before it is still there.
    pub fn write(&self, of: &Checkpoints) -> Outcome {
        let (beside, mut file) = Beside::open(&of.path)?;
        let written = file.write_all(&self.to_bytes(&of.settings)).and_then(|()| file.sync_all());
        written.map_err(|error| Failure::write(&of.path, error))?;
        beside.place()
    }

    fn to_bytes(&self, settings: &str) -> Vec<u8> {
        let States { engine, tracker, alarms } = &self.states;
        let parts = [
            (ENGINE, Some(engine.clone())),
            (TRACKER, tracker.clone()),
            (ALARMS, alarms.clone()),
            (COMPUTING, Some(encode(&self.computing))),
            (WRITING, Some(encode(&self.writing))),
        ];
        let arrays: BTreeMap<String, Array> = parts
            .into_iter()
            .filter_map(|(name, bytes)| Some((name.to_owned(), bytes?)))
            .map(|(name, bytes)| (name, Array { shape: vec![bytes.len()], values: Values::U8(bytes) }))
            .collect();
        State::new(origin(self.size, settings), arrays).expect("shapes are lengths").to_bytes()
    }

    /// The last frame that came.
    pub fn last(&self) -> Option<usize> {
        self.computing.came.1
    }

    /// Frames of which the results are there.
    pub fn frames(&self) -> usize {
        self.writing.frames
    }

    /// How long a table was.
    ///
    /// # Errors
    /// The table is not of this run, gone, or shorter.
    pub fn length(&self, path: &Path) -> Outcome<u64> {
        let there = fs::metadata(path).map_or(0, |file| file.len());
        let known = self.writing.files.iter().find(|(file, _)| *file == name(path));
        match known {
            Some((_, length)) if *length <= there => Ok(*length),
            Some((_, length)) => Err(Failure::failed(format_args!(
                "cannot go on with {}: it has {there} bytes, but had {length} when the checkpoint was written",
                path.display()
            ))),
            None => Err(Failure::failed(format_args!("the checkpoint knows nothing of {}", path.display()))),
        }
        .map_err(|failure| failure.hint("begin anew with --force, which replaces what is there"))
    }
}

/// Removes the checkpoint of a run that is through, and what one that was killed left of the next.
///
/// # Errors
/// The system refuses.
pub(in crate::commands) fn remove(of: &Checkpoints) -> Outcome {
    Beside::clear(&of.path)?;
    match fs::remove_file(&of.path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Failure::write(&of.path, error)),
        _ => Ok(()),
    }
}

/// The tables by name, and how long they are, once they have reached the disk.
pub(super) fn lengths(sinks: &[Box<dyn Sink + '_>]) -> Outcome<Vec<(String, u64)>> {
    let length = |path: &Path| {
        let synced = || {
            let file = File::open(path)?;
            file.sync_data()?;
            Ok(file.metadata()?.len())
        };
        let length = synced().map_err(|error: io::Error| Failure::write(path, error))?;
        Ok((name(path), length))
    };
    sinks.iter().filter_map(|sink| sink.grows()).map(length).collect()
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

const ENGINE: &str = "engine";
const TRACKER: &str = "tracker";
const ALARMS: &str = "alarms";
const COMPUTING: &str = "computing";
const WRITING: &str = "writing";

fn origin(size: Size, settings: &str) -> Origin {
    Origin::here("run", size, settings.to_owned())
}

fn encode(part: &impl Serialize) -> Vec<u8> {
    postcard::to_stdvec(part).expect("plain data")
}

fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Option<T> {
    match postcard::take_from_bytes(bytes) {
        Ok((part, [])) => Some(part),
        _ => None,
    }
}
