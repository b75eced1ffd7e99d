//! Scenes of moving points: what keeps its id, what begins, what ends.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use ndarray::Array2;
use proptest::prelude::*;

use super::*;

const SIZE: Size = Size { height: 200, width: 300 };

fn params() -> Params {
    Params::default().for_speed(1.0).unwrap()
}

fn at(x: f64, y: f64, direction: f64) -> Detection {
    Detection {
        x: x as f32,
        y: y as f32,
        score: 1.0,
        direction: direction as f32,
        trace: u64::MAX,
        ..Detection::default()
    }
}

/// Uniform in [-1, 1], from a seed.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// All points, by track.
type Found = BTreeMap<u64, Vec<TrackPoint>>;

fn track(params: &Params, frames: usize, mut seen: impl FnMut(usize) -> (Vec<Detection>, (f32, f32))) -> Found {
    let mut tracker = Tracker::new(SIZE, params).unwrap();
    let (mut points, mut all) = (Vec::new(), Found::new());
    for frame in 0..frames {
        let (detections, background_shift) = seen(frame);
        let observation = Observation { background_shift, ..Observation::new(frame, &detections) };
        tracker.process_into(&observation, &mut points);
        points.iter().for_each(|point| all.entry(point.track).or_default().push(*point));
    }
    // Each frame at most once, in order, and the ids without gaps.
    assert!(all.values().all(|points| points.windows(2).all(|pair| pair[1].frame == pair[0].frame + 1)));
    assert!(all.keys().copied().eq(0..all.len() as u64));
    all
}

#[test]
fn detections_that_are_no_numbers_are_left_out() {
    let odd = |change: fn(&mut Detection)| {
        let mut detection = at(150.0, 50.0, 0.0);
        change(&mut detection);
        detection
    };
    let seen = [odd(|d| d.x = f32::NAN), odd(|d| d.y = f32::INFINITY), odd(|d| d.score = f32::NAN)];
    let all = track(&params(), 20, |t| ([vec![at(20.0 + t as f64, 50.0, 0.0)], seen.to_vec()].concat(), (0.0, 0.0)));
    assert_eq!((all.len(), all[&0].len()), (1, 20));
}

fn off(point: &TrackPoint, (x, y): (f64, f64)) -> f64 {
    (point.x - x).hypot(point.y - y)
}

#[test]
fn crossing_targets_keep_their_ids() {
    // They meet in frame 50, at angles of 180, 90, 30 degrees; noise of some 0.6 px; no help from traces.
    for (angle, seed) in [(180.0f64, 1), (90.0, 2), (30.0, 3), (30.0, 4), (90.0, 5)] {
        let mut dice = Dice(seed);
        let turn = angle.to_radians() / 2.0;
        let place = |which: f64, t: usize| {
            let s = t as f64 - 50.0;
            (150.0 + turn.cos() * s, 100.0 - which * turn.sin() * s)
        };
        let found = track(&params(), 101, |t| {
            let mut seen: Vec<Detection> = [1.0, -1.0]
                .map(|which| {
                    let (x, y) = place(which, t);
                    at(x + dice.roll(), y + dice.roll(), which * turn + 0.2 * dice.roll())
                })
                .into();
            // The stronger one comes first, whichever it is.
            if t % 3 == 0 {
                seen.reverse();
            }
            (seen, (0.0, 0.0))
        });
        assert_eq!(found.len(), 2, "{angle}");
        for points in found.values() {
            let which = if off(&points[0], place(1.0, 0)) < off(&points[0], place(-1.0, 0)) { 1.0 } else { -1.0 };
            assert_eq!(points.len(), 101);
            assert!(points.iter().all(|p| off(p, place(which, p.frame)) < 2.0), "{angle} {seed}");
        }
    }
}

#[test]
fn an_occlusion_of_20_frames_is_coasted_through() {
    let place = |t: usize| (30.0 + t as f64, 60.0 + 0.5 * t as f64);
    let mut dice = Dice(7);
    let found = track(&params(), 100, |t| {
        let (x, y) = place(t);
        let seen = at(x + 0.5 * dice.roll(), y + 0.5 * dice.roll(), -0.46);
        (if (40..60).contains(&t) { vec![] } else { vec![seen] }, (0.0, 0.0))
    });
    assert_eq!(found.len(), 1);
    let points = &found[&0];
    assert_eq!(points.len(), 100);
    for point in points {
        let hidden = (40..60).contains(&point.frame);
        assert_eq!(point.state == TrackState::Coasting, hidden);
        assert_eq!((point.score, point.age), (if hidden { 0.0 } else { 1.0 }, point.frame as u32));
        assert!(off(point, place(point.frame)) < if hidden { 6.0 } else { 1.5 }, "{point:?}");
    }
}

