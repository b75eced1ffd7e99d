//! `apgstmd reproduce`: the experiments of the paper, computed, drawn and judged.

use std::io::{self, Write};
use std::path::Path;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

use crate::Outcome;
use crate::args::ReproduceArgs;
use crate::failure::Failure;
use crate::interrupt;
use crate::reproduce::folder::{Folder, PAGE, SUMMARY, Written};
use crate::reproduce::page::page;
use crate::reproduce::summary::Run;
use crate::reproduce::{Bench, EXPERIMENTS, Experiment, Extent};
use crate::settings::resolve_threads;

pub(crate) fn main(args: ReproduceArgs) -> Outcome {
    if args.list {
        return print(&list());
    }
    let threads = resolve_threads(args.threads)?;
    let chosen = choose(&args.names)?;
    let folder = Folder::new(args.out.clone());
    folder.check(args.force)?;
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| Failure::failed(format_args!("could not start {threads} threads: {error}")))?;
    interrupt::listen();
    folder.prepare()?;

    let begin = Instant::now();
    let extent = if args.quick { Extent::Quick } else { Extent::Full };
    let bar = progress_bar(args.quiet);
    let bench = Bench::new(extent, bar.clone());
    // Each is written as soon as it is done: what an interrupted run leaves is complete in itself.
    let written: Mutex<Vec<(usize, Written)>> = Mutex::new(Vec::new());
    let outcome = pool.install(|| {
        chosen.par_iter().enumerate().try_for_each(|(place, experiment)| {
            let kept = folder.keep(bench.run(experiment)?)?;
            written.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push((place, kept));
            Ok(())
        })
    });
    bar.finish_and_clear();
    let interrupted = matches!(outcome, Err(Failure::Interrupted));
    if !interrupted {
        outcome?;
    }
    let mut written = written.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    written.sort_by_key(|(place, _)| *place);
    let written = written.into_iter().map(|(_, written)| written).collect();
    let run = Run { extent, threads, seconds: begin.elapsed().as_secs_f64(), interrupted, written };
    folder.write(SUMMARY, run.json())?;
    folder.write(PAGE, page(&run))?;
    if !args.quiet {
        print(&format!("{}\n{}\npage  {}\n", run.table(), run.verdict(), folder.file(PAGE).display()))?;
    }
    verdict(&run)
}

/// What is wrong with a run, if anything is.
fn verdict(run: &Run) -> Outcome {
    match run.failing()[..] {
        _ if run.interrupted => Err(Failure::Interrupted),
        [] => Ok(()),
        ref failing => Err(Failure::failed(format_args!("not as it must be: {}", failing.join(", ")))),
    }
}

/// The experiments of these names, each once, in the table's order.
fn choose(names: &[String]) -> Outcome<Vec<&'static Experiment>> {
    for name in names.iter().filter(|name| *name != "all") {
        if !EXPERIMENTS.iter().any(|experiment| experiment.name == name) {
            return Err(unknown(name));
        }
    }
    let all = names.is_empty() || names.iter().any(|name| name == "all");
    Ok(EXPERIMENTS.iter().filter(|experiment| all || names.iter().any(|name| name == experiment.name)).collect())
}

fn unknown(name: &str) -> Failure {
    let names: Vec<&str> = EXPERIMENTS.iter().map(|experiment| experiment.name).collect();
    let likeness = |other: &str| strsim::jaro_winkler(name, other);
    let nearest = names.iter().max_by(|a, b| likeness(a).total_cmp(&likeness(b))).filter(|near| likeness(near) > 0.7);
    let failure = Failure::usage(format_args!("there is no experiment `{name}`: there are {}", names.join(", ")));
    match nearest {
        Some(nearest) => failure.hint(format_args!("perhaps `{nearest}` is meant")),
        None => failure.hint("`apgstmd reproduce --list` says what each shows"),
    }
}

fn list() -> String {
    let width = EXPERIMENTS.iter().map(|experiment| experiment.name.len()).max().unwrap_or(0);
    EXPERIMENTS.iter().map(|experiment| format!("{:<width$}  {}\n", experiment.name, experiment.title)).collect()
}

/// Counts frames, on stderr and only where that is a terminal; the length grows as experiments begin.
fn progress_bar(quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:32.cyan/blue} {pos}/{len} frames, {elapsed}, {eta} left");
    let bar = ProgressBar::new(0).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

fn print(text: &str) -> Outcome {
    let mut stdout = io::stdout().lock();
    stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
        .map_err(|error| Failure::write(Path::new("stdout"), error))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Figure;
    use crate::reproduce::bench::Done;
    use crate::reproduce::{Check, Findings, Wanted};

    #[test]
    fn a_number_that_is_not_as_it_must_be_fails_the_command() {
        let run = |measured: f64, interrupted: bool| {
            let checks = vec![Check::new("a number", measured, "px", Wanted::Below(2.0))];
            let findings = Findings { tables: vec![], figure: Figure::default(), checks };
            let done = Done { experiment: &EXPERIMENTS[0], findings, time: Duration::ZERO };
            let written = vec![Written { done, files: vec![], svg: String::new() }];
            verdict(&Run { extent: Extent::Quick, threads: 1, seconds: 0.0, interrupted, written })
        };
        assert!(run(1.0, false).is_ok());
        // `Failed` is exit code 1.
        let failure = run(3.0, false).unwrap_err();
        assert!(matches!(failure, Failure::Failed(_)));
        assert_eq!(failure.text().unwrap(), format!("not as it must be: {}", EXPERIMENTS[0].name));
        for measured in [1.0, 3.0] {
            assert!(matches!(run(measured, true), Err(Failure::Interrupted)));
        }
    }

    #[test]
    fn names() {
        let chosen = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
            choose(&names).map(|chosen| chosen.iter().map(|experiment| experiment.name).collect::<Vec<_>>())
        };
        assert_eq!(chosen(&[]).unwrap().len(), EXPERIMENTS.len());
        assert_eq!(chosen(&["all", "kernels"]).unwrap().len(), EXPERIMENTS.len());
        assert_eq!(chosen(&["width-tuning", "kernels", "kernels"]).unwrap(), ["kernels", "width-tuning"]);
        assert!(chosen(&["kernel"]).is_err());
    }
}
