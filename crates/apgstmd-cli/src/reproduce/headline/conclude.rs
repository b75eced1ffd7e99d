//! What the scores say: tables, figure, checks.

use apgstmd_core::Model;

use super::entrants::{Entrant, OWN_STAGE, SUBJECT};
use super::run::Score;
use super::scenes::{Setting, TUNED};
use crate::plot::{Figure, Measured, Panel, comparison, roc};
use crate::reproduce::{Check, Findings, Table, Wanted};

/// Contrasts that count as faint.
const FAINT: f64 = 0.3;
/// The models that the paper names as missing them.
const NAMED: &[Model] = &[Model::Estmd, Model::Dstmd, Model::StmdPlus];
/// Student's t for 95 %, two-sided, by degrees of freedom from 1.
const STUDENT: [f64; 9] = [12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262];
/// False alarms a frame at which rates are told.
const ALARMS: [f64; 3] = [0.1, 1.0, 5.0];

/// All scores, of which tables and figures are made.
pub struct Results<'a> {
    pub entrants: &'a [Entrant],
    pub scores: &'a [Score],
}

/// Mean over seeds and the 95 % interval of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    pub value: f64,
    pub half: f64,
}

impl Mean {
    /// Of one value a seed.
    fn of(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let value = values.iter().sum::<f64>() / count;
        if values.len() < 2 {
            return Self { value, half: f64::NAN };
        }
        let variance = values.iter().map(|v| (v - value).powi(2)).sum::<f64>() / (count - 1.0);
        let student = STUDENT[(values.len() - 2).min(STUDENT.len() - 1)];
        Self { value, half: student * (variance / count).sqrt() }
    }
}

