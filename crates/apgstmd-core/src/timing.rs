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
    tiles: [u64; Timing::PARTS.len()],
    total_tiles: u64,
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

    /// Tiles of 16 x 16 px in which attention was computed, summed over the frames.
    pub fn attended_tiles(&self) -> u64 {
        self.tiles[Part::Attention as usize]
    }

    /// Tiles in which the lobula's lateral inhibition was computed, summed over the frames. A tile in which only some
    /// directions are active counts in part.
    pub fn inhibited_tiles(&self) -> f64 {
        self.tiles[Part::Lobula as usize] as f64 / crate::DIRECTIONS as f64
    }

    /// Tiles in which prediction was computed, summed over the frames. A tile in which only some directions are active
    /// counts in part.
    pub fn predicted_tiles(&self) -> f64 {
        self.tiles[Part::Prediction as usize] as f64 / crate::DIRECTIONS as f64
    }

    /// All tiles, summed over the frames.
    pub fn total_tiles(&self) -> u64 {
        self.total_tiles
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

    /// As [`Clock::lap`], for a part that computes some of its tiles only.
    pub fn lap_tiles(&mut self, part: Part, tiles: usize) {
        if let Some((timing, _)) = &mut self.0 {
            timing.tiles[part as usize] += tiles as u64;
        }
        self.lap(part);
    }

    /// How many tiles the frame has.
    pub fn count_tiles(&mut self, tiles: usize) {
        if let Some((timing, _)) = &mut self.0 {
            timing.total_tiles += tiles as u64;
        }
    }
}
