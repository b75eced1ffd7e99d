//! What ends a command early, and how the user hears of it: one line `error: ...`, at most one line `hint: ...`.

use std::fmt::Display;
use std::io;
use std::path::Path;

/// Why a command did not finish.
#[derive(Debug)]
pub enum Failure {
    /// Arguments or parameters that cannot be used. Exit code 2.
    Usage(Message),
    /// Anything else: files, pictures, the machine. Exit code 1.
    Failed(Message),
    /// The reader of our output went away. Silent, exit code 0: whoever closed the pipe had enough.
    ClosedPipe,
    /// The user stopped us; what was found until then is on disk. Exit code 130.
    Interrupted,
}

/// What was wrong, and if it is not plain from that, what to do.
#[derive(Debug)]
pub struct Message {
    what: String,
    hint: Option<String>,
}

impl Failure {
    /// Wrong arguments or parameters.
    pub fn usage(what: impl Display) -> Self {
        Self::Usage(Message { what: what.to_string(), hint: None })
    }

    /// Anything but wrong arguments.
    pub fn failed(what: impl Display) -> Self {
        Self::Failed(Message { what: what.to_string(), hint: None })
    }

    /// The file at `path` could not be written.
    pub fn write(path: &Path, error: impl Into<io::Error>) -> Self {
        let error = error.into();
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::ClosedPipe,
            _ => Self::failed(format_args!("cannot write {}: {}", path.display(), reason(&error))),
        }
    }

    /// The same with advice.
    #[must_use]
    pub fn hint(mut self, advice: impl Display) -> Self {
        if let Self::Usage(message) | Self::Failed(message) = &mut self {
            message.hint = Some(advice.to_string());
        }
        self
    }

    /// The same with advice, unless it has some.
    #[must_use]
    pub fn or_hint(self, advice: impl Display) -> Self {
        match &self {
            Self::Usage(Message { hint: None, .. }) | Self::Failed(Message { hint: None, .. }) => self.hint(advice),
            _ => self,
        }
    }

    /// What went wrong, in one line.
    pub fn text(&self) -> Option<String> {
        match self {
            Self::Usage(message) | Self::Failed(message) => Some(one_line(&message.what)),
            Self::ClosedPipe | Self::Interrupted => None,
        }
    }

    fn exit_code(&self) -> u8 {
        match self {
            Self::ClosedPipe => 0,
            Self::Failed(_) => 1,
            Self::Usage(_) => 2,
            Self::Interrupted => 130,
        }
    }

    /// Prints what is to be said and returns the exit code.
    pub(crate) fn report(&self) -> u8 {
        if let Self::Usage(message) | Self::Failed(message) = self {
            print_error(&message.what, message.hint.as_deref());
        }
        self.exit_code()
    }
}

/// What the system said, without Rust's `(os error 2)`.
pub fn reason(error: &io::Error) -> String {
    let text = error.to_string();
    match text.find(" (os error") {
        Some(end) => text[..end].to_lowercase(),
        None => text,
    }
}

/// TOML errors quote the line they mean; in one line of text only the place and the reason help.
pub(crate) fn without_snippet(error: &impl Display) -> String {
    let quoted =
        |line: &&str| line.trim_start().trim_start_matches(|c: char| c.is_ascii_digit()).trim().starts_with('|');
    error.to_string().lines().filter(|line| !quoted(line)).collect::<Vec<_>>().join(": ")
}

impl From<clap::Error> for Failure {
    /// clap's message in our form.
    fn from(error: clap::Error) -> Self {
        let text = error.render().to_string();
        let (what, rest) = text.split_once("\n\n").unwrap_or((&text, ""));
        let tip = rest.lines().find_map(|line| line.trim().strip_prefix("tip: "));
        let stray_file = error.kind() == clap::error::ErrorKind::UnknownArgument && !what.contains("'-");
        let hint = match tip {
            _ if stray_file => "one INPUT is taken: put a pattern in quotes, e.g. 'frames/*.png'",
            Some(tip) => tip,
            None => "see --help for what is expected",
        };
        Self::usage(what.trim_start_matches("error: ")).hint(hint)
    }
}

/// Whether clap's "error" is the answer to --help or --version.
pub(crate) fn is_answer(error: &clap::Error) -> bool {
    use clap::error::ErrorKind::{DisplayHelp, DisplayHelpOnMissingArgumentOrSubcommand, DisplayVersion};
    matches!(error.kind(), DisplayHelp | DisplayVersion | DisplayHelpOnMissingArgumentOrSubcommand)
}

pub(crate) fn print_answer(error: &clap::Error) -> u8 {
    // A closed pipe is the only thing that can go wrong here, and nobody is left to be told.
    let _ = error.print();
    u8::try_from(error.exit_code()).unwrap_or(2)
}

fn print_error(what: &str, hint: Option<&str>) {
    use std::io::Write;
    // A closed stderr leaves only the exit code to speak.
    let mut stderr = io::stderr().lock();
    let _ = writeln!(stderr, "error: {}", one_line(what));
    if let Some(hint) = hint {
        let _ = writeln!(stderr, "hint: {}", one_line(hint));
    }
}

fn one_line(text: &str) -> String {
    text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_one_line() {
        assert_eq!(one_line("a\n  b\n\nc"), "a b c");
    }

    #[test]
    fn a_closed_pipe_is_no_error() {
        let failure = Failure::write(Path::new("-"), io::Error::from(io::ErrorKind::BrokenPipe));
        assert!(matches!(failure, Failure::ClosedPipe));
        assert_eq!(failure.exit_code(), 0);
    }
}
