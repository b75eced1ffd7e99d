//! What a bank consists of.

use super::exposure::{self, LONGEST};
use super::tuned;
use crate::error::ParamError;
use crate::params::{Localise, Params, Preset};

/// Scales of the pyramid: frames are reduced by these.
pub const SCALES: [usize; 4] = [1, 2, 4, 8];

/// Speeds of the default bank, px/frame.
const SPEEDS: [f64; 6] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0];
/// Sizes of the default bank, px.
const SIZES: [f64; 3] = [5.0, 10.0, 20.0];
/// Members of the default bank are not slower than this in pixels of their own scale: what is that large and slow is
/// left out, for it costs most and is seen by the finer members.
const SLOWEST: f64 = 0.25;

/// One detector of a bank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Member {
    /// Speed it is tuned to, px/frame of the full picture.
    pub speed: f64,
    /// It sees frames reduced by this: one of [`SCALES`].
    pub scale: usize,
}

impl Member {
    /// Its speed in pixels of its own scale.
    pub fn own_speed(&self) -> f64 {
        self.speed / self.scale as f64
    }

    /// Frames that it takes as one, their mean: a power of two, 8 at most, in which its targets move by half a pixel of its own
    /// scale or less.
    pub fn exposure(&self) -> usize {
        exposure::length(self.own_speed())
    }
}

/// Members of a bank and what becomes of their detections.
#[derive(Clone, Debug, PartialEq)]
pub struct BankParams {
    /// What the members have in common: each is this, tuned to its own speed. Each follows five times `most` peaks at most, and
    /// lets go of gains of prediction below a thousandth: scores are cube roots of responses, and others look too.
    pub base: Params,
    /// The members.
    pub members: Vec<Member>,
    /// Least equivalent contrast of a detection, 0 to 1.
    pub contrast: f32,
    /// Most detections in one frame, best first.
    pub most: usize,
}

impl Default for BankParams {
    /// The practical preset at speeds of 0.25 to 8 px/frame, an octave apart, and sizes of 5, 10 and 20 px.
    fn default() -> Self {
        Self::new(Params::preset(Preset::Practical))
    }
}

impl BankParams {
    /// The members of the default bank, with other parameters in common.
    pub fn new(base: Params) -> Self {
        let mut params = Self::with_members(base, &SPEEDS, &SIZES);
        params.members.retain(|member| member.own_speed() >= SLOWEST);
        params
    }

    /// A member for each of `speeds`, px/frame, at the scale of each of `sizes`, px.
    ///
    /// A scale of k sees targets of k times the size that the lobula is tuned to, 5 px; of a size, the nearest scale is
    /// taken.
    pub fn with_members(base: Params, speeds: &[f64], sizes: &[f64]) -> Self {
        let tuned = base.target_size();
        let mut scales: Vec<usize> = Vec::new();
        for size in sizes {
            let octave = (size / tuned).log2().round().clamp(0.0, SCALES.len() as f64 - 1.0);
            let scale = SCALES[octave as usize];
            if !scales.contains(&scale) {
                scales.push(scale);
            }
        }
        let of = |scale: usize| speeds.iter().map(move |speed| Member { speed: *speed, scale });
        let mut members: Vec<Member> = Vec::new();
        for member in scales.into_iter().flat_map(of) {
            if !members.contains(&member) {
                members.push(member);
            }
        }
        Self { base, members, contrast: 0.003, most: 20 }
    }

    /// The default bank where neither is given, else a member for each speed (by default those of the default bank) and size
    /// (by default what the lobula is tuned to where there are speeds).
    pub fn choose(base: Params, speeds: Option<&[f64]>, sizes: Option<&[f64]>) -> Self {
        match (speeds, sizes) {
            (None, None) => Self::new(base),
            (None, Some(sizes)) => Self::with_members(base, &SPEEDS, sizes),
            (Some(speeds), None) => {
                let size = base.target_size();
                Self::with_members(base, speeds, &[size])
            }
            (Some(speeds), Some(sizes)) => Self::with_members(base, speeds, sizes),
        }
    }

