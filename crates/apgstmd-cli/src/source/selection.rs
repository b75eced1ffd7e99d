//! `--start --stop --step`: which frames of a sequence are used.

use crate::Outcome;
use crate::failure::Failure;

/// Frames start, start + step, ... below stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Selection {
    /// First frame.
    pub start: usize,
    /// One past the last candidate.
    pub stop: usize,
    /// Distance between used frames.
    pub step: usize,
}

impl Selection {
    /// Checks the flags against a sequence of `count` frames.
    ///
    /// # Errors
    /// A step of 0, an empty range, a start behind the end.
    pub fn new(start: usize, stop: Option<usize>, step: usize, count: usize) -> Outcome<Self> {
        if step == 0 {
            return Err(Failure::usage("--step is 0, but it must be at least 1 (1 uses every picture)"));
        }
        if let Some(stop) = stop
            && stop <= start
        {
            return Err(Failure::usage(format_args!(
                "--stop {stop} is not above --start {start}: --stop is the first picture no longer used"
            )));
        }
        if start >= count {
            return Err(Failure::usage(format_args!(
                "--start {start} is behind the last picture: INPUT has {count}, numbered 0 to {}",
                count.saturating_sub(1)
            )));
        }
        Ok(Self { start, stop: stop.unwrap_or(count).min(count), step })
    }

    /// All of a sequence.
    pub fn all(count: usize) -> Self {
        Self { start: 0, stop: count, step: 1 }
    }

    /// Selections that take turns, at most `parts` of them: one frame of each, over and over, gives these frames.
    pub fn turns(self, parts: usize) -> impl Iterator<Item = Self> {
        let parts = parts.clamp(1, self.frames().len().max(1));
        (0..parts).map(move |part| Self { start: self.start + part * self.step, step: self.step * parts, ..self })
    }

    /// The selected frames in order.
    pub fn frames(self) -> impl ExactSizeIterator<Item = usize> {
        (self.start..self.stop).step_by(self.step)
    }

    /// The last selected frame.
    pub fn last(self) -> usize {
        self.start + (self.stop - 1 - self.start) / self.step * self.step
    }

    /// Whether `frame` is among them.
    pub fn contains(self, frame: usize) -> bool {
        (self.start..self.stop).contains(&frame) && (frame - self.start).is_multiple_of(self.step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_the_whole() {
        for (start, stop, step) in [(0, 10, 1), (3, 11, 4), (2, 3, 1), (5, 100, 7)] {
            let selection = Selection::new(start, Some(stop), step, 100).unwrap();
            for parts in 0..5 {
                let turns: Vec<Vec<usize>> = selection.turns(parts).map(|turn| turn.frames().collect()).collect();
                assert!(turns.len() <= parts.max(1) && turns.iter().all(|turn| !turn.is_empty()));
                let longest = turns[0].len();
                let whole = (0..longest).flat_map(|i| turns.iter().filter_map(move |turn| turn.get(i).copied()));
                assert_eq!(whole.collect::<Vec<_>>(), selection.frames().collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn selects_as_a_python_slice_does() {
        let selection = Selection::new(3, Some(11), 4, 100).unwrap();
        assert_eq!(selection.frames().collect::<Vec<_>>(), [3, 7]);
        assert_eq!(selection.last(), 7);
        assert!(selection.contains(7) && !selection.contains(8) && !selection.contains(11));
        assert_eq!(Selection::new(0, Some(999), 1, 5).unwrap().frames().len(), 5);
        for (start, stop, step, count) in [(0, None, 0, 5), (3, Some(3), 1, 5), (5, None, 1, 5), (0, None, 1, 0)] {
            assert!(Selection::new(start, stop, step, count).is_err());
        }
    }
}
