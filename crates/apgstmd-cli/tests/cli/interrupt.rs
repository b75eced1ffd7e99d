//! Ctrl-C: the frame in work is finished, what is on disk is whole, the exit code says so.
#![cfg(unix)]

use std::fs;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{command, csv_rows, json, picture, results};
use apgstmd_core::stimulus::truth_from_csv;

fn interrupt(child: &Child) {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
}

#[test]
fn an_interrupted_run_leaves_valid_files() {
    let frames = tempfile::tempdir().unwrap();
    // One picture under many names: enough work that the signal comes long before the end.
    picture(0).save(frames.path().join("0.png")).unwrap();
    let links = 20_000;
    for frame in 1..links {
        let name = if frame < 60 { None } else { Some("0.png") };
        let path = frames.path().join(format!("{frame}.png"));
        match name {
            None => picture(frame).save(path).unwrap(),
            Some(name) => fs::hard_link(frames.path().join(name), path).unwrap(),
        }
    }
    let (_parent, out) = results();
    let table = out.join("detections.csv");
    let mut child = command()
        .args(["run", "--speed", "1", "--rejection", "off", "--overlay", "--out"])
        .arg(&out)
        .arg(frames.path())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    let rows = || fs::read_to_string(&table).map_or(0, |text| text.lines().count());
    while rows() < 5 {
        assert!(begin.elapsed() < Duration::from_secs(120) && child.try_wait().unwrap().is_none(), "no rows came");
        std::thread::sleep(Duration::from_millis(20));
    }
    interrupt(&child);
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    assert!(stderr.contains("interrupted"), "{stderr}");

    let record = json(&out.join("run.json"));
    let done = record["frames"].as_u64().unwrap() as usize;
    assert_eq!(record["interrupted"], true);
    assert!(done > 0 && done < links, "{done} frames");
    let rows = csv_rows(&table);
    assert_eq!(record["found"]["detections"], rows.len());
    assert!(rows.len() >= 4 && rows.iter().all(|row| row.frame < done));
    let pictures: Vec<_> = fs::read_dir(out.join("overlay")).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(pictures.len(), done);
    assert!(pictures.iter().all(|path| image::open(path).is_ok()));
}

#[test]
fn an_interrupted_scene_has_the_truth_of_its_pictures() {
    let (_parent, out) = results();
    let mut child = command()
        .args(["synth", "--demo", "--frames", "100000", "--out"])
        .arg(&out)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    let rows = || fs::read_to_string(out.join("truth.csv")).map_or(0, |text| text.lines().count());
    while rows() < 50 {
        assert!(begin.elapsed() < Duration::from_secs(120) && child.try_wait().unwrap().is_none(), "no truth came");
        std::thread::sleep(Duration::from_millis(20));
    }
    interrupt(&child);
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{stderr}");
    let pictures = fs::read_dir(&out).unwrap().count() - 2;
    assert!(stderr.contains(&format!("interrupted: {pictures} frames")), "{stderr}");
    let truth = truth_from_csv(&fs::read_to_string(out.join("truth.csv")).unwrap()).unwrap();
    // Four targets: in the picture until the last frame drawn, or nearly so.
    let last = truth.iter().map(|row| row.frame).max().unwrap();
    assert!(last < pictures && pictures > 10, "{last} {pictures}");
}
