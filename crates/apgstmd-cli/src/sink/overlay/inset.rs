//! The strongest target, magnified, in the corner that hides least.

use apgstmd_core::Detection;
use image::imageops::{FilterType, crop_imm, resize};
use image::{Rgb, RgbImage};

use super::annotate::colour;
use super::canvas::{Canvas, INK};

/// Side of what is magnified, pixels of the picture.
const CROP: u32 = 25;
/// Side of the inset, share of the shorter side of the canvas.
const SHARE: f32 = 0.32;
/// Most that contrast is stretched by.
const MOST_GAIN: f32 = 8.0;

/// Draws the inset; `targets` are all targets on the canvas, `size` is that of the picture on it.
pub(super) fn draw(
    canvas: &mut Canvas,
    picture: &RgbImage,
    scale: f32,
    target: &Detection,
    targets: &[(f32, f32)],
    size: (u32, u32),
) {
    let shorter = size.0.min(size.1) as f32;
    let crop = CROP.min(picture.width()).min(picture.height());
    let zoom = (SHARE * shorter / crop as f32).round().max((1.5 * scale).ceil()).max(2.0) as u32;
    let side = crop * zoom;
    let margin = (0.012 * shorter).max(4.0);
    if side as f32 + 2.0 * margin > 0.6 * shorter {
        return;
    }
    let start = |centre: f32, length: u32| {
        let start = centre.round() - (crop / 2) as f32;
        start.clamp(0.0, (length - crop) as f32) as u32
    };
    let (left, top) = (start(target.x, picture.width()), start(target.y, picture.height()));
    let (piece, gain) = stretch(crop_imm(picture, left, top, crop, crop).to_image());
    let magnified = resize(&piece, side, side, FilterType::Nearest);

    let own = ((target.x + 0.5) * scale, (target.y + 0.5) * scale);
    let (x, y) = corner(own, targets, size, side as f32, margin);
    canvas.paste(&magnified, x as u32, y as u32);
    let rgb = colour(target.trace);
    canvas.frame(x.floor(), y.floor(), side as f32, side as f32, 1.6, rgb);

    // Marks on the border point at the target: nothing is drawn upon it.
    let (tx, ty) = (
        x.floor() + (target.x + 0.5 - left as f32) * zoom as f32,
        y.floor() + (target.y + 0.5 - top as f32) * zoom as f32,
    );
    let mark = 0.09 * side as f32;
    let (x, y, side) = (x.floor(), y.floor(), side as f32);
    for (from, to) in [((tx, y), (tx, y + mark)), ((x, ty), (x + mark, ty)), ((x + side, ty), (x + side - mark, ty))] {
        canvas.segment(from, to, 1.4, rgb, 1.0);
    }
    let letters = (0.085 * side).clamp(10.0, 15.0);
    let text = match gain {
        gain if gain >= 1.3 => format!("{zoom}x, contrast {gain:.1}x"),
        _ => format!("{zoom}x"),
    };
    canvas.label(&text, x + 0.6 * letters, y + side - 0.95 * letters, letters, INK);
}

/// The corner that covers fewest targets, of these the one farthest from the target shown.
fn corner(own: (f32, f32), targets: &[(f32, f32)], size: (u32, u32), side: f32, margin: f32) -> (f32, f32) {
    let (right, bottom) = (size.0 as f32 - side - margin, size.1 as f32 - side - margin);
    let ring = 0.3 * side;
    let covered = |(x, y): (f32, f32)| {
        let hides =
            |(tx, ty): &&(f32, f32)| *tx > x - ring && *tx < x + side + ring && *ty > y - ring && *ty < y + side + ring;
        targets.iter().filter(hides).count()
    };
    let distance = |(x, y): (f32, f32)| (x + 0.5 * side - own.0).hypot(y + 0.5 * side - own.1);
    let corners = [(margin, margin), (right, margin), (margin, bottom), (right, bottom)];
    let better =
        |a: &(f32, f32), b: &(f32, f32)| covered(*b).cmp(&covered(*a)).then(distance(*a).total_cmp(&distance(*b)));
    corners.into_iter().max_by(better).unwrap_or(corners[0])
}

/// Stretches what is there over the full range, by the same factor for all colours. A faint target shows that way.
fn stretch(mut piece: RgbImage) -> (RgbImage, f32) {
    let samples = piece.as_raw();
    let (Some(low), Some(high)) = (samples.iter().min(), samples.iter().max()) else { return (piece, 1.0) };
    let (low, high) = (f32::from(*low), f32::from(*high));
    let gain = (235.0 / (high - low).max(1.0)).clamp(1.0, MOST_GAIN);
    let middle = 0.5 * (low + high);
    let centre = middle + (127.5 - middle) * (1.0 - 1.0 / gain);
    for Rgb(pixel) in piece.pixels_mut() {
        for sample in pixel {
            *sample = (centre + (f32::from(*sample) - middle) * gain).round() as u8;
        }
    }
    (piece, gain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corner_is_far_and_hides_nothing() {
        let size = (400, 200);
        assert_eq!(corner((50.0, 30.0), &[(50.0, 30.0)], size, 60.0, 5.0), (335.0, 135.0));
        let targets = [(50.0, 30.0), (360.0, 170.0)];
        assert_eq!(corner((50.0, 30.0), &targets, size, 60.0, 5.0), (335.0, 5.0));
    }

    #[test]
    fn faint_contrast_is_stretched_and_strong_is_left() {
        let faint = RgbImage::from_fn(5, 5, |x, _| Rgb([120 + 2 * x as u8; 3]));
        let (piece, gain) = stretch(faint);
        assert_eq!(gain, MOST_GAIN);
        assert!(piece.get_pixel(4, 0).0[0] - piece.get_pixel(0, 0).0[0] == 64);
        let strong = RgbImage::from_fn(5, 5, |x, _| Rgb([60 * x as u8; 3]));
        assert_eq!(stretch(strong.clone()), (strong, 1.0));
    }
}
