//! The machine: threads over bands of rows, instruction sets inside a row. Knows nothing of filters or neurons.

pub(crate) mod bands;
pub(crate) mod convolve;
pub(crate) mod lateral;
mod load_store;
pub(crate) mod machine;
pub(crate) mod mix;
pub(crate) mod opponent;
pub(crate) mod recurse;
pub(crate) mod speckle;
pub(crate) mod tile;
pub(crate) mod warp;
pub(crate) mod workers;

#[cfg(test)]
mod tests {
    use ndarray::Array2;

    use crate::params::{BackgroundMotion, Localise};
    use crate::{Detector, Params, Preset, Response, Size, Timing};

    /// Every kernel at work, on one thread and on two; under Miri on two.
    #[test]
    fn a_whole_small_detector() {
        let mut params = Params::preset(Preset::Practical);
        // Else the lag is measured first, on many frames.
        params.detection.localise = Localise::Response;
        // Fast filters and small kernels: something is predicted of the fourth frame and attended to in the fifth.
        let Params { attention, lamina, medulla, lobula, rejection, prediction, detection, .. } = &mut params;
        (lamina.fast_tau, lamina.slow_tau) = (0.2, 0.6);
        (medulla.mi1_tau, medulla.tm1_4_tau, medulla.tm1_5_tau) = (1.0, 1.0, 1.0);
        (lamina.fast_order, lamina.slow_order) = (1, 1);
        (medulla.mi1_order, medulla.tm1_4_order, medulla.tm1_5_order) = (1, 1, 1);
        (lobula.radius, detection.peak_radius, attention.scales[0]) = (2, 2, 0.5);
        (prediction.horizon, prediction.v_opt, prediction.ring_width) = (1, 1.0, 0.3);
        (rejection.motion_min_points, rejection.motion_distance) = (2, 0.0);
        let size = Size::new(16, 17);
        if cfg!(miri) {
            // Tests of its own have that, and Miri takes a minute for a few thousand pixels.
            params.rejection.background = BackgroundMotion::Off;
        }
        let threads: &[usize] = if cfg!(miri) { &[2] } else { &[1, 2] };
        let mut detectors: Vec<Detector> =
            threads.iter().map(|threads| Detector::with_threads(size, &params, *threads).unwrap()).collect();
        let mut responses: Vec<Response> = detectors.iter().map(Detector::make_response).collect();
        let mut timing = Timing::default();
        for t in 0..5 {
            let frame = Array2::from_shape_fn((16, 17), |(y, x)| {
                if x.abs_diff(3 + 2 * t) < 2 && y.abs_diff(8) < 2 { 0u8 } else { 200 + (x % 3) as u8 }
            });
            for (detector, response) in detectors.iter_mut().zip(&mut responses) {
                detector.process_timed(frame.view(), response, &mut timing).unwrap();
                assert!(response.map.iter().all(|value| value.is_finite()));
            }
            assert!(responses.iter().all(|response| response.map == responses[0].map));
        }
        let tiles = [timing.inhibited_tiles(), timing.predicted_tiles(), timing.attended_tiles() as f64];
        assert!(tiles.iter().all(|count| *count > 0.0), "inhibition, prediction, attention in {tiles:?} tiles");
    }
}