#[test]
fn a_track_that_is_not_seen_again_ends_with_its_last_detection() {
    let line = |t: usize| vec![at(50.0 + t as f64, 50.0, 0.0)];
    for (seen, gap, tracks) in [(40, 30, 1), (40, 31, 2), (10, 10, 1), (10, 11, 2)] {
        let found = track(&params(), seen + gap + 40, |t| {
            (if (seen..seen + gap).contains(&t) { vec![] } else { line(t) }, (0.0, 0.0))
        });
        assert_eq!(found.len(), tracks, "{seen} seen, {gap} not: coast is 30, and no more than was seen");
        let first = &found[&0];
        assert_eq!(first.len(), if tracks == 1 { seen + gap + 40 } else { seen });
        assert!(tracks == 1 || first.iter().all(|point| point.state == TrackState::Confirmed));
    }
}

/// Frames that were left out: velocities and ages are those of steps, and the ids stay.
#[test]
fn frames_left_out_are_predicted_over() {
    let mut dice = Dice(13);
    let mut tracker = Tracker::new(SIZE, &params()).unwrap();
    let (mut points, mut all) = (Vec::new(), Found::new());
    // The camera drifts by 0.5 px a step. The second target comes towards the first.
    let place = |which: u64, t: usize| match which {
        0 => (30.0 + 1.5 * t as f64, 100.0),
        _ => (280.0 - 0.5 * t as f64, 104.0),
    };
    let (mut frame, mut steps) = (0, 1);
    while frame < 160 {
        let detections = [(0, 0.0), (1, PI)].map(|(which, direction)| {
            let (x, y) = place(which, frame);
            at(x + 0.5 * dice.roll(), y + 0.5 * dice.roll(), direction)
        });
        let background_shift = (0.5 * steps as f32, 0.0);
        let seen = Observation { steps: steps as u32, background_shift, ..Observation::new(frame, &detections) };
        tracker.process_into(&seen, &mut points);
        points.iter().for_each(|point| all.entry(point.track).or_default().push(*point));
        steps = 1 + (3.0 + 3.0 * dice.roll()) as usize;
        frame += steps;
    }
    assert_eq!(all.len(), 2);
    for (which, points) in &all {
        assert!(points.len() > 30 && points.iter().all(|point| point.age as usize == point.frame));
        assert!(points.iter().all(|point| off(point, place(*which, point.frame)) < 2.0));
        let last = points[points.len() - 1];
        let expected = if *which == 0 { 1.0 } else { -1.0 };
        assert!((last.vx - expected).abs() < 0.2 && last.vy.abs() < 0.2, "{last:?}");
    }
}

/// As long without a detection, in steps, as if every frame had been given.
#[test]
fn frames_left_out_let_it_coast() {
    let ids = |gap: usize, given: &[usize]| {
        let mut tracker = Tracker::new(SIZE, &params()).unwrap();
        let (mut points, mut ids, mut last) = (Vec::new(), std::collections::BTreeSet::new(), None);
        for t in (0..40).chain(given.iter().map(|t| 40 + t)).chain(40 + gap..60 + gap) {
            let hidden = (40..40 + gap).contains(&t);
            let seen = [at(50.0 + t as f64, 50.0, 0.0)];
            let detections = if hidden { &[] } else { &seen[..] };
            let steps = last.map_or(1, |last| t - last) as u32;
            tracker.process_into(&Observation { steps, ..Observation::new(t, detections) }, &mut points);
            ids.extend(points.iter().map(|point| point.track));
            last = Some(t);
        }
        ids.len()
    };
    assert_eq!((ids(30, &[0, 1, 29]), ids(31, &[0, 1, 30])), (1, 2));
    assert_eq!(ids(30, &[]), 1, "nothing was looked at: nothing was missed");
    let mut tracker = Tracker::new(SIZE, &params()).unwrap();
    let mut points = Vec::new();
    for t in 0..10 {
        let seen = [at(50.0, 50.0, 0.0)];
        let steps = if t % 2 == 0 { 0 } else { u32::MAX };
        tracker.process_into(&Observation { steps, ..Observation::new(t, &seen) }, &mut points);
        assert!(points.iter().all(|point| point.x.is_finite() && point.vx.is_finite()));
    }
}

