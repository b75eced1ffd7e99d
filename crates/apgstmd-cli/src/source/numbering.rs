//! Whether the pictures of a sequence are all there, by the numbers in their names.

/// Numbers that a sequence leaves out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Missing {
    /// How many.
    pub count: usize,
    /// The name before the first of them.
    pub after: String,
}

/// Looks for holes in names that count: that have one number that grows, mostly by the same step, and never by less. Time
/// stamps and frames picked by hand do not count like that, and nothing is known of them.
pub(super) fn missing<'a>(names: impl IntoIterator<Item = &'a str>) -> Option<Missing> {
    let mut names = names.into_iter();
    let mut before = names.next()?;
    let mut steps = Vec::new();
    for name in names {
        match grown(before, name) {
            Some(0) => return None,
            Some(step) => steps.push((step, before)),
            // Another series begins, as in another folder.
            None => (),
        }
        before = name;
    }
    let usual = steps.iter().map(|(step, _)| *step).min()?;
    let (even, holes): (Vec<_>, Vec<_>) = steps.into_iter().partition(|(step, _)| *step == usual);
    let (_, after) = holes.first()?;
    let counts = even.len() > holes.len() && holes.iter().all(|(step, _)| step.is_multiple_of(usual));
    let count = holes.iter().fold(0, |count: u128, (step, _)| count.saturating_add(step / usual - 1));
    let count = usize::try_from(count).unwrap_or(usize::MAX);
    counts.then(|| Missing { count, after: (*after).to_owned() })
}

/// By how much the number grows in which alone two names differ.
fn grown(before: &str, name: &str) -> Option<u128> {
    let (a, b) = (before.as_bytes(), name.as_bytes());
    let same = a.iter().zip(b).take_while(|(a, b)| a == b).count();
    let begin = same - a[..same].iter().rev().take_while(|byte| byte.is_ascii_digit()).count();
    let (a, b) = (&a[begin..], &b[begin..]);
    let digits = |text: &[u8]| text.iter().take_while(|byte| byte.is_ascii_digit()).count();
    let ((number_a, rest_a), (number_b, rest_b)) = (a.split_at(digits(a)), b.split_at(digits(b)));
    let value = |digits: &[u8]| std::str::from_utf8(digits).ok()?.parse::<u128>().ok();
    if rest_a != rest_b { None } else { value(number_b)?.checked_sub(value(number_a)?) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(names: &[&str]) -> Option<(usize, String)> {
        missing(names.iter().copied()).map(|missing| (missing.count, missing.after))
    }

    #[test]
    fn holes_are_seen() {
        let names = ["f_8.png", "f_9.png", "f_10.png", "f_13.png", "f_14.png", "f_16.png", "f_17.png"];
        assert_eq!(of(&names), Some((3, "f_10.png".to_owned())));
        assert_eq!(
            of(&["a/0090_x2.png", "a/0100_x2.png", "a/0110_x2.png", "a/0140_x2.png"]),
            Some((2, "a/0110_x2.png".into()))
        );
        // Two series.
        assert_eq!(
            of(&["a/1.png", "a/2.png", "a/4.png", "b/7.png", "b/8.png", "b/9.png"]),
            Some((1, "a/2.png".into()))
        );
    }

    #[test]
    fn whole_sequences_and_names_that_do_not_count() {
        for names in [
            &["f_098.png", "f_099.png", "f_100.png"][..],
            &["f_2.png", "f_4.png", "f_6.png"],
            // Time stamps with jitter, frames picked by hand.
            &["1000.png", "1040.png", "1081.png", "1120.png"],
            &["1.png", "2.png", "9.png", "40.png"],
            &["a.png", "b.png", "c.png"],
            &["01.png", "1.png", "2.png", "5.png"],
            &["1.png"],
            &[],
        ] {
            assert_eq!(of(names), None, "{names:?}");
        }
        let long = |end: &str| format!("{}{end}.png", "9".repeat(60));
        assert_eq!(missing([&*long("1"), &long("2"), &long("5")]), None);
    }
}
