//! The machine.
pub(crate) mod workers;
