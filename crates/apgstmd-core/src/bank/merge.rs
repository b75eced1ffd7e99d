//! Detections of one target by several members become one: the best one's. Best first, each takes in what lies near it.
//!
//! The number of a trace in the bank is that of the best member's trace, or of another that is taken in; all that are
//! taken in have it from then on, so that it stays when another member becomes the best.

use super::member::{Candidate, Running};
use crate::detection::Detection;
use crate::memory::heap;
use crate::state::remember;

/// Within so many px of the full picture detections at scale 1 are of one target.
const NEAR: f32 = 6.0;
/// At scale k, within so much of it times k, if that is more.
const NEAR_SCALED: f32 = 0.75;

#[derive(Clone, Copy, Debug)]
struct Ranked {
    member: usize,
    candidate: Candidate,
    scale: f32,
    /// Place in the output of what it belongs to.
    group: usize,
}

heap!(Ranked);

pub(super) struct Merge {
    most: usize,
    ranked: Vec<Ranked>,
    /// Index of the best of each group.
    best: Vec<usize>,
    /// Numbers given in this frame.
    given: Vec<u64>,
    next_id: u64,
}

heap!(Merge { ranked, best, given });
remember!(Merge { next_id });

const NONE: usize = usize::MAX;

impl Merge {
    pub fn new(candidates: usize, most: usize) -> Self {
        let (ranked, best) = (Vec::with_capacity(candidates), Vec::with_capacity(most));
        Self { most, ranked, best, given: Vec::with_capacity(most), next_id: 0 }
    }

    pub fn reset(&mut self) {
        self.next_id = 0;
    }

    /// What the members found, above `floor`, as detections of the bank.
    pub fn process(&mut self, members: &mut [Running], floor: f32, out: &mut Vec<Detection>) {
        self.group(members, floor);
        let Self { ranked, best, given, next_id, .. } = self;
        given.clear();
        out.clear();
        for (group, first) in best.iter().enumerate() {
            let inside = || ranked[*first..].iter().filter(|ranked| ranked.group == group);
            // The best comes first.
            let id = inside()
                .filter_map(|ranked| members[ranked.member].known_mut(ranked.candidate.trace).id)
                .find(|id| !given.contains(id))
                .unwrap_or_else(|| {
                    *next_id += 1;
                    *next_id - 1
                });
            given.push(id);
            for ranked in inside() {
                members[ranked.member].known_mut(ranked.candidate.trace).id = Some(id);
            }
            out.push(Detection { trace: id, ..ranked[*first].candidate.found });
        }
    }

    fn group(&mut self, members: &[Running], floor: f32) {
        let Self { most, ranked, best, .. } = self;
        ranked.clear();
        for (member, running) in members.iter().enumerate() {
            let scale = running.member.scale as f32;
            let usable = running
                .candidates
                .iter()
                .filter(|candidate| candidate.found.score > 0.0 && candidate.found.contrast >= floor);
            ranked.extend(usable.map(|candidate| Ranked { member, candidate: *candidate, scale, group: NONE }));
        }
        ranked.sort_unstable_by(|a, b| {
            let key = |ranked: &Ranked| (ranked.member, ranked.candidate.trace);
            b.candidate.found.score.total_cmp(&a.candidate.found.score).then_with(|| key(a).cmp(&key(b)))
        });
        best.clear();
        for index in 0..ranked.len() {
            let here = ranked[index];
            let near = best.iter().position(|first| {
                let other = &ranked[*first];
                let (dx, dy) = (
                    here.candidate.found.x - other.candidate.found.x,
                    here.candidate.found.y - other.candidate.found.y,
                );
                dx.hypot(dy) < NEAR * (NEAR_SCALED * here.scale.max(other.scale)).max(1.0)
            });
            ranked[index].group = match near {
                Some(group) => group,
                None if best.len() < *most => {
                    best.push(index);
                    best.len() - 1
                }
                None => NONE,
            };
        }
    }
}
