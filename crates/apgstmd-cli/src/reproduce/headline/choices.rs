//! What each choice of the practical preset gives: the preset with one thing changed at a time, on the seeds that it was
//! chosen on.

use apgstmd_core::params::{Gate, Speckles};
use apgstmd_core::{Params, Preset};

use super::conclude::Results;
use super::entrants::Entrant;
use super::run;
use super::scenes::{TUNED, chosen_on};
use crate::Outcome;
use crate::failure::Failure;
use crate::plot::{Figure, Panel, comparison};
use crate::reproduce::{Bench, Check, Experiment, Findings, Wanted, Work};

pub const EXPERIMENT: Experiment = Experiment {
    name: "choices",
    title: "What each choice of the practical preset gives",
    paper: "The paper fixes the constants of attention and prediction; it does not vary them.",
    method: "The scenes of the headline at the tuned speed, contrasts 0.1 and 0.2, seeds 1 to 3. The practical preset, and the \
             same with one thing changed; area under the detection rate over 0..1 false alarms a frame.",
    caption: "Area over contrast for the preset and each change of it.",
    work: Work::Other(compute),
};

/// A change, and what it is called.
type Change = (&'static str, fn(&mut Params));

const CHANGES: &[Change] = &[
    ("practical", |_| {}),
    ("attention off", |p| p.attention.enabled = false),
    ("attention and prediction off", |p| (p.attention.enabled, p.prediction.enabled) = (false, false)),
    ("gate = luminance", |p| p.attention.gate = Gate::Luminance),
    ("gate = luminance, ramp 10", |p| (p.attention.gate, p.attention.ramp) = (Gate::Luminance, 10.0)),
    ("speckles = light", |p| p.attention.speckles = Speckles::Light),
    ("threshold 0.02", |p| p.attention.threshold = 0.02),
    ("threshold 0.2", |p| p.attention.threshold = 0.2),
    ("scales 2, 2.5, 3, 3.5", |p| p.attention.scales = vec![2.0, 2.5, 3.0, 3.5]),
    ("alpha 2", |p| p.attention.alpha = 2.0),
    ("alpha 0.5", |p| p.attention.alpha = 0.5),
    ("beta 1", |p| p.prediction.beta = 1.0),
    ("beta 3", |p| p.prediction.beta = 3.0),
    ("mu 0.5", |p| p.prediction.mu = 0.5),
    ("ring_width 1", |p| p.prediction.ring_width = 1.0),
    ("gate 7 px", |p| (p.rejection.gate, p.rejection.gate_frames) = (7.0, 0.0)),
    ("motion_min_points 4", |p| p.rejection.motion_min_points = 4),
    ("max_peaks 100", |p| p.detection.max_peaks = 100),
];

fn compute(bench: &Bench) -> Outcome<Findings> {
    let entrants = CHANGES.iter().map(|(name, change)| {
        let mut params = Params::preset(Preset::Practical);
        change(&mut params);
        Ok(Entrant { name, params: params.for_speed(TUNED).map_err(Failure::failed)?, common: true })
    });
    let entrants = entrants.collect::<Outcome<Vec<_>>>()?;
    let scores = run::run(bench, &chosen_on(bench.extent), &entrants)?;
    let results = Results { entrants: &entrants, scores: &scores };
    let area = |entrant: usize| results.area(entrant, |_| true).value;
    let checks = (0..entrants.len()).map(|entrant| match entrant {
        0 => Check::new("practical: area", area(0), "", Wanted::Told),
        _ => Check::new(format!("{}: area gained", entrants[entrant].name), area(entrant) - area(0), "", Wanted::Told),
    });
    let curves = results.areas(0..entrants.len(), |s| s.contrast, |_| true);
    let plot = comparison("Weber contrast", "area over 0..1 false alarms", curves);
    Ok(Findings {
        checks: checks.collect(),
        figure: Figure { columns: 1, panels: vec![Panel::new("one thing changed at a time", plot)] },
        tables: vec![results.every_score(), results.by_contrast()],
    })
}
