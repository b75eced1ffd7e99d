//! `apgstmd synth`: a scene to pictures and truth.

use std::io::{self, Write};
use std::panic::resume_unwind;
use std::path::Path;
use std::thread;

use apgstmd_core::stimulus::{Renderer, Scene, Truth};

use super::pipeline::progress_bar;
use super::print;
use super::verdict::speed_of_targets;
use crate::Outcome;
use crate::args::SynthArgs;
use crate::failure::Failure;
use crate::interrupt;
use crate::settings::resolve_threads;
use crate::sink::scene_folder::{SceneFolder, scene_text};
use crate::source::{Overrides, SceneFile, is_scene};

const EXAMPLE: &str = include_str!("example_scene.toml");

pub(crate) fn main(args: SynthArgs) -> Outcome {
    let threads = resolve_threads(args.threads)?;
    let overrides = Overrides { frames: args.frames, seed: args.seed };
    let file = match &args.scene {
        Some(path) if !is_scene(path) => {
            return Err(Failure::usage(format_args!("{} is no scene: its name must end in .toml", path.display()))
                .hint("`apgstmd synth --print > scene.toml` writes an example to start from"));
        }
        Some(path) => SceneFile::read_with(path, overrides)?,
        None if args.demo => SceneFile::new(Scene::demo(), Path::new("demo"), overrides)?,
        None if args.paper => SceneFile::new(Scene::paper(), Path::new("paper"), overrides)?,
        None if args.print => SceneFile::parse(EXAMPLE, Path::new("example"), overrides)?,
        None => {
            return Err(Failure::usage("there is no scene to draw: give SCENE.toml, --demo or --paper")
                .hint("`apgstmd synth --print > scene.toml` writes an example to start from"));
        }
    };
    if args.print {
        let as_written =
            args.scene.is_none() && !args.demo && !args.paper && args.frames.is_none() && args.seed.is_none();
        return print(&if as_written { EXAMPLE.to_owned() } else { scene_text(file.scene()) });
    }
    let Some(out) = args.out else {
        return Err(Failure::usage("--out is missing: name the folder that the pictures go to"));
    };
    if !matches!(args.bit_depth, 8 | 16) {
        return Err(Failure::usage(format_args!("--bit-depth is {}, but it must be 8 or 16", args.bit_depth)));
    }
    let mut folder = SceneFolder::new(out.clone(), args.bit_depth == 16);
    folder.check(args.force)?;
    interrupt::listen();
    let truth = render(file.renderer(), &mut folder, threads, args.quiet)?;
    if !args.quiet {
        summarise(file.scene(), &truth, &out);
    }
    Ok(())
}

/// Frames are independent: each thread draws and writes its own, the truth follows in order.
fn render(renderer: &Renderer, folder: &mut SceneFolder, threads: usize, quiet: bool) -> Outcome<Vec<Truth>> {
    let frames = renderer.scene().frames;
    folder.begin(renderer.scene())?;
    let bar = progress_bar(Some(frames), quiet);
    let mut truth = Vec::new();
    for first in (0..frames).step_by(threads) {
        if interrupt::asked() {
            bar.finish_and_clear();
            if !quiet {
                // A closed stderr has nobody to tell.
                let _ = writeln!(io::stderr(), "interrupted: {first} frames and their truth are complete");
            }
            return Err(Failure::Interrupted);
        }
        let batch = first..frames.min(first + threads);
        let width = batch.len() as u64;
        let drawing: &SceneFolder = folder;
        let drawn: Vec<Outcome<Vec<Truth>>> = thread::scope(|scope| {
            let workers: Vec<_> =
                batch.map(|frame| scope.spawn(move || drawing.write_frame(renderer, frame))).collect();
            workers.into_iter().map(|worker| worker.join().unwrap_or_else(|panic| resume_unwind(panic))).collect()
        });
        for rows in drawn {
            let rows = rows?;
            folder.write_truth(&rows)?;
            truth.extend(rows);
        }
        bar.inc(width);
    }
    bar.finish_and_clear();
    Ok(truth)
}

/// On stderr: stdout is for data.
fn summarise(scene: &Scene, truth: &[Truth], out: &Path) {
    let Scene { width, height, frames, .. } = scene;
    let visible = truth.iter().filter(|row| row.visible).count();
    let out = out.display();
    let speed = speed_of_targets(truth);
    let flag = if speed > 0.0 { format!(" --speed {speed}") } else { String::new() };
    // A closed stderr has nobody to tell.
    let _ = writeln!(
        io::stderr(),
        "{frames} frame{} of {height} x {width} (height x width), {visible} visible targets in all\n\
         wrote {out}: pictures, truth.csv, scene.toml\n\
         next: apgstmd run {out}{flag} --out found; apgstmd eval found {out}",
        if *frames == 1 { "" } else { "s" },
    );
}