#[test]
fn points_of_a_new_track_come_with_its_confirmation() {
    let mut tracker = Tracker::new(SIZE, &params()).unwrap();
    let mut points = Vec::new();
    let mut reported = Vec::new();
    for t in 0..8 {
        let seen = at(50.0 + t as f64, 50.0, 0.0);
        // Detected in frames 0, 2, 4, ...
        let detections: &[Detection] = if t % 2 == 0 { &[seen] } else { &[] };
        tracker
            .process_into(&Observation { time: Some(0.1 * t as f64), ..Observation::new(t, detections) }, &mut points);
        reported.push(points.iter().map(|point| point.frame).collect::<Vec<_>>());
        assert!(points.iter().all(|point| point.time == Some(0.1 * point.frame as f64)));
        let living: Vec<usize> = tracker.living().map(|point| point.frame).collect();
        assert_eq!(living, if t >= 4 { vec![t] } else { vec![] });
    }
    let empty = Vec::new();
    assert_eq!(
        reported,
        [&empty, &empty, &empty, &empty, &vec![0, 1, 2, 3, 4], &empty, &vec![5, 6], &empty].map(Vec::clone)
    );
}

#[test]
fn births_by_n_of_m() {
    let counted = |hits: u32, window: u32, pattern: &[usize]| {
        let mut params = params();
        (params.tracking.birth_hits, params.tracking.birth_window) = (hits, window);
        let found = track(&params, 12, |t| {
            (if pattern.contains(&t) { vec![at(50.0 + t as f64, 50.0, 0.0)] } else { vec![] }, (0.0, 0.0))
        });
        found.values().map(Vec::len).collect::<Vec<_>>()
    };
    assert_eq!(counted(3, 5, &[0, 1, 4]), [5]);
    assert_eq!(counted(3, 5, &[0, 1, 5]), [0usize; 0]);
    assert_eq!(counted(3, 5, &[0, 4, 5, 6]), [3], "the first is given up, the rest begins anew");
    assert_eq!(counted(3, 3, &[0, 1, 3, 4, 5]), [3]);
    assert_eq!(counted(1, 1, &[4]), [1]);
    assert_eq!(counted(2, 2, &[4, 5]), [2]);
    let mut params = params();
    (params.tracking.birth_hits, params.tracking.birth_window) = (6, 5);
    let error = Tracker::new(SIZE, &params).unwrap_err().to_string();
    assert_eq!(error, "tracking.birth_hits is 6, but it must not exceed birth_window = 5");
}

#[test]
fn weak_detections_continue_tracks_but_begin_none() {
    let mut params = params();
    params.tracking.birth_score = 0.5;
    let found = track(&params, 30, |t| {
        let strong = Detection { score: if t == 0 { 1.0 } else { 0.1 }, ..at(50.0 + t as f64, 50.0, 0.0) };
        (vec![strong, Detection { score: 0.1, ..at(50.0 + t as f64, 150.0, 0.0) }], (0.0, 0.0))
    });
    assert_eq!(found.values().map(Vec::len).collect::<Vec<_>>(), [30]);
}

/// The camera jumps by up to 12 px a frame, twelve times the target's own step; it is hidden for ten frames.
#[test]
fn a_shaking_camera_shakes_no_track() {
    let mut dice = Dice(11);
    let shifts: Vec<(f64, f64)> = (0..90).map(|_| (12.0 * dice.roll(), 12.0 * dice.roll())).collect();
    let shake = |known: bool| {
        let mut camera = (0.0, 0.0);
        track(&params(), 90, |t| {
            camera = (camera.0 + shifts[t].0, camera.1 + shifts[t].1);
            let place = (100.0 + t as f64 + camera.0, 100.0 + camera.1);
            // The direction in the picture is the camera's, not the target's.
            let direction = (-shifts[t].1).atan2(1.0 + shifts[t].0);
            let seen = if (50..60).contains(&t) { vec![] } else { vec![at(place.0, place.1, direction)] };
            (seen, if known { (shifts[t].0 as f32, shifts[t].1 as f32) } else { (0.0, 0.0) })
        })
    };
    let found = shake(true);
    assert_eq!(found.len(), 1);
    let points = &found[&0];
    assert_eq!(points.len(), 90);
    assert!(points[40..].iter().all(|p| (p.vx - 1.0).abs() < 0.3 && p.vy.abs() < 0.3));
    assert_ne!(shake(false).get(&0).map(Vec::len), Some(90), "the shift is what holds it");
}

