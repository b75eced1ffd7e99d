//! Runs experiments: each on its own, its scenes beside each other, every detector on one thread.

use std::time::{Duration, Instant};

use indicatif::ProgressBar;
use rayon::prelude::*;

use super::record::{self, Record, Records};
use super::{Experiment, Extent, Findings, Table, Work};
use crate::Outcome;
use crate::failure::Failure;

/// Where experiments are run: inside a pool of threads, before a progress bar.
pub struct Bench {
    /// How much is done.
    pub extent: Extent,
    bar: ProgressBar,
}

/// An experiment that came to its end.
pub struct Done {
    /// Which.
    pub experiment: &'static Experiment,
    /// What it found.
    pub findings: Findings,
    /// How long it took.
    pub time: Duration,
}

impl Bench {
    /// `bar` counts frames.
    pub fn new(extent: Extent, bar: ProgressBar) -> Self {
        Self { extent, bar }
    }

    /// Announces work, in frames.
    pub fn announce(&self, frames: usize) {
        self.bar.inc_length(frames as u64);
    }

    /// A frame is done.
    pub fn tick(&self) {
        self.bar.inc(1);
    }

    /// Runs an experiment.
    ///
    /// # Errors
    /// `Interrupted`, and whatever a [`Work::Other`] fails with.
    pub fn run(&self, experiment: &'static Experiment) -> Outcome<Done> {
        let begin = Instant::now();
        let findings = match experiment.work {
            Work::Other(compute) => compute(self)?,
            Work::Scenes { conditions, conclude } => {
                let conditions = conditions(self.extent);
                self.announce(conditions.iter().map(|condition| condition.scene.frames).sum());
                let records: Option<Vec<Record>> =
                    conditions.par_iter().map(|condition| record::run(condition, || self.tick())).collect();
                let records = Records(records.ok_or(Failure::Interrupted)?);
                let (figure, checks) = conclude(&records);
                Findings { tables: Table::of(&records), figure, checks }
            }
        };
        Ok(Done { experiment, findings, time: begin.elapsed() })
    }
}
