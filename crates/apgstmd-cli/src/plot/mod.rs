//! Figures as data, drawn in one go into SVG and PNG. Knows nothing of experiments.
//!
//! Lengths are in half CSS pixels: plotters counts whole ones, and curves want finer steps.

mod backend;
mod comparison;
mod curves;
mod legend;
mod map;
mod painter;
mod polar;
mod relief;
mod style;
#[cfg(test)]
mod tests;
mod text;

use ndarray::Array2;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind};
use plotters::prelude::*;

pub use comparison::{Measured, comparison, roc};

use backend::{Twin, finish};
use painter::Painter;

/// Panels in rows.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// Panels beside each other.
    pub columns: usize,
    /// Row by row.
    pub panels: Vec<Panel>,
}

/// One picture of a figure.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Whether it takes the whole width of the figure.
    pub wide: bool,
    /// Above it.
    pub title: String,
    /// What it shows.
    pub plot: Plot,
}

/// What a panel shows.
#[derive(Clone, Debug)]
pub enum Plot {
    /// Lines over an axis.
    Curves(Curves),
    /// A value for each of the eight directions, from the centre outward.
    Polar(Polar),
    /// A plane in colours.
    Map(Map),
    /// A plane as a landscape.
    Relief(Relief),
}

/// Lines over an axis.
#[derive(Clone, Debug, Default)]
pub struct Curves {
    /// Horizontal.
    pub x: Axis,
    /// Vertical.
    pub y: Axis,
    /// Drawn in this order, in the colours of the palette.
    pub series: Vec<Series>,
    /// Shaded intervals of the horizontal axis, and what they mean.
    pub spans: Vec<(f64, f64, String)>,
    /// Places on the horizontal axis, with their names.
    pub marks: Vec<(f64, String)>,
}

/// An axis of [`Curves`].
#[derive(Clone, Debug, Default)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// Its ends; without them, those of the data.
    pub range: Option<(f64, f64)>,
    /// Logarithmic: for values above zero.
    pub logarithmic: bool,
}

/// A line.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// For the legend; without a name it has no entry there.
    pub name: String,
    /// (x, y).
    pub points: Vec<(f64, f64)>,
    /// Confidence interval (low, high) of each point, if known.
    pub bars: Vec<(f64, f64)>,
    /// How it is drawn.
    pub look: Look,
    /// Number in the palette; without one, the place in the list.
    pub color: Option<usize>,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Look {
    /// A line with a dot at each point.
    #[default]
    Dots,
    /// A line.
    Line,
    /// A dashed line.
    Dashed,
}

/// A value for each of the eight directions.
#[derive(Clone, Debug)]
pub struct Polar {
    /// Name and values of each curve.
    pub series: Vec<(String, [f64; 8])>,
    /// Value at the outer ring; without one, the largest.
    pub full: Option<f64>,
    /// A direction that is marked by an arrow, radians.
    pub arrow: Option<f64>,
}

/// A plane in colours. Row 0 is drawn at the top.
#[derive(Clone, Debug)]
pub struct Map {
    /// (rows, columns).
    pub values: Array2<f64>,
    /// Columns.
    pub x: Grid,
    /// Rows.
    pub y: Grid,
    /// What the colours mean; without it there is no bar.
    pub label: String,
    /// Which colours.
    pub colors: Colors,
    /// Values at the ends of the colours; without them, those of the data.
    pub range: Option<(f64, f64)>,
    /// Points with names.
    pub marks: Vec<(f64, f64, String)>,
    /// Lines drawn over it, (x, y).
    pub lines: Vec<Vec<(f64, f64)>>,
}

/// Coordinates of rows or columns of a map.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Quantity and unit.
    pub label: String,
    /// At row or column 0.
    pub first: f64,
    /// From one to the next; negative where it falls.
    pub step: f64,
}

/// Colours of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colors {
    /// Perceptually uniform.
    Viridis,
    /// Luminance.
    Grey,
}

/// A plane as a landscape, row 0 at the back.
#[derive(Clone, Debug)]
pub struct Relief {
    /// (rows, columns).
    pub values: Array2<f64>,
    /// Half its width: x and y run from -reach to reach.
    pub reach: f64,
    /// What the height means.
    pub label: String,
}

/// A figure on its way to the disk.
pub struct Drawing {
    /// A document of its own, that can also stand in a page.
    pub svg: String,
    /// A PNG file of the same.
    pub png: Vec<u8>,
}

type Area<'a> = DrawingArea<Twin<'a>, Shift>;
type Drawn<T = ()> = Result<T, DrawingAreaErrorKind<std::io::Error>>;

/// Draws a figure.
pub fn draw(figure: &Figure) -> Drawing {
    let whole = style::PANEL * figure.columns.max(1) as u32;
    let width = |panel: &Panel| if panel.wide { whole } else { style::PANEL };
    let rows = figure.rows();
    let height = |row: &[Panel]| row.iter().map(|panel| panel.plot.height(width(panel))).max().unwrap_or(0);
    let heights: Vec<u32> = rows.iter().map(|row| height(row) + style::HEAD).collect();
    let size = (whole, heights.iter().sum::<u32>().max(1));
    let (mut svg, mut painter, mut images) = (String::new(), Painter::new(size), Vec::new());
    let drawn: Drawn = {
        let mut rest = Twin::new(&mut svg, &mut painter, &mut images, size).into_drawing_area();
        rows.iter()
            .zip(&heights)
            .try_for_each(|(row, height)| {
                let (mut left, below) = rest.split_vertically(*height);
                rest = below;
                row.iter().try_for_each(|panel| {
                    let (cell, right) = left.split_horizontally(width(panel));
                    left = right;
                    panel.draw(&cell)
                })
            })
            .and_then(|()| rest.present())
    };
    drawn.expect("memory takes every drawing");
    Drawing { svg: finish(&svg, &images, size), png: painter.png() }
}

impl Figure {
    /// A wide panel is a row of its own.
    fn rows(&self) -> Vec<&[Panel]> {
        let mut rows = Vec::new();
        let mut begin = 0;
        for (i, panel) in self.panels.iter().enumerate() {
            let full = i - begin == self.columns.max(1);
            if i > begin && (full || panel.wide || self.panels[i - 1].wide) {
                rows.push(&self.panels[begin..i]);
                begin = i;
            }
        }
        if begin < self.panels.len() {
            rows.push(&self.panels[begin..]);
        }
        rows
    }
}

impl Panel {
    /// An ordinary panel.
    pub fn new(title: impl Into<String>, plot: Plot) -> Self {
        Self { wide: false, title: title.into(), plot }
    }

    fn draw(&self, area: &Area<'_>) -> Drawn {
        let (head, body) = area.split_vertically(style::HEAD);
        let middle = (head.dim_in_pixel().0 as i32 / 2, style::HEAD as i32 / 2 + 4);
        head.draw(&Text::new(self.title.as_str(), middle, style::title()))?;
        match &self.plot {
            Plot::Curves(curves) => curves.draw(&body),
            Plot::Polar(polar) => polar.draw(&body),
            Plot::Map(map) => map.draw(&body),
            Plot::Relief(relief) => relief.draw(&body),
        }
    }
}

impl Plot {
    fn height(&self, width: u32) -> u32 {
        match self {
            Self::Curves(curves) => curves.height(width),
            Self::Polar(polar) => polar.height(width),
            Self::Map(map) => map.height(width),
            Self::Relief(_) => relief::HEIGHT,
        }
    }
}
