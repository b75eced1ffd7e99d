//! `--false-alarms` and `tune`: thresholds by what people mean.

use std::fs;
use std::path::Path;

use crate::common::{apgstmd, csv_rows, json, results};

/// Clutter that drifts, with or without a target before it.
fn scene(folder: &Path, target: bool, frames: usize) -> std::path::PathBuf {
    let mut text = format!(
        "width = 200\nheight = 150\nrate = 30.0\nframes = {frames}\nseed = 4\nnoise = 0.01\n\
         [background]\nkind = \"natural\"\ncontrast = 0.15\nvelocity = [-24.0, 9.0]\n"
    );
    if target {
        text += "[[target]]\nshade = { dark = 0.6 }\n\
                 path = { kind = \"circular\", center = [100.0, 75.0], radius = 25.0, speed = 30.0 }\n";
    }
    let file = folder.join("scene.toml");
    fs::write(&file, text).unwrap();
    file
}

fn rows_a_frame(out: &Path, frames: usize) -> f64 {
    csv_rows(&out.join("detections.csv")).len() as f64 / frames as f64
}

#[test]
fn so_many_rows_are_listed() {
    let (parent, out) = results();
    let input = scene(parent.path(), false, 120);
    let run = |flags: &str| {
        let line = format!("run {{in}} --out {{out}} --force --speeds 1,2 {flags}");
        apgstmd(&line, &input, &out).ok();
        (rows_a_frame(&out, 120), json(&out.join("run.json")))
    };
    let (all, record) = run("--false-alarms off");
    assert!(record["threshold"]["false_alarms"].is_null());
    let mut before = all;
    // Rates that 120 frames can show: 30 rows are those of a dozen traces.
    for rate in [2.0, 0.5, 0.25] {
        let (listed, record) = run(&format!("--false-alarms {rate}"));
        // The clip sets it as it passes: what comes later is not known yet.
        assert!(listed < 2.5 * rate && listed > 0.3 * rate && listed < before, "{rate}: {listed} of {all}");
        assert_eq!(record["threshold"]["false_alarms"], rate);
        assert!(record["threshold"]["least_score"].as_f64().unwrap() > 0.0);
        before = listed;
    }
    let (usual, record) = run("");
    assert_eq!(record["threshold"]["false_alarms"], 2.0);
    assert!(usual < 5.0);
    // A single detector as well, where it is asked for.
    let single = |flags: &str| {
        apgstmd(&format!("run {{in}} --out {{out}} --force --speed 1 {flags}"), &input, &out).ok();
        (rows_a_frame(&out, 120), json(&out.join("run.json"))["threshold"].is_null())
    };
    let (everything, untouched) = single("");
    let (few, _) = single("--false-alarms 0.5");
    assert!(untouched && few < 1.25 && few > 0.15 && few < everything, "{few} of {everything}");
}

#[test]
fn a_threshold_of_an_empty_clip_holds_on_another() {
    let (parent, out) = results();
    let empty = scene(parent.path(), false, 120);
    let file = parent.path().join("tuned.toml");
    let tune = |flags: &str| apgstmd(&format!("tune {{in}} --out {{out}} {flags}"), &empty, &file);
    let said = tune("--speeds 1,2 --false-alarms 0.2").ok();
    assert!(said.stderr.contains("least score") && said.stderr.contains("95 %"), "{}", said.stderr);
    let text = fs::read_to_string(&file).unwrap();
    assert!(text.starts_with("# detection.least_score was set by") && text.contains("members = [[1.0, 1], [2.0, 1]]"));
    tune("--speeds 1,2").fails(1, &["is there already"]);
    // On that very clip it is exact.
    let run = |input: &Path, flags: &str| {
        let line = format!("run {{in}} --out {{out}} --force --params {} {flags}", file.display());
        apgstmd(&line, input, &out).ok();
        json(&out.join("run.json"))
    };
    let record = run(&empty, "");
    assert_eq!(csv_rows(&out.join("detections.csv")).len(), 24);
    assert_eq!(record["bank"]["members"].as_array().unwrap().len(), 2);
    assert!(record["params"]["detection"]["least_score"].as_f64().unwrap() > 0.0);
    assert_eq!(run(&empty, "--speeds 1")["bank"]["members"].as_array().unwrap().len(), 1);
    // The target is found with it.
    run(&scene(parent.path(), true, 120), "");
    assert!(csv_rows(&out.join("detections.csv")).iter().any(|row| row.score > 0.1));
}

#[test]
fn what_cannot_be_told_is_refused() {
    let (parent, out) = results();
    let input = scene(parent.path(), false, 20);
    apgstmd("tune {in} --speeds 1 --out {out}", &input, &out).fails(1, &["20 frames", "30"]);
    assert!(!out.exists());
    let cases: [(&str, &[&str]); 4] = [
        ("run {in} --out {out} --false-alarms 0", &["--false-alarms", "between 0.001 and 10", "off"]),
        ("run {in} --out {out} --false-alarms few", &["--false-alarms", "off"]),
        ("tune {in} --out {out} --false-alarms 11", &["--false-alarms is 11"]),
        ("tune {in} --out {out} --false-alarms nan", &["--false-alarms is NaN"]),
    ];
    for (line, parts) in cases {
        apgstmd(line, &input, &out).fails(2, parts);
    }
    let said = apgstmd("run {in} --speeds 1 --out {out} --false-alarms 0.1", &input, &out).ok();
    assert!(said.stderr.contains("extrapolated") && said.stderr.contains("takes 30"), "{}", said.stderr);
}
