//! The command line of apg-STMD as a library, so that the Python wheel runs the very same program.
//!
//! `main` is parse, resolve, run, exit code. Pictures come in through a [`source::FrameSource`], results leave through
//! [`sink::Sink`]s; the core knows neither.

pub mod args;
pub mod batch;
#[doc(hidden)]
pub mod boundary;
pub mod commands;
pub mod failure;
pub mod footage;
pub mod host;
pub mod interrupt;
pub mod itself;
pub mod judge;
pub mod plot;
pub mod report;
pub mod reproduce;
pub mod settings;
pub mod sink;
pub mod source;
mod text;

use std::ffi::OsString;

use clap::Parser;

use args::{Arguments, Command};
use failure::Failure;
use host::Host;

/// Runs the program with the given argument list (the program's name first), says what went wrong on stderr and returns
/// the exit code: 0 done, 1 failed, 2 wrong usage or parameters, 130 interrupted.
///
/// It owns the process while it runs: it writes to stdout and stderr, and listens for Ctrl-C unless
/// [`interrupt::leave_signals_to_the_caller`] was called.
pub fn main_with<I, T>(argv: I) -> u8
where
    I: IntoIterator<Item = T>,
    T: Into<OsString> + Clone,
{
    match Arguments::try_parse_from(argv) {
        Err(error) if failure::is_answer(&error) => failure::print_answer(&error),
        Err(error) => Failure::from(error).report(),
        Ok(arguments) => match execute(arguments, Host::default()) {
            Ok(()) => 0,
            Err(failure) => failure.report(),
        },
    }
}

/// As [`main_with`], but failures come back to the caller instead of going to stderr. `host` is for the command `run`.
///
/// # Errors
/// Whatever ends the command early.
pub fn run_with<I, T>(argv: I, host: Host) -> Outcome
where
    I: IntoIterator<Item = T>,
    T: Into<OsString> + Clone,
{
    match Arguments::try_parse_from(argv) {
        Err(error) if failure::is_answer(&error) => {
            failure::print_answer(&error);
            Ok(())
        }
        Err(error) => Err(error.into()),
        Ok(arguments) => execute(arguments, host),
    }
}

fn execute(arguments: Arguments, host: Host) -> Outcome {
    match arguments.command {
        Command::Run(args) => commands::run::main(args, host),
        Command::Batch(args) => commands::batch::main(&args),
        Command::Tune(args) => commands::tune::main(&args),
        Command::Demo(args) => commands::demo::main(args),
        Command::Params(args) => commands::params::main(&args),
        Command::Synth(args) => commands::synth::main(args),
        Command::Eval(args) => commands::eval::main(&args),
        Command::Reproduce(args) => commands::reproduce::main(args),
        Command::Bench(args) => commands::bench::main(*args),
    }
}

/// What a command returns.
pub type Outcome<T = ()> = Result<T, Failure>;
