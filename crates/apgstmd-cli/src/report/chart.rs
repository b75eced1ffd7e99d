//! What all charts share: colours, letters, frame, axes. SVG, in colours that the page's style sheet knows.

use plotters::coord::Shift;
use plotters::coord::ranged1d::ValueFormatter;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

const SIZE: (u32, u32) = (560, 400);
pub(crate) const INK: RGBColor = RGBColor(0x24, 0x29, 0x2f);
pub(crate) const LINE: RGBColor = RGBColor(0xd0, 0xd7, 0xde);
pub(crate) const CURVE: RGBColor = RGBColor(0x09, 0x69, 0xda);
pub(crate) const MARK: RGBColor = RGBColor(0xbc, 0x4c, 0x00);
pub(crate) const LETTERS: (&str, i32) = ("sans-serif", 15);

pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(crate) type Drawn<'a, T = ()> = Result<T, DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>>;

/// A picture as text.
pub(crate) fn draw(paint: impl for<'a> FnOnce(&Area<'a>) -> Drawn<'a>) -> String {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        paint(&area).and_then(|()| area.present()).expect("a string takes every drawing");
    }
    svg
}

/// Room for axes and their names.
pub(crate) fn frame<'a, 'b>(area: &'b Area<'a>) -> ChartBuilder<'b, 'b, SVGBackend<'a>> {
    let mut builder = ChartBuilder::on(area);
    builder.margin(12).margin_right(20).x_label_area_size(48).y_label_area_size(56);
    builder
}

/// Axes with their names, and how their numbers are written.
pub(crate) fn mesh<'a, X>(
    chart: &mut ChartContext<'_, SVGBackend<'a>, Cartesian2d<X, RangedCoordf64>>,
    (x, x_number): (&str, &dyn Fn(&f64) -> String),
    (y, y_number): (&str, &dyn Fn(&f64) -> String),
) -> Drawn<'a>
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(LINE)
        .axis_style(INK)
        .label_style(LETTERS.into_font().color(&INK))
        .axis_desc_style(LETTERS.into_font().color(&INK))
        .x_desc(x)
        .y_desc(y)
        .x_label_formatter(x_number)
        .y_label_formatter(y_number)
        .draw()
}
