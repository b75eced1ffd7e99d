//! `apgstmd demo`.

use crate::Outcome;
use crate::args::DemoArgs;
use crate::failure::Failure;

pub(crate) fn main(_args: DemoArgs) -> Outcome {
    Err(Failure::failed("not yet"))
}
