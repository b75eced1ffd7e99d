//! apg-STMD, wired as in the figure of the paper.

use ndarray::{Array3, ArrayView3, Axis, concatenate};

use crate::DIRECTIONS;
use crate::detection::{Detection, Response};
use crate::direction::of_vector_sum;
use crate::error::FrameError;
use crate::frame::{Frame, Size};
use crate::params::{Localise, Params};
use crate::plane::Plane;
use crate::probe::Stage;
use crate::row::bands::Bands;
use crate::stage::attention::Attention;
use crate::stage::facilitation::Facilitation;
use crate::stage::lamina::Lamina;
use crate::stage::lobula::Lobula;
use crate::stage::medulla::Medulla;
use crate::stage::memorizer::Memorizer;
use crate::stage::prediction::Prediction;
use crate::stage::rejection::Rejection;
use crate::stage::retina::Retina;
use crate::timing::{Clock, Part, Timing};

pub(crate) struct ApgStmd {
    params: Params,
    frames: u64,
    /// How far behind a target its response peaks, px.
    lag: f32,
    luminance: Plane,
    p: Plane,
    l: Plane,
    retina: Retina,
    attention: Attention,
    lamina: Lamina,
    medulla: Medulla,
    lobula: Lobula,
    rejection: Rejection,
    prediction: Prediction,
    facilitation: Facilitation,
    memorizer: Memorizer,
}

impl ApgStmd {
    /// `params` are valid and `size` is large enough.
    pub fn new(size: Size, params: &Params, threads: usize) -> Self {
        let lag = if params.detection.localise == Localise::Target { super::lag::measure(params) } else { 0.0 };
        Self { lag, ..Self::without_lag(size, params, threads) }
    }

    pub(super) fn without_lag(size: Size, params: &Params, threads: usize) -> Self {
        let engine = params.engine.temporal;
        let memorizer = Memorizer::new(size, if params.prediction.enabled { params.horizon() } else { 1 });
        Self {
            params: params.clone(),
            frames: 0,
            lag: 0.0,
            luminance: Plane::new(size),
            p: Plane::new(size),
            l: Plane::new(size),
            retina: Retina::new(&params.retina, threads),
            attention: Attention::new(size, params, threads),
            lamina: Lamina::new(size, &params.lamina, engine),
            medulla: Medulla::new(size, &params.medulla, engine),
            lobula: Lobula::new(size, &params.lobula, threads),
            rejection: Rejection::new(size, params),
            prediction: Prediction::new(params, &memorizer.grid, threads),
            facilitation: Facilitation::new(&params.prediction, threads),
            memorizer,
        }
    }

    /// Takes in the next frame's luminance; on error nothing has changed for `step`.
    pub fn take(&mut self, frame: Frame<'_>) -> Result<(), FrameError> {
        frame.write_luminance(&mut self.luminance)
    }

    /// One time step.
    pub fn step(&mut self, bands: &Bands, response: &mut Response, timing: Option<&mut Timing>) {
        let Self { p, l, retina, attention, lamina, medulla, lobula, rejection, prediction, memorizer, .. } = self;
        let mut clock = Clock::start(timing);
        memorizer.advance();
        let predicted = (self.frames >= memorizer.horizon() as u64).then(|| memorizer.ago(memorizer.horizon()));

        retina.process(bands, &self.luminance, p);
        clock.lap(Part::Retina);
        attention.process(bands, p, predicted);
        clock.lap(Part::Attention);
        lamina.process(bands, &attention.pe, l);
        clock.lap(Part::Lamina);
        medulla.process(bands, l);
        clock.lap(Part::Medulla);
        lobula.process(bands, l, medulla);
        clock.lap(Part::Lobula);
        rejection.process(p, &lobula.e, &lobula.strongest);
        let kept = rejection.kept(&lobula.e);
        clock.lap(Part::Rejection);
        prediction.process(bands, kept, memorizer);
        clock.lap(Part::Prediction);
        self.facilitation.process(bands, kept, &prediction.fresh, memorizer, response);
        clock.count_tiles(prediction.tiles());
        self.frames += 1;
        self.detect(response);
        clock.lap(Part::Facilitation);
    }

