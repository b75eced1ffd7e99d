//! The window through which the members of a level look: it stays with the background, so that they answer to what moves in
//! the world and not to what the camera does.
//!
//! Input: P and the background's movement. Output: P as seen through the window, and by how many whole pixels what is
//! remembered of it must move. Where the window lies beyond the picture it shows what was last seen there. P between its pixels
//! is interpolated (cubic convolution, Keys 1981). A rotation or zoom moves what is seen as before.
//!
//! State: how far the window lies beside the picture, what it shows, and of what place anything was ever seen. It goes along
//! in steps of a tile (of the full picture), so that what is remembered seldom moves and a camera that shakes moves nothing.

use crate::frame::Size;
use crate::memory::heap;
use crate::plane::{LANES, Plane};
use crate::row::bands::{Bands, Rows, Scratch};
use crate::row::mix::add_scaled;
use crate::scroll::{Scroll, came_in, scroll_maps};
use crate::state::{Remember, StateError, Visit};
use crate::tiles::{Area, TILE};

/// Taps of the interpolation, the first a pixel before the one on the left.
const TAPS: usize = 4;
/// Farthest that the window lies beside the picture, in steps.
const FARTHEST: f64 = 0.625;

/// Most whole pixels that it lies beside the picture at a scale.
pub(super) fn farthest(scale: usize) -> usize {
    (FARTHEST * (TILE / scale) as f64).ceil() as usize
}

pub(super) struct Window {
    /// Pixels of a step.
    step: usize,
    /// Place in the picture of its pixel (0, 0), px.
    pub beside: (f64, f64),
    /// Whole pixels that what it shows moved by since the last frame.
    by: (isize, isize),
    shown: Plane,
    /// What was seen before the last frame, as it lies now, and with it. Corners between the two count as seen.
    before: Area,
    seen: Area,
    /// A row between the rows of the picture, with what lies beside it, and what is seen of it.
    scratch: Scratch<[Vec<f32>; 2]>,
}

heap!(Window { shown, scratch });

impl Remember for Window {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        visit.part("shown", &mut self.shown)?;
        visit.part("seen", &mut Known(&mut self.seen, self.shown.size()))?;
        visit.part("beside", &mut self.beside)?;
        let farthest = FARTHEST * self.step as f64;
        let near = |side: f64| side.clamp(-farthest, farthest);
        self.beside = (near(self.beside.0), near(self.beside.1));
        Ok(())
    }
}

/// Whole pixels to the right and down, in a state.
pub(super) struct Pixels<'a>(pub &'a mut (isize, isize));

impl Remember for Pixels<'_> {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        let mut sides = (self.0.0 as f64, self.0.1 as f64);
        sides.show(visit)?;
        *self.0 = (sides.0 as isize, sides.1 as isize);
        Ok(())
    }
}

/// An area of maps of a size, in a state.
pub(super) struct Known<'a>(pub &'a mut Area, pub Size);

impl Remember for Known<'_> {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        let Self(Area { top, left, rows, columns }, Size { height, width }) = self;
        let mut sides = [*top, *left, *rows, *columns].map(|side| side as u64);
        visit.values(&[4], &mut sides)?;
        let [first, second, third, fourth] = sides.map(|side| side as usize);
        (*top, *left) = (first.min(*height), second.min(*width));
        (*rows, *columns) = (third.min(*height - *top), fourth.min(*width - *left));
        Ok(())
    }
}

impl Window {
    /// Upon a picture of `size`, reduced by `scale`.
    pub fn new(size: Size, scale: usize, threads: usize) -> Self {
        let (shown, whole) = (Plane::new(size), Area::whole(size));
        let stride = shown.stride();
        let scratch = Scratch::new(threads, || [stride + 2 * LANES, stride].map(|length| vec![0.0; length]));
        Self { step: TILE / scale, beside: (0.0, 0.0), by: (0, 0), shown, before: whole, seen: whole, scratch }
    }

