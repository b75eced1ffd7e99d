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
    use crate::{Detector, Params, Preset, Size};

    /// Every kernel at work, on one thread and on two, small enough for Miri.
    #[test]
    fn a_whole_small_detector() {
        let mut params = Params::preset(Preset::Practical).for_speed(4.0).unwrap();
        // Else the lag is measured first, on many frames.
        params.detection.localise = Localise::Response;
        let size = Size::new(16, 17);
        let [mut one, mut two] = [1, 2].map(|threads| Detector::with_threads(size, &params, threads).unwrap());
        for t in 0..3 {
            let frame = Array2::from_shape_fn((16, 17), |(y, x)| {
                if x.abs_diff(4 + 4 * t) < 2 && y.abs_diff(8) < 2 { 0u8 } else { 200 + (x % 3) as u8 }
            });
            let [a, b] = [&mut one, &mut two].map(|detector| detector.process(frame.view()).unwrap());
            assert!(a.map.iter().all(|value| value.is_finite()) && a.map == b.map);
        }
    }
}
