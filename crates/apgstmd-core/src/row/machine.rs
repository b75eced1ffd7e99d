//! What of the machine a detector uses: instruction set and threads.

use std::fmt;
use std::str::FromStr;

use fearless_simd::Level;

/// An instruction set, narrower ones first. Results of two sets differ by rounding: from [`SimdLevel::Avx2`] and
/// [`SimdLevel::Neon`] on, multiplications and additions are fused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SimdLevel {
    /// None: plain code for the baseline of the target.
    Scalar,
    /// x86, 128 bits.
    Sse2,
    /// x86, 128 bits.
    Sse4_2,
    /// ARM, 128 bits.
    Neon,
    /// x86, 256 bits, with FMA.
    Avx2,
    /// x86, 512 bits.
    Avx512,
}

impl SimdLevel {
    /// All of them, whatever this machine has.
    pub const ALL: &'static [Self] = &[Self::Scalar, Self::Sse2, Self::Sse4_2, Self::Neon, Self::Avx2, Self::Avx512];

    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Sse2 => "sse2",
            Self::Sse4_2 => "sse4.2",
            Self::Neon => "neon",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }

    /// The widest set that this machine has.
    pub fn best() -> Self {
        Self::available().last().unwrap_or(Self::Scalar)
    }

    /// The sets that this machine has, narrower ones first. `Scalar` is always among them.
    pub fn available() -> impl Iterator<Item = Self> {
        Self::ALL.iter().copied().filter(|level| level.token().is_some())
    }

    /// The set itself where the machine has it, else the widest one below it that the machine has.
    #[must_use]
    pub fn clamped(self) -> Self {
        Self::available().take_while(|level| *level <= self).last().unwrap_or(Self::Scalar)
    }

    /// The proof that this machine has the set.
    fn token(self) -> Option<Level> {
        let machine = Level::new();
        match self {
            Self::Scalar => Some(Level::fallback()),
            #[cfg(target_arch = "x86_64")]
            Self::Sse2 => machine.as_sse2().map(Level::Sse2),
            #[cfg(target_arch = "x86_64")]
            Self::Sse4_2 => machine.as_sse4_2().map(Level::Sse4_2),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => machine.as_avx2().map(Level::Avx2),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => machine.as_avx512().map(Level::Avx512),
            #[cfg(target_arch = "aarch64")]
            Self::Neon => machine.as_neon().map(Level::Neon),
            _ => None,
        }
    }

    /// What kernels are dispatched by.
    pub(crate) fn level(self) -> Level {
        self.clamped().token().unwrap_or(Level::fallback())
    }
}

impl fmt::Display for SimdLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// There is no instruction set of this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no instruction set `{0}`: they are {all}", all = SimdLevel::ALL.iter().map(|level| level.name()).collect::<Vec<_>>().join(", "))]
pub struct UnknownSimdLevel(pub String);

impl FromStr for SimdLevel {
    type Err = UnknownSimdLevel;
    fn from_str(text: &str) -> Result<Self, UnknownSimdLevel> {
        Self::ALL.iter().copied().find(|level| level.name() == text).ok_or_else(|| UnknownSimdLevel(text.to_owned()))
    }
}

/// How a detector uses the machine. Nothing of it changes what is computed, the instruction set but for rounding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Machine {
    /// Number of threads, 1 to [`crate::MOST_THREADS`]. With 1, everything runs on the calling thread.
    pub threads: usize,
    /// Instruction set, at most; none asks for the best. See [`SimdLevel::clamped`].
    pub simd: Option<SimdLevel>,
    /// Frames that [`crate::Detector::process_block`] computes together, at most: each takes memory for seven maps and makes
    /// all of them faster. 1 for streams; see [`crate::Detector::block_len`].
    pub together: usize,
    /// Computes everywhere, also where the result is known to be zero: for tests of what is left out.
    #[doc(hidden)]
    pub dense: bool,
}

impl Default for Machine {
    /// As many threads as the machine has cores, its best instruction set.
    fn default() -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        Self { threads: cores.min(crate::MOST_THREADS), simd: None, together: 1, dense: false }
    }
}

impl Machine {
    /// A number of threads, the best instruction set.
    pub fn with_threads(threads: usize) -> Self {
        Self { threads, ..Self::default() }
    }

    /// The instruction set that this asks for on the machine at hand.
    pub fn level(&self) -> SimdLevel {
        self.simd.map_or_else(SimdLevel::best, SimdLevel::clamped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_back() {
        for level in SimdLevel::ALL {
            assert_eq!(level.name().parse(), Ok(*level));
        }
        assert!("mmx".parse::<SimdLevel>().unwrap_err().to_string().contains("scalar, sse2"));
    }

    #[test]
    fn asking_for_more_gives_the_best() {
        let best = SimdLevel::best();
        assert!(SimdLevel::available().is_sorted() && SimdLevel::available().any(|level| level == SimdLevel::Scalar));
        for level in SimdLevel::ALL {
            let clamped = level.clamped();
            assert!(clamped <= *level && clamped <= best && SimdLevel::available().any(|level| level == clamped));
        }
        assert_eq!(best.clamped(), best);
        assert_eq!(Machine { simd: Some(SimdLevel::Scalar), ..Machine::default() }.level(), SimdLevel::Scalar);
        assert_eq!(Machine::default().level(), best);
    }
}
