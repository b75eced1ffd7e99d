//! The headline of the paper: faint targets before moving clutter, the models beside each other.
//!
//! [`scenes`] says what is shown, [`entrants`] who takes part, [`run`] scores every entrant on every scene, [`conclude`]
//! makes the table, the figure and the checks of it. [`choices`] does the same with settings of apg-STMD.

mod choices;
mod conclude;
mod entrants;
mod panorama;
mod run;
mod scenes;

use super::{Bench, Experiment, Findings, Work};
use crate::Outcome;

pub use choices::EXPERIMENT as CHOICES;

pub const EXPERIMENT: Experiment = Experiment {
    name: "headline",
    title: "Faint targets in moving clutter",
    paper: "With attention and prediction, targets of low contrast are found in moving natural clutter that the earlier \
            models of the same family miss.",
    method: "Three dark 5 x 5 px targets cross 256 x 192 px of clutter that moves another way: procedural noise with the power \
             spectrum of natural scenes, and a procedural panorama of sky, ridges and foliage. Contrasts 0.05 to 0.6, background \
             at 0.3 and 1 times the tuned speed of 1 px/frame, targets at 0.7, 1 and 1.4 times, camera noise, 8 bits; five seeds \
             that no setting was chosen on. Each model with its own rejection and with the common one, `motion`. Detection \
             rate over false alarms a frame, thresholds global over a clip; intervals: 95 % over seeds (Student's t).",
    caption: "Left: area under the detection rate over 0..1 false alarms a frame, over contrast, targets at the tuned speed. \
              Right: the same over the targets' speed, contrasts up to 0.3. Below: detection rate over false alarms at \
              contrast 0.2, and what attention and prediction add to their own stage.",
    work: Work::Other(compute),
};

fn compute(bench: &Bench) -> Outcome<Findings> {
    let (scenes, entrants) = (scenes::reported(bench.extent), entrants::entrants()?);
    let scores = run::run(bench, &scenes, &entrants)?;
    Ok(conclude::Results { entrants: &entrants, scores: &scores }.findings())
}
