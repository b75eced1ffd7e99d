//! One clip: a process of its own computes it into a folder that nobody looks at, which is then moved to its place. What
//! has its place is whole; so nothing is done twice, whoever does it, and nothing is lost when a process or machine dies.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

use super::record::{FileRecord, InputRecord, Record, SCHEMA_VERSION, Size, Status};
use super::{CLIP, CLIPS, FAILED, PART, STDERR, THUMBNAIL, checksum, rounded};
use crate::Outcome;
use crate::failure::{Failure, reason};
use crate::itself;
use crate::sink::results::RUN;

/// How often a process is asked whether it has ended.
const LOOK: Duration = Duration::from_millis(10);
/// Of stderr, in which the error stands last, bytes.
const TAIL: u64 = 1 << 16;
/// Exit code of an interrupted run.
const INTERRUPTED: i32 = 130;
/// A Ctrl-C reaches this process and the others at once, but is not heard at once.
const HEARING: Duration = Duration::from_millis(200);

/// What is to be done: all that a process on any machine that sees the same files must know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
    /// Name of its folder.
    pub name: String,
    /// Full path.
    pub input: PathBuf,
    /// Folder of the batch, full path.
    pub out: PathBuf,
    /// Flags of `apgstmd run`.
    pub flags: Vec<OsString>,
    /// SHA-256 of the files they name.
    pub flag_files: BTreeMap<String, String>,
    /// Threads that compute.
    pub threads: usize,
}

/// What became of it.
#[derive(Clone, Debug)]
pub struct Finished {
    /// As it stands in the clip's folder.
    pub record: Record,
    /// It was done before.
    pub before: bool,
}

/// Does it, unless it is done already: of the same input, with the same flags. `stop` is asked many times a second, and
/// where it says so the process ends.
///
/// # Errors
/// Interrupted; the folder of the batch cannot be used. What is wrong with the clip is in the record.
pub fn process(job: &Job, stop: &dyn Fn() -> bool) -> Outcome<Finished> {
    let begin = Instant::now();
    let part = part_folder(job)?;
    let mut record = job.record();
    let attempt = match checksum::input(&job.input, stop) {
        Ok(input) => {
            record.input = input;
            if let Some(record) = job.complete(&record.input) {
                remove(&job.out.join(FAILED).join(&job.name))?;
                return Ok(Finished { record, before: true });
            }
            run(job, part.path(), stop)
        }
        Err(failure) => Err(failure),
    };
    match attempt {
        Ok(()) => record.status = Status::Done,
        Err(Failure::Interrupted) => return Err(Failure::Interrupted),
        Err(failure) => {
            let error = failure.text().unwrap_or_default();
            say(&part.path().join(STDERR), &error)?;
            record.error = Some(error);
        }
    }
    if let Some(run) = fs::read(part.path().join(RUN)).ok().and_then(|text| serde_json::from_slice(&text).ok()) {
        note(&mut record, &run);
    }
    record.files = files(part.path(), stop)?;
    record.wall_seconds = rounded(begin.elapsed().as_secs_f64());
    if record.is_done() {
        match job.place(part.path(), &mut record)? {
            Placed::Here => {}
            Placed::Before(record) => return Ok(Finished { record: *record, before: true }),
            Placed::InTheWay(reason) => {
                record.status = Status::Failed;
                record.error = Some(reason);
            }
        }
    }
    let failed = job.out.join(FAILED).join(&job.name);
    remove(&failed)?;
    if !record.is_done() {
        record.folder = format!("{FAILED}/{}", job.name);
        write(&record, part.path())?;
        fs::rename(part.path(), &failed).map_err(|error| Failure::write(&failed, error))?;
    }
    Ok(Finished { record, before: false })
}

