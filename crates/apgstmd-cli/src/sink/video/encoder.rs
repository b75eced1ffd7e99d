//! ffmpeg as a receiver of pictures: a thread writes them to its stdin, so that whoever hands them over waits at most
//! for a place in a short queue, and not for ever.

use std::ffi::OsString;
use std::io::{self, Write};
use std::path::Path;
use std::process::{ChildStdin, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::{Builder, JoinHandle, sleep};
use std::time::{Duration, Instant};

use super::{Codec, Rate};
use crate::Outcome;
use crate::failure::{Failure, reason};
use crate::source::ffmpeg::log::{Complaints, listen};
use crate::source::ffmpeg::process::{Process, ended};

/// Pictures that may wait.
const WAITING: usize = 2;
/// Longest time that ffmpeg may take for one.
const PATIENCE: Duration = Duration::from_secs(60);

/// Pixels of a picture, and how often it is shown.
type Shown = (Vec<u8>, u32);

pub(super) struct Encoder {
    process: Process,
    queue: Option<SyncSender<Shown>>,
    writer: Option<JoinHandle<io::Result<()>>>,
    log: Option<JoinHandle<Complaints>>,
}

impl Encoder {
    /// Starts it: pictures of `size`, three bytes a pixel, into the file `to`, in the format that `name` asks for.
    ///
    /// # Errors
    /// ffmpeg or the system refuses.
    pub fn start(codec: Codec, rate: Rate, (width, height): (u32, u32), to: &Path, format: &str) -> Outcome<Self> {
        let (size, rate) = (format!("{width}x{height}"), rate.shown.to_string());
        let input = ["-f", "rawvideo", "-pixel_format", "rgb24", "-video_size", &size, "-framerate", &rate];
        // 4:2:0 needs even sides. What is not said is taken for BT.709 by some players and for BT.601 by others.
        let filter = "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,format=yuv420p";
        let colours =
            ["-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"];
        let mut arguments: Vec<OsString> = Vec::new();
        let mut add = |words: &[&str]| arguments.extend(words.iter().map(OsString::from));
        add(&["-hide_banner", "-nostats", "-loglevel", "repeat+level+warning", "-y"]);
        add(&input);
        add(&["-i", "pipe:0", "-an", "-vf", filter]);
        add(codec.flags);
        add(&colours);
        add(&["-movflags", "+faststart", "-f", format]);
        let mut file = OsString::from("file:");
        file.push(to);
        arguments.push(file);
        let mut process = Process::spawn("ffmpeg", &arguments, Stdio::piped(), "--video")?;
        let failed = |error: io::Error| Failure::failed(format_args!("cannot run ffmpeg: {}", reason(&error)));
        let (Some(stdin), Some(stderr)) = (process.0.stdin.take(), process.0.stderr.take()) else {
            return Err(failed(io::Error::other("it has no input")));
        };
        let (_, log) = listen(stderr, str::to_owned).map_err(failed)?;
        let (queue, pictures) = sync_channel(WAITING);
        let writer = Builder::new().name("apgstmd-video".to_owned());
        let writer = writer.spawn(move || write(stdin, &pictures)).map_err(failed)?;
        Ok(Self { process, queue: Some(queue), writer: Some(writer), log: Some(log) })
    }

    /// Hands over a picture that is shown `times` times.
    ///
    /// # Errors
    /// ffmpeg has ended, or does nothing any more.
    pub fn put(&mut self, picture: Vec<u8>, times: u32) -> Outcome {
        let begin = Instant::now();
        let mut shown = (picture, times);
        while let Some(queue) = &self.queue {
            match queue.try_send(shown) {
                Ok(()) => return Ok(()),
                Err(TrySendError::Disconnected(_)) => break,
                Err(TrySendError::Full(_)) if begin.elapsed() > PATIENCE => return Err(stuck()),
                Err(TrySendError::Full(back)) => shown = back,
            }
            sleep(Duration::from_millis(2));
        }
        Err(self.why())
    }

    /// No more pictures: waits until the file is whole.
    ///
    /// # Errors
    /// It is not.
    pub fn end(&mut self) -> Outcome {
        self.queue = None;
        let begin = Instant::now();
        loop {
            match self.process.0.try_wait() {
                Ok(Some(status)) if status.success() && self.written() => return Ok(()),
                Ok(Some(_)) | Err(_) => return Err(self.why()),
                Ok(None) if begin.elapsed() > PATIENCE => return Err(stuck()),
                Ok(None) => sleep(Duration::from_millis(5)),
            }
        }
    }

    /// Whether ffmpeg took everything. It has ended: nobody waits.
    fn written(&mut self) -> bool {
        self.writer.take().is_some_and(|writer| matches!(writer.join(), Ok(Ok(()))))
    }

    /// Why it has ended.
    fn why(&mut self) -> Failure {
        let status = self.process.end();
        let complaints = self.log.take().and_then(|log| log.join().ok()).unwrap_or_default();
        let killed = || status.map_or_else(|| "ffmpeg ended early".to_owned(), |status| ended("ffmpeg", status));
        let why = complaints.first.clone().unwrap_or_else(killed);
        Failure::failed(format_args!("--video: {why}"))
    }
}

fn stuck() -> Failure {
    Failure::failed(format_args!("--video: ffmpeg does nothing since {} s", PATIENCE.as_secs()))
}

fn write(mut stdin: ChildStdin, pictures: &Receiver<Shown>) -> io::Result<()> {
    for (picture, times) in pictures {
        for _ in 0..times {
            stdin.write_all(&picture)?;
        }
    }
    Ok(())
}