impl Results<'_> {
    /// The models beside each other.
    pub fn findings(&self) -> Findings {
        Findings {
            tables: vec![self.every_score(), self.by_contrast(), self.leads()],
            figure: self.figure(),
            checks: self.checks(),
        }
    }

    fn entrant(&self, name: &str) -> usize {
        self.entrants.iter().position(|entrant| entrant.name == name).expect("a test names both")
    }

    /// One value a seed: the mean of `value` over the scenes of the seed that `counts`.
    fn seeds(&self, entrant: usize, counts: impl Fn(&Setting) -> bool, value: impl Fn(&Score) -> f64) -> Vec<f64> {
        let mine = || self.scores.iter().filter(|s| s.entrant == entrant && counts(&s.setting));
        let mut seeds: Vec<u64> = mine().map(|s| s.setting.seed).collect();
        seeds.sort_unstable();
        seeds.dedup();
        seeds
            .into_iter()
            .map(|seed| {
                let of_seed: Vec<f64> = mine().filter(|s| s.setting.seed == seed).map(&value).collect();
                of_seed.iter().sum::<f64>() / of_seed.len() as f64
            })
            .collect()
    }

    /// Mean area over the scenes that `counts`.
    pub fn area(&self, entrant: usize, counts: impl Fn(&Setting) -> bool) -> Mean {
        Mean::of(&self.seeds(entrant, counts, |s| s.evaluation.area))
    }

    /// Mean over seeds of the area at each value of a number of the settings, a curve for each of these entrants.
    pub fn areas(
        &self,
        entrants: impl Iterator<Item = usize>,
        of: fn(&Setting) -> f64,
        counts: fn(&Setting) -> bool,
    ) -> Vec<(String, Vec<Measured>)> {
        let levels = self.levels(of);
        entrants
            .map(|entrant| {
                let measured = levels.iter().map(|&at| {
                    let Mean { value, half } = self.area(entrant, |s| of(s) == at && counts(s));
                    let half = if half.is_finite() { half } else { 0.0 };
                    Measured { at, value, interval: ((value - half).max(0.0), (value + half).min(1.0)) }
                });
                (self.entrants[entrant].name.to_owned(), measured.collect())
            })
            .collect()
    }

    /// The values that a number of the settings takes, in rising order.
    fn levels(&self, of: fn(&Setting) -> f64) -> Vec<f64> {
        let mut levels: Vec<f64> = self.scores.iter().map(|s| of(&s.setting)).collect();
        levels.sort_by(f64::total_cmp);
        levels.dedup();
        levels
    }

    /// A row for each scene and entrant.
    pub fn every_score(&self) -> Table {
        let columns = ["clutter", "contrast", "background_px", "speed_px", "seed", "model", "area"];
        let rates = ["rate_0.1", "rate_1", "rate_5", "rate_all"];
        let mut table = Table::new("scores", columns.into_iter().chain(rates));
        for Score { setting, entrant, evaluation } in self.scores {
            let Setting { clutter, contrast, background, speed, seed } = setting;
            let mut row = vec![clutter.name().to_owned(), contrast.to_string(), background.to_string()];
            row.extend([speed.to_string(), seed.to_string(), self.entrants[*entrant].name.to_owned()]);
            row.push(format!("{:.4}", evaluation.area));
            row.extend(ALARMS.map(|limit| format!("{:.4}", evaluation.detection_rate_at(limit))));
            row.push(format!("{:.4}", evaluation.all.detection_rate));
            table.push(row);
        }
        table
    }

    /// Means over seeds, a row for each model, speed of the targets and contrast.
    pub fn by_contrast(&self) -> Table {
        let columns = ["model", "speed_px", "contrast", "area", "area_low", "area_high"];
        let mut table = Table::new("means", columns.into_iter().chain(["rate_0.1", "rate_1", "rate_5"]));
        for (entrant, Entrant { name, .. }) in self.entrants.iter().enumerate() {
            for speed in self.levels(|s| s.speed) {
                for contrast in self.levels(|s| s.contrast) {
                    let counts = |s: &Setting| s.contrast == contrast && s.speed == speed;
                    let Mean { value, half } = self.area(entrant, counts);
                    let mut row = vec![(*name).to_owned(), speed.to_string(), contrast.to_string()];
                    row.extend([value, value - half, value + half].map(|number| format!("{number:.4}")));
                    row.extend(ALARMS.map(|limit| {
                        let rates = self.seeds(entrant, counts, |s| s.evaluation.detection_rate_at(limit));
                        format!("{:.4}", Mean::of(&rates).value)
                    }));
                    table.push(row);
                }
            }
        }
        table
    }

    /// By how much the subject leads each other entrant, seed by seed: rows as in `means`.
    fn leads(&self) -> Table {
        let mut table = Table::new("leads", ["over", "speed_px", "contrast", "lead", "lead_low", "lead_high"]);
        let subject = self.entrant(SUBJECT);
        for (other, Entrant { name, .. }) in self.entrants.iter().enumerate().filter(|(i, _)| *i != subject) {
            for speed in self.levels(|s| s.speed) {
                for contrast in self.levels(|s| s.contrast) {
                    let Mean { value, half } = self.lead(other, |s| s.contrast == contrast && s.speed == speed);
                    let mut row = vec![(*name).to_owned(), speed.to_string(), contrast.to_string()];
                    row.extend([value, value - half, value + half].map(|number| format!("{number:.4}")));
                    table.push(row);
                }
            }
        }
        table
    }

    fn lead(&self, other: usize, counts: impl Fn(&Setting) -> bool) -> Mean {
        let areas = |entrant| self.seeds(entrant, &counts, |s: &Score| s.evaluation.area);
        let leads: Vec<f64> = areas(self.entrant(SUBJECT)).iter().zip(areas(other)).map(|(a, b)| a - b).collect();
        Mean::of(&leads)
    }

    fn figure(&self) -> Figure {
        let common: Vec<usize> = (0..self.entrants.len()).filter(|i| self.entrants[*i].common).collect();
        let curves = |of, counts| self.areas(common.iter().copied(), of, counts);
        let mut panels = vec![Panel::new(
            "(a) targets at the tuned speed",
            comparison("Weber contrast", "area over 0..1 false alarms", curves(|s| s.contrast, |s| s.speed == TUNED)),
        )];
        if self.levels(|s| s.speed).len() > 1 {
            let faint = curves(|s| s.speed, |s| s.contrast <= FAINT);
            panels.push(Panel::new(
                "(b) contrasts up to 0.3",
                comparison("speed of the targets, px/frame", "area over 0..1 false alarms", faint),
            ));
        }
        let rates = |entrant: usize| {
            let points = (0..=80).map(|i| 10f64.powf(-3.0 + 4.0 * f64::from(i) / 80.0)).map(|alarms| {
                let seeds = self.seeds(
                    entrant,
                    |s| s.speed == TUNED && s.contrast == 0.2,
                    |s| s.evaluation.detection_rate_at(alarms),
                );
                (alarms, Mean::of(&seeds).value)
            });
            (self.entrants[entrant].name.to_owned(), points.collect())
        };
        let own = (0..self.entrants.len()).filter(|i| !self.entrants[*i].common || *i == self.entrant(SUBJECT));
        panels.push(Panel::new("(c) contrast 0.2, the common rejection", roc(common.iter().map(|i| rates(*i)))));
        panels.push(Panel::new("(d) contrast 0.2, each with its own", roc(own.map(rates))));
        Figure { columns: 2, panels }
    }

    fn checks(&self) -> Vec<Check> {
        let (subject, stage) = (self.entrant(SUBJECT), self.entrant(OWN_STAGE));
        let mut checks = Vec::new();
        for contrast in self.levels(|s| s.contrast).into_iter().filter(|contrast| *contrast <= FAINT) {
            let counts = |s: &Setting| s.contrast == contrast && s.speed == TUNED;
            let mut check = |what: &str, measured, wanted| {
                checks.push(Check::new(format!("contrast {contrast}: {what}"), measured, "", wanted));
            };
            check("area", self.area(subject, counts).value, Wanted::Told);
            check("lead over its own stage", self.lead(stage, counts).value, Wanted::Above(0.0));
            let (name, lead) = self.nearest(NAMED, counts);
            check(&format!("lead over {name}"), lead, Wanted::Above(0.0));
            let (name, lead) = self.nearest(&[Model::Cascaded], counts);
            check(&format!("lead over {name}"), lead, Wanted::Told);
        }
        for speed in self.levels(|s| s.speed).into_iter().filter(|speed| *speed != TUNED) {
            let counts = |s: &Setting| s.contrast <= FAINT && s.speed == speed;
            for models in [NAMED, &[Model::Cascaded]] {
                let (name, lead) = self.nearest(models, counts);
                checks.push(Check::new(format!("{speed} px/frame: lead over {name}"), lead, "", Wanted::Told));
            }
        }
        checks
    }

    /// The best of these models, with either rejection, and by how much the subject leads it.
    fn nearest(&self, models: &[Model], counts: impl Fn(&Setting) -> bool + Copy) -> (&str, f64) {
        let among = (0..self.entrants.len()).filter(|i| models.contains(&self.entrants[*i].params.model));
        let best = among.map(|i| (self.area(i, counts).value, i)).max_by(|a, b| a.0.total_cmp(&b.0));
        let (_, best) = best.expect("every model takes part");
        (self.entrants[best].name, self.lead(best, counts).value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_students() {
        let mean = Mean::of(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        // t = 2.776, standard error sqrt(2.5 / 5).
        assert!((mean.value - 3.0).abs() < 1e-12 && (mean.half - 2.776 * 0.5f64.sqrt()).abs() < 1e-12);
        assert!(Mean::of(&[1.0]).half.is_nan());
    }
}
