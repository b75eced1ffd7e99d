//! Writes what the repository keeps to compare with: `cargo run -p apgstmd-tests --bin make-golden -- stages` the golden from the
//! naive model, to be run again only when the specification changes; `outputs` the tables that this version finds, to be run again when
//! numbers are meant to change.

use std::error::Error;
use std::fs::{self, File};

use apgstmd_core::Model;
use apgstmd_tests::naive::Naive;
use apgstmd_tests::{golden, outputs};
use ndarray::{Array3, Axis, stack};
use ndarray_npy::NpzWriter;

fn main() -> Result<(), Box<dyn Error>> {
    match std::env::args().nth(1).as_deref() {
        Some("stages") => stages(),
        Some("outputs") => outputs(),
        _ => Err("usage: make-golden stages|outputs".into()),
    }
}

fn outputs() -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(outputs::folder())?;
    for (name, flags) in outputs::RUNS {
        for (table, text) in outputs::TABLES.iter().zip(outputs::tables(flags, None)?) {
            let path = outputs::folder().join(format!("{name}.{table}.csv"));
            println!("{}: {} rows", path.display(), text.lines().count() - 1);
            fs::write(path, text)?;
        }
    }
    Ok(())
}

fn stages() -> Result<(), Box<dyn Error>> {
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
