//! What can be wrong with a scene.

use thiserror::Error;

/// A scene that cannot be drawn.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A value breaks its rule.
    #[error("scene: {field} is {value}, but it {rule}")]
    OutOfRange {
        /// Where the value stands, e.g. `target[2].width`.
        field: String,
        /// The value given.
        value: String,
        /// The rule in words.
        rule: String,
    },
    /// The text is no valid scene file.
    #[error("{message}")]
    Toml {
        /// What is wrong, with line and column where the text has them.
        message: String,
    },
    /// The background is a panorama and no picture came with the scene, or the other way round.
    #[error("the background is {kind}, but {given}: {advice}")]
    Panorama {
        /// Kind of the background.
        kind: &'static str,
        /// What came with the scene.
        given: &'static str,
        /// What to do.
        advice: &'static str,
    },
}
