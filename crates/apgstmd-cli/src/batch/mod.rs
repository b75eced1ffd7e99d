//! Many videos: a process each, results that are whole as soon as they have their place, and a manifest of all.
//!
//! [`Batch::open`] makes the list of [`Job`]s, [`process`] does one, here or on another machine that sees the same files,
//! [`Batch::add`] takes note of it. The folders are the truth: the manifest only gathers what stands in them.

mod checksum;
mod clip;
mod inputs;
mod page;
mod record;

use std::collections::{BTreeMap, HashSet};
use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf, absolute};
use std::thread::available_parallelism;
use std::time::{Duration, Instant};

use apgstmd_core::MOST_THREADS;
use clap::Parser;

pub use self::clip::{Finished, Job, process};
pub use self::record::{FileRecord, InputRecord, Manifest, Record, SCHEMA_VERSION, Size, Status};
use crate::Outcome;
use crate::args::{Arguments, BatchArgs, Command, RunArgs};
use crate::failure::{Failure, reason};
use crate::settings::check_flags;
use crate::sink::beside::Beside;

/// Folders of clips that are whole.
pub(crate) const CLIPS: &str = "clips";
/// What failed ones left.
pub(crate) const FAILED: &str = "failed";
/// What is being computed.
const PART: &str = "part";
/// Everything that was done.
pub(crate) const MANIFEST: &str = "manifest.json";
/// One page over all.
pub(crate) const PAGE: &str = "index.html";
/// Held by the process that writes the manifest.
const LOCK: &str = "batch.lock";
/// In each clip's folder: its record.
const CLIP: &str = "clip.json";
/// In each clip's folder: what its process said.
const STDERR: &str = "stderr.txt";
/// In each clip's folder: a small picture.
const THUMBNAIL: &str = "thumbnail.jpg";
/// Flags that name no file here, because each clip has its own.
const OWN_FILES: [(&str, &str); 4] =
    [("--mot", "tracks.txt"), ("--coco", "tracks.json"), ("--report", REPORT), ("--video", "found.mp4")];
/// In each clip's folder: the page of the clip.
const REPORT: &str = "report.html";
/// The manifest of very many clips takes its time: it is written so seldom that this is one part in so many of all.
const MANIFEST_SHARE: u32 = 20;

/// The file of a clip's folder that a flag stands for.
fn own_file(flag: &std::ffi::OsStr) -> Option<&'static str> {
    OWN_FILES.iter().find(|(name, _)| flag == *name).map(|(_, file)| *file)
}

/// A folder of results and what is to be done in it.
pub struct Batch {
    out: PathBuf,
    jobs: Vec<Job>,
    records: BTreeMap<String, Record>,
    written: Option<(Instant, Duration)>,
    /// Released by the system when it is closed.
    lock: Option<File>,
}

impl Batch {
    /// Checks the flags, spells out the list, makes the folder; with `--resume` reads what it holds.
    ///
    /// # Errors
    /// Wrong flags, an unreadable list, a folder that is used already or cannot be.
    pub fn open(args: &BatchArgs) -> Outcome<Self> {
        let flags = check(args)?;
        let out = absolute(&args.out).map_err(|error| {
            Failure::usage(format_args!("--out {:?} is no folder: {}", args.out.display().to_string(), reason(&error)))
        })?;
        let inputs = inputs::expand(&args.inputs)?;
        if let Some(inside) = inputs.iter().find(|input| inputs::real(input).starts_with(inputs::real(&out))) {
            return Err(Failure::usage(format_args!(
                "{} lies in --out {}: results would be taken for videos next time",
                inside.display(),
                args.out.display()
            )));
        }
        let (_, threads) = share(args.jobs, args.threads, inputs.len())?;
        let flag_files = flag_files(args)?;
        if !args.resume {
            refuse_used(&args.out)?;
        }
        let lock = prepare(&args.out)?;
        let records = gather(&out);
        let names = names(&inputs, &records);
        let jobs = inputs.into_iter().zip(names).map(|(input, name)| Job {
            name,
            input,
            out: out.clone(),
            flags: flags.clone(),
            flag_files: flag_files.clone(),
            threads,
        });
        let mut batch = Self { jobs: jobs.collect(), out, records, written: None, lock: Some(lock) };
        batch.write(false)?;
        Ok(batch)
    }

    /// What is to be done, in the order given, each input once.
    pub fn jobs(&self) -> &[Job] {
        &self.jobs
    }

