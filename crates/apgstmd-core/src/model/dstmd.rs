//! DSTMD (Wang et al. 2018): an STMD with directions behind lateral inhibition in the lamina.

use std::slice::{from_mut, from_ref};

use ndarray::Array3;

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
use crate::stage::background::Background;
use crate::stage::lamina::Lamina;
use crate::stage::lamina_inhibition::LaminaInhibition;
use crate::stage::lobula::Lobula;
use crate::stage::medulla::Medulla;
use crate::stage::readout::Readout;
use crate::stage::rejection::Rejection;
use crate::stage::retina::Retina;
use crate::state::remember;
use crate::tiles::Grid;
use crate::timing::{Clock, Part, Timing};

pub(crate) struct Dstmd {
    p: Series,
    l: Plane,
    retina: Retina,
    lamina: Lamina,
    lamina_inhibition: LaminaInhibition,
    medulla: Medulla,
    lobula: Lobula,
    rejection: Rejection<DIRECTIONS>,
    readout: Readout,
}

heap!(Dstmd { p, l, retina, lamina, lamina_inhibition, medulla, lobula, rejection, readout });
remember!(Dstmd { p, lamina, lamina_inhibition, medulla, rejection });
scrolls!(Dstmd { p, lamina, lamina_inhibition, medulla });

impl Dstmd {
    pub fn new(size: Size, params: &Params, threads: usize) -> Self {
        let engine = params.engine.temporal;
        Self {
            p: Series::new(size, 1),
            l: Plane::new(size),
            retina: Retina::new(&params.retina, threads),
            lamina: Lamina::new(size, &params.lamina, engine, threads),
            lamina_inhibition: LaminaInhibition::new(size, &params.lamina_inhibition, threads),
            medulla: Medulla::new(size, &params.medulla, engine, threads, 1),
            lobula: Lobula::new(size, params, threads),
            rejection: Rejection::new(size, params, 1),
            readout: Readout::new(size, threads),
        }
    }

    /// Forgets the earlier frames.
    fn forget(&mut self) {
        self.l.fill(0.0);
        self.lamina.reset();
        self.lamina_inhibition.reset();
        self.medulla.reset();
        self.lobula.reset();
    }
}

impl Wiring for Dstmd {
    fn step(&mut self, bands: &Bands, luminance: &Plane, response: &mut Response, timing: Option<&mut Timing>) {
        let mut clock = Clock::start(timing);
        self.p.begin(1);
        self.retina.process(bands, luminance, &mut self.p.maps_mut()[0]);
        if self.rejection.look(bands, self.p.last(), 0) {
            self.forget();
        }
        clock.lap(Part::Retina);
        let Self { p, l, lamina, lamina_inhibition, medulla, lobula, rejection, readout, .. } = self;
        lamina.process(bands, (p, None), from_mut(l));
        lamina_inhibition.process(bands, l);
        clock.lap(Part::Lamina);
        let l1 = &lamina_inhibition.l1;
        medulla.process(bands, from_ref(l1));
        clock.lap(Part::Medulla);
        lobula.process(bands, l1, medulla.frame(0));
        clock.lap_tiles(Part::Lobula, lobula.tiles());
        clock.count_tiles(Grid::new(p.last().size()).count());
        rejection.follow(bands, p.last(), 0);
        rejection.process(bands, p.last(), 0, &lobula.responses(l1, medulla.frame(0)));
        clock.lap(Part::Rejection);
        readout.process(bands, rejection, &lobula.e, response);
        clock.lap(Part::Facilitation);
    }

    fn front(&mut self) -> (&mut Retina, &mut Background) {
        (&mut self.retina, &mut self.rejection.background)
    }

    fn stage(&self, bands: &Bands, stage: Stage) -> Option<Array3<f32>> {
        Some(match stage {
            Stage::P => self.p.last().view3().to_owned(),
            Stage::C => self.rejection.contrast.map(self.p.last()),
            Stage::L => self.l.view3().to_owned(),
            Stage::L1 => self.lamina_inhibition.l1.view3().to_owned(),
            Stage::Tm3 => part(&self.lamina_inhibition.l1, Prepare::Positive),
            Stage::Tm2 => part(&self.lamina_inhibition.l1, Prepare::Negative),
            Stage::Mi1 => self.medulla.mi1[0].view3().to_owned(),
            Stage::Tm1_4 => self.medulla.tm1_4[0].view3().to_owned(),
            Stage::Tm1_5 => self.medulla.tm1_5[0].view3().to_owned(),
            Stage::D => self.lobula.correlation(&self.lamina_inhibition.l1, self.medulla.frame(0)),
            Stage::E => everywhere(
                bands,
                self.l.size(),
                &self.lobula.responses(&self.lamina_inhibition.l1, self.medulla.frame(0)),
            ),
            Stage::Ep => stack(self.rejection.kept(&self.lobula.e)),
            _ => return None,
        })
    }

    fn look_in(&mut self, region: Option<&Region>) {
        let asked = self.rejection.look_in(region);
        self.lobula.look_in(asked.as_ref());
    }

    fn reset(&mut self) {
        self.p.fill(0.0);
        self.forget();
        self.rejection.reset();
    }
}