    /// Checks every member, and the parameters it is made of.
    ///
    /// # Errors
    /// Names the field, its value and the rule it breaks.
    pub fn validate(&self) -> Result<(), ParamError> {
        let wrong = |name, value: String, rule: &str| {
            Err(ParamError::OutOfRange { section: "bank", name, value, rule: rule.to_owned() })
        };
        if !(0.0..=1.0).contains(&self.contrast) {
            return wrong("contrast", self.contrast.to_string(), "must lie between 0 and 1");
        }
        if !(1..=10_000).contains(&self.most) {
            return wrong("most", self.most.to_string(), "must lie between 1 and 10000");
        }
        if !(1..=MOST_MEMBERS).contains(&self.members.len()) {
            let rule = format!("must be between 1 and {MOST_MEMBERS} different speeds and sizes");
            return wrong("members", self.members.len().to_string(), &rule);
        }
        for member in &self.members {
            if !SCALES.contains(&member.scale) {
                return wrong("scale", member.scale.to_string(), "must be 1, 2, 4 or 8");
            }
            self.of(member)?;
        }
        Ok(())
    }

    /// Parameters of a member, whose frames are those that it takes as one, localising nothing.
    ///
    /// # Errors
    /// The base cannot be tuned to its speed.
    pub(super) fn of(&self, member: &Member) -> Result<Params, ParamError> {
        // From the speed that the base is tuned to, which a horizon of whole frames may have moved.
        let own = member.own_speed() * member.exposure() as f64 * self.base.prediction.v_opt / tuned(&self.base);
        let mut params = self.base.for_speed(own).map_err(|error| match error {
            ParamError::Speed { low, high, .. } => ParamError::OutOfRange {
                section: "bank",
                name: "speed",
                value: format!("{} at scale {}", member.speed, member.scale),
                rule: format!("must lie between {} and {high} px/frame of the reduced picture", low / LONGEST as f64),
            },
            other => other,
        })?;
        params.detection.localise = Localise::Response;
        // That is one of the bank's own scores.
        params.detection.least_score = 0.0;
        let peaks = u32::try_from(self.most.saturating_mul(PEAKS)).unwrap_or(u32::MAX);
        params.detection.max_peaks = params.detection.max_peaks.min(peaks);
        params.prediction.negligible = params.prediction.negligible.max(NEGLIGIBLE);
        Ok(params)
    }
}

/// Peaks that a member follows for each detection of the bank.
const PEAKS: usize = 5;
/// Share of the largest gain that a member lets go.
const NEGLIGIBLE: f64 = 1e-3;
/// Most members of a bank.
const MOST_MEMBERS: usize = 64;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_become_scales() {
        let of = |sizes: &[f64]| -> Vec<usize> {
            BankParams::with_members(Params::default(), &[1.0], sizes).members.iter().map(|m| m.scale).collect()
        };
        assert_eq!(of(&[3.0, 5.0, 6.0]), [1]);
        assert_eq!(of(&[5.0, 8.0, 12.0, 20.0, 500.0]), [1, 2, 4, 8]);
    }

    #[test]
    fn the_default_is_octaves() {
        let params = BankParams::default();
        params.validate().unwrap();
        let speeds =
            |scale| -> Vec<f64> { params.members.iter().filter(|m| m.scale == scale).map(|m| m.speed).collect() };
        assert_eq!(speeds(1), SPEEDS);
        assert_eq!(speeds(2), [0.5, 1.0, 2.0, 4.0, 8.0]);
        assert_eq!(speeds(4), [1.0, 2.0, 4.0, 8.0]);
    }

    #[test]
    fn wrong_ones_are_named() {
        let wrong = |change: fn(&mut BankParams), name: &str| {
            let mut params = BankParams::default();
            change(&mut params);
            let error = params.validate().unwrap_err().to_string();
            assert!(error.contains(name), "{error}");
        };
        wrong(|params| params.members.clear(), "bank.members is 0");
        wrong(|params| params.contrast = f32::NAN, "bank.contrast is NaN");
        wrong(|params| params.most = 0, "bank.most is 0");
        wrong(|params| params.members[0].scale = 3, "bank.scale is 3");
        wrong(|params| params.members[0].speed = 1e-9, "bank.speed is 0.000000001 at scale 1");
        wrong(|params| params.members[0].speed = f64::NAN, "bank.speed is NaN");
    }
}
