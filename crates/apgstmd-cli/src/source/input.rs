//! INPUT of `apgstmd run`: pictures, a scene, a video, a camera, an address, or standard input.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use apgstmd_core::Size;
use apgstmd_core::stimulus::Scene;

use super::ffmpeg::{Location, Video};
use super::listing::KINDS;
use super::stdin::StdinFrames;
use super::stream::{About, Frames, Stream};
use super::{
    FrameSource, Limit, Listing, Missing, PictureFiles, RawFormat, SceneFile, SceneFrames, Selection, Span, is_picture,
    is_scene, numbering,
};
use crate::Outcome;
use crate::failure::Failure;

/// What the command line says of INPUT besides its name.
#[derive(Clone, Copy, Debug, Default)]
pub struct InputFlags {
    /// What raw bytes on standard input are.
    pub raw: Option<RawFormat>,
    /// Frames a second.
    pub fps: Option<f64>,
    /// The newest frame only, or each.
    pub live: Option<bool>,
    /// Bits that 16-bit samples use.
    pub bit_depth: Option<u32>,
    /// How large a frame may be that is read.
    pub limit: Limit,
}

/// What there is to see.
pub struct Input {
    path: PathBuf,
    kind: Kind,
    flags: InputFlags,
    /// Frames of a stream that have come.
    came: Arc<AtomicUsize>,
}

enum Kind {
    Pictures(Listing),
    Scene(Box<SceneFile>),
    Video(Box<Video>),
    Stdin,
    /// Handed over by the program around this one, until they are taken.
    Given(Mutex<Option<Box<dyn Frames>>>),
}

impl Input {
    /// Finds the pictures, reads the scene where the name ends in `.toml`, looks at the video.
    ///
    /// # Errors
    /// Nothing there, no pictures, a scene that cannot be drawn, no video, no ffmpeg; flags that are not for it.
    pub fn of(path: &Path, flags: InputFlags) -> Outcome<Self> {
        let kind = if path.as_os_str() == "-" {
            Kind::Stdin
        } else if is_scene(path) {
            Kind::Scene(Box::new(SceneFile::read(path)?))
        } else if let Some(location) = Location::of(path) {
            check_flags(flags, &location)?;
            Kind::Video(Box::new(Video::of(location, flags)?))
        } else if path.is_file() && !is_picture(path) {
            Kind::Video(Box::new(video_file(path, flags)?))
        } else {
            Kind::Pictures(Listing::of(path)?)
        };
        let input = Self { path: path.to_owned(), kind, flags, came: Arc::default() };
        input.check()?;
        Ok(input)
    }

    /// The frames of a program around this one.
    ///
    /// # Errors
    /// Flags that are not for them.
    pub fn given(frames: Box<dyn Frames>, flags: InputFlags) -> Outcome<Self> {
        let kind = Kind::Given(Mutex::new(Some(frames)));
        let input = Self { path: PathBuf::new(), kind, flags, came: Arc::default() };
        input.check().map(|()| input)
    }

    fn check(&self) -> Outcome {
        let flags = self.flags;
        match &self.kind {
            Kind::Stdin => StdinFrames::check()?,
            Kind::Scene(_) if flags.bit_depth.is_some() => {
                return Err(Failure::usage("--bit-depth is for pictures: a scene is drawn in floating point"));
            }
            Kind::Scene(file) => {
                let Scene { height, width, .. } = *file.scene();
                flags
                    .limit
                    .check(Size::new(height, width))
                    .map_err(|reason| Failure::usage(format_args!("cannot use {}: {reason}", self.shown())))?;
            }
            _ => {}
        }
        match &self.kind {
            Kind::Scene(_) if flags.fps.is_some() => {
                return Err(Failure::usage("--fps is for pictures and video: a scene has its own rate"));
            }
            _ => {}
        }
        if flags.raw.is_some() && !matches!(self.kind, Kind::Stdin) {
            return Err(Failure::usage(format_args!(
                "--raw is for standard input: INPUT must be -, but it is {}",
                self.shown()
            )));
        }
        if flags.live == Some(true) && matches!(self.kind, Kind::Pictures(_) | Kind::Scene(_)) {
            return Err(Failure::usage(
                "--live drops what comes too fast, but pictures and scenes wait until they are taken",
            )
            .hint("it is for video, cameras, addresses and standard input"));
        }
        Ok(())
    }

    /// How many frames it has, or, of a stream, how many have come.
    pub fn count(&self) -> usize {
        match &self.kind {
            Kind::Pictures(listing) => listing.files.len(),
            Kind::Scene(file) => file.scene().frames,
            Kind::Video(_) | Kind::Stdin | Kind::Given(_) => self.came.load(Ordering::Relaxed),
        }
    }

    /// The frames used, where that is known beforehand.
    ///
    /// # Errors
    /// None is left; seconds where no times are known.
    pub fn select(&self, span: Span) -> Outcome<Option<Selection>> {
        match &self.kind {
            Kind::Pictures(_) | Kind::Scene(_) => span.of(self.count(), self.rate()).map(Some),
            Kind::Stdin if self.flags.raw.is_some() => span.check_rate(self.flags.fps).map(|()| None),
            Kind::Video(_) | Kind::Stdin | Kind::Given(_) => Ok(None),
        }
    }

