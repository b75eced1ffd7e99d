//! One annotated frame: the picture, trails, rings around targets that leave them free, direction ticks, a magnified
//! inset, and below it a line of text so that none of the picture is hidden by words.

use std::f32::consts::{FRAC_PI_2, PI};

use apgstmd_core::Detection;
use image::RgbImage;
use image::imageops::{FilterType, resize};

use super::canvas::{Canvas, FAINT, GROUND, INK, Rgb, text_width};
use super::inset;
use super::trails::{Place, Trails};
use crate::sink::outline::Outline;

/// What is to be drawn of a frame.
pub(in crate::sink) struct Scene<'a> {
    pub picture: &'a RgbImage,
    /// Targets, strongest first.
    pub clear: &'a [Detection],
    /// Detections much weaker than the strongest.
    pub faint: &'a [Detection],
    /// The border of the region.
    pub outline: Option<&'a Outline>,
    pub trails: &'a Trails,
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
pub(in crate::sink) fn colour(trace: u64) -> Rgb {
    COLOURS[(trace % COLOURS.len() as u64) as usize]
}

/// How things are drawn upon a canvas.
struct Pen<'a> {
    scene: &'a Scene<'a>,
    scale: f32,
    radius: f32,
    line: f32,
    letters: f32,
    /// Rows of the canvas that show the picture.
    height: u32,
}

/// Draws a frame at `scale` canvas pixels a picture pixel.
pub(in crate::sink) fn annotate(scene: &Scene<'_>, scale: f32) -> Canvas {
    let enlarged = enlarge(scene.picture, scale);
    let (width, height) = enlarged.dimensions();
    let letters = (0.024 * width as f32).clamp(11.0, 18.0);
    let mut canvas = Canvas::new(width, height + (1.7 * letters) as u32);
    canvas.paste(&enlarged, 0, 0);
    let radius = (RING * scale).max(LEAST_RING);
    let line = (0.002 * width as f32).clamp(1.2, 2.2);
    let pen = Pen { scene, scale, radius, line, letters, height };

    if let Some(outline) = scene.outline {
        pen.outline(&mut canvas, &enlarged, outline);
    }
    for detection in scene.faint {
        let (x, y) = pen.at(detection.x, detection.y);
        canvas.ring(x, y, radius, 1.0, INK, 0.28);
    }
    for (trace, places) in scene.trails.all() {
        pen.trail(&mut canvas, trace, places);
    }
    for (rank, detection) in scene.clear.iter().enumerate().rev() {
        let (x, y) = pen.at(detection.x, detection.y);
        canvas.ring(x, y, radius, line, colour(detection.trace), 1.0);
        if detection.direction.is_finite() {
            pen.tick(&mut canvas, detection);
        }
        if rank < LABELLED {
            pen.number(&mut canvas, detection);
        }
    }
    pen.clear_caption_ground(&mut canvas);
    if let Some(strongest) = scene.clear.first() {
        let targets: Vec<(f32, f32)> = scene.clear.iter().map(|d| pen.at(d.x, d.y)).collect();
        inset::draw(&mut canvas, scene.picture, scale, strongest, &targets, (width, height));
    }
    pen.caption(&mut canvas);
    canvas
}

fn enlarge(picture: &RgbImage, scale: f32) -> RgbImage {
    let side = |pixels: u32| ((pixels as f32 * scale).round() as u32).max(1);
    let (width, height) = (side(picture.width()), side(picture.height()));
    let filter = match scale {
        1.0 => return picture.clone(),
        whole if whole.fract() == 0.0 => return repeat(picture, whole as u32),
        smaller if smaller < 1.0 => FilterType::Triangle,
        _ => FilterType::CatmullRom,
    };
    resize(picture, width, height, filter)
}

/// Each pixel as a square of `times` x `times`.
pub(in crate::sink) fn repeat(picture: &RgbImage, times: u32) -> RgbImage {
    let (width, height) = (times * picture.width(), times * picture.height());
    let mut samples = Vec::with_capacity(3 * width as usize * height as usize);
    for row in picture.as_raw().chunks_exact(3 * picture.width() as usize) {
        let start = samples.len();
        for pixel in row.chunks_exact(3) {
            (0..times).for_each(|_| samples.extend_from_slice(pixel));
        }
        let end = samples.len();
        (1..times).for_each(|_| samples.extend_from_within(start..end));
    }
    RgbImage::from_raw(width, height, samples).expect("as many samples as pixels ask for")
}

