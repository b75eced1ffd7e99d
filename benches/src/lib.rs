//! Scenes and detectors that the benchmarks share.

pub mod matrix;

use apgstmd_core::stimulus::{Renderer, Scene};
use apgstmd_core::{Detector, Machine, Params, Preset, Response, Size};
use ndarray::Array2;

/// Targets crossing natural clutter that moves, as many frames as are cycled through.
pub fn clutter(size: Size) -> Vec<Array2<f32>> {
    // As many as 256 MB hold.
    clutter_of(size, ((1 << 26) / size.area()).clamp(8, 64))
}

/// As [`clutter`], with a number of frames.
pub fn clutter_of(size: Size, frames: usize) -> Vec<Array2<f32>> {
    let scene = Scene { width: size.width, height: size.height, frames, ..Scene::demo() };
    render(&scene)
}

/// The same picture again and again.
pub fn still(size: Size) -> Vec<Array2<f32>> {
    clutter(size)[..1].to_vec()
}

fn render(scene: &Scene) -> Vec<Array2<f32>> {
    let renderer = Renderer::new(scene).expect("the scene is valid");
    (0..scene.frames).map(|t| renderer.frame(t)).collect()
}

/// The command line's default at 1 px/frame.
pub fn practical() -> Params {
    Params::preset(Preset::Practical).for_speed(1.0).expect("1 px/frame is in range")
}

/// A detector with frames to cycle through, already past its horizon.
pub struct Running {
    /// The detector.
    pub detector: Detector,
    /// Its output.
    pub response: Response,
    frames: Vec<Array2<f32>>,
    next: usize,
}

impl Running {
    /// Runs `warm_up` frames.
    pub fn new(params: &Params, threads: usize, frames: Vec<Array2<f32>>, warm_up: usize) -> Self {
        Self::with_machine(params, &Machine::with_threads(threads), frames, warm_up)
    }

    /// As `new`, with a choice of instruction set.
    pub fn with_machine(params: &Params, machine: &Machine, frames: Vec<Array2<f32>>, warm_up: usize) -> Self {
        let (height, width) = frames[0].dim();
        let detector = Detector::with_options(Size::new(height, width), params, machine).expect("valid parameters");
        let response = detector.make_response();
        let mut running = Self { detector, response, frames, next: 0 };
        for _ in 0..warm_up {
            running.step();
        }
        running
    }

    /// The next frame of the cycle; forth and back, so that nothing jumps.
    pub fn frame(&mut self) -> Array2<f32> {
        let last = self.frames.len() - 1;
        let place = if last == 0 { 0 } else { self.next % (2 * last) };
        self.next += 1;
        self.frames[place.min(2 * last - place)].clone()
    }

    /// One frame through the detector.
    pub fn step(&mut self) {
        let frame = self.frame();
        self.detector.process_into(frame.view(), &mut self.response).expect("frames of the right size");
    }
}

/// Time that this thread was running, ms: what others take of the machine does not count.
pub fn cpu_ms() -> f64 {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    stat.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(0.0) / 1e6
}
