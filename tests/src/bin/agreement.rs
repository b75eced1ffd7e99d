//! How far the instruction sets of this machine agree: every model and both presets on a lively scene, each set beside plain code.
//! A table in Markdown.

use apgstmd_core::{Detector, Machine, Model, Params, Preset, SimdLevel, Size};
use apgstmd_tests::stimulus::Scene;

const SIZE: Size = Size::new(96, 128);
const FRAMES: usize = 80;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!(
        "| model | instruction set | largest difference of the response | detections | only here or there | farthest apart |"
    );
    println!("|---|---|---:|---:|---:|---:|");
    let settings = [
        ("apg-stmd, practical", Params::preset(Preset::Practical)),
        ("apg-stmd, paper", Params::preset(Preset::Paper)),
    ];
    let others = Model::ALL[1..].iter().map(|model| (model.name(), Params::for_model(*model)));
    for (name, params) in settings.into_iter().chain(others) {
        let params = params.for_speed(1.0)?;
        for level in SimdLevel::available().filter(|level| *level != SimdLevel::Scalar) {
            let Agreement { relative, detections, unmatched, apart } = compare(&params, level)?;
            println!("| {name} | {level} | {relative:.1e} | {detections} | {unmatched} | {apart:.1e} px |");
        }
    }
    Ok(())
}

#[derive(Default)]
struct Agreement {
    /// Of the largest response of the frame.
    relative: f32,
    /// Of plain code.
    detections: usize,
    /// Traces that one of both has in a frame and the other has not.
    unmatched: usize,
    apart: f32,
}

fn compare(params: &Params, level: SimdLevel) -> Result<Agreement, Box<dyn std::error::Error>> {
    let on = |simd| Detector::with_options(SIZE, params, &Machine { simd: Some(simd), ..Machine::with_threads(1) });
    let (mut plain, mut wide) = (on(SimdLevel::Scalar)?, on(level)?);
    let scene = Scene::lively(SIZE, 1.0, 7);
    let mut agreement = Agreement::default();
    for t in 0..FRAMES {
        let frame = scene.frame(t);
        let (a, b) = (plain.process(frame.view())?, wide.process(frame.view())?);
        let most = a.map.iter().copied().fold(0.0, f32::max);
        let off = a.map.iter().zip(&b.map).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        if most > 0.0 {
            agreement.relative = agreement.relative.max(off / most);
        }
        agreement.detections += a.detections.len();
        for found in &a.detections {
            // Traces are numbered as they come: those that one lacks shift the numbers of the others.
            let near = |x: f32, y: f32| (found.x - x).hypot(found.y - y);
            let nearest = b.detections.iter().map(|other| near(other.x, other.y)).fold(f32::INFINITY, f32::min);
            match nearest < 1.0 {
                true => agreement.apart = agreement.apart.max(nearest),
                false => agreement.unmatched += 1,
            }
        }
        agreement.unmatched += b.detections.len().saturating_sub(a.detections.len());
    }
    Ok(agreement)
}
