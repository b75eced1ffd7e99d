//! `--video`: every frame annotated, through the program ffmpeg. Targets are the tracks, in rings of their own colour with
//! the path behind them; what belongs to no track has a faint ring. The file grows beside its place and is moved there
//! when it is whole, at Ctrl-C too.

mod clock;
mod codec;
mod encoder;
mod response;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use apgstmd_core::tracking::{TrackPoint, TrackState};
use apgstmd_core::{Detection, Size};

use self::clock::Clock;
pub use self::codec::Codec;
use self::encoder::Encoder;
use self::response::ResponseMap;
use super::beside::Beside;
use super::outline::Outline;
use super::overlay::annotate::{Scene, annotate};
use super::overlay::frame_scale;
use super::overlay::tone::Tone;
use super::overlay::trails::Trails;
use super::{Seen, Sink, WEAK};
use crate::Outcome;

/// Names that a video may have, and the formats that they ask of ffmpeg.
pub const FORMATS: [(&str, &str); 4] = [("mp4", "mp4"), ("m4v", "mp4"), ("mov", "mov"), ("mkv", "matroska")];
/// Longest side of a picture with the response beside it, px.
const WIDEST: f32 = 960.0;
/// Farthest that a detection lies from its track's estimate, px.
const NEAR: f64 = 8.0;

/// The format of a file name.
pub fn format_of(path: &Path) -> Option<&'static str> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    FORMATS.iter().find(|(name, _)| *name == extension).map(|(_, format)| *format)
}

/// Frames a second of the source, and of the video.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    shown: f64,
    /// A second of the video is one of the source.
    true_time: bool,
}

impl Rate {
    /// Of a source of `rate` frames a second: the same, but what no screen shows is slow motion, and what nobody waits for
    /// is a time lapse.
    pub fn of(rate: f64) -> Self {
        match rate {
            rate if rate > 120.0 => Self { shown: 30.0, true_time: false },
            rate if rate >= 1.0 => Self { shown: rate, true_time: true },
            _ => Self { shown: 10.0, true_time: false },
        }
    }

    /// Where only times are known, or nothing.
    fn between(from: Option<f64>, to: Option<f64>) -> Self {
        match (from, to) {
            (Some(from), Some(to)) if to > from => Self::of((to - from).recip()),
            _ => Self { shown: 25.0, true_time: false },
        }
    }
}

/// What a video is to be.
pub struct VideoOptions {
    /// Its file.
    pub path: PathBuf,
    /// What encodes it.
    pub codec: Codec,
    /// Frames a second, where that is known beforehand.
    pub rate: Option<f64>,
    /// The response map beside the picture.
    pub response: bool,
    /// That is one of a bank.
    pub bank: bool,
    /// Drawn upon every picture.
    pub outline: Option<Rc<Outline>>,
}

/// Draws every frame and hands it to ffmpeg.
pub struct Video {
    beside: Beside,
    options: VideoOptions,
    response: Option<ResponseMap>,
    tone: Option<Tone>,
    trails: Trails,
    strongest: f32,
    /// Drawn, and shown until the next one's time is known.
    pending: Option<(Vec<u8>, Option<f64>)>,
    size: (u32, u32),
    running: Option<(Encoder, Clock)>,
}

impl Video {
    /// Sees at once whether it will be able to write.
    ///
    /// # Errors
    /// It will not.
    pub fn new(options: VideoOptions) -> Outcome<Self> {
        Ok(Self {
            beside: Beside::new(&options.path)?,
            response: options.response.then(|| ResponseMap::new(options.bank)),
            options,
            tone: None,
            trails: Trails::default(),
            strongest: 0.0,
            pending: None,
            size: (0, 0),
            running: None,
        })
    }

    fn draw(&mut self, seen: &Seen) -> Vec<u8> {
        self.strongest = seen.detections.iter().map(|found| found.score).fold(self.strongest, f32::max);
        let least = WEAK * self.strongest;
        // A point that was not seen belongs to whatever trail there is.
        let strong = |point: &&TrackPoint| point.score >= least || point.state == TrackState::Coasting;
        self.trails.add_points(seen.frame, seen.tracks.iter().filter(strong));
        let (clear, faint) = by_tracks(seen, least);
        let tone = self.tone.get_or_insert_with(|| Tone::of(&seen.picture));
        let name = match seen.time {
            Some(time) => format!("{}   {time:.2} s", seen.name),
            None => seen.name.clone(),
        };
        let picture = &tone.render(&seen.picture);
        let outline = self.options.outline.as_deref();
        let (clear, faint, trails) = (&clear[..], &faint[..], &self.trails);
        let scene = Scene { picture, clear, faint, outline, trails, frame: seen.frame, name: &name };
        let size = seen.picture.size();
        let mut canvas = annotate(&scene, self.scale(size));
        if let (Some(map), Some(values)) = (&mut self.response, &seen.response) {
            canvas = map.beside(&canvas, values, size);
        }
        self.size = (canvas.width(), canvas.height());
        canvas.rgb()
    }

    fn scale(&self, size: Size) -> f32 {
        if !self.options.response {
            return frame_scale(size);
        }
        let scale = WIDEST / size.height.max(size.width) as f32;
        if scale >= 1.0 { scale.round().min(6.0) } else { scale.max(0.5) }
    }

    /// Hands on what waits, now that `next` comes.
    fn pass(&mut self, next: Option<f64>) -> Outcome {
        let Some((picture, time)) = self.pending.take() else { return Ok(()) };
        let (encoder, clock) = match &mut self.running {
            Some(running) => running,
            none => {
                let rate = self.options.rate.map_or_else(|| Rate::between(time, next), Rate::of);
                let format = format_of(&self.options.path).unwrap_or("mp4");
                let encoder = Encoder::start(self.options.codec, rate, self.size, self.beside.part(), format)?;
                none.insert((encoder, Clock::new(rate)))
            }
        };
        encoder.put(picture, clock.times(time, next))
    }
}

impl Sink for Video {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        let picture = self.draw(seen);
        self.pass(seen.time)?;
        self.pending = Some((picture, seen.time));
        Ok(())
    }

    fn finish(&mut self) -> Outcome {
        self.pass(None)?;
        match self.running.take() {
            Some((mut encoder, _)) => encoder.end().and_then(|()| self.beside.place()),
            None => Ok(()),
        }
    }
}

/// Detections of tracks from this score on, with the track's number for that of the trace, and the others.
fn by_tracks(seen: &Seen, least: f32) -> (Vec<Detection>, Vec<Detection>) {
    let mut points: HashMap<u64, &TrackPoint> =
        seen.tracks.iter().filter(|point| point.frame == seen.frame).map(|point| (point.track, point)).collect();
    let (mut clear, mut faint) = (Vec::new(), Vec::new());
    for detection in &seen.detections {
        if detection.score < least {
            faint.push(*detection);
            continue;
        }
        let distance = |point: &TrackPoint| {
            let (x, y) = (f64::from(detection.x), f64::from(detection.y));
            (point.x - x).hypot(point.y - y)
        };
        let same = |point: &TrackPoint| point.score == detection.score;
        // The score tells which of two close ones it was.
        let nearest = points.values().filter(|point| distance(point) < NEAR);
        let nearest = nearest.min_by(|a, b| same(b).cmp(&same(a)).then(distance(a).total_cmp(&distance(b))));
        match nearest.map(|point| point.track) {
            Some(track) => {
                points.remove(&track);
                clear.push(Detection { trace: track, ..*detection });
            }
            None => faint.push(*detection),
        }
    }
    (clear, faint)
}
