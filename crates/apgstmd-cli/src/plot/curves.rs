//! Lines over an axis.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::legend::{self, Sample};
use super::style::{INK, LINE, color, in_powers, number, power, superscript, text};
use super::{Area, Axis, Curves, Drawn, Look, Series};

const BODY: u32 = 600;
const MARGIN: u32 = 20;
const BELOW: u32 = 92;
const BESIDE: u32 = 124;

impl Curves {
    pub(super) fn height(&self, width: u32) -> u32 {
        BODY + legend::height(&self.entries(), width)
    }

    fn entries(&self) -> Vec<(&str, Sample)> {
        let curves = self.series.iter().enumerate().map(|(i, s)| (s.name.as_str(), Sample::Stroke(s.look, s.color(i))));
        let spans = self.spans.iter().map(|(_, _, name)| (name.as_str(), Sample::Shade));
        curves.chain(spans).filter(|(name, _)| !name.is_empty()).collect()
    }

    pub(super) fn draw(&self, area: &Area<'_>) -> Drawn {
        let entries = self.entries();
        let (top, body) = area.split_vertically(legend::height(&entries, area.dim_in_pixel().0));
        legend::draw(&top, &entries)?;
        let x = self.x.scale(self.series.iter().flat_map(|s| s.points.iter().map(|p| p.0)), false);
        let values = self.series.iter().flat_map(|s| {
            let ends = s.bars.iter().flat_map(|bar| [bar.0, bar.1]);
            s.points.iter().map(|p| p.1).chain(ends)
        });
        let y = self.y.scale(values, true);
        let mut chart = ChartBuilder::on(&body)
            .margin(MARGIN)
            .margin_right(36)
            .x_label_area_size(BELOW)
            .y_label_area_size(BESIDE)
            .build_cartesian_2d(x.low..x.high, y.low..y.high)?;
        let shade = |(from, to, _): &(f64, f64, String)| {
            Rectangle::new([(x.at(*from), y.low), (x.at(*to), y.high)], INK.mix(0.1).filled())
        };
        chart.draw_series(self.spans.iter().map(shade))?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(LINE)
            .axis_style(INK)
            .x_labels(9)
            .y_labels(7)
            .label_style(text(HPos::Left, VPos::Center))
            .axis_desc_style(text(HPos::Left, VPos::Center))
            .x_desc(in_powers(&self.x.label, x.tens))
            .y_desc(in_powers(&self.y.label, y.tens))
            .x_label_formatter(&|place| x.tick(*place))
            .y_label_formatter(&|place| y.tick(*place))
            .draw()?;
        for (place, name) in &self.marks {
            let (x, style) = (x.at(*place), INK.mix(0.7).stroke_width(2));
            chart.draw_series(DashedLineSeries::new([(x, y.low), (x, y.high)], 8, 8, style))?;
            chart.draw_series([Text::new(format!(" {name}"), (x, y.high), text(HPos::Left, VPos::Top))])?;
        }
        for (i, series) in self.series.iter().enumerate() {
            let color = series.color(i);
            let points: Vec<(f64, f64)> = series.points.iter().map(|point| (x.at(point.0), y.at(point.1))).collect();
            let bars = series.points.iter().zip(&series.bars).map(|(point, bar)| {
                PathElement::new([(x.at(point.0), y.at(bar.0)), (x.at(point.0), y.at(bar.1))], color.stroke_width(3))
            });
            chart.draw_series(bars)?;
            match series.look {
                Look::Dashed => chart.draw_series(DashedLineSeries::new(points, 14, 10, color.stroke_width(4)))?,
                Look::Line => chart.draw_series(LineSeries::new(points, color.stroke_width(4)))?,
                Look::Dots => {
                    chart.draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(4)))?;
                    chart.draw_series(points.into_iter().map(|point| Circle::new(point, 7, color.filled())))?
                }
            };
        }
        Ok(())
    }
}

impl Series {
    fn color(&self, place: usize) -> RGBColor {
        color(self.color.unwrap_or(place))
    }
}

