//! Rectangles by exact area coverage.

use ndarray::Array2;

/// A rectangle by its edges, px; pixel i lies between edge i and edge i + 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rectangle {
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
}

impl Rectangle {
    /// Around a centre, given as an array index (pixel centres at integers).
    pub fn around(center: (f64, f64), width: f64, height: f64) -> Self {
        let (x, y) = (center.0 + 0.5, center.1 + 0.5);
        Self { left: x - width / 2.0, top: y - height / 2.0, right: x + width / 2.0, bottom: y + height / 2.0 }
    }

    pub fn grown(self, margin: f64) -> Self {
        Self {
            left: self.left - margin,
            top: self.top - margin,
            right: self.right + margin,
            bottom: self.bottom + margin,
        }
    }

    /// The common part; empty rectangles have area 0.
    pub fn within(self, other: Self) -> Self {
        Self {
            left: self.left.max(other.left),
            top: self.top.max(other.top),
            right: self.right.min(other.right),
            bottom: self.bottom.min(other.bottom),
        }
    }

    pub fn area(self) -> f64 {
        (self.right - self.left).max(0.0) * (self.bottom - self.top).max(0.0)
    }
}

/// A part of the picture: rows and columns from (top, left) on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub top: i64,
    pub left: i64,
    pub height: usize,
    pub width: usize,
}

impl Window {
    /// The pixels that a rectangle touches.
    pub fn touched(by: Rectangle) -> Self {
        let (left, top) = (by.left.floor() as i64, by.top.floor() as i64);
        let width = (by.right.ceil() as i64 - left).max(0) as usize;
        let height = (by.bottom.ceil() as i64 - top).max(0) as usize;
        Self { top, left, height, width }
    }
}

/// Share of pixel `index` that lies between two edges.
fn cover(index: i64, from: f64, to: f64) -> f64 {
    (to.min((index + 1) as f64) - from.max(index as f64)).max(0.0)
}

/// Calls `visit` with the index in the window and the covered share of each pixel the rectangle touches.
pub(super) fn for_each_covered(window: Window, rectangle: Rectangle, mut visit: impl FnMut([usize; 2], f64)) {
    let range = |from: f64, to: f64, first: i64, count: usize| {
        let last = first + count as i64;
        (from.floor().max(first as f64) as i64).min(last)..(to.ceil().min(last as f64) as i64).max(first)
    };
    for y in range(rectangle.top, rectangle.bottom, window.top, window.height) {
        let row = cover(y, rectangle.top, rectangle.bottom);
        for x in range(rectangle.left, rectangle.right, window.left, window.width) {
            let share = row * cover(x, rectangle.left, rectangle.right);
            if share > 0.0 {
                visit([(y - window.top) as usize, (x - window.left) as usize], share);
            }
        }
    }
}

/// Draws a rectangle of one luminance over what is there.
pub(super) fn draw(into: &mut Array2<f32>, window: Window, rectangle: Rectangle, luminance: f64) {
    for_each_covered(window, rectangle, |at, share| {
        let pixel = &mut into[at];
        *pixel = (f64::from(*pixel) * (1.0 - share) + luminance * share) as f32;
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(rectangle: Rectangle) -> Array2<f32> {
        let mut frame = Array2::ones((12, 16));
        draw(&mut frame, Window { top: 0, left: 0, height: 12, width: 16 }, rectangle, 0.0);
        frame
    }

    #[test]
    fn darkness_is_area_and_lies_at_the_centre_anywhere() {
        for i in 0..50 {
            let center = (5.0 + 0.137 * f64::from(i), 5.0 + 0.031 * f64::from(i));
            let rectangle = Rectangle::around(center, f64::from(1 + i % 5), 3.0);
            let frame = drawn(rectangle);
            let dark = |weight: fn((usize, usize)) -> f64| {
                frame.indexed_iter().map(|(at, v)| (1.0 - f64::from(*v)) * weight(at)).sum::<f64>()
            };
            let total = dark(|_| 1.0);
            // 40 pixels rounded to f32.
            assert!((total - rectangle.area()).abs() < 1e-5, "{total} {}", rectangle.area());
            assert!((dark(|(_, x)| x as f64) / total - center.0).abs() < 1e-5);
            assert!((dark(|(y, _)| y as f64) / total - center.1).abs() < 1e-5);
        }
    }

    #[test]
    fn one_pixel_exactly() {
        let frame = drawn(Rectangle::around((3.0, 2.0), 1.0, 1.0));
        assert!(frame.indexed_iter().all(|(at, v)| *v == if at == (2, 3) { 0.0 } else { 1.0 }));
    }

    #[test]
    fn fractional_sizes() {
        for i in 0..50 {
            let rectangle = Rectangle::around((6.0 + 0.03 * f64::from(i), 5.2), 0.1 + 0.13 * f64::from(i), 3.7);
            let dark: f64 = drawn(rectangle).iter().map(|v| 1.0 - f64::from(*v)).sum();
            assert!((dark - rectangle.area()).abs() < 1e-5, "{dark} {}", rectangle.area());
        }
    }

    #[test]
    fn outside_and_across_the_border() {
        for center in [(-20.0, 5.0), (40.0, 5.0), (5.0, -20.0), (5.0, 40.0), (-1e7, 1e7)] {
            assert!(drawn(Rectangle::around(center, 3.0, 3.0)).iter().all(|v| *v == 1.0));
        }
        let corner: f32 = drawn(Rectangle::around((-0.5, -0.5), 4.0, 4.0)).iter().map(|v| 1.0 - v).sum();
        assert_eq!(corner, 4.0);
    }
}
