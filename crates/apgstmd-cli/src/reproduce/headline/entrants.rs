//! Who takes part: every model with its own rejection, and with the common one.

use apgstmd_core::params::RejectionMode;
use apgstmd_core::{Model, Params, Preset};

use super::scenes::TUNED;
use crate::Outcome;
use crate::failure::Failure;

/// A model with its parameters.
pub struct Entrant {
    /// In tables and legends.
    pub name: &'static str,
    pub params: Params,
    /// Whether it has the common rejection, so that only the model differs.
    pub common: bool,
}

/// The subject: apg-STMD for use.
pub const SUBJECT: &str = "apg-STMD practical";
/// The same without attention and prediction.
pub const OWN_STAGE: &str = "apg-STMD, its STMD stage alone";

/// All of them, tuned to [`TUNED`]. The common rejection, with what it follows, is that of the practical preset.
pub fn entrants() -> Outcome<Vec<Entrant>> {
    let practical = Params::preset(Preset::Practical);
    let common = |mut params: Params| {
        params.rejection = practical.rejection.clone();
        params.detection = practical.detection.clone();
        params
    };
    let own = |model| Params::for_model(model);
    let without = |attention, prediction| {
        let mut params = practical.clone();
        params.attention.enabled &= attention;
        params.prediction.enabled &= prediction;
        params
    };
    let mut list = vec![
        (SUBJECT, practical.clone(), true),
        ("apg-STMD practical, prediction only", without(false, true), true),
        (OWN_STAGE, without(false, false), true),
        ("apg-STMD paper, motion", common(own(Model::ApgStmd)), true),
        ("apg-STMD paper", own(Model::ApgStmd), false),
    ];
    for (model, with_own, with_common) in [
        (Model::StmdPlus, "STMD+", "STMD+, motion"),
        (Model::Dstmd, "DSTMD", "DSTMD, motion"),
        (Model::Cascaded, "Cascaded", "Cascaded, motion"),
        (Model::Estmd, "ESTMD", "ESTMD, motion"),
    ] {
        list.push((with_common, common(own(model)), true));
        list.push((with_own, own(model), false));
    }
    list.into_iter()
        .map(|(name, params, common)| {
            debug_assert!(!common || params.rejection.mode == RejectionMode::Motion);
            Ok(Entrant { name, params: params.for_speed(TUNED).map_err(Failure::failed)?, common })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_there_once_and_the_common_rejection_is_common() {
        let entrants = entrants().unwrap();
        let names: std::collections::HashSet<_> = entrants.iter().map(|entrant| entrant.name).collect();
        assert_eq!(names.len(), entrants.len());
        assert!(names.contains(SUBJECT) && names.contains(OWN_STAGE));
        let first = &entrants[0].params;
        for entrant in entrants.iter().filter(|entrant| entrant.common) {
            assert_eq!((&entrant.params.rejection, &entrant.params.detection), (&first.rejection, &first.detection));
        }
    }
}
