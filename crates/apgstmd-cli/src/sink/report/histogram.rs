//! How often each score was given, on a logarithmic scale: targets stand out by factors.

use std::collections::BTreeMap;

use serde::Serialize;

/// Bins a factor of ten.
const FINE: f64 = 10.0;

#[derive(Debug, Default)]
pub(super) struct Histogram {
    counts: BTreeMap<i32, u64>,
}

/// A value that the user or the program chose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Mark {
    /// Where it stands.
    pub value: f64,
    /// What it is.
    pub text: String,
}

/// As the page takes it.
#[derive(Serialize)]
pub(super) struct Record {
    name: &'static str,
    /// Decimal logarithm of the lower end of the first bin, and width of a bin.
    from: f64,
    step: f64,
    counts: Vec<u64>,
    marks: Vec<Mark>,
}

impl Histogram {
    pub fn add(&mut self, value: f32) {
        if value > 0.0 {
            *self.counts.entry((FINE * f64::from(value).log10()).floor() as i32).or_default() += 1;
        }
    }

    pub fn record(&self, name: &'static str, marks: Vec<Mark>) -> Option<Record> {
        let (first, last) = (*self.counts.keys().next()?, *self.counts.keys().next_back()?);
        let counts = (first..=last).map(|bin| self.counts.get(&bin).copied().unwrap_or(0)).collect();
        Some(Record { name, from: f64::from(first) / FINE, step: 1.0 / FINE, counts, marks })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_are_factors() {
        let mut histogram = Histogram::default();
        [0.1, 0.105, 1.0, 0.0, f32::NAN].into_iter().for_each(|value| histogram.add(value));
        let record = histogram.record("score", Vec::new()).unwrap();
        assert_eq!((record.from, record.counts.len(), record.counts[0], record.counts[10]), (-1.0, 11, 2, 1));
        assert!(Histogram::default().record("score", Vec::new()).is_none());
    }
}
