//! Parameter files: TOML in, commented TOML out.

use super::{Model, Params};
use crate::error::ParamError;

/// The one key that stands in no section.
const MODEL: &str = "model";

fn only_model(table: &toml::Table) -> toml::Table {
    table.iter().filter(|(key, _)| *key == MODEL).map(|(key, value)| (key.clone(), value.clone())).collect()
}

impl Params {
    /// Reads a parameter file. What it leaves out is as [`Params::for_model`] has it for the `model` it names, which is
    /// apg-STMD where it names none.
    ///
    /// # Errors
    /// Unknown keys, wrong types (both with line and column) and values out of range.
    pub fn from_toml(text: &str) -> Result<Self, ParamError> {
        let Self { model, .. } = toml::from_str(text).map_err(ParamError::toml)?;
        Self::for_model(model).with_table(&toml::from_str(text).map_err(ParamError::toml)?)
    }

    /// As [`Params::from_toml`], from a table that was read elsewhere.
    ///
    /// # Errors
    /// As `with_table`.
    pub fn from_table(table: &toml::Table) -> Result<Self, ParamError> {
        let model = Self::default().with_table(&only_model(table))?.model;
        Self::for_model(model).with_table(table)
    }

    /// Replaces the values that `table` (section -> field -> value, and `model`) names.
    ///
    /// # Errors
    /// Unknown sections or fields, wrong types, values out of range.
    pub fn with_table(&self, table: &toml::Table) -> Result<Self, ParamError> {
        let mut all = toml::Table::try_from(self).expect("parameters are plain tables");
        for (section, fields) in table {
            match (all.get_mut(section), fields) {
                (Some(toml::Value::Table(into)), toml::Value::Table(fields)) => into.extend(fields.clone()),
                (Some(model), fields) if section == MODEL => *model = fields.clone(),
                _ => {
                    let message = format!("there is no section `{section}` of parameters");
                    return Err(ParamError::Toml { message });
                }
            }
        }
        let params: Self = all.try_into().map_err(ParamError::toml)?;
        params.validate()?;
        Ok(params)
    }

    /// The full parameter file, every value preceded by what it means and what it may be.
    pub fn to_toml(&self) -> String {
        let all = toml::Table::try_from(self).expect("parameters are plain tables");
        let mut text =
            String::from("# apg-STMD parameters. Lengths in pixels, times in frames, luminance in [0, 1].\n\n");
        text += "# The model. Parameters of stages that it has not are ignored; \"(name)\" marks those of one model only.\n";
        let names: Vec<_> = Model::ALL.iter().map(|model| format!("\"{model}\"")).collect();
        text += &format!("# It must be one of {}.\nmodel = \"{}\"\n", names.join(", "), self.model);
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
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn file_round_trip() {
        let presets = [Preset::Paper, Preset::Practical].map(Params::preset);
        let models = Model::ALL.iter().map(|model| Params::for_model(*model));
        for params in presets.into_iter().chain(models) {
            for speed in [0.25, 0.9, 8.0] {
                let params = params.for_speed(speed).unwrap();
                let text = params.to_toml();
                assert_eq!(Params::from_toml(&text).unwrap(), params);
                assert_eq!(Params::from_table(&toml::from_str(&text).unwrap()).unwrap(), params);
            }
        }
    }

    #[test]
    fn what_a_file_leaves_out_is_as_its_model_has_it() {
        for &model in Model::ALL {
            let text = format!("model = \"{model}\"\n[retina]\nsigma = 2.0\n");
            let mut expected = Params::for_model(model);
            expected.retina.sigma = 2.0;
            assert_eq!(Params::from_toml(&text).unwrap(), expected);
            assert_eq!(Params::from_table(&toml::from_str(&text).unwrap()).unwrap(), expected);
        }
        let error = Params::from_toml("model = \"stmd\"\n").unwrap_err().to_string();
        assert!(error.contains("line 1") && error.contains("stmd-plus"), "{error}");
        assert!(Params::from_table(&toml::from_str("model = 3").unwrap()).is_err());
    }

    #[test]
    fn every_field_is_documented_in_the_file() {
        let all = toml::Table::try_from(Params::default()).unwrap();
        // All but `model`, which is documented as a whole.
        let count: usize = all.values().filter_map(|section| Some(section.as_table()?.len())).sum();
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
