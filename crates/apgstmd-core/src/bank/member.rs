//! A detector of the bank at work: its detections as candidates in pixels of the full picture, with equivalent contrasts.
//!
//! The equivalent contrast of a detection is the geometric mean of two: of the response, (Q / Q of the ideal target at
//! contrast 1)^(1/3), since Q is cubic in contrast, and of the spot's difference from its surround against the
//! ideal target's. Either alone is fooled: the response by strong edges, the spot by whatever stands still.
//!
//! A member that takes several frames as one holds its detections until the next: they go on with their speed and with
//! the background.

use serde::{Deserialize, Serialize};

use super::exposure::Exposure;
use super::params::{BankParams, Member};
use super::pyramid::{Level, reduced};
use super::spot::{Ideal, Profile, farthest, places};
use super::window;
use crate::detection::{Detection, Response};
use crate::detector::Detector;
use crate::error::ParamError;
use crate::frame::Size;
use crate::memory::{Heap, Memory, heap, owned};
use crate::model::lag;
use crate::params::Localise;
use crate::plane::Plane;
use crate::region::{Region, RegionError};
use crate::row::bands::Bands;
use crate::row::machine::Machine;
use crate::row::workers::Workers;
use crate::stage::background::{Finding, Motion};
use crate::state::{Remember, StateError, Visit};
use crate::tiles::TILE;
use crate::timing::Timing;

/// Frames after which a trace that is not seen is forgotten.
const FORGOTTEN: u64 = 16;
/// Points of a trace after which more of them count no more.
const MOST_POINTS: f32 = 60.0;
/// Net displacement after which more of it counts no more, px of the full picture: branches that sway come less far.
const FAR: f32 = 20.0;
/// The way of a trace that is faster, px/frame of its own scale, is its direction; that of slower ones is known better by the response.
const FAST: f32 = 0.9;

/// What a bank remembers of a trace of a member.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Known {
    pub trace: u64,
    /// Frame it was last seen in.
    last: u64,
    profile: Profile,
    /// Its number in the bank.
    pub id: Option<u64>,
}

heap!(Known);

/// A detection of a member, on its way to be merged.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Candidate {
    /// In pixels of the full picture, with its score.
    pub found: Detection,
    /// Number of the trace in the member.
    pub trace: u64,
    /// How it moves relative to the background, px/frame of the full picture.
    drift: (f32, f32),
}

heap!(Candidate);

/// Measured on the ideal target.
#[derive(Clone, Copy, Debug)]
pub(super) struct Calibration {
    /// Q at contrast 1.
    pub response: f32,
    pub lag: f32,
}

pub(super) struct Running {
    pub member: Member,
    exposure: Exposure,
    /// Whether the frames taken are still to be processed.
    pub due: bool,
    detector: Detector,
    calibration: Calibration,
    ideal: Ideal,
    /// Places that a target is looked for at.
    places: usize,
    /// By the number of their trace.
    pub known: Vec<Known>,
    pub candidates: Vec<Candidate>,
    /// Of the last frame.
    pub timing: Timing,
    /// How its window lay beside the picture when it last processed a frame, whole pixels.
    pub beside: (isize, isize),
}

impl Heap for Running {
    fn heap(&self) -> Memory {
        self.exposure.heap() + self.detector.memory() + self.known.heap() + self.candidates.heap()
    }
}

impl Remember for Running {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        visit.part("detector", &mut self.detector)?;
        visit.part("exposure", &mut self.exposure)?;
        if self.holds() {
            visit.part("beside", &mut window::Pixels(&mut self.beside))?;
            let most = window::farthest(self.member.scale) as isize;
            let near = |side: isize| side.clamp(-most, most);
            self.beside = (near(self.beside.0), near(self.beside.1));
        }
        let most = (self.known.capacity(), self.candidates.capacity());
        let sound = |(known, held): &(Vec<Known>, Vec<Candidate>)| {
            let has = |candidate: &Candidate| known.binary_search_by_key(&candidate.trace, |known| known.trace).is_ok();
            (known.len() <= most.0 && held.len() <= most.1)
                && known.is_sorted_by(|a, b| a.trace < b.trace)
                && known.iter().all(|known| known.profile.is_sound())
                && held.iter().all(|candidate| candidate.is_sound() && has(candidate))
        };
        let held = if self.holds() { self.candidates.clone() } else { Vec::new() };
        if let Some((known, held)) = visit.record("known", || (self.known.clone(), held), sound)? {
            self.known.clear();
            self.known.extend(known);
            self.candidates.clear();
            self.candidates.extend(held);
        }
        Ok(())
    }
}

