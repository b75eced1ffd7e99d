//! What apg-STMD asks for, counted: multiply-adds and bytes a frame, stage by stage. The one place for both.
//!
//! A multiply-add counts once, so do a lone multiplication and a lone addition. Counted is what the algebra needs, not
//! what is executed: no halos around bands and tiles, no padding, no look-ups of what is zero. Bytes are those of maps and
//! states that pass between stages, read and written once each; what stays in a cache within a stage is free.
//! Sparse stages count by the tiles that were computed. A stage that finds zeros within its tiles may do less than is
//! counted here, and then shows more than it achieves.
//!
//! | stage | multiply-adds a pixel | bytes a pixel |
//! |---|---|---|
//! | retina | two passes of 2 r + 1 taps | P written, frame read |
//! | attention | in attended tiles, for each scale, 7 passes of 2 r + 1 taps (3 along x, 4 along y) | P read, P_e written; there, M and A besides |
//! | lamina | update and output, for each of n + 1 states | states read and written, P_e read, L written |
//! | medulla | the same for both cascades, Tm1 with two outputs | states read and written, L read, three maps written |
//! | lobula | 3 for D in each of 8 directions; in inhibited tiles and directions four passes of 2 r + 1 taps, the core, 8 between directions | four maps read, 8 + 1 written |
//! | rejection | Gauss-Newton, 16384 samples at most | P and the largest E read, P kept |
//! | prediction | in predicted tiles and directions (2 r + 1)^2 taps | there, E' and F(t - dt) read, F written |
//! | facilitation | in predicted tiles and directions dt + 1 | there, dt + 1 times F read; two maps written |

use apgstmd_core::{Model, Params, Size};

const F32: f64 = 4.0;
const DIRECTIONS: f64 = apgstmd_core::DIRECTIONS as f64;
/// Iterations of the background's estimate, each with residual, scale and step, and two more residuals.
const SHIFT_OPERATIONS: f64 = 4.0 * 22.0 + 2.0 * 6.0;
const SHIFT_SAMPLES: f64 = 16384.0;

/// Multiply-adds and bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Cost {
    pub operations: f64,
    pub bytes: f64,
}

/// Shares of all tiles (and, but for attention, directions) that sparse stages computed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Active {
    pub attention: f64,
    pub lobula: f64,
    pub prediction: f64,
}

/// Cost of a stage in a frame; none for stages that are not counted: those of the other models.
pub(super) fn of(stage: &str, size: Size, params: &Params, active: Active) -> Option<Cost> {
    if params.model != Model::ApgStmd {
        return None;
    }
    let area = size.area() as f64;
    let taps = |radius: f64| 2.0 * radius + 1.0;
    let dt = f64::from(params.prediction.horizon);
    let (operations, bytes) = match stage {
        "retina" => (2.0 * taps((4.0 * params.retina.sigma).ceil()), 2.0 * F32),
        "attention" => {
            let passes: f64 = params.attention.scales.iter().map(|sigma| 7.0 * taps((4.0 * sigma).ceil())).sum();
            (active.attention * passes, (2.0 + 2.0 * active.attention) * F32)
        }
        "lamina" => {
            let states = f64::from(params.lamina.fast_order.max(params.lamina.slow_order)) + 1.0;
            (2.0 * states + 1.0, (2.0 * states + 2.0) * F32)
        }
        "medulla" => {
            let [mi1, tm1_4, tm1_5] =
                [params.medulla.mi1_order, params.medulla.tm1_4_order, params.medulla.tm1_5_order]
                    .map(|order| f64::from(order) + 1.0);
            let tm1 = tm1_4.max(tm1_5);
            (mi1 + tm1 + mi1 + tm1_4 + tm1_5 + 3.0, (2.0 * (mi1 + tm1) + 4.0) * F32)
        }
        "lobula" => {
            const CORE: f64 = 21.0;
            let inhibition = 4.0 * taps(f64::from(params.lobula.radius)) + CORE + DIRECTIONS;
            (DIRECTIONS * (3.0 + active.lobula * inhibition), (4.0 + DIRECTIONS + 1.0) * F32)
        }
        "rejection" => (SHIFT_OPERATIONS * (SHIFT_SAMPLES / area).min(1.0), 3.0 * F32),
        "prediction" => {
            let reach = params.prediction.v_opt * dt + 3.0 * params.prediction.ring_width;
            (active.prediction * DIRECTIONS * taps(reach.ceil()).powi(2), active.prediction * DIRECTIONS * 3.0 * F32)
        }
        "facilitation" => {
            let gains = active.prediction * DIRECTIONS * (dt + 1.0);
            (gains, (gains + 2.0) * F32)
        }
        _ => return None,
    };
    Some(Cost { operations: operations * area, bytes: bytes * area })
}

#[cfg(test)]
mod tests {
    use apgstmd_core::Timing;

    use super::*;

    #[test]
    fn numbers_of_the_default_model() {
        let size = Size::new(100, 200);
        let active = Active { attention: 0.5, lobula: 0.25, prediction: 0.125 };
        let of = |stage: &str| of(stage, size, &Params::default(), active).unwrap();
        let a_pixel = |stage: &str| (of(stage).operations / 20_000.0, of(stage).bytes / 20_000.0);
        assert_eq!(a_pixel("retina"), (18.0, 8.0));
        // Radii 8, 10, 12, 14.
        assert_eq!(a_pixel("attention"), (0.5 * 7.0 * (17.0 + 21.0 + 25.0 + 29.0), 12.0));
        assert_eq!(a_pixel("lamina"), (15.0, 64.0));
        assert_eq!(a_pixel("medulla"), (13.0 + 4.0 + 6.0 + 9.0 + 3.0, 120.0));
        assert_eq!(a_pixel("lobula"), (24.0 + 0.25 * 8.0 * 89.0, 52.0));
        // R_p = 6.25, radius 13.
        assert_eq!(a_pixel("prediction"), (729.0, 12.0));
        assert_eq!(a_pixel("facilitation"), (26.0, 112.0));
    }

    #[test]
    fn every_stage_of_the_model_is_counted() {
        let size = Size::new(64, 64);
        for stage in Timing::PARTS {
            assert!(of(stage, size, &Params::default(), Active::default()).is_some(), "{stage}");
            assert!(of(stage, size, &Params::for_model(Model::Estmd), Active::default()).is_none());
        }
    }
}