/// The process, from its start to its end.
fn run(job: &Job, part: &Path, stop: &dyn Fn() -> bool) -> Outcome {
    let stderr = File::create(part.join(STDERR)).map_err(|error| Failure::write(&part.join(STDERR), error))?;
    let with = |flag: &str, name: &str| {
        let mut word = OsString::from(format!("{flag}="));
        word.push(part.join(name));
        word
    };
    let flags = job.flags.iter().map(|flag| match super::own_file(flag) {
        Some(name) => with(flag.to_str().unwrap_or_default(), name),
        None => flag.clone(),
    });
    let mut command = itself::command()?;
    command.arg("run").args(flags).arg(with("--out", "")).arg(with("--poster", THUMBNAIL));
    command.arg(format!("--threads={}", job.threads)).args(["--while-stdin-is-open", "--"]).arg(&job.input);
    // Held open: when this process dies, however it does, the other ends too.
    let child = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(stderr).spawn();
    let mut child =
        child.map_err(|error| Failure::failed(format_args!("cannot start a process: {}", reason(&error))))?;
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) if !stop() => thread::sleep(LOOK),
            _ => {
                // Already gone, perhaps.
                let _ = child.kill();
                let _ = child.wait();
                return Err(Failure::Interrupted);
            }
        }
    };
    if status.success() {
        return Ok(());
    }
    if status.code() == Some(INTERRUPTED) && heard(stop) {
        return Err(Failure::Interrupted);
    }
    Err(Failure::failed(error_in(&part.join(STDERR)).unwrap_or_else(|| ending(status))))
}

/// For what failed before there was a process that could say so.
fn say(stderr: &Path, error: &str) -> Outcome {
    match stderr.exists() {
        true => Ok(()),
        false => fs::write(stderr, format!("error: {error}\n")).map_err(|error| Failure::write(stderr, error)),
    }
}

fn heard(stop: &dyn Fn() -> bool) -> bool {
    let begin = Instant::now();
    while !stop() && begin.elapsed() < HEARING {
        thread::sleep(LOOK);
    }
    stop()
}

/// What the program said was wrong.
fn error_in(stderr: &Path) -> Option<String> {
    let mut file = File::open(stderr).ok()?;
    let length = file.metadata().ok()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(TAIL))).ok()?;
    let mut tail = Vec::new();
    file.read_to_end(&mut tail).ok()?;
    let text = String::from_utf8_lossy(&tail);
    text.lines().rev().find_map(|line| line.strip_prefix("error: ")).map(str::to_owned)
}

/// How a process ended that said nothing.
fn ending(status: ExitStatus) -> String {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        return format!(
            "its process was killed by signal {signal}: was there too little memory for so many at a time?"
        );
    }
    format!("its process ended with {status}: see its {STDERR}")
}

/// What run.json says.
fn note(record: &mut Record, run: &Value) {
    let number = |value: &Value| value.as_u64();
    record.frames = number(&run["frames"]);
    record.detections = number(&run["found"]["detections"]);
    record.tracks = number(&run["found"]["tracks"]);
    record.processor_seconds = run["processor_seconds"].as_f64().map(rounded);
    let (height, width) = (number(&run["size"]["height"]), number(&run["size"]["width"]));
    record.size = height.zip(width).map(|(height, width)| Size { height, width });
}

/// Every file below a folder, by its path from there.
fn files(folder: &Path, stop: &dyn Fn() -> bool) -> Outcome<BTreeMap<String, FileRecord>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![(folder.to_owned(), String::new())];
    while let Some((folder, before)) = folders.pop() {
        for entry in fs::read_dir(&folder).map_err(|error| Failure::write(&folder, error))? {
            let entry = entry.map_err(|error| Failure::write(&folder, error))?;
            let name = format!("{before}{}", entry.file_name().to_string_lossy());
            if entry.path().is_dir() {
                folders.push((entry.path(), format!("{name}/")));
            } else {
                found.insert(name, checksum::of_file(&entry.path(), stop)?);
            }
        }
    }
    Ok(found)
}

enum Placed {
    Here,
    /// Another process was faster.
    Before(Box<Record>),
    /// What stands there is not of this program.
    InTheWay(String),
}

impl Job {
    /// Flags as the record has them.
    fn shown_flags(&self) -> Vec<String> {
        self.flags.iter().map(|flag| flag.to_string_lossy().into_owned()).collect()
    }

