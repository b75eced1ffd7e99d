//! `apgstmd run`: pictures in, tables and annotated pictures out.

use std::fs;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use apgstmd_core::Size;
use sha2::{Digest, Sha256};

use super::pipeline::{self, Checkpoint, Checkpoints, Options, Report, drive};
use super::{count, page};
use crate::Outcome;
use crate::args::{Format, RunArgs};
use crate::failure::Failure;
use crate::footage::Warning;
use crate::host::Host;
use crate::interrupt;
use crate::settings::{Destination, PictureSettings, RunSettings, TrackSettings, readers, seconds_between};
use crate::sink::Sink;
use crate::sink::camera::CameraCsv;
use crate::sink::dump::Dump;
use crate::sink::outline::Outline;
use crate::sink::overlay::Overlay;
use crate::sink::poster::Poster;
use crate::sink::report::{Gather, Gathered};
use crate::sink::results::{self, Results};
use crate::sink::run_json::{BankRecord, Input, RegionRecord, RunRecord, SCHEMA_VERSION, processor_seconds};
use crate::sink::table::{Csv, JsonLines, Target};
use crate::sink::tracks::{Coco, Mot, TracksCsv};
use crate::sink::video::{Codec, Video, VideoOptions};
use crate::source::{Place, Selection};

pub(crate) fn main(args: Box<RunArgs>, host: Host) -> Outcome {
    // Looking at a stream may take long.
    interrupt::listen();
    if args.child.while_stdin_is_open {
        interrupt::end_with_stdin();
    }
    let mut settings = RunSettings::resolve(*args, host.frames)?;
    let tracks = settings.tracks.any() || settings.pictures.any();
    if host.without_tables {
        settings.formats.clear();
        settings.tracks.csv = None;
    }
    let settings = settings;
    let results = check_results(&settings)?;
    let checkpoints = checkpoints(&settings);
    let from = match (&checkpoints, settings.resume) {
        (Some(checkpoints), true) => Checkpoint::read(checkpoints)?,
        _ => None,
    };
    if let (true, None, Destination::Folder(folder)) = (settings.resume, &from, &settings.destination)
        && is_through(&settings, folder)?
    {
        return Ok(());
    }
    let lengths = from.as_ref().map(|from| lengths(&settings, from)).transpose()?;
    let source = &settings.source;
    let done = from.as_ref().and_then(Checkpoint::last);
    let sources = source.open(settings.span, settings.selection.as_ref(), done, readers(settings.machine.threads))?;
    if let (Some(from), false) = (&from, settings.quiet) {
        eprint_line(&format!("going on after {}", count(from.frames(), "frame")));
    }
    if source.is_live_by_itself() && !settings.quiet {
        eprint_line(&format!(
            "{} goes on in its own time: frames that come while one is computed are dropped (--live=no keeps them)",
            source.shown()
        ));
    }
    let options = Options {
        params: &settings.params,
        bank: settings.bank.as_ref(),
        false_alarms: settings.false_alarms,
        machine: settings.machine.clone(),
        look_in: settings.look_in.as_ref(),
        on_error: settings.on_error,
        dump: settings.dump.as_ref(),
        tracks,
        response: settings.pictures.response,
        quiet: settings.quiet,
        live: source.is_live(),
        span: settings.span,
        checkpoints: checkpoints.as_ref(),
    };
    let mut gathered = settings.pictures.report.as_deref().map(Gathered::new);
    let codec = settings.pictures.video.as_ref().map(|_| Codec::choose()).transpose()?;
    let gather = gathered.as_mut();
    let mut report =
        drive(sources, &options, from, |size| open_sinks(&settings, &results, size, lengths, gather, codec, host.sink));
    if report.empty && source.count() > 0 {
        report.failure = Some(settings.span.nothing_left(source.count()));
    }
    let warnings = warnings(&settings, &report);
    // run.json says that all is there: it comes last.
    let shown = gathered.map_or(Ok(()), |gathered| page::write(&gathered, &settings, &report, &warnings));
    report.failure = report.failure.or(shown.err());
    let recorded = match &settings.destination {
        Destination::Folder(folder) => write_record(&settings, &report, &warnings, folder),
        Destination::Stdout => Ok(()),
    };
    let recorded = recorded.and_then(|()| match &checkpoints {
        Some(checkpoints) if report.failure.is_none() && !report.interrupted => pipeline::remove(checkpoints),
        _ => Ok(()),
    });
    if !settings.quiet && report.failure.is_none() {
        summarise(&settings, &report, &warnings);
    }
    match report.failure {
        Some(failure) => Err(failure),
        None => recorded.and(if report.interrupted { Err(Failure::Interrupted) } else { Ok(()) }),
    }
}

