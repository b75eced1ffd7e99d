//! The command line inside Python: as the console script, and as a function.

use std::ffi::OsString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread::Builder;
use std::time::Duration;

use apgstmd_cli::failure::Failure;
use apgstmd_cli::interrupt;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

use crate::errors::Error;

/// How long a Ctrl-C may wait before the program hears of it.
const LOOK: Duration = Duration::from_millis(50);
/// What a main thread has: the program was written for one.
const STACK: usize = 8 << 20;

/// What a Rust program that panics returns; the message has been printed by then.
const PANICKED: u8 = 101;

/// Runs the command line and returns its exit code. It owns the process: it prints, and listens for Ctrl-C itself.
#[pyfunction]
pub fn run_cli(py: Python<'_>, argv: Vec<OsString>) -> u8 {
    py.detach(|| catch_unwind(AssertUnwindSafe(|| apgstmd_cli::main_with(argv))).unwrap_or(PANICKED))
}

/// `apgstmd run` for a Python that goes on afterwards: failures are exceptions, Ctrl-C is Python's.
#[pyfunction]
pub fn run(py: Python<'_>, argv: Vec<OsString>) -> PyResult<()> {
    let outcome = attended(py, || apgstmd_cli::run_with(argv))?;
    outcome.map_err(|failure| match failure {
        Failure::Interrupted => PyKeyboardInterrupt::new_err(()),
        failure => Error::from(failure).into(),
    })
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