/// What vanishes is detected a little longer where it vanished, ever weaker: that must not stop the track.
#[test]
fn a_fading_echo_does_not_hold_a_track_back() {
    let x = |t: usize| 50.0 + t as f64;
    let run = |fading: f32| {
        track(&params(), 90, |t| {
            let seen = match t {
                0..40 | 60.. => vec![at(x(t), 100.0, 0.0)],
                40..46 => vec![Detection { score: fading.powi(t as i32 - 39), ..at(x(40), 100.0, 0.0) }],
                _ => vec![],
            };
            (seen, (0.0, 0.0))
        })
    };
    let farthest = |found: &Found| found[&0].iter().map(|p| off(p, (x(p.frame), 100.0))).fold(0.0, f64::max);
    let found = run(0.3);
    assert!(found.len() == 1 && farthest(&found) < 5.0, "{}", farthest(&found));
    let strong = farthest(&run(1.0));
    assert!(strong > 10.0, "a strong one is believed: {strong}");
}

/// A target turns behind an occluder: its own motion leads astray, the response shows where it is.
#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn the_response_guides_a_track_that_coasts() {
    let place = |t: usize| match t {
        0..40 => (50.0 + t as f64, 100.0),
        _ => (90.0, 100.0 + (t - 40) as f64),
    };
    let run = |guide: bool| {
        let mut params = params();
        params.tracking.guide = guide;
        let mut tracker = Tracker::new(SIZE, &params).unwrap();
        let (mut points, mut found) = (Vec::new(), Found::new());
        for frame in 0..90 {
            let (x, y) = place(frame);
            let hidden = (36..66).contains(&frame);
            let seen = [at(x, y, if frame < 40 { 0.0 } else { -PI / 2.0 })];
            let map = Array2::from_shape_fn((200, 300), |(v, u)| {
                (-((u as f64 - x).powi(2) + (v as f64 - y).powi(2)) / 8.0).exp() as f32
            });
            let detections = if hidden { &seen[..0] } else { &seen[..] };
            let observation = Observation { map: Some(map.view()), ..Observation::new(frame, detections) };
            tracker.process_into(&observation, &mut points);
            points.iter().for_each(|point| found.entry(point.track).or_default().push(*point));
        }
        found
    };
    let guided = run(true);
    assert_eq!(guided.len(), 1);
    let hidden: Vec<&TrackPoint> = guided[&0].iter().filter(|p| p.state == TrackState::Coasting).collect();
    assert_eq!(hidden.len(), 30);
    assert!(hidden.iter().all(|p| off(p, place(p.frame)) < 6.0 && p.score > 0.1), "{hidden:?}");
    assert_eq!(run(false).len(), 2);
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn many_targets_and_clutter() {
    // 12 targets on their own ways, a tenth of the detections missing, 20 false ones a frame.
    let mut dice = Dice(3);
    let starts: Vec<[f64; 4]> = (0..12)
        .map(|i| [60.0 + 15.0 * i as f64, 100.0 + 60.0 * dice.roll(), 0.8 * dice.roll(), 0.8 * dice.roll()])
        .collect();
    let place = |s: &[f64; 4], t: usize| (s[0] + s[2] * t as f64, s[1] + s[3] * t as f64);
    let found = track(&params(), 60, |t| {
        let mut seen = Vec::new();
        for s in &starts {
            let (x, y) = place(s, t);
            if dice.roll() > -0.8 {
                seen.push(at(x + 0.7 * dice.roll(), y + 0.7 * dice.roll(), (-s[3]).atan2(s[2])));
            }
        }
        seen.extend((0..20).map(|_| at(150.0 + 150.0 * dice.roll(), 100.0 + 100.0 * dice.roll(), PI * dice.roll())));
        (seen, (0.0, 0.0))
    });
    let long: Vec<&Vec<TrackPoint>> = found.values().filter(|points| points.len() > 50).collect();
    assert_eq!(long.len(), 12);
    for points in long {
        let whose = starts
            .iter()
            .min_by(|a, b| {
                off(&points[0], place(a, points[0].frame)).total_cmp(&off(&points[0], place(b, points[0].frame)))
            })
            .unwrap();
        let near = points.iter().filter(|p| off(p, place(whose, p.frame)) < 3.0).count();
        assert!(near * 10 > points.len() * 9, "{near} of {}", points.len());
    }
}

