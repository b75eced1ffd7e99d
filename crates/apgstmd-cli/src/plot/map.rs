//! A plane in colours, with a bar that says what they mean.

use ndarray::Array2;
use plotters::element::{Drawable, PointCollection};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};
use plotters_backend::{BackendCoord, DrawingErrorKind};

use super::style::{INK, in_powers, number, power, text, ticks};
use super::{Area, Colors, Drawn, Grid, Map};

const MARGIN: u32 = 20;
const BELOW: u32 = 88;
const BESIDE: u32 = 116;
/// Room of the colour bar with its numbers.
const BAR: u32 = 190;
/// Width of the bar.
const STRIPE: i32 = 34;
const HIGHEST: u32 = 640;

impl Colors {
    fn at(self, share: f64) -> RGBColor {
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
        match self {
            Self::Viridis => ViridisRGB.get_color(share),
            Self::Grey => {
                let level = (255.0 * share).round() as u8;
                RGBColor(level, level, level)
            }
        }
    }
}

/// As plotters' own, which only its raster backend brings along.
struct Bitmap<C> {
    corner: C,
    size: (u32, u32),
    rgb: Vec<u8>,
}

impl<'a, C: 'a> PointCollection<'a, C> for &'a Bitmap<C> {
    type Point = &'a C;
    type IntoIter = std::iter::Once<Self::Point>;
    fn point_iter(self) -> Self::IntoIter {
        std::iter::once(&self.corner)
    }
}

impl<C, DB: DrawingBackend> Drawable<DB> for Bitmap<C> {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        mut points: I,
        backend: &mut DB,
        _: (u32, u32),
    ) -> Result<(), DrawingErrorKind<DB::ErrorType>> {
        points.next().map_or(Ok(()), |place| backend.blit_bitmap(place, self.size, &self.rgb))
    }
}

impl Grid {
    /// Outer edges of the first and the last of `count` cells.
    fn edges(&self, count: usize) -> (f64, f64) {
        (self.first - self.step / 2.0, self.first + self.step * (count as f64 - 0.5))
    }
}

impl Map {
    /// Square cells, as large as there is room for.
    fn size(&self, room: u32) -> (u32, u32) {
        let (rows, columns) = self.values.dim();
        let widest = room - 2 * MARGIN - BESIDE - BAR;
        let cell = (f64::from(widest) / columns as f64).min(f64::from(HIGHEST) / rows as f64);
        ((cell * columns as f64).round() as u32, (cell * rows as f64).round() as u32)
    }

    pub(super) fn height(&self, room: u32) -> u32 {
        self.size(room).1 + 2 * MARGIN + BELOW
    }

