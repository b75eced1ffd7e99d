//! Text as outlines, in the font that is part of the program.

use ab_glyph::{Font, FontRef, GlyphId, OutlineCurve};
use tiny_skia::{Path, PathBuilder};

/// The font of figures, and one that has what it lacks.
fn fonts() -> [FontRef<'static>; 2] {
    [epaint_default_fonts::UBUNTU_LIGHT, epaint_default_fonts::HACK_REGULAR]
        .map(|bytes| FontRef::try_from_slice(bytes).expect("the fonts are part of the program"))
}

/// The glyph of a letter, and the font that has it.
fn glyph<'a>(fonts: &'a [FontRef<'static>; 2], letter: char) -> (&'a FontRef<'static>, GlyphId) {
    let id = fonts[0].glyph_id(letter);
    if id.0 == 0 { (&fonts[1], fonts[1].glyph_id(letter)) } else { (&fonts[0], id) }
}

fn scale(font: &FontRef<'_>, em: f32) -> f32 {
    em / font.units_per_em().unwrap_or(1000.0)
}

/// A line of text and its width, `em` high, its base line beginning at (0, 0). No path where there is nothing to see.
pub(super) fn outline(text: &str, em: f32) -> (Option<Path>, f32) {
    let fonts = fonts();
    let mut builder = PathBuilder::new();
    let mut pen = 0.0;
    for letter in text.chars() {
        let (font, id) = glyph(&fonts, letter);
        let scale = scale(font, em);
        if let Some(glyph) = font.outline(id) {
            let at = |p: ab_glyph::Point| (pen + scale * p.x, -scale * p.y);
            let mut last = None;
            for curve in &glyph.curves {
                let (from, to) = match curve {
                    OutlineCurve::Line(a, b) | OutlineCurve::Quad(a, _, b) | OutlineCurve::Cubic(a, _, _, b) => {
                        (*a, *b)
                    }
                };
                if last != Some(from) {
                    let (x, y) = at(from);
                    builder.move_to(x, y);
                }
                let (x, y) = at(to);
                match curve {
                    OutlineCurve::Line(..) => builder.line_to(x, y),
                    OutlineCurve::Quad(_, c, _) => builder.quad_to(at(*c).0, at(*c).1, x, y),
                    OutlineCurve::Cubic(_, c, d, _) => builder.cubic_to(at(*c).0, at(*c).1, at(*d).0, at(*d).1, x, y),
                }
                last = Some(to);
            }
        }
        pen += scale * font.h_advance_unscaled(id);
    }
    (builder.finish(), pen)
}

/// Width of a line of text.
pub(super) fn width(text: &str, em: f32) -> f32 {
    let fonts = fonts();
    let advances =
        text.chars().map(|letter| glyph(&fonts, letter)).map(|(f, id)| scale(f, em) * f.h_advance_unscaled(id));
    advances.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fonts_have_every_letter_that_figures_use() {
        for letter in "aZ09θφςπ°·×²³¹⁰⁴⁵⁶⁷⁸⁹⁻−√≤≥Δ∑–,.()/".chars() {
            assert_ne!(glyph(&fonts(), letter).1.0, 0, "{letter}");
        }
    }

    #[test]
    fn outlines_are_as_wide_as_their_text() {
        let (path, advance) = outline("mmmm", 20.0);
        let bounds = path.unwrap().bounds();
        assert!((advance - width("mmmm", 20.0)).abs() < 1e-3);
        assert!(bounds.width() < advance && bounds.width() > 0.8 * advance && bounds.top() < -8.0, "{bounds:?}");
        assert!(outline(" ", 20.0).0.is_none());
    }
}