#[test]
fn reset_forgets_everything() {
    let mut tracker = Tracker::new(SIZE, &params()).unwrap();
    let mut points = Vec::new();
    let mut run = |tracker: &mut Tracker| {
        let mut all = Vec::new();
        for t in 0..20 {
            let seen = [at(50.0 + t as f64, 50.0, 0.0), at(150.0 - t as f64, 90.0, PI)];
            tracker.process_into(&Observation::new(t, &seen), &mut points);
            all.extend(points.iter().copied());
        }
        all
    };
    let first = run(&mut tracker);
    tracker.reset();
    assert_eq!(tracker.living().count(), 0);
    assert_eq!(run(&mut tracker), first);
    assert_eq!(run(&mut tracker).last().unwrap().track, 3, "without reset they are new tracks");
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn thousands_of_detections() {
    let mut dice = Dice(5);
    let mut tracker = Tracker::new(Size::new(2000, 2000), &params()).unwrap();
    let (mut points, mut ids) = (Vec::new(), std::collections::HashSet::new());
    let starts: Vec<(f64, f64)> =
        (0..3000).map(|_| (1000.0 + 900.0 * dice.roll(), 1000.0 + 900.0 * dice.roll())).collect();
    for t in 0..20 {
        let seen: Vec<Detection> = starts.iter().map(|(x, y)| at(x + t as f64, *y, 0.0)).collect();
        tracker.process_into(&Observation::new(t, &seen), &mut points);
        assert!(t < 2 || points.len() >= 3000);
        ids.extend(points.iter().map(|point| point.track));
    }
    assert_eq!(ids.len(), 3000);
    // All on one spot: no order to be found, but no panic and no endless search either.
    for t in 20..24 {
        let heap: Vec<Detection> = (0..2000).map(|_| at(300.0 + dice.roll(), 300.0 + dice.roll(), 0.0)).collect();
        tracker.process_into(&Observation::new(t, &heap), &mut points);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]
    /// Whatever numbers come: the same twice, everything finite, no panic.
    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn nothing_breaks_it(
        frames in prop::collection::vec(
            (prop::collection::vec((any::<f32>(), -50f32..350.0, any::<f32>(), any::<bool>()), 0..12), any::<f32>(), any::<f32>()),
            0..30,
        ),
        hits in 1..4u32,
    ) {
        let mut params = params();
        params.tracking.birth_hits = hits;
        let run = || {
            let mut tracker = Tracker::new(SIZE, &params).unwrap();
            let (mut points, mut all) = (Vec::new(), Vec::new());
            for (frame, (places, dx, dy)) in frames.iter().enumerate() {
                let seen: Vec<Detection> = places.iter().enumerate().map(|(i, &(wild, tame, direction, calm))| {
                    let x = if calm { tame } else { wild };
                    Detection { x, y: tame, score: wild, direction, trace: i as u64, ..Detection::default() }
                }).collect();
                let observation = Observation { background_shift: (*dx, *dy), lag: *dx, ..Observation::new(frame, &seen) };
                tracker.process_into(&observation, &mut points);
                all.extend(points.iter().map(|p| (p.track, p.frame, p.x.to_bits(), p.y.to_bits(), p.age)));
                prop_assert!(points.iter().all(|p| p.x.is_finite() && p.y.is_finite() && p.vx.is_finite()));
            }
            Ok(all)
        };
        prop_assert_eq!(run()?, run()?);
    }
}

/// A target whose path is straight in a world that turns and grows about (149.5, 99.5), the middle of the picture.
fn in_a_turning_world(t: usize) -> (f64, f64) {
    let s = t as f64;
    let (sin, cos) = (0.04 * s).sin_cos();
    let (u, v, zoom) = (-60.0 + 0.8 * s, 20.0, 1.01f64.powf(s));
    (149.5 + zoom * (cos * u + sin * v), 99.5 + zoom * (cos * v - sin * u))
}

#[test]
fn a_turning_world_is_followed_while_nothing_is_seen() {
    let turning = EgoMotion { rotation: 0.04, zoom: 1.01, ..EgoMotion::default() };
    for (ego_motion, followed) in [(turning, true), (EgoMotion::default(), false)] {
        let mut tracker = Tracker::new(SIZE, &params()).unwrap();
        let (mut points, mut ids) = (Vec::new(), Vec::new());
        for t in 0..60 {
            let (x, y) = in_a_turning_world(t);
            let seen = if (30..45).contains(&t) { Vec::new() } else { vec![at(x, y, f64::NAN)] };
            let observation = Observation { ego_motion, ..Observation::new(t, &seen) };
            tracker.process_into(&observation, &mut points);
            ids.extend(points.iter().map(|point| point.track));
            if followed && t > 20 {
                let now = tracker.living().next().expect("it lives");
                assert!(off(&now, (x, y)) < 1.0, "frame {t}: {now:?}, not {x} {y}");
            }
        }
        assert_eq!(ids.iter().all(|id| *id == 0), followed, "{ids:?}");
    }
}

#[test]
fn frames_left_out_of_a_turning_world() {
    // As the camera shakes too, the shift of three steps is more than three times one of them.
    let mut tracker = Tracker::new(SIZE, &params()).unwrap();
    let mut points = Vec::new();
    let still = crate::stage::background::Motion::still(SIZE);
    let (sin, cos) = 0.04f64.sin_cos();
    let step = crate::stage::background::Motion { shift: (1.5, -0.5), stretch: cos - 1.0, turn: -sin, ..still };
    let middle = still.middle;
    let all = (0..3).fold(middle, |place, _| step.carry(place));
    let mut place = (120.0, 80.0);
    for t in 0..20 {
        let seen = [at(place.0, place.1, f64::NAN)];
        let ego_motion = EgoMotion { rotation: 0.12, ..EgoMotion::default() };
        let background_shift = ((all.0 - middle.0) as f32, (all.1 - middle.1) as f32);
        let observation = Observation { steps: 3, ego_motion, background_shift, ..Observation::new(t, &seen) };
        tracker.process_into(&observation, &mut points);
        if t > 10 {
            let now = tracker.living().next().expect("it lives");
            assert!(off(&now, place) < 0.01 && now.vx.hypot(now.vy) < 0.01, "frame {t}: {now:?}, not {place:?}");
        }
        place = (0..3).fold(place, |place, _| step.carry(place));
    }
}

#[test]
fn a_cut_ends_all_tracks() {
    let mut tracker = Tracker::new(SIZE, &params()).unwrap();
    let (mut points, mut ids) = (Vec::new(), Vec::new());
    for t in 0..40 {
        // The same place before and after: without a cut it is one track.
        let seen = [at(50.0 + t as f64, 100.0, 0.0)];
        tracker.process_into(&Observation { cut: t == 20, ..Observation::new(t, &seen) }, &mut points);
        ids.extend(points.iter().map(|point| (point.frame, point.track)));
        assert!(t != 20 || tracker.living().count() == 0);
    }
    assert!(ids.iter().all(|(frame, track)| *track == u64::from(*frame >= 20)), "{ids:?}");
    assert_eq!(ids.len(), 40);
}

/// Before a pan a bank tells how a target moves in the world: taken for its direction in the picture, it is lost.
#[test]
fn directions_in_the_world_begin_a_track_as_it_goes_on() {
    let params = Params::default().for_speed(1.0).unwrap();
    for in_world in [true, false] {
        let mut tracker = Tracker::new(Size::new(60, 400), &params).unwrap();
        let (mut points, mut last) = (Vec::new(), None);
        // To the right by 1 px a frame in the world, which passes to the left by 6 and has done so for long.
        for t in 0..46 {
            let found = [Detection { x: 400.0 - 5.0 * t as f32, trace: t as u64, ..at(0.0, 30.0, 0.0) }];
            let found = if t < 40 { &[][..] } else { &found };
            let observation = Observation { background_shift: (-6.0, 0.0), in_world, ..Observation::new(t, found) };
            tracker.process_into(&observation, &mut points);
            last = points.last().copied().or(last);
        }
        let right = last.is_some_and(|last| (last.track, last.age) == (0, 5) && (last.vx - 1.0).abs() < 0.05);
        assert_eq!(right, in_world, "{last:?}");
    }
}
