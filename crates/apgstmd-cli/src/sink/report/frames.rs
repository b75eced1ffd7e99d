//! Detections frame by frame, as many frames as there is room for: every one, then every second, every fourth.

use serde::Serialize;

use super::camera::{self, Moved};
use super::rounded;
use crate::sink::Seen;

/// Detections that are kept: twenty in each of 20,000 frames.
const MOST_DETECTIONS: usize = 400_000;
/// Frames that are kept.
const MOST_FRAMES: usize = 40_000;

/// A detection as the page draws it.
#[derive(Clone, Copy, Debug)]
struct Spot {
    x: f32,
    y: f32,
    score: f32,
    direction: f32,
}

#[derive(Clone, Debug)]
struct Row {
    frame: usize,
    name: String,
    time: Option<f64>,
    camera: Moved,
    spots: Vec<Spot>,
}

/// What is kept.
#[derive(Debug)]
pub(super) struct Frames {
    rows: Vec<Row>,
    detections: usize,
    /// One of so many is kept.
    every: usize,
    came: usize,
}

/// Columns; the detections of row i stand from `from[i]` to `from[i + 1]`.
#[derive(Serialize)]
pub(super) struct Columns {
    every: usize,
    frame: Vec<usize>,
    /// Null where times are not known.
    time: Option<Vec<f64>>,
    name: Vec<String>,
    from: Vec<usize>,
    x: Vec<f64>,
    y: Vec<f64>,
    score: Vec<f64>,
    /// Null where there is none.
    direction: Vec<Option<f64>>,
    /// Null where the camera did not move.
    camera: Option<camera::Columns>,
}

impl Frames {
    pub fn new() -> Self {
        Self { rows: Vec::new(), detections: 0, every: 1, came: 0 }
    }

    pub fn add(&mut self, seen: &Seen) {
        self.came += 1;
        if !(self.came - 1).is_multiple_of(self.every) {
            return;
        }
        let spots: Vec<Spot> = seen
            .detections
            .iter()
            .map(|found| Spot { x: found.x, y: found.y, score: found.score, direction: found.direction })
            .collect();
        self.detections += spots.len();
        let camera = Moved::of(seen);
        self.rows.push(Row { frame: seen.frame, name: seen.name.clone(), time: seen.time, camera, spots });
        while self.rows.len() > MOST_FRAMES || (self.detections > MOST_DETECTIONS && self.rows.len() > 1) {
            self.every *= 2;
            let mut index = 0;
            self.rows.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.detections = self.rows.iter().map(|row| row.spots.len()).sum();
        }
    }

    /// One of so many frames is kept.
    pub fn every(&self) -> usize {
        self.every
    }

    pub fn columns(&self, camera: bool) -> Columns {
        let moved = || self.rows.iter().map(|row| &row.camera).collect::<Vec<_>>();
        let spots = || self.rows.iter().flat_map(|row| &row.spots);
        let mut from = vec![0];
        for row in &self.rows {
            from.push(from[from.len() - 1] + row.spots.len());
        }
        let known = self.rows.iter().all(|row| row.time.is_some());
        let times = || self.rows.iter().filter_map(|row| row.time).map(|time| rounded(time, 4)).collect();
        Columns {
            every: self.every,
            frame: self.rows.iter().map(|row| row.frame).collect(),
            time: known.then(times),
            name: self.rows.iter().map(|row| row.name.clone()).collect(),
            from,
            x: spots().map(|spot| rounded(f64::from(spot.x), 1)).collect(),
            y: spots().map(|spot| rounded(f64::from(spot.y), 1)).collect(),
            score: spots().map(|spot| super::significant(f64::from(spot.score))).collect(),
            direction: spots()
                .map(|spot| spot.direction.is_finite().then(|| rounded(f64::from(spot.direction), 2)))
                .collect(),
            camera: camera.then(|| Moved::columns(&moved())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::{Picture, Pixels};
    use apgstmd_core::Detection;

    #[test]
    fn a_long_stream_is_thinned_evenly() {
        let mut frames = Frames::new();
        for frame in 0..100_000 {
            let pixels = Pixels::U8(ndarray::Array3::zeros((1, 1, 1)));
            let mut seen = Seen::bare(frame, Picture { pixels, bits: None });
            seen.detections = vec![Detection::default(); frame % 3];
            frames.add(&seen);
        }
        assert_eq!((frames.every(), frames.rows.len()), (4, 25_000));
        let columns = frames.columns(false);
        assert!(columns.frame.iter().enumerate().all(|(index, frame)| *frame == 4 * index));
        assert_eq!(columns.from[columns.frame.len()], columns.x.len());
        assert_eq!(columns.from[2] - columns.from[1], 4 % 3);
    }
}
