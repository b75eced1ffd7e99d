//! Video files, cameras and network streams through the programs `ffmpeg` and `ffprobe`: what they can read can be used.
//! Frames come as raw samples on its stdout, each announced with its time and size on its stderr.

mod location;
pub(crate) mod log;
mod probe;
pub(crate) mod process;

use std::ffi::OsString;
use std::io::{self, Read};
use std::process::ChildStdout;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

pub(crate) use self::location::Location;
use self::log::{Complaints, Stamp};
pub(super) use self::probe::Probed;
use self::process::{Process, ended, until};
use super::samples::Layout;
use super::stream::{Frames, Timed, Waited, read_frame, wait};
use super::{InputFlags, Limit, Switch};
use crate::Outcome;
use crate::failure::{Failure, reason};

/// Longest silence of what may stop answering. A file may take its time.
const SILENCE: Duration = Duration::from_secs(30);

/// A video that has been looked at.
pub(super) struct Video {
    pub location: Location,
    pub probed: Probed,
    layout: Layout,
    limit: Limit,
}

impl Video {
    /// Looks at it.
    ///
    /// # Errors
    /// One of the programs is missing, it is no video, `--bit-depth` contradicts it.
    pub fn of(location: Location, flags: InputFlags) -> Outcome<Self> {
        let patience = location.may_stall().then_some(SILENCE);
        let probed = probe::probe(&location, patience)?;
        if let Some(size) = probed.size {
            let refused = |reason| Failure::failed(format_args!("cannot use {}: {reason}", location.shown()));
            flags.limit.check(size).map_err(refused)?;
        }
        let layout = probed.format.layout.with_bit_depth(flags.bit_depth);
        let layout =
            layout.map_err(|reason| Failure::usage(format_args!("cannot use {}: {reason}", location.shown())))?;
        Ok(Self { location, probed, layout, limit: flags.limit })
    }

    /// Its frames from the first; `live`, as they come.
    pub fn open(&self, live: bool) -> VideoFrames {
        VideoFrames {
            location: self.location.clone(),
            arguments: self.arguments(live),
            layout: self.layout,
            limit: self.limit,
            live: live || self.location.is_live(),
            old: false,
            running: None,
            switch: Switch::default(),
            begun: false,
            last: None,
            interval: self.probed.rate.map(f64::recip),
        }
    }

    fn arguments(&self, live: bool) -> Vec<OsString> {
        let mut arguments: Vec<OsString> = Vec::new();
        let mut add = |words: &[&str]| arguments.extend(words.iter().map(OsString::from));
        add(&["-hide_banner", "-nostdin", "-nostats", "-loglevel", "repeat+level+info"]);
        // The size may change on the way.
        add(&["-fflags", "+discardcorrupt", "-max_pixels", &self.limit.pixels().to_string()]);
        if live {
            // Decoding by one thread a frame would hold back as many frames as there are threads. The usual `nobuffer` and
            // `low_delay` are no remedy: they lose what comes before the second key frame, and the order of B-frames.
            add(&["-thread_type", "slice"]);
        }
        if live && matches!(self.location, Location::File(_)) {
            add(&["-re"]);
        }
        arguments.extend(self.location.arguments());
        let format = &self.probed.format;
        let filter = format!("{},showinfo=checksum=0", format.filter);
        arguments.extend(["-map", "0:V:0", "-an", "-sn", "-dn", "-vf", &filter].map(OsString::from));
        arguments.extend(["-pix_fmt", &format.pixels, "-flush_packets", "1"].map(OsString::from));
        arguments
    }
}

pub(super) struct VideoFrames {
    location: Location,
    arguments: Vec<OsString>,
    layout: Layout,
    limit: Limit,
    live: bool,
    /// This ffmpeg is older than 5.1.
    old: bool,
    running: Option<Running>,
    switch: Switch,
    /// A frame came.
    begun: bool,
    last: Option<f64>,
    interval: Option<f64>,
}

struct Running {
    process: Process,
    frames: Receiver<Result<Announced, String>>,
    log: JoinHandle<Complaints>,
}

/// A frame with what was said of it.
type Announced = (Stamp, Vec<u8>);

