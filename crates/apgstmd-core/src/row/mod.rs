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

    use crate::params::Localise;
    use crate::{Detector, Params, Preset, Size, Timing};

    /// Every kernel at work, on one thread and on two, small enough for Miri.
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
        let [mut one, mut two] = [1, 2].map(|threads| Detector::with_threads(size, &params, threads).unwrap());
        let (mut a, mut b) = (one.make_response(), two.make_response());
        let mut timing = Timing::default();
        for t in 0..5 {
            let frame = Array2::from_shape_fn((16, 17), |(y, x)| {
                if x.abs_diff(3 + 2 * t) < 2 && y.abs_diff(8) < 2 { 0u8 } else { 200 + (x % 3) as u8 }
            });
            one.process_timed(frame.view(), &mut a, &mut timing).unwrap();
            two.process_into(frame.view(), &mut b).unwrap();
            assert!(a.map.iter().all(|value| value.is_finite()) && a.map == b.map);
        }
        let tiles = [timing.inhibited_tiles(), timing.predicted_tiles(), timing.attended_tiles() as f64];
        assert!(tiles.iter().all(|count| *count > 0.0), "inhibition, prediction, attention in {tiles:?} tiles");
    }
}
