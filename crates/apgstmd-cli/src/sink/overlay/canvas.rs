//! What the annotations are drawn with: anti-aliased lines with a dark halo, text, pictures. Positions are in canvas
//! pixels, (0, 0) the corner of the first one.

use ab_glyph::{Font, FontRef, Glyph, PxScale, ScaleFont, point};
use image::RgbImage;
use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, PremultipliedColorU8, Rect, Stroke, Transform,
};

/// Red, green, blue, 0 to 255.
pub(in crate::sink) type Rgb = [u8; 3];

/// Opaque picture under construction.
#[derive(Clone)]
pub(in crate::sink) struct Canvas {
    pixmap: Pixmap,
}

/// Text that is drawn on a dark ground.
pub(in crate::sink) const INK: Rgb = [236, 239, 244];
/// Less important text.
pub(in crate::sink) const FAINT: Rgb = [150, 158, 172];
/// The ground of captions and the strip.
pub(in crate::sink) const GROUND: Rgb = [20, 23, 28];

impl Canvas {
    pub fn new(width: u32, height: u32) -> Self {
        let mut pixmap = Pixmap::new(width.max(1), height.max(1)).expect("a canvas has pixels and fits into memory");
        pixmap.fill(color(GROUND, 1.0));
        Self { pixmap }
    }

    pub fn width(&self) -> u32 {
        self.pixmap.width()
    }

    pub fn height(&self) -> u32 {
        self.pixmap.height()
    }

    pub fn rgb(&self) -> Vec<u8> {
        let pixels = self.pixmap.data().chunks_exact(4);
        let mut samples = Vec::with_capacity(3 * pixels.len());
        // Opaque: premultiplied is plain.
        pixels.for_each(|pixel| samples.extend_from_slice(&pixel[..3]));
        samples
    }

    /// Copies a picture; what lies outside is left away.
    pub fn paste(&mut self, picture: &RgbImage, left: u32, top: u32) {
        let width = self.width();
        let columns = picture.width().min(width.saturating_sub(left)) as usize;
        let rows = picture.height().min(self.height().saturating_sub(top));
        let pixels = self.pixmap.pixels_mut();
        for y in 0..rows {
            let start = ((top + y) * width + left) as usize;
            let row = picture.as_raw()[(3 * y * picture.width()) as usize..].chunks_exact(3);
            for (pixel, sample) in pixels[start..start + columns].iter_mut().zip(row) {
                *pixel = opaque(sample[0], sample[1], sample[2]);
            }
        }
    }

    /// Copies a disc of a picture of the size of the canvas, or of its upper part.
    pub fn paste_disc(&mut self, picture: &RgbImage, x: f32, y: f32, radius: f32) {
        let width = self.width();
        let range = |centre: f32, length: u32| {
            let end = (centre + radius).ceil().max(0.0) as u32;
            (centre - radius).floor().max(0.0) as u32..end.min(length)
        };
        for v in range(y, picture.height().min(self.height())) {
            for u in range(x, picture.width().min(width)) {
                if (u as f32 + 0.5 - x).hypot(v as f32 + 0.5 - y) < radius {
                    let [r, g, b] = picture.get_pixel(u, v).0;
                    self.pixmap.pixels_mut()[(v * width + u) as usize] = opaque(r, g, b);
                }
            }
        }
    }

    /// Copies another canvas.
    pub fn paste_canvas(&mut self, other: &Self, left: u32, top: u32) {
        let paint = tiny_skia::PixmapPaint::default();
        self.pixmap.draw_pixmap(left as i32, top as i32, other.pixmap.as_ref(), &paint, Transform::identity(), None);
    }

    pub fn rectangle(&mut self, left: f32, top: f32, width: f32, height: f32, rgb: Rgb, alpha: f32) {
        if let Some(rect) = Rect::from_xywh(left, top, width, height) {
            self.pixmap.fill_rect(rect, &paint(rgb, alpha), Transform::identity(), None);
        }
    }

    pub fn frame(&mut self, left: f32, top: f32, width: f32, height: f32, line: f32, rgb: Rgb) {
        if let Some(rect) = Rect::from_xywh(left, top, width, height) {
            self.outline(&PathBuilder::from_rect(rect), line, rgb, 1.0);
        }
    }

    pub fn ring(&mut self, x: f32, y: f32, radius: f32, line: f32, rgb: Rgb, alpha: f32) {
        if let Some(path) = PathBuilder::from_circle(x, y, radius) {
            self.outline(&path, line, rgb, alpha);
        }
    }

    pub fn segment(&mut self, from: (f32, f32), to: (f32, f32), line: f32, rgb: Rgb, alpha: f32) {
        let mut builder = PathBuilder::new();
        builder.move_to(from.0, from.1);
        builder.line_to(to.0, to.1);
        if let Some(path) = builder.finish() {
            self.outline(&path, line, rgb, alpha);
        }
    }

