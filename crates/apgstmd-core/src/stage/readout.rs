//! Readout: the response, direction and detections of a frame. Without prediction Q = E'.
//!
//! Input: E', in 8 directions or in one map that has none, and the confirmed peaks. Output: [`Response`]. No state.

use crate::DIRECTIONS;
use crate::detection::{Detection, Response};
use crate::direction::of_vector_sum;
use crate::filter::peaks::Peak;
use crate::plane::Plane;
use crate::row::bands::{Bands, Rows};
use crate::stage::rejection::Rejection;

/// Maps and detections of a model without prediction.
pub(crate) fn show<const N: usize>(bands: &Bands, rejection: &Rejection<N>, e: &[Plane; N], response: &mut Response) {
    let kept = rejection.kept(e);
    let width = kept[0].size().width;
    let maps = [&mut response.map, &mut response.direction]
        .map(|map| Rows { data: map.as_slice_mut().expect("make_response makes contiguous maps"), stride: width });
    bands.over(kept[0].size().height, maps, |range, [mut map, mut direction]| {
        for (row, y) in range.enumerate() {
            let (map, direction) = (map.row(row), direction.row(row));
            let kept = kept.each_ref().map(|plane| plane.row(y));
            direction.fill(f32::NAN);
            for x in 0..width {
                let q = kept.map(|row| row[x]);
                map[x] = largest(&q);
                if map[x] > 0.0 {
                    direction[x] = direction_of(&q);
                }
            }
        }
    });
    report(rejection, |peak| kept.each_ref().map(|plane| plane.row(peak.y)[peak.x]), response);
}

/// Detections: the confirmed peaks, strongest response first. `q` is the response at a peak.
pub(crate) fn report<const N: usize>(rejection: &Rejection<N>, q: impl Fn(&Peak) -> [f32; N], response: &mut Response) {
    let (shift_x, shift_y) = rejection.shift();
    response.background_shift = (shift_x as f32, shift_y as f32);
    response.detections.clear();
    response.detections.extend(rejection.confirmed.iter().map(|(peak, trace)| {
        let q = q(peak);
        let score = largest(&q);
        Detection { x: peak.sub_x, y: peak.sub_y, score, direction: direction_of(&q), trace: *trace }
    }));
    response.detections.sort_unstable_by(|a, b| b.score.total_cmp(&a.score).then(a.trace.cmp(&b.trace)));
}

fn largest<const N: usize>(q: &[f32; N]) -> f32 {
    q.iter().copied().fold(0.0, f32::max)
}

/// NaN where the model has no directions.
fn direction_of<const N: usize>(q: &[f32; N]) -> f32 {
    <&[f32; DIRECTIONS]>::try_from(&q[..]).map_or(f32::NAN, of_vector_sum)
}
