//! One file a command, and what they share.

pub mod demo;
pub mod params;
mod pipeline;
pub mod run;
mod verdict;
