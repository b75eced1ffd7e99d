//! How far behind a target its response peaks, and how strong it is, measured at construction on an ideal target.

use ndarray::Array2;

use super::wire;
use crate::detection::Response;
use crate::frame::{Frame, Size};
use crate::params::{BackgroundMotion, Localise, Model, Params, RejectionMode};
use crate::plane::Plane;
use crate::row::bands::Bands;
use crate::row::machine::SimdLevel;

/// Side of the target, px.
pub(crate) const SIDE: f64 = 5.0;
/// From the border to the target's centre: beyond the lateral kernel and the neighbourhood of a peak.
const CLEAR: f64 = 20.0;
/// Path over which the lag is averaged, px: whole pixels, so that every sub-pixel place counts.
const MEASURED: f64 = 4.0;
/// Longest path on which filters are waited for, px. Filters that fit the speed have settled on an eighth of it; slow ones
/// behind a fast target would take hours, and a picture wider than any there is.
const LONGEST: f64 = 256.0;
/// Most frames in any case.
const MOST_FRAMES: f64 = 4000.0;

/// Mean distance from the centre of a black 5 x 5 target on white, moving at the tuned speed to the right, back to the
/// peak of its response, px; 0 where detections are not moved, where the parameters give no response, and without
/// directions, along which to move. Each frame is the mean of `taken` frames, the last of which counts.
pub(crate) fn measure(params: &Params, simd: SimdLevel, taken: usize) -> f32 {
    if params.detection.localise == Localise::Response || !params.model.is_directional() {
        return 0.0;
    }
    let mut params = params.clone();
    params.rejection.mode = RejectionMode::Off;
    params.attention.enabled = false;
    params.prediction.enabled = false;
    params.detection.threshold = 0.0;
    params.detection.max_peaks = 1;
    let (mut sum, mut count) = (0.0, 0.0);
    follow(&params, simd, (1.0, taken), filters_settle(&params), |center, response| {
        if let Some(peak) = response.detections.first() {
            sum += center - f64::from(peak.x);
            count += 1.0;
        }
    });
    if count == 0.0 { 0.0 } else { (sum / count) as f32 }
}

/// Mean response Q to the same target, of Weber contrast `contrast`, once everything has settled, rejection, attention and
/// prediction as in `params`; 0 where it is not detected. Each frame is the mean of `taken` frames.
pub(crate) fn response(params: &Params, simd: SimdLevel, contrast: f64, taken: usize) -> f32 {
    // Of what F keeps of earlier predictions, (1 - mu) a horizon, a few thousandths are left.
    let kept = (1.0 - params.prediction.mu).clamp(0.0, 0.9);
    let horizons = if kept > 0.0 { (0.003f64.ln() / kept.ln()).ceil() + 2.0 } else { 2.0 };
    // All there is to be seen is the target: taken for the background, it would be at rest.
    let mut params = params.clone();
    params.rejection.background = BackgroundMotion::Off;
    let params = &params;
    let rejection = f64::from(params.motion_window().max(params.rejection.contrast_window));
    let settle = filters_settle(params) + horizons * params.horizon() as f64 + rejection;
    let (mut sum, mut count) = (0.0, 0.0);
    follow(params, simd, (contrast, taken), settle, |_, response| {
        sum += response.detections.first().map_or(0.0, |found| f64::from(found.score));
        count += 1.0;
    });
    if count == 0.0 { 0.0 } else { (sum / count) as f32 }
}

/// Shows a dark target on white that moves to the right, and tells `see` the column of its centre and what a model found
/// over whole pixels, after `settle` frames.
fn follow(
    params: &Params,
    simd: SimdLevel,
    (contrast, taken): (f64, usize),
    settle: f64,
    mut see: impl FnMut(f64, &Response),
) {
    let speed = tuned_speed(params);
    let settle = settle.ceil().min(MOST_FRAMES);
    let (size, frames) = strip(speed, settle);
    let (mut model, mut luminance) = (wire(size, params, 1, 1), Plane::new(size));
    let most = params.detection.max_peaks as usize;
    let (bands, mut response) = (Bands::new(1, simd, false), Response::new(size, most));
    for t in 0..frames {
        let center = CLEAR + speed * t as f64;
        let at = |index: usize| center - speed * index as f64 / taken as f64;
        let mean = |x: usize| (0..taken).map(|index| covered(x as f64, at(index))).sum::<f64>() / taken as f64;
        let across: Vec<f64> = (0..size.width).map(mean).collect();
        let frame = Array2::from_shape_fn((size.height, size.width), |(y, x)| {
            1.0 - (contrast * across[x] * covered(y as f64, CLEAR)) as f32
        });
        let frame = Frame::from(frame.view());
        frame.write_luminance(&mut luminance).expect("the frame has the size of the model and luminance in [0, 1]");
        model.step(&bands, &luminance, &mut response, None);
        if t as f64 >= settle {
            see(center, &response);
        }
    }
}

