//! Rejection: peaks of max over theta of E, their traces, and which traces are targets.

use apgstmd_core::Params;
use apgstmd_core::params::{BackgroundMotion, RejectionMode};

use ndarray::Array2;

use super::map::Map;
use super::motion::{Motion, middle};

/// A maximum of its neighbourhood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peak {
    /// Pixel.
    pub pixel: (usize, usize),
    /// max over theta of E there.
    pub value: f64,
    /// Sub-pixel position (x, y).
    pub place: (f64, f64),
}

/// Peaks, strongest first (equals in raster order): above the threshold and 0, at least as high as every later pixel
/// (raster order) of the (2r + 1)^2 neighbourhood clipped to the image, higher than every earlier one. So a plateau
/// gives one peak. Peaks outside `region` are none.
pub fn peaks(map: &Map, params: &Params, region: Option<&Array2<bool>>) -> Vec<Peak> {
    let (height, width) = map.dim();
    let radius = params.detection.peak_radius as usize;
    let mut found = Vec::new();
    for ((y, x), &value) in map.indexed_iter() {
        if value <= params.detection.threshold || value <= 0.0 {
            continue;
        }
        let mut highest = true;
        for ny in y.saturating_sub(radius)..=(y + radius).min(height - 1) {
            for nx in x.saturating_sub(radius)..=(x + radius).min(width - 1) {
                let other = map[[ny, nx]];
                highest &= if (ny, nx) < (y, x) { value > other } else { value >= other };
            }
        }
        if highest {
            let dx = if x == 0 || x + 1 == width { 0.0 } else { vertex(map[[y, x - 1]], value, map[[y, x + 1]]) };
            let dy = if y == 0 || y + 1 == height { 0.0 } else { vertex(map[[y - 1, x]], value, map[[y + 1, x]]) };
            found.push(Peak { pixel: (y, x), value, place: (x as f64 + dx, y as f64 + dy) });
        }
    }
    found.retain(|peak| region.is_none_or(|region| region[peak.pixel]));
    found.sort_by(|a, b| b.value.total_cmp(&a.value)); // stable
    found.truncate(params.detection.max_peaks as usize);
    found
}

/// Where the parabola through (-1, l), (0, c), (1, r) has its maximum, at most half a pixel away.
fn vertex(l: f64, c: f64, r: f64) -> f64 {
    let curvature = l - 2.0 * c + r;
    if curvature < 0.0 { ((l - r) / (2.0 * curvature)).clamp(-0.5, 0.5) } else { 0.0 }
}

struct Trace {
    id: u64,
    place: (f64, f64),
    velocity: (f64, f64),
    /// The last place carried along with the background, and the velocity relative to that.
    carried: (f64, f64),
    drift: (f64, f64),
    missed: u32,
    /// Places, carried along with the background to the present frame, oldest first.
    relative: Vec<(f64, f64)>,
    /// Contrast vectors, oldest first.
    contrast: Vec<[f64; 4]>,
}

/// A peak whose trace is a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Confirmed {
    /// The peak of this frame.
    pub peak: Peak,
    /// Number of its trace.
    pub trace: u64,
}

/// All traces.
#[derive(Default)]
pub struct Traces {
    /// In order of creation.
    traces: Vec<Trace>,
    next: u64,
}

impl Traces {
    /// Ends all traces; numbers go on.
    pub fn end(&mut self) {
        self.traces.clear();
    }

    /// Links the peaks of a frame and returns those of confirmed traces, strongest first. `motion` is the background's.
    pub fn step(&mut self, peaks: &[Peak], c: &[Map], motion: &Motion, params: &Params) -> Vec<Confirmed> {
        let middle = middle(c[0].dim());
        let both = params.rejection.background == BackgroundMotion::Similarity;
        for trace in &mut self.traces {
            trace.relative.iter_mut().for_each(|place| *place = motion.carry(*place, middle));
            trace.carried = motion.carry(trace.carried, middle);
        }
        let gate = params.rejection.gate + params.rejection.gate_frames * params.prediction.v_opt;
        let peak_of = self.closest_pairs(peaks, gate, both);

        let mut trace_of = vec![None; peaks.len()];
        for (trace, matched) in self.traces.iter_mut().zip(&peak_of) {
            match matched {
                Some(peak) => {
                    let place = peaks[*peak].place;
                    let frames = f64::from(trace.missed + 1);
                    let step = ((place.0 - trace.place.0) / frames, (place.1 - trace.place.1) / frames);
                    trace.velocity = (0.7 * trace.velocity.0 + 0.3 * step.0, 0.7 * trace.velocity.1 + 0.3 * step.1);
                    trace.place = place;
                    let drift = ((place.0 - trace.carried.0) / frames, (place.1 - trace.carried.1) / frames);
                    trace.drift = (0.7 * trace.drift.0 + 0.3 * drift.0, 0.7 * trace.drift.1 + 0.3 * drift.1);
                    trace.carried = place;
                    trace.missed = 0;
                    trace_of[*peak] = Some(trace.id);
                }
                None => trace.missed += 1,
            }
        }
        self.traces.retain(|trace| trace.missed <= params.rejection.max_missed);
        for (peak, trace_of) in peaks.iter().zip(&mut trace_of) {
            if trace_of.is_none() {
                *trace_of = Some(self.next);
                self.traces.push(Trace {
                    id: self.next,
                    place: peak.place,
                    velocity: if both { (0.0, 0.0) } else { motion.shift },
                    carried: peak.place,
                    drift: (0.0, 0.0),
                    missed: 0,
                    relative: Vec::new(),
                    contrast: Vec::new(),
                });
                self.next += 1;
            }
        }

        let mut confirmed = Vec::new();
        for (&peak, id) in peaks.iter().zip(trace_of) {
            let trace = self.traces.iter_mut().find(|trace| Some(trace.id) == id).expect("every peak has a trace");
            trace.relative.push(peak.place);
            trace.contrast.push([0, 1, 2, 3].map(|j| c[j][peak.pixel]));
            if trace.is_target(params) {
                confirmed.push(Confirmed { peak, trace: trace.id });
            }
        }
        confirmed
    }

