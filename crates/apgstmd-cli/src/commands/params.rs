//! `apgstmd params`: the full parameter file.

use super::print;
use crate::Outcome;
use crate::args::ModelArgs;
use crate::settings::resolve_params;

pub(crate) fn main(args: &ModelArgs) -> Outcome {
    print(&resolve_params(args)?.to_toml())
}
