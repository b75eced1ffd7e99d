//! Wiring.
mod apg_stmd;
pub(crate) use apg_stmd::ApgStmd;
