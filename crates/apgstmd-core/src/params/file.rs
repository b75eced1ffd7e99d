//! Parameter files: TOML in, commented TOML out.

use super::Params;
use crate::error::ParamError;

impl Params {
    /// Reads a parameter file. What it leaves out keeps its default (the paper).
    ///
    /// # Errors
    /// Unknown keys, wrong types (both with line and column) and values out of range.
    pub fn from_toml(text: &str) -> Result<Self, ParamError> {
        let params: Self = toml::from_str(text).map_err(ParamError::toml)?;
        params.validate()?;
        Ok(params)
    }

    /// Replaces the values that `table` (section -> field -> value) names.
    ///
    /// # Errors
    /// Unknown sections or fields, wrong types, values out of range.
    pub fn with_table(&self, table: &toml::Table) -> Result<Self, ParamError> {
        let mut all = toml::Table::try_from(self).expect("parameters are plain tables");
        for (section, fields) in table {
            let (Some(toml::Value::Table(into)), toml::Value::Table(fields)) = (all.get_mut(section), fields) else {
                return Err(ParamError::Toml { message: format!("there is no section `{section}` of parameters") });
            };
            into.extend(fields.clone());
        }
        let params: Self = all.try_into().map_err(ParamError::toml)?;
        params.validate()?;
        Ok(params)
    }

    /// The full parameter file, every value preceded by what it means and what it may be.
    pub fn to_toml(&self) -> String {
        let all = toml::Table::try_from(self).expect("parameters are plain tables");
        let mut text =
            String::from("# apg-STMD parameters. Lengths in pixels, times in frames, luminance in [0, 1].\n");
        let mut section = "";
        for field in Self::fields() {
            if field.section != section {
                section = field.section;
                text += &format!("\n[{section}]\n");
            }
            for line in field.doc {
                text += &format!("#{line}\n");
            }
            text += &format!("# It {}.\n{} = {}\n", (field.rule)(), field.name, all[section][field.name]);
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::Preset;

    #[test]
    fn file_round_trip() {
        for preset in [Preset::Paper, Preset::Practical] {
            for speed in [0.25, 0.9, 8.0] {
                let params = Params::preset(preset).for_speed(speed).unwrap();
                assert_eq!(Params::from_toml(&params.to_toml()).unwrap(), params);
            }
        }
    }

    #[test]
    fn every_field_is_documented_in_the_file() {
        let all = toml::Table::try_from(Params::default()).unwrap();
        let count: usize = all.values().map(|section| section.as_table().unwrap().len()).sum();
        assert_eq!(Params::fields().count(), count);
        assert!(Params::fields().all(|field| !field.doc.is_empty()));
    }

    #[test]
    fn unknown_key_names_line_and_column() {
        let error = Params::from_toml("[retina]\nsigma = 1.0\n[attention]\nalpa = 2.0\n").unwrap_err().to_string();
        assert!(error.contains("line 4, column 1") && error.contains("alpa") && error.contains("alpha"), "{error}");
    }

    #[test]
    fn out_of_range_names_field_value_and_rule() {
        let error = Params::from_toml("[retina]\nsigma = -1.0\n").unwrap_err().to_string();
        assert_eq!(error, "retina.sigma is -1.0, but it must lie between 0.1 and 8");
        for text in ["[retina]\nsigma = nan", "[attention]\nscales = []", "[lamina]\nfast_order = 0"] {
            assert!(Params::from_toml(text).is_err(), "{text}");
        }
    }

    #[test]
    fn with_table_keeps_the_rest() {
        let base = Params::preset(Preset::Practical);
        let params = base.with_table(&toml::from_str("[attention]\nalpha = 0.5").unwrap()).unwrap();
        assert_eq!(params.attention.alpha, 0.5);
        assert_eq!(params.attention.ramp, base.attention.ramp);
        assert!(base.with_table(&toml::from_str("[attention]\nalpa = 0.5").unwrap()).is_err());
        assert!(base.with_table(&toml::from_str("[atention]\nalpha = 0.5").unwrap()).is_err());
    }
}
