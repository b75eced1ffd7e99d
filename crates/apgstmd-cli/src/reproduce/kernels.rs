//! The kernels of attention and prediction.

use std::f64::consts::FRAC_PI_4;

use apgstmd_core::{Params, kernels};
use ndarray::Array2;

use super::bench::Bench;
use super::check::{Check, Wanted};
use super::{Experiment, Findings, Table, Work};
use crate::Outcome;
use crate::plot::{Colors, Figure, Grid, Map, Panel, Plot, Relief};

pub const EXPERIMENT: Experiment = Experiment {
    name: "kernels",
    title: "Kernels of attention and prediction",
    paper: "The attention kernel compares a centre with its surround on both sides along its orientation. The prediction \
            kernel is a ring: where a target of the best speed will be after a while, most likely straight ahead.",
    method: "The kernels as the model computes them: attention at scale 3 px and orientation 45°, prediction for motion to the \
             right.",
    caption: "Attention kernel (a) in relief and (b) in the plane; prediction kernel (c) in relief and (d) in the plane.",
    work: Work::Other(findings),
};

fn findings(_: &Bench) -> Outcome<Findings> {
    let params = Params::default();
    let attention = kernels::attention(3.0, FRAC_PI_4);
    let prediction = kernels::prediction(&params, 0.0);
    let reach = (prediction.ncols() / 2) as f64;
    let total = attention.iter().map(|v| v.abs()).sum::<f64>();
    let peak = prediction.indexed_iter().max_by(|a, b| a.1.total_cmp(b.1)).map_or((0, 0), |(place, _)| place);
    let (ahead, off) = (peak.1 as f64 - reach, (peak.0 as f64 - reach).abs());
    let expected = params.prediction.v_opt * f64::from(params.prediction.horizon);
    let checks = vec![
        // Rounding of 625 values.
        Check::new("attention: sum, of the sum of sizes", (attention.sum() / total).abs(), "", Wanted::Below(1e-12)),
        Check::new("prediction: sum, off 1 by", (prediction.sum() - 1.0).abs(), "", Wanted::Below(1e-12)),
        Check::new(
            "prediction: largest, ahead of the target",
            ahead,
            "px",
            Wanted::Between(expected - 0.5, expected + 0.5),
        ),
        Check::new("the same, beside the path", off, "px", Wanted::Exactly(0.0)),
    ];
    let panels = vec![
        relief("(a) attention, in relief", &attention),
        plane("(b) attention, in the plane", &attention),
        relief("(c) prediction, in relief", &prediction),
        plane("(d) prediction, in the plane", &prediction),
    ];
    let tables = vec![table("attention", &attention), table("prediction", &prediction)];
    Ok(Findings { tables, figure: Figure { columns: 2, panels }, checks })
}

fn relief(title: &str, values: &Array2<f64>) -> Panel {
    let reach = (values.ncols() / 2) as f64;
    Panel::new(title, Plot::Relief(Relief { values: values.clone(), reach, label: "weight".into() }))
}

fn plane(title: &str, values: &Array2<f64>) -> Panel {
    let reach = (values.ncols() / 2) as f64;
    let map = Map {
        values: values.clone(),
        x: Grid { label: "x, px".into(), first: -reach, step: 1.0 },
        y: Grid { label: "y, px".into(), first: reach, step: -1.0 },
        label: "weight".into(),
        colors: Colors::Viridis,
        range: None,
        marks: vec![],
        lines: vec![],
    };
    Panel::new(title, Plot::Map(map))
}

fn table(name: &'static str, values: &Array2<f64>) -> Table {
    let reach = (values.ncols() / 2) as f64;
    let mut table = Table::new(name, ["x", "y", "weight"]);
    for ((row, column), value) in values.indexed_iter() {
        table.push([column as f64 - reach, reach - row as f64, *value]);
    }
    table
}
