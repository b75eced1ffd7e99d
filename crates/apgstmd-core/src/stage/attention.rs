//! Attention: A = R max over scales of min over orientations of (P * W_a), P_e = P + alpha A, inside the region
//! Omega(t) = { M(t - dt) > max(threshold max M(t - dt), threshold_floor) } that prediction points at.
//!
//! Input: P and the memorizer's M(t - dt). Output: A and P_e. State: R, the faded region. Only tiles that touch R are
//! computed. W_a is steerable: with g_j = t^j exp(-t^2 / 2 s^2), three passes along x and four along y give all
//! orientations of a scale.

use std::f64::consts::PI;

use crate::filter::kernel::{gaussian_half, sum_of_half};
use crate::filter::patch::{Border, Patch};
use crate::frame::Size;
use crate::memory::heap;
use crate::params::{Params, Support};
use crate::plane::Plane;
use crate::row::bands::{Bands, Rows, Scratch};

use crate::row::mix::blend;
use crate::row::speckle::{Layout, moments, steer};
use crate::row::tile::fade_row;
use crate::stage::memorizer::Gains;
use crate::tiles::{Grid, PerTile, TILE};

/// A faded region below this is over: what it still adds to P_e is below the resolution of P.
const FADED: f32 = 1e-6;

struct Scale {
    /// g_0, g_1, g_2 at 0..=radius.
    taps: Vec<[f32; 3]>,
    /// c: makes every kernel sum to exactly zero.
    center: f32,
}

pub(crate) struct Attention {
    enabled: bool,
    alpha: f32,
    threshold: f32,
    threshold_floor: f32,
    support: Support,
    fade: f32,
    scales: Vec<Scale>,
    /// Radius of the widest kernel.
    reach: usize,
    grid: Grid,
    /// No region yet: the first one counts in full.
    fresh: bool,
    region: Plane,
    /// P R, for `masked`.
    masked: Plane,
    /// Tiles in which R is not zero.
    active: Vec<bool>,
    /// Tiles in which A is not zero.
    pub attended: Vec<bool>,
    pub a: Plane,
    pub pe: Plane,
    scratch: Scratch<(Patch, [Patch; 3], Patch)>,
}

heap!(Scale { taps });
heap!(Attention { scales, region, masked, active, attended, a, pe, scratch });

impl Attention {
    pub fn new(size: Size, params: &Params, threads: usize) -> Self {
        let enabled = params.attention.enabled && params.prediction.enabled;
        let params = &params.attention;
        let grid = Grid::new(size);
        let reach = params.scales.iter().map(|sigma| (4.0 * sigma).ceil() as usize).max().unwrap_or(0);
        let scales = params.scales.iter().map(|&sigma| {
            let half = gaussian_half(sigma, (4.0 * sigma).ceil() as usize);
            let moment: Vec<f64> = half.iter().enumerate().map(|(t, g)| (t * t) as f64 * g).collect();
            // 2 / (pi s^4), shared between the two passes.
            let weight = (2.0 / (PI * sigma.powi(4))).sqrt();
            let tap = |(t, g): (usize, &f64)| {
                let t = t as f64;
                [g * weight, t * g * weight, t * t * g * weight].map(|tap| tap as f32)
            };
            Scale {
                taps: half.iter().enumerate().map(tap).collect(),
                center: (sum_of_half(&moment) / sum_of_half(&half)) as f32,
            }
        });
        Self {
            enabled,
            alpha: params.alpha as f32,
            threshold: params.threshold as f32,
            threshold_floor: params.threshold_floor as f32,
            support: params.support,
            fade: (1.0 / params.ramp) as f32,
            scales: scales.collect(),
            reach,
            grid,
            fresh: true,
            region: Plane::new(size),
            masked: Plane::new(size),
            active: vec![false; grid.count()],
            attended: vec![false; grid.count()],
            a: Plane::new(size),
            pe: Plane::new(size),
            scratch: Scratch::new(threads, || {
                let patch = || Patch::with_capacity(TILE + 2 * reach, TILE + 2 * reach);
                (patch(), [0, 1, 2].map(|_| patch()), patch())
            }),
        }
    }

    /// `predicted` is the memory of dt frames ago, where there is one.
    pub fn process(&mut self, bands: &Bands, p: &Plane, predicted: Option<&Gains>) {
        if self.enabled
            && let Some(predicted) = predicted
        {
            self.update_region(bands, p, predicted);
            self.attend(bands, p);
        }
        self.enhance(bands, p);
    }