impl Running {
    pub fn new(
        member: Member,
        full: Size,
        bank: &BankParams,
        machine: &Machine,
        ideal: Ideal,
        alike: Option<Calibration>,
    ) -> Result<Self, ParamError> {
        let params = bank.of(&member)?;
        params.validate()?;
        let size = reduced(full, member.scale);
        // It runs on the threads of the bank.
        let own = Workers::new(&Machine { threads: 1, ..*machine })?;
        let mut detector = Detector::made(size, &params, machine, own);
        detector.share();
        let exposure = Exposure::new(size, member.exposure());
        let calibration = alike.unwrap_or_else(|| {
            let mut moved = params.clone();
            moved.detection.localise = Localise::Target;
            let (simd, taken) = (detector.simd(), exposure.length);
            Calibration { response: lag::response(&params, simd, 1.0, taken), lag: lag::measure(&moved, simd, taken) }
        });
        let peaks = params.detection.max_peaks as usize;
        Ok(Self {
            member,
            exposure,
            due: false,
            detector,
            calibration,
            ideal,
            places: places(calibration.lag),
            known: Vec::with_capacity(peaks * (FORGOTTEN as usize + 2)),
            candidates: Vec::with_capacity(peaks),
            timing: Timing::default(),
            beside: (0, 0),
        })
    }

    /// What it will hold, about, with what it shows.
    pub fn needs(member: &Member, full: Size, bank: &BankParams, machine: &Machine) -> Result<Memory, ParamError> {
        let size = reduced(full, member.scale);
        let maps = if member.exposure() == 1 { 2 } else { 3 };
        Ok(Detector::needs(size, &bank.of(member)?, machine) + owned(maps * Plane::bytes(size)))
    }

    /// Sees what can be of a target in the region.
    pub fn look_in(&mut self, region: Option<&Region>) -> Result<(), RegionError> {
        let reach = farthest(self.calibration.lag) + window::farthest(self.member.scale);
        let reduced = region.map(|region| region.reduced(self.member.scale).dilated(reach));
        self.detector.look_in(reduced.as_ref())
    }

    /// Lets go of candidates elsewhere.
    pub fn report_in(&mut self, region: &Region) {
        self.candidates.retain(|candidate| region.contains(candidate.found.x, candidate.found.y));
    }

    pub fn own_speed(&self) -> f64 {
        self.member.own_speed()
    }

    pub fn calibration(&self) -> Calibration {
        self.calibration
    }

    /// Of a dark target, px of its own scale.
    pub fn lag(&self) -> f32 {
        self.calibration.lag
    }

    pub fn latency(&self) -> usize {
        self.detector.latency() * self.exposure.length
    }

    /// Whether its detections and maps stand for more than one frame.
    pub fn holds(&self) -> bool {
        self.exposure.length > 1
    }

    pub fn make_response(&self) -> Response {
        self.detector.make_response()
    }

    pub fn reset(&mut self, seen: &mut Response) {
        seen.clear();
        self.exposure.reset();
        self.beside = (0, 0);
        self.detector.reset();
        self.known.clear();
        self.candidates.clear();
    }

    /// Takes frame `frame` since the start. It is `due` where that is to be processed, else its candidates and maps go on.
    pub fn take(&mut self, frame: u64, level: &Level, seen: &mut Response) {
        self.timing = Timing::default();
        let found = &level.found;
        self.due = self.exposure.take(frame, &level.window.scroll(), &level.told());
        if self.due {
            return;
        }
        if found.cut {
            self.candidates.clear();
            seen.clear();
        }
        self.candidates.retain_mut(|candidate| candidate.go_on(found, self.member.scale as f32));
    }

