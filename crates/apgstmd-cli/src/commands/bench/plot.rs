//! Scaling curves as SVG.

use plotters::coord::ranged1d::ValueFormatter;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use crate::report::chart::{CURVE, Drawn, INK, LETTERS, LINE, MARK, draw, frame, mesh};

/// Colours of the series, in their order.
const COLOURS: [RGBColor; 3] = [CURVE, MARK, RGBColor(0x1a, 0x7f, 0x37)];

/// One curve.
pub(super) struct Series {
    pub name: String,
    pub points: Vec<(f64, f64)>,
    /// What would be ideal, rather than what was measured.
    pub ideal: bool,
}

/// How the x axis is divided.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Scale {
    /// From zero on.
    Linear,
    /// From the first value on, with whole numbers only.
    Whole,
    /// Equal distances are equal ratios.
    Logarithmic,
}

/// Some curves over one quantity. The y axis begins at zero.
pub(super) struct Figure<'a> {
    pub x: &'a str,
    pub y: &'a str,
    pub scale: Scale,
    /// Where the curves leave room for their names.
    pub names: SeriesLabelPosition,
    pub series: Vec<Series>,
}

impl Figure<'_> {
    pub fn svg(&self) -> String {
        let all = || self.series.iter().flat_map(|series| series.points.iter().copied());
        let (least, most) = all().fold((f64::INFINITY, 0.0f64), |(low, high), (x, _)| (low.min(x), high.max(x)));
        let top = 1.15 * all().map(|point| point.1).fold(0.0, f64::max);
        draw(|area| {
            area.fill(&WHITE)?;
            let mut builder = frame(area);
            let margin = 0.03 * (most - least).max(1e-9);
            match self.scale {
                Scale::Linear => self.paint(builder.build_cartesian_2d(0.0..most + margin, 0.0..top)?),
                Scale::Whole => self.paint(builder.build_cartesian_2d(least - margin..most + margin, 0.0..top)?),
                Scale::Logarithmic => {
                    self.paint(builder.build_cartesian_2d((0.8 * least..1.25 * most).log_scale(), 0.0..top)?)
                }
            }
        })
    }

    fn paint<'a: 'c, 'c, X>(
        &self,
        mut chart: ChartContext<'c, SVGBackend<'a>, Cartesian2d<X, RangedCoordf64>>,
    ) -> Drawn<'a>
    where
        X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let x_number = |x: &f64| match self.scale {
            Scale::Whole if (x - x.round()).abs() > 1e-6 => String::new(),
            _ => number(x),
        };
        mesh(&mut chart, (self.x, &x_number), (self.y, &number))?;
        let mut colours = COLOURS.iter().cycle();
        for series in &self.series {
            let points = || series.points.iter().copied();
            if series.ideal {
                let line = DashedLineSeries::new(points(), 5, 4, INK.mix(0.5).into());
                chart.draw_series(line)?.label(&series.name).legend(|(x, y)| legend(x, y, INK.mix(0.5)));
                continue;
            }
            let colour = *colours.next().unwrap_or(&CURVE);
            let line = LineSeries::new(points(), colour.stroke_width(2));
            chart.draw_series(line)?.label(&series.name).legend(move |(x, y)| legend(x, y, colour.into()));
            chart.draw_series(points().map(|point| Circle::new(point, 4, colour.filled())))?;
        }
        if self.series.len() > 1 {
            let letters = LETTERS.into_font().color(&INK);
            chart
                .configure_series_labels()
                .position(self.names.clone())
                .label_font(letters)
                .border_style(LINE)
                .background_style(WHITE)
                .draw()?;
        }
        Ok(())
    }
}

fn legend(x: i32, y: i32, colour: RGBAColor) -> PathElement<(i32, i32)> {
    PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2))
}

/// Bars with their names below.
pub(super) fn bars(y: &str, values: &[(&str, f64)]) -> String {
    let top = 1.15 * values.iter().map(|value| value.1).fold(0.0, f64::max);
    let count = values.len();
    draw(|area| {
        area.fill(&WHITE)?;
        let mut chart = frame(area).build_cartesian_2d(-0.5..count as f64 - 0.5, 0.0..top)?;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .disable_x_axis()
            .light_line_style(TRANSPARENT)
            .bold_line_style(LINE)
            .axis_style(INK)
            .label_style(LETTERS.into_font().color(&INK))
            .axis_desc_style(LETTERS.into_font().color(&INK))
            .y_desc(y)
            .y_label_formatter(&number)
            .draw()?;
        let bar = |(n, (_, value)): (usize, &(&str, f64))| {
            Rectangle::new([(n as f64 - 0.3, 0.0), (n as f64 + 0.3, *value)], CURVE.filled())
        };
        chart.draw_series(values.iter().enumerate().map(bar))?;
        use plotters::style::text_anchor::{HPos, Pos, VPos};
        for (n, (name, value)) in values.iter().enumerate() {
            let style = |vertical| LETTERS.into_font().color(&INK).pos(Pos::new(HPos::Center, vertical));
            let (left, bottom) = chart.backend_coord(&(n as f64, 0.0));
            area.draw(&Text::new(*name, (left, bottom + 8), style(VPos::Top)))?;
            let (left, top) = chart.backend_coord(&(n as f64, *value));
            area.draw(&Text::new(number(value), (left, top - 4), style(VPos::Bottom)))?;
        }
        Ok(())
    })
}

/// Three digits, no more than there are.
fn number(value: &f64) -> String {
    let digits = match value.abs() {
        size if size >= 100.0 || size == 0.0 => 0,
        size if size >= 10.0 => 1,
        size if size >= 1.0 => 2,
        _ => 3,
    };
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plotters::prelude::SeriesLabelPosition::UpperLeft;

    #[test]
    fn numbers_are_short() {
        for (value, text) in [(0.0, "0"), (1500.0, "1500"), (12.5, "12.5"), (2.0, "2"), (0.25, "0.25"), (1.234, "1.23")]
        {
            assert_eq!(number(&value), text);
        }
    }

    #[test]
    fn figures_hold_their_series() {
        let series =
            |name: &str, ideal| Series { name: name.to_owned(), points: vec![(1.0, 200.0), (4.0, 300.0)], ideal };
        for scale in [Scale::Linear, Scale::Whole, Scale::Logarithmic] {
            let series = vec![series("measured", false), series("ideal", true)];
            let svg = Figure { x: "threads", y: "frames/s", scale, names: UpperLeft, series }.svg();
            for text in ["threads", "frames/s", "measured", "ideal", "<circle"] {
                assert!(svg.contains(text), "{text}");
            }
            assert_eq!(svg.contains(">1.5<") || svg.contains("\n1.5\n"), scale == Scale::Linear);
        }
        let svg = bars("ms", &[("scalar", 9.0), ("avx2", 2.0)]);
        assert!(svg.contains("scalar") && svg.contains("avx2"));
    }
}
