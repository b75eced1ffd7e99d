//! Where each trace was in the last frames.

use std::collections::HashMap;

use apgstmd_core::Detection;
use apgstmd_core::tracking::TrackPoint;

/// Frames a trail reaches back.
const LENGTH: usize = 48;

/// Frames after which the trail of a track that is not seen ends.
const UNSEEN: usize = 16;

/// One past position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::sink) struct Place {
    pub frame: usize,
    pub x: f32,
    pub y: f32,
}

/// Past positions by trace.
#[derive(Default)]
pub(in crate::sink) struct Trails {
    places: HashMap<u64, Vec<Place>>,
    frames: Vec<usize>,
}

impl Trails {
    /// Adds a frame's detections and forgets what is too long ago.
    pub fn add(&mut self, frame: usize, detections: &[Detection]) {
        self.frames.push(frame);
        if self.frames.len() > LENGTH {
            self.frames.remove(0);
        }
        for detection in detections {
            let place = Place { frame, x: detection.x, y: detection.y };
            self.places.entry(detection.trace).or_default().push(place);
        }
        self.forget();
    }

    /// Adds points of tracks that became certain with a frame, of which some may be earlier. A track that nobody has seen
    /// for a while has no trail any more.
    pub fn add_points<'a>(&mut self, frame: usize, points: impl Iterator<Item = &'a TrackPoint>) {
        self.frames.push(frame);
        if self.frames.len() > LENGTH {
            self.frames.remove(0);
        }
        for point in points {
            let place = Place { frame: point.frame, x: point.x as f32, y: point.y as f32 };
            self.places.entry(point.track).or_default().push(place);
        }
        self.forget();
        let recent = self.frames[self.frames.len().saturating_sub(UNSEEN)];
        self.places.retain(|_, places| places.last().is_some_and(|place| place.frame >= recent));
    }

    fn forget(&mut self) {
        let oldest = self.frames[0];
        self.places.retain(|_, places| {
            places.retain(|place| place.frame >= oldest);
            !places.is_empty()
        });
    }

    /// Oldest first; the last one may be some frames ago.
    pub fn all(&self) -> impl Iterator<Item = (u64, &[Place])> {
        let mut traces: Vec<_> = self.places.iter().map(|(trace, places)| (*trace, places.as_slice())).collect();
        traces.sort_by_key(|(trace, _)| *trace);
        traces.into_iter()
    }

    /// 1 for a place in the newest frame, towards 0 for the oldest that is kept.
    pub fn freshness(&self, place: &Place) -> f32 {
        let age = self.frames.iter().rev().take_while(|frame| **frame > place.frame).count();
        1.0 - age as f32 / LENGTH as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trails_are_bounded_and_fade() {
        let mut trails = Trails::default();
        for frame in 0..200 {
            let detection = Detection { x: frame as f32, trace: u64::from(frame >= 20), ..Detection::default() };
            trails.add(2 * frame, &[detection]);
        }
        let all: Vec<_> = trails.all().collect();
        assert_eq!(all.len(), 1);
        assert_eq!(all[0].1.len(), LENGTH);
        assert_eq!(trails.freshness(all[0].1.last().unwrap()), 1.0);
        assert!(trails.freshness(&all[0].1[0]) < 0.05);
    }
}
