//! Annotated pictures: one a frame under `overlay/`, and `strip.png`, twelve frames on one sheet.

pub(super) mod annotate;
pub(super) mod canvas;
mod inset;
mod strip;
pub(super) mod tone;
pub(super) mod trails;

use std::collections::{HashSet, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use apgstmd_core::Size;

use self::annotate::{Scene, annotate};
use self::canvas::Canvas;
use self::tone::Tone;
use self::trails::Trails;
use super::outline::Outline;
use super::results::{OVERLAY, STRIP};
use super::{Seen, Sink, png as picture};
use crate::Outcome;
use crate::failure::Failure;

/// Width that small frames are enlarged to, about, px.
const FRAME_WIDTH: f32 = 1200.0;
/// Width of a frame on the strip, about, px.
const TILE_WIDTH: f32 = 560.0;
/// Detections below this share of the strongest one so far are drawn faintly: clutter is many times weaker than targets.
const FAINT_BELOW: f32 = 0.02;
/// Frames on the strip.
const TILES: usize = 12;

/// Draws every frame and, at the end, the strip.
pub struct Overlay {
    frames: Option<PathBuf>,
    strip: PathBuf,
    title: String,
    outline: Option<Rc<Outline>>,
    choice: Choice,
    tiles: Vec<Canvas>,
    tone: Option<Tone>,
    trails: Trails,
    strongest: f32,
    names: HashSet<String>,
    count: usize,
    detections: usize,
}

impl Overlay {
    /// `frames` are those that will come, where that is known: the strip shows twelve of them, evenly spaced. `each`
    /// asks for a picture of every frame besides, `outline` is drawn upon all.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn new(
        folder: &Path,
        title: String,
        frames: Option<&[usize]>,
        each: bool,
        outline: Option<Rc<Outline>>,
    ) -> Outcome<Self> {
        let pictures = folder.join(OVERLAY);
        if each {
            fs::create_dir_all(&pictures).map_err(|error| Failure::write(&pictures, error))?;
        }
        Ok(Self {
            frames: each.then_some(pictures),
            strip: folder.join(STRIP),
            title,
            outline,
            choice: match frames {
                Some(frames) => Choice::Known(evenly_spaced(frames, TILES)),
                None => Choice::Thinned { every: 1 },
            },
            tiles: Vec::new(),
            tone: None,
            trails: Trails::default(),
            strongest: 0.0,
            names: HashSet::new(),
            count: 0,
            detections: 0,
        })
    }
}

impl Sink for Overlay {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        self.count += 1;
        self.detections += seen.detections.len();
        self.strongest = seen.detections.iter().map(|d| d.score).fold(self.strongest, f32::max);
        let (clear, faint): (Vec<_>, Vec<_>) =
            seen.detections.iter().copied().partition(|d| d.score >= FAINT_BELOW * self.strongest);
        self.trails.add(seen.frame, &clear);
        let on_strip = self.choice.takes(seen.frame, self.count - 1);
        if self.frames.is_none() && !on_strip {
            return Ok(());
        }
        let tone = self.tone.get_or_insert_with(|| Tone::of(&seen.picture));
        let scene = Scene {
            picture: &tone.render(&seen.picture),
            clear: &clear,
            faint: &faint,
            outline: self.outline.as_deref(),
            trails: &self.trails,
            frame: seen.frame,
            name: &seen.name,
        };
        let size = seen.picture.size();
        if let Some(folder) = self.frames.clone() {
            let drawn = annotate(&scene, frame_scale(size));
            let path = folder.join(file_name(&mut self.names, &seen.name, seen.frame));
            save(&path, &drawn)?;
        }
        if on_strip {
            self.tiles.push(annotate(&scene, tile_scale(size)));
            self.choice.thin(&mut self.tiles);
        }
        Ok(())
    }

    fn finish(&mut self) -> Outcome {
        if self.tiles.is_empty() {
            return Ok(());
        }
        let title = format!("{}   {} frames, {} detections", self.title, self.count, self.detections);
        let shown: Vec<usize> = (0..self.tiles.len()).collect();
        let tiles: Vec<&Canvas> = evenly_spaced(&shown, TILES).into_iter().map(|tile| &self.tiles[tile]).collect();
        let sheet = strip::assemble(&tiles, &title);
        save(&self.strip, &sheet)
    }
}