    /// R(t) = R(t-1) + (Omega(t) - R(t-1)) / ramp.
    fn update_region(&mut self, bands: &Bands, p: &Plane, predicted: &Gains) {
        let threshold = (self.threshold * predicted.peak).max(self.threshold_floor);
        let fade = if std::mem::replace(&mut self.fresh, false) { 1.0 } else { self.fade };
        let Self { grid, region, masked, active, support, .. } = self;
        let (size, stride) = (p.size(), p.stride());
        let out = (
            [region, masked].map(|plane| Rows { data: plane.data_mut(), stride }),
            PerTile { values: active, across: grid.across },
        );
        bands.over_tiles(size.height, out, |range, ([mut region, mut masked], active)| {
            for column in 0..grid.across {
                let tile = grid.holding(column * TILE, range.start);
                let block = predicted.tile(tile);
                if block.is_none() && !active.values[column] {
                    continue;
                }
                let area = grid.area(tile);
                active.values[column] = false;
                for y in 0..area.rows {
                    let columns = area.left..area.left + area.columns;
                    let r = &mut region.row(y)[columns.clone()];
                    let m = block.map(|block| &block.m()[y * TILE..y * TILE + area.columns]);
                    active.values[column] |= fade_row(bands.level(), m, threshold, fade, FADED, r);
                    if *support == Support::Masked {
                        let p = &p.row(area.top + y)[columns.clone()];
                        for ((masked, p), r) in masked.row(y)[columns].iter_mut().zip(p).zip(&*r) {
                            *masked = p * r;
                        }
                    }
                }
            }
        });
    }

    fn attend(&mut self, bands: &Bands, p: &Plane) {
        let Self { grid, scales, reach, support, region, masked, active, attended, a, scratch, .. } = self;
        let stride = p.stride();
        let reach = *reach;
        // What R cuts off on the way in spreads; what it cuts off on the way out does not.
        let (source, border, spread) = match support {
            Support::Full => (p, Border::Replicate, 0),
            Support::Masked => (&*masked, Border::Zero, reach),
        };
        let out = (Rows { data: a.data_mut(), stride }, PerTile { values: attended, across: grid.across });
        bands.over_tiles(p.size().height, out, |range, (mut a, attended)| {
            for column in 0..grid.across {
                let tile = grid.holding(column * TILE, range.start);
                let area = grid.area(tile);
                let columns = area.left..area.left + area.columns;
                if !bands.dense() && !grid.around(tile, spread).any(|tile| active[tile]) {
                    if std::mem::replace(&mut attended.values[column], false) {
                        (0..area.rows).for_each(|y| a.row(y)[columns.clone()].fill(0.0));
                    }
                    continue;
                }
                attended.values[column] = true;
                scratch.with(bands, |(patch, sums, best)| {
                    let (top, left) = (area.top as isize - reach as isize, area.left as isize - reach as isize);
                    patch.gather(source, top, left, area.rows + 2 * reach, area.columns + 2 * reach, border);
                    if *support == Support::Full {
                        // The kernels sum to zero: what the tile has in common only costs precision.
                        let common = patch.row(reach)[reach];
                        patch.data_mut().iter_mut().for_each(|value| *value -= common);
                    }
                    strongest_speckle(bands, scales, reach, (area.rows, area.columns), patch, sums, best);
                    for y in 0..area.rows {
                        let out = &mut a.row(y)[columns.clone()];
                        let r = &region.row(area.top + y)[columns.clone()];
                        match support {
                            Support::Full => {
                                out.iter_mut().zip(best.row(y)).zip(r).for_each(|((out, a), r)| *out = a * r);
                            }
                            Support::Masked => out.copy_from_slice(&best.row(y)[..area.columns]),
                        }
                    }
                });
            }
        });
    }

    /// P_e = P + alpha A.
    fn enhance(&mut self, bands: &Bands, p: &Plane) {
        let stride = p.stride();
        let Self { a, pe, alpha, attended, grid, .. } = self;
        bands.over_tiles(p.size().height, Rows { data: pe.data_mut(), stride }, |range, mut pe| {
            let first = grid.holding(0, range.start);
            let any = attended[first..first + grid.across].contains(&true);
            for (row, y) in range.enumerate() {
                if any {
                    blend(bands.level(), 1.0, p.padded_row(y), *alpha, a.padded_row(y), pe.row(row));
                } else {
                    pe.row(row).copy_from_slice(p.padded_row(y));
                }
            }
        });
    }

    /// Tiles computed in the last frame.
    pub fn tiles(&self) -> usize {
        self.attended.iter().filter(|attended| **attended).count()
    }

    pub fn reset(&mut self) {
        self.fresh = true;
        for plane in [&mut self.region, &mut self.masked, &mut self.a, &mut self.pe] {
            plane.fill(0.0);
        }
        self.active.fill(false);
        self.attended.fill(false);
    }
}

/// max over scales of min over orientations of the patch's interior, into `best`.
fn strongest_speckle(
    bands: &Bands,
    scales: &[Scale],
    reach: usize,
    (rows, columns): (usize, usize),
    patch: &Patch,
    sums: &mut [Patch; 3],
    best: &mut Patch,
) {
    best.shape(rows, columns);
    best.data_mut().fill(f32::NEG_INFINITY);
    let width = crate::plane::padded(columns);
    for scale in scales {
        let radius = scale.taps.len() - 1;
        let inset = reach - radius;
        for sum in &mut *sums {
            sum.shape(rows + 2 * radius, columns);
        }
        let [m0, m1, m2] = &mut *sums;
        let stride = m0.stride;
        let above = Layout { stride, rows: rows + 2 * radius, width };
        let out = [m0.data_mut(), m1.data_mut(), m2.data_mut()];
        moments(bands.level(), (&patch.below(inset)[inset..], patch.stride), &scale.taps, above, out);
        let sources = [m0.data(), m1.data(), m2.data()];
        let layout = Layout { stride, rows, width };
        steer(bands.level(), sources, &scale.taps, scale.center, layout, best.data_mut());
    }
}
