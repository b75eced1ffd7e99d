//! What a member sees of a stream: every frame, or the mean of several as one.
//!
//! A target of a quarter of a pixel a frame moves by half a pixel from one mean of two frames to the next, and its member is a
//! detector of 0.5 px/frame of these, at half of the cost. What a member of slower filters would average of the noise, the mean
//! does. Members that take 2, 4 or 8 frames as one are never due in the same frame.
//!
//! State: the sum of the frames taken so far, and how the background has moved meanwhile.

use super::window::{Known, Pixels};
use crate::frame::Size;
use crate::memory::heap;
use crate::plane::Plane;
use crate::scroll::Scroll;
use crate::stage::background::Finding;
use crate::state::{Remember, StateError, Visit};
use crate::tiles::Area;

/// Farthest that a target moves from one exposure to the next, px. With a whole pixel, targets that change their speed are lost.
const FARTHEST: f64 = 0.5;
/// Most frames that are taken as one.
pub(super) const LONGEST: usize = 8;

/// Frames that are taken as one for targets of `speed` px/frame: a power of two in which they move by half a pixel at most.
pub(super) fn length(speed: f64) -> usize {
    let mut length = 1;
    while length < LONGEST && 2.0 * speed * length as f64 <= FARTHEST {
        length *= 2;
    }
    length
}

pub(super) struct Exposure {
    pub length: usize,
    /// Frames in the sum.
    pub taken: usize,
    /// Of no size where every frame is seen.
    sum: Plane,
    /// About the frames taken, as if they were one.
    pub found: Finding,
    /// How the window moved with them, and what of it was known before.
    by: (isize, isize),
    before: Area,
    nothing: Finding,
}

heap!(Exposure { sum });

impl Remember for Exposure {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        if self.length == 1 {
            return Ok(());
        }
        visit.index("taken", &mut self.taken, self.length + 1)?;
        visit.part("sum", &mut self.sum)?;
        visit.part("found", &mut self.found)?;
        visit.part("by", &mut Pixels(&mut self.by))?;
        visit.part("before", &mut Known(&mut self.before, self.sum.size()))
    }
}

impl Exposure {
    pub fn new(size: Size, length: usize) -> Self {
        let sum = Plane::new(if length == 1 { Size::new(0, 0) } else { size });
        let nothing = Finding::nothing(size);
        Self { length, taken: 0, sum, found: nothing, by: (0, 0), before: Area::whole(size), nothing }
    }

    /// Whether a frame, counted from the start, ends an exposure of several.
    fn is_last(&self, frame: u64) -> bool {
        frame % self.length as u64 == self.length as u64 / 2 - 1
    }

    /// Takes a frame, of which `found` is what the background did before it, after what was taken of the others has moved. Whether
    /// `p` and `found` are now to be seen.
    pub fn take(&mut self, frame: u64, scroll: &Scroll<'_>, found: &Finding) -> bool {
        let p = scroll.p;
        if self.length == 1 {
            self.begin(scroll, found);
            return true;
        }
        if self.taken == 0 || found.cut || self.is_last(frame.wrapping_sub(1)) {
            self.begin(scroll, found);
            self.sum.data_mut().copy_from_slice(p.data());
        } else {
            self.found = self.found.then(found);
            self.by = (self.by.0.saturating_add(scroll.by.0), self.by.1.saturating_add(scroll.by.1));
            self.before = self.before.moved(scroll.by, p.size());
            self.sum.scroll(scroll, self.taken as f32);
            self.taken += 1;
            self.sum.data_mut().iter_mut().zip(p.data()).for_each(|(sum, p)| *sum += p);
        }
        let due = self.is_last(frame);
        if due {
            let share = 1.0 / self.taken as f32;
            self.sum.data_mut().iter_mut().for_each(|sum| *sum *= share);
        }
        due
    }

    fn begin(&mut self, scroll: &Scroll<'_>, found: &Finding) {
        (self.taken, self.found, self.by, self.before) = (1, *found, scroll.by, scroll.before);
    }

