//! One file a command, and what they share.

pub mod demo;
pub mod eval;
pub mod params;
mod pipeline;
pub mod reproduce;
pub mod run;
pub mod synth;
mod verdict;
