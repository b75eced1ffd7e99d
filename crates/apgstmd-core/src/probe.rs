//! A look inside: every named stage of the last frame. Dumps, golden tests and Python inspection use this one door.

use std::fmt;
use std::str::FromStr;

use ndarray::Array3;

use crate::model::Wiring;
use crate::params::Model;
use crate::row::bands::Bands;
use crate::row::machine::SimdLevel;

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
    /// Lamina output after lateral inhibition, L1. What follows it reads L1 in place of L.
    L1 = "L1",
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
    /// ESTMD: ON signal after lateral inhibition.
    ON = "ON",
    /// ESTMD: OFF signal after lateral inhibition.
    OFF = "OFF",
    /// ESTMD: delayed OFF signal.
    OFFd = "OFFd",
    /// ESTMD output Y, without direction.
    Y = "Y",
    /// Cascaded: Y after its low-pass filter.
    Yd = "Yd",
    /// Correlation D before inhibition, 8 directions.
    D = "D",
    /// Output E of the STMD or, in Cascaded, of the motion detectors, 8 directions.
    E = "E",
    /// E near confirmed peaks, what prediction receives, 8 directions. Without prediction it is the response.
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
#[error("there is no stage `{0}`: the stages are {all}", all = names(Stage::ALL))]
pub struct UnknownStage(pub String);

impl FromStr for Stage {
    type Err = UnknownStage;
    fn from_str(text: &str) -> Result<Self, UnknownStage> {
        Self::ALL.iter().copied().find(|stage| stage.name() == text).ok_or_else(|| UnknownStage(text.to_owned()))
    }
}

/// The model has no stage of this name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the model {model} has no stage `{stage}`: its stages are {own}", own = names(model.stages()))]
pub struct MissingStage {
    /// The stage asked for.
    pub stage: Stage,
    /// The model asked.
    pub model: Model,
}

fn names(stages: &[Stage]) -> String {
    stages.iter().map(|stage| stage.name()).collect::<Vec<_>>().join(", ")
}

impl Model {
    /// The stages it has, in the order of the data flow.
    pub const fn stages(self) -> &'static [Stage] {
        use Stage::{A, C, D, E, Ep, F, L, L1, M, Mi1, OFF, OFFd, ON, P, Pe, Q, Tm1_4, Tm1_5, Tm2, Tm3, Y, Yd};
        match self {
            Self::ApgStmd => &[P, C, A, Pe, L, Tm3, Tm2, Mi1, Tm1_4, Tm1_5, D, E, Ep, F, M, Q],
            Self::StmdPlus => &[P, C, L, Tm3, Tm2, Mi1, Tm1_4, Tm1_5, D, E, Ep],
            Self::Dstmd => &[P, C, L, L1, Tm3, Tm2, Mi1, Tm1_4, Tm1_5, D, E, Ep],
            Self::Cascaded => &[P, C, L, L1, ON, OFF, OFFd, Y, Yd, E, Ep],
            Self::Estmd => &[P, C, L, L1, ON, OFF, OFFd, Y],
        }
    }
}

/// Read access to the stages of the last processed frame, from [`crate::Detector::probe`].
#[derive(Clone, Copy)]
pub struct Probe<'a> {
    model: Model,
    wiring: &'a dyn Wiring,
    simd: SimdLevel,
}

impl<'a> Probe<'a> {
    pub(crate) fn new(model: Model, wiring: &'a dyn Wiring, simd: SimdLevel) -> Self {
        Self { model, wiring, simd }
    }

    /// The stages there are: those of the model.
    pub fn stages(&self) -> &'static [Stage] {
        self.model.stages()
    }

    /// A copy of the stage: ([`Stage::planes`], rows, columns). Before the first frame all are zero.
    ///
    /// # Errors
    /// The model has no such stage.
    pub fn stage(&self, stage: Stage) -> Result<Array3<f32>, MissingStage> {
        self.wiring.stage(&Bands::new(1, self.simd, false), stage).ok_or(MissingStage { stage, model: self.model })
    }
}
