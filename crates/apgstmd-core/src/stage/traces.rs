//! Traces: peaks linked from frame to frame, closest pairs first, and what each trace has shown so far.
//!
//! State: the living traces with their last points. A trace is expected at its last place plus its velocity
//! (0.7 v + 0.3 step) and ends after `max_missed` frames without a peak. Points are carried along with the background, so
//! that a path is relative to it, in px of the present picture. A trace begins with the background's velocity; with `both`
//! it is expected in two places: as it moves in the picture, at first not at all, and as it moves relative to the
//! background, at first with it.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use crate::filter::peaks::Peak;
use crate::memory::heap;
use crate::stage::background::Motion;
use crate::stage::contrast::ORIENTATIONS;
use crate::state::{Remember, StateError, Visit};

/// What is remembered of a trace at a frame.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct Point {
    /// Where what it passed is now.
    pub place: (f64, f64),
    /// Distance of that from the trace's point before, px of the present picture.
    pub step: f64,
    /// Directional contrast there.
    pub contrast: [f32; ORIENTATIONS],
}

#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct Trace {
    pub id: u64,
    /// In the picture.
    seen: Track,
    /// Relative to the background, with which the place is carried along.
    carried: Track,
    missed: u32,
    /// Points so far, those that are remembered and earlier ones.
    pub count: u32,
    /// The last ones, as many as are remembered.
    pub points: VecDeque<Point>,
}

/// Where the last points of a trace lead.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Course {
    /// From the first to the last relative to the background, px.
    pub displacement: f32,
    /// That over the length of the path between them.
    pub straightness: f32,
    /// Relative to the background, px/frame, y downward: of the last steps, the latest counting most.
    pub velocity: (f32, f32),
}

/// Beyond any place and velocity of a trace, px: what a course is told of fits into f32.
const FARTHEST: f64 = 1e12;

/// Points over which the course is told.
const REMEMBERED: usize = 60;

/// Where a trace was last, and its velocity, px a frame.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
struct Track {
    place: (f64, f64),
    velocity: (f64, f64),
}

struct Pair {
    distance: f64,
    trace: usize,
    peak: usize,
}

pub(crate) struct Traces {
    gate: f64,
    max_missed: u32,
    window: usize,
    both: bool,
    living: Vec<Trace>,
    /// Ended traces, kept for the memory of their points.
    spare: Vec<Trace>,
    pairs: Vec<Pair>,
    /// Peaks from the top of the picture down.
    downward: Vec<usize>,
    /// Trace of each peak of this frame.
    owner: Vec<Option<usize>>,
    /// Peak of each living trace in this frame.
    found: Vec<Option<usize>>,
    next_id: u64,
}

heap!(Pair, Point);
heap!(Trace { points });
heap!(Traces { living, spare, pairs, downward, owner, found });

impl Remember for Traces {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        visit.part("next_id", &mut self.next_id)?;
        let (most, points) = (self.living.len() + self.spare.len(), self.window.max(REMEMBERED));
        let missed = self.max_missed;
        let sound =
            |living: &Vec<Trace>| living.len() <= most && living.iter().all(|trace| trace.sound(points, missed));
        let Some(loaded) = visit.record("living", || self.living.clone(), sound)? else { return Ok(()) };
        self.end();
        // Into the memory that is there.
        for from in loaded {
            let mut trace = self.spare.pop().expect("no more than there is room for");
            trace.points.clear();
            trace.points.extend(&from.points);
            self.living.push(Trace { points: std::mem::take(&mut trace.points), ..from });
        }
        Ok(())
    }
}

impl Traces {
    /// Room for `most_peaks` a frame and `window` points a trace.
    pub fn new(gate: f64, max_missed: u32, most_peaks: usize, window: usize, both: bool) -> Self {
        // A trace lives only while it was seen in the last max_missed + 1 frames.
        let most = most_peaks * (max_missed as usize + 2);
        let trace = || Trace {
            id: 0,
            seen: Track::default(),
            carried: Track::default(),
            missed: 0,
            count: 0,
            points: VecDeque::with_capacity(window.max(REMEMBERED) + 1),
        };
        Self {
            gate,
            max_missed,
            window,
            both,
            living: Vec::with_capacity(most),
            spare: (0..most).map(|_| trace()).collect(),
            pairs: Vec::with_capacity(2 * most * most_peaks),
            downward: Vec::with_capacity(most_peaks),
            owner: Vec::with_capacity(most_peaks),
            found: Vec::with_capacity(most),
            next_id: 0,
        }
    }