/// Which frames come onto the strip.
enum Choice {
    /// These, or those that come next after them.
    Known(VecDeque<usize>),
    /// How many will come shows only at the end: every so-manieth, and half of them each time that there are too many.
    Thinned { every: usize },
}

impl Choice {
    /// Whether to take a frame, before which `count` came.
    fn takes(&mut self, frame: usize, count: usize) -> bool {
        match self {
            Self::Thinned { every } => count.is_multiple_of(*every),
            Self::Known(wanted) => {
                let passed = wanted.iter().take_while(|wanted| frame >= **wanted).count();
                wanted.drain(..passed);
                passed > 0
            }
        }
    }

    fn thin<T>(&mut self, tiles: &mut Vec<T>) {
        if let Self::Thinned { every } = self
            && tiles.len() == 4 * TILES
        {
            *every *= 2;
            let mut index = 0;
            tiles.retain(|_| {
                index += 1;
                index % 2 == 1
            });
        }
    }
}

fn save(path: &Path, canvas: &Canvas) -> Outcome {
    let size = (canvas.width(), canvas.height());
    picture::write(path, size, (png::ColorType::Rgb, png::BitDepth::Eight), &canvas.rgb())
}

/// Whole numbers keep pixels square and crisp.
pub(super) fn frame_scale(size: Size) -> f32 {
    (FRAME_WIDTH / size.height.max(size.width) as f32).round().clamp(1.0, 6.0)
}

fn tile_scale(size: Size) -> f32 {
    let scale = TILE_WIDTH / size.height.max(size.width) as f32;
    if scale >= 1.5 { scale.round().min(6.0) } else { scale }
}

/// `a/b.png` -> `a_b.png`; two frames that would share a file get their number added.
fn file_name(taken: &mut HashSet<String>, name: &str, frame: usize) -> String {
    let stem = name.rsplit_once('.').map_or(name, |(stem, _)| stem).replace(['/', '\\'], "_");
    let unique = if taken.contains(&stem) { format!("{stem}_{frame:06}") } else { stem };
    taken.insert(unique.clone());
    format!("{unique}.png")
}

/// The middles of `count` equal parts.
fn evenly_spaced(frames: &[usize], count: usize) -> VecDeque<usize> {
    if frames.len() <= count {
        return frames.iter().copied().collect();
    }
    (0..count).map(|i| frames[(2 * i + 1) * frames.len() / (2 * count)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_are_spread_evenly() {
        let frames: Vec<usize> = (10..130).collect();
        let tiles = evenly_spaced(&frames, TILES);
        assert_eq!((tiles.len(), tiles[0], tiles[11]), (12, 15, 125));
        assert_eq!(evenly_spaced(&frames[..5], TILES), [10, 11, 12, 13, 14]);
    }

    #[test]
    fn a_strip_of_unknown_length() {
        for frames in [1, 5, 12, 13, 47, 48, 49, 500, 2000] {
            let mut choice = Choice::Thinned { every: 1 };
            let mut tiles = Vec::new();
            for frame in 0..frames {
                if choice.takes(frame, frame) {
                    tiles.push(frame);
                    choice.thin(&mut tiles);
                }
            }
            let shown = evenly_spaced(&tiles, TILES);
            assert_eq!(shown.len(), frames.min(TILES), "{frames}");
            let steps: Vec<usize> = shown.iter().zip(shown.iter().skip(1)).map(|(a, b)| b - a).collect();
            let (least, most) = (steps.iter().min().unwrap_or(&1), steps.iter().max().unwrap_or(&1));
            assert!(*most <= 2 * least && frames - shown[shown.len() - 1] <= 2 * most, "{frames}: {shown:?}");
        }
    }

    #[test]
    fn frames_never_share_a_file() {
        let mut taken = HashSet::new();
        assert_eq!(file_name(&mut taken, "a/b.png", 0), "a_b.png");
        assert_eq!(file_name(&mut taken, "a_b.jpg", 1), "a_b_000001.png");
        assert_eq!(file_name(&mut taken, "b.v2.tif", 2), "b.v2.png");
    }
}