    /// A filled triangle with its point at `tip`, looking along (dx, dy).
    pub fn arrow_head(&mut self, tip: (f32, f32), (dx, dy): (f32, f32), length: f32, rgb: Rgb) {
        let base = (tip.0 - length * dx, tip.1 - length * dy);
        let half = 0.55 * length;
        let mut builder = PathBuilder::new();
        builder.move_to(tip.0, tip.1);
        builder.line_to(base.0 - half * dy, base.1 + half * dx);
        builder.line_to(base.0 + half * dy, base.1 - half * dx);
        builder.close();
        if let Some(path) = builder.finish() {
            self.outline(&path, 0.5, rgb, 1.0);
            self.pixmap.fill_path(&path, &paint(rgb, 1.0), FillRule::Winding, Transform::identity(), None);
        }
    }

    /// Bright on dark on anything: a dark halo below the line.
    fn outline(&mut self, path: &Path, line: f32, rgb: Rgb, alpha: f32) {
        for (width, rgb, alpha) in [(line + 1.8, [0, 0, 0], 0.45 * alpha), (line, rgb, alpha)] {
            let stroke = Stroke { width, line_cap: LineCap::Round, line_join: LineJoin::Round, ..Stroke::default() };
            self.pixmap.stroke_path(path, &paint(rgb, alpha), &stroke, Transform::identity(), None);
        }
    }

    /// Text with its left edge at `x` and its middle line at `y`. Returns its width.
    pub fn text(&mut self, text: &str, x: f32, y: f32, height: f32, rgb: Rgb) -> f32 {
        let font = font();
        let (glyphs, width) = layout(&font, text, height);
        let scaled = font.as_scaled(PxScale::from(height));
        let baseline = y + 0.5 * (scaled.ascent() + scaled.descent());
        for mut glyph in glyphs {
            glyph.position = point(x + glyph.position.x, baseline);
            let Some(outline) = font.outline_glyph(glyph) else { continue };
            let bounds = outline.px_bounds();
            outline.draw(|dx, dy, coverage| {
                self.blend(bounds.min.x as i64 + i64::from(dx), bounds.min.y as i64 + i64::from(dy), rgb, coverage);
            });
        }
        width
    }

    /// Text with a soft dark ground, for use upon pictures.
    pub fn label(&mut self, text: &str, x: f32, y: f32, height: f32, rgb: Rgb) {
        let pad = 0.22 * height;
        let width = text_width(text, height);
        self.rectangle(x - pad, y - 0.6 * height, width + 2.0 * pad, 1.2 * height, [0, 0, 0], 0.55);
        self.text(text, x, y, height, rgb);
    }

    fn blend(&mut self, x: i64, y: i64, rgb: Rgb, coverage: f32) {
        let (width, height) = (i64::from(self.width()), i64::from(self.height()));
        if !(0..width).contains(&x) || !(0..height).contains(&y) {
            return;
        }
        let pixel = &mut self.pixmap.pixels_mut()[(y * width + x) as usize];
        let coverage = coverage.clamp(0.0, 1.0);
        let mix =
            |under: u8, over: u8| (f32::from(under) * (1.0 - coverage) + f32::from(over) * coverage).round() as u8;
        *pixel = opaque(mix(pixel.red(), rgb[0]), mix(pixel.green(), rgb[1]), mix(pixel.blue(), rgb[2]));
    }
}

/// Width of a text, px.
pub(in crate::sink) fn text_width(text: &str, height: f32) -> f32 {
    layout(&font(), text, height).1
}

fn layout(font: &FontRef<'static>, text: &str, height: f32) -> (Vec<Glyph>, f32) {
    let scale = PxScale::from(height);
    let scaled = font.as_scaled(scale);
    let mut x = 0.0;
    let mut glyphs = Vec::new();
    for letter in text.chars() {
        let id = font.glyph_id(letter);
        glyphs.push(id.with_scale_and_position(scale, point(x, 0.0)));
        x += scaled.h_advance(id);
    }
    (glyphs, x)
}

fn font() -> FontRef<'static> {
    FontRef::try_from_slice(epaint_default_fonts::HACK_REGULAR).expect("the font is part of the program")
}

fn color([r, g, b]: Rgb, alpha: f32) -> Color {
    Color::from_rgba8(r, g, b, (255.0 * alpha.clamp(0.0, 1.0)).round() as u8)
}

fn paint(rgb: Rgb, alpha: f32) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color(color(rgb, alpha));
    paint
}

fn opaque(r: u8, g: u8, b: u8) -> PremultipliedColorU8 {
    PremultipliedColorU8::from_rgba(r, g, b, 255).expect("an opaque colour is its own premultiplied form")
}
