//! The experiments of the paper, declared: what is shown to the model, what is recorded, what must come out.
//!
//! [`EXPERIMENTS`] is the table; [`mod@bench`] runs it, [`folder`], [`page`] and [`summary`] write what comes out.

mod attention;
pub mod bench;
pub mod check;
mod condition;
mod direction;
mod facilitation;
pub mod folder;
mod headline;
mod kernels;
mod occlusion;
pub mod page;
mod primer;
mod record;
pub mod summary;
mod table;
mod tuning;

use crate::Outcome;
use crate::plot::Figure;

pub use bench::Bench;
pub use check::{Check, Wanted};
pub use condition::{Condition, Recorder, Region, What, Zone};
pub use record::{Peaks, Record, Recording, Records};
pub use table::Table;

/// One experiment of the paper.
pub struct Experiment {
    /// On the command line and in file names.
    pub name: &'static str,
    /// A heading.
    pub title: &'static str,
    /// What the paper says, in other words.
    pub paper: &'static str,
    /// What is shown to the model, and what is recorded.
    pub method: &'static str,
    /// How to read the figure.
    pub caption: &'static str,
    /// How it is done.
    pub work: Work,
}

/// How an experiment is done.
pub enum Work {
    /// Scenes are run through the model, each on its own, and recorded.
    Scenes {
        /// The scenes.
        conditions: fn(Extent) -> Vec<Condition>,
        /// What is made of the records.
        conclude: fn(&Records) -> (Figure, Vec<Check>),
    },
    /// Whatever else computes a figure, tables and checks.
    Other(fn(&Bench) -> Outcome<Findings>),
}

/// What an experiment found.
pub struct Findings {
    /// Files of numbers.
    pub tables: Vec<Table>,
    /// In the form of the paper's.
    pub figure: Figure,
    /// What was measured, and whether it is as it must be.
    pub checks: Vec<Check>,
}

/// How much is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// The same with fewer points and smaller scenes.
    Quick,
    /// All of it.
    Full,
}

impl Extent {
    /// One of two.
    pub fn pick<T>(self, quick: T, full: T) -> T {
        match self {
            Self::Quick => quick,
            Self::Full => full,
        }
    }
}

/// All experiments, in the paper's order.
pub static EXPERIMENTS: &[Experiment] = &[
    kernels::EXPERIMENT,
    tuning::CONTRAST,
    tuning::VELOCITY,
    tuning::WIDTH,
    tuning::HEIGHT,
    direction::EXPERIMENT,
    attention::EXPERIMENT,
    facilitation::TIME,
    facilitation::SPACE,
    primer::CONTRAST,
    primer::DIRECTION,
    occlusion::EXPERIMENT,
    headline::EXPERIMENT,
    headline::CHOICES,
];

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use apgstmd_core::stimulus::Renderer;

    use super::*;

    #[test]
    fn every_experiment_is_sound() {
        let names: HashSet<&str> = EXPERIMENTS.iter().map(|experiment| experiment.name).collect();
        assert_eq!(names.len(), EXPERIMENTS.len());
        for experiment in EXPERIMENTS {
            let Work::Scenes { conditions, .. } = experiment.work else { continue };
            for extent in [Extent::Quick, Extent::Full] {
                let conditions = conditions(extent);
                assert!(!conditions.is_empty());
                for condition in &conditions {
                    // What the runner takes for granted.
                    Renderer::new(&condition.scene).unwrap();
                    condition.params.validate().unwrap();
                    for recorder in &condition.recorders {
                        assert!(recorder.frames.end <= condition.scene.frames && !recorder.frames.is_empty());
                    }
                    let names = |condition: &Condition| condition.factors.iter().map(|f| f.0).collect::<Vec<_>>();
                    assert_eq!(names(condition), names(&conditions[0]), "{}: one table", experiment.name);
                }
            }
        }
    }
}
