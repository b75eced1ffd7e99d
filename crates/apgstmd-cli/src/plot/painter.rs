//! The raster half of a drawing: anti-aliased, on white.

use plotters_backend::text_anchor::{HPos, VPos};
use plotters_backend::{BackendColor, BackendCoord, BackendTextStyle, FontTransform};
use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, PremultipliedColorU8, Rect, Stroke, Transform,
};

use super::text;

/// plotters' size of letters over CSS's.
pub(super) const EM: f64 = 1.24;

/// A picture under construction.
pub(super) struct Painter {
    pixmap: Pixmap,
}

impl Painter {
    pub fn new((width, height): (u32, u32)) -> Self {
        let mut pixmap = Pixmap::new(width.max(1), height.max(1)).expect("a figure has pixels and fits into memory");
        pixmap.fill(Color::WHITE);
        Self { pixmap }
    }

    /// As a PNG file.
    pub fn png(&self) -> Vec<u8> {
        let rgb: Vec<u8> = self.pixmap.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
        encode((self.pixmap.width(), self.pixmap.height()), &rgb)
    }

    pub fn stroke(
        &mut self,
        points: impl IntoIterator<Item = BackendCoord>,
        color: BackendColor,
        width: u32,
        closed: bool,
    ) {
        if let Some(path) = polyline(points, closed) {
            self.outline(&path, color, width);
        }
    }

    pub fn fill(&mut self, points: impl IntoIterator<Item = BackendCoord>, color: BackendColor) {
        if let Some(path) = polyline(points, true) {
            self.area(&path, color, Transform::identity());
        }
    }

    pub fn circle(&mut self, (x, y): BackendCoord, radius: u32, color: BackendColor, width: u32, fill: bool) {
        let Some(path) = PathBuilder::from_circle(x as f32, y as f32, radius.max(1) as f32) else { return };
        if fill { self.area(&path, color, Transform::identity()) } else { self.outline(&path, color, width) }
    }

    pub fn rectangle(&mut self, (left, top): BackendCoord, (right, bottom): BackendCoord, color: BackendColor) {
        if let Some(rect) = Rect::from_ltrb(left as f32, top as f32, right as f32, bottom as f32) {
            self.area(&PathBuilder::from_rect(rect), color, Transform::identity());
        }
    }

    /// Set as a browser sets it: see plotters' SVG for the shifts.
    pub fn text<S: BackendTextStyle>(&mut self, letters: &str, style: &S, (x, y): BackendCoord) {
        let em = (style.size() / EM) as f32;
        let (Some(path), width) = text::outline(letters, em) else { return };
        let anchor = style.anchor();
        let dx = match anchor.h_pos {
            HPos::Left => 0.0,
            HPos::Center => -width / 2.0,
            HPos::Right => -width,
        };
        // 0.52 em is the height of a small x in this font.
        let dy = em
            * match anchor.v_pos {
                VPos::Top => 0.76,
                VPos::Center => 0.26,
                VPos::Bottom => -0.26,
            };
        let degrees = match style.transform() {
            FontTransform::None => 0.0,
            FontTransform::Rotate90 => 90.0,
            FontTransform::Rotate180 => 180.0,
            FontTransform::Rotate270 => 270.0,
        };
        let place = Transform::from_translate(dx, dy).post_rotate(degrees).post_translate(x as f32, y as f32);
        self.area(&path, style.color(), place);
    }

    /// Copies rows of RGB bytes; what lies outside is left away.
    pub fn picture(&mut self, (left, top): BackendCoord, (width, height): (u32, u32), rgb: &[u8]) {
        let (across, down) = (self.pixmap.width() as i32, self.pixmap.height() as i32);
        let pixels = self.pixmap.pixels_mut();
        for (row, line) in rgb.chunks_exact(3 * width as usize).take(height as usize).enumerate() {
            for (column, rgb) in line.chunks_exact(3).enumerate() {
                let (x, y) = (left + column as i32, top + row as i32);
                if (0..across).contains(&x) && (0..down).contains(&y) {
                    let opaque = PremultipliedColorU8::from_rgba(rgb[0], rgb[1], rgb[2], 255);
                    pixels[(y * across + x) as usize] = opaque.expect("an opaque colour is its own premultiplied form");
                }
            }
        }
    }

    fn outline(&mut self, path: &Path, color: BackendColor, width: u32) {
        let stroke = Stroke {
            width: width.max(1) as f32,
            line_cap: LineCap::Butt,
            line_join: LineJoin::Round,
            ..Stroke::default()
        };
        self.pixmap.stroke_path(path, &paint(color), &stroke, Transform::identity(), None);
    }

    fn area(&mut self, path: &Path, color: BackendColor, place: Transform) {
        self.pixmap.fill_path(path, &paint(color), FillRule::Winding, place, None);
    }
}

/// RGB bytes as a PNG file.
pub(super) fn encode((width, height): (u32, u32), rgb: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(rgb))
        .expect("as many bytes as its size needs, into memory");
    bytes
}

fn polyline(points: impl IntoIterator<Item = BackendCoord>, closed: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    for (i, (x, y)) in points.into_iter().enumerate() {
        match i {
            0 => builder.move_to(x as f32, y as f32),
            _ => builder.line_to(x as f32, y as f32),
        }
    }
    if closed {
        builder.close();
    }
    builder.finish()
}

fn paint(color: BackendColor) -> Paint<'static> {
    let (r, g, b) = color.rgb;
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color(Color::from_rgba8(r, g, b, (255.0 * color.alpha.clamp(0.0, 1.0)).round() as u8));
    paint
}
