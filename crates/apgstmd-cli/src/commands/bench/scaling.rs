//! How time grows: with threads, pixels, active tiles and instruction sets. A CSV and an SVG each.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use apgstmd_core::params::RejectionMode;
use apgstmd_core::{Machine, Params, SimdLevel, Size};
use indicatif::ProgressBar;
use plotters::prelude::SeriesLabelPosition::{LowerRight, UpperLeft, UpperRight};

use super::cores;
use super::measure::{Measured, Subject, measure, warm_up};
use super::plot::{Figure, Scale, Series, bars};
use super::scene::{Clip, TARGETS};
use crate::Outcome;
use crate::commands::pipeline::progress_bar;
use crate::failure::Failure;

/// The largest size that is measured unless asked otherwise.
pub(super) const LARGEST: Size = Size::new(2160, 3840);
const USUAL: Size = Size::new(270, 480);
const LARGE: Size = Size::new(1080, 1920);
/// 16 : 9, from 120 to 2160 rows.
const SIZES: [Size; 9] = [
    Size::new(120, 214),
    Size::new(180, 320),
    USUAL,
    Size::new(360, 640),
    Size::new(540, 960),
    Size::new(720, 1280),
    LARGE,
    Size::new(1440, 2560),
    LARGEST,
];
const TARGET_COUNTS: [usize; 8] = [0, 1, 2, 4, 8, 16, 32, 64];
/// Large frames are measured for as long as small ones, but at least so many of them.
const FEWEST: usize = 20;

const CSV_HEADER: &str = "curve,width,height,threads,simd,rejection,targets,frames,ms_p50,ms_p99,frames_per_second,\
                          ns_per_pixel,predicted_tiles,attended_tiles,inhibited_tiles,memory_resident_bytes\n";

/// Measures all curves into `folder`, on frames of no more pixels than `largest`.
///
/// # Errors
/// Ctrl-C, a folder that cannot be written to.
pub(super) fn run(folder: &Path, params: &Params, speed: f64, frames: usize, largest: Size) -> Outcome {
    fs::create_dir_all(folder).map_err(|error| Failure::write(folder, error))?;
    let usual = if USUAL.area() > largest.area() { largest } else { USUAL };
    let bar = progress_bar(None, false);
    let lab = Lab { folder, params, speed, frames, usual, largest, bar: &bar };
    let outcome = lab
        .threads()
        .and_then(|()| lab.pixels())
        .and_then(|()| lab.active_tiles())
        .and_then(|()| lab.instruction_sets());
    bar.finish_and_clear();
    outcome
}

struct Lab<'a> {
    folder: &'a Path,
    params: &'a Params,
    speed: f64,
    frames: usize,
    usual: Size,
    largest: Size,
    bar: &'a ProgressBar,
}

/// A point of a curve.
struct Point {
    curve: String,
    targets: usize,
    measured: Measured,
}

