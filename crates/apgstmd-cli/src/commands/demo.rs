//! `apgstmd demo`: a made-up scene, detected frame by frame as it is drawn, and judged against its truth.

use std::fs;
use std::path::Path;

use apgstmd_core::evaluation::{Scored, TruthBox};
use apgstmd_core::stimulus::{Renderer, Scene, Truth};
use apgstmd_core::{Machine, Params, Preset};

use super::pipeline::{Options, Report, drive};
use super::print;
use super::verdict::{Verdict, speed_of_targets};
use crate::Outcome;
use crate::args::{DemoArgs, OnError};
use crate::failure::Failure;
use crate::interrupt;
use crate::settings::{readers, resolve_threads};
use crate::sink::overlay::Overlay;
use crate::sink::results::{self, Results};
use crate::sink::run_json::{Input, RunRecord, SCHEMA_VERSION, processor_seconds};
use crate::sink::table::{Csv, Target};
use crate::sink::{Seen, Sink};
use crate::source::{FrameSource, SceneFrames, Selection, Span};

pub(crate) fn main(args: DemoArgs) -> Outcome {
    let threads = resolve_threads(args.threads)?;
    let results = Results::new(args.out.clone(), None);
    results.check(args.force || holds_a_demo(&args.out))?;
    let mut scene = Scene::demo();
    scene.seed = args.seed.unwrap_or(scene.seed);
    let renderer = Renderer::new(&scene).map_err(Failure::usage)?;
    let truth: Vec<Truth> = (0..scene.frames).flat_map(|t| renderer.truth(t)).collect();
    let speed = speed_of_targets(&truth);
    let params = Params::preset(Preset::Practical).for_speed(speed).map_err(Failure::failed)?;

    interrupt::listen();
    let mut found = Vec::new();
    let machine = Machine::with_threads(threads);
    let options = Options {
        params: &params,
        bank: None,
        false_alarms: None,
        machine,
        look_in: None,
        on_error: OnError::Stop,
        dump: None,
        tracks: false,
        response: false,
        quiet: args.quiet,
        live: false,
        span: Span::ALL,
        checkpoints: None,
    };
    let all = Selection::all(scene.frames);
    let sources = all.turns(readers(threads));
    let sources = sources.map(|part| Box::new(SceneFrames::new(&renderer, part)) as Box<dyn FrameSource>).collect();
    let report = drive(sources, &options, None, |_| {
        results.prepare()?;
        let frames: Vec<usize> = (0..scene.frames).collect();
        Ok(vec![
            Box::new(Csv::new(Target::file(&args.out.join(results::CSV))?)?) as Box<dyn Sink + '_>,
            Box::new(Overlay::new(&args.out, "demo scene".to_owned(), Some(&frames), false, None)?),
            Box::new(Collect(&mut found)),
        ])
    });
    if let Some(failure) = report.failure {
        return Err(failure);
    }
    if report.interrupted {
        return Err(Failure::Interrupted);
    }

    let boxes: Vec<TruthBox> = truth.iter().map(|row| TruthBox::from(*row)).collect();
    let verdict = Verdict::new(&found, &truth, &boxes, scene.frames).map_err(Failure::failed)?;
    let text = summary(&scene, &report, &verdict, speed, threads);
    let path = args.out.join(results::SUMMARY);
    fs::write(&path, &text).map_err(|error| Failure::write(&path, error))?;
    write_record(&scene, &report, &verdict, &params, speed, threads, &args.out)?;
    if args.quiet { Ok(()) } else { show(&text, &args.out) }
}

/// A folder that an earlier demo filled may be filled again.
fn holds_a_demo(folder: &Path) -> bool {
    let text = fs::read_to_string(folder.join(results::RUN)).unwrap_or_default();
    let record: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    record["program"] == "apgstmd" && record["command"] == "demo"
}

/// Keeps all detections for the verdict.
struct Collect<'a>(&'a mut Vec<Scored>);

impl Sink for Collect<'_> {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        self.0.extend(seen.detections.iter().map(|d| Scored {
            frame: seen.frame,
            x: f64::from(d.x),
            y: f64::from(d.y),
            score: f64::from(d.score),
            direction: Some(f64::from(d.direction)).filter(|direction| direction.is_finite()),
        }));
        Ok(())
    }
}

fn summary(scene: &Scene, report: &Report, verdict: &Verdict, speed: f64, threads: usize) -> String {
    format!(
        "{} targets before a moving background: {} frames of {} x {} px, seed {}, made on the fly\n\
         practical preset for {speed:.2} px/frame, {threads} thread{}: {:.1} s, {:.1} ms of computing a frame\n\n{}",
        scene.targets.len(),
        report.frames,
        scene.width,
        scene.height,
        scene.seed,
        if threads == 1 { "" } else { "s" },
        report.wall.as_secs_f64(),
        1e3 * report.timing().compute.median,
        verdict.table(),
    )
}

fn write_record(
    scene: &Scene,
    report: &Report,
    verdict: &Verdict,
    params: &Params,
    speed: f64,
    threads: usize,
    folder: &Path,
) -> Outcome {
    let Some(size) = report.size else { return Ok(()) };
    let record = RunRecord {
        schema_version: SCHEMA_VERSION,
        program: "apgstmd",
        version: env!("CARGO_PKG_VERSION"),
        command: "demo",
        input: Input {
            path: format!("the built-in scene, seed {}", scene.seed),
            pictures: scene.frames,
            start: 0,
            stop: scene.frames,
            step: 1,
            left_out: String::new(),
            frames_left_out: 0,
            fps: Some(scene.rate),
            bit_depth: None,
            scene: Some(scene),
        },
        size: size.into(),
        threads,
        simd: Machine::default().level().name(),
        frames: report.frames,
        resumed_after: None,
        settings_sha256: None,
        live: None,
        skipped: report.skipped.listed(),
        frames_skipped: report.skipped.count(),
        interrupted: false,
        error: None,
        found: report.found,
        background: &report.background,
        seconds_per_frame: report.timing(),
        stage_seconds_per_frame: report.stage_seconds(),
        warnings: &report.warnings,
        seconds: report.wall.as_secs_f64(),
        processor_seconds: processor_seconds(),
        speed: Some(speed),
        threshold: None,
        region: None,
        bank: None,
        params,
        evaluation: Some(serde_json::to_value(verdict).map_err(Failure::failed)?),
    };
    record.write(&folder.join(results::RUN))
}

fn show(text: &str, folder: &Path) -> Outcome {
    let place = |name: &str| folder.join(name).display().to_string();
    print(&format!(
        "{text}\nannotated frames  {}\ndetections        {}\nsummary           {}, {}\n",
        place(results::STRIP),
        place(results::CSV),
        place(results::SUMMARY),
        place(results::RUN),
    ))
}
