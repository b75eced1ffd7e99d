//! apg-STMD: detection of tiny, low-contrast moving targets, after the insect visual system.
//!
//! Wang, Zhao, Wang, Hu, Peng, Yue: *Attention and Prediction Guided Motion Detection for Low-Contrast Small Moving
//! Targets*, IEEE Transactions on Cybernetics, 2022.
//!
//! ```text
//! frame -> retina -+- attention <------------------------- memorizer: M(t - dt)
//!                  |     +- lamina - medulla - lobula (8 directions)
//!                  +- contrast, background shift --+--------+
//!                                              rejection (traces)
//!                                                  +- prediction -> memorizer
//! ```
//!
//! What it finds in each frame becomes tracks in a [`Tracker`]. A [`Bank`] looks for targets of unknown speed and size.
//!
//! Start at [`Detector`]; [`Params`] holds every constant, [`Probe`] shows every inner map.
#![deny(missing_docs)]

pub mod alarms;
mod assignment;
mod bank;
mod detection;
mod detector;
mod direction;
mod error;
pub mod evaluation;
mod filter;
mod frame;
pub mod kernels;
mod memory;
mod model;
pub mod params;
mod plane;
mod probe;
mod region;
mod row;
mod scroll;
mod stage;
pub mod state;
pub mod stimulus;
mod tiles;
mod timing;
pub mod tracking;

pub use alarms::FalseAlarms;
pub use bank::{Bank, BankParams, Member, SCALES};
pub use detection::{Detection, EgoMotion, Response};
pub use detector::{Detector, LEAST_SIDE, MOST_PIXELS, MOST_THREADS};
pub use error::{FrameError, ParamError};
pub use frame::{Frame, Samples, Size};
pub use memory::Memory;
pub use params::{Model, Params, Preset, UnknownModel};
pub use probe::{MissingStage, Probe, Stage, UnknownStage};
pub use region::{Rectangle, Region, RegionError};
pub use row::machine::{Machine, SimdLevel, UnknownSimdLevel};
pub use state::{State, StateError};
pub use timing::Timing;
pub use tracking::Tracker;

/// Preferred directions of the lobula: k pi / 4, counter-clockwise on the screen.
pub const DIRECTIONS: usize = 8;
