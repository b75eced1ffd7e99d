//! Text: parameter and scene files, tables, arguments, names.

use std::cell::RefCell;
use std::cmp::Ordering;
use std::path::{Path, PathBuf};

use apgstmd_cli::args::Arguments;
use apgstmd_cli::boundary::{detections_json, in_natural_order, location, name_of_video, printf_pattern};
use apgstmd_cli::sink::table::{Csv, JsonLines, Target};
use apgstmd_cli::sink::tracks::{Coco, Mot, TracksCsv};
use apgstmd_cli::sink::{Seen, Sink};
use apgstmd_cli::source::{Picture, Pixels, Place, RawFormat, Span};
use apgstmd_core::evaluation::{
    Options, Scored, detections_from_text, evaluate, evaluate_tracks, tracks_from_text, truth_from_text,
};
use apgstmd_core::stimulus::{Renderer, Scene, truth_from_csv, truth_to_csv};
use apgstmd_core::tracking::{TrackPoint, TrackState};
use apgstmd_core::{BankParams, Detection, EgoMotion, Params};
use arbitrary::Unstructured;
use clap::{CommandFactory, FromArgMatches};
use ndarray::Array3;

use super::{any_float, text_of, whole};

/// A parameter file that is taken can be written, and is then the same.
pub fn parameters(bytes: &[u8]) {
    let text = text_of(bytes);
    if let Ok(params) = Params::from_toml(&text) {
        params.validate().expect("what was read is valid");
        assert_eq!(Params::from_toml(&params.to_toml()).expect("what was written can be read"), params);
    }
    if let Ok(Some(bank)) = BankParams::from_toml(&text)
        && bank.validate().is_ok()
    {
        assert_eq!(BankParams::from_toml(&bank.to_toml()).expect("what was written can be read"), Some(bank));
    }
}

/// A scene that is taken can be written, and what is drawn of it is luminance.
pub fn scene(bytes: &[u8]) {
    /// Larger ones take longer and show nothing else.
    const MOST: usize = 1 << 14;
    let Ok(scene) = Scene::from_toml(&text_of(bytes)) else { return };
    assert_eq!(Scene::from_toml(&scene.to_toml()).expect("what was written can be read"), scene);
    if scene.width * scene.height > MOST {
        return;
    }
    let Ok(renderer) = Renderer::new(&scene) else { return };
    for t in [0, scene.frames / 2, scene.frames - 1] {
        assert!(renderer.frame(t).iter().all(|value| (0.0..=1.0).contains(value)), "frame {t} is luminance");
        let truth = renderer.truth(t);
        let table = truth_to_csv(&truth);
        assert_eq!(truth_from_csv(&table).expect("what was written can be read").len(), truth.len());
        truth_from_text(&table).expect("the evaluator reads it too");
    }
}

/// Truth in any form either is refused or can be judged against.
pub fn truth(bytes: &[u8]) {
    let text = text_of(bytes);
    let _ = truth_from_csv(&text);
    if let Ok(truth) = truth_from_text(&text) {
        let found: Vec<Scored> = truth
            .iter()
            .map(|target| {
                let (x, y) = target.center();
                Scored::new(target.frame, x, y, 1.0)
            })
            .collect();
        let options = Options::spanning(&found, &truth);
        if let Ok(evaluation) = evaluate(&found, &truth, &options) {
            super::judging::is_sound(&evaluation);
        }
        let _ = evaluate_tracks(&[], &truth, &options);
    }
}

/// Detections and tracks in any form either are refused or can be judged.
pub fn detections(bytes: &[u8]) {
    let text = text_of(bytes);
    for found in [detections_from_text(&text).ok(), detections_json(&text).ok()].into_iter().flatten() {
        if let Ok(evaluation) = evaluate(&found, &[], &Options::spanning(&found, &[])) {
            super::judging::is_sound(&evaluation);
        }
    }
    if let Ok(Some(tracks)) = tracks_from_text(&text) {
        let last = tracks.iter().map(|point| point.frame).max().unwrap_or(0);
        if let Ok(judged) = evaluate_tracks(&tracks, &[], &Options::new(0..last.saturating_add(1))) {
            super::judging::are_sound(&judged);
        }
    }
}