/// What is refused before the first picture is read.
fn check_results(settings: &RunSettings) -> Outcome<Option<Results>> {
    let dumps = settings.dump.as_ref().map(|dump| dump.folder.clone());
    let results = match &settings.destination {
        Destination::Folder(folder) => Results::new(folder.clone(), dumps),
        Destination::Stdout => match dumps {
            Some(dumps) => Results::dumps_only(dumps),
            None => return Ok(None),
        },
    };
    results.check(settings.force || settings.resume)?;
    Ok(Some(results))
}

fn checkpoints(settings: &RunSettings) -> Option<Checkpoints> {
    let Destination::Folder(folder) = &settings.destination else { return None };
    (settings.checkpoint.is_some() || settings.resume).then(|| Checkpoints {
        path: folder.join(results::CHECKPOINT),
        every: settings.checkpoint,
        settings: settings.described(),
    })
}

fn sha256(settings: &RunSettings) -> String {
    Sha256::digest(settings.described()).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Whether the folder holds all results of these settings.
fn is_through(settings: &RunSettings, folder: &Path) -> Outcome<bool> {
    let path = folder.join(results::RUN);
    let Ok(text) = fs::read_to_string(&path) else { return Ok(false) };
    let record: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    if record["interrupted"] != false || !record["error"].is_null() {
        return Ok(false);
    }
    if record["settings_sha256"] != sha256(settings) {
        return Err(Failure::failed(format_args!("{} is of a run with other settings", path.display()))
            .hint("choose another folder with --out, or replace its results with --force"));
    }
    if !settings.quiet {
        eprint_line(&format!("{} is of this run, which is through: nothing is left to do", path.display()));
    }
    Ok(true)
}

/// Bytes of the tables that a checkpoint is of.
struct Lengths {
    tables: Vec<u64>,
    tracks: Option<u64>,
    camera: u64,
    mot: Option<u64>,
}

fn lengths(settings: &RunSettings, from: &Checkpoint) -> Outcome<Lengths> {
    let Destination::Folder(folder) = &settings.destination else { unreachable!("checkpoints have a folder") };
    let of = |path: &Option<PathBuf>| path.as_deref().map(|path| from.length(path)).transpose();
    let tables = settings.formats.iter().map(|format| from.length(&folder.join(file_of(*format))));
    Ok(Lengths {
        tables: tables.collect::<Outcome<_>>()?,
        tracks: of(&settings.tracks.csv)?,
        camera: from.length(&folder.join(results::CAMERA))?,
        mot: of(&settings.tracks.mot)?,
    })
}

fn file_of(format: Format) -> &'static str {
    match format {
        Format::Csv => results::CSV,
        Format::Jsonl => results::JSONL,
    }
}

