//! A look inside: every named stage of the last frame. Dumps, golden tests and Python inspection use this one door.

use std::fmt;
use std::str::FromStr;

use ndarray::Array3;

use crate::model::ApgStmd;

macro_rules! stages {
    ($( $(#[doc = $doc:literal])* $name:ident = $text:literal ),* $(,)?) => {
        /// A map inside the model, named as in the paper.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[allow(non_camel_case_types)]
        pub enum Stage { $( $(#[doc = $doc])* $name ),* }

        impl Stage {
            /// All stages in the order of the data flow.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// Name in files and in Python.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$name => $text),* }
            }
        }
    };
}

stages! {
    /// Retina output P.
    P = "P",
    /// T1 directional contrast C, 4 orientations.
    C = "C",
    /// Attention response A, times the faded region R.
    A = "A",
    /// Contrast-enhanced luminance P_e = P + alpha R A.
    Pe = "Pe",
    /// Lamina output L (LMC).
    L = "L",
    /// ON signal: the positive part of L.
    Tm3 = "Tm3",
    /// OFF signal: the negative part of L, as a positive number.
    Tm2 = "Tm2",
    /// Delayed ON signal.
    Mi1 = "Mi1",
    /// OFF signal, shorter delay.
    Tm1_4 = "Tm1_4",
    /// OFF signal, longer delay.
    Tm1_5 = "Tm1_5",
    /// Correlation D before inhibition, 8 directions.
    D = "D",
    /// STMD output E, 8 directions.
    E = "E",
    /// E near confirmed peaks, what prediction receives, 8 directions.
    Ep = "Ep",
    /// Predictive gain F, 8 directions.
    F = "F",
    /// Prediction map M.
    M = "M",
    /// Facilitated output Q, 8 directions.
    Q = "Q",
}

impl Stage {
    /// Maps in this stage: 8 directions, 4 orientations, or 1.
    pub const fn planes(self) -> usize {
        match self {
            Self::D | Self::E | Self::Ep | Self::F | Self::Q => 8,
            Self::C => 4,
            _ => 1,
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// There is no stage of this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no stage `{0}`: the stages are P, C, A, Pe, L, Tm3, Tm2, Mi1, Tm1_4, Tm1_5, D, E, Ep, F, M, Q")]
pub struct UnknownStage(pub String);

impl FromStr for Stage {
    type Err = UnknownStage;
    fn from_str(text: &str) -> Result<Self, UnknownStage> {
        Self::ALL.iter().copied().find(|stage| stage.name() == text).ok_or_else(|| UnknownStage(text.to_owned()))
    }
}

/// Read access to the stages of the last processed frame, from [`crate::Detector::probe`].
#[derive(Clone, Copy)]
pub struct Probe<'a> {
    model: &'a ApgStmd,
}

impl<'a> Probe<'a> {
    pub(crate) fn new(model: &'a ApgStmd) -> Self {
        Self { model }
    }

    /// A copy of the stage: ([`Stage::planes`], rows, columns). Before the first frame all are zero.
    pub fn stage(&self, stage: Stage) -> Array3<f32> {
        self.model.stage(stage)
    }
}