    /// Processes what was taken, and makes candidates of what it shows.
    pub fn process(&mut self, bands: &Bands, level: &Level, seen: &mut Response) {
        self.due = false;
        let scroll = self.exposure.scroll(level.window.scroll());
        self.detector.process_seen(bands, (&scroll, &self.exposure.found), seen, &mut self.timing);
        let now = self.detector.frames();
        self.known.retain(|known| now.saturating_sub(known.last) <= FORGOTTEN);
        self.candidates.clear();
        let p_size = self.detector.size();
        let (beside, new) = (level.window.beside, level.new_for(self.member.own_speed()));
        self.beside = (beside.0.round() as isize, beside.1.round() as isize);
        for found in &seen.detections {
            let index = match self.known.binary_search_by_key(&found.trace, |known| known.trace) {
                Ok(index) => index,
                Err(index) => {
                    let begun = Known { trace: found.trace, last: now, profile: Profile::EMPTY, id: None };
                    self.known.insert(index, begun);
                    index
                }
            };
            let known = &mut self.known[index];
            known.last = now;
            let mut moved = *found;
            let (dx, dy) = found.velocity;
            if !found.direction.is_nan() && dx.hypot(dy) >= FAST {
                moved.direction = (-dy).atan2(dx);
            }
            known.profile.add(new, (found.x, found.y), moved.direction, self.places);
            let Some(spot) = known.profile.spot(self.places, !found.direction.is_nan()) else { continue };
            moved.move_ahead(spot.ahead);
            moved.x += beside.0 as f32;
            moved.y += beside.1 as f32;
            let inside = |place: f32, length: usize| (0.0..length as f32).contains(&(place + 0.5));
            if !inside(moved.x, p_size.width) || !inside(moved.y, p_size.height) {
                continue;
            }
            let of_response = self.equivalent(found.score);
            let of_spot = (spot.difference.abs() / self.ideal.difference).min(1.0);
            let contrast = (of_response * of_spot).sqrt();
            let scale = self.member.scale as f32;
            let share = scale / self.exposure.taken as f32;
            let mut found = Detection {
                x: full(moved.x, scale),
                y: full(moved.y, scale),
                displacement: found.displacement * scale,
                velocity: (dx * share, dy * share),
                contrast,
                speed: self.member.speed as f32,
                size: found.size * scale,
                ..moved
            };
            found.score = contrast * evidence(&found);
            self.candidates.push(Candidate { found, trace: found.trace, drift: self.drift(&moved) });
        }
    }

    /// What the bank remembers of a trace that has a candidate.
    pub fn known_mut(&mut self, trace: u64) -> &mut Known {
        let index = self.known.binary_search_by_key(&trace, |known| known.trace);
        &mut self.known[index.expect("every candidate's trace is known")]
    }

    /// How what is found, in pixels of its own scale, moves relative to the background, px/frame of the full picture.
    fn drift(&self, found: &Detection) -> (f32, f32) {
        if found.direction.is_nan() {
            return (0.0, 0.0);
        }
        let (speed, share) = (self.member.speed as f32, self.member.scale as f32 / self.exposure.taken as f32);
        // Its window goes along with the shift.
        let turned = Motion { shift: (0.0, 0.0), ..self.exposure.found.motion };
        let passed = turned.at((f64::from(found.x), f64::from(found.y)));
        let (dx, dy) = (speed * found.direction.cos(), -speed * found.direction.sin());
        (dx - share * passed.0 as f32, dy - share * passed.1 as f32)
    }

    /// Weber contrast of the ideal target with response `q`.
    fn equivalent(&self, q: f32) -> f32 {
        if self.calibration.response > 0.0 { (q / self.calibration.response).cbrt().min(1.0) } else { 0.0 }
    }
}

impl Candidate {
    /// Goes on for a frame, seen at a scale. Whether it is still in the picture.
    fn go_on(&mut self, background: &Finding, scale: f32) -> bool {
        let Self { found: Detection { x, y, .. }, drift, .. } = self;
        let passed = background.motion.at((f64::from(reduced_place(*x, scale)), f64::from(reduced_place(*y, scale))));
        *x += drift.0 + scale * passed.0 as f32;
        *y += drift.1 + scale * passed.1 as f32;
        let (right, below) = background.motion.middle;
        let inside = |place: f32, middle: f64| (0.0..=2.0 * middle).contains(&f64::from(reduced_place(place, scale)));
        inside(*x, right) && inside(*y, below)
    }

    fn is_sound(&self) -> bool {
        let Detection { x, y, score, straightness, displacement, contrast, speed, size, velocity, .. } = self.found;
        let (right, down) = self.drift;
        let all = [x, y, score, straightness, displacement, contrast, speed, size, right, down, velocity.0, velocity.1];
        all.iter().all(|value| value.is_finite())
    }
}