impl Lab<'_> {
    fn clip(&self, size: Size, targets: usize) -> Outcome<Clip> {
        Clip::new(size, self.speed, targets, self.frames_of(size) + warm_up(self.params))
    }

    fn measure(&self, clip: &Clip, size: Size, params: &Params, machine: Machine) -> Outcome<Measured> {
        measure(&Subject { size, params: params.clone(), machine, frames: self.frames_of(size) }, clip, self.bar)
    }

    fn frames_of(&self, size: Size) -> usize {
        (self.frames * USUAL.area() / size.area()).clamp(FEWEST.min(self.frames), self.frames)
    }

    fn fits(&self, size: Size) -> bool {
        size.area() <= self.largest.area()
    }

    fn threads(&self) -> Outcome {
        let mut points = Vec::new();
        for size in [self.usual, LARGE].into_iter().filter(|size| self.fits(*size)) {
            let clip = self.clip(size, TARGETS)?;
            for threads in thread_counts(cores()) {
                let measured = self.measure(&clip, size, self.params, Machine::with_threads(threads))?;
                points.push(Point { curve: format!("{} x {}", size.width, size.height), targets: TARGETS, measured });
            }
        }
        let speed_up = |points: &[&Point]| {
            let alone = points[0].measured.ms();
            points.iter().map(|p| (p.measured.threads as f64, alone / p.measured.ms())).collect()
        };
        let mut series = series(&points, speed_up);
        let most = cores() as f64;
        series.push(Series { name: "ideal".to_owned(), points: vec![(1.0, 1.0), (most, most)], ideal: true });
        let figure = Figure { x: "threads", y: "times as fast as one", scale: Scale::Whole, names: LowerRight, series };
        self.write("threads", &points, &figure.svg())
    }

    fn pixels(&self) -> Outcome {
        let mut counts = vec![1, cores()];
        counts.dedup();
        let mut points = Vec::new();
        for size in SIZES.into_iter().filter(|size| self.fits(*size)) {
            let clip = self.clip(size, TARGETS)?;
            for &threads in &counts {
                let measured = self.measure(&clip, size, self.params, Machine::with_threads(threads))?;
                points.push(Point { curve: threads_text(threads), targets: TARGETS, measured });
            }
        }
        let cost = |points: &[&Point]| points.iter().map(|p| (pixels(p) / 1e6, ns_per_pixel(p))).collect();
        let series = series(&points, cost);
        let figure = Figure { x: "megapixels", y: "ns a pixel", scale: Scale::Logarithmic, names: UpperRight, series };
        self.write("pixels", &points, &figure.svg())
    }

    /// More targets, more tiles in which something is predicted; without rejection, nearly all of them.
    fn active_tiles(&self) -> Outcome {
        let mut everything = self.params.clone();
        everything.rejection.mode = RejectionMode::Off;
        let mut points = Vec::new();
        for targets in TARGET_COUNTS {
            let clip = self.clip(self.usual, targets)?;
            let measured = self.measure(&clip, self.usual, self.params, Machine::default())?;
            points.push(Point { curve: "rejection motion".to_owned(), targets, measured });
        }
        let clip = self.clip(self.usual, TARGETS)?;
        let measured = self.measure(&clip, self.usual, &everything, Machine::default())?;
        points.push(Point { curve: "rejection off".to_owned(), targets: TARGETS, measured });
        let time = |points: &[&Point]| {
            let mut line: Vec<_> = points.iter().map(|p| (100.0 * p.measured.predicted(), p.measured.ms())).collect();
            line.sort_by(|a, b| a.0.total_cmp(&b.0));
            line
        };
        let series = series(&points, time);
        let figure =
            Figure { x: "% of tiles predicted in", y: "ms a frame", scale: Scale::Linear, names: UpperLeft, series };
        self.write("tiles", &points, &figure.svg())
    }

    fn instruction_sets(&self) -> Outcome {
        let clip = self.clip(self.usual, TARGETS)?;
        let mut points = Vec::new();
        for level in SimdLevel::available() {
            let machine = Machine { simd: Some(level), ..Machine::default() };
            let measured = self.measure(&clip, self.usual, self.params, machine)?;
            points.push(Point { curve: "instruction set".to_owned(), targets: TARGETS, measured });
        }
        let values: Vec<_> = points.iter().map(|p| (p.measured.simd, p.measured.ms())).collect();
        self.write("simd", &points, &bars("ms a frame", &values))
    }

    fn write(&self, name: &str, points: &[Point], svg: &str) -> Outcome {
        let csv = CSV_HEADER.to_owned() + &points.iter().map(row).collect::<String>();
        for (ending, text) in [("csv", &*csv), ("svg", svg)] {
            let path = self.folder.join(format!("{name}.{ending}"));
            fs::write(&path, text).map_err(|error| Failure::write(&path, error))?;
            // A closed stderr has nobody to tell.
            let _ = writeln!(io::stderr(), "wrote {}", path.display());
        }
        Ok(())
    }
}

/// One for each name, in the order in which they first come.
fn series(points: &[Point], line: impl Fn(&[&Point]) -> Vec<(f64, f64)>) -> Vec<Series> {
    let mut names: Vec<&str> = Vec::new();
    for point in points {
        if !names.contains(&&*point.curve) {
            names.push(&point.curve);
        }
    }
    let of = |name: &str| points.iter().filter(|point| point.curve == name).collect::<Vec<_>>();
    names.iter().map(|name| Series { name: (*name).to_owned(), points: line(&of(name)), ideal: false }).collect()
}

fn row(Point { curve, targets, measured }: &Point) -> String {
    let m = measured;
    let active = |name: &str| m.stages.iter().find(|stage| stage.name == name).map_or(0.0, |stage| stage.active);
    format!(
        "{curve},{},{},{},{},{},{targets},{},{:.4},{:.4},{:.1},{:.3},{:.4},{:.4},{:.4},{}\n",
        m.width,
        m.height,
        m.threads,
        m.simd,
        format!("{:?}", m.rejection).to_lowercase(),
        m.frames,
        m.latency_ms.p50,
        m.latency_ms.p99,
        m.frames_per_second,
        1e6 * m.ms() / (m.width * m.height) as f64,
        m.predicted(),
        active("attention"),
        active("lobula"),
        m.memory_bytes.resident,
    )
}

fn pixels(point: &Point) -> f64 {
    (point.measured.width * point.measured.height) as f64
}

fn ns_per_pixel(point: &Point) -> f64 {
    1e6 * point.measured.ms() / pixels(point)
}

fn threads_text(threads: usize) -> String {
    format!("{threads} thread{}", if threads == 1 { "" } else { "s" })
}

/// All up to eight, then twice as many each time, and the number of cores.
fn thread_counts(cores: usize) -> Vec<usize> {
    const EACH: usize = 8;
    let doubled = std::iter::successors(Some(2 * EACH), |n| Some(2 * n)).take_while(|n| *n < cores);
    let mut counts: Vec<usize> = (1..=cores.min(EACH)).chain(doubled).chain([cores]).collect();
    counts.dedup();
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thread_counts_end_with_the_cores() {
        assert_eq!(thread_counts(1), [1]);
        assert_eq!(thread_counts(2), [1, 2]);
        assert_eq!(thread_counts(8), [1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(thread_counts(24), [1, 2, 3, 4, 5, 6, 7, 8, 16, 24]);
    }
}