    /// Takes note of a clip, in the manifest too.
    ///
    /// # Errors
    /// Writing failed.
    pub fn add(&mut self, record: Record) -> Outcome {
        self.records.insert(record.name.clone(), record);
        match self.written {
            Some((when, cost)) if when.elapsed() < MANIFEST_SHARE * cost => Ok(()),
            _ => self.write(false),
        }
    }

    /// Takes note that nothing came back of a job: the machines that tried it died.
    ///
    /// # Errors
    /// Writing failed.
    pub fn lost(&mut self, name: &str, why: &str) -> Outcome {
        let Some(job) = self.jobs.iter().find(|job| job.name == name) else { return Ok(()) };
        let record = Record { error: Some(why.to_owned()), ..job.record() };
        self.add(record)
    }

    /// Writes the manifest and the page, clears away what was left half done, and returns what became of the jobs, in
    /// their order; of those that were not tried, what is known from earlier.
    ///
    /// # Errors
    /// Writing failed.
    pub fn finish(&mut self, interrupted: bool) -> Outcome<Vec<Record>> {
        self.write(interrupted)?;
        Beside::new(&self.out.join(PAGE))?.write(page::page(&self.out, &self.manifest(interrupted)))?;
        // Of processes that died; nothing in it was finished.
        let _ = fs::remove_dir_all(self.out.join(PART));
        self.lock = None;
        Ok(self.jobs.iter().filter_map(|job| self.records.get(&job.name)).cloned().collect())
    }

    fn manifest(&self, interrupted: bool) -> Manifest<'_> {
        let mut clips: Vec<&Record> = self.records.values().collect();
        clips.sort_by(|a, b| alphanumeric_sort::compare_str(&a.name, &b.name));
        let done = clips.iter().filter(|record| record.is_done()).count();
        Manifest {
            schema_version: SCHEMA_VERSION,
            program: "apgstmd",
            version: env!("CARGO_PKG_VERSION"),
            command: "batch",
            done,
            failed: clips.len() - done,
            waiting: self.jobs.iter().filter(|job| !self.records.contains_key(&job.name)).count(),
            interrupted,
            clips,
        }
    }

    fn write(&mut self, interrupted: bool) -> Outcome {
        let begin = Instant::now();
        let path = self.out.join(MANIFEST);
        let text = serde_json::to_string_pretty(&self.manifest(interrupted));
        let text = text.map_err(|error| Failure::write(&path, error))?;
        Beside::new(&path)?.write(&(text + "\n"))?;
        self.written = Some((Instant::now(), begin.elapsed()));
        Ok(())
    }
}

/// Videos at a time, and threads for each.
///
/// # Errors
/// Numbers out of range.
pub fn share(jobs: Option<usize>, threads: Option<usize>, clips: usize) -> Outcome<(usize, usize)> {
    for (flag, given) in [("--jobs", jobs), ("--threads", threads)] {
        if let Some(given) = given.filter(|given| !(1..=MOST_THREADS).contains(given)) {
            return Err(Failure::usage(format_args!("{flag} is {given}, but it must be between 1 and {MOST_THREADS}")));
        }
    }
    let cores = available_parallelism().map_or(1, usize::from).min(MOST_THREADS);
    let jobs = jobs.unwrap_or(cores / threads.unwrap_or(1)).clamp(1, clips.max(1));
    Ok((jobs, threads.unwrap_or((cores / jobs).max(1))))
}

/// Seconds to a microsecond: text of so few digits is read back as it was written.
fn rounded(seconds: f64) -> f64 {
    (1e6 * seconds).round() / 1e6
}

/// The flags of `apgstmd run` for each clip, checked as far as that is possible without one.
fn check(args: &BatchArgs) -> Outcome<Vec<OsString>> {
    let mut flags = Vec::new();
    for flag in &args.run.0 {
        let mut word = OsString::from(&flag.name);
        if let Some(value) = &flag.value {
            word.push("=");
            match flag.is_file {
                // Processes elsewhere have another current folder.
                true => word.push(absolute(Path::new(value)).unwrap_or_else(|_| PathBuf::from(value))),
                false => word.push(value),
            }
        }
        flags.push(word);
    }
    let own = [args.mot, args.coco, args.report, args.video];
    let own = OWN_FILES.iter().zip(own).filter(|(_, wanted)| *wanted);
    let own: Vec<(&str, &str)> = own.map(|(own, _)| *own).collect();
    let place = args.out.join(PART).join("clip");
    let named = own.iter().map(|(flag, file)| {
        let mut word = OsString::from(format!("{flag}="));
        word.push(place.join(file));
        word
    });
    let words = ["apgstmd", "run"].map(OsString::from).into_iter().chain(flags.iter().cloned()).chain(named);
    let mut out = OsString::from("--out=");
    out.push(&place);
    let words = words.chain([out, OsString::from("--"), OsString::from("clip")]);
    let run: Box<RunArgs> = match Arguments::try_parse_from(words)?.command {
        Command::Run(run) => run,
        other => unreachable!("the words say run, not {other:?}"),
    };
    check_flags(&run)?;
    flags.extend(own.iter().map(|(flag, _)| OsString::from(flag)));
    Ok(flags)
}

