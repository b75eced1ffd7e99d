//! Twelve annotated frames on one sheet.

use super::canvas::{Canvas, FAINT, INK};

/// Puts tiles of one size into a grid with a title line.
pub(super) fn assemble(tiles: &[&Canvas], title: &str) -> Canvas {
    let Some(first) = tiles.first() else { return Canvas::new(1, 1) };
    let (width, height) = (first.width(), first.height());
    let columns = columns(tiles.len(), width, height);
    let rows = (tiles.len() as u32).div_ceil(columns);
    let gap = (width / 60).max(6);
    let head = 34;
    let mut sheet = Canvas::new(columns * (width + gap) + gap, rows * (height + gap) + head + gap / 2);
    let letters = 16.0;
    let used = sheet.text("apg-STMD", gap as f32, 0.5 * head as f32, letters, INK);
    sheet.text(title, gap as f32 + used + letters, 0.5 * head as f32, letters, FAINT);
    for (i, tile) in tiles.iter().enumerate() {
        let (row, column) = (i as u32 / columns, i as u32 % columns);
        sheet.paste_canvas(tile, gap + column * (width + gap), head + row * (height + gap));
    }
    sheet
}

/// A grid that is rather wide than high: 3 x 4 for landscape tiles, 4 x 3 for square ones.
fn columns(tiles: usize, width: u32, height: u32) -> u32 {
    let most = match width as f32 / height as f32 {
        ratio if ratio > 1.3 => 3,
        ratio if ratio > 0.9 => 4,
        _ => 6,
    };
    most.min(tiles as u32)
}
