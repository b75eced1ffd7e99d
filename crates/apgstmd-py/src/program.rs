//! The command line inside Python: as the console script, as a function, and as something to be looked at frame by frame.

use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use apgstmd_cli::failure::Failure;
use apgstmd_cli::host::Host;
use apgstmd_cli::source::{Frames, Switch, Timed};
use apgstmd_cli::{Outcome, interrupt};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyIterator;

use crate::arrays::Borrowed;
use crate::errors::Error;
use crate::seen::{Eye, Rows};

/// How long a Ctrl-C may wait before the program hears of it.
const LOOK: Duration = Duration::from_millis(50);
/// What a main thread has: the program was written for one.
const STACK: usize = 8 << 20;
/// Results that wait until they are looked at.
const WAITING: usize = 4;

/// What a Rust program that panics returns; the message has been printed by then.
const PANICKED: u8 = 101;

/// Runs the command line and returns its exit code. It owns the process: it prints, and listens for Ctrl-C itself.
#[pyfunction]
pub fn run_cli(py: Python<'_>, argv: Vec<OsString>) -> u8 {
    py.detach(|| catch_unwind(AssertUnwindSafe(|| apgstmd_cli::main_with(argv))).unwrap_or(PANICKED))
}

/// A command for a Python that goes on afterwards: failures are exceptions, Ctrl-C is Python's.
#[pyfunction]
#[pyo3(signature = (argv, frames=None, bit_depth=None))]
pub fn run(
    py: Python<'_>,
    argv: Vec<OsString>,
    frames: Option<Py<PyIterator>>,
    bit_depth: Option<u32>,
) -> PyResult<()> {
    let mut program = Program::start(argv, frames.map(|frames| (frames, bit_depth)), None)?;
    while program.next(py)?.is_some() {}
    Ok(())
}

/// The program that a batch starts for each video is this Python with this package. `-P` keeps it from looking for packages
/// in the current folder, which may hold anything.
pub fn say_who_we_are(py: Python<'_>) -> PyResult<()> {
    let executable: Option<OsString> = py.import("sys")?.getattr("executable")?.extract()?;
    let words =
        executable.filter(|path| !path.is_empty()).map(|path| [path, "-P".into(), "-m".into(), "apgstmd".into()]);
    apgstmd_cli::itself::is(words.map_or_else(Vec::new, Vec::from));
    Ok(())
}

/// Python notices signals only between its own steps: `work` has its own thread, this one looks for them meanwhile.
pub fn attended<T: Send + 'static>(py: Python<'_>, work: impl FnOnce() -> T + Send + 'static) -> PyResult<T> {
    interrupt::leave_signals_to_the_caller();
    let (done, mut result) = channel();
    Builder::new()
        .name("apgstmd".into())
        .stack_size(STACK)
        .spawn(move || done.send(catch_unwind(AssertUnwindSafe(work))))
        .map_err(|error| Error::State(format!("could not start a thread: {error}")))?;
    let mut asked_to_stop = None;
    loop {
        let news;
        (news, result) = py.detach(move || (result.recv_timeout(LOOK), result));
        match news {
            Ok(Ok(outcome)) => return asked_to_stop.map_or(Ok(outcome), Err),
            Ok(Err(_)) | Err(RecvTimeoutError::Disconnected) => {
                return Err(Error::State("apgstmd has a defect, please report it with the lines above".into()).into());
            }
            Err(RecvTimeoutError::Timeout) => {
                asked_to_stop = asked_to_stop.or(py.check_signals().err());
                if asked_to_stop.is_some() {
                    interrupt::ask();
                }
            }
        }
    }
}

/// What the thread of the program tells the caller's.
pub enum Event {
    /// A frame is wanted.
    Wanted,
    /// A frame is through.
    Seen(Box<Rows>),
    /// The program has ended; without an outcome it panicked.
    Done(Option<Outcome>),
}

/// How a run is looked at.
pub struct Watch {
    /// Whether it writes tables all the same.
    pub tables: bool,
}

type Answer = Result<Option<Timed>, String>;

/// A command at work in a thread of its own. Python notices signals only between its own steps, and what it iterates over
/// belongs to the thread that calls: so the caller's thread looks for signals, fetches frames and takes results meanwhile.
pub struct Program {
    events: Receiver<Event>,
    given: Option<Given>,
    /// What is raised in the end, whatever the program says.
    error: Option<PyErr>,
    thread: JoinHandle<()>,
}

struct Given {
    frames: Py<PyIterator>,
    bit_depth: Option<u32>,
    answers: Sender<Answer>,
}

