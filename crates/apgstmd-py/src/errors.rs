//! The one place where the core's errors become Python exceptions.

use apgstmd_cli::failure::Failure;
use apgstmd_core::{FrameError, MissingStage, ParamError, RegionError, StateError, UnknownModel, UnknownStage};
use pyo3::PyErr;
use pyo3::exceptions::{PyMemoryError, PyRuntimeError, PyTypeError, PyValueError};

pub enum Error {
    /// A value or a frame that cannot be used: ValueError.
    Value(String),
    /// An object of the wrong kind: TypeError.
    Type(String),
    /// There is not enough of it: MemoryError.
    Memory(String),
    /// The detector or the machine is in no state to go on: RuntimeError.
    State(String),
}

impl From<ParamError> for Error {
    fn from(error: ParamError) -> Self {
        match error {
            ParamError::ThreadStart { .. } => Self::State(error.to_string()),
            ParamError::Memory { .. } => Self::Memory(error.to_string()),
            _ => Self::Value(error.to_string()),
        }
    }
}

impl From<Failure> for Error {
    fn from(failure: Failure) -> Self {
        let message = failure.text().unwrap_or_default();
        match failure {
            Failure::Usage(_) => Self::Value(message),
            _ => Self::State(message),
        }
    }
}

impl From<FrameError> for Error {
    fn from(error: FrameError) -> Self {
        Self::Value(error.to_string())
    }
}

impl From<RegionError> for Error {
    fn from(error: RegionError) -> Self {
        Self::Value(error.to_string())
    }
}

impl From<StateError> for Error {
    fn from(error: StateError) -> Self {
        Self::Value(error.to_string())
    }
}

impl From<UnknownStage> for Error {
    fn from(error: UnknownStage) -> Self {
        Self::Value(error.to_string())
    }
}

impl From<MissingStage> for Error {
    fn from(error: MissingStage) -> Self {
        Self::Value(error.to_string())
    }
}

impl From<UnknownModel> for Error {
    fn from(error: UnknownModel) -> Self {
        Self::Value(error.to_string())
    }
}

impl From<Error> for PyErr {
    fn from(error: Error) -> Self {
        match error {
            Error::Value(message) => PyValueError::new_err(message),
            Error::Type(message) => PyTypeError::new_err(message),
            Error::Memory(message) => PyMemoryError::new_err(message),
            Error::State(message) => PyRuntimeError::new_err(message),
        }
    }
}
