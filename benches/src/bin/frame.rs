//! Time of whole frames and of each stage, and what the detector holds: `frame WIDTHxHEIGHT [threads] [frames] [variant]
//! [simd] [together]`, before clutter that moves; variant `practical`, `paper` or `off` (practical, with everything predicted).
//!
//! One line: the shortest, the median and the 99th percentile of the frames, and for one thread the time that it ran; of
//! each stage the quartiles. `CPU` time counts nothing that others take of the machine.

use std::time::Instant;

use apgstmd_benches::{Running, clutter, cpu_ms, practical};
use apgstmd_core::params::RejectionMode;
use apgstmd_core::{Frame, Machine, Params, Size, Timing};

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let get = |index: usize, default: &str| args.get(index).cloned().unwrap_or_else(|| default.to_owned());
    let size = get(0, "480x270");
    let (width, height) = size.split_once('x').expect("WIDTHxHEIGHT");
    let size = Size::new(height.parse().expect("rows"), width.parse().expect("columns"));
    let threads: usize = get(1, "1").parse().expect("threads");
    let frames: usize = get(2, "200").parse().expect("frames");
    let variant = get(3, "practical");
    let mut params = practical();
    match variant.as_str() {
        "practical" => {}
        "paper" => params = Params::default(),
        "off" => params.rejection.mode = RejectionMode::Off,
        other => panic!("there is no variant {other}"),
    }
    let simd = args.get(4).map(|name| name.parse().expect("an instruction set"));
    let together = get(5, "1").parse().expect("frames that are computed together");
    let machine = Machine { simd, together, ..Machine::with_threads(threads) };
    let mut running = Running::with_machine(&params, &machine, clutter(size), 120.min(frames * 8));
    let mut times = Vec::new();
    let together = running.detector.block_len();
    if together > 1 {
        return blocks(&mut running, frames, together);
    }
    let busy = cpu_ms();
    let mut timing = Timing::default();
    let mut parts = vec![Vec::new(); Timing::PARTS.len()];
    for _ in 0..frames {
        let before: Vec<_> = timing.parts().map(|(_, spent)| spent).collect();
        let frame = running.frame();
        let start = Instant::now();
        running.detector.process_timed(frame.view(), &mut running.response, &mut timing).expect("frames fit");
        times.push(start.elapsed().as_secs_f64() * 1e3);
        for ((part, (_, spent)), before) in parts.iter_mut().zip(timing.parts()).zip(before) {
            part.push((spent - before).as_secs_f64() * 1e3);
        }
    }
    let busy = (cpu_ms() - busy) / frames as f64;
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((frames - 1) as f64 * share) as usize];
    print!(
        "{size} {variant} {} {threads} threads: min {:.2} p50 {:.2} p99 {:.2} CPU {busy:.2} ms |",
        running.detector.simd(),
        times[0],
        at(0.5),
        at(0.99)
    );
    for (name, part) in Timing::PARTS.iter().zip(&mut parts) {
        part.sort_by(f64::total_cmp);
        print!(" {name} {:.2}/{:.2}/{:.2}", part[frames / 4], part[frames / 2], part[3 * frames / 4]);
    }
    let share = |tiles: f64| 100.0 * tiles / timing.total_tiles() as f64;
    print!(
        " | tiles % attention {:.0} inhibition {:.0} prediction {:.0}",
        share(timing.attended_tiles() as f64),
        share(timing.inhibited_tiles()),
        share(timing.predicted_tiles())
    );
    let memory = running.detector.memory();
    println!(" | MB {:.0} of {:.0}", memory.resident as f64 / 1e6, memory.bound as f64 / 1e6);
}

/// Frames that are computed together: the time of one, over whole blocks.
fn blocks(running: &mut Running, frames: usize, together: usize) {
    let mut responses = vec![running.detector.make_response(); together];
    let mut times = Vec::new();
    let busy = cpu_ms();
    for _ in 0..frames / together {
        let pictures: Vec<_> = (0..together).map(|_| running.frame().clone()).collect();
        let views: Vec<Frame<'_>> = pictures.iter().map(|picture| picture.view().into()).collect();
        let start = Instant::now();
        running.detector.process_block(&views, &mut responses).expect("frames fit");
        times.push(start.elapsed().as_secs_f64() * 1e3 / together as f64);
    }
    let busy = (cpu_ms() - busy) / (times.len() * together) as f64;
    times.sort_by(f64::total_cmp);
    let (least, middle) = (times[0], times[times.len() / 2]);
    let memory = running.detector.memory().resident as f64 / 1e6;
    println!("{together} frames together: min {least:.2} p50 {middle:.2} CPU {busy:.2} ms a frame | MB {memory:.0}");
}
