//! The evaluator: compared with the words of its rule, matched anew at every threshold; tracks held to their bounds.

use apgstmd_core::evaluation::{
    Evaluation, Options, Scored, TrackEvaluation, Tracked, TruthBox, evaluate, evaluate_tracks,
};
use arbitrary::Unstructured;

use super::{any_float, whole};

const FRAMES: usize = 4;

/// Counts and shares of an evaluation agree and are numbers.
pub fn is_sound(evaluation: &Evaluation) {
    let share = |value: f64, what: &str| assert!((0.0..=1.0 + 1e-12).contains(&value), "{what} is {value}");
    share(evaluation.area, "area");
    share(evaluation.average_precision, "average precision");
    for point in &evaluation.curve {
        share(point.detection_rate, "detection rate");
        share(point.precision, "precision");
        share(point.f1, "f1");
        assert!(point.false_alarms.is_finite() && point.threshold.is_finite());
    }
    for at in evaluation.at.iter().chain([&evaluation.best_f1, &evaluation.all]) {
        let finite = |value: Option<f64>| value.is_none_or(f64::is_finite);
        assert!(finite(at.localisation_error) && finite(at.direction_error), "{at:?}");
    }
    assert!(evaluation.true_detections <= evaluation.targets);
}

/// The same of tracks.
pub fn are_sound(judged: &TrackEvaluation) {
    let share = |value: f64| (0.0..=1.0 + 1e-12).contains(&value);
    assert!(judged.clear.mota <= 1.0 && judged.clear.mota.is_finite(), "{judged:?}");
    assert!(judged.clear.motp.is_none_or(f64::is_finite), "{judged:?}");
    let shares = [judged.identity.idf1, judged.hota.hota, judged.hota.det_a, judged.hota.ass_a];
    assert!(shares.into_iter().all(share), "{judged:?}");
    assert_eq!(judged.identity.id_true + judged.identity.id_false, judged.points);
}

/// A place on a grid of half pixels, so that ties of every kind happen, or anywhere at all.
fn place(input: &mut Unstructured<'_>, wild: bool) -> f64 {
    if wild { any_float(input) } else { f64::from(whole(input, 0..=48)) / 2.0 }
}

fn boxes(input: &mut Unstructured<'_>, wild: bool) -> Vec<TruthBox> {
    let count = whole(input, 0..=12);
    (0..count)
        .map(|index| {
            let frame = whole(input, 0..=FRAMES as u32 - 1) as usize;
            let at = [place(input, wild), place(input, wild)];
            let sides = [place(input, wild).abs(), place(input, wild).abs() / 4.0];
            TruthBox {
                visible: whole(input, 0..=3) > 0,
                ignore: whole(input, 0..=5) == 0,
                id: Some(i64::from(index) / 3).filter(|_| whole(input, 0..=7) > 0),
                ..TruthBox::new(frame, [at[0], at[1], sides[0], sides[1]])
            }
        })
        .collect()
}

/// Equal to matching anew at every threshold, where distances have no rounding; sound anywhere.
pub fn evaluator(bytes: &[u8]) {
    let mut input = Unstructured::new(bytes);
    let wild = whole(&mut input, 0..=3) == 0;
    let truth = boxes(&mut input, wild);
    let found: Vec<Scored> = (0..whole(&mut input, 0..=24))
        .map(|_| {
            let frame = whole(&mut input, 0..=FRAMES as u32 - 1) as usize;
            let (x, y) = (place(&mut input, wild), place(&mut input, wild));
            let score = if wild { any_float(&mut input) } else { f64::from(whole(&mut input, 0..=5)) };
            Scored::new(frame, x, y, score)
        })
        .collect();
    let Ok(evaluation) = evaluate(&found, &truth, &Options::new(0..FRAMES)) else {
        assert!(wild, "numbers are refused that are numbers");
        return;
    };
    is_sound(&evaluation);
    if wild {
        return;
    }
    for threshold in 0..6 {
        let expected = brute_force(&found, &truth, f64::from(threshold));
        let point = evaluation.curve.iter().rfind(|point| point.threshold >= f64::from(threshold));
        let given = point.map_or((0, 0), |point| (point.true_detections, point.false_detections));
        assert_eq!(given, expected, "at {threshold}");
    }
}

