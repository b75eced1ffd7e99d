use super::*;
use crate::params::{Gate, Model, Preset, RejectionMode, TemporalEngine};
use crate::stage::background::Motion;

const SIZE: Size = Size { height: 112, width: 144 };

/// P of a world of blocks at rest before which a dark target moves, seen from `origin` on.
fn view(t: usize, origin: (isize, isize)) -> Plane {
    let mut p = Plane::new(SIZE);
    let target = (60.0 + 1.0 * t as f64, 70.0 - 0.4 * t as f64);
    for y in 0..SIZE.height {
        for (x, out) in p.row_mut(y).iter_mut().enumerate() {
            let (u, v) = (x as isize + origin.0, y as isize + origin.1);
            let block = 0.5 + 0.06 * ((u.div_euclid(7) * 5 + v.div_euclid(6) * 3).rem_euclid(7)) as f64;
            let distance = (u as f64 - target.0).hypot(v as f64 - target.1);
            *out = (block * (1.0 - 0.9 * (-(distance / 2.5).powi(2)).exp())) as f32;
        }
    }
    p
}

fn sharing(params: &Params) -> Detector {
    let mut detector = Detector::with_threads(SIZE, params, 1).unwrap();
    detector.share();
    detector
}

/// What moves in the world is seen alike from a camera at rest and from one that moves, whose memory goes along: as far from the
/// borders as the kernels reach, beyond which each sees something else.
fn is_seen_alike(params: &Params, margin: usize) {
    let mut params = params.clone();
    // What is negligible depends on where the tiles lie.
    params.prediction.negligible = 0.0;
    let params = &params;
    let (mut resting, mut moving) = (sharing(params), sharing(params));
    let (mut seen, mut carried) = (resting.make_response(), moving.make_response());
    let (bands, mut timing) = (Bands::single(), Timing::default());
    let mut before = (0isize, 0isize);
    let tolerance = if matches!(params.model, Model::Cascaded | Model::Estmd) { 1e-4 } else { 1e-5 };
    let mut compared = 0;
    for t in 0..56usize {
        // Left and right by up to five a frame, down and up, across the edges of tiles.
        let sway = |period: usize, most: isize| {
            most - (t as isize * 3 % (2 * period as isize) - period as isize).abs() * most / period as isize
        };
        let origin = if t < 8 { (0, 0) } else { (sway(11, 20) - 9, sway(17, 14) - 6) };
        let by = (before.0 - origin.0, before.1 - origin.1);
        before = origin;
        let still = Finding::nothing(SIZE);
        let found = Finding { motion: Motion { shift: (by.0 as f64, by.1 as f64), ..still.motion }, ..still };
        let (at_rest, along) = (view(t, (0, 0)), view(t, origin));
        resting.process_seen(&bands, (&Scroll::none(&at_rest), &still), &mut seen, &mut timing);
        moving.process_seen(&bands, (&Scroll { by, ..Scroll::none(&along) }, &found), &mut carried, &mut timing);
        let most = seen.map.iter().fold(0.0f32, |most, value| most.max(*value));
        for y in margin..SIZE.height - margin {
            for x in margin..SIZE.width - margin {
                let place = [y as isize - origin.1, x as isize - origin.0];
                let inside =
                    |place: isize, length: usize| (margin as isize..(length - margin) as isize).contains(&place);
                if !inside(place[0], SIZE.height) || !inside(place[1], SIZE.width) {
                    continue;
                }
                let (one, other) = (seen.map[[y, x]], carried.map[place.map(|place| place as usize)]);
                // f32 sums in another order, of which the older models multiply differences.
                assert!(
                    (one - other).abs() <= tolerance * most,
                    "{}, frame {t}, ({x}, {y}): {one} {other} of {most}",
                    params.model
                );
                compared += usize::from(one > 0.01 * most && most > 0.0);
            }
        }
    }
    assert!(compared > 500, "{}: nothing to compare: {compared}", params.model);
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn memory_goes_along_with_the_world() {
    let practical = Params::preset(Preset::Practical).for_speed(1.0).unwrap();
    is_seen_alike(&practical, 30);
    for &model in Model::ALL {
        for temporal in [TemporalEngine::Cascade, TemporalEngine::Fir] {
            let mut params = if model == Model::ApgStmd { practical.clone() } else { Params::for_model(model) };
            params.engine.temporal = temporal;
            params.attention.gate = Gate::Luminance;
            // Which trace is confirmed may hang on what lies beyond the borders.
            params.rejection.mode = RejectionMode::Off;
            is_seen_alike(&params, 30);
        }
    }
}