impl Running {
    fn start(location: &Location, arguments: &[OsString], expected: (Layout, Limit), old: bool) -> Outcome<Self> {
        let mut arguments = arguments.to_vec();
        // Anything else drops and doubles frames to keep a steady rate.
        let every_frame = if old { ["-vsync", "0"] } else { ["-fps_mode", "passthrough"] };
        arguments.extend(every_frame.iter().chain(&["-f", "rawvideo", "pipe:1"]).map(OsString::from));
        let mut process = Process::start("ffmpeg", &arguments, location)?;
        let failed = |error: io::Error| Failure::failed(format_args!("cannot run ffmpeg: {}", reason(&error)));
        let (Some(stdout), Some(stderr)) = (process.0.stdout.take(), process.0.stderr.take()) else {
            return Err(failed(io::Error::other("it has no output")));
        };
        let cleaner = location.clone();
        let (stamps, log) = log::listen(stderr, move |text| cleaner.without_secret(text)).map_err(failed)?;
        let (sender, frames) = sync_channel(1);
        // A thread of its own, since ffmpeg may hang in the middle of a frame, and Ctrl-C must be heard then too.
        thread::Builder::new()
            .name("apgstmd-ffmpeg".to_owned())
            .spawn(move || {
                if let Err(reason) = read(stdout, &stamps, expected, &sender) {
                    // Nobody listens any more only where nobody wants to know.
                    let _ = sender.send(Err(reason));
                }
            })
            .map_err(failed)?;
        Ok(Self { process, frames, log })
    }
}

/// A stamp comes before its frame: while there is one to come, so is the other.
fn read(
    mut stdout: ChildStdout,
    stamps: &Receiver<Stamp>,
    (layout, limit): (Layout, Limit),
    frames: &SyncSender<Result<Announced, String>>,
) -> Result<(), String> {
    for stamp in stamps {
        limit.check(stamp.size)?;
        let samples = read_frame(&mut stdout, layout.bytes(stamp.size)?)?;
        let samples = samples.ok_or("it ends before the samples of a frame")?;
        if frames.send(Ok((stamp, samples))).is_err() {
            return Ok(());
        }
    }
    match stdout.read(&mut [0]) {
        Ok(0) | Err(_) => Ok(()),
        Ok(_) => Err("ffmpeg wrote samples of a frame that it did not announce".to_owned()),
    }
}

impl VideoFrames {
    fn decoded(&mut self) -> Result<Option<Timed>, String> {
        if self.running.is_none() {
            let running = Running::start(&self.location, &self.arguments, (self.layout, self.limit), self.old);
            self.running = Some(running.map_err(|failure| failure.text().unwrap_or_default())?);
        }
        let Some(running) = &self.running else { return Ok(None) };
        let limit = self.location.may_stall().then_some(SILENCE);
        match wait(&running.frames, &self.switch, limit) {
            Waited::Came(Ok((stamp, samples))) => {
                let picture = self.layout.picture(stamp.size, samples)?;
                // Some streams leave times out: then the next is one interval later.
                let guessed = || Some(self.last? + self.interval?);
                self.last = stamp.time.or_else(guessed);
                self.begun = true;
                Ok(Some((picture, self.last)))
            }
            Waited::Came(Err(cut)) => self.end(Some(cut)),
            Waited::Ended => self.end(None),
            Waited::Off => Ok(None),
            Waited::TooLong => Err(format!("no frame came for {} s", SILENCE.as_secs())),
        }
    }

    /// ffmpeg is done: well, or why not.
    fn end(&mut self, cut: Option<String>) -> Result<Option<Timed>, String> {
        let Some(Running { mut process, log, .. }) = self.running.take() else { return Ok(None) };
        let status = process.end();
        let complaints =
            if until(|| log.is_finished()) { log.join().unwrap_or_default() } else { Complaints::default() };
        if self.switch.is_off() {
            return Ok(None);
        }
        let failed = status.filter(|status| !status.success());
        if failed.is_some() && !self.begun && !self.old && complaints.last.iter().any(|line| line.contains("fps_mode"))
        {
            self.old = true;
            return self.decoded();
        }
        if let Some(status) = failed {
            let said = complaints.reason().map_or(String::new(), |line| format!(": {line}"));
            return Err(format!("{}{said}", ended("ffmpeg", status)));
        }
        match (cut, complaints.first) {
            (Some(cut), _) => Err(cut),
            // Whoever joins a stream in the middle has to hear some.
            (None, Some(first)) if !self.live => {
                let more = match complaints.errors {
                    1 => String::new(),
                    errors => format!(" (and {} more complaints)", errors - 1),
                };
                Err(format!("it is damaged or ends early, ffmpeg says: {first}{more}"))
            }
            (None, _) => Ok(None),
        }
    }
}

impl Frames for VideoFrames {
    fn next(&mut self) -> Result<Option<Timed>, String> {
        let next = self.decoded();
        if !matches!(next, Ok(Some(_))) {
            // Ended, given up or broken: in no case is it needed any more.
            self.running = None;
        }
        next
    }

    fn switch(&self) -> Switch {
        self.switch.clone()
    }
}