    /// Carries all traces along with the background: call it before `link`.
    pub fn carry(&mut self, motion: &Motion) {
        let zoom = motion.zoom();
        for trace in &mut self.living {
            for point in &mut trace.points {
                point.place = motion.carry(point.place);
                point.step *= zoom;
            }
            trace.carried.place = motion.carry(trace.carried.place);
        }
    }

    /// Links the peaks of a frame; `motion` is the background's since the last, `point` what to remember of a peak.
    pub fn link(&mut self, peaks: &[Peak], motion: &Motion, point: impl Fn(&Peak) -> Point) {
        self.pairs.clear();
        self.downward.clear();
        self.downward.extend(0..peaks.len());
        self.downward.sort_unstable_by(|a, b| peaks[*a].sub_y.total_cmp(&peaks[*b].sub_y));
        for (index, trace) in self.living.iter().enumerate() {
            let frames = f64::from(trace.missed + 1);
            let expected =
                |track: &Track| (track.place.0 + track.velocity.0 * frames, track.place.1 + track.velocity.1 * frames);
            let tracks = [Some(&trace.seen), Some(&trace.carried).filter(|_| self.both)];
            for expected in tracks.into_iter().flatten().map(expected) {
                let below = |peak: &usize| f64::from(peaks[*peak].sub_y) - expected.1;
                let first = self.downward.partition_point(|peak| below(peak) < -self.gate);
                for &peak_index in self.downward[first..].iter().take_while(|peak| below(peak) <= self.gate) {
                    let (dx, dy) = (f64::from(peaks[peak_index].sub_x) - expected.0, below(&peak_index));
                    if dx.abs() > self.gate {
                        continue;
                    }
                    let distance = dx.hypot(dy);
                    if distance <= self.gate {
                        self.pairs.push(Pair { distance, trace: index, peak: peak_index });
                    }
                }
            }
        }
        self.pairs
            .sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance).then((a.trace, a.peak).cmp(&(b.trace, b.peak))));
        self.owner.clear();
        self.owner.resize(peaks.len(), None);
        self.found.clear();
        self.found.resize(self.living.len(), None);
        for pair in &self.pairs {
            if self.owner[pair.peak].is_none() && self.found[pair.trace].is_none() {
                self.owner[pair.peak] = Some(pair.trace);
                self.found[pair.trace] = Some(pair.peak);
            }
        }
        for (trace, found) in self.living.iter_mut().zip(&self.found) {
            match found {
                Some(peak) => trace.follow(&peaks[*peak]),
                None => trace.missed += 1,
            }
        }
        self.forget();
        for (peak, owner) in peaks.iter().zip(&mut self.owner) {
            if owner.is_none() {
                let mut trace = self.spare.pop().expect("room for every trace that can live");
                let place = (f64::from(peak.sub_x), f64::from(peak.sub_y));
                trace.begin(self.next_id, place, if self.both { (0.0, 0.0) } else { motion.at(place) });
                self.next_id += 1;
                *owner = Some(self.living.len());
                self.living.push(trace);
            }
            let trace = &mut self.living[owner.expect("every peak has a trace")];
            trace.remember(point(peak), self.window.max(REMEMBERED));
        }
    }

    /// Ends the traces that were not seen for too long, and renumbers the owners of the peaks.
    fn forget(&mut self) {
        let mut kept = 0;
        for index in 0..self.living.len() {
            if self.living[index].missed <= self.max_missed {
                if let Some(peak) = self.found[index] {
                    self.owner[peak] = Some(kept);
                }
                self.living.swap(kept, index);
                kept += 1;
            }
        }
        self.spare.extend(self.living.drain(kept..));
    }

    /// The trace of a peak of this frame.
    pub fn of_peak(&self, peak: usize) -> &Trace {
        &self.living[self.owner[peak].expect("every peak has a trace")]
    }

    /// Ends all traces. Numbers go on.
    pub fn end(&mut self) {
        self.spare.append(&mut self.living);
    }

    pub fn reset(&mut self) {
        self.end();
        self.next_id = 0;
    }
}

