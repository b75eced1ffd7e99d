//! Facilitated output: Q(t) = E'(t) + beta sum over k = 0..dt of exp(kappa (k - dt)) F(t - k).
//!
//! Input: E' and the memorizer. Output: the response map max over directions of Q, the direction map, and Q at a pixel.
//! No state. Tiles without E' and without F are zero and cost nothing.

use ndarray::Array3;

use crate::DIRECTIONS;
use crate::detection::Response;
use crate::memory::heap;
use crate::params::PredictionParams;
use crate::plane::Plane;
use crate::row::bands::{Bands, Rows, Scratch};
use crate::row::mix::{add_scaled, summarise};
use crate::stage::memorizer::{Memorizer, TILE_AREA};
use crate::tiles::{Area, TILE, copy_columns};

/// Frames added in one pass.
const TOGETHER: usize = 8;

pub(crate) struct Facilitation {
    /// beta exp(kappa (k - dt)) for k = 0..=dt.
    weights: Vec<f32>,
    scratch: Scratch<Work>,
}

struct Work {
    q: Vec<f32>,
    largest: Vec<f32>,
    angle: Vec<f32>,
}

heap!(Work { q, largest, angle });
heap!(Facilitation { weights, scratch });

impl Facilitation {
    pub fn new(params: &PredictionParams, threads: usize) -> Self {
        let horizon = params.horizon;
        let weight = |k: u32| params.beta * (params.kappa * (f64::from(k) - f64::from(horizon))).exp();
        Self {
            weights: (0..=horizon).filter(|_| params.enabled).map(|k| weight(k) as f32).collect(),
            scratch: Scratch::new(threads, || Work {
                q: vec![0.0; DIRECTIONS * TILE_AREA],
                largest: vec![0.0; TILE_AREA],
                angle: vec![0.0; TILE_AREA],
            }),
        }
    }

    /// Writes both maps. `fresh` names the directions of E' that are not zero, by tile.
    pub fn process(
        &self,
        bands: &Bands,
        kept: &[Plane; DIRECTIONS],
        fresh: &[u8],
        memorizer: &Memorizer,
        response: &mut Response,
    ) {
        let size = kept[0].size();
        let maps = [&mut response.map, &mut response.direction].map(|map| Rows {
            data: map.as_slice_mut().expect("make_response makes contiguous maps"),
            stride: size.width,
        });
        bands.over_tiles(size.height, maps, |range, [mut map, mut direction]| {
            for row in 0..range.len() {
                map.row(row).fill(0.0);
                direction.row(row).fill(f32::NAN);
            }
            for column in 0..memorizer.grid.across {
                let tile = memorizer.grid.holding(column * TILE, range.start);
                self.scratch.with(bands, |Work { q, largest, angle }| {
                    if !self.tile(bands, kept, fresh[tile], memorizer, tile, q) {
                        return;
                    }
                    let mut maps = q.chunks_exact(TILE_AREA);
                    let q: [&[f32]; DIRECTIONS] = std::array::from_fn(|_| maps.next().unwrap_or_default());
                    summarise(bands.level(), q, largest, angle);
                    let Area { left, rows, columns, .. } = memorizer.grid.area(tile);
                    for y in 0..rows {
                        let row = y * TILE..y * TILE + columns;
                        copy_columns(&largest[row.clone()], &mut map.row(y)[left..left + columns]);
                        copy_columns(&angle[row], &mut direction.row(y)[left..left + columns]);
                    }
                });
            }
        });
    }

    /// Q of one tile; false where it is zero everywhere and `q` was not written. `fresh` names the directions of E' that
    /// are not zero in the tile.
    fn tile(
        &self,
        bands: &Bands,
        kept: &[Plane; DIRECTIONS],
        fresh: u8,
        memorizer: &Memorizer,
        tile: usize,
        q: &mut [f32],
    ) -> bool {
        let Area { top, left, rows, columns } = memorizer.grid.area(tile);
        let remembered = (0..=memorizer.horizon()).any(|k| memorizer.ago(k).mask[tile] != 0);
        if fresh == 0 && !remembered {
            return false;
        }
        for (k, (plane, q)) in kept.iter().zip(q.chunks_exact_mut(TILE_AREA)).enumerate() {
            q.fill(0.0);
            if fresh >> k & 1 == 0 {
                continue;
            }
            for (y, q) in q.chunks_exact_mut(TILE).enumerate().take(rows) {
                copy_columns(&plane.row(top + y)[left..left + columns], &mut q[..columns]);
            }
        }
        for (direction, q) in q.chunks_exact_mut(TILE_AREA).enumerate() {
            let (mut terms, mut count) = ([(0.0, &[][..]); TOGETHER], 0);
            for (k, weight) in self.weights.iter().enumerate() {
                let gains = memorizer.ago(k);
                if gains.mask[tile] >> direction & 1 == 1
                    && let Some(block) = gains.tile(tile)
                {
                    terms[count] = (*weight, block.f(direction));
                    count += 1;
                }
                if count == TOGETHER {
                    add_scaled(bands.level(), &terms, q);
                    count = 0;
                }
            }
            add_scaled(bands.level(), &terms[..count], q);
        }
        true
    }

    /// Q at one pixel.
    pub fn at(&self, kept: &[Plane; DIRECTIONS], memorizer: &Memorizer, x: usize, y: usize) -> [f32; DIRECTIONS] {
        let tile = memorizer.grid.holding(x, y);
        let Area { top, left, .. } = memorizer.grid.area(tile);
        let place = (y - top) * TILE + x - left;
        std::array::from_fn(|direction| {
            let mut q = kept[direction].row(y)[x];
            for (k, weight) in self.weights.iter().enumerate() {
                if let Some(block) = memorizer.ago(k).tile(tile) {
                    q += weight * block.f(direction)[place];
                }
            }
            q
        })
    }

    /// Q of a whole frame.
    pub fn map(&self, kept: &[Plane; DIRECTIONS], fresh: &[u8], memorizer: &Memorizer) -> Array3<f32> {
        let size = kept[0].size();
        let bands = Bands::single();
        let mut map = Array3::zeros((DIRECTIONS, size.height, size.width));
        let mut q = vec![0.0; DIRECTIONS * TILE_AREA];
        for (tile, fresh) in fresh.iter().enumerate() {
            if self.tile(&bands, kept, *fresh, memorizer, tile, &mut q) {
                let Area { top, left, rows, columns } = memorizer.grid.area(tile);
                for (direction, q) in q.chunks_exact(TILE_AREA).enumerate() {
                    for y in 0..rows {
                        for x in 0..columns {
                            map[[direction, top + y, left + x]] = q[y * TILE + x];
                        }
                    }
                }
            }
        }
        map
    }
}