impl Program {
    /// `frames` yields (array, seconds or None). Watched, every frame that is through comes out of `next`.
    pub fn start(
        argv: Vec<OsString>,
        frames: Option<(Py<PyIterator>, Option<u32>)>,
        watch: Option<Watch>,
    ) -> PyResult<Self> {
        interrupt::leave_signals_to_the_caller();
        let (sender, events) = sync_channel(WAITING);
        let mut host = Host::default();
        if let Some(Watch { tables }) = watch {
            host.without_tables = !tables;
            host.sink = Some(Box::new(Eye(sender.clone())));
        }
        let given = frames.map(|(frames, bit_depth)| {
            let (answers, taken) = channel();
            host.frames = Some(Box::new(Asked { wanted: sender.clone(), taken, switch: Switch::default() }));
            Given { frames, bit_depth, answers }
        });
        let work = move || {
            let outcome = catch_unwind(AssertUnwindSafe(|| apgstmd_cli::run_with(argv, host)));
            // Nobody listens any more where the caller had enough.
            let _ = sender.send(Event::Done(outcome.ok()));
        };
        let thread = Builder::new()
            .name("apgstmd".into())
            .stack_size(STACK)
            .spawn(work)
            .map_err(|error| Error::State(format!("could not start a thread: {error}")))?;
        Ok(Self { events, given, error: None, thread })
    }

    /// The next frame that is through; none at the end. After an error there is none.
    pub fn next(&mut self, py: Python<'_>) -> PyResult<Option<Box<Rows>>> {
        loop {
            let events = &mut self.events;
            match py.detach(move || events.recv_timeout(LOOK)) {
                Ok(Event::Wanted) => self.fetch(py),
                Ok(Event::Seen(rows)) if self.error.is_none() => return Ok(Some(rows)),
                Ok(Event::Seen(_)) => {}
                Ok(Event::Done(outcome)) => return self.end(outcome),
                Err(RecvTimeoutError::Disconnected) => return self.end(None),
                Err(RecvTimeoutError::Timeout) => {
                    if let Err(signal) = py.check_signals() {
                        self.stop(signal);
                    }
                }
            }
        }
    }

    /// Ends it where it is, after the frame in work; its files are complete up to there.
    pub fn close(self) {
        let Self { events, given, thread, .. } = self;
        drop((events, given));
        // It has caught its panics.
        let _ = thread.join();
    }

    fn stop(&mut self, signal: PyErr) {
        self.error.get_or_insert(signal);
        interrupt::ask();
    }

    fn fetch(&mut self, py: Python<'_>) {
        let Some(given) = &self.given else { return };
        let answer = match &self.error {
            None => given.next(py),
            Some(_) => Ok(None),
        };
        let told = match answer {
            Ok(frame) => Ok(frame),
            Err(signal) if signal.is_instance_of::<PyKeyboardInterrupt>(py) => {
                self.stop(signal);
                Ok(None)
            }
            Err(error) => {
                let reason = error.to_string();
                self.error = Some(error);
                Err(reason)
            }
        };
        if let Some(given) = &self.given {
            // It may have ended meanwhile.
            let _ = given.answers.send(told);
        }
    }

    fn end(&mut self, outcome: Option<Outcome>) -> PyResult<Option<Box<Rows>>> {
        if let Some(error) = self.error.take() {
            return Err(error);
        }
        match outcome {
            Some(Ok(())) => Ok(None),
            Some(Err(Failure::Interrupted)) => Err(PyKeyboardInterrupt::new_err(())),
            Some(Err(failure)) => Err(Error::from(failure).into()),
            None => Err(Error::State("apgstmd has a defect, please report it with the lines above".into()).into()),
        }
    }
}

impl Given {
    fn next(&self, py: Python<'_>) -> PyResult<Option<Timed>> {
        let Some(item) = self.frames.bind(py).clone().next() else { return Ok(None) };
        let (array, time): (Bound<'_, PyAny>, Option<f64>) = item?.extract()?;
        Ok(Some((Borrowed::new(&array, self.bit_depth)?.picture(), time)))
    }
}

/// The program's side of frames that the caller fetches.
struct Asked {
    wanted: SyncSender<Event>,
    taken: Receiver<Answer>,
    switch: Switch,
}

impl Frames for Asked {
    fn next(&mut self) -> Answer {
        if self.wanted.send(Event::Wanted).is_err() {
            return Ok(None);
        }
        while !self.switch.is_off() {
            match self.taken.recv_timeout(LOOK) {
                Ok(answer) => return answer,
                Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
        Ok(None)
    }

    fn switch(&self) -> Switch {
        self.switch.clone()
    }
}
