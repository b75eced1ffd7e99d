//! Streams that go on and on: what a detector, a tracker and the thresholds of a live run come to after very many frames.

use std::fs;

use apgstmd_core::tracking::Observation;
use apgstmd_core::{Detector, FalseAlarms, Machine, Params, Response, Size, Tracker};
use ndarray::Array2;

/// Frames of fine structure that drifts, with dark targets that cross it again and again, and noise of which no frame is
/// like another: a function of the frame's number, cheap at any of them.
pub struct Endless {
    size: Size,
    /// One turn of the ground, at twice the columns: it drifts by half a pixel a frame.
    ground: Array2<u8>,
}

/// Half side of a target, px, and columns from one to the next.
const HALF: usize = 2;
const APART: usize = 60;

impl Endless {
    /// Frames of that size.
    pub fn new(size: Size) -> Self {
        let turn = (2 * size.width).next_multiple_of(64) as f64;
        let ground = Array2::from_shape_fn((size.height, turn as usize), |(y, x)| {
            let wave = |times: f64, tilt: f64, phase: f64| {
                (std::f64::consts::TAU * (times * (x as f64 / turn) + tilt * y as f64) + phase).sin()
            };
            let coarse = wave(3.0, 0.03, 0.3) + wave(7.0, -0.05, 1.9);
            let fine = wave((turn / 13.0).round(), 0.11, 4.0) + wave((turn / 31.0).round(), -0.07, 2.2);
            (150.0 + 14.0 * coarse + 11.0 * fine) as u8
        });
        Self { size, ground }
    }

    /// Frame `t` into an array of that size.
    pub fn draw(&self, t: u64, frame: &mut [u8]) {
        let Size { height, width } = self.size;
        let turn = self.ground.ncols();
        let first = (t % turn as u64) as usize;
        for (y, row) in frame.chunks_exact_mut(width).enumerate() {
            let ground = self.ground.row(y);
            for (x, pixel) in row.iter_mut().enumerate() {
                let noise = mix(t.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (y * width + x) as u64) % 5;
                *pixel = ground[(first + 2 * x) % turn] + noise as u8;
            }
        }
        // A target in each lane, at 1 px a frame to the left or right, out of sight for a while between two crossings.
        let way = width as u64 + APART as u64;
        for (lane, top) in (4..height.saturating_sub(2 * HALF + 4)).step_by(16).enumerate() {
            let at = (t + 29 * lane as u64) % way;
            let at = if lane % 2 == 0 { at } else { way - 1 - at };
            let (left, right) = ((at as usize).saturating_sub(2 * HALF + 1), (at as usize).min(width));
            for y in top..top + 2 * HALF + 1 {
                frame[y * width..][left.min(right)..right].fill(40);
            }
        }
    }
}

/// Mixes the bits of a number.
fn mix(number: u64) -> u64 {
    let z = (number ^ (number >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z ^ (z >> 27)
}

/// How it goes after so many frames.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Frames so far.
    pub frames: u64,
    /// Frames a second of processor time since the sample before: other programs do not count.
    pub rate: f64,
    /// Memory of the process in use, bytes.
    pub resident: u64,
}

/// How far a detector that has seen very many frames is from a fresh one that has seen the last of them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Drift {
    /// Largest difference of the response, of its largest value in that frame.
    pub response: f32,
    /// Detections of the old one in the frames that were compared.
    pub detections: usize,
    /// Those of either that the other has not within a tenth of a pixel.
    pub unmatched: usize,
}

/// Frames on which both are compared.
const COMPARED: u64 = 200;

/// Frames through a detector, the thresholds and the tracker of a live run, on one thread. `sample` is told how it goes, ten
/// times; then a fresh detector sees the last `prime` frames, and both see the next.
pub fn run(size: Size, params: &Params, frames: u64, prime: u64, mut sample: impl FnMut(Sample)) -> Drift {
    let stream = Endless::new(size);
    let mut picture = Array2::zeros((size.height, size.width));
    let make = || Detector::with_options(size, params, &Machine::with_threads(1)).expect("valid parameters");
    let mut draw = |t: u64, detector: &mut Detector, response: &mut Response| {
        stream.draw(t, picture.as_slice_mut().expect("it is contiguous"));
        detector.process_into(picture.view(), response).expect("a valid frame");
    };
    let (mut old, mut alarms) = (make(), FalseAlarms::new());
    let mut tracker = Tracker::new(size, params).expect("valid parameters");
    let (mut response, mut points, mut birth_score) = (old.make_response(), Vec::new(), 0.0);
    let mut begin = processor_seconds("self").unwrap_or(0.0);
    let each = (frames / 10).max(1);
    for t in 0..frames {
        draw(t, &mut old, &mut response);
        alarms.add(&response.detections);
        if t % 10 == 0 {
            birth_score = alarms.least_score(0.1);
        }
        let seen = Observation { birth_score, ..Observation::of(t as usize, &response, old.lag()) };
        points.clear();
        tracker.process_into(&seen, &mut points);
        if (t + 1) % each == 0 {
            let now = processor_seconds("self").unwrap_or(0.0);
            sample(Sample {
                frames: t + 1,
                rate: each as f64 / (now - begin),
                resident: resident("self").unwrap_or(0),
            });
            begin = now;
        }
    }
    let mut fresh = make();
    let mut other = fresh.make_response();
    (frames.saturating_sub(prime)..frames).for_each(|t| draw(t, &mut fresh, &mut other));
    let mut drift = Drift::default();
    for t in frames..frames + COMPARED {
        draw(t, &mut old, &mut response);
        draw(t, &mut fresh, &mut other);
        let most = other.map.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
        let off = response.map.iter().zip(&other.map).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        drift.response = drift.response.max(off / most);
        drift.detections += response.detections.len();
        let alone = |a: &Response, b: &Response| {
            let near = |x: f32, y: f32| b.detections.iter().any(|found| (found.x - x).hypot(found.y - y) < 0.1);
            a.detections.iter().filter(|found| !near(found.x, found.y)).count()
        };
        drift.unmatched += alone(&response, &other) + alone(&other, &response);
    }
    drift
}

/// Memory of a process that is in use, bytes, where the system tells.
pub fn resident(process: &str) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    Some(1024 * line.trim().trim_end_matches(" kB").parse::<u64>().ok()?)
}

/// Processor time that a process has taken, where the system tells.
pub fn processor_seconds(process: &str) -> Option<f64> {
    let told = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // Behind the name: the 14th and the 15th of all, in hundredths of a second.
    let mut numbers = told.rsplit_once(')')?.1.split_whitespace().skip(11).map(str::parse::<f64>);
    Some((numbers.next()?.ok()? + numbers.next()?.ok()?) / 100.0)
}
