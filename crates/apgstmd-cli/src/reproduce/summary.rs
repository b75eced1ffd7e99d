//! What came out, as a table for people and as JSON for programs.

use serde::Serialize;

use super::check::{Check, Wanted};
use super::folder::Written;
use super::{Experiment, Extent};

/// Raised when a field changes its meaning or goes away.
const SCHEMA_VERSION: u32 = 1;

/// A run of experiments.
pub struct Run {
    /// How much was done.
    pub extent: Extent,
    /// Threads it ran on.
    pub threads: usize,
    /// How long it took.
    pub seconds: f64,
    /// The user stopped it: what was not finished is missing.
    pub interrupted: bool,
    /// What came to its end, in the order of the table of experiments.
    pub written: Vec<Written>,
}

#[derive(Serialize)]
struct Json<'a> {
    schema_version: u32,
    program: &'static str,
    version: &'static str,
    command: &'static str,
    quick: bool,
    threads: usize,
    seconds: f64,
    interrupted: bool,
    holds: bool,
    experiments: Vec<JsonExperiment<'a>>,
}

#[derive(Serialize)]
struct JsonExperiment<'a> {
    name: &'static str,
    title: &'static str,
    seconds: f64,
    holds: bool,
    files: &'a [String],
    checks: Vec<JsonCheck<'a>>,
}

#[derive(Serialize)]
struct JsonCheck<'a> {
    what: &'a str,
    /// null where there was nothing to measure.
    measured: f64,
    unit: &'static str,
    wanted: Wanted,
    holds: bool,
}

impl Written {
    /// What it is.
    pub fn experiment(&self) -> &'static Experiment {
        self.done.experiment
    }

    /// Its checks.
    pub fn checks(&self) -> &[Check] {
        &self.done.findings.checks
    }

    /// Whether all of them hold.
    pub fn holds(&self) -> bool {
        self.checks().iter().all(Check::holds)
    }
}

impl Run {
    /// All checks.
    pub fn checks(&self) -> impl Iterator<Item = &Check> {
        self.written.iter().flat_map(Written::checks)
    }

    /// Names of the experiments that are not as they must be.
    pub fn failing(&self) -> Vec<&'static str> {
        self.written.iter().filter(|written| !written.holds()).map(|written| written.experiment().name).collect()
    }

    /// `summary.json`.
    pub fn json(&self) -> String {
        let experiments = self.written.iter().map(|written| JsonExperiment {
            name: written.experiment().name,
            title: written.experiment().title,
            seconds: written.done.time.as_secs_f64(),
            holds: written.holds(),
            files: &written.files,
            checks: written.checks().iter().map(json_check).collect(),
        });
        let record = Json {
            schema_version: SCHEMA_VERSION,
            program: "apgstmd",
            version: env!("CARGO_PKG_VERSION"),
            command: "reproduce",
            quick: self.extent == Extent::Quick,
            threads: self.threads,
            seconds: self.seconds,
            interrupted: self.interrupted,
            holds: self.failing().is_empty(),
            experiments: experiments.collect(),
        };
        serde_json::to_string_pretty(&record).expect("numbers, names and lists") + "\n"
    }

    /// A line for each check, under the name of its experiment.
    pub fn table(&self) -> String {
        let head = ["experiment", "what", "measured", "wanted", "holds"].map(str::to_owned);
        let mut rows = vec![head];
        for written in &self.written {
            for (i, check) in written.checks().iter().enumerate() {
                let name = if i == 0 { written.experiment().name } else { "" };
                let verdict = check.verdict().to_owned();
                rows.push([name.to_owned(), check.what.clone(), check.measured(), check.wanted(), verdict]);
            }
        }
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        let widths: [usize; 5] = std::array::from_fn(width);
        let mut text = String::new();
        for [name, what, measured, wanted, holds] in &rows {
            let [a, b, c, d, _] = widths;
            text += &format!("{name:<a$}  {what:<b$}  {measured:>c$}   {wanted:<d$}  {holds}\n");
        }
        text
    }

    /// How many hold.
    pub fn verdict(&self) -> String {
        let ruled = || self.checks().filter(|check| check.is_ruled());
        let (all, holding) = (ruled().count(), ruled().filter(|check| check.holds()).count());
        format!("{holding} of {all} hold, in {} experiments and {:.0} s", self.written.len(), self.seconds)
    }
}

fn json_check(check: &Check) -> JsonCheck<'_> {
    JsonCheck {
        what: &check.what,
        measured: check.measured,
        unit: check.unit,
        wanted: check.wanted,
        holds: check.holds(),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::plot::Figure;
    use crate::reproduce::bench::Done;
    use crate::reproduce::{EXPERIMENTS, Findings};

    fn run(measured: [f64; 2]) -> Run {
        let check = |value| Check::new("a number", value, "px", Wanted::Below(2.0));
        let findings = Findings { tables: vec![], figure: Figure::default(), checks: measured.map(check).to_vec() };
        let done = Done { experiment: &EXPERIMENTS[0], findings, time: Duration::from_secs(1) };
        let written = vec![Written { done, files: vec!["a.svg".into()], svg: String::new() }];
        Run { extent: Extent::Quick, threads: 2, seconds: 3.0, interrupted: false, written }
    }

    #[test]
    fn one_failing_check_fails_the_run() {
        let good = run([1.0, 1.5]);
        assert!(good.failing().is_empty() && good.verdict().starts_with("2 of 2"));
        let json: serde_json::Value = serde_json::from_str(&good.json()).unwrap();
        assert_eq!((&json["holds"], &json["schema_version"], &json["quick"]), (&true.into(), &1.into(), &true.into()));
        for measured in [[1.0, 3.0], [f64::NAN, 1.0]] {
            let bad = run(measured);
            assert_eq!(bad.failing(), [EXPERIMENTS[0].name]);
            assert!(bad.table().contains("NO") && bad.verdict().starts_with("1 of 2"), "{}", bad.table());
            let json: serde_json::Value = serde_json::from_str(&bad.json()).unwrap();
            assert_eq!((&json["holds"], &json["experiments"][0]["holds"]), (&false.into(), &false.into()));
            assert_eq!(json["experiments"][0]["checks"][1]["wanted"]["below"], 2.0);
        }
    }
}
