//! Prediction: F(t) = (mu E'(t) + (1 - mu) F(t - dt)) * W_p, M = sum over directions of F.
//!
//! Input: E' and the memorizer's F(t - dt). Output: F and M into the memorizer. No state of its own. W_p is a ring of
//! radius v_opt dt, denser along the direction. Only tiles within the kernel's reach of something are computed, and in
//! them only rows of the source that are not zero.

use std::ops::Range;

use fearless_simd::Level;

use crate::DIRECTIONS;
use crate::direction::angle;
use crate::filter::kernel::bessel_i0;
use crate::filter::patch::Patch;
use crate::memory::heap;
use crate::params::Params;
use crate::plane::Plane;
use crate::row::bands::{Bands, Rows, Scratch, Slice};
use crate::row::convolve::correlate_tile;
use crate::stage::memorizer::{BLOCK, Gains, Memorizer, TILE_AREA};
use crate::tiles::{Grid, TILE};

pub(crate) struct Prediction {
    enabled: bool,
    mu: f32,
    floor: f32,
    radius: usize,
    /// W_p of each direction, turned by half a circle: what is correlated with it is convolved with W_p.
    kernels: [Vec<f32>; DIRECTIONS],
    /// Directions of E' that are not zero, by tile.
    pub fresh: Vec<u8>,
    jobs: Vec<Job>,
    computed: usize,
    /// Largest M of the last frame.
    peak: f32,
    scratch: Scratch<Work>,
}

/// What all tiles of a frame read.
struct Source<'a> {
    level: Level,
    kept: &'a [Plane; DIRECTIONS],
    past: &'a Gains,
    grid: &'a Grid,
    floor: f32,
}

struct Work {
    patch: Patch,
    /// Columns of each row of the patch outside which it is zero.
    spans: Vec<Range<usize>>,
}

/// Gains below this share of the largest M are zero. They could neither open a region of attention nor be seen in Q, but
/// would spread over the whole picture, frame by frame.
const NEGLIGIBLE: f32 = 1e-7;

#[derive(Clone, Copy)]
struct Job {
    tile: usize,
    /// Directions that something reaches; after the work, those that are not zero.
    mask: u8,
    peak: f32,
}

/// W_p for a direction, (2 radius + 1) squared row by row, unit sum.
fn kernel(params: &Params, radius: usize, theta: f64) -> Vec<f64> {
    let prediction = &params.prediction;
    let reach = prediction.v_opt * f64::from(prediction.horizon);
    let r = radius as isize;
    let value = |dx: f64, dy: f64| {
        let distance = dx.hypot(dy);
        let ring = (-(distance - reach).powi(2) / (2.0 * prediction.ring_width.powi(2))).exp();
        // Both angular factors relative to the largest, exp(eta), so that no eta overflows.
        let angular = if distance == 0.0 {
            bessel_i0(prediction.concentration) * (-prediction.concentration).exp()
        } else {
            (prediction.concentration * ((-dy).atan2(dx) - theta).cos() - prediction.concentration).exp()
        };
        ring * angular
    };
    let mut values: Vec<f64> =
        (-r..=r).flat_map(|dy| (-r..=r).map(move |dx| (dx as f64, dy as f64))).map(|(dx, dy)| value(dx, dy)).collect();
    let sum: f64 = values.iter().sum();
    values.iter_mut().for_each(|value| *value /= sum);
    values
}

heap!(Job);
heap!(Work { patch, spans });
heap!(Prediction { kernels, fresh, jobs, scratch });

impl Prediction {
    pub fn new(params: &Params, grid: &Grid, threads: usize) -> Self {
        let prediction = &params.prediction;
        let reach = prediction.v_opt * f64::from(prediction.horizon);
        let radius = (reach + 3.0 * prediction.ring_width).ceil() as usize;
        let kernels =
            std::array::from_fn(|k| kernel(params, radius, angle(k)).into_iter().rev().map(|tap| tap as f32).collect());
        Self {
            enabled: prediction.enabled,
            mu: prediction.mu as f32,
            // Four orders below the response floor: what it removes could not open a region of attention.
            floor: (params.lobula.response_floor * 1e-4).max(1e-30) as f32,
            radius,
            kernels,
            fresh: vec![0; grid.count()],
            jobs: Vec::with_capacity(grid.count()),
            computed: 0,
            peak: 0.0,
            scratch: Scratch::new(threads, || {
                let side = TILE + 2 * radius;
                Work { patch: Patch::with_capacity(side, side), spans: Vec::with_capacity(side) }
            }),
        }
    }

