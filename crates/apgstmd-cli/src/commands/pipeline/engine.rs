//! What computes: one detector, or a bank of them.

use apgstmd_core::{
    Bank, BankParams, Detector, Frame, FrameError, Machine, ParamError, Params, Probe, Region, RegionError, Response,
    Size, State, StateError, Timing,
};

use super::Options;

pub(super) enum Engine {
    Detector(Box<Detector>),
    Bank(Box<Bank>),
}

impl Engine {
    pub fn new(size: Size, options: &Options<'_>, machine: &Machine) -> Result<Self, ParamError> {
        Ok(match options.bank {
            None => Self::Detector(Box::new(Detector::with_options(size, options.params, machine)?)),
            Some(bank) => Self::Bank(Box::new(Bank::with_options(size, bank, machine)?)),
        })
    }

    pub fn size(&self) -> Size {
        match self {
            Self::Detector(detector) => detector.size(),
            Self::Bank(bank) => bank.size(),
        }
    }

    pub fn make_response(&self) -> Response {
        match self {
            Self::Detector(detector) => detector.make_response(),
            Self::Bank(bank) => bank.make_response(),
        }
    }

    pub fn block_len(&self) -> usize {
        match self {
            Self::Detector(detector) => detector.block_len(),
            Self::Bank(_) => 1,
        }
    }

    pub fn frames(&self) -> u64 {
        match self {
            Self::Detector(detector) => detector.frames(),
            Self::Bank(bank) => bank.frames(),
        }
    }

    pub fn look_in(&mut self, region: &Region) -> Result<(), RegionError> {
        match self {
            Self::Detector(detector) => detector.look_in(Some(region)),
            Self::Bank(bank) => bank.look_in(Some(region)),
        }
    }

    pub fn state(&mut self) -> State {
        match self {
            Self::Detector(detector) => detector.state(),
            Self::Bank(bank) => bank.state(),
        }
    }

    pub fn restore(&mut self, state: &State) -> Result<(), StateError> {
        match self {
            Self::Detector(detector) => detector.restore(state),
            Self::Bank(bank) => bank.restore(state),
        }
    }

    /// How far the response peaks behind a target, px.
    pub fn lag(&self) -> f32 {
        match self {
            Self::Detector(detector) => detector.lag(),
            Self::Bank(bank) => bank.lag(),
        }
    }

    /// One response a frame, up to the first frame that cannot be used; adds up what each stage takes.
    pub fn process_block(
        &mut self,
        frames: &[Frame<'_>],
        responses: &mut [Response],
        timing: &mut Timing,
    ) -> Result<(), FrameError> {
        match self {
            Self::Detector(detector) => detector.process_block_timed(frames, responses, timing),
            Self::Bank(bank) => {
                let mut pairs = frames.iter().zip(responses);
                pairs.try_for_each(|(frame, response)| bank.process_timed(*frame, response, timing))
            }
        }
    }

    /// The inner maps; those of a bank are refused before the run.
    pub fn probe(&self) -> Option<Probe<'_>> {
        match self {
            Self::Detector(detector) => Some(detector.probe()),
            Self::Bank(_) => None,
        }
    }
}

/// Least score that begins a track behind a bank where the parameters name none, whatever the clip says: in a quiet clip less is
/// rare, and still no target.
pub(super) const BIRTH_SCORE: f64 = 0.01;

/// Parameters for a tracker behind a bank: tuned to the middle of its speeds.
pub(super) fn tracked(bank: &BankParams) -> Result<Params, ParamError> {
    let octaves = bank.members.iter().map(|member| member.speed.log2()).sum::<f64>() / bank.members.len() as f64;
    let mut params = bank.base.for_speed(octaves.exp2())?;
    params.tracking.birth_score = birth_score(bank);
    Ok(params)
}

/// Least score that begins a track behind a bank.
pub(in crate::commands) fn birth_score(bank: &BankParams) -> f64 {
    if bank.base.tracking.birth_score == 0.0 { BIRTH_SCORE } else { bank.base.tracking.birth_score }
}