    fn range(&self) -> (f64, f64) {
        let finite = || self.values.iter().copied().filter(|value| value.is_finite());
        let (low, high) =
            self.range.unwrap_or((finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max)));
        if low < high { (low, high) } else { (0.0, 1.0) }
    }

    pub(super) fn draw(&self, area: &Area<'_>) -> Drawn {
        let room = area.dim_in_pixel().0;
        let (width, height) = self.size(room);
        let (low, high) = self.range();
        let frame = room - width - BESIDE - BAR - 2 * MARGIN;
        let body = area.margin(0, 0, frame / 2, 0);
        let (main, _) = body.split_vertically(self.height(room));
        let (x, y) = (self.x.edges(self.values.ncols()), self.y.edges(self.values.nrows()));
        let mut chart = ChartBuilder::on(&main.split_horizontally(width + BESIDE + 2 * MARGIN).0)
            .margin(MARGIN)
            .x_label_area_size(BELOW)
            .y_label_area_size(BESIDE)
            .build_cartesian_2d(x.0..x.1, y.1..y.0)?;
        let (across, down) = chart.plotting_area().dim_in_pixel();
        let rgb = enlarged(&self.values, (across, down), |value| self.colors.at((value - low) / (high - low)));
        chart.draw_series([Bitmap { corner: (x.0, y.0), size: (across, down), rgb }])?;
        chart
            .configure_mesh()
            .disable_mesh()
            .axis_style(INK)
            .x_labels((width / 110).clamp(3, 9) as usize)
            .y_labels((height / 80).clamp(3, 8) as usize)
            .label_style(text(HPos::Left, VPos::Center))
            .axis_desc_style(text(HPos::Left, VPos::Center))
            .x_desc(self.x.label.as_str())
            .y_desc(self.y.label.as_str())
            .x_label_formatter(&|x| number(*x))
            .y_label_formatter(&|y| number(*y))
            .draw()?;
        let over = match self.colors {
            Colors::Viridis => WHITE,
            Colors::Grey => RGBColor(0xff, 0xd3, 0x3d),
        };
        for line in &self.lines {
            chart.draw_series(DashedLineSeries::new(line.iter().copied(), 12, 8, over.stroke_width(3)))?;
        }
        for (x, y, name) in &self.marks {
            chart.draw_series([Circle::new((*x, *y), 16, over.stroke_width(4))])?;
            // A dark edge, so that it can be read on any ground.
            let edge = [(16, -14), (20, -14), (16, -10), (20, -10)].map(|place| (place, BLACK));
            for (place, color) in edge.into_iter().chain([((18, -12), over)]) {
                let style = text(HPos::Left, VPos::Bottom).color(&color);
                chart.draw_series([EmptyElement::at((*x, *y)) + Text::new(name.clone(), place, style)])?;
            }
        }
        if self.label.is_empty() { Ok(()) } else { self.bar(&main, (low, high), width, height) }
    }

    fn bar(&self, area: &Area<'_>, (low, high): (f64, f64), width: u32, height: u32) -> Drawn {
        let tens = power(high.abs().max(low.abs()));
        let left = (width + BESIDE + MARGIN + 26) as i32;
        let top = MARGIN as i32;
        let bottom = top + height as i32;
        // As a picture: thin rectangles would leave seams in a browser.
        let share = |y: u32| f64::from(height - 1 - y) / f64::from((height - 1).max(1));
        let column = Array2::from_shape_fn((height as usize, 1), |(y, _)| share(y as u32));
        let rgb = enlarged(&column, (STRIPE as u32, height), |share| self.colors.at(share));
        area.draw(&Bitmap { corner: (left, top), size: (STRIPE as u32, height), rgb })?;
        let scale = 10f64.powi(-tens);
        for value in ticks(scale * low, scale * high, 5) {
            let share = (value / scale - low) / (high - low);
            let y = bottom - (share * f64::from(height)).round() as i32;
            area.draw(&PathElement::new([(left + STRIPE, y), (left + STRIPE + 8, y)], INK.stroke_width(2)))?;
            area.draw(&Text::new(number(value), (left + STRIPE + 14, y), text(HPos::Left, VPos::Center)))?;
        }
        let style = text(HPos::Left, VPos::Center)
            .transform(FontTransform::Rotate270)
            .pos(plotters::style::text_anchor::Pos::new(HPos::Center, VPos::Center));
        area.draw(&Text::new(in_powers(&self.label, tens), (left + STRIPE + 112, (top + bottom) / 2), style))
    }
}

/// The nearest cell for each pixel of the drawing: cells keep their edges.
fn enlarged(values: &Array2<f64>, (width, height): (u32, u32), color: impl Fn(f64) -> RGBColor) -> Vec<u8> {
    let (rows, columns) = values.dim();
    let nearest = |i: u32, of: u32, cells: usize| ((f64::from(i) + 0.5) / f64::from(of) * cells as f64) as usize;
    let mut rgb = Vec::with_capacity(3 * (width * height) as usize);
    for y in 0..height {
        let row = nearest(y, height, rows).min(rows - 1);
        for x in 0..width {
            let RGBColor(r, g, b) = color(values[(row, nearest(x, width, columns).min(columns - 1))]);
            rgb.extend([r, g, b]);
        }
    }
    rgb
}
