//! A plane as a landscape: plotters' 3-D chart, coloured by height.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::style::{LINE, in_powers, number, power, text};
use super::{Area, Drawn, Relief};

pub(super) const HEIGHT: u32 = 760;

impl Relief {
    pub(super) fn draw(&self, area: &Area<'_>) -> Drawn {
        let (rows, columns) = self.values.dim();
        let (low, high) =
            self.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
        let tens = power(high.abs().max(low.abs()));
        let scale = 10f64.powi(-tens);
        let span = if high > low { high - low } else { 1.0 };
        let floor = scale * if low < 0.0 { low - 0.05 * span } else { 0.0 };
        let mut chart = ChartBuilder::on(area).margin(16).build_cartesian_3d(
            -self.reach..self.reach,
            floor..scale * (high + 0.05 * span),
            -self.reach..self.reach,
        )?;
        chart.with_projection(|mut projection| {
            projection.yaw = 0.6;
            projection.pitch = 0.45;
            projection.scale = 0.72;
            projection.into_matrix()
        });
        chart
            .configure_axes()
            .x_labels(5)
            .y_labels(5)
            .z_labels(5)
            .tick_size(12)
            .label_style(text(HPos::Left, VPos::Center))
            .bold_grid_style(LINE)
            .light_grid_style(TRANSPARENT)
            .axis_panel_style(TRANSPARENT)
            .x_formatter(&|x| number(*x))
            .y_formatter(&|y| number(*y))
            .z_formatter(&|z| number(-*z))
            .draw()?;
        let at = |i: usize, count: usize| self.reach * (2.0 * i as f64 / (count as f64 - 1.0) - 1.0);
        let index = |place: f64, count: usize| {
            (((place / self.reach + 1.0) / 2.0 * (count as f64 - 1.0)).round() as usize).min(count - 1)
        };
        // The z axis runs towards the viewer, as rows do: it is -y.
        let height = |x: f64, z: f64| scale * self.values[(index(z, rows), index(x, columns))];
        let style = |v: &f64| {
            let RGBColor(r, g, b) = ViridisRGB.get_color(((v / scale - low) / span).clamp(0.0, 1.0));
            RGBColor(r, g, b).filled()
        };
        let xs: Vec<f64> = (0..columns).map(|i| at(i, columns)).collect();
        let zs: Vec<f64> = (0..rows).map(|i| at(i, rows)).collect();
        chart.draw_series(SurfaceSeries::xoz(xs.iter().copied(), zs.iter().copied(), height).style_func(&style))?;
        let r = 1.5 * self.reach;
        let names = [("x, px".to_owned(), (0.0, floor, r)), ("y, px".to_owned(), (r, floor, 0.0))];
        let center = || text(HPos::Center, VPos::Center);
        chart.draw_series(names.map(|(name, place)| Text::new(name, place, center())))?;
        area.draw(&Text::new(in_powers(&self.label, tens), (40, 40), text(HPos::Left, VPos::Center)))
    }
}
