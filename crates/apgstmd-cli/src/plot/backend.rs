//! What plotters draws on: SVG text and a raster at once, so that both are the same picture.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use plotters::prelude::{DrawingBackend, SVGBackend};
use plotters_backend::{BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingErrorKind};

use super::painter::{EM, Painter, encode};
use super::style::GROUND;
use super::text;

/// Forwards every element to both.
pub(super) struct Twin<'a> {
    svg: SVGBackend<'a>,
    painter: &'a mut Painter,
    /// SVG elements of pictures; plotters' SVG has none.
    images: &'a mut Vec<String>,
}

type Sent = Result<(), DrawingErrorKind<std::io::Error>>;

impl<'a> Twin<'a> {
    pub fn new(svg: &'a mut String, painter: &'a mut Painter, images: &'a mut Vec<String>, size: (u32, u32)) -> Self {
        Self { svg: SVGBackend::with_string(svg, size), painter, images }
    }
}

impl DrawingBackend for Twin<'_> {
    type ErrorType = std::io::Error;

    fn get_size(&self) -> (u32, u32) {
        self.svg.get_size()
    }

    fn ensure_prepared(&mut self) -> Sent {
        self.svg.ensure_prepared()
    }

    fn present(&mut self) -> Sent {
        self.svg.present()
    }

    fn draw_pixel(&mut self, (x, y): BackendCoord, color: BackendColor) -> Sent {
        self.painter.rectangle((x, y), (x + 1, y + 1), color);
        self.svg.draw_pixel((x, y), color)
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Sent {
        self.painter.stroke([from, to], style.color(), style.stroke_width(), false);
        self.svg.draw_line(from, to, style)
    }

    fn draw_rect<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S, fill: bool) -> Sent {
        if fill {
            self.painter.rectangle(from, to, style.color());
        } else {
            let corners = [from, (to.0, from.1), to, (from.0, to.1)];
            self.painter.stroke(corners, style.color(), 1, true);
        }
        self.svg.draw_rect(from, to, style, fill)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, path: I, style: &S) -> Sent {
        let points: Vec<BackendCoord> = path.into_iter().collect();
        self.painter.stroke(points.iter().copied(), style.color(), style.stroke_width(), false);
        self.svg.draw_path(points, style)
    }

    fn draw_circle<S: BackendStyle>(&mut self, center: BackendCoord, radius: u32, style: &S, fill: bool) -> Sent {
        self.painter.circle(center, radius, style.color(), style.stroke_width(), fill);
        self.svg.draw_circle(center, radius, style, fill)
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(&mut self, corners: I, style: &S) -> Sent {
        let corners: Vec<BackendCoord> = corners.into_iter().collect();
        self.painter.fill(corners.iter().copied(), style.color());
        self.svg.fill_polygon(corners, style)
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, place: BackendCoord) -> Sent {
        self.painter.text(text, style, place);
        self.svg.draw_text(text, style, place)
    }

    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        letters: &str,
        style: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Self::ErrorType>> {
        let em = (style.size() / EM) as f32;
        Ok((text::width(letters, em).ceil() as u32, em.ceil() as u32))
    }

    fn blit_bitmap(&mut self, place: BackendCoord, size: (u32, u32), rgb: &[u8]) -> Sent {
        self.painter.picture(place, size, rgb);
        let (width, height) = size;
        self.images.push(format!(
            "<image x=\"{}\" y=\"{}\" width=\"{width}\" height=\"{height}\" href=\"data:image/png;base64,{}\"/>\n",
            place.0,
            place.1,
            STANDARD.encode(encode(size, rgb))
        ));
        Ok(())
    }
}

/// The SVG with its ground and its pictures, which lie below everything else.
pub(super) fn finish(svg: &str, images: &[String], (width, height): (u32, u32)) -> String {
    let (head, rest) = svg.split_once('\n').unwrap_or((svg, ""));
    let color = format!("#{:02X}{:02X}{:02X}", GROUND.0, GROUND.1, GROUND.2);
    let ground = format!("<rect width=\"{width}\" height=\"{height}\" fill=\"{color}\"/>\n");
    format!("{head}\n{ground}{}{rest}", images.concat())
}
