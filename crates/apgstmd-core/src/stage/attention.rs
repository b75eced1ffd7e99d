//! Attention: A = R max over scales of min over orientations of (P * W_a), P_e = P + alpha A, inside the region
//! Omega(t) = { M(t - dt) > max(threshold max M(t - dt), threshold_floor) } that prediction points at.
//!
//! Input: P and the memorizer's M(t - dt). Output: A, P_e and, with `gate = change`, what attention adds to the steps of P.
//! State: R, the faded region, and for those steps the last A. Only tiles that touch R are computed.

use ndarray::Array3;

use crate::frame::Size;
use crate::memory::heap;
use crate::params::{Gate, Params, Support};
use crate::plane::{Plane, Series};
use crate::row::bands::{Bands, Rows};
use crate::row::mix::blend;
use crate::row::tile::fade_row;
use crate::scroll::{Scroll, Scrolls, scroll_maps};
use crate::stage::memorizer::Gains;
use crate::stage::speckle::Speckle;
use crate::state::{Remember, StateError, Visit, remember};
use crate::tiles::{Area, Grid, PerTile, TILE};

/// A faded region below this is over: what it still adds to P_e is below the resolution of P.
const FADED: f32 = 1e-6;

pub(crate) struct Attention {
    enabled: bool,
    alpha: f32,
    threshold: f32,
    threshold_floor: f32,
    support: Support,
    fade: f32,
    speckle: Speckle,
    grid: Grid,
    /// No region yet: the first one counts in full.
    fresh: bool,
    region: Plane,
    /// P R, for `masked`.
    masked: Plane,
    /// Tiles in which R is not zero.
    active: Vec<bool>,
    /// Tiles in which A is not zero.
    attended: Vec<bool>,
    /// Tiles computed in the last call, over its frames.
    computed: usize,
    pub a: Plane,
    /// P_e of the frames that are computed together.
    pe: Series,
    steps: Option<Steps>,
}

/// For `gate = change`. Here A is without R.
struct Steps {
    /// A(t-1) in attended tiles.
    whole: Plane,
    /// alpha R(t) (A(t) - A(t-1)) of each frame that is computed together.
    added: Vec<Plane>,
    /// Tiles in which these may not be zero.
    set: Vec<Vec<bool>>,
}

heap!(Steps { whole, added, set });
heap!(Attention { speckle, region, masked, active, attended, a, pe, steps });
remember!(Steps { whole });

impl Remember for Attention {
    /// The rest is made anew from these, where it is read.
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        visit.part("fresh", &mut self.fresh)?;
        visit.part("region", &mut self.region)?;
        visit.part("active", &mut self.active)?;
        visit.part("attended", &mut self.attended)?;
        match &mut self.steps {
            None => visit.part("pe", &mut self.pe),
            Some(steps) => visit.part("steps", steps),
        }
    }
}

impl Scrolls for Attention {
    /// What attention adds is made anew from what moves.
    fn scroll(&mut self, scroll: &Scroll<'_>) {
        let Self { grid, region, masked, active, attended, a, pe, .. } = self;
        pe.scroll(scroll);
        if scroll.by == (0, 0) {
            return;
        }
        if active.contains(&true) {
            let size = region.size();
            scroll_maps(region.data_mut(), size, 1, scroll.by);
            masked.fill(0.0);
            for (tile, active) in active.iter_mut().enumerate() {
                let Area { top, left, rows, columns } = grid.area(tile);
                let rows = (top..top + rows).map(|y| &region.row(y)[left..left + columns]);
                *active = rows.flatten().any(|r| *r != 0.0);
            }
        }
        if attended.contains(&true) {
            attended.fill(false);
            a.fill(0.0);
        }
    }
}

impl Attention {
    /// For `together` frames at once.
    pub fn new(size: Size, params: &Params, threads: usize, together: usize) -> Self {
        let enabled = params.attention.enabled && params.prediction.enabled;
        let params = &params.attention;
        let grid = Grid::new(size);
        let change = enabled && params.gate == Gate::Change;
        Self {
            enabled,
            alpha: params.alpha as f32,
            threshold: params.threshold as f32,
            threshold_floor: params.threshold_floor as f32,
            support: params.support,
            fade: (1.0 / params.ramp) as f32,
            speckle: Speckle::new(params, threads),
            grid,
            fresh: true,
            region: Plane::new(size),
            masked: Plane::new(size),
            active: vec![false; grid.count()],
            attended: vec![false; grid.count()],
            computed: 0,
            a: Plane::new(size),
            // Each has its own output; the other takes no room.
            pe: Series::new(if change { Size::new(0, 0) } else { size }, together),
            steps: change.then(|| Steps {
                whole: Plane::new(size),
                added: (0..together).map(|_| Plane::new(size)).collect(),
                set: vec![vec![false; grid.count()]; together],
            }),
        }
    }

