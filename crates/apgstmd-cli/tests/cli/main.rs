//! The program as a user has it: one test program, which is built and linked once.

mod bad_input;
mod bank;
mod batch;
mod bench;
mod camera;
mod commands;
mod common;
mod evaluation;
mod faults;
mod formats;
mod hostile;
mod interrupt;
mod live;
mod output;
mod overlap;
mod pictures;
mod regions;
mod reproduce;
mod resume;
mod scenes;
mod thresholds;
mod tracks;
mod video;
