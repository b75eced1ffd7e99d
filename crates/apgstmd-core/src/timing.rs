//! Where the time of a frame goes, stage by stage.

use std::ops::AddAssign;
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

/// Time spent in each part of the model, summed over the frames given to [`crate::Detector::process_timed`]; of a
/// [`crate::Bank`] also over its members, which run side by side.
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

impl AddAssign<&Timing> for Timing {
    fn add_assign(&mut self, other: &Self) {
        self.spent.iter_mut().zip(other.spent).for_each(|(sum, spent)| *sum += spent);
        self.tiles.iter_mut().zip(other.tiles).for_each(|(sum, tiles)| *sum += tiles);
        self.total_tiles += other.total_tiles;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Bank, BankParams, Detector, Frame, Machine, Member, Params, Size};
    use ndarray::Array2;

    fn frame(t: usize) -> Array2<u8> {
        Array2::from_shape_fn((64, 96), |(y, x)| if x.abs_diff(10 + t) < 3 && y.abs_diff(32) < 3 { 0 } else { 255 })
    }

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn a_bank_adds_up_its_members() {
        let size = Size::new(64, 96);
        let mut bank = Bank::with_options(size, &BankParams::default(), &Machine::with_threads(2)).unwrap();
        let mut response = bank.make_response();
        let mut timing = Timing::default();
        for t in 0..5 {
            bank.process_timed(frame(t).view(), &mut response, &mut timing).unwrap();
        }
        let tiles = |side: usize| side.div_ceil(16) as u64;
        let each = |scale: usize| tiles(size.height / scale) * tiles(size.width / scale);
        // Of five frames 0, 2, 4.
        let due = |member: Member| match member.exposure() {
            1 => 5,
            2 => 3,
            other => panic!("no member takes {other} frames as one"),
        };
        let expected: u64 = bank.members().map(|member| due(member) * each(member.scale)).sum();
        assert_eq!(timing.total_tiles(), expected);
        assert!(timing.parts().all(|(part, spent)| spent > Duration::ZERO || part == "facilitation"), "{timing:?}");
    }

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn blocks_are_timed_and_stay_the_same() {
        let machine = Machine { together: 4, ..Machine::with_threads(1) };
        let params = Params::default().for_speed(1.0).unwrap();
        let mut detectors = [(); 2].map(|()| Detector::with_options(Size::new(64, 96), &params, &machine).unwrap());
        let pictures: Vec<Array2<u8>> = (0..12).map(frame).collect();
        let frames: Vec<Frame<'_>> = pictures.iter().map(|picture| picture.view().into()).collect();
        let mut responses = [(); 2].map(|()| (0..12).map(|_| detectors[0].make_response()).collect::<Vec<_>>());
        let mut timing = Timing::default();
        detectors[0].process_block(&frames, &mut responses[0]).unwrap();
        detectors[1].process_block_timed(&frames, &mut responses[1], &mut timing).unwrap();
        assert!(responses[0].iter().zip(&responses[1]).all(|(a, b)| a.map == b.map));
        assert!(timing.of("lobula") > Duration::ZERO && timing.total_tiles() == 12 * 4 * 6, "{timing:?}");
    }
}
