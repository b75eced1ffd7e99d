//! Cases worked by hand, and a brute-force evaluator that matches anew at every threshold.

use proptest::prelude::*;

use super::*;

fn target(frame: usize, x: f64, y: f64) -> TruthBox {
    TruthBox::new(frame, [x - 1.5, y - 1.5, 4.0, 4.0])
}

fn judge(detections: &[Scored], truth: &[TruthBox], frames: usize) -> Evaluation {
    evaluate(detections, truth, &Options::new(0..frames)).unwrap()
}

/// True, false and neutral detections.
fn counts(detections: &[Scored], truth: &[TruthBox]) -> (usize, usize, usize) {
    let e = judge(detections, truth, 10);
    (e.true_detections, e.false_detections, e.neutral_detections)
}

#[test]
fn within_five_pixels_or_two_beyond_the_box() {
    assert_eq!(target(0, 20.0, 30.0).center(), (20.0 + 0.0, 30.0 + 0.0));
    let small = [target(0, 20.0, 30.0)];
    for ((x, y), hit) in [((25.0, 30.0), true), ((25.01, 30.0), false), ((23.0, 34.0), true), ((23.9, 33.9), true)] {
        assert_eq!(counts(&[Scored::new(0, x, y, 1.0)], &small).0, usize::from(hit), "{x}, {y}");
    }
    let corner = Scored::new(0, 24.0, 34.0, 1.0);
    // 5.7 px from the centre, but 2 px from each edge.
    assert_eq!(counts(&[corner], &small), (1, 0, 0));
    let large = [TruthBox::new(0, [10.0, 10.0, 30.0, 20.0])];
    // Edges 10 and 40 lie at -0.5 of the columns 10 and 40.
    for (x, hit) in [(7.5, true), (7.4, false), (41.5, true), (41.6, false)] {
        assert_eq!(counts(&[Scored::new(0, x, 15.0, 1.0)], &large).0, usize::from(hit), "{x}");
    }
}

#[test]
fn one_detection_for_one_target_best_score_first() {
    let truth = [target(0, 20.0, 20.0)];
    let both = [Scored::new(0, 21.0, 20.0, 0.2), Scored::new(0, 24.0, 20.0, 0.9)];
    let e = judge(&both, &truth, 1);
    assert_eq!((e.true_detections, e.false_detections), (1, 1));
    assert_eq!(e.all.localisation_error, Some(4.0));
    let pair = [target(0, 20.0, 20.0), target(0, 26.0, 20.0)];
    // The first takes its nearest, 26; the second matches both and takes the one left.
    assert_eq!(counts(&[Scored::new(0, 24.0, 20.0, 0.9), Scored::new(0, 25.0, 20.0, 0.5)], &pair), (2, 0, 0));
    assert_eq!(counts(&[Scored::new(1, 20.0, 20.0, 0.9)], &truth), (0, 1, 0));
}

#[test]
fn hidden_and_ignored_neither_reward_nor_punish() {
    let hidden = TruthBox { visible: false, ..target(0, 20.0, 20.0) };
    let ignored = TruthBox { ignore: true, ..target(1, 20.0, 20.0) };
    let found = [Scored::new(0, 20.0, 20.0, 0.9), Scored::new(0, 21.0, 20.0, 0.8), Scored::new(1, 20.0, 20.0, 0.7)];
    let e = judge(&found, &[hidden, ignored], 2);
    assert_eq!((e.targets, e.true_detections, e.false_detections, e.neutral_detections), (0, 0, 0, 3));
    assert!(e.curve.is_empty() && e.area == 0.0 && e.best_f1.point.is_none());
    // A visible target goes before a hidden one that is nearer; the next detection has only the hidden one left.
    let e = judge(&found[..2], &[hidden, target(0, 24.0, 20.0)], 1);
    assert_eq!((e.true_detections, e.false_detections, e.neutral_detections), (1, 0, 1));
}

