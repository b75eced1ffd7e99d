//! Which model is computed, and the constants that each one has of its own.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::{Params, Preset, RejectionMode};

/// A model of small-target motion detection in insects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// Attention and prediction around an STMD: Wang et al. 2022. The subject of this program.
    #[default]
    ApgStmd,
    /// STMD with rejection by directional contrast, without attention and prediction: Wang et al. 2019.
    StmdPlus,
    /// Directional STMD behind lateral inhibition in the lamina: Wang et al. 2018.
    Dstmd,
    /// Elementary motion detectors over ESTMDs: Wiederman & O'Carroll 2013.
    Cascaded,
    /// Elementary STMD, without direction: Wiederman et al. 2008.
    Estmd,
}

impl Model {
    /// All models, the subject first, then from the nearest to the farthest relative.
    pub const ALL: &'static [Self] = &[Self::ApgStmd, Self::StmdPlus, Self::Dstmd, Self::Cascaded, Self::Estmd];

    /// Name in parameter files, on the command line and in Python.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ApgStmd => "apg-stmd",
            Self::StmdPlus => "stmd-plus",
            Self::Dstmd => "dstmd",
            Self::Cascaded => "cascaded",
            Self::Estmd => "estmd",
        }
    }

    /// Whether its response has directions. Without, every direction is NaN and `localise = target` moves nothing.
    pub const fn is_directional(self) -> bool {
        !matches!(self, Self::Estmd)
    }
}

impl fmt::Display for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// There is no model of this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no model `{0}`: the models are apg-stmd, stmd-plus, dstmd, cascaded, estmd")]
pub struct UnknownModel(pub String);

impl FromStr for Model {
    type Err = UnknownModel;
    fn from_str(text: &str) -> Result<Self, UnknownModel> {
        Self::ALL.iter().copied().find(|model| model.name() == text).ok_or_else(|| UnknownModel(text.to_owned()))
    }
}

impl Params {
    /// A model as it was published: its own lateral inhibition, and its own rejection, which only apg-STMD and STMD+
    /// have (`contrast`). Any other `rejection.mode` can be chosen. Attention and prediction are switched off in the
    /// models that have none; what is set there is ignored, but for `prediction.v_opt`, which tells every model's speed.
    ///
    /// ```
    /// use apgstmd_core::{Model, Params};
    /// let params = Params::for_model(Model::Dstmd).for_speed(1.0)?;
    /// assert_eq!((params.lobula.inhibition, params.lamina_inhibition.excitation_tau), (3.0, 0.75));
    /// # Ok::<(), apgstmd_core::ParamError>(())
    /// ```
    pub fn for_model(model: Model) -> Self {
        let mut params = Self { model, ..Self::default() };
        if model != Model::ApgStmd {
            params.attention.enabled = false;
            params.prediction.enabled = false;
            let lobula = &mut params.lobula;
            (lobula.excitation, lobula.inhibition, lobula.surround_weight) = (1.0, 3.0, 1.0);
            (lobula.center_sigma, lobula.surround_sigma) = (1.5, 3.0);
        }
        if model == Model::Cascaded {
            // Homogeneous of degree 4 in contrast: 4e-7 for a black target on white, 4e-11 for one of a tenth of that.
            params.lobula.response_floor = 1e-18;
        }
        if !matches!(model, Model::ApgStmd | Model::StmdPlus) {
            params.rejection.mode = RejectionMode::Off;
        }
        params
    }

    /// Where to start when nothing but a model is asked for: apg-STMD for use (`Practical`), the others, which are there
    /// to compare with, as published.
    pub fn usual(model: Model) -> Self {
        let preset = if model == Model::ApgStmd { Preset::Practical } else { Preset::Paper };
        Self::for_model(model).with_preset(preset)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_files() {
        for &model in Model::ALL {
            assert_eq!(model.name().parse(), Ok(model));
            assert!(Params::for_model(model).to_toml().contains(&format!("\nmodel = \"{model}\"\n")));
        }
        assert!("stmd+".parse::<Model>().unwrap_err().to_string().contains("stmd-plus"));
    }

    #[test]
    fn preferred_size() {
        // sigma 1.25 and 2.5, weight 1.2: 2 sqrt(ln(4 / 1.2) / 0.24) = 4.48; sigma 1.5 and 3: 2 sqrt(ln 4 * 6) = 5.77.
        assert_eq!(Params::for_model(Model::ApgStmd).target_size(), 5.0);
        assert_eq!(Params::for_model(Model::Dstmd).target_size(), 6.0);
        let mut none = Params::default();
        none.lobula.surround_weight = 10.0;
        assert_eq!(none.target_size(), 1.0);
    }

    #[test]
    fn every_time_constant_scales() {
        let params = Params::for_model(Model::Cascaded).for_speed(0.5).unwrap();
        let inhibition = &params.lamina_inhibition;
        assert_eq!((inhibition.excitation_tau, inhibition.inhibition_tau), (1.5, 4.5));
        assert_eq!((params.estmd.off_tau, params.emd.tau), (12.5, 6.0));
        assert_eq!((params.emd.spacing, params.estmd.off_order), (3.0, 12));
    }
}
