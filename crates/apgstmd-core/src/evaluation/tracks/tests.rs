//! Cases worked by hand, and tiny ones in which every matching there is was tried.

use proptest::prelude::*;

use super::*;

fn target(frame: usize, id: i64, x: f64, y: f64) -> TruthBox {
    TruthBox { id: Some(id), ..TruthBox::new(frame, [x - 1.5, y - 1.5, 4.0, 4.0]) }
}

fn point(frame: usize, track: i64, x: f64, y: f64) -> Tracked {
    Tracked { frame, track, x, y }
}

fn judge(tracked: &[Tracked], truth: &[TruthBox]) -> TrackEvaluation {
    evaluate_tracks(tracked, truth, &Options::new(0..100)).unwrap()
}

/// Matched, misses, false positives, switches, fragmentations.
fn counts(e: &TrackEvaluation) -> [usize; 5] {
    let c = &e.clear;
    [c.matched, c.misses, c.false_positives, c.id_switches, c.fragmentations]
}

#[test]
fn a_perfect_track_has_one_everywhere() {
    let truth: Vec<TruthBox> = (0..10).map(|t| target(t, 4, 20.0 + t as f64, 20.0)).collect();
    let tracked: Vec<Tracked> = (0..10).map(|t| point(t, 9, 20.0 + t as f64, 20.0)).collect();
    let e = judge(&tracked, &truth);
    assert_eq!((e.clear.mota, e.clear.motp, e.identity.idf1), (1.0, Some(0.0), 1.0));
    assert_eq!((e.hota.hota, e.hota.det_a, e.hota.ass_a), (1.0, 1.0, 1.0));
    assert_eq!((counts(&e), e.tracks, e.identities), ([10, 0, 0, 0, 0], 1, 1));
    assert_eq!((e.clear.mostly_tracked, e.clear.partly_tracked, e.clear.mostly_lost), (1, 0, 0));
}

/// 3 px off is 0.6 of the limit: true at the thresholds 0.05 to 0.4 of 19.
#[test]
fn distance_over_limit() {
    let truth: Vec<TruthBox> = (0..10).map(|t| target(t, 4, 20.0, 20.0)).collect();
    let tracked: Vec<Tracked> = (0..10).map(|t| point(t, 9, 20.0, 23.0)).collect();
    let e = judge(&tracked, &truth);
    assert_eq!((e.clear.mota, e.clear.motp), (1.0, Some(3.0)));
    // 4 / 2 + 2 = 4 px: the disc of 5 px reaches farther.
    assert!((e.hota.hota - 8.0 / 19.0).abs() < 1e-12, "{}", e.hota.hota);
    let wide = TruthBox { id: Some(0), ..TruthBox::new(0, [10.0, 10.0, 30.0, 6.0]) };
    let similarity = |x: f64, y: f64| similarity(&Scored::new(0, x, y, 0.0), &wide, &Options::new(0..1));
    // Half of 30 and 2 px more: 17 px along x; 5 px along y, by the box as by the disc.
    assert!((similarity(24.5 + 8.5, 12.5) - 0.5).abs() < 1e-12 && (similarity(24.5, 12.5 + 2.5) - 0.5).abs() < 1e-12);
    assert_eq!((similarity(24.5, 12.5), similarity(24.5 + 17.0, 12.5)), (1.0, 0.0));
}