#[test]
fn a_curve_worked_by_hand() {
    // 4 targets in 4 frames; scores 9 true, 8 false, 7 true + false (tie), 6 true, 5 false three times.
    let truth: Vec<TruthBox> = (0..4).map(|t| target(t, 20.0, 20.0)).collect();
    let on = |t, score| Scored::new(t, 20.0, 21.0, score);
    let off = |t, score| Scored::new(t, 90.0, 90.0, score);
    let found = [on(0, 9.0), off(0, 8.0), on(1, 7.0), off(3, 7.0), on(2, 6.0), off(1, 5.0), off(2, 5.0), off(3, 5.0)];
    let e = judge(&found, &truth, 4);
    let points: Vec<_> = e.curve.iter().map(|p| (p.threshold, p.true_detections, p.false_detections)).collect();
    assert_eq!(points, [(9.0, 1, 0), (8.0, 1, 1), (7.0, 2, 2), (6.0, 3, 2), (5.0, 3, 5)]);
    // Rate 1/4 over 0..2/4, 3/4 over 2/4..1.
    assert_eq!(e.area, 0.5 * 0.25 + 0.5 * 0.75);
    let rates: Vec<f64> = e.at.iter().map(|at| at.detection_rate).collect();
    assert_eq!(rates, [0.25, 0.75, 0.75, 0.75, 0.75]);
    assert_eq!((e.at[1].point.unwrap().threshold, e.at[0].limit), (6.0, Some(0.1)));
    assert_eq!(e.average_precision, 0.25 * 1.0 + 0.25 * 0.5 + 0.25 * 0.6);
    let best = e.best_f1.point.unwrap();
    assert_eq!((best.threshold, best.precision, best.detection_rate, best.f1), (6.0, 0.6, 0.75, 6.0 / 9.0));
    assert_eq!((e.best_f1.localisation_error, e.best_f1.direction_error), (Some(1.0), None));
}

#[test]
fn no_point_below_the_limit() {
    let found = [Scored::new(0, 5.0, 5.0, 1.0), Scored::new(0, 50.0, 50.0, 1.0)];
    let e = judge(&found, &[target(0, 5.0, 5.0)], 1);
    assert_eq!((e.at[0].detection_rate, e.at[0].point, e.at[2].detection_rate, e.area), (0.0, None, 1.0, 0.0));
}

#[test]
fn only_the_frames_asked_for() {
    let truth: Vec<TruthBox> = (0..60).map(|t| target(t, 20.0, 20.0)).collect();
    let found: Vec<Scored> = (0..60).map(|t| Scored::new(t, 20.0, 20.0 + 30.0 * (t % 2) as f64, 1.0)).collect();
    let e = evaluate(&found, &truth, &Options::new(30..50)).unwrap();
    assert_eq!((e.first_frame, e.frames, e.targets, e.true_detections, e.false_detections), (30, 20, 20, 10, 10));
    // Frames without truth count their false alarms.
    assert_eq!(judge(&found, &truth[..1], 60).false_detections, 59);
}

#[test]
fn directions_against_the_track() {
    let truth: Vec<TruthBox> = (0..20).map(|t| target(t, 20.0 + t as f64, 20.0)).collect();
    let found: Vec<Scored> = (0..20)
        .map(|t| Scored {
            direction: Some(if t < 15 { 0.2 } else { 3.0 }),
            ..Scored::new(t, 20.0 + t as f64, 20.0, 1.0)
        })
        .collect();
    // 0.2 - 0 in f64.
    assert!((judge(&found, &truth, 20).all.direction_error.unwrap() - 0.2).abs() < 1e-12);
}

#[test]
fn nonsense_is_refused() {
    let error = |detections: &[Scored], options: &Options| evaluate(detections, &[], options).unwrap_err().to_string();
    assert_eq!(error(&[], &Options::new(3..3)), "frames 3..3 hold no frame: give at least one");
    assert_eq!(
        error(&[Scored::new(4, 1.0, 2.0, f64::NAN)], &Options::new(0..9)),
        "detection 0 (frame 4) has score = NaN, but it must be a finite number"
    );
    assert_eq!(
        error(&[], &Options { radius: -1.0, ..Options::new(0..9) }),
        "radius is -1 px, but it must be a number from 0 to 1e12"
    );
}

/// Sums of distances that are numbers each were none together.
#[test]
fn places_beyond_any_picture_are_refused() {
    let truth = [TruthBox::new(0, [-8e307, 0.0, 1.6e308, 4.0])];
    let found = [Scored::new(0, 7e307, 1.0, 1.0)];
    let expected = "truth box 0 (frame 0) has x = -8";
    assert!(evaluate(&[], &truth, &Options::new(0..1)).unwrap_err().to_string().starts_with(expected));
    let error = evaluate(&found, &[], &Options::new(0..1)).unwrap_err().to_string();
    assert!(error.ends_with("places and sizes must lie within 1e12 px"), "{error}");
}

