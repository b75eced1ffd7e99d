//! Readout: the response, direction and detections of a frame. Without prediction Q = E'.
//!
//! Input: E', in 8 directions or in one map that has none, and the confirmed peaks. Output: [`Response`]. No state. Rows
//! in which nothing was kept cost one look.

use crate::DIRECTIONS;
use crate::detection::{Detection, EgoMotion, Response};
use crate::direction::of_vector_sum;
use crate::filter::peaks::Peak;
use crate::frame::Size;
use crate::memory::heap;
use crate::plane::{Plane, padded};
use crate::row::bands::{Bands, Rows, Scratch};
use crate::row::mix::summarise;
use crate::stage::background::Finding;
use crate::stage::rejection::Rejection;

/// Maps and detections of a model without prediction.
pub(crate) struct Readout {
    /// One row of each map, with its padding.
    scratch: Scratch<[Vec<f32>; 2]>,
}

heap!(Readout { scratch });

impl Readout {
    pub fn new(size: Size, threads: usize) -> Self {
        Self { scratch: Scratch::new(threads, || [0, 1].map(|_| vec![0.0; padded(size.width)])) }
    }

    pub fn process<const N: usize>(
        &self,
        bands: &Bands,
        rejection: &Rejection<N>,
        e: &[Plane; N],
        response: &mut Response,
    ) {
        let kept = rejection.kept(e);
        let Size { height, width } = kept[0].size();
        let maps = [&mut response.map, &mut response.direction]
            .map(|map| Rows { data: map.as_slice_mut().expect("make_response makes contiguous maps"), stride: width });
        bands.over(height, maps, |range, [mut map, mut direction]| {
            self.scratch.with(bands, |[largest, angle]| {
                for (row, y) in range.enumerate() {
                    let (map, direction) = (map.row(row), direction.row(row));
                    let any = |plane: &Plane| plane.row(y).iter().fold(0, |any, value| any | value.to_bits()) != 0;
                    if !kept.iter().any(any) {
                        map.fill(0.0);
                        direction.fill(f32::NAN);
                        continue;
                    }
                    let kept = kept.each_ref().map(|plane| plane.padded_row(y));
                    if let Ok(q) = <[&[f32]; DIRECTIONS]>::try_from(&kept[..]) {
                        summarise(bands.level(), q, largest, angle);
                        map.copy_from_slice(&largest[..width]);
                        direction.copy_from_slice(&angle[..width]);
                    } else {
                        map.copy_from_slice(&kept[0][..width]);
                        direction.fill(f32::NAN);
                    }
                }
            });
        });
        report(rejection, |peak| kept.each_ref().map(|plane| plane.row(peak.y)[peak.x]), response);
    }
}

/// What the background did.
pub(crate) fn tell(found: &Finding, response: &mut Response) {
    let Finding { motion, residual, unexplained, cut } = *found;
    response.background_shift = (motion.shift.0 as f32, motion.shift.1 as f32);
    let (rotation, zoom) = (motion.rotation() as f32, motion.zoom() as f32);
    response.ego_motion = EgoMotion { rotation, zoom, residual, unexplained };
    response.cut = cut;
}

/// Detections: the confirmed peaks, strongest response first. `q` is the response at a peak.
pub(crate) fn report<const N: usize>(rejection: &Rejection<N>, q: impl Fn(&Peak) -> [f32; N], response: &mut Response) {
    tell(rejection.background(), response);
    response.detections.clear();
    response.detections.extend(rejection.confirmed.iter().map(|(peak, evidence)| {
        let q = q(peak);
        let score = largest(&q);
        Detection {
            x: peak.sub_x,
            y: peak.sub_y,
            score,
            direction: direction_of(&q),
            trace: evidence.trace,
            points: evidence.points,
            straightness: evidence.course.straightness,
            displacement: evidence.course.displacement,
            velocity: evidence.course.velocity,
            ..Detection::default()
        }
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
