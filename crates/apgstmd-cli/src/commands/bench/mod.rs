//! `apgstmd bench`: how fast the detector is on this machine, and how near to what the machine could give.

mod cost;
mod measure;
mod peak;
mod plot;
mod scaling;
mod scene;
mod table;

use std::fs;
use std::num::NonZero;

use apgstmd_core::{Machine, Params, SimdLevel, Size};
use serde::Serialize;

use self::measure::{Measured, Subject, measure, warm_up};
use self::peak::Peak;
use self::scene::{Clip, TARGETS};
use super::pipeline::progress_bar;
use super::print;
use crate::Outcome;
use crate::args::{BenchArgs, ModelArg, ModelArgs, Speed};
use crate::failure::Failure;
use crate::interrupt;
use crate::settings::{resolve_params, resolve_threads};
use crate::sink::beside;

/// Raised when a field changes its meaning or goes away.
const SCHEMA_VERSION: u32 = 1;

/// Everything, as JSON has it.
#[derive(Serialize)]
struct Record<'a> {
    schema_version: u32,
    program: &'static str,
    version: &'static str,
    label: Option<&'a str>,
    cpu: String,
    cores: usize,
    peaks: Vec<Peak>,
    runs: Vec<Measured>,
}

pub(crate) fn main(args: BenchArgs) -> Outcome {
    if args.frames == 0 {
        return Err(Failure::usage("--frames is 0, but there must be at least 1 to measure"));
    }
    interrupt::listen();
    if let Some(folder) = &args.scaling {
        let params = params(&args, None)?;
        let largest = args.largest.unwrap_or(scaling::LARGEST);
        return scaling::run(folder, &params, args.speed, args.frames, largest);
    }
    let subjects = subjects(&args)?;
    let bar = progress_bar(Some(subjects.len() * args.frames), false);
    let mut runs = Vec::with_capacity(subjects.len());
    let mut clip: Option<(Size, Clip)> = None;
    for subject in &subjects {
        let ready = clip.take().filter(|(size, _)| *size == subject.size);
        let (_, ready) = match ready {
            Some(ready) => clip.insert(ready),
            None => {
                let wanted = args.frames + warm_up(&subject.params);
                clip.insert((subject.size, Clip::new(subject.size, args.speed, TARGETS, wanted)?))
            }
        };
        runs.push(measure(subject, ready, &bar)?);
    }
    bar.finish_and_clear();
    let mut threads: Vec<usize> = subjects.iter().map(|subject| subject.machine.threads).collect();
    threads.sort_unstable();
    threads.dedup();
    let record = Record {
        schema_version: SCHEMA_VERSION,
        program: "apgstmd",
        version: env!("CARGO_PKG_VERSION"),
        label: args.label.as_deref(),
        cpu: cpu(),
        cores: cores(),
        peaks: threads.into_iter().map(Peak::measure).collect(),
        runs,
    };
    let json = serde_json::to_string_pretty(&record).map_err(Failure::failed)? + "\n";
    if let Some(path) = &args.out {
        beside::write(path, &json)?;
    }
    print(&if args.json { json } else { table::text(&record) })
}

/// Every combination of the lists.
fn subjects(args: &BenchArgs) -> Outcome<Vec<Subject>> {
    let threads = match &args.threads[..] {
        [] => vec![resolve_threads(None)?],
        threads => threads.iter().map(|&threads| resolve_threads(Some(threads))).collect::<Outcome<_>>()?,
    };
    let levels: Vec<Option<SimdLevel>> =
        if args.simd.is_empty() { vec![None] } else { args.simd.iter().copied().map(Some).collect() };
    let models: Vec<Option<ModelArg>> =
        if args.model.is_empty() { vec![None] } else { args.model.iter().copied().map(Some).collect() };
    let mut subjects = Vec::new();
    for &size in &args.size {
        for &model in &models {
            let params = params(args, model)?;
            for &simd in &levels {
                for &threads in &threads {
                    let machine = Machine { threads, simd, ..Machine::default() };
                    subjects.push(Subject { size, params: params.clone(), machine, frames: args.frames });
                }
            }
        }
    }
    Ok(subjects)
}

fn params(args: &BenchArgs, model: Option<ModelArg>) -> Outcome<Params> {
    resolve_params(&ModelArgs {
        model,
        preset: args.preset,
        speed: Some(Speed::PerFrame(args.speed)),
        rejection: args.rejection,
        ..ModelArgs::default()
    })
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, NonZero::get)
}

/// Its name where the system tells, else the architecture.
fn cpu() -> String {
    let info = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let named = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    named.map_or(std::env::consts::ARCH, |(_, name)| name.trim()).to_owned()
}
