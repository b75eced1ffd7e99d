//! Long streams, as they come from a camera: `long [SMALL LARGE]` are frames of 32 x 24 and of 480 x 270, a million and 20,000
//! where nothing is said. Each goes through `apgstmd run` behind a pipe and through the library. Tables in Markdown; exit status 1 where
//! something grew, drifted or was timed wrongly.

use std::error::Error;
use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, Write};
use std::path::Path;
use std::process::{Command, ExitCode, Stdio};

use apgstmd_core::{Params, Preset, Size};
use apgstmd_tests::long::{Endless, Sample, processor_seconds, resident, run};

type Outcome<T = ()> = Result<T, Box<dyn Error>>;

/// Of a program whose memory is flat: what allocators and statistics with logarithmic growth come to.
const GROWTH: u64 = 4 << 20;
/// Frames after which a fresh detector knows what an old one knows.
const PRIME: u64 = 3000;
/// Largest difference of both, of the largest response: rounding.
const DRIFT: f32 = 1e-4;
/// Slowest tenth of a run beside its median, in processor time, which other programs disturb through caches alone.
const SLOW: f64 = 0.5;
/// Milliseconds that 32 bits can count.
const FULL: f64 = (1u64 << 32) as f64 / 1e3;

fn main() -> ExitCode {
    // The program itself, so that it has a process of its own.
    if std::env::args().nth(1).as_deref() == Some("run") {
        return apgstmd_cli::main_with(std::env::args_os()).into();
    }
    match measure() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn measure() -> Outcome<bool> {
    let numbers: Vec<u64> = std::env::args().skip(1).map(|word| word.parse()).collect::<Result<_, _>>()?;
    let (small, large) = match numbers[..] {
        [] => (1_000_000, 20_000),
        [small, large] => (small, large),
        _ => return Err("usage: long [SMALL LARGE], numbers of frames".into()),
    };
    let mut good = true;
    println!(
        "| what | frames | memory after a tenth, MiB | at the end | frames a second of processor time: first tenth | slowest | last |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|");
    let (tiny, usual) = (Size::new(24, 32), Size::new(270, 480));
    // So slow that the last frames come after the 2^32nd millisecond.
    let seconds = (1.1 * FULL / small as f64).ceil() as u64;
    for (what, size, frames, flags) in
        [("run, a bank of two", tiny, small, "--speeds 1,2 --sizes 5"), ("run --speed 1", usual, large, "--speed 1")]
    {
        good &= row(what, size, &program(size, frames, seconds, flags)?);
    }
    let params = Params::preset(Preset::Practical).for_speed(1.0)?;
    let mut drifts = Vec::new();
    for (size, frames) in [(tiny, small), (usual, large)] {
        let mut samples = Vec::new();
        let drift = run(size, &params, frames, PRIME.min(frames / 2), |sample| samples.push(sample));
        good &= row("detector, thresholds, tracker", size, &samples) && drift.response <= DRIFT;
        drifts.push((size, frames, drift));
    }
    println!(
        "\n| size | frames | a fresh detector after {PRIME} frames: difference of the response | detections | not where the other has one |"
    );
    println!("|---|---:|---:|---:|---:|");
    for (size, frames, drift) in drifts {
        let Size { height, width } = size;
        let (off, detections, unmatched) = (drift.response, drift.detections, drift.unmatched);
        println!("| {width} x {height} | {frames} | {off:.1e} | {detections} | {unmatched} |");
    }
    Ok(good)
}

/// Prints the samples; whether they are flat.
fn row(what: &str, size: Size, samples: &[Sample]) -> bool {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return false };
    let mut rates: Vec<f64> = samples.iter().map(|sample| sample.rate).collect();
    rates.sort_by(f64::total_cmp);
    let (slowest, median) = (rates[0], rates[rates.len() / 2]);
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    println!(
        "| {what}, {} x {} | {} | {:.1} | {:.1} | {:.0} | {slowest:.0} | {:.0} |",
        size.width,
        size.height,
        last.frames,
        mib(first.resident),
        mib(last.resident),
        first.rate,
        last.rate
    );
    last.resident < first.resident + GROWTH && slowest > SLOW * median
}

/// Frames through a pipe into `apgstmd run`, so many seconds of their own time apart.
fn program(size: Size, frames: u64, seconds: u64, flags: &str) -> Outcome<Vec<Sample>> {
    let place = tempfile::tempdir()?;
    let out = place.path().join("out");
    let mut command = Command::new(std::env::current_exe()?);
    let raw = format!("{}x{}", size.width, size.height);
    command.args([
        "run",
        "-",
        "--raw",
        &raw,
        "--threads",
        "1",
        "--quiet",
        "--fps",
        &(1.0 / seconds as f64).to_string(),
        "--out",
    ]);
    let mut child = command.arg(&out).args(flags.split_whitespace()).stdin(Stdio::piped()).spawn()?;
    let mut pipe = BufWriter::new(child.stdin.take().ok_or("it has no standard input")?);
    let process = child.id().to_string();
    let stream = Endless::new(size);
    let mut frame = vec![0; size.height * size.width];
    let (mut samples, mut begin, each) = (Vec::new(), 0.0, (frames / 10).max(1));
    for t in 0..frames {
        stream.draw(t, &mut frame);
        pipe.write_all(&frame)?;
        // The last frames are still on their way when the others have gone.
        if (t + 1) % each == 0 {
            let now = processor_seconds(&process).unwrap_or(0.0);
            let rate = each as f64 / (now - begin);
            samples.push(Sample { frames: t + 1, rate, resident: resident(&process).unwrap_or(0) });
            begin = now;
        }
    }
    drop(pipe);
    if !child.wait()?.success() {
        return Err("apgstmd run failed".into());
    }
    timed(&out.join("camera.csv"), frames, seconds)?;
    Ok(samples)
}

/// Every frame has its row, and the time that it should.
fn timed(camera: &Path, frames: u64, seconds: u64) -> Outcome {
    let mut lines = BufReader::new(File::open(camera)?).lines();
    lines.next().ok_or("camera.csv has no head")??;
    for frame in 0..frames {
        let line = lines.next().ok_or("camera.csv is too short")??;
        let mut cells = line.split(',');
        let (number, time) = (cells.next().map(str::parse::<u64>), cells.next().map(str::parse::<f64>));
        let expected = frame * seconds;
        if number != Some(Ok(frame)) || time != Some(Ok(expected as f64)) {
            return Err(format!("frame {frame} should come at {expected} s, but its row is {line}").into());
        }
    }
    match lines.next() {
        None => Ok(()),
        Some(_) => Err("camera.csv has more rows than there were frames".into()),
    }
}