/// With `lengths`, tables that are there are cut back to them.
fn open_sinks<'a>(
    settings: &RunSettings,
    results: &Option<Results>,
    size: Size,
    lengths: Option<Lengths>,
    gathered: Option<&'a mut Gathered>,
    codec: Option<Codec>,
    host: Option<Box<dyn Sink + Send>>,
) -> Outcome<Vec<Box<dyn Sink + 'a>>> {
    if let (Some(results), None) = (results, &lengths) {
        results.prepare()?;
    }
    let outline = outline(settings, size)?;
    let mut sinks: Vec<Box<dyn Sink + 'a>> = Vec::new();
    for (index, format) in settings.formats.iter().enumerate() {
        let length = lengths.as_ref().map(|lengths| lengths.tables[index]);
        let target = match (&settings.destination, length) {
            (Destination::Folder(folder), None) => Target::file(&folder.join(file_of(*format)))?,
            (Destination::Folder(folder), Some(length)) => Target::resume(&folder.join(file_of(*format)), length)?,
            (Destination::Stdout, _) => Target::stdout(),
        };
        match format {
            Format::Csv if length.is_some() => sinks.push(Box::new(Csv::resume(target))),
            Format::Csv => sinks.push(Box::new(Csv::new(target)?)),
            Format::Jsonl => sinks.push(Box::new(JsonLines::new(target))),
        }
    }
    let TrackSettings { csv, mot, coco, box_size } = &settings.tracks;
    if let Some(path) = csv {
        let length = lengths.as_ref().and_then(|lengths| lengths.tracks);
        sinks.push(Box::new(length.map_or_else(|| TracksCsv::new(path), |length| TracksCsv::resume(path, length))?));
    }
    if let Destination::Folder(folder) = &settings.destination {
        let length = lengths.as_ref().map(|lengths| lengths.camera);
        sinks.push(Box::new(CameraCsv::new(&folder.join(results::CAMERA), length)?));
    }
    if let Some(path) = mot {
        let length = lengths.as_ref().and_then(|lengths| lengths.mot);
        let mot = length.map_or_else(|| Mot::new(path, *box_size), |length| Mot::resume(path, *box_size, length));
        sinks.push(Box::new(mot?));
    }
    if let Some(path) = coco {
        sinks.push(Box::new(Coco::new(path, *box_size)?));
    }
    if let Some(dump) = &settings.dump {
        sinks.push(Box::new(Dump::new(dump)?));
    }
    if let (true, Destination::Folder(folder)) = (settings.overlay, &settings.destination) {
        let frames = settings.selection.as_ref().map(Selection::frames);
        sinks.push(Box::new(Overlay::new(folder, settings.source.shown(), frames, true, outline.clone())?));
    }
    if let Some(path) = &settings.poster {
        sinks.push(Box::new(Poster::new(path)));
    }
    if let Some(gathered) = gathered {
        gathered.open()?;
        gathered.outline = outline.clone();
        sinks.push(Box::new(Gather(gathered)));
    }
    if let Some(sink) = host {
        sinks.push(sink);
    }
    // Last: should it fail, the others have the frame.
    if let (Some(path), Some(codec)) = (&settings.pictures.video, codec) {
        let rate = seconds_between(&settings.source, settings.span).ok().map(f64::recip);
        let (path, response, bank) = (path.clone(), settings.pictures.response, settings.bank.is_some());
        sinks.push(Box::new(Video::new(VideoOptions { path, codec, rate, response, bank, outline })?));
    }
    Ok(sinks)
}

/// The border of the region, where pictures are to show it.
fn outline(settings: &RunSettings, size: Size) -> Outcome<Option<Rc<Outline>>> {
    match &settings.look_in {
        Some(look_in) if settings.overlay || settings.pictures.any() => {
            Ok(Some(Rc::new(Outline::of(&look_in.region(size)?))))
        }
        _ => Ok(None),
    }
}

fn write_record(settings: &RunSettings, report: &Report, warnings: &[Warning], folder: &Path) -> Outcome {
    // Without a first frame nothing was opened, and nothing is left behind.
    let Some(size) = report.size else { return Ok(()) };
    let record = RunRecord {
        schema_version: SCHEMA_VERSION,
        program: "apgstmd",
        version: env!("CARGO_PKG_VERSION"),
        command: "run",
        input: input_record(settings, report),
        size: size.into(),
        threads: settings.machine.threads,
        simd: settings.machine.level().name(),
        frames: report.frames,
        resumed_after: report.resumed_after,
        settings_sha256: Some(sha256(settings)),
        live: report.live,
        skipped: report.skipped.listed(),
        frames_skipped: report.skipped.count(),
        interrupted: report.interrupted,
        error: report.failure.as_ref().and_then(Failure::text),
        found: report.found,
        background: &report.background,
        seconds_per_frame: report.timing(),
        stage_seconds_per_frame: report.stage_seconds(),
        warnings,
        seconds: report.wall.as_secs_f64(),
        processor_seconds: processor_seconds(),
        speed: settings.speed,
        threshold: report.threshold,
        region: settings.look_in.as_ref().zip(report.size).and_then(|(look_in, size)| RegionRecord::of(look_in, size)),
        bank: settings.bank.as_ref().map(BankRecord::of),
        params: &settings.params,
        evaluation: None,
    };
    record.write(&folder.join(results::RUN))
}