impl Pen<'_> {
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        ((x + 0.5) * self.scale, (y + 0.5) * self.scale)
    }

    /// Under everything else, and not inside rings.
    fn outline(&self, canvas: &mut Canvas, enlarged: &RgbImage, Outline(lines): &Outline) {
        let place = |edge: usize| (edge as f32 * self.scale).round();
        for &[x, y, u, v] in lines {
            let (x, y, u, v) = (place(x), place(y), place(u), place(v));
            let (width, height) = if y == v { (u - x, 1.0) } else { (1.0, v - y) };
            let (back, up) = if y == v { (0.0, 1.0) } else { (1.0, 0.0) };
            canvas.rectangle(x, y, width, height, [0, 0, 0], 0.45);
            canvas.rectangle(x - back, y - up, width, height, INK, 0.75);
        }
        for detection in self.scene.clear.iter().chain(self.scene.faint) {
            let (x, y) = self.at(detection.x, detection.y);
            canvas.paste_disc(enlarged, x, y, self.radius);
        }
    }

    fn trail(&self, canvas: &mut Canvas, trace: u64, places: &[Place]) {
        // Nothing is drawn inside any ring: that is where targets are.
        let free = |(x, y): (f32, f32)| {
            self.scene.clear.iter().all(|d| {
                let (cx, cy) = self.at(d.x, d.y);
                (x - cx).hypot(y - cy) > self.radius + self.line
            })
        };
        for pair in places.windows(2) {
            let (from, to) = (self.at(pair[0].x, pair[0].y), self.at(pair[1].x, pair[1].y));
            let middle = (0.5 * (from.0 + to.0), 0.5 * (from.1 + to.1));
            if free(from) && free(to) && free(middle) {
                let strength = 0.3 + 0.6 * self.scene.trails.freshness(&pair[1]);
                canvas.segment(from, to, 0.9 * self.line, colour(trace), strength);
            }
        }
    }

    fn tick(&self, canvas: &mut Canvas, detection: &Detection) {
        let (x, y) = self.at(detection.x, detection.y);
        let (dx, dy) = (detection.direction.cos(), -detection.direction.sin());
        let along = |distance: f32| (x + distance * dx, y + distance * dy);
        let head = (0.45 * self.radius).clamp(5.0, 12.0);
        let rgb = colour(detection.trace);
        canvas.segment(along(self.radius), along(1.55 * self.radius), self.line, rgb, 1.0);
        canvas.arrow_head(along(1.55 * self.radius + head), (dx, dy), head, rgb);
    }

    /// Beside the ring, off the way of the trail and the tick, inside the picture.
    fn number(&self, canvas: &mut Canvas, detection: &Detection) {
        let (x, y) = self.at(detection.x, detection.y);
        let text = detection.trace.to_string();
        let size = 0.85 * self.letters;
        let width = text_width(&text, size);
        let direction = if detection.direction.is_finite() { detection.direction } else { 0.0 };
        let places = [FRAC_PI_2, -FRAC_PI_2, 0.25 * PI, -0.25 * PI, 0.75 * PI, -0.75 * PI].map(|turn| {
            let (dx, dy) = ((direction + turn).cos(), -(direction + turn).sin());
            let reach = self.radius + 0.8 * size + 0.5 * width * dx.abs();
            (x + reach * dx - 0.5 * width, y + reach * dy)
        });
        let fits = |(left, middle): &&(f32, f32)| {
            *left > 0.3 * size
                && left + width + 0.3 * size < canvas.width() as f32
                && middle - 0.6 * size > 0.0
                && middle + 0.6 * size < self.height as f32
        };
        let (left, middle) = places.iter().find(fits).copied().unwrap_or(places[0]);
        canvas.label(&text, left, middle, size, colour(detection.trace));
    }

    /// Rings at the lower edge reach into the caption: they end at the picture.
    fn clear_caption_ground(&self, canvas: &mut Canvas) {
        let (width, top) = (canvas.width() as f32, self.height as f32);
        canvas.rectangle(0.0, top, width, canvas.height() as f32 - top, GROUND, 1.0);
    }

    fn caption(&self, canvas: &mut Canvas) {
        let (width, letters) = (canvas.width() as f32, self.letters);
        let middle = 0.5 * (self.height + canvas.height()) as f32;
        let margin = 0.6 * letters;
        let used = canvas.text(&self.scene.frame.to_string(), margin, middle, letters, INK);
        let left_end = margin + used + letters;
        let right = self.count();
        let right_left = width - margin - text_width(&right, letters);
        if right_left > left_end {
            canvas.text(&right, right_left, middle, letters, FAINT);
        }
        if text_width(self.scene.name, letters) < right_left - letters - left_end {
            canvas.text(self.scene.name, left_end, middle, letters, FAINT);
        }
    }

    fn count(&self) -> String {
        let Scene { clear, faint, .. } = self.scene;
        let Some(strongest) = clear.first() else {
            return if faint.is_empty() { "no target".to_owned() } else { format!("{} faint", faint.len()) };
        };
        let targets = if clear.len() == 1 { "1 target".to_owned() } else { format!("{} targets", clear.len()) };
        let faint = if faint.is_empty() { String::new() } else { format!(" + {} faint", faint.len()) };
        format!("{targets}{faint}, strongest {:.1e}", strongest.score)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    #[test]
    fn targets_stay_visible() {
        let picture = RgbImage::from_fn(120, 90, |x, y| Rgb([(x * 2) as u8, (y * 2) as u8, 90]));
        let mut trails = Trails::default();
        let mut target = Detection { x: 20.0, y: 44.0, score: 1.0, direction: 0.0, trace: 3, ..Detection::default() };
        for frame in 0..40 {
            target.x += 1.0;
            trails.add(frame, &[target]);
        }
        for scale in [1.0, 3.0] {
            let draw = |clear: &[Detection], outline: Option<&Outline>, trails: &Trails| {
                annotate(&Scene { picture: &picture, clear, faint: &[], outline, trails, frame: 40, name: "" }, scale)
            };
            let bare = draw(&[], None, &Trails::default()).rgb();
            // The border goes through the target.
            let border = Outline(vec![[0, 44, 120, 44], [60, 0, 60, 90]]);
            let canvas = draw(&[target], Some(&border), &trails);
            let drawn = canvas.rgb();
            let (cx, cy) = ((target.x + 0.5) * scale, (target.y + 0.5) * scale);
            let (mut inside, mut changed) = (0, 0);
            for (i, (old, new)) in bare.chunks(3).zip(drawn.chunks(3)).enumerate() {
                let (x, y) = (i as u32 % canvas.width(), i as u32 / canvas.width());
                let distance = (x as f32 + 0.5 - cx).hypot(y as f32 + 0.5 - cy);
                changed += usize::from(old != new);
                if distance < 6.0 * scale {
                    inside += 1;
                    assert_eq!(old, new, "pixel ({x}, {y}) at scale {scale}");
                }
            }
            assert!(inside > 100 && changed > 100, "{inside} {changed}");
        }
    }
}
