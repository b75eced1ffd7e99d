//! The naive float64 model, golden data, what holds the boundaries and what the suites in `tests/` share.

pub mod boundary;
pub mod compare;
pub mod floors;
pub mod golden;
pub mod long;
pub mod naive;
pub mod outputs;
pub mod stimulus;
