//! Which frames count.

use super::*;

fn run(text: &str) -> Outcome<Option<RunFrames>> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("run.json"), text).unwrap();
    RunFrames::beside(&folder.path().join("detections.csv"))
}

fn record(frames: usize, skipped: &str, start: usize, stop: usize, step: usize) -> RunFrames {
    let text = format!(
        r#"{{"program": "apgstmd", "frames": {frames}, "skipped": {skipped}, "interrupted": false, "error": null,
            "input": {{"pictures": 100, "start": {start}, "stop": {stop}, "step": {step}}}}}"#
    );
    run(&text).unwrap().unwrap()
}

fn frames(run: Option<&RunFrames>, given: Option<usize>, range: (usize, Option<usize>)) -> Outcome<Frames> {
    Frames::resolve(run, given, range, &[Scored::new(7, 0.0, 0.0, 1.0)], &[TruthBox::new(9, [0.0; 4])])
}

/// Those that have a rank, in order, each one above the last.
fn judged(frames: &Frames) -> Vec<usize> {
    let all: Vec<usize> = (0..200).filter(|frame| frames.rank(*frame).is_some()).collect();
    assert!(all.iter().enumerate().all(|(i, frame)| frames.rank(*frame) == Some(i)));
    assert_eq!((frames.count(), frames.first(), frames.last()), (all.len(), all[0], *all.last().unwrap()));
    all
}

#[test]
fn run_json_before_frames_before_the_last_named() {
    let all = record(100, "[]", 0, 100, 1);
    assert_eq!(judged(&frames(Some(&all), Some(100), (0, None)).unwrap()).len(), 100);
    assert_eq!(judged(&frames(None, Some(40), (0, None)).unwrap()).len(), 40);
    let named = frames(None, None, (0, None)).unwrap();
    assert_eq!((judged(&named).len(), named.origin()), (10, &Origin::Named));
    assert_eq!(judged(&frames(None, None, (3, Some(30))).unwrap()).len(), 27);
    assert_eq!(judged(&frames(None, Some(40), (3, Some(30))).unwrap()), (3..30).collect::<Vec<_>>());
    assert!(frames(Some(&all), Some(99), (0, None)).is_err());
    for range in [(10, None), (5, Some(5))] {
        assert!(frames(None, None, range).is_err());
    }
    assert!(frames(None, Some(0), (0, None)).is_err());
    assert!(Frames::resolve(None, None, (0, None), &[], &[]).is_err());
}

#[test]
fn steps_skipped_pictures_and_early_ends() {
    let stepped = record(4, "[]", 10, 22, 3);
    assert_eq!(judged(&frames(Some(&stepped), None, (0, None)).unwrap()), [10, 13, 16, 19]);
    assert_eq!(judged(&frames(Some(&stepped), None, (11, Some(19))).unwrap()), [13, 16]);
    let gaps = record(3, r#"[{"frame": 13}]"#, 10, 22, 3);
    assert_eq!(judged(&frames(Some(&gaps), None, (0, None)).unwrap()), [10, 16, 19]);
    let early = record(5, "[]", 10, 90, 2);
    assert_eq!(judged(&frames(Some(&early), None, (0, None)).unwrap()), [10, 12, 14, 16, 18]);
}

/// Frames dropped live, and those between steps in seconds.
#[test]
fn what_was_left_out_is_no_miss() {
    let left_out = |text: &str, frames: usize, step: usize| {
        run(&format!(
            r#"{{"program": "apgstmd", "frames": {frames}, "skipped": [], "interrupted": false, "error": null,
                "input": {{"pictures": 20, "start": 2, "stop": 14, "step": {step}, "left_out": "{text}"}}}}"#
        ))
    };
    let of =
        |text, count, step| judged(&frames(left_out(text, count, step).unwrap().as_ref(), None, (0, None)).unwrap());
    assert_eq!(of("3..5,9", 8, 1), [2, 6, 7, 8, 10, 11, 12, 13]);
    assert_eq!(of("4..8", 3, 2), [2, 10, 12]);
    // It ended early: three and what lies between them.
    assert_eq!(of("3..5", 3, 1), [2, 6, 7]);
    for bad in ["x", "1", "13..14", "5..3..1"] {
        assert!(left_out(bad, 3, 1).is_err(), "{bad}");
    }
}

/// Of very many run.json lists the first: then camera.csv tells, which has a row for each frame that was processed.
#[test]
fn more_than_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.json");
    let text = r#"{"program": "apgstmd", "frames": 5, "skipped": [{"frame": 4}], "frames_skipped": 2, "interrupted": true, "error": null,
        "input": {"pictures": 100, "start": 2, "stop": 100, "step": 1, "left_out": "5..6", "frames_left_out": 3}}"#;
    fs::write(&path, text).unwrap();
    let beside = || RunFrames::beside(&folder.path().join("detections.csv"));
    let told = beside().unwrap_err().text().unwrap();
    assert!(told.contains("camera.csv") && told.contains("no such file"), "{told}");
    // The last row is a part of one.
    fs::write(folder.path().join("camera.csv"), "frame,time_s\n2,0\n3,1\n7,2\n10,8\n11,9\n1").unwrap();
    assert_eq!(judged(&frames(beside().unwrap().as_ref(), None, (0, None)).unwrap()), [2, 3, 7, 10, 11]);
    assert!(RunFrames::parse(text, Path::new("the run")).is_err());
    // Nobody's memory holds so many, whatever is claimed.
    let text = text.replace("5..6", "5..99999999999").replace("100,", "999999999999,");
    assert!(RunFrames::parse(&text, &path).is_err());
}

#[test]
fn other_programs_may_have_a_run_json_too() {
    assert_eq!(run(r#"{"program": "other"}"#).unwrap(), None);
    assert_eq!(run("[]").unwrap(), None);
    assert!(run(r#"{"program": "apgstmd"}"#).is_err());
    assert!(run("{").is_err());
}

#[test]
fn what_was_not_processed_is_no_miss() {
    // Seen every second frame; the target is there in all of them and found in each that was seen.
    let run = record(50, "[]", 0, 100, 2);
    let truth: Vec<TruthBox> = (0..100).map(|t| TruthBox::new(t, [t as f64, 20.0, 4.0, 4.0])).collect();
    let mut found: Vec<Scored> = (0..100).step_by(2).map(|t| Scored::new(t, t as f64 + 1.5, 21.5, 1.0)).collect();
    found.extend((0..25).map(|t| Scored::new(2 * t, 90.0, 90.0, 0.5)));
    let frames = Frames::resolve(Some(&run), None, (0, None), &found, &truth).unwrap();
    let tracks: Vec<Tracked> =
        (0..100).step_by(2).map(|t| Tracked { frame: t, track: 3, x: t as f64 + 1.5, y: 21.5 }).collect();
    let judgement = judge(&found, Some(&tracks), &truth, &frames, 5.0, 2.0).unwrap();
    let tracked = judgement.tracks.unwrap().unwrap();
    assert_eq!((tracked.clear.mota, tracked.identity.idf1, tracked.hota.hota), (1.0, 1.0, 1.0));
    let e = &judgement.evaluation;
    assert_eq!((e.frames, e.targets, e.true_detections, e.false_detections), (50, 50, 50, 25));
    assert_eq!(e.all.point.unwrap().false_alarms, 0.5);
    assert_eq!((judgement.detections_outside, judgement.truth_outside), (0, 50));
}
