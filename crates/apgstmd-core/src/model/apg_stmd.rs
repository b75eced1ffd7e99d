//! Placeholder wiring while the stages are written.
use ndarray::Array3;

use crate::detection::Response;
use crate::error::FrameError;
use crate::frame::{Frame, Size};
use crate::params::Params;
use crate::plane::Plane;
use crate::probe::Stage;
use crate::row::workers::Bands;

pub(crate) struct ApgStmd {
    params: Params,
    input: Plane,
    frames: u64,
}
impl ApgStmd {
    pub fn new(size: Size, params: &Params) -> Self {
        Self { params: params.clone(), input: Plane::new(size), frames: 0 }
    }
    pub fn size(&self) -> Size {
        self.input.size()
    }
    pub fn params(&self) -> &Params {
        &self.params
    }
    pub fn frames(&self) -> u64 {
        self.frames
    }
    pub fn latency(&self) -> usize {
        0
    }
    pub fn lag(&self) -> f32 {
        0.0
    }
    pub fn take(&mut self, frame: Frame<'_>) -> Result<(), FrameError> {
        frame.write_luminance(&mut self.input)
    }
    pub fn step(&mut self, _bands: &Bands<'_>, response: &mut Response) {
        self.frames += 1;
        response.detections.clear();
    }
    pub fn stage(&self, stage: Stage) -> Array3<f32> {
        Array3::zeros((stage.planes(), self.size().height, self.size().width))
    }
    pub fn reset(&mut self) {
        self.frames = 0;
    }
}