#[test]
fn switches_and_fragmentations() {
    let truth: Vec<TruthBox> = (0..12).map(|t| target(t, 4, 20.0, 20.0)).collect();
    let on = |t: usize, track: i64| point(t, track, 20.0, 20.0);
    // Track 1 in 0..4, nothing in 4..6, track 1 in 6..8, track 2 in 8..12.
    let tracked: Vec<Tracked> =
        (0..4).map(|t| on(t, 1)).chain((6..8).map(|t| on(t, 1))).chain((8..12).map(|t| on(t, 2))).collect();
    // A frame without any point does not end what was: TrackEval's choice, which makes the gap no fragmentation.
    assert_eq!(counts(&judge(&tracked, &truth)), [10, 2, 0, 1, 0]);
    let far: Vec<Tracked> = tracked.iter().copied().chain((0..12).map(|t| point(t, 7, 90.0, 90.0))).collect();
    let e = judge(&far, &truth);
    assert_eq!(counts(&e), [10, 2, 12, 1, 1]);
    assert!((e.clear.mota - (1.0 - 15.0 / 12.0)).abs() < 1e-12);
    // Of 12 + 22, 6 points of track 1 are its target's for good.
    assert_eq!((e.identity.id_true, e.identity.idf1), (6, 2.0 * 6.0 / 34.0));
    // 10 of 24; 6 with a Jaccard index of 6 / 12, 4 with 4 / 12.
    let (det_a, ass_a) = (10.0 / 24.0, (6.0 * 6.0 / 12.0 + 4.0 * 4.0 / 12.0) / 10.0);
    assert!((e.hota.det_a - det_a).abs() < 1e-12 && (e.hota.ass_a - ass_a).abs() < 1e-12);
    assert!((e.hota.hota - (det_a * ass_a).sqrt()).abs() < 1e-12);
}

#[test]
fn a_track_is_kept_although_another_is_nearer() {
    let truth: Vec<TruthBox> = (0..6).map(|t| target(t, 4, 20.0, 20.0)).collect();
    let mut tracked: Vec<Tracked> = (0..6).map(|t| point(t, 1, 20.0, 22.0)).collect();
    tracked.extend((3..6).map(|t| point(t, 2, 20.0, 20.0)));
    let e = judge(&tracked, &truth);
    assert_eq!((counts(&e), e.clear.motp), ([6, 0, 3, 0, 0], Some(2.0)));
}

#[test]
fn hidden_and_ignored_count_for_nothing() {
    let hidden = TruthBox { visible: false, ..target(1, 4, 20.0, 20.0) };
    let truth = [
        target(0, 4, 20.0, 20.0),
        hidden,
        target(2, 4, 20.0, 20.0),
        TruthBox { ignore: true, ..target(2, 5, 60.0, 20.0) },
    ];
    let tracked = [point(0, 1, 20.0, 20.0), point(1, 1, 20.0, 21.0), point(2, 1, 20.0, 20.0), point(2, 2, 60.0, 21.0)];
    let e = judge(&tracked, &truth);
    assert_eq!((counts(&e), e.neutral_points, e.points, e.tracks), ([2, 0, 0, 0, 0], 2, 2, 1));
    assert_eq!((e.hota.hota, e.identity.idf1), (1.0, 1.0));
    // Not tracking it there is no miss either.
    assert_eq!(counts(&judge(&tracked[..1], &truth[..2])), [1, 0, 0, 0, 0]);
}

#[test]
fn nothing_found_and_nothing_to_find() {
    let truth: Vec<TruthBox> = (0..4).map(|t| target(t, 4, 20.0, 20.0)).collect();
    let tracked: Vec<Tracked> = (0..4).map(|t| point(t, 1, 20.0, 20.0)).collect();
    for (e, expected) in
        [(judge(&[], &truth), [0, 4, 0, 0, 0]), (judge(&tracked, &[]), [0, 0, 4, 0, 0]), (judge(&[], &[]), [0; 5])]
    {
        assert_eq!(counts(&e), expected);
        assert_eq!((e.clear.mota, e.clear.motp, e.identity.idf1, e.hota.hota), (0.0, None, 0.0, 0.0));
    }
}

