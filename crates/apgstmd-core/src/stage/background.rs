//! The background's motion from frame to frame, as far as the picture tells: none, a translation or a similarity.
//!
//! Input: P. Output: the motion, how well it explains the picture, and whether the scene was cut. `look` must come before
//! anything else sees the frame, since a cut ends what the filters remember; `follow` can come aside.

use fearless_simd::Level;

use crate::frame::Size;
use crate::memory::{Heap, Memory, heap};
use crate::params::{BackgroundMotion, Params, RejectionMode};
use crate::plane::Plane;
use crate::stage::similarity::Similarity;
use crate::stage::translation::Translation;
use crate::state::{Remember, StateError, Visit, remember};

/// A similarity of the plane: a place at (u, v) from the middle moves by shift + (stretch u - turn v, turn u + stretch v).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Motion {
    /// Movement of the middle, px.
    pub shift: (f64, f64),
    /// zoom cos(angle) - 1, the angle clockwise on the screen.
    pub stretch: f64,
    /// zoom sin(angle).
    pub turn: f64,
    /// What it turns about.
    pub middle: (f64, f64),
}

heap!(Motion);

impl Motion {
    pub fn still(size: Size) -> Self {
        let middle = ((size.width as f64 - 1.0) / 2.0, (size.height as f64 - 1.0) / 2.0);
        Self { shift: (0.0, 0.0), stretch: 0.0, turn: 0.0, middle }
    }

    /// How far the background at a place moves.
    pub fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let (u, v) = (x - self.middle.0, y - self.middle.1);
        (self.shift.0 + self.stretch * u - self.turn * v, self.shift.1 + self.turn * u + self.stretch * v)
    }

    /// Where the background at a place goes.
    pub fn carry(&self, place: (f64, f64)) -> (f64, f64) {
        let (dx, dy) = self.at(place);
        (place.0 + dx, place.1 + dy)
    }

    /// What it makes of a direction or velocity.
    pub fn turned(&self, (u, v): (f64, f64)) -> (f64, f64) {
        (u + self.stretch * u - self.turn * v, v + self.turn * u + self.stretch * v)
    }

    /// Both, one after the other, about the same middle.
    pub fn then(&self, next: &Self) -> Self {
        let (dx, dy) = next.turned(self.shift);
        let (zoomed, turned) = next.turned((1.0 + self.stretch, self.turn));
        Self { shift: (next.shift.0 + dx, next.shift.1 + dy), stretch: zoomed - 1.0, turn: turned, middle: self.middle }
    }

    /// The same in a picture that is `scale` times as large.
    pub fn enlarged(&self, scale: f64) -> Self {
        let place = |place: f64| (place + 0.5) * scale - 0.5;
        let (shift, middle) = (self.shift, self.middle);
        Self { shift: (scale * shift.0, scale * shift.1), middle: (place(middle.0), place(middle.1)), ..*self }
    }

    /// Radians, counter-clockwise on the screen.
    pub fn rotation(&self) -> f64 {
        // 0 and not -0 where nothing turns.
        if self.turn == 0.0 { 0.0 } else { (-self.turn).atan2(1.0 + self.stretch) }
    }

    pub fn zoom(&self) -> f64 {
        (1.0 + self.stretch).hypot(self.turn)
    }
}

/// What was found about a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Finding {
    pub motion: Motion,
    /// Robust scale of what the motion does not explain, luminance: 1.5 times the median absolute residual.
    pub residual: f32,
    /// The picture tells of no motion, and none is assumed.
    pub unexplained: bool,
    /// The picture has nothing to do with the last one.
    pub cut: bool,
}

impl Finding {
    pub fn nothing(size: Size) -> Self {
        Self { motion: Motion::still(size), residual: 0.0, unexplained: false, cut: false }
    }

    /// About two frames as if they were one.
    pub fn then(&self, next: &Self) -> Self {
        if next.cut {
            return *next;
        }
        Self {
            motion: self.motion.then(&next.motion),
            residual: self.residual.max(next.residual),
            unexplained: self.unexplained || next.unexplained,
            cut: self.cut,
        }
    }
}

enum Estimator {
    Off,
    /// What is found is told from outside.
    Told,
    Translation(Box<Translation>),
    Similarity(Box<Similarity>),
}

impl Heap for Estimator {
    fn heap(&self) -> Memory {
        match self {
            Self::Off | Self::Told => Memory::default(),
            Self::Translation(translation) => translation.heap(),
            Self::Similarity(similarity) => similarity.heap(),
        }
    }
}

pub(crate) struct Background {
    estimator: Estimator,
    /// Of each frame that is computed together.
    found: Vec<Finding>,
    none: Finding,
}

heap!(Finding);
impl Remember for Motion {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        let Self { shift, stretch, turn, middle } = self;
        visit.part("shift", shift)?;
        visit.part("stretch", stretch)?;
        visit.part("turn", turn)?;
        visit.part("middle", middle)?;
        // Beyond what any background does in the largest picture, so that what is carried along stays finite.
        let most = [
            (&mut shift.0, 1e6),
            (&mut shift.1, 1e6),
            (stretch, 1e2),
            (turn, 1e2),
            (&mut middle.0, 1e8),
            (&mut middle.1, 1e8),
        ];
        most.into_iter().for_each(|(value, most)| *value = value.clamp(-most, most));
        Ok(())
    }
}
remember!(Finding { motion, residual, unexplained, cut });
heap!(Background { estimator, found });
remember!(Background { estimator });

