//! What a detector remembers, to be kept and taken up again: by the same version of the program, for frames of the same
//! size, with the same parameters, it goes on to the bit as if it had never stopped.
//!
//! A state is a set of named arrays. As a file it is a safetensors file, with what it is of and a checksum in its
//! metadata. It holds what goes on from frame to frame, not the inner maps of the last frame.

mod file;
mod visit;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::frame::Size;

pub(crate) use visit::{Angles, Remember, Visit, is_count, remember};

/// Version of the names and meaning of the arrays.
pub const STATE_FORMAT: u32 = 1;

/// What a detector, a bank or a tracker remembers.
///
/// ```
/// use apgstmd_core::{Detector, Params, Size, State};
/// use ndarray::Array2;
///
/// let params = Params::default().for_speed(1.0)?;
/// let frame = |t: usize| Array2::from_shape_fn((32, 48), |(y, x)| ((7 * x + 3 * y + 5 * t) % 64) as u8);
/// let mut detector = Detector::new(Size::new(32, 48), &params)?;
/// for t in 0..10 {
///     detector.process(frame(t).view())?;
/// }
/// let file = detector.state().to_bytes();
///
/// let mut other = Detector::with_threads(Size::new(32, 48), &params, 1)?;
/// other.restore(&State::from_bytes(&file)?)?;
/// assert_eq!(detector.process(frame(10).view())?.map, other.process(frame(10).view())?.map);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    origin: Origin,
    arrays: BTreeMap<String, Array>,
}

/// What a state is of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// [`STATE_FORMAT`] of the program that made it.
    pub format: u32,
    /// Version of that program.
    pub version: String,
    /// `detector`, `bank`, `tracker` or `alarms`.
    pub of: String,
    /// Rows of a frame.
    pub height: usize,
    /// Columns of a frame.
    pub width: usize,
    /// The parameters, TOML.
    pub parameters: String,
}

impl Origin {
    /// Of what this program makes.
    pub fn here(of: &str, size: Size, parameters: String) -> Self {
        Self {
            format: STATE_FORMAT,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            of: of.to_owned(),
            height: size.height,
            width: size.width,
            parameters,
        }
    }

    /// Whether it is that of what is to take it up.
    ///
    /// # Errors
    /// Another version, kind, size, or other parameters: the first that differs is named.
    pub fn agrees(&self, expected: &Self) -> Result<(), StateError> {
        let told = |origin: &Self| format!("{} (state format {})", origin.version, origin.format);
        if (self.format, &self.version) != (expected.format, &expected.version) {
            return Err(StateError::Version { given: told(self), expected: told(expected) });
        }
        if self.of != expected.of {
            return Err(StateError::Kind { given: self.of.clone(), expected: expected.of.clone() });
        }
        let size = |origin: &Self| Size::new(origin.height, origin.width);
        if size(self) != size(expected) {
            return Err(StateError::Size { given: size(self), expected: size(expected) });
        }
        differ(&self.parameters, &expected.parameters)
    }
}

/// An array of a state, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// As many as the shape says.
    pub values: Values,
}

/// The values of an array.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "named for their types")]
pub enum Values {
    F32(Vec<f32>),
    F64(Vec<f64>),
    U8(Vec<u8>),
    U32(Vec<u32>),
    U64(Vec<u64>),
}

impl Values {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(values) => values.len(),
            Self::F64(values) => values.len(),
            Self::U8(values) => values.len(),
            Self::U32(values) => values.len(),
            Self::U64(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Name of their type.
    pub fn name(&self) -> &'static str {
        match self {
            Self::F32(_) => "f32",
            Self::F64(_) => "f64",
            Self::U8(_) => "u8",
            Self::U32(_) => "u32",
            Self::U64(_) => "u64",
        }
    }
}

