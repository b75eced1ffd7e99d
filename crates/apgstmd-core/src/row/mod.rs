//! The machine: threads over bands of rows, instruction sets inside a row. Knows nothing of filters or neurons.

pub(crate) mod bands;
pub(crate) mod convolve;
pub(crate) mod lateral;
mod load_store;
pub(crate) mod machine;
pub(crate) mod mix;
pub(crate) mod opponent;
pub(crate) mod recurse;
pub(crate) mod speckle;
pub(crate) mod tile;
pub(crate) mod warp;
pub(crate) mod workers;
