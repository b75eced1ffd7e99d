//! One annotated frame: the picture, trails, rings around targets that leave them free, direction ticks, a magnified
//! inset, and below it a line of text so that none of the picture is hidden by words.

use std::f32::consts::{FRAC_PI_2, PI};

use apgstmd_core::Detection;
use image::RgbImage;
use image::imageops::{FilterType, resize};

use super::canvas::{Canvas, FAINT, INK, Rgb, text_width};
use super::inset;
use super::trails::{Place, Trails};

/// What stands below the picture.
pub(super) struct Caption<'a> {
    pub frame: usize,
    pub name: &'a str,
}

/// Radius of a ring: pixels of the picture, and at least this many of the canvas.
const RING: f32 = 8.0;
const LEAST_RING: f32 = 9.0;
/// Detections with a number beside their ring.
const LABELLED: usize = 12;
/// Colours of traces, told apart by colour-blind eyes as well (after Okabe and Ito, brightened).
const COLOURS: [Rgb; 6] =
    [[255, 176, 32], [86, 196, 255], [255, 240, 80], [255, 120, 190], [70, 225, 160], [255, 128, 64]];

/// Colour of a trace.
pub(super) fn colour(trace: u64) -> Rgb {
    COLOURS[(trace % COLOURS.len() as u64) as usize]
}

/// Draws a frame at `scale` canvas pixels a picture pixel.
pub(super) fn annotate(
    picture: &RgbImage,
    scale: f32,
    detections: &[Detection],
    trails: &Trails,
    caption: &Caption<'_>,
) -> Canvas {
    let enlarged = enlarge(picture, scale);
    let (width, height) = enlarged.dimensions();
    let letters = letter_height(width);
    let mut canvas = Canvas::new(width, height + caption_height(width));
    canvas.paste(&enlarged, 0, 0);
    let at = |x: f32, y: f32| ((x + 0.5) * scale, (y + 0.5) * scale);
    let radius = (RING * scale).max(LEAST_RING);
    let line = (0.002 * width as f32).clamp(1.2, 2.2);

    for (trace, places) in trails.all() {
        trail(&mut canvas, trails, trace, places, detections, scale, radius, line);
    }
    for (rank, detection) in detections.iter().enumerate().rev() {
        let (x, y) = at(detection.x, detection.y);
        let strength = if rank < LABELLED { 1.0 } else { 0.55 };
        let rgb = colour(detection.trace);
        canvas.ring(x, y, radius, line, rgb, strength);
        if detection.direction.is_finite() {
            tick(&mut canvas, (x, y), detection.direction, radius, line, rgb);
        }
        if rank < LABELLED {
            number(&mut canvas, (x, y), detection, radius, letters, height);
        }
    }
    if let Some(strongest) = detections.first() {
        let others: Vec<(f32, f32)> = detections.iter().map(|d| at(d.x, d.y)).collect();
        inset::draw(&mut canvas, picture, scale, strongest, &others, (width, height));
    }
    write_caption(&mut canvas, caption, detections, height, letters);
    canvas
}

fn enlarge(picture: &RgbImage, scale: f32) -> RgbImage {
    let side = |pixels: u32| ((pixels as f32 * scale).round() as u32).max(1);
    let (width, height) = (side(picture.width()), side(picture.height()));
    let filter = match scale {
        1.0 => return picture.clone(),
        whole if whole.fract() == 0.0 => FilterType::Nearest,
        smaller if smaller < 1.0 => FilterType::Triangle,
        _ => FilterType::CatmullRom,
    };
    resize(picture, width, height, filter)
}

fn letter_height(width: u32) -> f32 {
    (0.024 * width as f32).clamp(11.0, 18.0)
}

fn caption_height(width: u32) -> u32 {
    (1.7 * letter_height(width)) as u32
}

#[allow(clippy::too_many_arguments)]
fn trail(
    canvas: &mut Canvas,
    trails: &Trails,
    trace: u64,
    places: &[Place],
    detections: &[Detection],
    scale: f32,
    radius: f32,
    line: f32,
) {
    let at = |place: &Place| ((place.x + 0.5) * scale, (place.y + 0.5) * scale);
    // Nothing is drawn inside any ring: that is where targets are.
    let free = |(x, y): (f32, f32)| {
        detections.iter().all(|d| {
            let (dx, dy) = (x - (d.x + 0.5) * scale, y - (d.y + 0.5) * scale);
            dx.hypot(dy) > radius + line
        })
    };
    for pair in places.windows(2) {
        let (from, to) = (at(&pair[0]), at(&pair[1]));
        let middle = (0.5 * (from.0 + to.0), 0.5 * (from.1 + to.1));
        if free(from) && free(to) && free(middle) {
            canvas.segment(from, to, 0.9 * line, colour(trace), 0.3 + 0.6 * trails.freshness(&pair[1]));
        }
    }
}

fn tick(canvas: &mut Canvas, (x, y): (f32, f32), direction: f32, radius: f32, line: f32, rgb: Rgb) {
    let (dx, dy) = (direction.cos(), -direction.sin());
    let along = |distance: f32| (x + distance * dx, y + distance * dy);
    let head = (0.45 * radius).clamp(5.0, 12.0);
    canvas.segment(along(radius), along(1.55 * radius), line, rgb, 1.0);
    canvas.arrow_head(along(1.55 * radius + head), (dx, dy), head, rgb);
}

/// Beside the ring, off the way of the trail and the tick, inside the picture.
fn number(canvas: &mut Canvas, (x, y): (f32, f32), detection: &Detection, radius: f32, letters: f32, height: u32) {
    let text = detection.trace.to_string();
    let size = 0.85 * letters;
    let width = text_width(&text, size);
    let direction = if detection.direction.is_finite() { detection.direction } else { 0.0 };
    let places = [FRAC_PI_2, -FRAC_PI_2, 0.25 * PI, -0.25 * PI, 0.75 * PI, -0.75 * PI].map(|turn| {
        let (dx, dy) = ((direction + turn).cos(), -(direction + turn).sin());
        let reach = radius + 0.8 * size + 0.5 * width * dx.abs();
        (x + reach * dx - 0.5 * width, y + reach * dy)
    });
    let fits = |(left, middle): &&(f32, f32)| {
        *left > 0.3 * size
            && left + width + 0.3 * size < canvas.width() as f32
            && middle - 0.6 * size > 0.0
            && middle + 0.6 * size < height as f32
    };
    let (left, middle) = places.iter().find(fits).copied().unwrap_or(places[0]);
    canvas.label(&text, left, middle, size, colour(detection.trace));
}

fn write_caption(canvas: &mut Canvas, caption: &Caption<'_>, detections: &[Detection], top: u32, letters: f32) {
    let width = canvas.width() as f32;
    let middle = top as f32 + 0.5 * (canvas.height() - top) as f32;
    let margin = 0.6 * letters;
    let number = format!("{}", caption.frame);
    let right = match detections.first() {
        None => "no target".to_owned(),
        Some(first) => format!(
            "{} target{}, strongest {:.1e}",
            detections.len(),
            if detections.len() == 1 { "" } else { "s" },
            first.score
        ),
    };
    let used = canvas.text(&number, margin, middle, letters, INK);
    let right_width = text_width(&right, letters);
    let right_left = width - margin - right_width;
    let left_end = margin + used + letters;
    if right_left > left_end {
        canvas.text(&right, right_left, middle, letters, FAINT);
    }
    let space = right_left - letters - left_end;
    if text_width(caption.name, letters) < space {
        canvas.text(caption.name, left_end, middle, letters, FAINT);
    }
}
