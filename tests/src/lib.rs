//! The naive float64 model, golden data and what the suites in `tests/` share.

pub mod compare;
pub mod floors;
pub mod golden;
pub mod naive;
pub mod stimulus;