/// A state that cannot be taken up. What should have taken it is as before.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum StateError {
    /// Not the bytes of a state.
    #[error("this is no state of apgstmd: {reason}")]
    File {
        /// What is wrong.
        reason: String,
    },
    /// Bytes have changed.
    #[error("the state is damaged: its checksum is {given}, but its content has {found}; take an older one")]
    Checksum {
        /// As it stands in the state.
        given: String,
        /// That of the arrays.
        found: String,
    },
    /// Made by another version.
    #[error(
        "the state is of apgstmd {given}, but this is {expected}: numbers may differ between versions; go on with \
         {given}, or begin anew"
    )]
    Version {
        /// Version and format that made it.
        given: String,
        /// Version and format that read it.
        expected: String,
    },
    /// Of something else.
    #[error("the state is of a {given}, but a {expected} was to take it up")]
    Kind {
        /// What it is of.
        given: String,
        /// What reads it.
        expected: String,
    },
    /// For other frames.
    #[error("the state is for frames of {given} (height x width), but this detector takes {expected}")]
    Size {
        /// Of the state.
        given: Size,
        /// Of the detector.
        expected: Size,
    },
    /// Other parameters.
    #[error(
        "the state was made with {name} = {given}, but here it is {expected}: make it with the parameters of the state"
    )]
    Parameter {
        /// Section and field.
        name: String,
        /// Of the state.
        given: String,
        /// Of the detector.
        expected: String,
    },
    /// An array is missing, unknown, of another type or shape, or holds what cannot be.
    #[error("array `{name}` of the state {problem}")]
    Array {
        /// Its name.
        name: String,
        /// What is wrong with it.
        problem: String,
    },
}

impl State {
    /// A state of these parts, to be checked when it is taken up.
    ///
    /// # Errors
    /// An array with other than as many values as its shape says.
    pub fn new(origin: Origin, arrays: BTreeMap<String, Array>) -> Result<Self, StateError> {
        for (name, array) in &arrays {
            let wanted = array.shape.iter().try_fold(1usize, |product, side| product.checked_mul(*side));
            if wanted != Some(array.values.len()) {
                let problem = format!("has {} values, but the shape {:?}", array.values.len(), array.shape);
                return Err(StateError::Array { name: name.clone(), problem });
            }
        }
        Ok(Self { origin, arrays })
    }

    /// What it is of.
    pub fn origin(&self) -> &Origin {
        &self.origin
    }

    /// Its arrays by name.
    pub fn arrays(&self) -> &BTreeMap<String, Array> {
        &self.arrays
    }

    /// All that `part` remembers.
    pub(crate) fn of(origin: Origin, part: &mut dyn Remember) -> Self {
        let mut arrays = BTreeMap::new();
        part.show(&mut Visit::save(&mut arrays)).expect("what is remembered can be saved");
        Self { origin, arrays }
    }

    /// Whether `part`, being of `expected`, could take it up.
    pub(crate) fn check(&self, expected: &Origin, part: &mut dyn Remember) -> Result<(), StateError> {
        self.origin.agrees(expected)?;
        let mut visit = Visit::check(&self.arrays);
        part.show(&mut visit)?;
        visit.end()
    }

    /// Puts it into `part`, which it was checked for.
    pub(crate) fn load(&self, part: &mut dyn Remember) {
        part.show(&mut Visit::load(&self.arrays)).expect("it was checked");
    }
}

/// An error that names the first parameter in which two files differ.
fn differ(given: &str, expected: &str) -> Result<(), StateError> {
    if given == expected {
        return Ok(());
    }
    let read = |text: &str| toml::from_str::<toml::Table>(text).map(toml::Value::Table).ok();
    let none = || ("the parameters".to_owned(), "others".to_owned(), "not these".to_owned());
    let (name, given, expected) = match (read(given), read(expected)) {
        (Some(given), Some(expected)) => first_difference("", &given, &expected).unwrap_or_else(none),
        _ => none(),
    };
    Err(StateError::Parameter { name, given, expected })
}

fn first_difference(name: &str, a: &toml::Value, b: &toml::Value) -> Option<(String, String, String)> {
    let (toml::Value::Table(a), toml::Value::Table(b)) = (a, b) else {
        return (a != b).then(|| (name.to_owned(), a.to_string(), b.to_string()));
    };
    let nothing = toml::Value::String("nothing".to_owned());
    a.keys().chain(b.keys()).find_map(|key| {
        let path = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
        first_difference(&path, a.get(key).unwrap_or(&nothing), b.get(key).unwrap_or(&nothing))
    })
}
