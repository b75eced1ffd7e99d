//! One declaration per parameter: the macro makes the struct, its documentation, its default, its range check and
//! the table that the commented parameter file and the Python keywords are made from.

use std::fmt::Display;

use crate::error::ParamError;

/// What is known about one parameter besides its value.
#[derive(Clone, Copy, Debug)]
pub struct FieldInfo {
    /// TOML table the field stands in, e.g. `attention`.
    pub section: &'static str,
    /// Field name inside its table, e.g. `alpha`.
    pub name: &'static str,
    /// Documentation lines.
    pub doc: &'static [&'static str],
    /// What values are allowed, in words.
    pub rule: fn() -> String,
}

/// A range check that can say in words what it wants.
pub(super) trait Rule<T> {
    fn holds(&self, value: &T) -> bool;
    fn text(&self) -> String;
}

pub(super) struct Between<T>(pub T, pub T);

impl<T: PartialOrd + Display> Rule<T> for Between<T> {
    fn holds(&self, value: &T) -> bool {
        *value >= self.0 && *value <= self.1
    }
    fn text(&self) -> String {
        format!("must lie between {} and {}", self.0, self.1)
    }
}

/// A list of 1 to `most` numbers, each between the bounds.
pub(super) struct EachBetween {
    pub low: f64,
    pub high: f64,
    pub most: usize,
}

impl Rule<Vec<f64>> for EachBetween {
    fn holds(&self, value: &Vec<f64>) -> bool {
        !value.is_empty() && value.len() <= self.most && value.iter().all(|v| *v >= self.low && *v <= self.high)
    }
    fn text(&self) -> String {
        format!("must be a list of 1 to {} numbers, each between {} and {}", self.most, self.low, self.high)
    }
}

/// For types that have no wrong value.
pub(super) struct Any(pub &'static str);

impl<T> Rule<T> for Any {
    fn holds(&self, _: &T) -> bool {
        true
    }
    fn text(&self) -> String {
        format!("must be {}", self.0)
    }
}

pub(super) fn check<T: std::fmt::Debug>(
    section: &'static str,
    name: &'static str,
    value: &T,
    rule: &impl Rule<T>,
) -> Result<(), ParamError> {
    if rule.holds(value) {
        Ok(())
    } else {
        Err(ParamError::OutOfRange { section, name, value: format!("{value:?}"), rule: <_ as Rule<T>>::text(rule) })
    }
}

macro_rules! stage_params {
    (
        $(#[doc = $sdoc:literal])*
        $struct:ident in $section:literal {
            $( $(#[doc = $doc:literal])* $field:ident: $ty:ty = $default:expr, $rule:expr; )*
        }
    ) => {
        $(#[doc = $sdoc])*
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct $struct { $( $(#[doc = $doc])* pub $field: $ty, )* }

        impl Default for $struct {
            fn default() -> Self { Self { $( $field: $default, )* } }
        }

        impl $struct {
            /// The parameters of this stage, in order.
            pub const FIELDS: &'static [FieldInfo] = &[ $( FieldInfo {
                section: $section,
                name: stringify!($field),
                doc: &[$($doc),*],
                rule: || Rule::<$ty>::text(&$rule),
            }, )* ];

            pub(super) fn check_ranges(&self) -> Result<(), ParamError> {
                $( check($section, stringify!($field), &self.$field, &$rule)?; )*
                Ok(())
            }
        }
    };
}
pub(super) use stage_params;