/// What is written of any frame, under any name, can be read again by the evaluator and by any JSON parser.
pub fn written(bytes: &[u8]) {
    let mut input = Unstructured::new(bytes);
    let folder = tempfile::tempdir_in(std::env::temp_dir()).expect("a folder");
    let file = |name: &str| folder.path().join(name);
    let frame = whole(&mut input, 0..=1 << 20) as usize;
    let number = |input: &mut Unstructured<'_>| Some(any_float(input) as f32).filter(|v| v.is_finite()).unwrap_or(0.5);
    let detections: Vec<Detection> = (0..whole(&mut input, 0..=3))
        .map(|trace| Detection {
            x: number(&mut input),
            y: number(&mut input),
            score: number(&mut input).abs(),
            direction: any_float(&mut input) as f32,
            trace: u64::from(trace),
            contrast: number(&mut input),
            ..Detection::default()
        })
        .map(|found| match found.direction.is_finite() {
            true => found,
            false => Detection { direction: f32::NAN, ..found },
        })
        .collect();
    let point = |(index, found): (usize, &Detection)| TrackPoint {
        frame,
        time: None,
        track: index as u64,
        x: f64::from(found.x),
        y: f64::from(found.y),
        vx: 0.5,
        vy: -0.5,
        score: found.score,
        state: if index == 0 { TrackState::Confirmed } else { TrackState::Coasting },
        age: 3,
    };
    let tracks: Vec<TrackPoint> = detections.iter().enumerate().map(point).collect();
    let name = text_of(input.take_rest()).into_owned();
    let seen = Seen {
        frame,
        name: name.clone(),
        time: Some(0.25),
        picture: Picture { pixels: Pixels::U8(Array3::zeros((16, 17, 1))), bits: None },
        detections,
        tracks,
        background_shift: (0.0, 0.0),
        ego_motion: EgoMotion::default(),
        cut: false,
        maps: Vec::new(),
        response: None,
    };
    let ready = "the folder can be written";
    let mut sinks: [Box<dyn Sink>; 5] = [
        Box::new(Csv::new(Target::file(&file("d.csv")).expect(ready)).expect(ready)),
        Box::new(JsonLines::new(Target::file(&file("d.jsonl")).expect(ready))),
        Box::new(TracksCsv::new(&file("t.csv")).expect(ready)),
        Box::new(Mot::new(&file("t.txt"), 5.0).expect(ready)),
        Box::new(Coco::new(&file("t.json"), 5.0).expect(ready)),
    ];
    for sink in &mut sinks {
        sink.frame(&seen).expect(ready);
        sink.finish().expect(ready);
    }
    let text = |name: &str| std::fs::read_to_string(file(name)).expect("UTF-8");
    let count = seen.detections.len();
    let table = detections_from_text(&text("d.csv")).expect("our own table");
    let lines = detections_json(&text("d.jsonl")).expect("our own lines");
    assert_eq!((table.len(), lines.len()), (count, count));
    for ((row, line), found) in table.iter().zip(&lines).zip(&seen.detections) {
        let same = |row: &Scored| row.x as f32 == found.x && row.y as f32 == found.y && row.score as f32 == found.score;
        assert!(same(row) && same(line), "{row:?} {line:?} {found:?}");
        assert_eq!(row.direction.is_none(), found.direction.is_nan());
    }
    assert_eq!(tracks_from_text(&text("t.csv")).expect("our own table").map_or(0, |t| t.len()), count);
    if count > 0 {
        assert_eq!(tracks_from_text(&text("t.txt")).expect("MOT").expect("ids").len(), count);
    }
    let coco: serde_json::Value = serde_json::from_str(&text("t.json")).expect("JSON");
    assert_eq!(coco["images"][0]["file_name"], name.as_str());
    assert_eq!(coco["annotations"].as_array().map(Vec::len), Some(count));
}