impl Trace {
    /// Whether it can have been saved with at most so many points, and frames without one.
    fn sound(&self, most: usize, missed: u32) -> bool {
        let tracks = [self.seen, self.carried];
        let places = tracks.iter().flat_map(|track| [track.place, track.velocity]);
        let points = self.points.iter().map(|point| point.place);
        let near = |(x, y): (f64, f64)| x.abs() <= FARTHEST && y.abs() <= FARTHEST;
        let of_point =
            |point: &Point| point.step.abs() <= FARTHEST && point.contrast.iter().all(|value| value.is_finite());
        let counted = (1..=most).contains(&self.points.len()) && self.missed <= missed;
        counted && places.chain(points).all(near) && self.points.iter().all(of_point)
    }

    fn begin(&mut self, id: u64, place: (f64, f64), velocity: (f64, f64)) {
        self.id = id;
        self.seen = Track { place, velocity };
        self.carried = Track { place, velocity: (0.0, 0.0) };
        self.missed = 0;
        self.count = 0;
        self.points.clear();
    }

    fn remember(&mut self, mut point: Point, most: usize) {
        point.step = self.points.back().map_or(0.0, |last| distance(last, &point));
        if self.points.len() == most {
            self.points.pop_front();
        }
        self.points.push_back(point);
        self.count = self.count.saturating_add(1);
    }

    fn follow(&mut self, peak: &Peak) {
        let place = (f64::from(peak.sub_x), f64::from(peak.sub_y));
        let frames = f64::from(self.missed + 1);
        for Track { place: last, velocity } in [&mut self.seen, &mut self.carried] {
            let step = ((place.0 - last.0) / frames, (place.1 - last.1) / frames);
            *velocity = (0.7 * velocity.0 + 0.3 * step.0, 0.7 * velocity.1 + 0.3 * step.1);
            *last = place;
        }
        self.missed = 0;
    }

    /// Net displacement and path length of the last `window` points relative to the background, px.
    pub fn movement(&self, window: usize) -> (f64, f64) {
        let first = self.points.len().saturating_sub(window);
        let net = match (self.points.get(first), self.points.back()) {
            (Some(first), Some(last)) => distance(first, last),
            _ => 0.0,
        };
        (net, self.points.iter().skip(first + 1).map(|point| point.step).sum())
    }

    /// What the remembered points come to.
    pub fn course(&self) -> Course {
        let (net, path) = self.movement(REMEMBERED);
        Course {
            displacement: net as f32,
            straightness: if path > 0.0 { (net / path) as f32 } else { 0.0 },
            velocity: (self.carried.velocity.0 as f32, self.carried.velocity.1 as f32),
        }
    }

    /// Largest standard deviation over the orientations of the last `window` contrasts.
    pub fn contrast_deviation(&self, window: usize) -> f64 {
        let first = self.points.len().saturating_sub(window);
        let count = (self.points.len() - first) as f64;
        (0..ORIENTATIONS)
            .map(|j| {
                let values = || self.points.iter().skip(first).map(|point| f64::from(point.contrast[j]));
                let mean = values().sum::<f64>() / count;
                (values().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
            })
            .fold(0.0, f64::max)
    }
}

fn distance(a: &Point, b: &Point) -> f64 {
    (b.place.0 - a.place.0).hypot(b.place.1 - a.place.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Size;

    #[test]
    fn a_course_is_told_beside_the_background() {
        let pan = Motion { shift: (3.0, 4.0), ..Motion::still(Size::new(200, 300)) };
        let mut traces = Traces::new(4.0, 2, 1, 8, true);
        for t in 0..70u8 {
            // Relative to the background it goes left by 1 px a frame; once it is not seen.
            let (x, y) = (10.0 + 2.0 * f32::from(t), 20.0 + 4.0 * f32::from(t));
            let peak = Peak { x: x as usize, y: y as usize, value: 1.0, sub_x: x, sub_y: y };
            traces.carry(&pan);
            let peaks = if t == 40 { &[][..] } else { &[peak] };
            let point = |peak: &Peak| Point {
                place: (f64::from(peak.sub_x), f64::from(peak.sub_y)),
                step: 0.0,
                contrast: [0.0; ORIENTATIONS],
            };
            traces.link(peaks, &pan, point);
        }
        // The last 60 points are those of the last 61 frames.
        let Course { displacement, straightness, velocity } = traces.of_peak(0).course();
        assert!(
            (displacement - 60.0).abs() < 1e-3 && (straightness - 1.0).abs() < 1e-6,
            "{displacement} {straightness}"
        );
        assert!((velocity.0 + 1.0).abs() < 1e-3 && velocity.1.abs() < 1e-3, "{velocity:?}");
    }
}
