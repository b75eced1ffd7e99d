//! The command line of apg-STMD as a library, so that the Python wheel runs the very same program.
//!
//! `main` is parse, resolve, run, exit code. Pictures come in through a [`source::FrameSource`], results leave through
//! [`sink::Sink`]s; the core knows neither.

pub mod args;
pub mod commands;
pub mod failure;
pub mod interrupt;
pub mod settings;
pub mod sink;
pub mod source;

use std::ffi::OsString;

use clap::Parser;

use args::{Arguments, Command};
use failure::Failure;

/// Runs the program with the given argument list (the program's name first) and returns its exit code: 0 done, 1 failed,
/// 2 wrong usage or parameters, 130 interrupted.
///
/// It owns the process while it runs: it installs a Ctrl-C handler and writes to stdout and stderr.
pub fn main_with<I, T>(argv: I) -> u8
where
    I: IntoIterator<Item = T>,
    T: Into<OsString> + Clone,
{
    let arguments = match Arguments::try_parse_from(argv) {
        Ok(arguments) => arguments,
        Err(error) => return failure::report_usage(&error),
    };
    let outcome = match arguments.command {
        Command::Run(args) => commands::run::main(args),
        Command::Demo(args) => commands::demo::main(args),
        Command::Params(args) => commands::params::main(&args),
    };
    match outcome {
        Ok(()) => 0,
        Err(failure) => {
            failure.report();
            failure.exit_code()
        }
    }
}

/// What a command returns.
pub type Outcome<T = ()> = Result<T, Failure>;
