//! Detections of one target by several members become one: the best one's. Best first, each takes in what lies near it.
//! What lies somewhat farther off and is much weaker may be its echo, seen by members of other speeds in its wake: it counts less,
//! and so does what lies where others were found before ([`super::clutter`]).
//!
//! The number of a trace in the bank is that of the best member's trace, or of another that is taken in; all that are
//! taken in have it from then on, so that it stays when another member becomes the best.

use super::clutter::Clutter;
use super::member::{Candidate, Running};
use crate::detection::Detection;
use crate::memory::heap;
use crate::stage::background::Finding;
use crate::state::remember;

/// Within so many px of the full picture detections at scale 1 are of one target.
const NEAR: f32 = 6.0;
/// At scale k, within so much of it times k, if that is more.
const NEAR_SCALED: f32 = 0.75;
/// An echo lies within so many px of what has more than so many times its score, and keeps this share of its own.
const ECHO: (f32, f32) = (30.0, 2.0);
const OF_ECHO: f32 = 0.3;
/// So many times as many as are reported are looked at, for clutter may come first.
const LOOKED_AT: usize = 3;

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
    /// Most groups.
    looked_at: usize,
    ranked: Vec<Ranked>,
    /// Index of the best of each group.
    best: Vec<usize>,
    /// Numbers given in this frame.
    given: Vec<u64>,
    /// What was found, of which the best is reported.
    found: Vec<Detection>,
    clutter: Clutter,
    next_id: u64,
}

heap!(Merge { ranked, best, given, found, clutter });
remember!(Merge { clutter, next_id });

const NONE: usize = usize::MAX;

impl Merge {
    pub fn new(candidates: usize, most: usize) -> Self {
        let looked_at = most.saturating_mul(LOOKED_AT).min(candidates);
        Self {
            most,
            looked_at,
            ranked: Vec::with_capacity(candidates),
            best: Vec::with_capacity(looked_at),
            given: Vec::with_capacity(looked_at),
            found: Vec::with_capacity(looked_at),
            clutter: Clutter::new(most),
            next_id: 0,
        }
    }

    pub fn reset(&mut self) {
        self.next_id = 0;
        self.clutter.reset();
    }

    /// What the members found, above `floor`, as detections of the bank. The background moved so since the last frame, in pixels of
    /// the full picture.
    pub fn process(&mut self, members: &mut [Running], floor: f32, background: &Finding, out: &mut Vec<Detection>) {
        self.group(members, floor);
        let Self { most, ranked, best, given, found, clutter, next_id, .. } = self;
        given.clear();
        found.clear();
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
            found.push(Detection { trace: id, ..ranked[*first].candidate.found });
        }
        clutter.begin(background);
        clutter.remember(found);
        found.iter_mut().for_each(|found| found.score = clutter.left(found));
        found.sort_unstable_by(best_first);
        demote_echoes(found);
        found.sort_unstable_by(best_first);
        out.clear();
        out.extend(found.iter().take(*most));
    }

    fn group(&mut self, members: &[Running], floor: f32) {
        let Self { looked_at, ranked, best, .. } = self;
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
                None if best.len() < *looked_at => {
                    best.push(index);
                    best.len() - 1
                }
                None => NONE,
            };
        }
    }
}

fn best_first(a: &Detection, b: &Detection) -> std::cmp::Ordering {
    b.score.total_cmp(&a.score).then(a.trace.cmp(&b.trace))
}

/// Of detections, best first, what may be an echo keeps less of its score.
fn demote_echoes(found: &mut [Detection]) {
    // From the last on: what is echoed comes before its echoes, and still has all of its score.
    for index in (1..found.len()).rev() {
        let (stronger, rest) = found.split_at_mut(index);
        let here = &mut rest[0];
        let echoes = |other: &Detection| {
            other.score > ECHO.1 * here.score && (other.x - here.x).hypot(other.y - here.y) < ECHO.0
        };
        if stronger.iter().any(echoes) {
            here.score *= OF_ECHO;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn echoes_are_near_and_weak() {
        let of = |x: f32, score: f32| Detection { x, score, ..Detection::default() };
        // An echo; as strong as half of it; farther off; an echo of an echo's place only.
        let mut found = [of(50.0, 1.0), of(75.0, 0.5), of(60.0, 0.4), of(85.0, 0.3), of(100.0, 0.19)];
        demote_echoes(&mut found);
        let scores = found.map(|found| found.score);
        assert_eq!(scores, [1.0, 0.5, 0.4 * OF_ECHO, 0.3, 0.19 * OF_ECHO]);
    }
}
