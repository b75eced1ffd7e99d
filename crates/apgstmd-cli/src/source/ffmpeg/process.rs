//! The two programs as child processes that never outlive us.

use std::ffi::OsString;
use std::io::{self, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::sync_channel;
use std::time::{Duration, Instant};

use super::Location;
use super::log;
use crate::Outcome;
use crate::failure::{Failure, reason};
use crate::source::Switch;
use crate::source::stream::{Waited, wait};

/// Killed when dropped.
pub(crate) struct Process(pub Child);

impl Process {
    /// Starts `ffmpeg` or `ffprobe` with nothing to read, in order to read `location`.
    ///
    /// # Errors
    /// It is not there, or the system refuses.
    pub fn start(program: &str, arguments: &[OsString], location: &Location) -> Outcome<Self> {
        Self::spawn(program, arguments, Stdio::null(), &format!("reading {}", location.shown()))
    }

    /// Starts one of them in order to do what `doing` says. Ctrl-C in a terminal goes to us alone, who then end it.
    ///
    /// # Errors
    /// It is not there, or the system refuses.
    pub fn spawn(program: &str, arguments: &[OsString], stdin: Stdio, doing: &str) -> Outcome<Self> {
        let mut command = Command::new(program);
        command.args(arguments).stdin(stdin).stdout(Stdio::piped()).stderr(Stdio::piped());
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        match command.spawn() {
            Ok(child) => Ok(Self(child)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Err(missing(program, doing)),
            Err(error) => Err(Failure::failed(format_args!("cannot start {program}: {}", reason(&error)))),
        }
    }
}

impl Process {
    /// How it ended, which it is about to: its output is over. None where it does not, and is killed.
    pub fn end(&mut self) -> Option<ExitStatus> {
        let mut status = None;
        until(|| {
            status = self.0.try_wait().ok().flatten();
            status.is_some()
        });
        status
    }
}

/// Waits a little for what should be so at once.
pub(crate) fn until(mut so: impl FnMut() -> bool) -> bool {
    let begin = Instant::now();
    while !so() {
        if begin.elapsed() > Duration::from_secs(2) {
            return false;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    true
}

impl Drop for Process {
    fn drop(&mut self) {
        // Both fail only where it has ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn missing(program: &str, doing: &str) -> Failure {
    Failure::failed(format_args!("{doing} needs the program {program}, which is not on the PATH")).hint(
        "install ffmpeg: apt-get install ffmpeg (Debian, Ubuntu), brew install ffmpeg (macOS), \
         winget install ffmpeg (Windows)",
    )
}

/// What a program prints, waited for.
///
/// # Errors
/// It could not be started, failed, or took longer than `limit`.
pub(super) fn output(
    program: &str,
    arguments: &[OsString],
    location: &Location,
    limit: Option<Duration>,
) -> Outcome<Vec<u8>> {
    let mut process = Process::start(program, arguments, location)?;
    let failed = |error: io::Error| Failure::failed(format_args!("cannot run {program}: {}", reason(&error)));
    let (Some(mut stdout), Some(stderr)) = (process.0.stdout.take(), process.0.stderr.take()) else {
        return Err(failed(io::Error::other("it has no output")));
    };
    let cleaner = location.clone();
    let (_, log) = log::listen(stderr, move |text| cleaner.without_secret(text)).map_err(failed)?;
    let (sender, printed) = sync_channel(1);
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        let read = stdout.read_to_end(&mut bytes).map(|_| bytes);
        let _ = sender.send(read);
    });
    match wait(&printed, &Switch::default(), limit) {
        Waited::Came(bytes) => {
            let bytes = bytes.map_err(failed)?;
            let status = process.0.wait().map_err(failed)?;
            let complaints = log.join().unwrap_or_default();
            if status.success() {
                return Ok(bytes);
            }
            // ffmpeg begins its last line with the name, which is said already.
            let why = complaints.reason().map_or_else(|| ended(program, status), |line| without_name(line, location));
            Err(Failure::failed(format_args!("cannot read {} as video: {why}", location.shown())))
        }
        Waited::Off => Err(Failure::Interrupted),
        Waited::TooLong => Err(Failure::failed(format_args!(
            "cannot read {}: nothing came for {} s",
            location.shown(),
            limit.unwrap_or_default().as_secs()
        ))),
        Waited::Ended => Err(failed(io::Error::other("its output ended early"))),
    }
}

fn without_name(line: &str, location: &Location) -> String {
    let shown = location.shown();
    let line = line.strip_prefix("file:").unwrap_or(line);
    line.strip_prefix(&*shown).and_then(|rest| rest.strip_prefix(": ")).unwrap_or(line).to_owned()
}

/// How a program ended.
pub(crate) fn ended(program: &str, status: ExitStatus) -> String {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        return format!("{program} was killed by signal {signal}");
    }
    match status.code() {
        Some(code) => format!("{program} ended with exit status {code}"),
        None => format!("{program} ended early"),
    }
}
