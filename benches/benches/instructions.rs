//! Instructions of one frame under valgrind: a number that does not jitter, for regressions. 240 x 135, one thread; the
//! emulated machine has AVX2 at most. `make instructions`.

use std::hint::black_box;

use apgstmd_benches::{Running, clutter_of, practical};
use apgstmd_core::params::RejectionMode;
use apgstmd_core::{Machine, Model, Params, SimdLevel, Size};
use gungraun::{library_benchmark, library_benchmark_group, main};

/// Past the horizon and a few traces.
fn warm(params: &Params, simd: SimdLevel) -> Running {
    let machine = Machine { simd: Some(simd), ..Machine::with_threads(1) };
    Running::with_machine(params, &machine, clutter_of(Size::new(135, 240), 20), 19)
}

fn preset(simd: SimdLevel) -> Running {
    warm(&practical(), simd)
}

fn everything_predicted() -> Running {
    let mut params = practical();
    params.rejection.mode = RejectionMode::Off;
    warm(&params, SimdLevel::Avx2)
}

fn model(model: Model) -> Running {
    warm(&Params::for_model(model).for_speed(1.0).expect("1 px/frame is in range"), SimdLevel::Avx2)
}

#[library_benchmark]
#[bench::practical_avx2(preset(SimdLevel::Avx2))]
#[bench::practical_sse2(preset(SimdLevel::Sse2))]
#[bench::practical_everything_predicted(everything_predicted())]
#[bench::stmd_plus(model(Model::StmdPlus))]
#[bench::dstmd(model(Model::Dstmd))]
#[bench::cascaded(model(Model::Cascaded))]
#[bench::estmd(model(Model::Estmd))]
fn frame(mut running: Running) -> Running {
    black_box(&mut running).step();
    running
}

library_benchmark_group!(name = frames; benchmarks = frame);
main!(library_benchmark_groups = frames);