    /// Detections: the confirmed peaks, strongest facilitated response first.
    fn detect(&self, response: &mut Response) {
        let (shift_x, shift_y) = self.rejection.shift();
        response.background_shift = (shift_x as f32, shift_y as f32);
        let ahead = if self.params.detection.localise == Localise::Target { self.lag } else { 0.0 };
        let kept = self.rejection.kept(&self.lobula.e);
        response.detections.clear();
        response.detections.extend(self.rejection.confirmed.iter().map(|(peak, trace)| {
            let q = self.facilitation.at(kept, &self.memorizer, peak.x, peak.y);
            let direction = of_vector_sum(&q);
            // Responses that cancel have no direction to move along.
            let (cos, sin) = if direction.is_nan() { (0.0, 0.0) } else { (direction.cos(), direction.sin()) };
            Detection {
                x: peak.sub_x + ahead * cos,
                y: peak.sub_y - ahead * sin,
                score: q.into_iter().fold(0.0, f32::max),
                direction,
                trace: *trace,
            }
        }));
        response.detections.sort_unstable_by(|a, b| b.score.total_cmp(&a.score).then(a.trace.cmp(&b.trace)));
    }

    pub fn size(&self) -> Size {
        self.luminance.size()
    }

    pub fn params(&self) -> &Params {
        &self.params
    }

    pub fn frames(&self) -> u64 {
        self.frames
    }

    pub fn lag(&self) -> f32 {
        self.lag
    }

    pub fn latency(&self) -> usize {
        self.params.medulla.tm1_5_tau.ceil() as usize + self.params.horizon()
    }

    /// A stage of the last frame, (maps, rows, columns).
    pub fn stage(&self, stage: Stage) -> Array3<f32> {
        let Size { height, width } = self.size();
        let kept = || self.rejection.kept(&self.lobula.e);
        match stage {
            Stage::P => self.p.view3().to_owned(),
            Stage::C => self.rejection.contrast.map(&self.p),
            Stage::A => self.attention.a.view3().to_owned(),
            Stage::Pe => self.attention.pe.view3().to_owned(),
            Stage::L => self.l.view3().to_owned(),
            Stage::Tm3 => self.l.view3().mapv(|l| l.max(0.0)),
            Stage::Tm2 => self.l.view3().mapv(|l| (-l).max(0.0)),
            Stage::Mi1 => self.medulla.mi1.view3().to_owned(),
            Stage::Tm1_4 => self.medulla.tm1_4.view3().to_owned(),
            Stage::Tm1_5 => self.medulla.tm1_5.view3().to_owned(),
            Stage::D => self.lobula.correlation(&self.l, &self.medulla),
            Stage::E => stack(&self.lobula.e),
            Stage::Ep => stack(kept()),
            Stage::F | Stage::M => {
                let mut maps = Array3::zeros((stage.planes(), height, width));
                let first = if stage == Stage::M { DIRECTIONS } else { 0 };
                for (k, map) in maps.axis_iter_mut(Axis(0)).enumerate() {
                    self.memorizer.ago(0).copy_map(&self.memorizer.grid, first + k, map);
                }
                maps
            }
            Stage::Q => self.facilitation.map(kept(), &self.prediction.fresh, &self.memorizer),
        }
    }

    /// As before the first frame.
    pub fn reset(&mut self) {
        self.frames = 0;
        self.p.fill(0.0);
        self.l.fill(0.0);
        self.attention.reset();
        self.lamina.reset();
        self.medulla.reset();
        self.lobula.reset();
        self.rejection.reset();
        self.prediction.reset();
        self.memorizer.reset();
    }
}

fn stack(planes: &[Plane; DIRECTIONS]) -> Array3<f32> {
    let views: [ArrayView3<'_, f32>; DIRECTIONS] = planes.each_ref().map(Plane::view3);
    concatenate(Axis(0), &views).expect("all planes of a stage have one size")
}
