//! Tracks: what `run` writes of them, what `eval` makes of it.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::common::{HEIGHT, ROW, WIDTH, apgstmd, column, command, folder, json, results};
use serde_json::Value;

const HEADER: &str = "frame,time_s,track,x,y,vx,vy,score,state,age";

/// Rows of tracks.csv, each with all its fields.
fn rows(path: &Path) -> Vec<Vec<String>> {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.ends_with('\n'), "the last row is complete");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some(HEADER));
    let rows: Vec<Vec<String>> = lines.map(|line| line.split(',').map(str::to_owned).collect()).collect();
    assert!(rows.iter().all(|row| row.len() == 10));
    rows
}

fn number(row: &[String], name: &str) -> f64 {
    row[HEADER.split(',').position(|column| column == name).unwrap()].parse().unwrap()
}

/// The square of 5 px in every frame.
fn truth(frames: usize, path: &Path) {
    let row = |t: usize| format!("{t},{},{},5,5,3\n", column(t) - 2.0, ROW - 2.0);
    fs::write(path, "frame,x,y,w,h,id\n".to_owned() + &(0..frames).map(row).collect::<String>()).unwrap();
}

fn judged(found: &Path, truth: &Path) -> Value {
    serde_json::from_str(&apgstmd("eval {in} {out} --json", found, truth).ok().stdout).unwrap()
}

#[test]
fn one_target_is_one_track_in_every_form() {
    let frames = folder(60);
    let (parent, out) = results();
    let [mot, coco, boxes] = ["t.txt", "t.json", "truth.csv"].map(|name| parent.path().join(name));
    let line = format!("run {{in}} --out {{out}} --speed 1 --mot {} --coco {}", mot.display(), coco.display());
    let ran = apgstmd(&line, frames.path(), &out).ok();
    for file in ["tracks.csv", "t.txt", "t.json", "1 track\n"] {
        assert!(ran.stderr.contains(file), "{}", ran.stderr);
    }
    let rows = rows(&out.join("tracks.csv"));
    assert_eq!(json(&out.join("run.json"))["found"]["tracks"], 1);
    assert!(rows.len() > 30);
    for (i, row) in rows.iter().enumerate() {
        let frame = number(row, "frame");
        let off = (number(row, "x") - column(frame as usize)).hypot(number(row, "y") - ROW);
        assert!(off < 3.0 && number(row, "track") == 0.0, "{row:?}");
        assert_eq!((number(row, "age"), row[1].as_str()), (i as f64, ""), "no frame is left out, no time is known");
        assert!(i < 20 || ((number(row, "vx") - 1.0).abs() < 0.3 && number(row, "vy").abs() < 0.3), "{row:?}");
    }

    let text = fs::read_to_string(&mot).unwrap();
    assert_eq!(text.lines().count(), rows.len());
    for (line, row) in text.lines().zip(&rows) {
        let v: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        assert_eq!(v.len(), 10);
        assert_eq!((v[0], v[1], v[4], v[5]), (number(row, "frame") + 1.0, 1.0, 5.0, 5.0), "the size the model prefers");
        // Pixel i, counted from 1, lies between i - 1/2 and i + 1/2 there: the box of 5 px begins 2 px before.
        assert!((v[2] - (number(row, "x") + 1.0 - 2.0)).abs() < 2e-3, "{line} {row:?}");
        assert_eq!((v[6], v[7], v[8], v[9]), (number(row, "score"), -1.0, -1.0, -1.0));
    }

    let data = json(&coco);
    assert_eq!(data["info"]["schema_version"], 1);
    let images = data["images"].as_array().unwrap();
    assert_eq!(images.len(), 60);
    assert_eq!((&images[7]["file_name"], &images[7]["width"]), (&"f_7.png".into(), &WIDTH.into()));
    assert_eq!((&images[7]["height"], &images[7]["frame"]), (&HEIGHT.into(), &7.into()));
    let annotations = data["annotations"].as_array().unwrap();
    assert_eq!(annotations.len(), rows.len());
    for (annotation, row) in annotations.iter().zip(&rows) {
        let value = |at: &str| annotation.pointer(at).unwrap().as_f64().unwrap();
        assert_eq!(value("/image_id"), number(row, "frame") + 1.0);
        assert_eq!((value("/bbox/2"), value("/area"), value("/track_id")), (5.0, 25.0, 0.0));
        assert!((value("/bbox/0") + 2.0 - number(row, "x")).abs() < 2e-3);
        assert_eq!((value("/center/0"), annotation["category_id"].clone()), (number(row, "x"), 1.into()));
    }
    assert!(!parent.path().join("t.json.part").exists());

    truth(60, &boxes);
    let whole = judged(&out, &boxes);
    let tracks = &whole["tracks"];
    assert_eq!((&tracks["tracks"], &tracks["id_switches"], &tracks["identities"]), (&1.into(), &0.into(), &1.into()));
    assert!(tracks["mota"].as_f64().unwrap() > 0.6 && tracks["idf1"].as_f64().unwrap() > 0.8, "{tracks}");
    // Boxes of MOTChallenge text are rounded to a thousandth of a pixel.
    for file in [out.join("tracks.csv"), mot] {
        let again = judged(&file, &boxes);
        for key in ["mota", "idf1", "hota", "det_a", "ass_a"] {
            let [a, b] = [&again, &whole].map(|value| value["tracks"][key].as_f64().unwrap());
            assert!((a - b).abs() < 0.02, "{} {key}: {a} {b}", file.display());
        }
        assert_eq!(again["tracks"]["matched"], tracks["matched"]);
    }
}

