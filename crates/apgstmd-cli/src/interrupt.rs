//! Ctrl-C (and a polite kill): the frame in work is finished, files are closed, then the program ends with 130.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};

static STOP: AtomicBool = AtomicBool::new(false);
static SIGNALS_ARE_THE_CALLERS: AtomicBool = AtomicBool::new(false);

/// For a host with signal handling of its own (Python): no handler is installed, the host calls [`ask`].
pub fn leave_signals_to_the_caller() {
    SIGNALS_ARE_THE_CALLERS.store(true, Ordering::Relaxed);
}

/// Asks a running command to end after the frame in work.
pub fn ask() {
    STOP.store(true, Ordering::Relaxed);
}

/// From here on the first signal only asks for the end, a second one ends the process at once.
pub(crate) fn listen() {
    STOP.store(false, Ordering::Relaxed);
    if SIGNALS_ARE_THE_CALLERS.load(Ordering::Relaxed) {
        return;
    }
    // Fails only where a handler is set already: then an earlier call of ours still listens.
    let _ = ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
}

/// Ends this process with its standard input, which whoever started it holds open: a process that nobody waits for any
/// more computes nothing, however its parent died.
pub(crate) fn end_with_stdin() {
    std::thread::spawn(|| {
        let _ = io::copy(&mut io::stdin().lock(), &mut io::sink());
        std::process::exit(130);
    });
}

/// Whether the user asked for the end.
pub(crate) fn asked() -> bool {
    STOP.load(Ordering::Relaxed)
}
