//! `apgstmd params`: the full parameter file.

use std::io::{self, Write};
use std::path::Path;

use crate::Outcome;
use crate::args::ModelArgs;
use crate::failure::Failure;
use crate::settings::resolve_params;

pub(crate) fn main(args: &ModelArgs) -> Outcome {
    let text = resolve_params(args)?.to_toml();
    let mut stdout = io::stdout().lock();
    stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()).map_err(|e| Failure::write(Path::new("stdout"), e))
}