    /// Takes the next frames; `predicted` names the memory of dt frames before each, where there is one.
    pub fn process<'a>(&mut self, bands: &Bands, p: &Series, predicted: impl Fn(usize) -> Option<&'a Gains>) {
        self.pe.begin(p.maps().len());
        self.computed = 0;
        for (frame, now) in p.maps().iter().enumerate() {
            if self.enabled
                && let Some(predicted) = predicted(frame)
            {
                self.update_region(bands, now, predicted);
                self.attend(bands, frame, now, p.before(frame));
                self.computed += self.attended.iter().filter(|attended| **attended).count();
            }
            if self.steps.is_none() {
                self.enhance(bands, frame, now);
            }
        }
    }

    /// Lets go of all but the first `count` frames.
    pub fn keep(&mut self, count: usize) {
        self.pe.keep(count);
    }

    /// What the lamina filters: P_e, or P and what attention adds to its changes.
    pub fn output<'a>(&'a self, p: &'a Series) -> (&'a Series, Option<&'a [Plane]>) {
        match &self.steps {
            None => (&self.pe, None),
            Some(steps) => (p, Some(&steps.added)),
        }
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

    fn attend(&mut self, bands: &Bands, frame: usize, p: &Plane, before: &Plane) {
        let Self { alpha, support, speckle, grid, region, masked, active, attended, a, steps, .. } = self;
        // What R cuts off on the way in spreads; what it cuts off on the way out does not.
        let (source, spread) = match support {
            Support::Full => (p, 0),
            Support::Masked => (&*masked, speckle.reach),
        };
        let stride = p.stride();
        let steps = steps.as_mut().map(|Steps { whole, added, set }| {
            let set = PerTile { values: &mut set[frame][..], across: grid.across };
            ([whole, &mut added[frame]].map(|plane| Rows { data: plane.data_mut(), stride }), set)
        });
        let a = Rows { data: a.data_mut(), stride };
        let out = ((a, PerTile { values: attended, across: grid.across }), steps);
        bands.over_tiles(p.size().height, out, |range, ((mut a, attended), mut steps)| {
            for column in 0..grid.across {
                let tile = grid.holding(column * TILE, range.start);
                let area = grid.area(tile);
                let columns = area.left..area.left + area.columns;
                let was_attended = attended.values[column];
                let attend = bands.dense() || grid.around(tile, spread).any(|tile| active[tile]);
                attended.values[column] = attend;
                if let Some(([_, added], set)) = &mut steps
                    && std::mem::replace(&mut set.values[column], attend)
                    && !attend
                {
                    (0..area.rows).for_each(|y| added.row(y)[columns.clone()].fill(0.0));
                }
                if !attend {
                    (0..area.rows).filter(|_| was_attended).for_each(|y| a.row(y)[columns.clone()].fill(0.0));
                    continue;
                }
                if let (Some(([whole, _], _)), false) = (&mut steps, was_attended) {
                    speckle.each_row(bands, before, &area, |y, a| whole.row(y)[columns.clone()].copy_from_slice(a));
                }
                speckle.each_row(bands, source, &area, |y, now| {
                    let out = &mut a.row(y)[columns.clone()];
                    let r = &region.row(area.top + y)[columns.clone()];
                    match support {
                        Support::Full => out.iter_mut().zip(now).zip(r).for_each(|((out, a), r)| *out = a * r),
                        Support::Masked => out.copy_from_slice(now),
                    }
                    if let Some(([whole, added], _)) = &mut steps {
                        let (whole, added) = (&mut whole.row(y)[columns.clone()], &mut added.row(y)[columns.clone()]);
                        for (((added, whole), now), r) in added.iter_mut().zip(&*whole).zip(now).zip(r) {
                            *added = *alpha * r * (now - whole);
                        }
                        whole.copy_from_slice(now);
                    }
                });
            }
        });
    }

    /// P_e as a map.
    pub fn enhanced(&self, p: &Plane) -> Array3<f32> {
        &p.view3() + &(&self.a.view3() * self.alpha)
    }

    /// P_e = P + alpha A.
    fn enhance(&mut self, bands: &Bands, frame: usize, p: &Plane) {
        let stride = p.stride();
        let Self { a, pe, alpha, attended, grid, .. } = self;
        bands.over_tiles(p.size().height, Rows { data: pe.maps_mut()[frame].data_mut(), stride }, |range, mut pe| {
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

    /// Tiles computed in the last call, over its frames.
    pub fn tiles(&self) -> usize {
        self.computed
    }

    pub fn reset(&mut self) {
        self.fresh = true;
        for plane in [&mut self.region, &mut self.masked, &mut self.a] {
            plane.fill(0.0);
        }
        self.pe.fill(0.0);
        self.active.fill(false);
        self.attended.fill(false);
        self.computed = 0;
        if let Some(steps) = &mut self.steps {
            steps.added.iter_mut().for_each(|added| added.fill(0.0));
            steps.set.iter_mut().for_each(|set| set.fill(false));
        }
    }
}