    /// The peak of every trace: the closest pairs within the gate first (then trace order, then peak order).
    fn closest_pairs(&self, peaks: &[Peak], gate: f64, both: bool) -> Vec<Option<usize>> {
        let mut pairs = Vec::new();
        for (t, trace) in self.traces.iter().enumerate() {
            let frames = f64::from(trace.missed + 1);
            let after = |place: (f64, f64), v: (f64, f64)| (place.0 + v.0 * frames, place.1 + v.1 * frames);
            let (seen, carried) = (after(trace.place, trace.velocity), after(trace.carried, trace.drift));
            for (p, peak) in peaks.iter().enumerate() {
                let off = |(x, y): (f64, f64)| (peak.place.0 - x).hypot(peak.place.1 - y);
                let distance = if both { off(seen).min(off(carried)) } else { off(seen) };
                if distance <= gate {
                    pairs.push((distance, t, p));
                }
            }
        }
        pairs.sort_by(|a, b| a.partial_cmp(b).expect("distances are finite"));
        let mut peak_of = vec![None; self.traces.len()];
        for (_, t, p) in pairs {
            if peak_of[t].is_none() && !peak_of.contains(&Some(p)) {
                peak_of[t] = Some(p);
            }
        }
        peak_of
    }
}

impl Trace {
    fn is_target(&self, params: &Params) -> bool {
        let rejection = &params.rejection;
        match rejection.mode {
            RejectionMode::Off => true,
            RejectionMode::Contrast => {
                let judged = last(&self.contrast, rejection.contrast_window);
                let deviation = |j: usize| {
                    let mean = judged.iter().map(|c| c[j]).sum::<f64>() / judged.len() as f64;
                    (judged.iter().map(|c| (c[j] - mean).powi(2)).sum::<f64>() / judged.len() as f64).sqrt()
                };
                judged.len() >= rejection.contrast_min_points as usize
                    && (0..4).map(deviation).fold(0.0, f64::max) >= rejection.contrast_deviation
            }
            RejectionMode::Motion => {
                let judged = last(&self.relative, params.motion_window());
                let distance = |a: (f64, f64), b: (f64, f64)| (b.0 - a.0).hypot(b.1 - a.1);
                let net = distance(judged[0], judged[judged.len() - 1]);
                let path: f64 = judged.windows(2).map(|pair| distance(pair[0], pair[1])).sum();
                judged.len() >= rejection.motion_min_points as usize
                    && net >= rejection.motion_distance
                    && net >= rejection.motion_straightness * path
            }
        }
    }
}

fn last<T>(points: &[T], window: u32) -> &[T] {
    &points[points.len().saturating_sub(window as usize)..]
}

/// E' = E within `keep_radius` (square) of a confirmed peak, else 0; without rejection E' = E.
pub fn keep(e: &[Map], confirmed: &[Confirmed], params: &Params) -> Vec<Map> {
    if params.rejection.mode == RejectionMode::Off {
        return e.to_vec();
    }
    let radius = params.rejection.keep_radius as usize;
    let near = |y: usize, x: usize| {
        confirmed.iter().any(|c| c.peak.pixel.0.abs_diff(y) <= radius && c.peak.pixel.1.abs_diff(x) <= radius)
    };
    e.iter().map(|e| Map::from_shape_fn(e.dim(), |(y, x)| if near(y, x) { e[[y, x]] } else { 0.0 })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_found_where_it_is() {
        let map = Map::from_shape_fn((20, 20), |(y, x)| {
            (10.0 - (x as f64 - 7.3).powi(2) - 0.5 * (y as f64 - 11.8).powi(2)).max(0.0)
        });
        let found = peaks(&map, &Params::default(), None);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].pixel, (12, 7));
        assert!((found[0].place.0 - 7.3).abs() < 1e-12 && (found[0].place.1 - 11.8).abs() < 1e-12);
    }

    #[test]
    fn a_plateau_gives_one_peak() {
        let found = peaks(&Map::ones((9, 9)), &Params::default(), None);
        assert_eq!(found.iter().map(|peak| peak.pixel).collect::<Vec<_>>(), [(0, 0)]);
    }

    #[test]
    fn moving_with_the_background_is_no_target() {
        let mut params = Params::default();
        params.rejection.mode = RejectionMode::Motion;
        let c = vec![Map::zeros((60, 60)); 4];
        let run = |shift: (f64, f64)| {
            let mut traces = Traces::default();
            let mut last = Vec::new();
            for t in 0..12 {
                let (x, y) = (5 + t, 20);
                let peak = Peak { pixel: (y, x), value: 1.0, place: (x as f64, y as f64) };
                last = traces.step(&[peak], &c, &Motion { shift, ..Motion::NONE }, &params);
            }
            last.iter().map(|c| c.trace).collect::<Vec<_>>()
        };
        assert_eq!(run((0.0, 0.0)), [0]);
        assert_eq!(run((1.0, 0.0)), [] as [u64; 0]);
    }
}
