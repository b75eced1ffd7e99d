//! One configuration measured: frames streamed one by one, each timed as a whole and by stage.

use std::time::{Duration, Instant};

use apgstmd_core::{Detector, Machine, Memory, ParamError, Params, Size, Timing};
use indicatif::ProgressBar;
use serde::Serialize;

use super::cost::{self, Active};
use super::scene::Clip;
use crate::Outcome;
use crate::failure::Failure;
use crate::interrupt;

/// What is measured.
#[derive(Clone, Debug)]
pub(super) struct Subject {
    pub size: Size,
    pub params: Params,
    pub machine: Machine,
    pub frames: usize,
}

/// What came out, as JSON has it. Times in milliseconds.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Measured {
    pub model: String,
    pub width: usize,
    pub height: usize,
    pub threads: usize,
    pub simd: &'static str,
    pub rejection: apgstmd_core::params::RejectionMode,
    /// Frames measured, and before them run to fill every memory.
    pub frames: usize,
    pub warm_up: usize,
    pub frames_per_second: f64,
    pub latency_ms: Latency,
    pub stages: Vec<Stage>,
    /// Multiply-adds and bytes a second over all stages; none where they are not counted.
    pub gfma_per_s: Option<f64>,
    pub gbytes_per_s: Option<f64>,
    pub memory_bytes: MemoryRecord,
    pub detections_per_frame: f64,
}

/// Of single frames.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Latency {
    pub mean: f64,
    /// What a busy machine disturbs least.
    pub min: f64,
    pub p50: f64,
    pub p99: f64,
    pub max: f64,
}

/// One stage.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Stage {
    pub name: &'static str,
    /// Median over frames.
    pub ms: f64,
    /// Share of the tiles that were computed; 1 where all are.
    pub active: f64,
    pub gfma_per_s: Option<f64>,
    pub gbytes_per_s: Option<f64>,
}

/// See [`Memory`].
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct MemoryRecord {
    pub bound: usize,
    pub resident: usize,
}

impl From<Memory> for MemoryRecord {
    fn from(memory: Memory) -> Self {
        Self { bound: memory.bound, resident: memory.resident }
    }
}

impl Measured {
    /// Milliseconds a frame, the median.
    pub fn ms(&self) -> f64 {
        self.latency_ms.p50
    }

    /// Share of the tiles and directions that prediction computed.
    pub fn predicted(&self) -> f64 {
        self.stages.iter().find(|stage| stage.name == "prediction").map_or(0.0, |stage| stage.active)
    }
}

/// Frames run before those that are measured: the whole history of prediction, then as long again for the region of
/// attention to fade in.
pub(super) fn warm_up(params: &Params) -> usize {
    4 * params.prediction.horizon as usize + 32
}

/// Runs it.
///
/// # Errors
/// A size or number of threads that cannot be; Ctrl-C.
pub(super) fn measure(subject: &Subject, clip: &Clip, bar: &ProgressBar) -> Outcome<Measured> {
    let Subject { size, params, machine, frames } = subject;
    let mut detector = Detector::with_options(*size, params, machine).map_err(|error| match error {
        ParamError::TooSmall { .. } | ParamError::TooLarge { .. } => Failure::usage(format_args!("--size: {error}")),
        _ => Failure::failed(error),
    })?;
    let mut response = detector.make_response();
    let warm_up = warm_up(params);
    let mut totals = Vec::with_capacity(*frames);
    let mut parts = vec![Vec::with_capacity(*frames); Timing::PARTS.len()];
    let mut sum = Timing::default();
    let mut detections = 0;
    for n in 0..warm_up + frames {
        if interrupt::asked() {
            return Err(Failure::Interrupted);
        }
        let frame = clip.frame(n);
        let before = sum.clone();
        let begin = Instant::now();
        detector.process_timed(frame.view(), &mut response, &mut sum).map_err(Failure::failed)?;
        let spent = begin.elapsed();
        if n < warm_up {
            sum = Timing::default();
            continue;
        }
        bar.inc(1);
        totals.push(spent);
        for (spent, ((_, now), (_, before))) in parts.iter_mut().zip(sum.parts().zip(before.parts())) {
            spent.push(now.saturating_sub(before));
        }
        detections += response.detections.len();
    }
    let active = shares(&sum);
    let stages: Vec<Stage> = Timing::PARTS
        .iter()
        .zip(&mut parts)
        .map(|(name, spent)| stage(name, milliseconds(median(spent)), subject, active))
        .collect();
    let mean = milliseconds(totals.iter().sum::<Duration>()) / *frames as f64;
    totals.sort_unstable();
    let quantile = |q: f64| milliseconds(totals[((totals.len() - 1) as f64 * q).round() as usize]);
    let p50 = quantile(0.5);
    let costs = || stages.iter().map(|stage| cost::of(stage.name, *size, params, active));
    let rate = |of: fn(&cost::Cost) -> f64| {
        costs().map(|cost| cost.map(|cost| of(&cost))).sum::<Option<f64>>().map(|sum| sum / (1e6 * p50))
    };
    Ok(Measured {
        model: params.model.to_string(),
        width: size.width,
        height: size.height,
        threads: machine.threads,
        simd: detector.simd().name(),
        rejection: params.rejection.mode,
        frames: *frames,
        warm_up,
        frames_per_second: 1e3 / mean,
        latency_ms: Latency { mean, min: quantile(0.0), p50, p99: quantile(0.99), max: quantile(1.0) },
        gfma_per_s: rate(|cost| cost.operations),
        gbytes_per_s: rate(|cost| cost.bytes),
        stages,
        memory_bytes: detector.memory().into(),
        detections_per_frame: detections as f64 / *frames as f64,
    })
}

fn stage(name: &'static str, ms: f64, subject: &Subject, active: Active) -> Stage {
    let cost = cost::of(name, subject.size, &subject.params, active);
    // A stage that takes no time has nothing to do.
    let rate = |amount: f64| if ms > 0.0 { amount / (1e6 * ms) } else { 0.0 };
    let share = match name {
        "attention" => active.attention,
        "lobula" => active.lobula,
        "prediction" => active.prediction,
        _ => 1.0,
    };
    Stage {
        name,
        ms,
        active: share,
        gfma_per_s: cost.map(|cost| rate(cost.operations)),
        gbytes_per_s: cost.map(|cost| rate(cost.bytes)),
    }
}

fn shares(sum: &Timing) -> Active {
    let all = sum.total_tiles() as f64;
    let share = |tiles: f64| if all > 0.0 { tiles / all } else { 1.0 };
    Active {
        attention: share(sum.attended_tiles() as f64),
        lobula: share(sum.inhibited_tiles()),
        prediction: share(sum.predicted_tiles()),
    }
}

fn milliseconds(duration: Duration) -> f64 {
    1e3 * duration.as_secs_f64()
}

fn median(spent: &mut [Duration]) -> Duration {
    let middle = spent.len() / 2;
    *spent.select_nth_unstable(middle).1
}
