//! Cascaded (Wiederman & O'Carroll 2013): elementary motion detectors over ESTMDs.

use std::slice::from_mut;

use ndarray::Array3;

use super::{Wiring, stack};
use crate::DIRECTIONS;
use crate::detection::Response;
use crate::frame::Size;
use crate::memory::heap;
use crate::params::Params;
use crate::plane::{Plane, Series};
use crate::probe::Stage;
use crate::region::Region;
use crate::row::bands::Bands;
use crate::scroll::scrolls;
use crate::stage::background::Background;
use crate::stage::emd::Emd;
use crate::stage::estmd::Estmd;
use crate::stage::lamina::Lamina;
use crate::stage::lamina_inhibition::LaminaInhibition;
use crate::stage::readout::Readout;
use crate::stage::rejection::Rejection;
use crate::stage::retina::Retina;
use crate::state::remember;
use crate::timing::{Clock, Part, Timing};

pub(crate) struct Cascaded {
    p: Series,
    l: Plane,
    retina: Retina,
    lamina: Lamina,
    lamina_inhibition: LaminaInhibition,
    estmd: Estmd,
    emd: Emd,
    rejection: Rejection<DIRECTIONS>,
    readout: Readout,
}

heap!(Cascaded { p, l, retina, lamina, lamina_inhibition, estmd, emd, rejection, readout });
remember!(Cascaded { p, lamina, lamina_inhibition, estmd, emd, rejection });
scrolls!(Cascaded { p, lamina, lamina_inhibition, estmd, emd });

impl Cascaded {
    pub fn new(size: Size, params: &Params, threads: usize) -> Self {
        let engine = params.engine.temporal;
        Self {
            p: Series::new(size, 1),
            l: Plane::new(size),
            retina: Retina::new(&params.retina, threads),
            lamina: Lamina::new(size, &params.lamina, engine, threads),
            lamina_inhibition: LaminaInhibition::new(size, &params.lamina_inhibition, threads),
            estmd: Estmd::new(size, params, threads),
            emd: Emd::new(size, params),
            rejection: Rejection::new(size, params, 1),
            readout: Readout::new(size, threads),
        }
    }

    /// Forgets the earlier frames.
    fn forget(&mut self) {
        self.l.fill(0.0);
        self.lamina.reset();
        self.lamina_inhibition.reset();
        self.estmd.reset();
        self.emd.reset();
    }
}

impl Wiring for Cascaded {
    fn step(&mut self, bands: &Bands, luminance: &Plane, response: &mut Response, timing: Option<&mut Timing>) {
        let mut clock = Clock::start(timing);
        self.p.begin(1);
        self.retina.process(bands, luminance, &mut self.p.maps_mut()[0]);
        if self.rejection.look(bands, self.p.last(), 0) {
            self.forget();
        }
        clock.lap(Part::Retina);
        let Self { p, l, lamina, lamina_inhibition, estmd, emd, rejection, readout, .. } = self;
        lamina.process(bands, (p, None), from_mut(l));
        lamina_inhibition.process(bands, l);
        clock.lap(Part::Lamina);
        estmd.process(bands, &lamina_inhibition.l1);
        emd.process(bands, &estmd.y);
        clock.lap(Part::Lobula);
        rejection.follow(bands, p.last(), 0);
        rejection.process(bands, p.last(), 0, &(&emd.e, &emd.strongest));
        clock.lap(Part::Rejection);
        readout.process(bands, rejection, &emd.e, response);
        clock.lap(Part::Facilitation);
    }

    fn front(&mut self) -> (&mut Retina, &mut Background) {
        (&mut self.retina, &mut self.rejection.background)
    }

    fn stage(&self, _: &Bands, stage: Stage) -> Option<Array3<f32>> {
        Some(match stage {
            Stage::P => self.p.last().view3().to_owned(),
            Stage::C => self.rejection.contrast.map(self.p.last()),
            Stage::L => self.l.view3().to_owned(),
            Stage::L1 => self.lamina_inhibition.l1.view3().to_owned(),
            Stage::ON => self.estmd.on.view3().to_owned(),
            Stage::OFF => self.estmd.off.view3().to_owned(),
            Stage::OFFd => self.estmd.off_delayed.view3().to_owned(),
            Stage::Y => self.estmd.y.view3().to_owned(),
            Stage::Yd => self.emd.slow.view3().to_owned(),
            Stage::E => stack(&self.emd.e),
            Stage::Ep => stack(self.rejection.kept(&self.emd.e)),
            _ => return None,
        })
    }

    fn look_in(&mut self, region: Option<&Region>) {
        self.rejection.look_in(region);
    }

    fn reset(&mut self) {
        self.p.fill(0.0);
        self.forget();
        self.rejection.reset();
    }
}