/// Pictures that cannot be used count as time that passes; those that --step passes over do not, as for the detector.
#[test]
fn tracks_go_on_over_frames_left_out() {
    let frames = folder(60);
    for frame in [30, 31, 32, 45] {
        fs::write(frames.path().join(format!("f_{frame}.png")), "no picture").unwrap();
    }
    let (_parent, out) = results();
    apgstmd("run {in} --out {out} --speed 1 --fps 8 --on-error skip", frames.path(), &out).ok();
    let found = rows(&out.join("tracks.csv"));
    let moves: Vec<_> = found.iter().filter(|row| number(row, "track") == 0.0).collect();
    let (first, last) = (number(&found[0], "frame"), moves[moves.len() - 1]);
    assert!((number(last, "vx") - 1.0).abs() < 0.3, "{last:?}");
    for row in moves {
        let frame = number(row, "frame");
        assert_eq!((number(row, "age"), number(row, "time_s")), (frame - first, frame / 8.0), "{row:?}");
        // The detector, which knows no gaps, is late for a moment.
        let off = (number(row, "x") - column(frame as usize)).hypot(number(row, "y") - ROW);
        assert!(off < 5.0, "{row:?}");
    }
    let numbers: Vec<f64> = found.iter().map(|row| number(row, "frame")).collect();
    assert!(numbers.contains(&29.0) && !numbers.contains(&31.0) && numbers.contains(&59.0), "{numbers:?}");

    apgstmd("run {in} --out {out} --speed 2 --fps 8 --step 2 --start 1 --stop 31 --force", frames.path(), &out).ok();
    let found = rows(&out.join("tracks.csv"));
    assert!(found.len() > 5);
    for row in found {
        let frame = number(&row, "frame");
        assert!((frame - 1.0) % 2.0 == 0.0 && number(&row, "time_s") == frame / 8.0, "{row:?}");
        assert!(number(&row, "age") <= (frame - 1.0) / 2.0, "{row:?}");
    }
}

