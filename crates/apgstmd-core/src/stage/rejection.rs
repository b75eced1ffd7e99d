//! Rejection: peaks of E are linked into traces; E' keeps E near peaks whose trace is confirmed.
//!
//! Input: E, P. Output: E', the confirmed peaks, the background's motion. State: traces, background. `off` keeps
//! everything; `contrast` asks that directional contrast vary along the trace (STMD+); `motion` asks that the trace move,
//! in a line, relative to the background.

use crate::filter::peaks::{Peak, PeakFinder, most};
use crate::frame::Size;
use crate::memory::heap;
use crate::params::{BackgroundMotion, Params, RejectionMode};
use crate::plane::Plane;
use crate::region::Region;
use crate::row::bands::{Bands, Rows};
use crate::stage::background::{Background, Finding};
use crate::stage::contrast::{Contrast, ORIENTATIONS};
use crate::stage::traces::{Course, Point, Trace, Traces};
use crate::state::remember;
use crate::tiles::{Area, Grid};

/// N: maps of E, 8 directions or one that has none.
pub(crate) struct Rejection<const N: usize> {
    mode: RejectionMode,
    finder: PeakFinder,
    min_points: usize,
    /// Points that are judged.
    window: usize,
    least: Least,
    pub background: Background,
    /// The last of the frames that are computed together.
    frame: usize,
    pub contrast: Contrast,
    traces: Traces,
    /// Confirmed peaks of this frame, with their traces.
    pub confirmed: Vec<(Peak, Evidence)>,
    kept: Kept<N>,
}

/// E'.
struct Kept<const N: usize> {
    /// Of no size where all of E is kept.
    maps: [Plane; N],
    /// Around each peak.
    radius: usize,
    grid: Grid,
    /// Tiles in which E' may not be zero.
    tiles: Vec<bool>,
}

/// What the trace of a peak has shown so far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evidence {
    pub trace: u64,
    pub points: u32,
    pub course: Course,
}

heap!(Evidence);

/// Rows of the bands in which E is copied.
const KEPT_ROWS: usize = 64;

/// Where E comes from.
pub(crate) trait Responses<const N: usize>: Sync {
    /// max over directions of E.
    fn strongest(&self) -> &Plane;