    /// Goes along with the background, which moved by so many pixels; after a cut it begins anew.
    pub fn follow(&mut self, bands: &Bands, p: &Plane, shift: (f64, f64), cut: bool) {
        if cut {
            self.reset();
        }
        let (size, step) = (p.size(), self.step as f64);
        let go = |beside: &mut f64, shift: f64| {
            let to = *beside + if cut { 0.0 } else { shift };
            let by = if to.abs() > FARTHEST * step { (to / step).round() * step } else { 0.0 };
            *beside = to - by;
            by as isize
        };
        self.by = (go(&mut self.beside.0, shift.0), go(&mut self.beside.1, shift.1));
        let visible = visible(size, self.beside);
        self.before = self.seen.moved(self.by, size);
        self.seen = self.before.with(&visible);
        scroll_maps(self.shown.data_mut(), size, 1, self.by);
        if self.beside == (0.0, 0.0) {
            self.shown.data_mut().copy_from_slice(p.data());
        } else {
            self.look(bands, p, &visible);
        }
    }

    /// What is seen, how what is remembered of it must move, and what of it was known before.
    pub fn scroll(&self) -> Scroll<'_> {
        Scroll { by: self.by, p: &self.shown, before: self.before, seen: self.seen }
    }

    /// Shows what is visible and, whether it is or not, what came in.
    fn look(&mut self, bands: &Bands, p: &Plane, visible: &Area) {
        let Self { beside, by, shown, scratch, .. } = self;
        let (size, stride) = (p.size(), p.stride());
        let ((left, across), (top, down)) = (taps(beside.0), taps(beside.1));
        let (new_rows, new_columns) = (came_in(by.1, size.height), came_in(by.0, size.width));
        let visible_columns = match new_columns.is_empty() {
            true => visible.across(),
            false => visible.left.min(new_columns.start)..visible.across().end.max(new_columns.end),
        };
        let level = bands.level();
        bands.over(size.height, Rows { data: shown.data_mut(), stride }, |range, mut out| {
            scratch.with(bands, |[line, seen]| {
                for (row, y) in range.enumerate() {
                    let columns = if new_rows.contains(&y) {
                        0..size.width
                    } else if visible.down().contains(&y) {
                        visible_columns.clone()
                    } else {
                        new_columns.clone()
                    };
                    if columns.is_empty() {
                        continue;
                    }
                    let row_of = |tap: usize| {
                        let y = (y + tap).saturating_add_signed(top).min(size.height - 1);
                        (down[tap], p.padded_row(y))
                    };
                    let between = &mut line[LANES..LANES + stride];
                    between.fill(0.0);
                    add_scaled(level, &std::array::from_fn::<_, TAPS, _>(row_of), between);
                    // Beyond the border is what is at it.
                    let (start, end) = (between[0], between[size.width - 1]);
                    line[..LANES].fill(start);
                    line[LANES + size.width..].fill(end);
                    let first = LANES.saturating_add_signed(left);
                    seen.fill(0.0);
                    let column_of = |tap: usize| (across[tap], &line[first + tap..first + tap + stride]);
                    add_scaled(level, &std::array::from_fn::<_, TAPS, _>(column_of), seen);
                    out.part(row, columns.clone()).copy_from_slice(&seen[columns]);
                }
            });
        });
    }

    pub fn reset(&mut self) {
        let whole = Area::whole(self.shown.size());
        (self.beside, self.by, self.before, self.seen) = ((0.0, 0.0), (0, 0), whole, whole);
    }
}

/// What of a window beside a picture lies in it.
fn visible(size: Size, beside: (f64, f64)) -> Area {
    let side = |beside: f64, length: usize| {
        let last = (length - 1) as f64;
        let place = |place: f64| place.clamp(0.0, last) as usize;
        let first = place((-beside).ceil());
        (first, place((last - beside).floor()) + 1 - first)
    };
    let ((left, columns), (top, rows)) = (side(beside.0, size.width), side(beside.1, size.height));
    Area { top, left, rows, columns }
}

