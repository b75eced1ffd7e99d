//! One style for all figures. Colours are those that the pages' style sheets know and change in the dark.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Width of a panel.
pub(super) const PANEL: u32 = 1040;
/// Height of a panel's title.
pub(super) const HEAD: u32 = 64;

pub(super) const INK: RGBColor = RGBColor(0x24, 0x29, 0x2f);
pub(super) const LINE: RGBColor = RGBColor(0xd0, 0xd7, 0xde);
pub(super) const GROUND: RGBColor = RGBColor(0xff, 0xff, 0xff);

/// Told apart also by most of those who see fewer colours, and on light and dark ground.
pub(super) const PALETTE: [RGBColor; 8] = [
    RGBColor(0x09, 0x69, 0xda),
    RGBColor(0xbc, 0x4c, 0x00),
    RGBColor(0x1a, 0x7f, 0x37),
    RGBColor(0x82, 0x50, 0xdf),
    RGBColor(0xcf, 0x22, 0x2e),
    RGBColor(0x0e, 0x7c, 0x86),
    RGBColor(0x8a, 0x63, 0x00),
    RGBColor(0x6e, 0x77, 0x81),
];

pub(super) fn color(number: usize) -> RGBColor {
    PALETTE[number % PALETTE.len()]
}

/// Size of letters, as plotters counts it.
pub(super) const LETTERS: f64 = 31.0;
/// Of titles.
const TITLE: f64 = 35.0;

fn letters(size: f64) -> FontDesc<'static> {
    FontDesc::new(FontFamily::SansSerif, size, FontStyle::Normal)
}

pub(super) fn text(h: HPos, v: VPos) -> TextStyle<'static> {
    TextStyle::from(letters(LETTERS)).color(&INK).pos(Pos::new(h, v))
}

pub(super) fn title() -> TextStyle<'static> {
    TextStyle::from(letters(TITLE)).color(&INK).pos(Pos::new(HPos::Center, VPos::Center))
}

/// A power of ten that the values of an axis are counted in, where plain numbers would be hard to read.
pub(super) fn power(largest: f64) -> i32 {
    if largest > 0.0 && !(0.05..1e4).contains(&largest) { largest.log10().floor() as i32 } else { 0 }
}

/// The axis label, with the unit that [`power`] makes.
pub(super) fn in_powers(label: &str, power: i32) -> String {
    match power {
        0 => label.to_owned(),
        _ => format!("{label}, 10{}", superscript(power)),
    }
}

pub(super) fn superscript(power: i32) -> String {
    let digit = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        c => char::from_u32(0x2070 + c.to_digit(10).unwrap_or(0)).unwrap_or(c),
    };
    power.to_string().chars().map(digit).collect()
}

/// A number of a scale: no more digits than it needs.
pub(super) fn number(value: f64) -> String {
    let text = if value.abs() >= 100.0 { format!("{value:.0}") } else { format!("{value:.3}") };
    let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if short == "-0" { "0".to_owned() } else { short.to_owned() }
}

/// Round numbers from `low` to `high`, about as many as asked for.
pub(super) fn ticks(low: f64, high: f64, count: usize) -> Vec<f64> {
    let rough = (high - low) / count.max(1) as f64;
    if rough.is_nan() || rough <= 0.0 {
        return Vec::new();
    }
    let ten = 10f64.powf(rough.log10().floor());
    let step = ten * [1.0, 2.0, 5.0, 10.0].into_iter().find(|m| m * ten >= 0.8 * rough).unwrap_or(10.0);
    let (first, last) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
    (first..=last).map(|i| i as f64 * step).collect()
}

/// A measured value in few digits.
pub(super) fn value(value: f64) -> String {
    match power(value.abs()) {
        0 => number(value),
        power => format!("{:.1}·10{}", value * 10f64.powi(-power), superscript(power)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_a_scale() {
        for (value, expected) in [(0.0, "0"), (0.25, "0.25"), (-0.00001, "0"), (250.0, "250"), (1.0 / 3.0, "0.333")] {
            assert_eq!(number(value), expected);
        }
        assert_eq!((power(8.65e-4), power(0.9), power(250.0), power(0.0)), (-4, 0, 0, 0));
        assert_eq!(in_powers("E", -14), "E, 10⁻¹⁴");
        assert_eq!(value(8.65e-4), "8.7·10⁻⁴");
        assert_eq!(ticks(-0.3, 0.7, 5), [-0.2, 0.0, 0.2, 0.4, 0.6000000000000001]);
        assert_eq!(ticks(0.0, 1.87, 5), [0.0, 0.5, 1.0, 1.5]);
        assert!(ticks(1.0, 1.0, 5).is_empty());
    }
}
