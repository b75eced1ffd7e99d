//! What a caller can get wrong, one enum an activity. Each message says what was given, what was expected, what to do.

use thiserror::Error;

use crate::frame::Size;

fn what_there_is(available: Option<u64>) -> String {
    let left = |bytes| format!("but {bytes} are left of what the machine, container or service may have");
    available.map_or("which the system does not give".to_owned(), left)
}

/// A parameter that cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ParamError {
    /// A value breaks its rule.
    #[error("{section}.{name} is {value}, but it {rule}")]
    OutOfRange {
        /// Section of the parameter file.
        section: &'static str,
        /// Field in that section.
        name: &'static str,
        /// The value given.
        value: String,
        /// The rule in words.
        rule: String,
    },
    /// A speed outside the range the model can be scaled to.
    #[error("speed {speed} px/frame is out of range: it must lie between {low} and {high}")]
    Speed {
        /// The speed given, px/frame.
        speed: f64,
        /// Lowest accepted.
        low: f64,
        /// Highest accepted.
        high: f64,
    },
    /// The text is no valid parameter file.
    #[error("{message}")]
    Toml {
        /// What is wrong, with line and column where the text has them.
        message: String,
    },
    /// Frames too small for the model.
    #[error("frames of {size} (height x width) are too small: the model needs at least {least} x {least} pixels")]
    TooSmall {
        /// The size given.
        size: Size,
        /// Fewest rows and columns.
        least: usize,
    },
    /// Frames too large to address.
    #[error("frames of {size} (height x width) are too large: at most {most} pixels can be processed")]
    TooLarge {
        /// The size given.
        size: Size,
        /// Most pixels.
        most: usize,
    },
    /// More memory than there is.
    #[error(
        "frames of {size} (height x width) need {bytes} bytes of memory, {}: smaller frames or fewer detectors need less",
        what_there_is(*.available)
    )]
    Memory {
        /// The size given.
        size: Size,
        /// What it would have taken: at least, where it is known what is left; else at most.
        bytes: usize,
        /// What the machine, the container or the service has left, where that is less.
        available: Option<u64>,
    },
    /// A thread count that makes no sense.
    #[error("{threads} threads were asked for, but it must be between 1 and {most}")]
    Threads {
        /// The number given.
        threads: usize,
        /// Most threads accepted.
        most: usize,
    },
    /// The operating system refused to start the threads.
    #[error("could not start {threads} threads: {reason}")]
    ThreadStart {
        /// The number asked for.
        threads: usize,
        /// What the system said.
        reason: String,
    },
}

impl ParamError {
    pub(crate) fn toml(error: toml::de::Error) -> Self {
        Self::Toml { message: error.to_string().trim_end().to_owned() }
    }
}

/// A frame that cannot be processed. The detector is unchanged after it.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The frame has another size than the detector.
    #[error("the frame is {given} (height x width), but this detector was made for {expected}")]
    Size {
        /// Size of the frame.
        given: Size,
        /// Size of the detector.
        expected: Size,
    },
    /// Neither grey nor RGB nor RGBA.
    #[error("the frame has {channels} channels, but 1 (grey), 3 (RGB) or 4 (RGBA) are expected")]
    Channels {
        /// Number of channels given.
        channels: usize,
    },
    /// NaN or infinity.
    #[error("the luminance at column {x}, row {y} is {value}: every pixel must be a finite number in [0, 1]")]
    NotFinite {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// The value found.
        value: f64,
    },
    /// A float outside [0, 1].
    #[error(
        "the luminance at column {x}, row {y} is {value}, outside [0, 1]: divide the frame by its full scale first"
    )]
    OutOfRange {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// The value found.
        value: f64,
    },
    /// An integer above the declared full scale.
    #[error(
        "the sample at column {x}, row {y} is {value}, above the declared full scale of {full_scale}: declare more bits"
    )]
    AboveFullScale {
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// The value found.
        value: f64,
        /// The full scale declared.
        full_scale: f64,
    },
    /// The output was made for another size.
    #[error(
        "the output is {given} (height x width), but this detector writes {expected}: make it with make_response()"
    )]
    Output {
        /// Size of the output.
        given: Size,
        /// Size of the detector.
        expected: Size,
    },
}
