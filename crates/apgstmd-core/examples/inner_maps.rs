//! Every map of the paper, of the frame that was processed last: their names, shapes and largest values.
//!
//!     cargo run --release --package apgstmd-core --example inner_maps

use std::error::Error;

use apgstmd_core::params::RejectionMode;
use apgstmd_core::stimulus::{Path, Renderer, Scene, Target};
use apgstmd_core::{DIRECTIONS, Detector, Params, Preset, Size, Stage};

fn main() -> Result<(), Box<dyn Error>> {
    // The paper's stimulus: a black target of 5 x 5 px on white, to the right at 0.25 px/frame, seen by the paper's model.
    let path = Path::Straight { start: [20.0, 32.0], speed: 250.0, direction: 0.0 };
    let scene = Scene { width: 160, height: 64, targets: vec![Target::new(path)], ..Scene::paper() };
    let renderer = Renderer::new(&scene)?;
    let mut params = Params::preset(Preset::Paper);
    // On plain white the paper's own rule rejects the target.
    params.rejection.mode = RejectionMode::Off;
    let mut detector = Detector::new(Size::new(64, 160), &params)?;

    let (mut frame, mut response) = (renderer.make_frame(), detector.make_response());
    for t in 0..240 {
        renderer.frame_into(t, &mut frame);
        detector.process_into(frame.view(), &mut response)?;
    }

    let probe = detector.probe();
    for stage in probe.stages() {
        // (planes, rows, columns): 8 directions, 4 orientations or 1.
        let map = probe.stage(*stage)?;
        let largest = map.iter().fold(0.0f32, |most, value| most.max(value.abs()));
        println!("{stage:6} {:?}  largest {largest:.3e}", map.shape());
    }

    // Which of the 8 directions answers most: 0, to the right.
    let e = probe.stage(Stage::E)?;
    let strongest = |k: usize| e.index_axis(ndarray::Axis(0), k).iter().copied().fold(0.0, f32::max);
    let best = (0..DIRECTIONS).max_by(|a, b| strongest(*a).total_cmp(&strongest(*b)));
    println!("direction of the strongest response: {best:?} x 45 degrees");
    assert_eq!(best, Some(0));
    Ok(())
}

#[test]
fn runs() {
    main().unwrap();
}