/// In the full picture: the centre of pixel 0 of a reduced one lies between pixels.
fn full(place: f32, scale: f32) -> f32 {
    (place + 0.5) * scale - 0.5
}

fn reduced_place(place: f32, scale: f32) -> f32 {
    (place + 0.5) / scale - 0.5
}

/// What its trace says of a detection, 0 to 1: how straight it is, how long it has been seen, and how far it has come.
fn evidence(found: &Detection) -> f32 {
    let seen = (found.points as f32 / MOST_POINTS).min(1.0) * (found.displacement / FAR).min(1.0);
    found.straightness.powi(2) * seen.sqrt()
}

/// A row of the bank's maps: the largest equivalent contrast over the members, and the direction there.
pub(super) fn map_row(members: &[Running], seen: &[Response], y: usize, map: &mut [f32], direction: &mut [f32]) {
    map.fill(0.0);
    direction.fill(f32::NAN);
    // Nothing of most of a frame.
    let mut shown = 0..0;
    for (running, seen) in members.iter().zip(seen) {
        let (scale, unit, (right, down)) = (running.member.scale, running.calibration.response, running.beside);
        let (height, width) = seen.map.dim();
        let row = (y / scale).checked_add_signed(-down).filter(|row| *row < height && y / scale < height);
        let Some(row) = row.filter(|_| unit > 0.0) else { continue };
        let (q, angle) = (seen.map.row(row), seen.direction.row(row));
        let (Some(q), Some(angle)) = (q.as_slice(), angle.as_slice()) else { continue };
        for (first, q) in (0..).step_by(TILE).zip(q.chunks(TILE)) {
            if q.iter().fold(0, |any, value| any | value.to_bits()) == 0 {
                continue;
            }
            // Of the picture.
            let visible = 0.max(-right).max(first as isize)..(width as isize - right).min((first + q.len()) as isize);
            if visible.is_empty() {
                continue;
            }
            let visible = visible.start as usize..visible.end as usize;
            let column = |place: usize| scale * place.saturating_add_signed(right);
            let columns = column(visible.start)..column(visible.end);
            shown = if shown.is_empty() {
                columns.clone()
            } else {
                shown.start.min(columns.start)..shown.end.max(columns.end)
            };
            let out = map[columns.clone()].chunks_exact_mut(scale).zip(direction[columns].chunks_exact_mut(scale));
            let seen = q[visible.start - first..visible.end - first].iter().zip(&angle[visible]);
            for ((q, angle), (map, direction)) in seen.zip(out) {
                let value = q / unit;
                for (map, direction) in map.iter_mut().zip(direction) {
                    if value > *map {
                        (*map, *direction) = (value, *angle);
                    }
                }
            }
        }
    }
    for value in map[shown].iter_mut().filter(|value| **value > 0.0) {
        *value = value.cbrt().min(1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_trace_says() {
        let complete = Detection { straightness: 1.0, points: 60, displacement: 20.0, ..Detection::default() };
        assert_eq!(evidence(&complete), 1.0);
        assert_eq!(evidence(&Detection { straightness: 0.5, ..complete }), 0.25);
        assert_eq!(evidence(&Detection { points: 15, ..complete }), 0.5);
        assert_eq!(evidence(&Detection { displacement: 5.0, ..complete }), 0.5);
        assert_eq!(evidence(&Detection { displacement: 0.0, ..complete }), 0.0);
    }

    #[test]
    fn a_candidate_goes_on_with_the_background_until_it_leaves() {
        let nothing = Finding::nothing(Size::new(50, 100));
        let pan = Finding { motion: Motion { shift: (8.0, -1.0), ..nothing.motion }, ..nothing };
        let found = Detection { x: 100.0, y: 40.0, ..Detection::default() };
        let mut candidate = Candidate { found, trace: 0, drift: (0.25, 0.5) };
        let mut places = Vec::new();
        while candidate.go_on(&pan, 2.0) {
            places.push((candidate.found.x, candidate.found.y));
        }
        // The reduced picture has 100 columns, the full one 200.
        assert_eq!(places, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(|t| (100.0 + 16.25 * t, 40.0 - 1.5 * t)));
    }
}
