//! Wiring: one file a model, its stages in the order of the data flow.

mod apg_stmd;
mod cascaded;
mod dstmd;
mod estmd;
pub(crate) mod lag;
mod stmd_plus;

use ndarray::{Array3, ArrayView3, Axis, concatenate};

use crate::detection::Response;
use crate::frame::Size;
use crate::memory::{Heap, Memory};
use crate::params::{Model, Params};
use crate::plane::Plane;
use crate::probe::Stage;
use crate::region::Region;
use crate::row::bands::{Bands, Rows};
use crate::row::recurse::Prepare;
use crate::scroll::Scrolls;
use crate::stage::background::{Background, Finding};
use crate::stage::rejection::Responses;
use crate::stage::retina::Retina;
use crate::state::Remember;
use crate::tiles::{Area, TILE};
use crate::timing::Timing;

/// A model, wired: everything between luminance and response.
pub(crate) trait Wiring: Heap + Remember + Scrolls + Send + Sync {
    /// One time step. Detections stand where the response peaks.
    fn step(&mut self, bands: &Bands, luminance: &Plane, response: &mut Response, timing: Option<&mut Timing>);

    /// Several time steps, one response each: the same numbers as one by one.
    fn block(
        &mut self,
        bands: &Bands,
        luminance: &[Plane],
        responses: &mut [Response],
        mut timing: Option<&mut Timing>,
    ) {
        for (luminance, response) in luminance.iter().zip(responses) {
            self.step(bands, luminance, response, timing.as_deref_mut());
        }
    }

    /// Is given P from now on, and told before each step what is known of the background: other detectors see the same.
    fn share(&mut self) {
        let (retina, background) = self.front();
        retina.pass();
        background.listen();
    }

    /// Tells what the background does before the next step.
    fn tell(&mut self, found: &Finding) {
        self.front().1.tell(found);
    }

    /// What other detectors of the same frames have, too.
    fn front(&mut self) -> (&mut Retina, &mut Background);

    /// A stage of the last frame, (maps, rows, columns), if the model has it. `bands` is one thread.
    fn stage(&self, bands: &Bands, stage: Stage) -> Option<Array3<f32>>;

    /// Peaks elsewhere are none from now on.
    fn look_in(&mut self, region: Option<&Region>);

    /// As before the first frame.
    fn reset(&mut self);
}

/// The model that `params` name, for `together` frames at once. They are valid and `size` is large enough.
pub(crate) fn wire(size: Size, params: &Params, threads: usize, together: usize) -> Box<dyn Wiring> {
    match params.model {
        Model::ApgStmd => Box::new(apg_stmd::ApgStmd::new(size, params, threads, together)),
        Model::StmdPlus => Box::new(stmd_plus::StmdPlus::new(size, params, threads)),
        Model::Dstmd => Box::new(dstmd::Dstmd::new(size, params, threads)),
        Model::Cascaded => Box::new(cascaded::Cascaded::new(size, params, threads)),
        Model::Estmd => Box::new(estmd::Estmd::new(size, params, threads)),
    }
}

/// What [`wire`] comes to, about, found from two smaller ones: it grows with the tiles of a frame.
pub(crate) fn memory(size: Size, params: &Params, threads: usize, together: usize) -> Memory {
    let of = |side: usize| wire(Size::new(side, side), params, threads, together).heap();
    let tiles = |height: usize, width: usize| (height.div_ceil(TILE) * width.div_ceil(TILE)) as f64;
    // From 128 on what follows the background takes no more samples.
    let (small, large) = (of(128), of(256));
    let further = (tiles(size.height, size.width) - tiles(256, 256)) / (tiles(256, 256) - tiles(128, 128));
    let bytes = |small: usize, large: usize| (large as f64 + further * (large as f64 - small as f64)) as usize;
    Memory { bound: bytes(small.bound, large.bound), resident: bytes(small.resident, large.resident) }
}

/// Frames from the onset of a matched target to its complete response: the longest delay, and the horizon of the
/// prediction.
pub(crate) fn latency(params: &Params) -> usize {
    let delay = match params.model {
        Model::ApgStmd | Model::StmdPlus | Model::Dstmd => params.medulla.tm1_5_tau,
        Model::Cascaded => params.estmd.off_tau + params.emd.tau,
        Model::Estmd => params.estmd.off_tau,
    };
    delay.ceil() as usize + if params.model == Model::ApgStmd { params.horizon() } else { 0 }
}

fn stack<const N: usize>(planes: &[Plane; N]) -> Array3<f32> {
    let views: [ArrayView3<'_, f32>; N] = planes.each_ref().map(Plane::view3);
    concatenate(Axis(0), &views).expect("all planes of a stage have one size")
}

/// E in all of the picture.
fn everywhere<const N: usize>(bands: &Bands, size: Size, e: &impl Responses<N>) -> Array3<f32> {
    let mut planes: [Plane; N] = std::array::from_fn(|_| Plane::new(size));
    let stride = planes[0].stride();
    let mut out = planes.each_mut().map(|plane| Rows { data: plane.data_mut(), stride });
    let whole = Area { top: 0, left: 0, rows: size.height, columns: size.width };
    e.copy(bands, &whole, 0, &mut out);
    stack(&planes)
}

/// The positive or negative part of a signal.
fn part(signal: &Plane, sign: Prepare) -> Array3<f32> {
    signal.view3().mapv(|value| sign.apply(value))
}
