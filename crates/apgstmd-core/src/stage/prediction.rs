//! Prediction: F(t) = (mu E'(t) + (1 - mu) F(t - dt)) * W_p, M = sum over directions of F.
//!
//! Input: E' and the memorizer's F(t - dt). Output: F and M into the memorizer. No state of its own. W_p is a ring of
//! radius v_opt dt, denser along the direction. Only tiles within the kernel's reach of something are computed, and in
//! them only rows of the source that are not zero.

use crate::DIRECTIONS;
use crate::direction::angle;
use crate::filter::kernel::bessel_i0;
use crate::filter::patch::{Patch, patch_stride};
use crate::params::Params;
use crate::plane::Plane;
use crate::row::bands::{Bands, Rows, Scratch, Slice};
use crate::row::convolve::accumulate;
use crate::stage::memorizer::{BLOCK, Gains, Memorizer, TILE_AREA};
use crate::tiles::{Grid, TILE};

pub(crate) struct Prediction {
    enabled: bool,
    mu: f32,
    floor: f32,
    radius: usize,
    /// For each direction and source row of the kernel: (column in the patch, tap).
    kernels: [Vec<Vec<(usize, f32)>>; DIRECTIONS],
    /// Directions of E' that are not zero, by tile.
    fresh: Vec<u8>,
    jobs: Vec<Job>,
    scratch: Scratch<Patch>,
}

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

impl Prediction {
    pub fn new(params: &Params, grid: &Grid, threads: usize) -> Self {
        let prediction = &params.prediction;
        let reach = prediction.v_opt * f64::from(prediction.horizon);
        let radius = (reach + 3.0 * prediction.ring_width).ceil() as usize;
        let side = 2 * radius + 1;
        let kernels = std::array::from_fn(|k| {
            let values = kernel(params, radius, angle(k));
            // Convolution: the source row j above meets the kernel's row side - 1 - j, and likewise across.
            let row = |j: usize| (0..side).map(|i| (i, values[(side - 1 - j) * side + side - 1 - i] as f32)).collect();
            (0..side).map(row).collect()
        });
        Self {
            enabled: prediction.enabled,
            mu: prediction.mu as f32,
            // Four orders below the response floor: what it removes could not open a region of attention.
            floor: (params.lobula.response_floor * 1e-4).max(1e-30) as f32,
            radius,
            kernels,
            fresh: vec![0; grid.count()],
            jobs: Vec::with_capacity(grid.count()),
            scratch: Scratch::new(threads, || Patch::with_capacity(TILE + 2 * radius, TILE + 2 * radius)),
        }
    }

    /// Writes F and M of this frame into the memorizer. `kept` is E', `strongest` its largest value over directions
    /// or anything zero in the same places.
    pub fn process(&mut self, bands: &Bands, kept: &[Plane; DIRECTIONS], memorizer: &mut Memorizer) {
        if !self.enabled {
            return;
        }
        let grid = memorizer.grid;
        let (past, present) = memorizer.oldest_and_present();
        let size = kept[0].size();
        let fresh = crate::tiles::PerTile { values: &mut self.fresh, across: grid.across };
        bands.over_tiles(size.height, fresh, |range, fresh| {
            for (column, mask) in fresh.values.iter_mut().enumerate() {
                *mask = directions_present(kept, &grid, grid.holding(column * TILE, range.start));
            }
        });
        self.jobs.clear();
        for tile in 0..grid.count() {
            let around = grid.around(tile, self.radius);
            let mask = around.fold(0, |mask, near| mask | self.fresh[near] | past.mask[near]);
            if mask != 0 {
                self.jobs.push(Job { tile, mask, peak: 0.0 });
            }
        }
        let mut jobs = std::mem::take(&mut self.jobs);
        let blocks = Rows { data: &mut present.data[..jobs.len() * BLOCK], stride: BLOCK };
        bands.each((Slice(&mut jobs), blocks), |(jobs, mut blocks)| {
            for (index, job) in jobs.0.iter_mut().enumerate() {
                self.scratch.with(bands, |patch| self.predict(bands, kept, past, &grid, job, blocks.row(index), patch));
            }
        });
        for (block, job) in jobs.iter().enumerate() {
            present.set(job.tile, block, job.mask);
            present.peak = present.peak.max(job.peak);
        }
        self.jobs = jobs;
    }

    fn predict(
        &self,
        bands: &Bands,
        kept: &[Plane; DIRECTIONS],
        past: &Gains,
        grid: &Grid,
        job: &mut Job,
        block: &mut [f32],
        patch: &mut Patch,
    ) {
        let area = grid.area(job.tile);
        let side = TILE + 2 * self.radius;
        let (f, m) = block.split_at_mut(DIRECTIONS * TILE_AREA);
        f.fill(0.0);
        m.fill(0.0);
        for (k, f) in f.chunks_exact_mut(TILE_AREA).enumerate() {
            if job.mask & 1 << k == 0 {
                continue;
            }
            self.gather(kept, past, grid, job.tile, k, patch);
            let zero: fn(&[f32]) -> bool = |row| row.iter().fold(0, |any, value| any | value.to_bits()) == 0;
            let mut rows_present = [0u64; 8];
            for row in 0..side {
                if !zero(patch.row(row)) {
                    rows_present[row / 64] |= 1 << (row % 64);
                }
            }
            let mut any = false;
            for (y, out) in f.chunks_exact_mut(TILE).enumerate().take(area.rows) {
                for (j, taps) in self.kernels[k].iter().enumerate() {
                    let row = y + j;
                    if rows_present[row / 64] >> (row % 64) & 1 == 1 {
                        accumulate(bands.level(), patch.row(row), taps, out);
                    }
                }
                for (value, m) in out[..area.columns].iter_mut().zip(&mut m[y * TILE..]) {
                    *value = if *value < self.floor { 0.0 } else { *value };
                    *m += *value;
                    any |= *value > 0.0;
                }
                out[area.columns..].fill(0.0);
            }
            if !any {
                job.mask &= !(1 << k);
            }
        }
        job.peak = m.iter().copied().fold(0.0, f32::max);
    }

    /// mu E' + (1 - mu) F(t - dt) of direction k over a tile and the kernel's reach around it, zero outside.
    fn gather(&self, kept: &[Plane; DIRECTIONS], past: &Gains, grid: &Grid, tile: usize, k: usize, patch: &mut Patch) {
        let side = TILE + 2 * self.radius;
        patch.shape(side, side);
        debug_assert!(patch.stride == patch_stride(side));
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
