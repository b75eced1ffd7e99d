//! `run` without a speed: a bank, its flags, its rows.

use std::fs;

use crate::common::{apgstmd, assert_found, csv_rows, folder, json, results};

/// Cells of a column of detections.csv.
fn column(text: &str, name: &str) -> Vec<f64> {
    let mut lines = text.lines();
    let index = lines.next().unwrap().split(',').position(|column| column == name).unwrap();
    lines.map(|line| line.split(',').nth(index).unwrap().parse().unwrap()).collect()
}

#[test]
fn without_flags_the_speed_is_found() {
    let (frames, (_parent, out)) = (folder(45), results());
    apgstmd("run {in} --out {out}", frames.path(), &out).ok();
    let rows = csv_rows(&out.join("detections.csv"));
    (25..45).for_each(|frame| assert_found(&rows, frame));
    let text = fs::read_to_string(out.join("detections.csv")).unwrap();
    for name in ["score", "contrast"] {
        assert!(column(&text, name).iter().all(|value| *value > 0.0 && *value <= 1.0), "{name}");
    }
    let record = json(&out.join("run.json"));
    let members = record["bank"]["members"].as_array().unwrap();
    // The pictures are 96 x 64: large enough for all three scales.
    assert_eq!(members.len(), 15);
    assert!(record["speed"].is_null());
    let of_target: Vec<&str> = text.lines().filter(|line| line.starts_with("44,")).take(1).collect();
    let speed: f64 = of_target[0].split(',').nth(8).unwrap().parse().unwrap();
    assert!((0.5..=2.0).contains(&speed), "{of_target:?}");
    assert!(json(&out.join("run.json"))["found"]["tracks"].as_u64().unwrap() >= 1);
}

#[test]
fn flags_choose_the_members() {
    let (frames, (_parent, out)) = (folder(30), results());
    apgstmd("run {in} --out {out} --speeds 1,2 --sizes 5,10 --contrast 0.3", frames.path(), &out).ok();
    let record = json(&out.join("run.json"));
    let expected = serde_json::json!([
        {"speed": 1.0, "size": 5.0}, {"speed": 2.0, "size": 5.0},
        {"speed": 1.0, "size": 10.0}, {"speed": 2.0, "size": 10.0}
    ]);
    assert_eq!(record["bank"]["members"], expected);
    let text = fs::read_to_string(out.join("detections.csv")).unwrap();
    let contrasts = column(&text, "contrast");
    assert!(!contrasts.is_empty() && contrasts.iter().all(|contrast| *contrast >= 0.3));
    let members = |flags: &str| {
        apgstmd(&format!("run {{in}} --out {{out}} --force {flags}"), frames.path(), &out).ok();
        json(&out.join("run.json"))["bank"]["members"].as_array().map_or(0, Vec::len)
    };
    assert_eq!(members("--speed auto --rejection off"), 15);
    assert_eq!(members("--size 5"), 6);
    assert_eq!(members("--speed 2 --sizes 5,10"), 2);
    for single in ["--speed 1", "--rejection off", "--preset paper", "--model dstmd", "--dump P"] {
        assert_eq!(members(single), 0, "{single}");
    }
}

#[test]
fn a_speed_in_seconds_uses_the_rate() {
    let (frames, (_parent, out)) = (folder(30), results());
    let rows = |flags: &str| {
        apgstmd(&format!("run {{in}} --out {{out}} --force {flags}"), frames.path(), &out).ok();
        let speed = json(&out.join("run.json"))["speed"].as_f64().unwrap();
        (fs::read_to_string(out.join("detections.csv")).unwrap(), speed)
    };
    assert_eq!(rows("--fps 8 --speed 8px/s"), rows("--fps 8 --speed 1"));
    assert_eq!(rows("--fps 8 --speed 8px/s --step 2").1, 2.0);
}

#[test]
fn nonsense() {
    let (frames, (_parent, out)) = (folder(3), results());
    let cases: [(&str, &[&str]); 11] = [
        ("--speed 40px/s", &["px/s", "--fps"]),
        ("--speed 0px/s --fps 30", &["speed 0 px/frame"]),
        ("--speeds 1 --speed 2", &["--speed and --speeds"]),
        ("--speed auto --dump E", &["--dump", "--speed auto"]),
        ("--speeds 1 --dump E", &["--dump", "--speeds"]),
        ("--contrast 2", &["--contrast is 2"]),
        ("--contrast nan", &["--contrast is NaN"]),
        ("--contrast 0.1 --speed 1", &["--contrast is for a bank"]),
        ("--sizes 0", &["--sizes has 0"]),
        ("--speeds 0", &["bank.speed is 0"]),
        ("--speeds 1,x", &["x"]),
    ];
    for (flags, parts) in cases {
        apgstmd(&format!("run {{in}} --out {{out}} {flags}"), frames.path(), &out).fails(2, parts);
    }
    apgstmd("params --speed auto", frames.path(), &out).fails(2, &["--speed auto", "run"]);
}
