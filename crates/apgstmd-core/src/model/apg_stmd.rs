//! apg-STMD, wired as in the figure of the paper.

use std::slice::{from_mut, from_ref};

use ndarray::{Array3, Axis};

use super::{Wiring, everywhere, part, stack};
use crate::DIRECTIONS;
use crate::detection::Response;
use crate::frame::Size;
use crate::memory::heap;
use crate::params::Params;
use crate::plane::{Plane, Series};
use crate::probe::Stage;
use crate::region::Region;
use crate::row::bands::Bands;
use crate::row::recurse::Prepare;
use crate::scroll::scrolls;
use crate::stage::attention::Attention;
use crate::stage::background::Background;
use crate::stage::facilitation::Facilitation;
use crate::stage::lamina::Lamina;
use crate::stage::lobula::Lobula;
use crate::stage::medulla::Medulla;
use crate::stage::memorizer::Memorizer;
use crate::stage::prediction::Prediction;
use crate::stage::readout;
use crate::stage::rejection::Rejection;
use crate::stage::retina::Retina;
use crate::state::remember;
use crate::timing::{Clock, Part, Timing};

pub(crate) struct ApgStmd {
    frames: u64,
    /// Of the frames that are computed together.
    p: Series,
    l: Vec<Plane>,
    retina: Retina,
    attention: Attention,
    lamina: Lamina,
    medulla: Medulla,
    lobula: Lobula,
    rejection: Rejection<DIRECTIONS>,
    prediction: Prediction,
    facilitation: Facilitation,
    memorizer: Memorizer,
}

heap!(ApgStmd { p, l, retina, attention, lamina, medulla, lobula, rejection, prediction, facilitation, memorizer });
remember!(ApgStmd { frames, p, attention, lamina, medulla, rejection, prediction, memorizer });
scrolls!(ApgStmd { p, attention, lamina, medulla, memorizer });

impl ApgStmd {
    /// For `together` frames at once, the horizon at most: within it no frame waits for what another predicts.
    pub fn new(size: Size, params: &Params, threads: usize, together: usize) -> Self {
        let engine = params.engine.temporal;
        let memorizer = Memorizer::new(size, if params.prediction.enabled { params.horizon() } else { 1 });
        Self {
            frames: 0,
            p: Series::new(size, together),
            l: (0..together).map(|_| Plane::new(size)).collect(),
            retina: Retina::new(&params.retina, threads),
            attention: Attention::new(size, params, threads, together),
            lamina: Lamina::new(size, &params.lamina, engine, threads),
            medulla: Medulla::new(size, &params.medulla, engine, threads, together),
            lobula: Lobula::new(size, params, threads),
            rejection: Rejection::new(size, params, together),
            prediction: Prediction::new(params, &memorizer.grid, threads),
            facilitation: Facilitation::new(&params.prediction, threads),
            memorizer,
        }
    }

    /// P_e of the frames of which P is at hand, and before which of them the scene is cut, of those from `looked_at` on. What
    /// attention made of that one and the later ones is worth nothing: it must be forgotten with all else.
    fn attend(&mut self, bands: &Bands, looked_at: usize) -> Option<usize> {
        let Self { frames, p, attention, rejection, memorizer, .. } = self;
        let horizon = memorizer.horizon();
        // The memorizer still stands at the frame before these.
        let predicted =
            |frame: usize| (*frames + frame as u64 >= horizon as u64).then(|| memorizer.ago(horizon - 1 - frame));
        let mut cut = None;
        let look = || cut = (looked_at..p.maps().len()).find(|frame| rejection.look(bands, &p.maps()[*frame], *frame));
        bands.both(|| attention.process(bands, p, predicted), look);
        cut
    }

    /// The frames of which P and P_e are at hand, in which the scene goes on.
    fn scene(&mut self, bands: &Bands, responses: &mut [Response], clock: &mut Clock<'_>) {
        let Self { frames, p, l, attention, lamina, medulla, lobula, rejection, .. } = self;
        let Self { prediction, facilitation, memorizer, .. } = self;
        let count = responses.len();
        let l = &mut l[..count];
        let follow = || p.maps()[..count].iter().enumerate().for_each(|(frame, p)| rejection.follow(bands, p, frame));
        let sense = || {
            lamina.process(bands, attention.output(p), l);
            clock.lap(Part::Lamina);
            medulla.process(bands, l);
            clock.lap(Part::Medulla);
        };
        bands.both(sense, follow);
        for (frame, response) in responses.iter_mut().enumerate() {
            let (p, l, medulla) = (&p.maps()[frame], &l[frame], medulla.frame(frame));
            lobula.process(bands, l, medulla);
            clock.lap_tiles(Part::Lobula, lobula.tiles());
            rejection.process(bands, p, frame, &lobula.responses(l, medulla));
            let kept = rejection.kept(&lobula.e);
            clock.lap(Part::Rejection);
            memorizer.advance();
            prediction.process(bands, kept, rejection.kept_tiles(), memorizer);
            clock.lap_tiles(Part::Prediction, prediction.tiles());
            facilitation.process(bands, kept, &prediction.source.fresh, memorizer, response);
            clock.count_tiles(memorizer.grid.count());
            readout::report(rejection, |peak| facilitation.at(kept, memorizer, peak.x, peak.y), response);
            clock.lap(Part::Facilitation);
        }
        *frames += count as u64;
    }