/// Arguments, one a line, are taken or refused with a message.
pub fn arguments(bytes: &[u8]) {
    const FLAGS: [&str; 8] =
        ["--speed", "--false-alarms", "--speeds", "--simd", "--live", "--format", "--start", "--dump"];
    let text = text_of(bytes);
    let words: Vec<&str> = text.lines().collect();
    parsed(&mut words.iter().copied());
    // The values of flags, without finding the flag first.
    for (word, flag) in words.iter().zip(FLAGS.iter().cycle()) {
        let _ = word.parse::<RawFormat>();
        if let Ok(place) = word.parse::<Place>() {
            assert_eq!(place.to_string().parse(), Ok(place), "{word}");
            for span in [Span::new(place, None, Place::Frames(1)), Span::new(Place::Frames(0), Some(place), place)] {
                let _ = span.and_then(|span| span.of(1000, Some(25.0)));
            }
        }
        parsed(&mut ["run", "x", &format!("{flag}={word}")].into_iter());
    }
}

/// Parses a command line, or is told why not.
fn parsed(words: &mut dyn Iterator<Item = &str>) {
    thread_local! {
        // Making it takes a hundred times as long as parsing.
        static COMMAND: RefCell<clap::Command> = RefCell::new(Arguments::command());
    }
    let words = std::iter::once("apgstmd").chain(words);
    let arguments = COMMAND.with_borrow_mut(|command| command.try_get_matches_from_mut(words));
    if let Err(error) = arguments.and_then(|matches| Arguments::from_arg_matches(&matches)) {
        assert!(!error.to_string().is_empty());
    }
}

/// Names, one a line, have one order, whatever order they came in; numbers count in it; results are named after an input
/// without leaving the folder.
pub fn names(bytes: &[u8]) {
    /// More take longer and show nothing else.
    const MOST: usize = 64;
    let text = text_of(bytes);
    let given: Vec<PathBuf> = text.split('\n').take(MOST).map(PathBuf::from).collect();
    let (mut forward, mut backward) = (given.clone(), given.clone());
    backward.reverse();
    in_natural_order(&mut forward);
    in_natural_order(&mut backward);
    assert_eq!(forward, backward, "the order depends on the order of the folder");
    for first in given.iter().take(8) {
        for second in given.iter().take(8) {
            let mut pair = [second.clone(), first.clone()];
            in_natural_order(&mut pair);
            // Paths that differ in `//` and `./` are equal as paths.
            let place = |name: &PathBuf| forward.iter().position(|other| other.as_os_str() == name.as_os_str());
            assert_ne!(place(&pair[0]).cmp(&place(&pair[1])), Ordering::Greater, "{first:?} {second:?}");
            let _ = printf_pattern(first, second);
        }
        let stem = first.display().to_string();
        let numbered = |number: u32| PathBuf::from(format!("a{}_{number}.png", stem.replace(['/', '.'], "")));
        if !stem.ends_with(|c: char| c.is_numeric()) {
            let mut pair = [numbered(10), numbered(9)];
            in_natural_order(&mut pair);
            assert_eq!(pair, [numbered(9), numbered(10)]);
        }
        let named = name_of_video(first.clone());
        assert!(is_plain(&named), "{first:?} gives {named:?}");
        if let Some((shown, named)) = location(first) {
            assert!(is_plain(&named), "{first:?} gives {named:?}");
            assert!(!shown.is_empty());
        }
    }
}

/// A name of a file in a folder.
fn is_plain(name: &str) -> bool {
    let path = Path::new(name);
    path.components().count() == 1 && path.file_name().is_some() && !name.contains(['/', '\n', '\0', '"', '<'])
}
