//! Prediction: F(t) = (mu E'(t) + (1 - mu) F(t - dt)) * W_p, M = sum over directions of F.
//!
//! Input: E' and the memorizer's F(t - dt). Output: F and M into the memorizer. No state of its own. W_p is a ring of
//! radius v_opt dt, denser along the direction. Only tiles are computed in which something can come to more than the
//! floor, and for them only the rows and columns of the source that are not zero.

use std::ops::Range;

use crate::DIRECTIONS;
use crate::direction::angle;
use crate::filter::kernel::bessel_i0;
use crate::memory::heap;
use crate::params::Params;
use crate::plane::Plane;
use crate::row::bands::{Bands, Rows, Scratch, Slice};
use crate::row::mix::accumulate;
use crate::row::tile::{PATCH, PATCHES, ROWS, TileKernel, correlate_tile};
use crate::stage::memorizer::{BLOCK, Memorizer, TILE_AREA};
use crate::stage::source::Source;
use crate::state::remember;
use crate::tiles::{Grid, PerTile, TILE};

/// To the left and to the right of half a tile, in each direction.
type LargestTaps = [[f32; DIRECTIONS]; 2];

pub(crate) struct Prediction {
    enabled: bool,
    floor: f32,
    /// Gains below this share of the largest M are zero: see [`Prediction::negligible`].
    share: f32,
    kernels: [TileKernel; DIRECTIONS],
    /// The places of patches that reach half a tile, and the largest taps that lead from there.
    most: Vec<((isize, isize), LargestTaps)>,
    /// The largest tap.
    peak_tap: f32,
    pub source: Source,
    /// Directions that something reaches, in the upper and the lower half of each tile.
    reached: Vec<[u8; 2]>,
    jobs: Vec<Job>,
    computed: usize,
    /// Largest M of the last frame.
    peak: f32,
    scratch: Scratch<Vec<Range<usize>>>,
}

/// A tile to be computed.
#[derive(Clone, Copy)]
struct Job {
    tile: usize,
    /// Directions that something reaches, in the upper and the lower half.
    halves: [u8; 2],
    /// After the work, the directions that are not zero.
    mask: u8,
    peak: f32,
}

heap!(Job);
heap!(Prediction { kernels, most, source, reached, jobs, scratch });
remember!(Prediction { peak });

/// Radius of W_p: v_opt dt + 3 zeta.
pub(crate) fn reach(params: &Params) -> usize {
    let prediction = &params.prediction;
    (prediction.v_opt * f64::from(prediction.horizon) + 3.0 * prediction.ring_width).ceil() as usize
}

