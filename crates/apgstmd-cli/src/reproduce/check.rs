//! A number, the rule for it, and whether it holds.

use std::fmt;

use serde::Serialize;

/// A measured number and its rule.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// What was measured.
    pub what: String,
    /// How much.
    pub measured: f64,
    /// Of both numbers.
    pub unit: &'static str,
    /// How much it must be.
    pub wanted: Wanted,
}

/// How much it must be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Wanted {
    /// Less than this.
    Below(f64),
    /// More than this.
    Above(f64),
    /// This or more.
    AtLeast(f64),
    /// From the first to the second.
    Between(f64, f64),
    /// This and nothing else.
    Exactly(f64),
    /// No rule: it is only told.
    Told,
}

impl Check {
    /// A rule applied.
    pub fn new(what: impl Into<String>, measured: f64, unit: &'static str, wanted: Wanted) -> Self {
        Self { what: what.into(), measured, unit, wanted }
    }

    /// Whether there is a rule.
    pub fn is_ruled(&self) -> bool {
        self.wanted != Wanted::Told
    }

    /// `yes`, `NO`, or that there is no rule.
    pub fn verdict(&self) -> &'static str {
        match (self.is_ruled(), self.holds()) {
            (_, false) => "NO",
            (true, true) => "yes",
            (false, true) => "-",
        }
    }

    /// Whether it is as it must be. What is not a number never is.
    pub fn holds(&self) -> bool {
        let value = self.measured;
        match self.wanted {
            Wanted::Below(limit) => value < limit,
            Wanted::Above(limit) => value > limit,
            Wanted::AtLeast(limit) => value >= limit,
            Wanted::Between(low, high) => (low..=high).contains(&value),
            Wanted::Exactly(only) => value == only,
            Wanted::Told => !value.is_nan(),
        }
    }

    /// The measured number with its unit.
    pub fn measured(&self) -> String {
        with_unit(&digits(self.measured), self.unit)
    }

    /// The rule with its unit.
    pub fn wanted(&self) -> String {
        if self.is_ruled() { with_unit(&self.wanted.to_string(), self.unit) } else { self.wanted.to_string() }
    }
}

impl fmt::Display for Wanted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Below(limit) => write!(f, "below {}", digits(*limit)),
            Self::Above(limit) => write!(f, "above {}", digits(*limit)),
            Self::AtLeast(limit) => write!(f, "at least {}", digits(*limit)),
            Self::Between(low, high) => write!(f, "{} to {}", digits(*low), digits(*high)),
            Self::Exactly(only) => write!(f, "{}", digits(*only)),
            Self::Told => f.write_str("no rule"),
        }
    }
}

fn with_unit(text: &str, unit: &str) -> String {
    if unit.is_empty() { text.to_owned() } else { format!("{text} {unit}") }
}

/// Four significant digits, no more than it has.
fn digits(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    if !(1e-3..1e5).contains(&size) {
        return format!("{value:.2e}");
    }
    let decimals = (3 - size.log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules() {
        let holds = |measured, wanted| Check::new("", measured, "", wanted).holds();
        assert!(holds(1.0, Wanted::Below(1.1)) && !holds(1.1, Wanted::Below(1.1)));
        assert!(holds(1.2, Wanted::Above(1.1)) && !holds(1.1, Wanted::Above(1.1)));
        assert!(holds(1.1, Wanted::AtLeast(1.1)) && !holds(1.0, Wanted::AtLeast(1.1)));
        assert!(holds(2.0, Wanted::Between(2.0, 2.3)) && !holds(2.31, Wanted::Between(2.0, 2.3)));
        assert!(holds(8.0, Wanted::Exactly(8.0)) && !holds(7.0, Wanted::Exactly(8.0)));
        for wanted in
            [Wanted::Below(1.0), Wanted::Above(1.0), Wanted::Between(0.0, 1.0), Wanted::Exactly(1.0), Wanted::Told]
        {
            assert!(!holds(f64::NAN, wanted), "{wanted}");
        }
    }

    #[test]
    fn words() {
        let check = Check::new("E at 100 px/s", 15.6789, "%", Wanted::Below(20.0));
        assert_eq!((check.measured().as_str(), check.wanted().as_str()), ("15.68 %", "below 20 %"));
        assert_eq!((check.verdict(), Check { measured: 21.0, ..check }.verdict()), ("yes", "NO"));
        let told = Check::new("share", 3.0, "%", Wanted::Told);
        assert_eq!((told.wanted().as_str(), told.verdict(), told.holds()), ("no rule", "-", true));
        assert_eq!(digits(8.6543e-4), "8.65e-4");
        assert_eq!((digits(0.12500001), digits(250.0), digits(0.0)), ("0.125".into(), "250".into(), "0".into()));
        assert_eq!(Wanted::Between(2.0, 2.3).to_string(), "2 to 2.3");
    }
}