    /// Writes E of an area to `out`, of which the first row is row `first` of the picture.
    fn copy(&self, bands: &Bands, area: &Area, first: usize, out: &mut [Rows<'_>; N]);
}

/// E that is at hand, with the largest over directions.
impl<const N: usize> Responses<N> for (&[Plane; N], &Plane) {
    fn strongest(&self) -> &Plane {
        self.1
    }

    fn copy(&self, _: &Bands, area: &Area, first: usize, out: &mut [Rows<'_>; N]) {
        let columns = area.left..area.left + area.columns;
        for (out, e) in out.iter_mut().zip(self.0) {
            for y in area.top..area.top + area.rows {
                out.part(y - first, columns.clone()).copy_from_slice(&e.row(y)[columns.clone()]);
            }
        }
    }
}

impl<const N: usize> Kept<N> {
    fn everything(&self) -> bool {
        self.maps[0].size().area() == 0
    }

    /// Copies E around the peaks.
    fn copy(&mut self, bands: &Bands, peaks: &[(Peak, Evidence)], e: &impl Responses<N>) {
        if self.everything() {
            return;
        }
        let Self { maps, radius, grid, tiles } = self;
        let (size, stride) = (maps[0].size(), maps[0].stride());
        for (peak, _) in peaks {
            grid.touching(&around(peak, *radius, size)).for_each(|tile| tiles[tile] = true);
        }
        let maps = maps.each_mut().map(|plane| Rows { data: plane.data_mut(), stride });
        bands.over_long(size.height, KEPT_ROWS, maps, |range, mut maps| {
            for (peak, _) in peaks {
                let Area { top, left, rows, columns } = around(peak, *radius, size);
                let (first, last) = (top.max(range.start), (top + rows).min(range.end));
                if first < last {
                    e.copy(bands, &Area { top: first, left, rows: last - first, columns }, range.start, &mut maps);
                }
            }
        });
    }

    /// Makes zero again what was copied.
    fn clear(&mut self, peaks: &[(Peak, Evidence)]) {
        if self.everything() {
            return;
        }
        for (peak, _) in peaks {
            let Area { top, left, rows, columns } = around(peak, self.radius, self.maps[0].size());
            for map in &mut self.maps {
                (top..top + rows).for_each(|y| map.row_mut(y)[left..left + columns].fill(0.0));
            }
        }
        self.tiles.fill(false);
    }
}

/// Within `radius` of a peak.
fn around(peak: &Peak, radius: usize, size: Size) -> Area {
    let (top, left) = (peak.y.saturating_sub(radius), peak.x.saturating_sub(radius));
    let rows = (peak.y + radius + 1).min(size.height) - top;
    Area { top, left, rows, columns: (peak.x + radius + 1).min(size.width) - left }
}

/// What a confirmed trace must have shown.
struct Least {
    deviation: f64,
    distance: f64,
    straightness: f64,
}

heap!(const N => Kept<N> { maps, tiles });
heap!(const N => Rejection<N> { background, contrast, finder, traces, confirmed, kept });
remember!(const N => Rejection<N> { background, traces });

impl<const N: usize> Rejection<N> {
    /// For `together` frames at once.
    pub fn new(size: Size, params: &Params, together: usize) -> Self {
        let rejection = &params.rejection;
        let (window, min_points) = match rejection.mode {
            RejectionMode::Off => (1, 0),
            RejectionMode::Contrast => (rejection.contrast_window, rejection.contrast_min_points),
            RejectionMode::Motion => (params.motion_window(), rejection.motion_min_points),
        };
        let peak_radius = params.detection.peak_radius as usize;
        let max_peaks = (params.detection.max_peaks as usize).min(most(size, peak_radius));
        // With `off` E' is E itself.
        let kept_size = if rejection.mode == RejectionMode::Off { Size::new(0, 0) } else { size };
        Self {
            mode: rejection.mode,
            finder: PeakFinder::new(size, peak_radius, params.detection.threshold as f32, max_peaks),
            min_points: min_points as usize,
            window: window as usize,
            least: Least {
                deviation: rejection.contrast_deviation,
                distance: rejection.motion_distance,
                straightness: rejection.motion_straightness,
            },
            background: Background::new(size, params, together),
            frame: 0,
            contrast: Contrast::new(rejection),
            traces: Traces::new(
                params.gate(),
                rejection.max_missed,
                max_peaks,
                window as usize,
                rejection.background == BackgroundMotion::Similarity,
            ),
            confirmed: Vec::with_capacity(max_peaks),
            kept: Kept {
                maps: std::array::from_fn(|_| Plane::new(kept_size)),
                radius: rejection.keep_radius as usize,
                grid: Grid::new(size),
                tiles: vec![rejection.mode == RejectionMode::Off; Grid::new(size).count()],
            },
        }
    }

    /// Whether the scene is cut before a frame: then whatever remembers earlier frames must forget them. Call it before
    /// anything else sees P, for each of the frames that are computed together, until the first cut.
    pub fn look(&mut self, bands: &Bands, p: &Plane, frame: usize) -> bool {
        self.background.look(bands.level(), p, frame)
    }

    /// After `look` found a cut before `frame`: this is the first frame from now on.
    pub fn begin_at(&mut self, frame: usize) {
        self.background.begin_at(frame);
    }

    /// Peaks elsewhere are none from now on. Where E must be known for that, all the picture if none.
    pub fn look_in(&mut self, region: Option<&Region>) -> Option<Region> {
        self.finder.region = region.cloned();
        // A peak is told by all that is near it.
        region.map(|region| region.dilated(self.finder.radius() + 1))
    }

    /// Follows the background, which needs nothing but P: call it between `look` and `process`.
    pub fn follow(&mut self, bands: &Bands, p: &Plane, frame: usize) {
        self.background.follow(bands.level(), p, frame);
    }

    /// Confirms peaks and makes E' of this frame.
    pub fn process(&mut self, bands: &Bands, p: &Plane, frame: usize, e: &impl Responses<N>) {
        self.frame = frame;
        let Finding { motion, cut, .. } = *self.background.found(frame);
        if cut {
            self.traces.end();
        }
        let Self { finder, traces, confirmed, kept, .. } = self;
        let leave = || {
            traces.carry(&motion);
            kept.clear(confirmed);
        };
        bands.both(|| finder.find(bands, e.strongest()), leave);
        let (mode, contrast) = (self.mode, &self.contrast);
        self.traces.link(&self.finder.peaks, &motion, |peak| Point {
            place: (f64::from(peak.sub_x), f64::from(peak.sub_y)),
            step: 0.0,
            contrast: if mode == RejectionMode::Contrast {
                contrast.at(p, peak.x, peak.y)
            } else {
                [0.0; ORIENTATIONS]
            },
        });
        self.confirmed.clear();
        for (index, peak) in self.finder.peaks.iter().enumerate() {
            let trace = self.traces.of_peak(index);
            if self.confirms(trace) {
                let evidence = Evidence { trace: trace.id, points: trace.count, course: trace.course() };
                self.confirmed.push((*peak, evidence));
            }
        }
        self.kept.copy(bands, &self.confirmed, e);
    }

    fn confirms(&self, trace: &Trace) -> bool {
        if trace.points.len() < self.min_points {
            return false;
        }
        match self.mode {
            RejectionMode::Off => true,
            RejectionMode::Contrast => trace.contrast_deviation(self.window) >= self.least.deviation,
            RejectionMode::Motion => {
                let (net, path) = trace.movement(self.window);
                net >= self.least.distance && net >= self.least.straightness * path
            }
        }
    }

    /// E': E within `keep_radius` of a confirmed peak, zero elsewhere; with `off`, E itself.
    pub fn kept<'a>(&'a self, e: &'a [Plane; N]) -> &'a [Plane; N] {
        if self.kept.everything() { e } else { &self.kept.maps }
    }

    /// Tiles in which E' may not be zero.
    pub fn kept_tiles(&self) -> &[bool] {
        &self.kept.tiles
    }

    /// The background's motion since the last frame.
    pub fn background(&self) -> &Finding {
        self.background.found(self.frame)
    }

    pub fn reset(&mut self) {
        self.kept.clear(&self.confirmed);
        self.confirmed.clear();
        self.background.reset();
        self.traces.reset();
    }
}