    /// Pictures that are missing by the numbers in the names of those from the first to the last of `selection`.
    pub fn missing(&self, selection: Option<&Selection>) -> Option<Missing> {
        let Kind::Pictures(listing) = &self.kind else { return None };
        let [first, .., last] = selection?.frames() else { return None };
        let names: Vec<String> = listing.files[*first..=*last].iter().map(|file| listing.name(file)).collect();
        numbering::missing(names.iter().map(String::as_str))
    }

    /// How many frames its header says it has, where that is far more than have come. Some fewer are nothing unusual: an
    /// edit may hide some, and some may need others that are gone.
    pub fn claims(&self) -> Option<usize> {
        let Kind::Video(video) = &self.kind else { return None };
        video.probed.claimed.filter(|claimed| self.count() < claimed - claimed / 10)
    }

    /// Frames a second, where that is known beforehand.
    pub fn rate(&self) -> Option<f64> {
        self.flags.fps.or(match &self.kind {
            Kind::Scene(file) => Some(file.scene().rate),
            Kind::Video(video) => video.probed.rate,
            Kind::Pictures(_) | Kind::Stdin | Kind::Given(_) => None,
        })
    }

    /// Whether frames that come too fast are dropped.
    pub fn is_live(&self) -> bool {
        self.flags.live.unwrap_or_else(|| match &self.kind {
            Kind::Video(video) => video.location.is_live(),
            _ => false,
        })
    }

    /// Whether that is so without having been asked for.
    pub fn is_live_by_itself(&self) -> bool {
        self.flags.live.is_none() && self.is_live()
    }

    /// What the command line says of it.
    pub fn flags(&self) -> InputFlags {
        self.flags
    }

    /// The scene, where it is one.
    pub fn scene(&self) -> Option<&Scene> {
        match &self.kind {
            Kind::Scene(file) => Some(file.scene()),
            _ => None,
        }
    }

    /// INPUT as given, but for a password.
    pub fn shown(&self) -> String {
        match &self.kind {
            Kind::Video(video) => video.location.shown(),
            Kind::Stdin => "standard input".to_owned(),
            Kind::Given(_) => "the frames given".to_owned(),
            Kind::Pictures(_) | Kind::Scene(_) => self.path.display().to_string(),
        }
    }

    /// What results are named after.
    pub fn name(&self) -> String {
        match &self.kind {
            Kind::Pictures(listing) => {
                let folder = if listing.folder.as_os_str().is_empty() { Path::new(".") } else { &listing.folder };
                let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
                folder.file_name().map_or("frames".into(), |name| name.to_string_lossy()).into_owned()
            }
            Kind::Scene(file) => file.stem(),
            Kind::Video(video) => video.location.name(),
            Kind::Stdin => "stdin".to_owned(),
            Kind::Given(_) => "frame".to_owned(),
        }
    }

    /// The frames as streams that take turns, at most `parts` of them, to be read side by side. `selection` is what
    /// [`Input::select`] made of `span`; frames up to `done` are left out.
    ///
    /// # Errors
    /// The system has no more threads.
    pub fn open(
        &self,
        span: Span,
        selection: Option<&Selection>,
        done: Option<usize>,
        parts: usize,
    ) -> Outcome<Vec<Box<dyn FrameSource + '_>>> {
        let all = Selection::all(self.count());
        let left = selection.unwrap_or(&all).after(done);
        let turns = || left.turns(parts);
        Ok(match &self.kind {
            Kind::Pictures(listing) => turns()
                .map(|part| Box::new(PictureFiles::new(listing, part, self.flags)) as Box<dyn FrameSource + '_>)
                .collect(),
            Kind::Scene(file) => turns()
                .map(|part| Box::new(SceneFrames::new(file.renderer(), part)) as Box<dyn FrameSource + '_>)
                .collect(),
            Kind::Video(video) => {
                let expected = if video.location.is_live() { None } else { video.probed.frames };
                let expected = expected.and_then(|count| span.of(count, self.rate()).ok());
                let about = self.about(expected.map(|selection| selection.frames().len()));
                vec![Box::new(Stream::new(video.open(self.is_live()), about, (span, done)))]
            }
            Kind::Stdin => {
                let frames = StdinFrames::open(self.flags)?;
                vec![Box::new(Stream::new(frames, self.about(None), (span, done)))]
            }
            Kind::Given(frames) => {
                let frames = frames.lock().unwrap_or_else(PoisonError::into_inner).take();
                frames
                    .map(|frames| Box::new(Stream::new(frames, self.about(None), (span, done))) as Box<dyn FrameSource>)
                    .into_iter()
                    .collect()
            }
        })
    }

    fn about(&self, expected: Option<usize>) -> About {
        About { name: self.name(), shown: self.shown(), fps: self.flags.fps, expected, came: Arc::clone(&self.came) }
    }
}

/// What is known to be wrong before a camera is asked.
fn check_flags(flags: InputFlags, location: &Location) -> Outcome {
    if flags.fps.is_some() && location.is_live() {
        return Err(Failure::usage(format_args!(
            "--fps is for what tells no times: {} tells when each frame was taken",
            location.shown()
        )));
    }
    Ok(())
}

fn video_file(path: &Path, flags: InputFlags) -> Outcome<Video> {
    let empty = path.metadata().is_ok_and(|file| file.len() == 0);
    if empty {
        return Err(Failure::failed(format_args!("cannot read {}: the file is empty", path.display())));
    }
    Video::of(Location::File(path.to_owned()), flags).map_err(|failure| failure.or_hint(KINDS))
}
