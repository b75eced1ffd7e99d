//! Mathematics: filters over time and space. Knows no neurons.

pub(crate) mod gamma;
pub(crate) mod kernel;
pub(crate) mod low_pass;
pub(crate) mod opponent;
pub(crate) mod patch;
pub(crate) mod peaks;
pub(crate) mod ring;
pub(crate) mod rolling;
pub(crate) mod temporal;
