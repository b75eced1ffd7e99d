//! Naive model and fast core against golden data, stage by stage.
use apgstmd_core::{Params, params::RejectionMode};
use apgstmd_tests::golden::Golden;
use apgstmd_tests::naive::Naive;

fn params() -> Params {
    let mut params = Params::default();
    params.rejection.mode = RejectionMode::Off;
    params
}

#[test]
fn naive_against_independent() {
    let Some(golden) = Golden::independent() else {
        println!("the independent golden is not here: nothing compared");
        return;
    };
    let mut naive = Naive::new(&params(), 0.0);
    for t in 0..golden.frames.len_of(ndarray::Axis(0)) {
        let seen = naive.step(&golden.luminance(t));
        for (stage, truth) in golden.stages.get(&t).into_iter().flatten() {
            let most = truth.iter().fold(0.0f32, |a, b| a.max(b.abs())) as f64;
            let mut worst = 0.0f64;
            let mut over = 0;
            for (k, map) in seen[*stage].iter().enumerate() {
                for ((y, x), v) in map.indexed_iter() {
                    let d = (v - truth[[k, y, x]] as f64).abs();
                    worst = worst.max(d);
                    over += (d > 1e-6 * most) as usize;
                }
            }
            println!("{t} {stage} max {most:.3e} worst {:.2e} over {over}", worst / most);
        }
    }
}
