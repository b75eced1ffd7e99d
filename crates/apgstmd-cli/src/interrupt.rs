//! Ctrl-C (and a polite kill): the frame in work is finished, files are closed, then the program ends with 130.

use std::sync::atomic::{AtomicBool, Ordering};

static STOP: AtomicBool = AtomicBool::new(false);

/// From here on the first signal only asks for the end, a second one ends the process at once.
pub fn listen() {
    STOP.store(false, Ordering::Relaxed);
    // Fails only where a handler is set already: then an earlier call of ours still listens.
    let _ = ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
}

/// Whether the user asked for the end.
pub fn asked() -> bool {
    STOP.load(Ordering::Relaxed)
}
