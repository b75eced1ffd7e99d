//! Names of curves, in lines above a plot, where they cover no data.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::painter::EM;
use super::style::{INK, LETTERS, text};
use super::{Area, Drawn, Look, text as letters};

/// Height of a line.
const LINE: u32 = 46;
/// The sample before a name, and the room around both.
const SAMPLE: i32 = 52;
const GAP: i32 = 14;
const BETWEEN: i32 = 40;

/// How an entry is shown.
#[derive(Clone, Copy)]
pub(super) enum Sample {
    Stroke(Look, RGBColor),
    Shade,
}

type Entry<'a> = (&'a str, Sample);

fn width(name: &str) -> i32 {
    SAMPLE + GAP + letters::width(name, (LETTERS / EM) as f32).ceil() as i32
}

/// Entries in lines no longer than `room`.
fn lines<'a, 'b>(entries: &'b [Entry<'a>], room: u32) -> Vec<Vec<&'b Entry<'a>>> {
    let mut lines: Vec<Vec<&Entry>> = Vec::new();
    let mut left = 0;
    for entry in entries {
        let needed = width(entry.0) + BETWEEN;
        if lines.is_empty() || needed > left {
            lines.push(Vec::new());
            left = room as i32 - BETWEEN;
        }
        left -= needed;
        lines.last_mut().expect("one was pushed").push(entry);
    }
    lines
}

/// Height of a legend in a panel of this width.
pub(super) fn height(entries: &[Entry<'_>], room: u32) -> u32 {
    LINE * lines(entries, room).len() as u32
}

/// Draws it at the top of `area`.
pub(super) fn draw(area: &Area<'_>, entries: &[Entry<'_>]) -> Drawn {
    let room = area.dim_in_pixel().0;
    for (row, line) in lines(entries, room).into_iter().enumerate() {
        let whole: i32 = line.iter().map(|entry| width(entry.0) + BETWEEN).sum::<i32>() - BETWEEN;
        let mut x = (room as i32 - whole) / 2;
        let y = (LINE * row as u32 + LINE / 2) as i32;
        for (name, sample) in line {
            match *sample {
                Sample::Shade => {
                    area.draw(&Rectangle::new([(x, y - 12), (x + SAMPLE, y + 12)], INK.mix(0.1).filled()))?
                }
                Sample::Stroke(look, color) => {
                    let pieces: &[(i32, i32)] =
                        if look == Look::Dashed { &[(0, 14), (19, 33), (38, 52)] } else { &[(0, SAMPLE)] };
                    for (from, to) in pieces {
                        area.draw(&PathElement::new([(x + from, y), (x + to, y)], color.stroke_width(4)))?;
                    }
                    if look == Look::Dots {
                        area.draw(&Circle::new((x + SAMPLE / 2, y), 7, color.filled()))?;
                    }
                }
            }
            area.draw(&Text::new(*name, (x + SAMPLE + GAP, y), text(HPos::Left, VPos::Center)))?;
            x += width(name) + BETWEEN;
        }
    }
    Ok(())
}
