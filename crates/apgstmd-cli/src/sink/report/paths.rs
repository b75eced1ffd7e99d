//! The ways of all tracks, as many points as there is room for: then every second of each, and of many tracks those that
//! were seen longest.

use std::collections::BTreeMap;

use apgstmd_core::tracking::{TrackPoint, TrackState};
use serde::Serialize;

use super::{rounded, significant};
use crate::sink::WEAK;

/// Points that are kept.
const MOST: usize = 120_000;
/// Frames for which a track may rest and still go on.
const ALIVE: usize = 500;

#[derive(Clone, Debug, Default)]
struct Path {
    points: Vec<(usize, f32, f32)>,
    /// The newest, on its way to `points` where every so-manieth goes.
    newest: (usize, f32, f32),
    every: usize,
    count: usize,
    confirmed: usize,
    best: f32,
    speed: f64,
    times: Option<(f64, f64)>,
}

#[derive(Debug, Default)]
pub(super) struct Paths {
    tracks: BTreeMap<u64, Path>,
    points: usize,
    left_out: usize,
}

/// As the page takes it.
#[derive(Serialize)]
pub(super) struct Record {
    track: u64,
    frame: Vec<usize>,
    x: Vec<f64>,
    y: Vec<f64>,
    /// Points in all, and those that were seen.
    count: usize,
    confirmed: usize,
    best: f64,
    /// Relative to the background, the mean, px/frame.
    speed: f64,
    /// Seconds, first and last.
    times: Option<(f64, f64)>,
}

impl Paths {
    pub fn add(&mut self, points: &[TrackPoint]) {
        for point in points {
            let path = self.tracks.entry(point.track).or_default();
            path.every = path.every.max(1);
            path.newest = (point.frame, point.x as f32, point.y as f32);
            if path.count.is_multiple_of(path.every) {
                path.points.push(path.newest);
                self.points += 1;
            }
            path.count += 1;
            path.confirmed += usize::from(point.state == TrackState::Confirmed);
            path.best = path.best.max(point.score);
            path.speed += point.vx.hypot(point.vy);
            if let Some(time) = point.time {
                path.times = Some((path.times.map_or(time, |(first, _)| first), time));
            }
        }
        if self.points > MOST {
            self.thin(points.iter().map(|point| point.frame).max().unwrap_or(0));
        }
    }

    fn thin(&mut self, now: usize) {
        for path in self.tracks.values_mut().filter(|path| path.points.len() > 8) {
            let mut index = 0;
            path.points.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            path.every *= 2;
        }
        let total = |tracks: &BTreeMap<u64, Path>| tracks.values().map(|path| path.points.len()).sum::<usize>();
        self.points = total(&self.tracks);
        if self.points > MOST / 2 {
            // Thousands of short ones: the shorter half goes, of those that have ended.
            let ended = self.tracks.iter().filter(|(_, path)| path.newest.0 + ALIVE < now);
            let mut ended: Vec<(usize, u64)> = ended.map(|(track, path)| (path.confirmed, *track)).collect();
            ended.sort_unstable();
            for (_, track) in &ended[..ended.len() / 2] {
                self.tracks.remove(track);
                self.left_out += 1;
            }
            self.points = total(&self.tracks);
        }
    }

    /// Tracks that there was no room for.
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// How many are not far weaker than the best.
    pub fn strong(&self) -> usize {
        let best = self.tracks.values().map(|path| path.best).fold(0.0, f32::max);
        self.tracks.values().filter(|path| path.best >= WEAK * best).count()
    }

    /// Those that were seen longest and best first.
    pub fn records(&self) -> Vec<Record> {
        let record = |(track, path): (&u64, &Path)| {
            let mut points = path.points.clone();
            if points.last() != Some(&path.newest) {
                points.push(path.newest);
            }
            Record {
                track: *track,
                frame: points.iter().map(|point| point.0).collect(),
                x: points.iter().map(|point| rounded(f64::from(point.1), 1)).collect(),
                y: points.iter().map(|point| rounded(f64::from(point.2), 1)).collect(),
                count: path.count,
                confirmed: path.confirmed,
                best: significant(f64::from(path.best)),
                speed: rounded(path.speed / path.count as f64, 2),
                times: path.times.map(|(first, last)| (rounded(first, 3), rounded(last, 3))),
            }
        };
        let mut records: Vec<Record> = self.tracks.iter().map(record).collect();
        let weight = |record: &Record| record.best * (record.confirmed as f64).sqrt();
        records.sort_by(|a, b| weight(b).total_cmp(&weight(a)).then(a.track.cmp(&b.track)));
        records
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(track: u64, frame: usize) -> TrackPoint {
        let (x, y) = (frame as f64, track as f64);
        let (time, state) = (Some(x / 10.0), TrackState::Confirmed);
        TrackPoint { frame, time, track, x, y, vx: 1.0, vy: 0.0, score: 0.5, state, age: 1 }
    }

    #[test]
    fn a_long_track_keeps_its_ends() {
        let mut paths = Paths::default();
        for frame in 0..300_000 {
            paths.add(&[point(0, frame)]);
        }
        assert!(paths.points <= MOST);
        let record = &paths.records()[0];
        assert_eq!((record.frame[0], record.frame.last(), record.count), (0, Some(&299_999), 300_000));
        assert_eq!((record.speed, record.times), (1.0, Some((0.0, 29_999.9))));
        assert!(record.frame.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn of_many_short_tracks_the_longer_stay() {
        let mut paths = Paths::default();
        for track in 0..100_000u64 {
            let length = if track % 100 == 0 { 40 } else { 4 };
            let points: Vec<TrackPoint> = (0..length).map(|k| point(track, 10 * track as usize + k)).collect();
            paths.add(&points);
        }
        assert!(paths.points <= MOST && paths.left_out() > 10_000);
        assert_eq!(paths.left_out() + paths.records().len(), 100_000);
        assert_eq!(paths.tracks.keys().filter(|track| **track % 100 == 0).count(), 1000);
    }
}