    /// The frames taken as one, where `last` is the last.
    pub fn scroll<'a>(&'a self, last: Scroll<'a>) -> Scroll<'a> {
        Scroll { by: self.by, p: self.p(last.p), before: self.before, ..last }
    }

    /// P of the frames taken as one, where `p` is that of the last.
    fn p<'a>(&'a self, p: &'a Plane) -> &'a Plane {
        if self.length == 1 { p } else { &self.sum }
    }

    pub fn reset(&mut self) {
        (self.taken, self.found, self.by) = (0, self.nothing, (0, 0));
        self.sum.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage::background::Motion;

    const SIZE: Size = Size { height: 20, width: 30 };

    fn plane(value: f32) -> Plane {
        let mut plane = Plane::new(SIZE);
        plane.fill(value);
        plane
    }

    fn shifted(x: f64) -> Finding {
        let nothing = Finding::nothing(SIZE);
        Finding { motion: Motion { shift: (x, 0.0), ..nothing.motion }, ..nothing }
    }

    #[test]
    fn slow_targets_move_by_half_a_pixel_at_most() {
        let speeds = [8.0, 1.0, 0.51, 0.5, 0.3, 0.25, 0.13, 0.125, 0.02];
        assert_eq!(speeds.map(length), [1, 1, 1, 1, 1, 2, 2, 4, 8]);
    }

    #[test]
    fn means_and_motions_of_the_frames_since_the_last() {
        let mut exposure = Exposure::new(SIZE, 4);
        let mut seen = Vec::new();
        for t in 0..12 {
            let p = plane(t as f32);
            if exposure.take(t, &Scroll::none(&p), &shifted(t as f64)) {
                seen.push((t, exposure.p(&p).row(7)[5], exposure.found.motion.shift.0));
            }
        }
        assert_eq!(seen, [(1, 0.5, 1.0), (5, 3.5, 14.0), (9, 7.5, 30.0)]);
    }

    #[test]
    fn after_a_cut_nothing_of_what_was_before() {
        let mut exposure = Exposure::new(SIZE, 4);
        let mut seen = Vec::new();
        for t in 0..10 {
            let p = plane(t as f32);
            let found = Finding { cut: t == 4, ..shifted(t as f64) };
            if exposure.take(t, &Scroll::none(&p), &found) {
                seen.push((exposure.p(&p).row(0)[0], exposure.found.cut));
            }
        }
        assert_eq!(seen, [(0.5, false), (4.5, true), (7.5, false)]);
    }

    /// What was seen of the world stays where it was; what comes in is taken for what it was in all frames.
    #[test]
    fn the_sum_moves_with_what_is_seen() {
        let mut exposure = Exposure::new(SIZE, 4);
        let dotted = |x: usize| {
            let mut p = plane(0.0);
            p.row_mut(7)[x] = 1.0;
            p
        };
        exposure.take(2, &Scroll::none(&dotted(20)), &shifted(0.0));
        let p = dotted(26);
        exposure.take(3, &Scroll { by: (6, 0), ..Scroll::none(&p) }, &shifted(6.0));
        let mut p = dotted(23);
        p.row_mut(7)[29] = 0.5;
        exposure.take(4, &Scroll { by: (-3, 0), ..Scroll::none(&p) }, &shifted(-3.0));
        exposure.take(5, &Scroll::none(&p), &shifted(0.0));
        let mean = exposure.p(&p);
        assert_eq!((mean.row(7)[23], mean.row(7)[29], mean.row(7)[20]), (1.0, 0.5, 0.0));
    }

    #[test]
    fn none_are_due_together() {
        let mut exposures = [2, 4, 8].map(|length| Exposure::new(SIZE, length));
        let p = plane(0.5);
        let due: Vec<usize> = (0..16)
            .map(|t| exposures.iter_mut().map(|e| usize::from(e.take(t, &Scroll::none(&p), &shifted(0.0)))).sum())
            .collect();
        assert!(due.iter().all(|due| *due <= 1) && due.iter().sum::<usize>() == 8 + 4 + 2, "{due:?}");
    }
}
