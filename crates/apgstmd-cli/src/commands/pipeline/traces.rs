//! How many different traces there were, in memory that does not grow with the length of a run.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Frames after which a trace that is not seen does not come back: twice what detectors and banks remember.
const GONE: usize = 64;

#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Traces {
    count: usize,
    frames: usize,
    /// Number of each, and the frame it was last seen in.
    living: BTreeMap<u64, usize>,
}

impl Traces {
    /// Takes the traces of the next frame, and says how many there were so far.
    pub fn add(&mut self, seen: impl Iterator<Item = u64>) -> usize {
        self.frames += 1;
        for trace in seen {
            self.count += usize::from(self.living.insert(trace, self.frames).is_none());
        }
        if self.frames.is_multiple_of(GONE) {
            self.living.retain(|_, last| *last + GONE > self.frames);
        }
        self.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_counted_once_and_forgotten_later() {
        let mut traces = Traces::default();
        // Each is seen in every third of some 60 frames.
        for t in 0..100_000u64 {
            let count = traces.add((0..20).map(|i| t / 60 * 20 + i).filter(|trace| (t + trace).is_multiple_of(3)));
            assert!(t < 3 || count as u64 == (t / 60 + u64::from(t % 60 >= 2)) * 20 || t % 60 < 2, "{t}: {count}");
            assert!(traces.living.len() < 100);
        }
        assert_eq!(traces.count, 100_000usize.div_ceil(60) * 20);
    }
}
