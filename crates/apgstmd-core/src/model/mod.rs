//! Wiring of the models.

mod apg_stmd;
mod lag;

pub(crate) use apg_stmd::ApgStmd;
