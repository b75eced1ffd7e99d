//! When each frame is shown. A video of an even rate plays everywhere, so a frame whose successor is late is shown
//! until then, again and again; none is ever left out.

use super::Rate;

/// Longest pause that is kept, s: a stream that was away for an hour is not an hour of one picture.
const LONGEST: f64 = 2.0;

/// Counts shown frames.
pub(super) struct Clock {
    rate: Rate,
    /// Seconds at the first frame, later for each pause that was cut.
    begin: Option<f64>,
    shown: u64,
}

impl Clock {
    pub fn new(rate: Rate) -> Self {
        Self { rate, begin: None, shown: 0 }
    }

    /// How often a frame of time `from` is shown until that of time `to` comes.
    pub fn times(&mut self, from: Option<f64>, to: Option<f64>) -> u32 {
        let times = match (from, to) {
            (Some(from), Some(to)) if self.rate.true_time => {
                let begin = self.begin.get_or_insert(from);
                let most = (LONGEST * self.rate.shown).ceil().max(1.0);
                // A quarter of a frame early or late is what time stamps in milliseconds make of an even rate.
                let due = (to - *begin) * self.rate.shown - self.shown as f64;
                if due > most {
                    *begin += (due - most) / self.rate.shown;
                }
                due.round().clamp(1.0, most) as u32
            }
            _ => 1,
        };
        self.shown += u64::from(times);
        times
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(rate: f64, stamps: &[f64]) -> Vec<u32> {
        let mut clock = Clock::new(Rate::of(rate));
        stamps.windows(2).map(|pair| clock.times(Some(pair[0]), Some(pair[1]))).collect()
    }

    #[test]
    fn an_even_rate_is_one_each() {
        let stamps: Vec<f64> = (0..100).map(|frame| (f64::from(frame) * 1000.0 / 29.97).round() / 1000.0).collect();
        assert!(times(29.97, &stamps).iter().all(|times| *times == 1));
    }

    #[test]
    fn gaps_are_filled_and_crowds_catch_up() {
        assert_eq!(times(10.0, &[5.0, 5.1, 5.4, 5.5]), [1, 3, 1]);
        assert_eq!(times(10.0, &[0.0, 0.01, 0.02, 0.3, 0.4, 0.5]), [1, 1, 1, 1, 1]);
        assert_eq!(times(10.0, &[0.0, 3600.0, 3600.1, 3600.3]), [20, 1, 2]);
        assert_eq!(times(10.0, &[0.0, 0.0, 0.0]), [1, 1]);
    }

    #[test]
    fn slow_motion_knows_no_gaps() {
        assert_eq!(times(1000.0, &[0.0, 0.001, 0.5]), [1, 1]);
    }
}
