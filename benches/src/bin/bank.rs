//! What a bank costs beside a detector of one speed: `bank [WIDTHxHEIGHT] [threads] [frames] [speeds]`, before clutter that
//! moves. A detector of 1 px/frame and a bank of several speeds (0.5,1,2,4) take each frame in turn, both with as many threads, so
//! that whatever else runs on the machine meets both.
//!
//! One line: of each the shortest and the mean time of a frame, and the ratio of the means, which slow members, that are not due
//! in each frame, have a part in. With one thread also the time that it ran, which counts nothing that others take of the machine.

use std::time::Instant;

use apgstmd_benches::{clutter, cpu_ms, practical};
use apgstmd_core::{Bank, BankParams, Detector, Machine, Size};

#[derive(Default)]
struct Spent {
    times: Vec<f64>,
    busy: f64,
}

impl Spent {
    fn on(&mut self, work: impl FnOnce()) {
        let (before, start) = (cpu_ms(), Instant::now());
        work();
        self.times.push(start.elapsed().as_secs_f64() * 1e3);
        self.busy += cpu_ms() - before;
    }

    fn summary(&self) -> [f64; 3] {
        let count = self.times.len() as f64;
        let shortest = self.times.iter().copied().fold(f64::INFINITY, f64::min);
        [shortest, self.times.iter().sum::<f64>() / count, self.busy / count]
    }
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let get = |index: usize, default: &str| args.get(index).cloned().unwrap_or_else(|| default.to_owned());
    let size = get(0, "640x512");
    let (width, height) = size.split_once('x').expect("WIDTHxHEIGHT");
    let size = Size::new(height.parse().expect("rows"), width.parse().expect("columns"));
    let threads: usize = get(1, "2").parse().expect("threads");
    let frames: usize = get(2, "200").parse().expect("frames");
    let speeds: Vec<f64> = get(3, "0.5,1,2,4").split(',').map(|speed| speed.parse().expect("px/frame")).collect();
    let pictures = clutter(size);
    let machine = Machine::with_threads(threads);
    let mut detector = Detector::with_options(size, &practical(), &machine).expect("valid parameters");
    let params = BankParams::with_members(practical(), &speeds, &[5.0]);
    let mut bank = Bank::with_options(size, &params, &machine).expect("valid parameters");
    let (mut found, mut merged) = (detector.make_response(), bank.make_response());
    let (mut one, mut several) = (Spent::default(), Spent::default());
    // Past the horizons and the start of the traces.
    let warm_up = 100;
    for t in 0..warm_up + frames {
        let place = t % (2 * pictures.len() - 2);
        let picture = &pictures[place.min(2 * pictures.len() - 2 - place)];
        if t == warm_up {
            (one, several) = (Spent::default(), Spent::default());
        }
        one.on(|| detector.process_into(picture.view(), &mut found).expect("frames fit"));
        several.on(|| bank.process_into(picture.view(), &mut merged).expect("frames fit"));
    }
    let ([a, b, c], [x, y, z]) = (one.summary(), several.summary());
    print!("{size} {} {threads} threads: one min {a:.2} mean {b:.2} ms, ", detector.simd());
    print!("{} min {x:.2} mean {y:.2} ms, {:.2} times", speeds.len(), y / b);
    if threads == 1 {
        print!(", CPU {c:.2} and {z:.2} ms, {:.2} times", z / c);
    }
    println!(" | {} and {} MB", detector.memory().resident >> 20, bank.memory().resident >> 20);
}
