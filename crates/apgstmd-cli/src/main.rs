use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(apgstmd_cli::main_with(std::env::args_os()))
}