/// True and false detections at one threshold.
fn brute_force(found: &[Scored], truth: &[TruthBox], threshold: f64) -> (usize, usize) {
    let (mut hits, mut alarms) = (0, 0);
    for frame in 0..FRAMES {
        let mut left: Vec<&Scored> = found.iter().filter(|d| d.frame == frame && d.score >= threshold).collect();
        let here = || truth.iter().filter(move |target| target.frame == frame);
        let mut targets: Vec<&TruthBox> = here().filter(|target| target.visible && !target.ignore).collect();
        let pardons: Vec<&TruthBox> = here().filter(|target| !target.visible || target.ignore).collect();
        // The best first; of equal ones the one that was given first.
        while let Some(best) = left.iter().map(|d| d.score).reduce(f64::max) {
            let detection = left.remove(left.iter().position(|d| d.score == best).expect("it is one of them"));
            let mut nearest: Option<(f64, usize)> = None;
            for (index, target) in targets.iter().enumerate() {
                if let Some(distance) = gap(detection, target)
                    && nearest.is_none_or(|(least, _)| distance < least)
                {
                    nearest = Some((distance, index));
                }
            }
            match nearest {
                Some((_, index)) => {
                    targets.remove(index);
                    hits += 1;
                }
                None if pardons.iter().any(|target| gap(detection, target).is_some()) => {}
                None => alarms += 1,
            }
        }
    }
    (hits, alarms)
}

/// Squared distance from the centre, where it counts.
fn gap(detection: &Scored, target: &TruthBox) -> Option<f64> {
    let dx = detection.x + 0.5 - target.x - target.width / 2.0;
    let dy = detection.y + 0.5 - target.y - target.height / 2.0;
    let in_box = dx.abs() <= target.width / 2.0 + 2.0 && dy.abs() <= target.height / 2.0 + 2.0;
    let squared = dx * dx + dy * dy;
    (squared <= 25.0 || in_box).then_some(squared)
}

/// Tracks of any kind are refused, or judged within the bounds of each number; a track that is the truth is perfect.
pub fn track_evaluator(bytes: &[u8]) {
    let mut input = Unstructured::new(bytes);
    let wild = whole(&mut input, 0..=3) == 0;
    let truth = boxes(&mut input, wild);
    let options = Options::new(0..FRAMES);
    let tracked: Vec<Tracked> = (0..whole(&mut input, 0..=20))
        .map(|_| Tracked {
            frame: whole(&mut input, 0..=FRAMES as u32 - 1) as usize,
            track: i64::from(whole(&mut input, 0..=5)),
            x: place(&mut input, wild),
            y: place(&mut input, wild),
        })
        .collect();
    if let Ok(judged) = evaluate_tracks(&tracked, &truth, &options) {
        are_sound(&judged);
    }
    let own: Vec<Tracked> = truth
        .iter()
        .filter(|target| target.counts())
        .map(|target| {
            let (x, y) = target.center();
            Tracked { frame: target.frame, track: target.id.unwrap_or(-1), x, y }
        })
        .collect();
    // Where targets lie on each other the nearest may be the other one.
    let apart = |a: &Tracked| own.iter().filter(|b| b.frame == a.frame && (b.x, b.y) == (a.x, a.y)).count() == 1;
    if let Ok(judged) = evaluate_tracks(&own, &truth, &options)
        && !wild
        && !own.is_empty()
        && own.iter().all(apart)
    {
        assert_eq!((judged.identity.idf1, judged.clear.misses, judged.clear.false_positives), (1.0, 0, 0));
    }
}
