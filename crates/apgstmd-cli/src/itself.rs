//! This program as a command, for those that start it again: a process a video.

use std::env;
use std::ffi::OsString;
use std::process::Command;
use std::sync::OnceLock;

use crate::Outcome;
use crate::failure::{Failure, reason};

static WORDS: OnceLock<Vec<OsString>> = OnceLock::new();

/// For a host in which this is a library (Python): the words that run the command line, without its arguments. Only the
/// first call counts.
pub fn is(words: Vec<OsString>) {
    let _ = WORDS.set(words);
}

/// The command line, ready for arguments.
pub(crate) fn command() -> Outcome<Command> {
    if let Some(words) = WORDS.get() {
        let (program, arguments) = words.split_first().ok_or_else(|| {
            Failure::failed(
                "this Python does not say where its interpreter is, so that none can be started for a video",
            )
            .hint("sys.executable must name it")
        })?;
        let mut command = Command::new(program);
        command.args(arguments);
        return Ok(command);
    }
    let program = env::current_exe()
        .map_err(|error| Failure::failed(format_args!("cannot find this program itself: {}", reason(&error))))?;
    Ok(Command::new(program))
}