    /// Writes F and M of this frame into the memorizer; `kept` is E'.
    pub fn process(&mut self, bands: &Bands, kept: &[Plane; DIRECTIONS], memorizer: &mut Memorizer) {
        let grid = memorizer.grid;
        let (past, present) = memorizer.oldest_and_present();
        let size = kept[0].size();
        let fresh = crate::tiles::PerTile { values: &mut self.fresh, across: grid.across };
        bands.over_tiles(size.height, fresh, |range, fresh| {
            for (column, mask) in fresh.values.iter_mut().enumerate() {
                *mask = directions_present(kept, &grid, grid.holding(column * TILE, range.start));
            }
        });
        if !self.enabled {
            return;
        }
        self.jobs.clear();
        for tile in 0..grid.count() {
            let around = grid.around(tile, self.radius);
            let mask = around.fold(0, |mask, near| mask | self.fresh[near] | past.mask[near]);
            let mask = if bands.dense() { u8::MAX } else { mask };
            if mask != 0 {
                self.jobs.push(Job { tile, mask, peak: 0.0 });
            }
        }
        self.computed = self.jobs.iter().map(|job| job.mask.count_ones() as usize).sum();
        let floor = self.floor.max(NEGLIGIBLE * self.peak);
        let source = Source { level: bands.level(), kept, past, grid: &grid, floor };
        let mut jobs = std::mem::take(&mut self.jobs);
        let blocks = Rows { data: present.blocks(jobs.len()), stride: BLOCK };
        bands.each((Slice(&mut jobs), blocks), |(jobs, mut blocks)| {
            for (index, job) in jobs.0.iter_mut().enumerate() {
                self.scratch.with(bands, |work| self.predict(&source, job, blocks.row(index), work));
            }
        });
        for (block, job) in jobs.iter().enumerate() {
            present.set(job.tile, block, job.mask);
            present.peak = present.peak.max(job.peak);
        }
        self.peak = present.peak;
        self.jobs = jobs;
    }

    /// Tiles computed in the last frame, times directions.
    pub fn tiles(&self) -> usize {
        self.computed
    }

    pub fn reset(&mut self) {
        self.computed = 0;
        self.peak = 0.0;
        self.fresh.fill(0);
    }

    /// F and M of one tile.
    fn predict(&self, source: &Source<'_>, job: &mut Job, block: &mut [f32], work: &mut Work) {
        let (f, m) = block.split_at_mut(DIRECTIONS * TILE_AREA);
        let area = source.grid.area(job.tile);
        m.fill(0.0);
        for (k, f) in f.chunks_exact_mut(TILE_AREA).enumerate() {
            if job.mask & 1 << k == 0 {
                f.fill(0.0);
                continue;
            }
            self.gather(source, job.tile, k, work);
            let Work { patch, spans } = work;
            correlate_tile(source.level, &patch.data, patch.stride, spans, &self.kernels[k], f);
            let mut any = false;
            for (y, f) in f.chunks_exact_mut(TILE).enumerate() {
                let inside = if y < area.rows { area.columns } else { 0 };
                f[inside..].fill(0.0);
                for (f, m) in f[..inside].iter_mut().zip(&mut m[y * TILE..]) {
                    *f = if *f < source.floor { 0.0 } else { *f };
                    *m += *f;
                    any |= *f > 0.0;
                }
            }
            if !any {
                job.mask &= !(1 << k);
            }
        }
        job.peak = m.iter().copied().fold(0.0, f32::max);
    }

    /// mu E' + (1 - mu) F(t - dt) of direction k over a tile and the kernel's reach around it, zero outside.
    fn gather(&self, source: &Source<'_>, tile: usize, k: usize, work: &mut Work) {
        let Source { kept, past, grid, .. } = source;
        let Work { patch, spans } = work;
        let side = TILE + 2 * self.radius;
        patch.shape(side, side);
        patch.data.fill(0.0);
        let center = grid.area(tile);
        for near in grid.around(tile, self.radius) {
            let (fresh, old) =
                (self.fresh[near] >> k & 1 == 1, past.tile(near).filter(|_| past.mask[near] >> k & 1 == 1));
            if !fresh && old.is_none() {
                continue;
            }
            let area = grid.area(near);
            // Columns of the near tile inside the patch: in the picture, and from the patch's left edge.
            let first = (area.left + self.radius).max(center.left) - self.radius;
            let last = (area.left + area.columns).min(center.left + TILE + self.radius);
            for y in area.top..area.top + area.rows {
                let row = (y + self.radius) as isize - center.top as isize;
                if !(0..side as isize).contains(&row) || first >= last {
                    continue;
                }
                let inset = first + self.radius - center.left;
                let out = &mut patch.row_mut(row as usize)[inset..inset + last - first];
                if let Some(block) = old {
                    let start = (y - area.top) * TILE + first - area.left;
                    let f = &block.f(k)[start..start + last - first];
                    out.iter_mut().zip(f).for_each(|(out, f)| *out = (1.0 - self.mu) * f);
                }
                if fresh {
                    let e = &kept[k].row(y)[first..last];
                    out.iter_mut().zip(e).for_each(|(out, e)| *out += self.mu * e);
                }
            }
        }
        spans.clear();
        spans.extend((0..side).map(|y| {
            let row = &patch.row(y)[..side];
            match row.iter().position(|value| *value != 0.0) {
                Some(first) => first..row.iter().rposition(|value| *value != 0.0).map_or(side, |last| last + 1),
                None => 0..0,
            }
        }));
    }
}

/// Which directions of E' are not zero in a tile, as bits.
fn directions_present(kept: &[Plane; DIRECTIONS], grid: &Grid, tile: usize) -> u8 {
    let area = grid.area(tile);
    let mut mask = 0;
    for (k, plane) in kept.iter().enumerate() {
        let mut any = 0;
        for y in area.top..area.top + area.rows {
            let row = &plane.row(y)[area.left..area.left + area.columns];
            any = row.iter().fold(any, |any, value| any | value.to_bits());
        }
        mask |= u8::from(any != 0) << k;
    }
    mask
}