fn input_record<'a>(settings: &'a RunSettings, report: &Report) -> Input<'a> {
    let count = settings.source.count();
    let span = settings.span;
    let range = |range: &RangeInclusive<usize>| match (range.start(), range.end()) {
        (start, end) if start == end => start.to_string(),
        (start, end) => format!("{start}..{end}"),
    };
    Input {
        path: settings.source.shown(),
        pictures: count,
        start: span.start.frames().or(report.first).unwrap_or(0),
        stop: match span.stop {
            None => count,
            Some(Place::Frames(stop)) => stop.min(count),
            Some(Place::Seconds(_)) => report.last.map_or(count, |last| last + 1),
        },
        step: span.stride(),
        left_out: report.left_out.listed().iter().map(range).collect::<Vec<_>>().join(","),
        frames_left_out: report.left_out.count(),
        fps: settings.source.rate(),
        bit_depth: settings.bit_depth,
        scene: settings.source.scene(),
    }
}

/// What the user should know of the input and of what became of it.
fn warnings(settings: &RunSettings, report: &Report) -> Vec<Warning> {
    let mut warnings = report.warnings.clone();
    if let Some(live) = report.live {
        let share = live.dropped as f64 / (live.dropped + report.frames).max(1) as f64;
        if share >= MANY_DROPPED {
            warnings.push(Warning::new(
                "dropped",
                format!(
                    "{:.0} % of the frames were dropped, so that targets move {:.1} times as far from one computed frame \
                     to the next",
                    100.0 * share,
                    (1.0 - share).max(1e-3).recip()
                ),
                "compute less: a known --speed, fewer --speeds, a smaller picture",
            ));
        }
    }
    if 10 * report.background.unexplained > report.frames {
        warnings.push(Warning::new(
            "camera",
            format!(
                "in {} the picture does not tell how the camera moved, and is taken to stand still",
                count(report.background.unexplained, "frame")
            ),
            "before a plain sky that is as it should be; elsewhere what is found there may belong to the background",
        ));
    }
    if let Some(missing) = settings.source.missing(settings.selection.as_ref()) {
        warnings.push(Warning::new(
            "missing",
            format!(
                "{} missing by the numbers in the names, the first after {}",
                count(missing.count, "picture"),
                missing.after
            ),
            "put them back: each picture is taken for the next moment, so that all that moves jumps there",
        ));
    }
    if let Some(first) = report.skipped.listed().first() {
        warnings.push(Warning::new(
            "skipped",
            format!("{} skipped, the first {}: {}", report.skipped.count(), first.name, first.reason),
            "run.json lists them",
        ));
    }
    if let (Some(claimed), None, false) = (settings.source.claims(), settings.span.stop, report.interrupted) {
        warnings.push(Warning::new(
            "short",
            format!(
                "{} says that it has {claimed} frames, but {} came",
                settings.source.shown(),
                settings.source.count()
            ),
            "it may have been cut short",
        ));
    }
    warnings
}

/// Cuts that the summary names.
const CUTS_NAMED: usize = 20;
/// Share of dropped frames from which on it matters.
const MANY_DROPPED: f64 = 0.2;
/// False alarms that must be expected in a clip for it to tell how frequent they are.
pub(super) const LEAST_ALARMS: f64 = 3.0;

