//! Elementary motion detectors: E = max(Y Yd_up - Yd Y_up, 0) for 8 directions, Yd = Y through a first-order low-pass.
//!
//! Input: Y. Output: E and its largest value over directions. State: the low-pass. The second pixel lies upstream, zero
//! outside the picture. Where Y is zero so is E, and costs nothing.

use crate::DIRECTIONS;
use crate::direction::upstream;
use crate::filter::low_pass::LowPass;
use crate::frame::Size;
use crate::memory::heap;
use crate::params::Params;
use crate::plane::Plane;
use crate::row::bands::{Bands, Rows};
use crate::row::opponent::oppose;
use crate::scroll::scrolls;
use crate::state::remember;

pub(crate) struct Emd {
    upstream: [(isize, isize); DIRECTIONS],
    floor: f32,
    low_pass: LowPass,
    /// Yd.
    pub slow: Plane,
    pub e: [Plane; DIRECTIONS],
    /// max over directions of E.
    pub strongest: Plane,
}

heap!(Emd { low_pass, slow, e, strongest });
remember!(Emd { low_pass });
scrolls!(Emd { low_pass });

impl Emd {
    pub fn new(size: Size, params: &Params) -> Self {
        Self {
            upstream: std::array::from_fn(|k| upstream(k, params.emd.spacing)),
            floor: params.lobula.response_floor as f32,
            low_pass: LowPass::new(size, params.emd.tau),
            slow: Plane::new(size),
            e: std::array::from_fn(|_| Plane::new(size)),
            strongest: Plane::new(size),
        }
    }

    pub fn process(&mut self, bands: &Bands, y: &Plane) {
        self.low_pass.process(bands, y, &mut self.slow, false);
        let Size { height, width } = y.size();
        let Self { upstream, floor, slow, e, strongest, .. } = self;
        let stride = y.stride();
        let out = (
            e.each_mut().map(|plane| Rows { data: plane.data_mut(), stride }),
            Rows { data: strongest.data_mut(), stride },
        );
        bands.over(height, out, |range, (mut e, mut strongest)| {
            for (index, row) in range.enumerate() {
                let strongest = strongest.row(index);
                strongest.fill(0.0);
                let quiet = y.row(row).iter().all(|y| *y == 0.0);
                for (e, (dx, dy)) in e.iter_mut().zip(&*upstream) {
                    let e = e.row(index);
                    e.fill(0.0);
                    // Columns whose upstream pixel lies inside.
                    let (first, last) = (0.max(-dx) as usize, (width as isize).min(width as isize - dx));
                    let up = row as isize + dy;
                    if quiet || !(0..height as isize).contains(&up) || first as isize >= last {
                        continue;
                    }
                    let here = first..last as usize;
                    let there = (first as isize + dx) as usize..(last + dx) as usize;
                    let at = |row: usize, columns: &std::ops::Range<usize>| {
                        [&y.row(row)[columns.clone()], &slow.row(row)[columns.clone()]]
                    };
                    let (now, up) = (at(row, &here), at(up as usize, &there));
                    oppose(bands.level(), now, up, *floor, &mut e[here.clone()], &mut strongest[here]);
                }
            }
        });
    }

    pub fn reset(&mut self) {
        self.low_pass.reset();
        self.e.iter_mut().chain([&mut self.slow, &mut self.strongest]).for_each(|plane| plane.fill(0.0));
    }
}