#[test]
fn targets_must_be_told_apart() {
    let anonymous = |t: usize, x: f64| TruthBox { id: None, ..target(t, 0, x, 20.0) };
    // One target without id is one target.
    assert_eq!(counts(&judge(&[point(0, 1, 20.0, 20.0)], &[anonymous(0, 20.0), anonymous(1, 20.0)])), [1, 1, 0, 0, 0]);
    let error = |tracked: &[Tracked], truth: &[TruthBox]| {
        evaluate_tracks(tracked, truth, &Options::new(0..9)).unwrap_err().to_string()
    };
    assert_eq!(
        error(&[], &[anonymous(3, 20.0), anonymous(3, 60.0)]),
        "frame 3 of the truth holds several targets without id: tracks can be judged only against ids"
    );
    assert_eq!(
        error(&[], &[target(3, 8, 20.0, 20.0), target(3, 8, 60.0, 20.0)]),
        "the target 8 is twice in frame 3, but it can be in one place only"
    );
    assert_eq!(
        error(&[point(2, 5, 1.0, 1.0), point(2, 5, 2.0, 2.0)], &[]),
        "the track 5 is twice in frame 2, but it can be in one place only"
    );
    assert!(error(&[point(2, 5, f64::NAN, 1.0)], &[]).contains("x = NaN"));
    // Outside the frames that are judged nothing is looked at.
    assert!(evaluate_tracks(&[point(20, 5, 1.0, 1.0); 2], &[], &Options::new(0..9)).is_ok());
}

/// All one-to-one matchings of `left` with `right`, as lists of pairs.
fn matchings(left: &[usize], right: &[usize]) -> Vec<Vec<(usize, usize)>> {
    let Some((&first, rest)) = left.split_first() else { return vec![vec![]] };
    let mut all = matchings(rest, right);
    for &partner in right {
        let others: Vec<usize> = right.iter().copied().filter(|r| *r != partner).collect();
        all.extend(matchings(rest, &others).into_iter().map(|mut m| {
            m.push((first, partner));
            m
        }));
    }
    all
}

const FRAMES: usize = 4;

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]
    /// Up to three targets and three tracks; IDF1 and the counts of a single frame against all matchings.
    #[test]
    fn equals_the_best_of_all_matchings(
        truth in prop::collection::btree_map((0..FRAMES, 0..3i64), (0.0..12.0f64, 0.0..12.0f64), 0..12),
        tracked in prop::collection::btree_map((0..FRAMES, 0..3i64), (0.0..12.0f64, 0.0..12.0f64), 0..12),
    ) {
        let truth: Vec<TruthBox> = truth.into_iter().map(|((t, id), (x, y))| target(t, id, x, y)).collect();
        let tracked: Vec<Tracked> = tracked.into_iter().map(|((t, id), (x, y))| point(t, id, x, y)).collect();
        let e = judge(&tracked, &truth);
        let options = Options::new(0..100);
        let near = |t: usize, id: usize, track: usize| {
            let b = truth.iter().find(|b| (b.frame, b.id) == (t, Some(id as i64)))?;
            let p = tracked.iter().find(|p| (p.frame, p.track) == (t, track as i64))?;
            matches(&scored(p), b, &options).then(|| similarity(&scored(p), b, &options))
        };
        let names = [0, 1, 2];
        let common = |m: &Vec<(usize, usize)>| m.iter().map(|&(i, j)| (0..FRAMES).filter(|t| near(*t, i, j).is_some()).count()).sum::<usize>();
        let best = matchings(&names, &names).iter().map(common).max().unwrap();
        prop_assert_eq!((e.identity.id_true, e.identity.id_missed, e.identity.id_false), (best, truth.len() - best, tracked.len() - best));
        // A single frame has nothing to be kept: CLEAR is the matching of the greatest similarity, 1/2 a match added.
        let first: Vec<TruthBox> = truth.iter().filter(|b| b.frame == 0).copied().collect();
        let now: Vec<Tracked> = tracked.iter().filter(|p| p.frame == 0).copied().collect();
        let total = |m: &Vec<(usize, usize)>| {
            let pairs: Vec<f64> = m.iter().filter_map(|&(i, j)| near(0, i, j)).collect();
            (pairs.iter().map(|s| 0.5 + 0.5 * s).sum::<f64>(), pairs.len())
        };
        let best = matchings(&names, &names).iter().map(total).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap().1;
        prop_assert_eq!(counts(&judge(&now, &first)), [best, first.len() - best, now.len() - best, 0, 0]);
    }
}