/// Where values stand on an axis: counted in powers of ten, or as their logarithm.
struct Scale {
    low: f64,
    high: f64,
    tens: i32,
    logarithmic: bool,
}

impl Scale {
    /// Place of a value; what lies outside stands at the end.
    fn at(&self, value: f64) -> f64 {
        let place = if self.logarithmic { value.log10() } else { value * 10f64.powi(-self.tens) };
        if place.is_nan() { self.low } else { place.clamp(self.low, self.high) }
    }

    /// What is written there. Logarithmic: whole powers of ten only.
    fn tick(&self, place: f64) -> String {
        match self.logarithmic {
            false => number(place),
            true if (place - place.round()).abs() > 1e-6 => String::new(),
            true if self.low > -3.5 && self.high < 3.5 => number(10f64.powf(place)),
            true => format!("10{}", superscript(place.round() as i32)),
        }
    }
}

impl Axis {
    /// From end to end as asked for; else as the data has it, `from_zero` with some room above.
    fn scale(&self, data: impl Iterator<Item = f64>, from_zero: bool) -> Scale {
        let logarithmic = self.logarithmic;
        let seen = data.filter(|value| value.is_finite() && (!logarithmic || *value > 0.0));
        let (least, most) =
            seen.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = match self.range {
            Some(range) => range,
            None if least > most => (if logarithmic { 0.1 } else { 0.0 }, 1.0),
            None if logarithmic && from_zero => (0.8 * least, 1.25 * most),
            None if !from_zero => (least, most),
            None if least >= 0.0 => (0.0, 1.08 * most),
            None => (least - 0.08 * (most - least), most + 0.08 * (most - least)),
        };
        let tens = if logarithmic { 0 } else { power(high.abs().max(low.abs())) };
        let place = |value: f64| if logarithmic { value.log10() } else { value * 10f64.powi(-tens) };
        let (low, high) = (place(low), place(high));
        // One value alone stands in the middle.
        let (low, high) = if low < high { (low, high) } else { (low - 0.5, low + 0.5) };
        Scale { low, high, tens, logarithmic }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(axis: &Axis, data: &[f64], from_zero: bool) -> (f64, f64) {
        let scale = axis.scale(data.iter().copied(), from_zero);
        (scale.low, scale.high)
    }

    #[test]
    fn axes_hold_their_data() {
        let axis = Axis::default();
        assert_eq!(ends(&axis, &[2.0, 5.0], false), (2.0, 5.0));
        assert_eq!(ends(&axis, &[2.0, 5.0], true).0, 0.0);
        assert!(ends(&axis, &[-1.0, 1.0], true).0 < -1.0);
        let logarithmic = Axis { logarithmic: true, ..Axis::default() };
        assert_eq!(ends(&logarithmic, &[0.0, 0.01, 100.0], false), (-2.0, 2.0));
        for axis in [axis, logarithmic] {
            for from_zero in [false, true] {
                for odd in [&[][..], &[0.0], &[7.0], &[f64::NAN], &[-1.0]] {
                    let (low, high) = ends(&axis, odd, from_zero);
                    assert!(low < high, "{odd:?}: {low} {high}");
                }
            }
        }
    }

    #[test]
    fn logarithmic_ticks_are_powers_of_ten() {
        let axis = Axis { logarithmic: true, range: Some((1e-6, 1e3)), ..Axis::default() };
        let scale = axis.scale(std::iter::empty(), false);
        let ticks = [-6.0, -2.0, 0.5, 3.0].map(|place| scale.tick(place));
        assert_eq!(ticks, ["10⁻⁶", "10⁻²", "", "10³"]);
        let axis = Axis { range: Some((1e-3, 1e2)), ..axis };
        assert_eq!(axis.scale(std::iter::empty(), false).tick(-2.0), "0.01");
        assert_eq!((scale.at(0.0), scale.at(1e9)), (-6.0, 3.0));
    }
}