#[test]
fn table_and_page_tell_of_tracks() {
    let parent = tempfile::tempdir().unwrap();
    let path = |name: &str| parent.path().join(name);
    truth(10, &path("truth.csv"));
    // 1 px off; another id from frame 5 on.
    let row = |t: usize| format!("{t},{},{},{},1\n", usize::from(t >= 5), column(t), ROW + 1.0);
    fs::write(path("t.csv"), "frame,track,x,y,score\n".to_owned() + &(0..10).map(row).collect::<String>()).unwrap();
    let line = format!("eval {{in}} {{out}} --html {}", path("p.html").display());
    let table = apgstmd(&line, &path("t.csv"), &path("truth.csv")).ok().stdout;
    let line = |name: &str| table.lines().find(|line| line.starts_with(name)).unwrap_or_default();
    assert!(line("MOTA").contains("0.900") && line("MOTA").contains("1 switches"), "{table}");
    assert!(line("MOTP").contains("1.00 px") && line("IDF1").contains("0.500"), "{table}");
    // 1 of 5 px is a similarity of 0.8: true at 16 of 19 thresholds, where DetA = 1 and AssA = 1/2.
    let hota = 16.0 / 19.0 * 0.5f64.sqrt();
    assert!(line("HOTA").contains(&format!("{hota:.3}")), "{table}");
    let page = fs::read_to_string(path("p.html")).unwrap();
    for part in ["Tracks", "MOTA", "0.900", "IDF1", &format!("{hota:.3}")] {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn tracks_that_cannot_be_judged_leave_the_rest() {
    let parent = tempfile::tempdir().unwrap();
    let path = |name: &str| parent.path().join(name);
    fs::write(path("t.csv"), "frame,track,x,y,score\n0,0,10,10,1\n0,1,50,10,1\n").unwrap();
    fs::write(path("truth.csv"), "frame,x,y,w,h\n0,8,8,5,5\n0,48,8,5,5\n").unwrap();
    let value = judged(&path("t.csv"), &path("truth.csv"));
    assert_eq!((&value["tracks"], &value["true_detections"]), (&Value::Null, &2.into()));
    let note = value["notes"][0].as_str().unwrap();
    assert!(note.contains("tracks are not judged") && note.contains("without id"), "{note}");
    // Without tracks there is nothing to say of them.
    fs::write(path("t.csv"), "frame,x,y,score\n0,10,10,1\n").unwrap();
    assert_eq!(judged(&path("t.csv"), &path("truth.csv"))["notes"], Value::Array(vec![]));
}

#[test]
fn no_tracks() {
    let frames = folder(30);
    let (_parent, out) = results();
    let ran = apgstmd("run {in} --out {out} --speed 1 --no-tracks", frames.path(), &out).ok();
    assert!(!out.join("tracks.csv").exists() && !ran.stderr.contains("track"), "{}", ran.stderr);
    assert_eq!(json(&out.join("run.json"))["found"]["tracks"], Value::Null);
}

#[test]
fn tracks_beside_a_pipe() {
    let frames = folder(40);
    let (parent, out) = results();
    let mot = parent.path().join("t.txt");
    let line = format!("run {{in}} --out - --speed 1 --mot {} --box-size 8.5", mot.display());
    let piped = apgstmd(&line, frames.path(), &out).ok();
    assert_eq!(piped.stdout, apgstmd("run {in} --out - --speed 1", frames.path(), &out).ok().stdout);
    let text = fs::read_to_string(&mot).unwrap();
    assert!(text.lines().count() > 5 && text.lines().all(|line| line.contains(",8.5,8.5,")), "{text}");
    apgstmd(&line, frames.path(), &out).fails(1, &["t.txt is there already"]);
    assert_eq!(fs::read_to_string(&mot).unwrap(), text);
    apgstmd(&format!("{line} --force --stop 2"), frames.path(), &out).ok();
    assert_eq!(fs::read_to_string(&mot).unwrap(), "");
}

#[test]
fn nonsense_on_the_command_line() {
    let frames = folder(3);
    let (parent, out) = results();
    let cases: [(&str, i32, &[&str]); 11] = [
        ("--box-size 5", 2, &["--box-size is for --mot and --coco"]),
        ("--mot a.txt --box-size 0", 2, &["--box-size is 0", "above 0"]),
        ("--mot a.txt --box-size nan", 2, &["--box-size is NaN"]),
        ("--mot a.txt --box-size -3", 2, &["--box-size is -3"]),
        ("--mot -", 2, &["--mot needs the name of a file"]),
        ("--coco {in}", 2, &["--coco needs the name of a file"]),
        ("--mot a.txt --coco ./a.txt", 2, &["both a.txt"]),
        ("--mot {out}/tracks.csv", 2, &["another result's name"]),
        ("--coco {out}/run.json --force", 2, &["another result's name"]),
        ("--mot {in}/f_0.png", 1, &["is there already"]),
        ("--coco {in}/no/a.json", 1, &["cannot write", "a.json"]),
    ];
    for (flags, code, parts) in cases {
        apgstmd(&format!("run {{in}} --out {{out}} {flags}"), frames.path(), &out).fails(code, parts);
    }
    assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 0, "nothing was begun");
    assert!(!PathBuf::from("a.txt").exists());
}

/// A picture that cannot be read ends the run; what was tracked until then is there in every form.
#[test]
fn a_run_that_fails_leaves_whole_files() {
    let frames = folder(40);
    fs::write(frames.path().join("f_35.png"), "no picture").unwrap();
    let (parent, out) = results();
    let coco = parent.path().join("t.json");
    let line = format!("run {{in}} --out {{out}} --speed 1 --coco {}", coco.display());
    apgstmd(&line, frames.path(), &out).fails(1, &["f_35.png"]);
    let rows = rows(&out.join("tracks.csv"));
    let data = json(&coco);
    assert_eq!(data["images"].as_array().unwrap().len(), 35);
    assert!(!rows.is_empty() && data["annotations"].as_array().unwrap().len() == rows.len());
}

/// Killed without warning: whole rows; no COCO JSON rather than half of one.
#[test]
fn a_run_that_is_killed_leaves_whole_rows() {
    let frames = folder(60);
    let long = tempfile::tempdir().unwrap();
    for frame in 0..6000 {
        // To and fro.
        let shown = if (frame / 50) % 2 == 0 { frame % 50 } else { 50 - frame % 50 };
        let from = frames.path().join(format!("f_{shown}.png"));
        fs::hard_link(from, long.path().join(format!("{frame}.png"))).unwrap();
    }
    let (parent, out) = results();
    let [mot, coco] = ["t.txt", "t.json"].map(|name| parent.path().join(name));
    let mut child = command()
        .args([
            "run",
            &long.path().display().to_string(),
            "--out",
            &out.display().to_string(),
            "--speed",
            "1",
            "--quiet",
        ])
        .args(["--mot", &mot.display().to_string(), "--coco", &coco.display().to_string(), "--threads", "1"])
        .spawn()
        .unwrap();
    let deadline = Instant::now() + Duration::from_secs(60);
    while fs::read_to_string(&mot).map_or(0, |text| text.lines().count()) < 40 {
        assert!(child.try_wait().unwrap().is_none() && Instant::now() < deadline, "it must still be at work");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(rows(&out.join("tracks.csv")).len() >= 40);
    let text = fs::read_to_string(&mot).unwrap();
    assert!(text.ends_with('\n') && text.lines().all(|line| line.split(',').count() == 10));
    assert!(!coco.exists());
}
