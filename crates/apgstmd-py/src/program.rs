//! The console script: the command line library, in a Python process that does nothing else.

use std::panic::{AssertUnwindSafe, catch_unwind};

use pyo3::prelude::*;

/// What a Rust program that panics returns; the message has been printed by then.
const PANICKED: u8 = 101;

/// Runs the command line and returns its exit code.
#[pyfunction]
pub fn run_cli(py: Python<'_>, argv: Vec<String>) -> u8 {
    py.detach(|| catch_unwind(AssertUnwindSafe(|| apgstmd_cli::main_with(argv))).unwrap_or(PANICKED))
}
