//! Parameter files of a bank: those of its members in common, and the section `[bank]`.

use serde::{Deserialize, Serialize};

use super::params::{BankParams, Member};
use crate::error::ParamError;
use crate::params::Params;

const SECTION: &str = "bank";

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    /// Speed, px/frame, and scale of each.
    members: Vec<(f64, usize)>,
    contrast: f32,
    most: usize,
}

impl BankParams {
    /// Reads a parameter file with a section `[bank]`; none where it has no such section, and is one of a single detector.
    ///
    /// # Errors
    /// As [`Params::from_toml`]; members that cannot be.
    pub fn from_toml(text: &str) -> Result<Option<Self>, ParamError> {
        let mut table: toml::Table = toml::from_str(text).map_err(ParamError::toml)?;
        let Some(section) = table.remove(SECTION) else { return Ok(None) };
        let Section { members, contrast, most } = section
            .try_into()
            .map_err(|error: toml::de::Error| ParamError::Toml { message: format!("[bank]: {}", error.message()) })?;
        let members = members.into_iter().map(|(speed, scale)| Member { speed, scale }).collect();
        let bank = Self { base: Params::from_table(&table)?, members, contrast, most };
        bank.validate()?;
        Ok(Some(bank))
    }

    /// The full parameter file: that of the parameters in common, and the section `[bank]`.
    pub fn to_toml(&self) -> String {
        let members: Vec<String> =
            self.members.iter().map(|member| format!("[{:?}, {}]", member.speed, member.scale)).collect();
        format!(
            "{}\n# Several detectors: `apgstmd run --params` runs them all.\n[bank]\n\
             # Speed, px/frame, and scale of each: it sees the picture reduced by 1, 2, 4 or 8.\nmembers = [{}]\n\
             # Least equivalent contrast of a detection, 0 to 1.\ncontrast = {:?}\n\
             # Most detections in one frame, best first.\nmost = {}\n",
            self.base.to_toml(),
            members.join(", "),
            self.contrast,
            self.most
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn round_trip() {
        let mut bank = BankParams { contrast: 0.05, most: 7, ..BankParams::default() };
        bank.base.detection.least_score = 0.031_25;
        assert_eq!(BankParams::from_toml(&bank.to_toml()).unwrap(), Some(bank));
        assert_eq!(BankParams::from_toml(&Params::default().to_toml()).unwrap(), None);
    }

    #[test]
    fn wrong_ones_are_named() {
        for (text, said) in [
            ("[bank]\nmembers = [[1.0, 3]]\ncontrast = 0.1\nmost = 5", "bank.scale is 3"),
            ("[bank]\nmembers = [[1.0, 1]]\ncontrst = 0.1\nmost = 5", "contrst"),
            ("[bank]\nmembers = []\ncontrast = 0.1\nmost = 5", "bank.members is 0"),
            ("[bank]\nmost = 5", "members"),
            ("bank = 3", "[bank]"),
            ("[bank]\nmembers = [[1.0, 1]]\ncontrast = 0.1\nmost = 5\n[retina]\nsigma = -1.0", "retina.sigma"),
        ] {
            let error = BankParams::from_toml(text).unwrap_err().to_string();
            assert!(error.contains(said), "{text}: {error}");
        }
    }
}
