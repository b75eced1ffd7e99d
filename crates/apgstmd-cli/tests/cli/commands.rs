//! `params`, `demo`, `--help`, `--version`.

use std::fs;
use std::path::Path;

use crate::common::{apgstmd, csv_rows, folder, json, results};
use apgstmd_core::{Params, Preset};

fn printed(line: &str) -> String {
    apgstmd(line, Path::new("unused"), Path::new("unused")).ok().stdout
}

#[test]
fn printed_parameters_read_back_the_same() {
    let practical = Params::preset(Preset::Practical);
    let text = printed("params");
    assert!(text.lines().filter(|line| line.starts_with('#')).count() > 40, "every value is explained");
    assert_eq!(Params::from_toml(&text).unwrap(), practical);
    assert_eq!(Params::from_toml(&printed("params --preset paper")).unwrap(), Params::default());
    let fast = printed("params --speed 2 --rejection off --localise response --threshold 0.001");
    let mut expected = practical.for_speed(2.0).unwrap();
    expected.rejection.mode = apgstmd_core::params::RejectionMode::Off;
    expected.detection.localise = apgstmd_core::params::Localise::Response;
    expected.detection.threshold = 0.001;
    assert_eq!(Params::from_toml(&fast).unwrap(), expected);

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("p.toml");
    fs::write(&file, &fast).unwrap();
    assert_eq!(apgstmd("params --params {in}", &file, Path::new("")).ok().stdout, fast);
}

/// A run with a printed file is the run with the flags that it was printed with.
#[test]
fn a_file_does_what_the_flags_do() {
    let frames = folder(30);
    let parent = tempfile::tempdir().unwrap();
    let file = parent.path().join("p.toml");
    fs::write(&file, printed("params --speed 1 --rejection off")).unwrap();
    let by_flags = apgstmd("run {in} --out - --speed 1 --rejection off", frames.path(), &file).ok().stdout;
    let by_file = apgstmd("run {in} --out - --params {out}", frames.path(), &file).ok().stdout;
    assert!(by_flags.lines().count() > 5);
    assert_eq!(by_flags, by_file);
}

#[test]
fn the_demo_reports_what_its_files_hold() {
    let (_parent, out) = results();
    // What an earlier demo left may be replaced unasked.
    fs::create_dir(&out).unwrap();
    fs::write(out.join("run.json"), r#"{"program": "apgstmd", "command": "demo"}"#).unwrap();
    let ran = apgstmd("demo --out {out}", Path::new("unused"), &out).ok();
    for part in ["target", "found after", "false alarms", "strip.png", "detections.csv", "summary.txt"] {
        assert!(ran.stdout.contains(part), "{part}: {}", ran.stdout);
    }
    let record = json(&out.join("run.json"));
    assert_eq!((&record["command"], &record["frames"]), (&"demo".into(), &150.into()));
    let verdict = &record["evaluation"];
    let targets = verdict["targets"].as_array().unwrap();
    assert_eq!(targets.len(), 4);
    // The numbers printed are those computed from the table on disk.
    let rows = csv_rows(&out.join("detections.csv"));
    assert_eq!(record["found"]["detections"], rows.len());
    let summary = fs::read_to_string(out.join("summary.txt")).unwrap();
    assert!(ran.stdout.starts_with(&summary));
    for target in targets {
        assert!(summary.contains(&format!("{:.0} %", 100.0 * target["frames_found"].as_f64().unwrap())), "{summary}");
    }
    assert!(verdict["detection_rate"].as_f64().unwrap() > 0.5, "{summary}");
    assert!(verdict["false_alarms"].as_f64().unwrap() <= 0.1);
    assert!(image::open(out.join("strip.png")).is_ok());
}

#[test]
fn the_demo_spares_results_of_a_run() {
    let frames = folder(3);
    let (_parent, out) = results();
    apgstmd("run {in} --out {out}", frames.path(), &out).ok();
    apgstmd("demo --out {out}", Path::new("unused"), &out).fails(1, &["earlier run"]);
}

#[test]
fn help_and_version() {
    assert_eq!(printed("--version").lines().next(), Some(concat!("apgstmd ", env!("CARGO_PKG_VERSION"))));
    assert!(printed("--help").contains("Examples:"));
    let help = printed("run --help");
    for flag in ["--speed", "--dump-frames", "--on-error", "--bit-depth", "--overlay", "--simd", "Exit codes"] {
        assert!(help.contains(flag), "{flag}");
    }
    let nothing = apgstmd("", Path::new(""), Path::new(""));
    assert_eq!(nothing.code, 2);
    assert!(nothing.stderr.contains("Usage"), "{}", nothing.stderr);
}