impl Remember for Estimator {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        match self {
            Self::Off | Self::Told => Ok(()),
            Self::Translation(translation) => translation.show(visit),
            Self::Similarity(similarity) => similarity.show(visit),
        }
    }
}

impl Background {
    /// For `together` frames at once.
    pub fn new(size: Size, params: &Params, together: usize) -> Self {
        let none = Finding::nothing(size);
        let estimator = match (params.rejection.mode, params.rejection.background) {
            (RejectionMode::Motion, BackgroundMotion::Translation) => {
                Estimator::Translation(Box::new(Translation::new(size)))
            }
            (RejectionMode::Motion, BackgroundMotion::Similarity) => {
                Estimator::Similarity(Box::new(Similarity::new(size, together)))
            }
            _ => Estimator::Off,
        };
        Self { estimator, found: vec![none; together], none }
    }

    /// Finds nothing by itself from now on: what it would find is told before each frame.
    pub fn listen(&mut self) {
        self.estimator = Estimator::Told;
    }

    /// What another one found about the next frame.
    pub fn tell(&mut self, found: &Finding) {
        self.found[0] = *found;
    }

    /// Whether the scene was cut before this frame of those that are computed together.
    pub fn look(&mut self, level: Level, p: &Plane, frame: usize) -> bool {
        match &mut self.estimator {
            Estimator::Similarity(similarity) => similarity.look(level, p, frame),
            Estimator::Told => self.found[frame].cut,
            Estimator::Off | Estimator::Translation(_) => false,
        }
    }

    /// What was looked at as `frame` is the first frame from now on.
    pub fn begin_at(&mut self, frame: usize) {
        if let Estimator::Similarity(similarity) = &mut self.estimator {
            similarity.begin_at(frame);
        }
    }

    /// Finds the motion since the last frame. `look` has seen this one.
    pub fn follow(&mut self, level: Level, p: &Plane, frame: usize) {
        self.found[frame] = match &mut self.estimator {
            Estimator::Off => self.none,
            Estimator::Told => self.found[frame],
            Estimator::Translation(translation) => {
                let (shift, residual) = translation.process(p);
                let motion = Motion { shift: shift.unwrap_or((0.0, 0.0)), ..self.none.motion };
                Finding { motion, residual, unexplained: shift.is_none(), cut: false }
            }
            Estimator::Similarity(similarity) => similarity.follow(level, p, frame),
        };
    }

    /// What `follow` found about a frame of those that are computed together.
    pub fn found(&self, frame: usize) -> &Finding {
        &self.found[frame]
    }

    pub fn reset(&mut self) {
        self.found.fill(self.none);
        match &mut self.estimator {
            Estimator::Off | Estimator::Told => {}
            Estimator::Translation(translation) => translation.reset(),
            Estimator::Similarity(similarity) => similarity.reset(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_motion_after_the_other() {
        let still = Motion::still(Size::new(101, 201));
        let first = Motion { shift: (3.0, -2.0), stretch: 0.02, turn: 0.1, ..still };
        let second = Motion { shift: (-1.0, 5.0), stretch: -0.04, turn: 0.03, ..still };
        let both = first.then(&second);
        for place in [(0.0, 0.0), (100.0, 50.0), (37.0, 91.0)] {
            let (x, y) = second.carry(first.carry(place));
            let (u, v) = both.carry(place);
            assert!((x - u).abs() < 1e-12 && (y - v).abs() < 1e-12, "{place:?}");
        }
    }

    #[test]
    fn the_same_in_a_larger_picture() {
        let small = Motion { shift: (3.0, -2.0), stretch: 0.02, turn: 0.1, ..Motion::still(Size::new(50, 100)) };
        let full = small.enlarged(4.0);
        assert_eq!(full.middle, Motion::still(Size::new(200, 400)).middle);
        let enlarged = |(x, y): (f64, f64)| (4.0 * (x + 0.5) - 0.5, 4.0 * (y + 0.5) - 0.5);
        for place in [(0.0, 0.0), (99.0, 12.0)] {
            let (a, b) = (enlarged(small.carry(place)), full.carry(enlarged(place)));
            assert!((a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-9, "{a:?} {b:?}");
        }
    }

    #[test]
    fn rotation_is_counter_clockwise_on_the_screen() {
        let still = Motion::still(Size::new(101, 201));
        assert_eq!((still.at((3.0, 4.0)), still.rotation(), still.zoom()), ((0.0, 0.0), 0.0, 1.0));
        let (angle, zoom) = (0.1f64, 1.05);
        let motion = Motion { stretch: zoom * angle.cos() - 1.0, turn: -zoom * angle.sin(), ..still };
        assert!((motion.rotation() - angle).abs() < 1e-12 && (motion.zoom() - zoom).abs() < 1e-12);
        // Right of the middle it goes up.
        let (x, y) = motion.carry((150.0, 50.0));
        assert!((x - (100.0 + 50.0 * zoom * angle.cos())).abs() < 1e-9, "{x}");
        assert!((y - (50.0 - 50.0 * zoom * angle.sin())).abs() < 1e-9, "{y}");
    }
}