/// On stderr: stdout is for data.
fn summarise(settings: &RunSettings, report: &Report, warnings: &[Warning]) {
    let Some(size) = report.size else { return };
    let found = report.found;
    let seconds = report.wall.as_secs_f64();
    let rate = report.frames_now() as f64 / seconds.max(1e-9);
    let timing = report.timing();
    let mut lines = vec![
        format!(
            "{} of {size} in {seconds:.1} s: {rate:.0} frames/s, {:.1} ms of computing a frame, {}, {}",
            count(report.frames_now(), "frame"),
            1e3 * timing.compute.median,
            count(settings.machine.threads, "thread"),
            settings.machine.level(),
        ),
        format!(
            "at work side by side: reading {:.0} %, computing {:.0} %, writing {:.0} % of the time; {} limits",
            100.0 * timing.busy.decode,
            100.0 * timing.busy.compute,
            100.0 * timing.busy.write,
            page::limit(report)
        ),
        format!(
            "{} in {}, {}{}",
            count(found.detections, "detection"),
            count(found.frames_with_detections, "frame"),
            count(found.traces, "trace"),
            found.tracks.map_or(String::new(), |tracks| format!(", {}", count(tracks, "track")))
        ),
    ];
    if let Some(rate) = settings.false_alarms {
        let needed = (LEAST_ALARMS / rate).ceil() as usize;
        if report.frames < needed {
            lines.push(format!(
                "warning: {} cannot show {rate} false alarms a frame, which takes {needed}: their score was extrapolated",
                count(report.frames, "frame")
            ));
        }
    }
    if let Some(live) = report.live {
        let share = 100.0 * live.dropped as f64 / (live.dropped + report.frames).max(1) as f64;
        lines.push(format!(
            "live: {} dropped ({share:.0} %); rows were there {:.0} ms after their frame, at most {:.0} ms",
            count(live.dropped, "frame"),
            1e3 * live.delay.median,
            1e3 * live.delay.most,
        ));
    }
    let cuts = &report.background.cuts;
    if !cuts.is_empty() {
        let first: Vec<String> = cuts.iter().take(CUTS_NAMED).map(usize::to_string).collect();
        let more = if cuts.len() > first.len() { ", ..." } else { "" };
        let all = count(report.background.cut_count, "frame");
        lines.push(format!("the scene is cut before {all}: {}{more}", first.join(", ")));
    }
    lines.extend(warnings.iter().map(|warning| format!("warning: {}; {}", warning.text, warning.advice)));
    if report.interrupted {
        let further = match settings.checkpoint {
            Some(_) => "; --resume goes on from there",
            None => "",
        };
        lines.push(format!("interrupted: the files are complete up to there{further}"));
    }
    if found.detections == 0 && !report.interrupted {
        lines.push(match &settings.bank {
            None => format!(
                "nothing found: these parameters are tuned to {:.2} px/frame; say how fast your targets move with --speed, \
                 or look for all with --speed auto",
                settings.params.prediction.v_opt
            ),
            Some(bank) => format!("nothing found of contrast {} and more: less is allowed with --contrast", bank.contrast),
        });
    }
    let written = written(settings);
    if !written.is_empty() {
        let written: Vec<String> = written.iter().map(|path| path.display().to_string()).collect();
        lines.push(format!("wrote {}", written.join(", ")));
    }
    for line in lines {
        eprint_line(&line);
    }
}

fn written(settings: &RunSettings) -> Vec<PathBuf> {
    let mut paths = Vec::new();
    if let Destination::Folder(folder) = &settings.destination {
        for format in &settings.formats {
            paths.push(folder.join(file_of(*format)));
        }
        paths.extend(settings.tracks.csv.clone());
        paths.push(folder.join(results::CAMERA));
        paths.push(folder.join(results::RUN));
        if settings.overlay {
            paths.push(folder.join(results::STRIP));
            paths.push(folder.join(results::OVERLAY));
        }
    }
    let PictureSettings { video, report, .. } = &settings.pictures;
    paths.extend([&settings.tracks.mot, &settings.tracks.coco, video, report].into_iter().flatten().cloned());
    paths.extend(settings.dump.as_ref().map(|dump| dump.folder.clone()));
    // A run that was interrupted early has no strip yet.
    paths.retain(|path| path.exists());
    paths
}

/// `eprintln!` panics when stderr is closed; a summary is not worth that.
pub(super) fn eprint_line(line: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{line}");
}
