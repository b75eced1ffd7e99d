//! Instructions of one frame, counted under valgrind: the same number on every run, however busy the machine is. The
//! widest set that valgrind knows is AVX2.

use std::hint::black_box;

use apgstmd_benches::{Running, clutter, practical, still};
use apgstmd_core::params::RejectionMode;
use apgstmd_core::{Machine, Model, Params, SimdLevel, Size};
use gungraun::{library_benchmark, library_benchmark_group, main};
use ndarray::Array2;

const SIZE: Size = Size::new(135, 240);
const WARM_UP: usize = 40;

/// A detector past its horizon, and the frame that comes next.
fn ready(params: &Params, simd: SimdLevel, frames: Vec<Array2<f32>>) -> (Running, Array2<f32>) {
    let machine = Machine { threads: 1, simd: Some(simd), ..Machine::default() };
    let mut running = Running::on(&machine, params, frames, WARM_UP);
    let frame = running.frame();
    (running, frame)
}

fn apg_stmd(simd: SimdLevel) -> (Running, Array2<f32>) {
    ready(&practical(), simd, clutter(SIZE))
}

fn predicted_everywhere() -> (Running, Array2<f32>) {
    let mut params = practical();
    params.rejection.mode = RejectionMode::Off;
    ready(&params, SimdLevel::Avx2, clutter(SIZE))
}

fn before_a_still_picture() -> (Running, Array2<f32>) {
    ready(&practical(), SimdLevel::Avx2, still(SIZE))
}

fn model(model: Model) -> (Running, Array2<f32>) {
    let params = Params::usual(model).for_speed(1.0).expect("1 px/frame is in range");
    ready(&params, SimdLevel::Avx2, clutter(SIZE))
}

#[library_benchmark]
#[bench::avx2(apg_stmd(SimdLevel::Avx2))]
#[bench::sse4_2(apg_stmd(SimdLevel::Sse4_2))]
#[bench::scalar(apg_stmd(SimdLevel::Scalar))]
#[bench::rejection_off(predicted_everywhere())]
#[bench::still(before_a_still_picture())]
#[bench::stmd_plus(model(Model::StmdPlus))]
#[bench::dstmd(model(Model::Dstmd))]
#[bench::cascaded(model(Model::Cascaded))]
#[bench::estmd(model(Model::Estmd))]
fn frame((mut running, frame): (Running, Array2<f32>)) -> Running {
    running.detector.process_into(black_box(frame.view()), &mut running.response).expect("frames of the right size");
    running
}

library_benchmark_group!(name = whole, benchmarks = [frame]);
main!(library_benchmark_groups = whole);