/// Where the first tap lies, and the taps.
fn taps(place: f64) -> (isize, [f32; TAPS]) {
    let cell = place.floor();
    let t = place - cell;
    let taps = [
        ((2.0 - t) * t - 1.0) * t / 2.0,
        ((3.0 * t - 5.0) * t * t + 2.0) / 2.0,
        ((4.0 - 3.0 * t) * t + 1.0) * t / 2.0,
        (t - 1.0) * t * t / 2.0,
    ];
    (cell as isize - 1, taps.map(|tap| tap as f32))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Size = Size { height: 26, width: 42 };

    fn picture(value: impl Fn(f64, f64) -> f64) -> Plane {
        let mut p = Plane::new(SIZE);
        for y in 0..SIZE.height {
            p.row_mut(y).iter_mut().enumerate().for_each(|(x, out)| *out = value(x as f64, y as f64) as f32);
        }
        p
    }

    /// Cubic convolution gives parabolas back.
    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn a_parabola_stands_still() {
        let scene = |x: f64, y: f64| 0.3 + 0.02 * x - 0.01 * y + 0.0002 * x * x - 0.0003 * x * y + 0.0004 * y * y;
        for scale in [1, 4] {
            let mut window = Window::new(SIZE, scale, 1);
            let (mut at, mut scrolled) = ((0.0, 0.0), (0, 0));
            for shift in [(0.3, -0.1), (0.3, 0.0), (-4.7, 2.25), (0.0, 0.0), (8.0, -0.75), (9.1, -6.4), (-3.3, 12.25)] {
                at = (at.0 + shift.0, at.1 + shift.1);
                let p = picture(|x, y| scene(x - at.0, y - at.1));
                window.follow(&Bands::single(), &p, shift, false);
                let scroll = window.scroll();
                scrolled = (scrolled.0 + scroll.by.0, scrolled.1 + scroll.by.1);
                let farthest = if scale == 1 { 10.0 } else { 2.5 };
                assert!(window.beside.0.abs() <= farthest && window.beside.1.abs() <= farthest, "{:?}", window.beside);
                let visible = visible(SIZE, window.beside);
                assert!(visible.rows >= 16 && visible.columns >= 32, "{visible:?}");
                // A tap lies beyond the border.
                for y in visible.down().skip(2).take(visible.rows - 4) {
                    for x in visible.across().skip(2).take(visible.columns - 4) {
                        let expected = scene(x as f64 - scrolled.0 as f64, y as f64 - scrolled.1 as f64);
                        let seen = f64::from(scroll.p.row(y)[x]);
                        // A dozen f32 operations on values of about one.
                        assert!((seen - expected).abs() < 1e-6, "{shift:?} ({x}, {y}): {seen} {expected}");
                    }
                }
            }
        }
    }

    /// What is out of view stays as it was, what was never seen is as its border until it is.
    #[test]
    fn beyond_the_picture_is_what_was_seen_there() {
        let mut window = Window::new(SIZE, 1, 1);
        let bands = Bands::single();
        window.follow(&bands, &picture(|x, _| x), (0.0, 0.0), false);
        // The camera goes to the right: columns on the left go out of view.
        window.follow(&bands, &picture(|x, _| x + 6.0), (-6.0, 0.0), false);
        let scroll = window.scroll();
        assert!(scroll.is_none());
        assert!((0..42).all(|x| scroll.p.row(5)[x] == x as f32), "{:?}", scroll.p.row(5));
        // And on: all moves by a tile, and 16 columns come in, of which 4 are still beyond the picture.
        window.follow(&bands, &picture(|x, _| x + 12.0), (-6.0, 0.0), false);
        let scroll = window.scroll();
        assert_eq!((scroll.by, window.beside.0), ((-16, 0), 4.0));
        assert_eq!((scroll.before.across(), scroll.seen.across()), (0..26, 0..38));
        let shown: Vec<f32> = (16..54).chain([53; 4]).map(|x| x as f32).collect();
        assert_eq!(scroll.p.row(5), shown);
        window.follow(&bands, &picture(|x, _| x + 13.0), (-1.0, 0.0), false);
        let scroll = window.scroll();
        assert_eq!((scroll.by, scroll.before.across(), scroll.seen.across()), ((0, 0), 0..38, 0..39));
        assert_eq!(scroll.p.row(5)[36..], [52.0, 53.0, 54.0, 53.0, 53.0, 53.0]);
    }

    #[test]
    fn a_cut_begins_anew() {
        let p = picture(|x, _| x);
        let mut window = Window::new(SIZE, 1, 1);
        window.follow(&Bands::single(), &p, (3.4, 0.2), false);
        window.follow(&Bands::single(), &p, (3.4, 0.2), true);
        assert_eq!(window.beside, (0.0, 0.0));
        assert!(window.scroll().is_none() && window.scroll().p.view() == p.view());
    }
}
