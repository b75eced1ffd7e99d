//! Ctrl-C: the frame in work is finished, what is on disk is whole, the exit code says so.
#![cfg(unix)]

mod common;

use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use common::{command, csv_rows, json, picture, results};

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
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
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
