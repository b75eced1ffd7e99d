//! The timeline: as many bins as a screen can show, twice as wide whenever they run out.

use apgstmd_core::tracking::{TrackPoint, TrackState};
use serde::Serialize;

use super::camera::{Bars, Most};
use super::{rounded, significant};
use crate::sink::{Seen, WEAK};

/// Bins at most.
const MOST: usize = 1024;

#[derive(Clone, Copy, Debug, Default)]
struct Bin {
    first: usize,
    last: usize,
    frames: usize,
    detections: usize,
    tracked: usize,
    best: f32,
    camera: Most,
}

impl Bin {
    fn join(self, other: Self) -> Self {
        Self {
            first: self.first,
            last: other.last,
            frames: self.frames + other.frames,
            detections: self.detections + other.detections,
            tracked: self.tracked + other.tracked,
            best: self.best.max(other.best),
            camera: self.camera.join(other.camera),
        }
    }
}

#[derive(Debug)]
pub(super) struct Bins {
    bins: Vec<Bin>,
    /// Frames a bin.
    width: usize,
    /// Score so far.
    strongest: f32,
}

/// As the page takes it.
#[derive(Serialize)]
pub(super) struct Columns {
    width: usize,
    first: Vec<usize>,
    last: Vec<usize>,
    /// A frame, on average.
    detections: Vec<f64>,
    tracked: Vec<f64>,
    /// Strongest score.
    best: Vec<f64>,
    /// Null where the camera did not move.
    camera: Option<Bars>,
}

impl Bins {
    pub fn new() -> Self {
        Self { bins: Vec::new(), width: 1, strongest: 0.0 }
    }

    pub fn add(&mut self, seen: &Seen) {
        let bin = Bin {
            first: seen.frame,
            last: seen.frame,
            frames: 1,
            detections: seen.detections.len(),
            tracked: 0,
            best: seen.detections.iter().map(|found| found.score).fold(0.0, f32::max),
            camera: Most::of(seen),
        };
        match self.bins.last_mut() {
            Some(last) if last.frames < self.width => *last = last.join(bin),
            _ => {
                if self.bins.len() == MOST {
                    self.bins = self.bins.chunks(2).filter_map(|pair| pair.iter().copied().reduce(Bin::join)).collect();
                    self.width *= 2;
                }
                self.bins.push(bin);
            }
        }
        self.strongest = self.strongest.max(bin.best);
        let least = WEAK * self.strongest;
        let strong = |point: &&TrackPoint| point.score >= least || point.state == TrackState::Coasting;
        for point in seen.tracks.iter().filter(strong) {
            self.count(point);
        }
    }

    /// A point may belong to an earlier frame.
    fn count(&mut self, point: &TrackPoint) {
        let after = self.bins.partition_point(|bin| bin.first <= point.frame);
        if let Some(bin) = after.checked_sub(1).and_then(|index| self.bins.get_mut(index)) {
            bin.tracked += 1;
        }
    }

    pub fn columns(&self, camera: bool) -> Columns {
        let each = |value: fn(&Bin) -> f64| self.bins.iter().map(value).collect::<Vec<f64>>();
        Columns {
            width: self.width,
            first: self.bins.iter().map(|bin| bin.first).collect(),
            last: self.bins.iter().map(|bin| bin.last).collect(),
            detections: each(|bin| rounded(bin.detections as f64 / bin.frames as f64, 2)),
            tracked: each(|bin| rounded(bin.tracked as f64 / bin.frames as f64, 2)),
            best: each(|bin| significant(f64::from(bin.best))),
            camera: camera.then(|| Most::bars(&self.bins.iter().map(|bin| bin.camera).collect::<Vec<_>>())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{Picture, Pixels};
    use apgstmd_core::Detection;

    #[test]
    fn nothing_is_lost_when_bins_double() {
        let mut bins = Bins::new();
        for frame in 0..10_000 {
            let pixels = Pixels::U8(ndarray::Array3::zeros((1, 1, 1)));
            let mut seen = Seen::bare(2 * frame, Picture { pixels, bits: None });
            seen.detections = vec![Detection { score: frame as f32, ..Detection::default() }; 2];
            seen.background_shift = (0.0, if frame == 4567 { 7.0 } else { -1.0 });
            seen.cut = frame % 5000 == 4321;
            bins.add(&seen);
        }
        assert!(bins.width == 16 && bins.bins.len() <= MOST);
        let sum = |value: fn(&Bin) -> usize| bins.bins.iter().map(value).sum::<usize>();
        assert_eq!((sum(|bin| bin.frames), sum(|bin| bin.detections)), (10_000, 20_000));
        assert_eq!(sum(|bin| bin.camera.cuts), 2);
        let moved: Vec<f32> = bins.bins.iter().map(|bin| bin.camera.shift).collect();
        assert!(moved[4567 / 16] == 7.0 && moved.iter().filter(|shift| **shift == 1.0).count() == moved.len() - 1);
        assert!(bins.bins.windows(2).all(|pair| pair[0].last < pair[1].first && pair[0].best < pair[1].best));
    }
}