fn flag_files(args: &BatchArgs) -> Outcome<BTreeMap<String, String>> {
    let mut sums = BTreeMap::new();
    for flag in args.run.0.iter().filter(|flag| flag.is_file) {
        if let Some(value) = &flag.value {
            sums.insert(flag.name.clone(), checksum::of_file(Path::new(value), &|| false)?.sha256);
        }
    }
    Ok(sums)
}

fn refuse_used(out: &Path) -> Outcome {
    if out.exists() && !out.is_dir() {
        return Err(Failure::failed(format_args!("{} is a file, but a folder is needed there", out.display()))
            .hint("choose a folder with --out"));
    }
    match [MANIFEST, CLIPS, FAILED, PAGE]
        .iter()
        .map(|name| out.join(name))
        .find(|path| fs::symlink_metadata(path).is_ok())
    {
        None => Ok(()),
        Some(path) => Err(Failure::failed(format_args!("{} is there already from an earlier batch", path.display()))
            .hint("go on with it by --resume, or choose another folder with --out")),
    }
}

/// Makes the folders, and sees that nobody else is at work in them. What an earlier batch left half done goes.
fn prepare(out: &Path) -> Outcome<File> {
    fs::create_dir_all(out)
        .map_err(|error| Failure::write(out, error).hint("choose a folder you may write to with --out"))?;
    let path = out.join(LOCK);
    if fs::symlink_metadata(&path).is_ok_and(|about| !about.is_file()) {
        return Err(Failure::failed(format_args!("{} is no file of this program", path.display()))
            .hint("move what stands there, or choose another folder with --out"));
    }
    let lock = File::options().create(true).append(true).open(&path).map_err(|error| Failure::write(&path, error))?;
    match lock.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            return Err(Failure::failed(format_args!("another batch is at work in {}", out.display()))
                .hint("wait for it, or choose another folder with --out"));
        }
        // Some network file systems know no locks.
        Err(TryLockError::Error(_)) => {}
    }
    let part = out.join(PART);
    if clip::is_real_folder(&part) {
        fs::remove_dir_all(&part).map_err(|error| Failure::write(&part, error))?;
    }
    for folder in [CLIPS, FAILED, PART].map(|name| out.join(name)) {
        // Nothing is written through a link to elsewhere.
        if !clip::is_real_folder(&folder) {
            fs::create_dir(&folder).map_err(|error| {
                Failure::write(&folder, error).hint("what stands there is no folder: move it, or choose another --out")
            })?;
        }
    }
    Ok(lock)
}

/// What stands in the folders. A failed clip is the later attempt: one that is done leaves none.
fn gather(out: &Path) -> BTreeMap<String, Record> {
    let mut records = BTreeMap::new();
    for folder in [CLIPS, FAILED] {
        let entries = fs::read_dir(out.join(folder)).into_iter().flatten().flatten();
        for path in entries.map(|entry| entry.path()).filter(|path| clip::is_real_folder(path)) {
            if let Some(record) = Record::read(&path)
                && path.file_name().is_some_and(|name| name == record.name.as_str())
            {
                records.insert(record.name.clone(), record);
            }
        }
    }
    records
}

/// A name for each input: the one it had, where it was here before, else a new one.
fn names(inputs: &[PathBuf], records: &BTreeMap<String, Record>) -> Vec<String> {
    let mut known: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for record in records.values().rev() {
        known.entry(&record.input.path).or_default().push(&record.name);
    }
    let mut taken: HashSet<String> = records.keys().map(|name| name.to_lowercase()).collect();
    let name = |input: &PathBuf| {
        let before = known.get_mut(&*input.to_string_lossy()).and_then(Vec::pop);
        before.map_or_else(|| inputs::distinct(&inputs::name_of(input), &mut taken), str::to_owned)
    };
    inputs.iter().map(name).collect()
}
