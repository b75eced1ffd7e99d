//! Writes the repository's own golden from the naive model:
//! `cargo run -p apgstmd-tests --bin make-golden`. To be run again only when the specification changes.

use std::error::Error;
use std::fs::File;

use apgstmd_core::Model;
use apgstmd_tests::golden;
use apgstmd_tests::naive::Naive;
use ndarray::{Array3, Axis, stack};
use ndarray_npy::NpzWriter;

fn main() -> Result<(), Box<dyn Error>> {
    let scene = golden::own_scene();
    let mut frames = Array3::<u8>::zeros((golden::OWN_FRAMES, scene.size.height, scene.size.width));
    let mut npz = NpzWriter::new_compressed(File::create(golden::own_path())?);
    let mut naive = Naive::new(&golden::own_params(), 0.0);
    for t in 0..golden::OWN_FRAMES {
        let frame = scene.frame(t);
        let seen = naive.step(&frame.mapv(|v| f64::from(v) / 255.0));
        frames.index_axis_mut(Axis(0), t).assign(&frame);
        for detection in &seen.detections {
            println!("{t:3} {detection:?}");
        }
        if golden::OWN_STAGES.contains(&t) {
            for &stage in Model::ApgStmd.stages() {
                let planes: Vec<_> = seen[stage].iter().map(|map| map.view()).collect();
                let planes = stack(Axis(0), &planes)?.mapv(|v| v as f32);
                npz.add_array(format!("{stage}_{t:06}"), &planes)?;
            }
        }
    }
    npz.add_array("frames", &frames)?;
    npz.finish()?;
    println!("{}: {} bytes", golden::own_path().display(), golden::own_path().metadata()?.len());
    Ok(())
}
