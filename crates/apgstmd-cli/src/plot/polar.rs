//! A value for each of the eight directions, counter-clockwise from the right, as on the screen.

use std::f64::consts::{FRAC_PI_4, FRAC_PI_8, TAU};

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::legend::{self, Sample};
use super::style::{INK, LINE, color, text, value};
use super::{Area, Drawn, Look, Polar};

const BODY: u32 = 720;
/// Of the outer ring.
const RADIUS: f64 = 280.0;

impl Polar {
    pub(super) fn height(&self, width: u32) -> u32 {
        BODY + legend::height(&self.entries(), width)
    }

    fn entries(&self) -> Vec<(&str, Sample)> {
        let named = self.series.iter().enumerate().filter(|(_, (name, _))| !name.is_empty());
        named.map(|(i, (name, _))| (name.as_str(), Sample::Stroke(Look::Dots, color(i)))).collect()
    }

    pub(super) fn draw(&self, area: &Area<'_>) -> Drawn {
        let entries = self.entries();
        let width = area.dim_in_pixel().0;
        let (top, body) = area.split_vertically(legend::height(&entries, width));
        legend::draw(&top, &entries)?;
        let center = (f64::from(width) / 2.0, f64::from(BODY) / 2.0);
        let at = |radius: f64, angle: f64| {
            ((center.0 + radius * angle.cos()).round() as i32, (center.1 - radius * angle.sin()).round() as i32)
        };
        for ring in [0.25, 0.5, 0.75, 1.0] {
            let turn = (0..=90).map(|i| at(ring * RADIUS, TAU * f64::from(i) / 90.0));
            body.draw(&PathElement::new(turn.collect::<Vec<_>>(), LINE.stroke_width(2)))?;
        }
        for k in 0..8 {
            let angle = f64::from(k) * FRAC_PI_4;
            body.draw(&PathElement::new([at(0.0, 0.0), at(RADIUS, angle)], LINE.stroke_width(2)))?;
            let h = match angle.cos() {
                c if c > 0.1 => HPos::Left,
                c if c < -0.1 => HPos::Right,
                _ => HPos::Center,
            };
            body.draw(&Text::new(format!("{}°", 45 * k), at(RADIUS + 20.0, angle), text(h, VPos::Center)))?;
        }
        let most = self.series.iter().flat_map(|(_, values)| values).copied().fold(0.0, f64::max);
        let full = self.full.unwrap_or(most);
        let share = |v: f64| if full > 0.0 { (v / full).clamp(0.0, 1.0) } else { 0.0 };
        for (i, (_, values)) in self.series.iter().enumerate() {
            let corner = |k: usize| at(RADIUS * share(values[k % 8]), (k % 8) as f64 * FRAC_PI_4);
            let color = color(i);
            let corners: Vec<(i32, i32)> = (0..8).map(corner).collect();
            if self.series.len() <= 2 {
                body.draw(&Polygon::new(corners.clone(), color.mix(0.08).filled()))?;
            }
            body.draw(&PathElement::new((0..=8).map(corner).collect::<Vec<_>>(), color.stroke_width(4)))?;
            for corner in corners {
                body.draw(&Circle::new(corner, 7, color.filled()))?;
            }
        }
        if let Some(angle) = self.arrow {
            let (tip, tail) = (at(RADIUS - 6.0, angle), at(RADIUS - 90.0, angle));
            body.draw(&PathElement::new([tail, tip], INK.stroke_width(5)))?;
            let wings = [at(RADIUS - 34.0, angle + 0.06), tip, at(RADIUS - 34.0, angle - 0.06)];
            body.draw(&Polygon::new(wings, INK.filled()))?;
        }
        // Between two spokes, where no curve has a corner.
        let place = at(RADIUS + 8.0, FRAC_PI_8);
        body.draw(&Text::new(value(full), place, text(HPos::Left, VPos::Center)))
    }
}
