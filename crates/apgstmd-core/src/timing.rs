//! Where the time of a frame goes, stage by stage.

use std::time::{Duration, Instant};

macro_rules! parts {
    ($($part:ident = $name:literal),* $(,)?) => {
        #[derive(Clone, Copy)]
        pub(crate) enum Part { $($part),* }

        impl Timing {
            /// The parts of a time step in the order in which they run.
            pub const PARTS: &'static [&'static str] = &[$($name),*];
        }
    };
}

parts! {
    Retina = "retina",
    Attention = "attention",
    Lamina = "lamina",
    Medulla = "medulla",
    Lobula = "lobula",
    Rejection = "rejection",
    Prediction = "prediction",
    Facilitation = "facilitation",
}

/// Time spent in each part of the model, summed over the frames given to [`crate::Detector::process_timed`].
#[derive(Clone, Debug, Default)]
pub struct Timing {
    spent: [Duration; Timing::PARTS.len()],
    tiles: u64,
}

impl Timing {
    /// Name and time of each part.
    pub fn parts(&self) -> impl Iterator<Item = (&'static str, Duration)> {
        Self::PARTS.iter().copied().zip(self.spent)
    }

    /// Time of one part; zero for a name that is none of [`Timing::PARTS`].
    pub fn of(&self, part: &str) -> Duration {
        self.parts().find(|(name, _)| *name == part).map_or(Duration::ZERO, |(_, spent)| spent)
    }

    /// Tiles in which prediction was computed, summed over the frames.
    pub fn predicted_tiles(&self) -> u64 {
        self.tiles
    }
}

/// A stopwatch, or nothing.
pub(crate) struct Clock<'a>(Option<(&'a mut Timing, Instant)>);

impl<'a> Clock<'a> {
    pub fn start(timing: Option<&'a mut Timing>) -> Self {
        Self(timing.map(|timing| (timing, Instant::now())))
    }

    /// The time since the last lap went into `part`.
    pub fn lap(&mut self, part: Part) {
        if let Some((timing, since)) = &mut self.0 {
            let now = Instant::now();
            timing.spent[part as usize] += now - *since;
            *since = now;
        }
    }

    pub fn count_tiles(&mut self, tiles: usize) {
        if let Some((timing, _)) = &mut self.0 {
            timing.tiles += tiles as u64;
        }
    }
}