    /// Forgets the earlier frames.
    fn forget(&mut self) {
        self.frames = 0;
        self.p.fill(0.0);
        self.l.iter_mut().for_each(|l| l.fill(0.0));
        self.attention.reset();
        self.lamina.reset();
        self.medulla.reset();
        self.lobula.reset();
        self.prediction.reset();
        self.memorizer.reset();
    }
}

impl Wiring for ApgStmd {
    fn step(&mut self, bands: &Bands, luminance: &Plane, response: &mut Response, timing: Option<&mut Timing>) {
        self.block(bands, from_ref(luminance), from_mut(response), timing);
    }

    fn block(&mut self, bands: &Bands, luminance: &[Plane], responses: &mut [Response], timing: Option<&mut Timing>) {
        let mut clock = Clock::start(timing);
        let (mut luminance, mut responses) = (luminance, responses);
        let mut looked_at = 0;
        loop {
            self.p.begin(luminance.len());
            for (luminance, p) in luminance.iter().zip(self.p.maps_mut()) {
                self.retina.process(bands, luminance, p);
            }
            clock.lap(Part::Retina);
            let cut = self.attend(bands, looked_at);
            clock.lap_tiles(Part::Attention, self.attention.tiles());
            let (scene, next) = responses.split_at_mut(cut.unwrap_or(luminance.len()));
            if !scene.is_empty() {
                self.p.keep(scene.len());
                self.attention.keep(scene.len());
                self.scene(bands, scene, &mut clock);
            }
            let Some(cut) = cut else { break };
            self.forget();
            self.rejection.begin_at(cut);
            (luminance, responses, looked_at) = (&luminance[cut..], next, 1);
        }
    }

    fn front(&mut self) -> (&mut Retina, &mut Background) {
        (&mut self.retina, &mut self.rejection.background)
    }

    fn stage(&self, bands: &Bands, stage: Stage) -> Option<Array3<f32>> {
        let kept = || self.rejection.kept(&self.lobula.e);
        let last = self.p.maps().len() - 1;
        let (l, medulla) = (&self.l[last], self.medulla.frame(last));
        Some(match stage {
            Stage::P => self.p.last().view3().to_owned(),
            Stage::C => self.rejection.contrast.map(self.p.last()),
            Stage::A => self.attention.a.view3().to_owned(),
            Stage::Pe => self.attention.enhanced(self.p.last()),
            Stage::L => l.view3().to_owned(),
            Stage::Tm3 => part(l, Prepare::Positive),
            Stage::Tm2 => part(l, Prepare::Negative),
            Stage::Mi1 => medulla.mi1.view3().to_owned(),
            Stage::Tm1_4 => medulla.tm1_4.view3().to_owned(),
            Stage::Tm1_5 => medulla.tm1_5.view3().to_owned(),
            Stage::D => self.lobula.correlation(l, medulla),
            Stage::E => everywhere(bands, l.size(), &self.lobula.responses(l, medulla)),
            Stage::Ep => stack(kept()),
            Stage::F | Stage::M => {
                let Size { height, width } = l.size();
                let mut maps = Array3::zeros((stage.planes(), height, width));
                let first = if stage == Stage::M { DIRECTIONS } else { 0 };
                for (k, map) in maps.axis_iter_mut(Axis(0)).enumerate() {
                    self.memorizer.ago(0).copy_map(&self.memorizer.grid, first + k, map);
                }
                maps
            }
            Stage::Q => self.facilitation.map(kept(), &self.prediction.source.fresh, &self.memorizer),
            _ => return None,
        })
    }

    fn look_in(&mut self, region: Option<&Region>) {
        let asked = self.rejection.look_in(region);
        self.lobula.look_in(asked.as_ref());
    }

    fn reset(&mut self) {
        self.forget();
        self.rejection.reset();
    }
}
