//! DSTMD (Wang et al. 2018): an STMD with directions behind lateral inhibition in the lamina.

use ndarray::Array3;

use super::{Wiring, everywhere, part, stack};
use crate::DIRECTIONS;
use crate::detection::Response;
use crate::frame::Size;
use crate::memory::heap;
use crate::params::Params;
use crate::plane::Plane;
use crate::probe::Stage;
use crate::row::bands::Bands;
use crate::row::recurse::Prepare;
use crate::stage::lamina::Lamina;
use crate::stage::lamina_inhibition::LaminaInhibition;
use crate::stage::lobula::Lobula;
use crate::stage::medulla::Medulla;
use crate::stage::readout::Readout;
use crate::stage::rejection::Rejection;
use crate::stage::retina::Retina;
use crate::tiles::Grid;
use crate::timing::{Clock, Part, Timing};

pub(crate) struct Dstmd {
    p: Plane,
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

impl Dstmd {
    pub fn new(size: Size, params: &Params, threads: usize) -> Self {
        let engine = params.engine.temporal;
        Self {
            p: Plane::new(size),
            l: Plane::new(size),
            retina: Retina::new(&params.retina, threads),
            lamina: Lamina::new(size, &params.lamina, engine),
            lamina_inhibition: LaminaInhibition::new(size, &params.lamina_inhibition, threads),
            medulla: Medulla::new(size, &params.medulla, engine),
            lobula: Lobula::new(size, params, threads),
            rejection: Rejection::new(size, params),
            readout: Readout::new(size, threads),
        }
    }
}

impl Wiring for Dstmd {
    fn step(&mut self, bands: &Bands, luminance: &Plane, response: &mut Response, timing: Option<&mut Timing>) {
        let Self { p, l, retina, lamina, lamina_inhibition, medulla, lobula, rejection, readout } = self;
        let mut clock = Clock::start(timing);
        retina.process(bands, luminance, p);
        clock.lap(Part::Retina);
        lamina.process(bands, (p, None), l);
        lamina_inhibition.process(bands, l);
        clock.lap(Part::Lamina);
        let l1 = &lamina_inhibition.l1;
        medulla.process(bands, l1);
        clock.lap(Part::Medulla);
        lobula.process(bands, l1, medulla);
        clock.lap_tiles(Part::Lobula, lobula.tiles());
        clock.count_tiles(Grid::new(p.size()).count());
        rejection.follow(p);
        rejection.process(bands, p, &lobula.responses(l1, medulla));
        clock.lap(Part::Rejection);
        readout.process(bands, rejection, &lobula.e, response);
        clock.lap(Part::Facilitation);
    }

    fn stage(&self, bands: &Bands, stage: Stage) -> Option<Array3<f32>> {
        Some(match stage {
            Stage::P => self.p.view3().to_owned(),
            Stage::C => self.rejection.contrast.map(&self.p),
            Stage::L => self.l.view3().to_owned(),
            Stage::L1 => self.lamina_inhibition.l1.view3().to_owned(),
            Stage::Tm3 => part(&self.lamina_inhibition.l1, Prepare::Positive),
            Stage::Tm2 => part(&self.lamina_inhibition.l1, Prepare::Negative),
            Stage::Mi1 => self.medulla.mi1.view3().to_owned(),
            Stage::Tm1_4 => self.medulla.tm1_4.view3().to_owned(),
            Stage::Tm1_5 => self.medulla.tm1_5.view3().to_owned(),
            Stage::D => self.lobula.correlation(&self.lamina_inhibition.l1, &self.medulla),
            Stage::E => {
                everywhere(bands, self.l.size(), &self.lobula.responses(&self.lamina_inhibition.l1, &self.medulla))
            }
            Stage::Ep => stack(self.rejection.kept(&self.lobula.e)),
            _ => return None,
        })
    }

    fn reset(&mut self) {
        self.p.fill(0.0);
        self.l.fill(0.0);
        self.lamina.reset();
        self.lamina_inhibition.reset();
        self.medulla.reset();
        self.lobula.reset();
        self.rejection.reset();
    }
}