    /// Of which nothing is known yet but that it failed.
    pub(super) fn record(&self) -> Record {
        Record {
            schema_version: SCHEMA_VERSION,
            name: self.name.clone(),
            status: Status::Failed,
            error: None,
            folder: format!("{CLIPS}/{}", self.name),
            input: InputRecord::named(&self.input),
            flags: self.shown_flags(),
            flag_files: self.flag_files.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            threads: self.threads,
            wall_seconds: 0.0,
            processor_seconds: None,
            size: None,
            frames: None,
            detections: None,
            tracks: None,
            files: BTreeMap::new(),
        }
    }

    fn folder(&self) -> PathBuf {
        self.out.join(CLIPS).join(&self.name)
    }

    /// The record, where the same was done before and its files are there.
    fn complete(&self, input: &InputRecord) -> Option<Record> {
        let folder = self.folder();
        let record = Record::read(&folder).filter(|_| is_real_folder(&folder))?;
        let there = |(name, file): (&String, &FileRecord)| {
            fs::metadata(folder.join(name)).is_ok_and(|about| about.len() == file.bytes)
        };
        let same = record.is_done()
            && record.input.sha256.is_some()
            && record.input.sha256 == input.sha256
            && record.flag_files == self.flag_files
            && meant(&record.flags, &self.flag_files).eq(meant(&self.shown_flags(), &self.flag_files));
        (same && record.files.iter().all(there)).then_some(record)
    }

    /// Moves what is whole to its place, an earlier result of other flags or another input out of it.
    fn place(&self, part: &Path, record: &mut Record) -> Outcome<Placed> {
        let folder = self.folder();
        write(record, part)?;
        for _ in 0..3 {
            match fs::rename(part, &folder) {
                Ok(()) => return Ok(Placed::Here),
                Err(_) if fs::symlink_metadata(&folder).is_ok() => {}
                Err(error) => return Err(Failure::write(&folder, error)),
            }
            if let Some(record) = self.complete(&record.input) {
                return Ok(Placed::Before(Box::new(record)));
            }
            if !is_real_folder(&folder) || Record::read(&folder).is_none() {
                let there = folder.display();
                return Ok(Placed::InTheWay(format!("{there} is in the way: it is no result of apgstmd batch")));
            }
            let old = part_folder(self)?;
            // Another process may have moved it.
            let _ = fs::rename(&folder, old.path().join(&self.name));
        }
        Ok(Placed::InTheWay(format!("{} is replaced again and again by another process", folder.display())))
    }
}

/// A new folder that no other process has, here or elsewhere; gone with what it holds unless it was moved.
fn part_folder(job: &Job) -> Outcome<TempDir> {
    let part = job.out.join(PART);
    let prefix = format!("{}-", job.name);
    let mut folder = tempfile::Builder::new();
    folder.prefix(&prefix);
    // Results are as open as the user's other files.
    #[cfg(unix)]
    folder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
    folder.tempdir_in(&part).map_err(|error| Failure::write(&part, error))
}

/// Flags without the places of files, which are known by their sums.
fn meant<'a>(flags: &'a [String], files: &BTreeMap<String, String>) -> impl Iterator<Item = &'a str> {
    flags.iter().map(move |flag| match flag.split_once('=') {
        Some((name, _)) if files.contains_key(name) => name,
        _ => flag.as_str(),
    })
}

fn write(record: &Record, folder: &Path) -> Outcome {
    let path = folder.join(CLIP);
    let text = serde_json::to_string_pretty(record).map_err(|error| Failure::write(&path, error))?;
    fs::write(&path, text + "\n").map_err(|error| Failure::write(&path, error))
}

/// No link to elsewhere.
pub(super) fn is_real_folder(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|about| about.is_dir())
}

/// Removes a folder of this program, whose links are not followed.
fn remove(folder: &Path) -> Outcome {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Failure::write(folder, error)),
        _ => Ok(()),
    }
}
