//! Whole frames and each stage of them, in clutter and before a still picture.

use std::time::{Duration, Instant};

use apgstmd_benches::{Running, clutter, practical, still};
use apgstmd_core::params::{RejectionMode, TemporalEngine};
use apgstmd_core::{Frame, Machine, Model, Params, SimdLevel, Size, Timing};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

const SIZES: [Size; 2] = [Size::new(270, 480), Size::new(250, 500)];

fn frames(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("frame");
    group.sample_size(20).measurement_time(Duration::from_secs(4));
    for size in SIZES {
        group.throughput(Throughput::Elements(size.area() as u64));
        for threads in [1, 2] {
            let mut run = |name: &str, mut running: Running| {
                let id = BenchmarkId::new(name, format!("{}x{}/{threads} threads", size.width, size.height));
                group.bench_function(id, |bencher| {
                    bencher.iter_custom(|count| {
                        let mut spent = Duration::ZERO;
                        for _ in 0..count {
                            let frame = running.frame();
                            let start = Instant::now();
                            let done = running.detector.process_into(frame.view(), &mut running.response);
                            spent += start.elapsed();
                            done.expect("frames of the right size");
                        }
                        spent
                    });
                });
            };
            run("clutter", Running::new(&practical(), threads, clutter(size), 60));
            run("still", Running::new(&practical(), threads, still(size), 2000));
            let mut off = practical();
            off.rejection.mode = RejectionMode::Off;
            run("clutter, rejection off", Running::new(&off, threads, clutter(size), 60));
        }
    }
    group.finish();
}

/// The time that each part takes, over `count` frames.
fn timed(running: &mut Running, count: u64) -> Timing {
    let mut timing = Timing::default();
    for _ in 0..count {
        let frame = running.frame();
        let done = running.detector.process_timed(frame.view(), &mut running.response, &mut timing);
        done.expect("frames of the right size");
    }
    timing
}

fn stages(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("stage");
    group.sample_size(10).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(500));
    let mut running = Running::new(&practical(), 1, clutter(SIZES[0]), 60);
    for part in Timing::PARTS {
        group.bench_function(*part, |bencher| bencher.iter_custom(|count| timed(&mut running, count).of(part)));
    }
    group.finish();
}

/// Whole frames of each model, and of apg-STMD with each instruction set.
fn variants(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("variant");
    group.sample_size(10).measurement_time(Duration::from_secs(3)).warm_up_time(Duration::from_millis(500));
    let size = SIZES[0];
    group.throughput(Throughput::Elements(size.area() as u64));
    let machine = |simd| Machine { simd: Some(simd), ..Machine::with_threads(1) };
    let models = Model::ALL.iter().map(|model| {
        let params = if *model == Model::ApgStmd { practical() } else { Params::for_model(*model) };
        (model.to_string(), params, machine(SimdLevel::best()))
    });
    let levels = SimdLevel::available().map(|simd| (simd.to_string(), practical(), machine(simd)));
    for (name, params, machine) in models.chain(levels) {
        let mut running = Running::with_machine(&params, &machine, clutter(size), 60);
        group.bench_function(name, |bencher| bencher.iter(|| running.step()));
    }
    group.finish();
}

/// The filters over time, as cascade and as FIR, which is the reference, and with several frames computed together.
fn engines(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("lamina and medulla");
    group.sample_size(10).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(500));
    for (name, engine) in [("cascade", TemporalEngine::Cascade), ("fir", TemporalEngine::Fir)] {
        let mut params = practical();
        params.engine.temporal = engine;
        let mut running = Running::new(&params, 1, clutter(SIZES[0]), 60);
        group.bench_function(name, |bencher| {
            bencher.iter_custom(|count| {
                let timing = timed(&mut running, count);
                timing.of("lamina") + timing.of("medulla")
            });
        });
    }
    group.finish();
    let mut group = criterion.benchmark_group("frames together");
    group.sample_size(10).measurement_time(Duration::from_secs(3)).warm_up_time(Duration::from_millis(500));
    for together in [1, 2, 4, 6] {
        let machine = Machine { together, ..Machine::with_threads(1) };
        let mut running = Running::with_machine(&practical(), &machine, clutter(SIZES[0]), 60);
        let mut responses = vec![running.detector.make_response(); together];
        group.throughput(Throughput::Elements(together as u64));
        group.bench_function(together.to_string(), |bencher| {
            bencher.iter(|| {
                let pictures: Vec<_> = (0..together).map(|_| running.frame()).collect();
                let views: Vec<Frame<'_>> = pictures.iter().map(|picture| picture.view().into()).collect();
                running.detector.process_block(&views, &mut responses).expect("frames of the right size");
            });
        });
    }
    group.finish();
}

criterion_group!(benches, frames, stages, engines, variants);
criterion_main!(benches);