/// W_p for a direction, (2 radius + 1) squared row by row, unit sum.
pub(crate) fn kernel(params: &Params, radius: usize, theta: f64) -> Vec<f64> {
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
        let radius = reach(params);
        // Turned by half a circle: what is correlated with it is convolved with W_p.
        let taps: [Vec<f32>; DIRECTIONS] =
            std::array::from_fn(|k| kernel(params, radius, angle(k)).into_iter().rev().map(|tap| tap as f32).collect());
        Self {
            enabled: prediction.enabled,
            // Four orders below the response floor: what it removes could not open a region of attention.
            floor: (params.lobula.response_floor * 1e-4).max(1e-30) as f32,
            share: prediction.negligible as f32,
            kernels: taps.each_ref().map(|taps| TileKernel::new(taps)),
            most: places(radius)
                .map(|place| (place, [0..ROWS, ROWS..TILE].map(|columns| largest(&taps, radius, place, columns))))
                .collect(),
            peak_tap: taps.iter().flatten().copied().fold(0.0, f32::max),
            source: Source::new(grid, prediction.mu as f32, radius),
            reached: vec![[0; 2]; grid.count()],
            jobs: Vec::with_capacity(grid.count()),
            computed: 0,
            peak: 0.0,
            scratch: Scratch::new(threads, || vec![0..0; TILE + 2 * radius]),
        }
    }

    /// Writes F and M of this frame into the memorizer; `kept` is E', which is zero but for the tiles `near`.
    pub fn process(&mut self, bands: &Bands, kept: &[Plane; DIRECTIONS], near: &[bool], memorizer: &mut Memorizer) {
        let grid = memorizer.grid;
        let (past, present) = memorizer.oldest_and_present();
        self.source.gather(bands, kept, near, self.enabled.then_some(past));
        if !self.enabled {
            return;
        }
        let floor = self.negligible();
        let mut reached = std::mem::take(&mut self.reached);
        bands.over_tiles(grid.down * TILE, PerTile { values: &mut reached, across: grid.across }, |range, reached| {
            let first = grid.holding(0, range.start);
            for (index, halves) in reached.values.iter_mut().enumerate() {
                *halves = if bands.dense() { [u8::MAX; 2] } else { self.reached(&grid, first + index, floor) };
            }
        });
        self.jobs.clear();
        let some = reached.iter().enumerate().filter(|(_, halves)| **halves != [0; 2]);
        self.jobs.extend(some.map(|(tile, halves)| Job { tile, halves: *halves, mask: 0, peak: 0.0 }));
        self.reached = reached;
        let halves = self.jobs.iter().flat_map(|job| job.halves);
        self.computed = halves.map(|mask| mask.count_ones() as usize).sum::<usize>().div_ceil(2);
        let mut jobs = std::mem::take(&mut self.jobs);
        let blocks = Rows { data: present.blocks(jobs.len()), stride: BLOCK };
        bands.each((Slice(&mut jobs), blocks), |(jobs, mut blocks)| {
            self.scratch.with(bands, |spans| {
                for (index, job) in jobs.0.iter_mut().enumerate() {
                    self.predict(bands, &grid, floor, job, blocks.row(index), spans);
                }
            });
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
        self.source.reset();
    }

    /// Gains below this are zero. By default they could neither open a region of attention nor be seen in Q, but would
    /// spread over the whole picture, frame by frame. What a frame loses is passed on with weight 1 - mu only, so a gain
    /// is short of the truth by 1 / mu times this at most. The largest M of this frame is not known yet: it is taken for that of the last one,
    /// or for what the densest tile of the source comes to at the largest tap, should everything have vanished.
    fn negligible(&self) -> f32 {
        let left = self.source.largest_sum() * self.peak_tap;
        self.floor.max(self.share * self.peak.min(left))
    }

    /// Directions in which some gain may come to `floor`, for both halves of a tile.
    fn reached(&self, grid: &Grid, tile: usize, floor: f32) -> [u8; 2] {
        if !self.source.anything_around(tile) {
            return [0; 2];
        }
        let patch = |index: usize| (index * PATCHES) as isize;
        let (row, column) = (patch(tile / grid.across), patch(tile % grid.across));
        let half = (ROWS / PATCH) as isize;
        [row, row + half].map(|row| {
            let mut bounds = [[0.0; DIRECTIONS]; 2];
            for ((down, right), most) in &self.most {
                if let Some(sums) = self.source.patch(row + down, column + right) {
                    for (bounds, most) in bounds.iter_mut().zip(most) {
                        for k in 0..DIRECTIONS {
                            bounds[k] += sums[k] * most[k];
                        }
                    }
                }
            }
            // Sums of some thousand positive terms are exact to a part in a thousand.
            let reaches = |bound: f32| bound > 0.0 && bound * 1.001 >= floor;
            (0..DIRECTIONS).fold(0, |mask, k| mask | u8::from(bounds.iter().any(|bounds| reaches(bounds[k]))) << k)
        })
    }

    /// F and M of one tile.
    fn predict(
        &self,
        bands: &Bands,
        grid: &Grid,
        floor: f32,
        job: &mut Job,
        block: &mut [f32],
        spans: &mut [Range<usize>],
    ) {
        let (f, m) = block.split_at_mut(DIRECTIONS * TILE_AREA);
        let area = grid.area(job.tile);
        m.fill(0.0);
        for (k, f) in f.chunks_exact_mut(TILE_AREA).enumerate() {
            let halves = job.halves.map(|mask| mask >> k & 1 == 1);
            if halves == [false; 2] {
                f.fill(0.0);
                continue;
            }
            let (window, stride) = self.source.window(job.tile, k);
            self.source.spans(job.tile, k, spans);
            correlate_tile(bands.level(), window, stride, spans, &self.kernels[k], halves, f);
            if area.columns < TILE {
                f.chunks_exact_mut(TILE).for_each(|row| row[area.columns..].fill(0.0));
            }
            f[area.rows * TILE..].fill(0.0);
            if accumulate(bands.level(), floor, f, m) > 0.0 {
                job.mask |= 1 << k;
            }
        }
        job.peak = m.iter().copied().fold(0.0, f32::max);
    }
}

/// Where the patches lie that reach half a tile, in rows and columns of patches from its first one.
fn places(radius: usize) -> impl Iterator<Item = (isize, isize)> {
    let reach = radius.div_ceil(PATCH) as isize;
    let places = move |length: usize| -reach..(length / PATCH) as isize + reach;
    places(ROWS).flat_map(move |down| places(TILE).map(move |right| (down, right)))
}

/// In each direction, the largest tap that leads from the patch in a place to some columns of half a tile.
fn largest(
    taps: &[Vec<f32>; DIRECTIONS],
    radius: usize,
    (down, right): (isize, isize),
    columns: Range<usize>,
) -> [f32; DIRECTIONS] {
    let (r, side) = (radius as isize, PATCH as isize);
    // Offsets from pixels of the half tile to those of the patch.
    let offsets = |place: isize, pixels: Range<usize>| {
        let first = side * place - (pixels.end as isize - 1);
        let last = side * place + side - 1 - pixels.start as isize;
        (first.max(-r)..=last.min(r)).map(move |offset| (offset + r) as usize)
    };
    let mut most = [0.0f32; DIRECTIONS];
    for dy in offsets(down, 0..ROWS) {
        for dx in offsets(right, columns.clone()) {
            for (most, taps) in most.iter_mut().zip(taps) {
                *most = most.max(taps[dy * (2 * radius + 1) + dx]);
            }
        }
    }
    most
}