/// Size of the pictures that a target crosses at this speed, and how many there are.
fn strip(speed: f64, settle: f64) -> (Size, usize) {
    let frames = settle + (MEASURED / speed).ceil().max(4.0);
    (Size::new((2.0 * CLEAR + SIDE) as usize, (2.0 * CLEAR + speed * frames).ceil() as usize), frames as usize)
}

/// Frames after which the gamma filters have settled to a few thousandths, three time constants, as far as the path allows.
fn filters_settle(params: &Params) -> f64 {
    (3.0 * slowest(params)).min(LONGEST / tuned_speed(params))
}

/// The speed at which a target covers the distance of the two pixels in the delay between their signals, px/frame. In the
/// lobula at the defaults that is 12 frames, four fifths of tau_3, and the speed is v_opt; where the horizon is rounded to
/// whole frames v_opt is not. The motion detectors have 3 px and 12 frames as well.
pub(crate) fn tuned_speed(params: &Params) -> f64 {
    let (distance, delay) = match params.model {
        Model::Cascaded => (params.emd.spacing, params.emd.tau),
        _ => (params.lobula.spacing, 0.8 * params.medulla.mi1_tau),
    };
    (distance / delay).clamp(0.01, 32.0)
}

/// Largest time constant that the response depends on, frames.
fn slowest(params: &Params) -> f64 {
    let Params { lamina, lamina_inhibition, medulla, .. } = params;
    let before = match params.model {
        Model::ApgStmd | Model::StmdPlus => lamina.slow_tau,
        Model::Dstmd | Model::Cascaded | Model::Estmd => {
            lamina.slow_tau + lamina_inhibition.excitation_tau.max(lamina_inhibition.inhibition_tau)
        }
    };
    let after = match params.model {
        Model::ApgStmd | Model::StmdPlus | Model::Dstmd => {
            medulla.mi1_tau.max(medulla.tm1_4_tau).max(medulla.tm1_5_tau)
        }
        Model::Cascaded | Model::Estmd => params.estmd.off_tau + params.emd.tau,
    };
    before.max(after)
}

/// Share of the pixel at `x` that the target around `center` covers.
pub(crate) fn covered(x: f64, center: f64) -> f64 {
    ((x + 0.5).min(center + SIDE / 2.0) - (x - 0.5).max(center - SIDE / 2.0)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::Preset;

    /// Slow filters behind a fast target, and behind a slow one: a detector is made in seconds, and takes little memory for it.
    #[test]
    fn the_strip_is_bounded() {
        for model in Model::ALL {
            for spacing in [1.0, 3.0, 32.0] {
                for delay in [0.01, 0.1, 1.0, 5.0, 500.0] {
                    let mut params = Params::for_model(*model);
                    (params.lobula.spacing, params.emd.spacing) = (spacing, spacing);
                    (params.medulla.mi1_tau, params.emd.tau) = (delay, delay);
                    (params.lamina.slow_tau, params.lamina_inhibition.inhibition_tau) = (500.0, 500.0);
                    params.validate().unwrap();
                    let (size, frames) = strip(tuned_speed(&params), filters_settle(&params).ceil().min(MOST_FRAMES));
                    assert!(size.width <= 500 && frames <= 4400, "{model} {spacing} {delay}: {size}, {frames} frames");
                }
            }
        }
    }

    #[test]
    fn filters_that_fit_the_speed_settle_wholly() {
        for speed in [0.05, 0.25, 1.0, 8.0, 32.0] {
            for model in Model::ALL {
                let params = Params::for_model(*model).for_speed(speed).unwrap();
                assert_eq!(filters_settle(&params), 3.0 * slowest(&params), "{model} at {speed}");
            }
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn the_ideal_target_is_not_taken_for_the_background() {
        for speed in [1.0, 2.0, 8.0] {
            let response = |background| {
                let mut params = Params::preset(Preset::Practical).for_speed(speed).unwrap();
                params.rejection.background = background;
                response(&params, SimdLevel::best(), 1.0, 1)
            };
            let still = response(BackgroundMotion::Off);
            assert!(still > 0.0);
            assert_eq!(response(BackgroundMotion::Similarity), still, "{speed} px/frame");
        }
    }
}
