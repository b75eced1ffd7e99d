//! How far behind a target its response peaks, measured once at construction on an ideal target.

use ndarray::Array2;

use super::ApgStmd;
use crate::detection::Response;
use crate::frame::Size;
use crate::params::{Localise, Params, RejectionMode};
use crate::row::bands::Bands;

const SIDE: f64 = 5.0;
/// From the border to the target's centre: beyond the lateral kernel and the neighbourhood of a peak.
const CLEAR: f64 = 20.0;
/// Path over which the lag is averaged, px: whole pixels, so that every sub-pixel place counts.
const MEASURED: f64 = 4.0;

/// Mean distance from the centre of a black 5 x 5 target on white, moving at the tuned speed to the right, back to the peak of its
/// response, px; 0 where the parameters give no response.
pub(super) fn measure(params: &Params) -> f32 {
    let mut params = params.clone();
    params.rejection.mode = RejectionMode::Off;
    params.attention.enabled = false;
    params.prediction.enabled = false;
    params.detection.threshold = 0.0;
    params.detection.max_peaks = 1;
    params.detection.localise = Localise::Response;
    let speed = tuned_speed(&params);
    let medulla = &params.medulla;
    let slowest =
        [medulla.mi1_tau, medulla.tm1_4_tau, medulla.tm1_5_tau, params.lamina.slow_tau].into_iter().fold(0.0, f64::max);
    // The gamma filters have settled to a few thousandths after three time constants.
    let settle = (3.0 * slowest).ceil().min(4000.0);
    let frames = settle + (MEASURED / speed).ceil().max(4.0);
    let size = Size::new((2.0 * CLEAR + SIDE) as usize, (2.0 * CLEAR + speed * frames).ceil() as usize);
    let mut model = ApgStmd::without_lag(size, &params, 1);
    let (bands, mut response) = (Bands::new(1), Response::new(size, 1));
    let (mut sum, mut count) = (0.0, 0.0);
    for t in 0..frames as usize {
        let center = CLEAR + speed * t as f64;
        let frame = Array2::from_shape_fn((size.height, size.width), |(y, x)| {
            1.0 - (covered(x as f64, center) * covered(y as f64, CLEAR)) as f32
        });
        model.take(frame.view().into()).expect("the frame has the size of the model and luminance in [0, 1]");
        model.step(&bands, &mut response, None);
        if let (Some(peak), true) = (response.detections.first(), t as f64 >= settle) {
            sum += center - f64::from(peak.x);
            count += 1.0;
        }
    }
    if count == 0.0 { 0.0 } else { (sum / count) as f32 }
}

/// The speed at which a target covers `spacing` in the delay between the two ON signals, px/frame. At the defaults that
/// is 12 frames, four fifths of tau_3, and the speed is v_opt; where the horizon is rounded to whole frames v_opt is not.
fn tuned_speed(params: &Params) -> f64 {
    (params.lobula.spacing / (0.8 * params.medulla.mi1_tau)).clamp(0.01, 32.0)
}

/// Share of the pixel at `x` that the target around `center` covers.
fn covered(x: f64, center: f64) -> f64 {
    ((x + 0.5).min(center + SIDE / 2.0) - (x - 0.5).max(center - SIDE / 2.0)).clamp(0.0, 1.0)
}