/// True and false detections at one threshold, by the words of the rule and nothing else.
fn brute_force(detections: &[Scored], truth: &[TruthBox], frames: usize, threshold: f64) -> (usize, usize) {
    let (mut hits, mut alarms) = (0, 0);
    for frame in 0..frames {
        let mut left: Vec<&Scored> = detections.iter().filter(|d| d.frame == frame && d.score >= threshold).collect();
        let mut targets: Vec<&TruthBox> = truth.iter().filter(|b| b.frame == frame && b.visible && !b.ignore).collect();
        let pardons: Vec<&TruthBox> = truth.iter().filter(|b| b.frame == frame && (!b.visible || b.ignore)).collect();
        while !left.is_empty() {
            let best = left.iter().map(|d| d.score).fold(f64::MIN, f64::max);
            let detection = left.remove(left.iter().position(|d| d.score == best).unwrap());
            let gap = |b: &TruthBox| {
                let (dx, dy) = (detection.x + 0.5 - b.x - b.width / 2.0, detection.y + 0.5 - b.y - b.height / 2.0);
                let in_box = dx.abs() <= b.width / 2.0 + 2.0 && dy.abs() <= b.height / 2.0 + 2.0;
                let squared = dx * dx + dy * dy;
                (squared <= 25.0 || in_box).then_some(squared)
            };
            let mut nearest: Option<(f64, usize)> = None;
            for (i, b) in targets.iter().enumerate() {
                if let Some(squared) = gap(b)
                    && nearest.is_none_or(|(least, _)| squared < least)
                {
                    nearest = Some((squared, i));
                }
            }
            if let Some((_, i)) = nearest {
                targets.remove(i);
                hits += 1;
            } else if !pardons.iter().any(|b| gap(b).is_some()) {
                alarms += 1;
            }
        }
    }
    (hits, alarms)
}

const FRAMES: usize = 4;

/// Coordinates on a half-pixel grid and few scores, so that ties of every kind happen.
fn detection() -> impl Strategy<Value = Scored> {
    (0..FRAMES, 0..50u8, 0..50u8, 0..6u8)
        .prop_map(|(frame, x, y, score)| Scored::new(frame, f64::from(x) / 2.0, f64::from(y) / 2.0, f64::from(score)))
}

fn truth_box() -> impl Strategy<Value = TruthBox> {
    (0..FRAMES, (0..40u8, 0..40u8), (0..30u8, 0..10u8), 0..4u8, 0..6u8).prop_map(|(frame, at, side, seen, ignore)| {
        let sides = [at.0, at.1, side.0, side.1].map(|v| f64::from(v) / 2.0);
        TruthBox { visible: seen > 0, ignore: ignore == 0, ..TruthBox::new(frame, sides) }
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]
    #[test]
    fn equals_matching_anew_at_every_threshold(
        detections in prop::collection::vec(detection(), 0..40),
        truth in prop::collection::vec(truth_box(), 0..16),
    ) {
        let e = judge(&detections, &truth, FRAMES);
        let targets = truth.iter().filter(|b| b.counts()).count();
        prop_assert_eq!(e.targets, targets);
        let all: Vec<(usize, usize)> =
            (0..6).map(|score| brute_force(&detections, &truth, FRAMES, f64::from(score))).collect();
        for (score, expected) in all.iter().enumerate() {
            let point = e.curve.iter().rfind(|p| p.threshold >= score as f64);
            prop_assert_eq!(point.map_or((0, 0), |p| (p.true_detections, p.false_detections)), *expected);
        }
        let rate_within = |alarms: f64| {
            let hits = all.iter().filter(|(_, a)| *a as f64 <= alarms).map(|(hits, _)| *hits).max().unwrap_or(0);
            if targets == 0 { 0.0 } else { hits as f64 / targets as f64 }
        };
        let area: f64 = (0..FRAMES).map(|k| rate_within(k as f64) / FRAMES as f64).sum();
        // The same fractions summed in another order.
        prop_assert!((e.area - area).abs() < 1e-12, "{} {}", e.area, area);
        for (limit, at) in FALSE_ALARM_LIMITS.iter().zip(&e.at) {
            prop_assert_eq!(at.detection_rate, rate_within(limit * FRAMES as f64));
        }
    }
}
