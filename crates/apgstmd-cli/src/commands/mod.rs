//! One file a command, and what they share.

pub mod batch;
pub mod bench;
pub mod demo;
pub mod eval;
mod page;
pub mod params;
mod pipeline;
pub mod reproduce;
pub mod run;
pub mod synth;
pub mod tune;
mod verdict;

use std::io::{self, Write};
use std::path::Path;

use crate::Outcome;
use crate::failure::Failure;

fn count(n: usize, thing: &str) -> String {
    format!("{n} {thing}{}", if n == 1 { "" } else { "s" })
}

/// Text to stdout, all of it or an error.
fn print(text: &str) -> Outcome {
    let mut stdout = io::stdout().lock();
    stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
        .map_err(|error| Failure::write(Path::new("stdout"), error))
}
