//! `--checkpoint` and `--resume`: however often a run is killed or interrupted, its files end up as those of one that was not.

#![cfg(unix)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use crate::common::{Ran, apgstmd, folder, json, record, results, scene, start, tables};

/// After a kill: what is there are the first rows of what will be, and perhaps a part of the next.
fn assert_prefix(part: &BTreeMap<&str, Vec<u8>>, whole: &BTreeMap<&'static str, Vec<u8>>) {
    for (name, part) in part {
        let rows = part.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
        assert!(whole[name].starts_with(&part[..rows]), "{name} is no longer the beginning of what it will be");
    }
}

/// How runs are ended, in turn.
const SIGNALS: [&str; 3] = ["-KILL", "-INT", "-TERM"];

/// Ends runs of `line` after pseudo-random times, up to that of a whole run, until so many were ended, beginning anew when
/// one is through.
fn kill(line: &str, input: &Path, kills: usize) {
    let (_parent, whole) = results();
    fs::create_dir(&whole).unwrap();
    let begin = Instant::now();
    apgstmd(line, input, &whole).ok();
    let longest = begin.elapsed().mul_f64(0.7);
    let (truth, told) = (tables(&whole), record(&whole));
    assert!(truth.len() >= 2 && truth.values().all(|table| table.len() > 1000), "there is something to compare");
    let (mut killed, mut resumed, mut through, mut seed) = (0, 0, 0, 7u64);
    let begin = Instant::now();
    while killed < kills || through == 0 || resumed == 0 {
        let (_parent, out) = results();
        fs::create_dir(&out).unwrap();
        let mut early = false;
        loop {
            assert!(
                begin.elapsed() < Duration::from_secs(600),
                "{killed} killed, {resumed} resumed, {through} through"
            );
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let mut child = start(line, input, &out);
            let until = Instant::now() + longest.mul_f64((seed >> 33) as f64 / (1u64 << 31) as f64);
            while Instant::now() < until && child.try_wait().unwrap().is_none() {
                std::thread::sleep(Duration::from_millis(1));
            }
            let ended = child.try_wait().unwrap().is_some();
            let signal = SIGNALS[killed % SIGNALS.len()];
            if !ended {
                assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
            }
            let ran = Ran::from(child.wait_with_output().unwrap());
            resumed += usize::from(ran.stderr.contains("going on after"));
            if ended || ran.code == 0 {
                ran.ok();
                break;
            }
            killed += 1;
            // A bank lists its first frames by what the clip has shown when it is asked to end: the next run begins anew, unless
            // it is killed before it begins.
            let kept = out.join("checkpoint.safetensors").exists();
            early = !kept && (early || ran.code == 130);
            if !early {
                assert_prefix(&tables(&out), &truth);
            }
            // -1: killed, or asked before it listens.
            assert!(ran.code == -1 || signal != "-KILL" && ran.code == 130, "{signal}: {} {}", ran.code, ran.stderr);
            // Said where there was a first frame.
            if ran.stderr.contains("interrupted: the files are complete") {
                assert_eq!(record(&out)["interrupted"], true);
                let whole = |table: &Vec<u8>| table.is_empty() || table.ends_with(b"\n");
                assert!(tables(&out).values().all(whole), "{signal} leaves whole rows");
            }
        }
        through += 1;
        assert!(tables(&out) == truth, "the tables are not those of a run that was never disturbed");
        assert_eq!(record(&out), told);
        let left: Vec<_> = fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(left.len(), truth.len() + 1, "tables and run.json, but there is {left:?}");
    }
    println!("{killed} killed, {resumed} went on from a checkpoint, {through} through");
}

const RUN: &str = "run {in} --out {out} --speed 1 --threads 1 --format csv,jsonl --mot {out}/tracks.mot";

/// `make kills` for more of them.
#[test]
fn kills_change_nothing() {
    let kills = std::env::var("KILLS").map_or(6, |kills| kills.parse().expect("a number"));
    let (_folder, scene) = scene(150);
    kill(&format!("{RUN} --checkpoint 10 --resume"), &scene, kills);
}

#[test]
fn a_bank_that_is_killed_goes_on() {
    let (_folder, scene) = scene(150);
    let line = "run {in} --out {out} --speeds 1,2 --sizes 5 --mot {out}/tracks.mot --checkpoint 10 --resume";
    kill(line, &scene, 3);
}

/// Without checkpoints a run that was killed is made anew.
#[test]
fn without_a_checkpoint_it_begins_anew() {
    let (_folder, scene) = scene(200);
    let (_parent, out) = results();
    let (_other, whole) = results();
    fs::create_dir(&out).unwrap();
    fs::create_dir(&whole).unwrap();
    apgstmd(RUN, &scene, &whole).ok();
    let mut child = start(RUN, &scene, &out);
    while fs::read(out.join("detections.csv")).map_or(0, |table| table.len()) < 200 {
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    apgstmd(RUN, &scene, &out).fails(1, &["is there already"]);
    let ran = apgstmd(&format!("{RUN} --resume"), &scene, &out).ok();
    assert!(!ran.stderr.contains("going on"), "{}", ran.stderr);
    assert!(tables(&out) == tables(&whole));
    // And what is through stays.
    let before = fs::read(out.join("run.json")).unwrap();
    let ran = apgstmd(&format!("{RUN} --resume"), &scene, &out).ok();
    assert!(ran.stderr.contains("nothing is left to do"), "{}", ran.stderr);
    assert_eq!(fs::read(out.join("run.json")).unwrap(), before);
    apgstmd(&format!("{RUN} --resume --threshold 0.1"), &scene, &out).fails(1, &["other settings"]);
    assert_eq!(fs::read(out.join("run.json")).unwrap(), before);
}

/// SIGINT and SIGTERM leave a checkpoint of the last frame, on pictures, video and standard input, with gaps and pictures that
/// cannot be used.
#[test]
fn what_was_interrupted_goes_on() {
    let pictures = folder(60);
    for broken in [7, 31, 32, 50] {
        fs::write(pictures.path().join(format!("f_{broken}.png")), b"no picture").unwrap();
    }
    let good = folder(60);
    let video = pictures.path().join("../resumed.mkv");
    crate::common::video(good.path(), "-c:v ffv1", &video);
    let line =
        "run {in} --speed 1 --out {out} --on-error skip --start 2 --step 1 --checkpoint 1000 --resume --threads 1";
    for (input, signal, name) in [(pictures.path(), "-INT", "f_3.png"), (&*video, "-TERM", "resumed_000003")] {
        let (_parent, whole) = results();
        apgstmd(line, input, &whole).ok();
        let (_parent, out) = results();
        // Slowly, so that the signal comes in the middle.
        let mut child = start(&format!("{line} --rejection motion"), input, &out);
        let begin = Instant::now();
        while fs::read_to_string(out.join("detections.csv")).map_or(0, |text| text.lines().count()) < 2 {
            assert!(begin.elapsed() < Duration::from_secs(60), "no rows came");
            if child.try_wait().unwrap().is_some() {
                break;
            }
            std::thread::sleep(Duration::from_micros(200));
        }
        let _ = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        let ran = Ran::from(child.wait_with_output().unwrap());
        if ran.code == 130 {
            let kept = out.join("checkpoint.safetensors");
            assert!(kept.exists() && json(&out.join("run.json"))["interrupted"] == true, "{}", ran.stderr);
            let ran = apgstmd(&format!("{line} --rejection motion"), input, &out).ok();
            assert!(ran.stderr.contains("going on after"), "{}", ran.stderr);
            assert!(!kept.exists());
        }
        assert!(tables(&out) == tables(&whole), "{}", input.display());
        assert_eq!(record(&out)["skipped"], record(&whole)["skipped"]);
        assert_eq!(record(&out)["found"], record(&whole)["found"]);
        assert!(!name.is_empty());
    }
    fs::remove_file(video).unwrap();
}

#[test]
fn what_cannot_be_resumed_is_refused() {
    let (_folder, file) = scene(400);
    let (_parent, out) = results();
    fs::create_dir(&out).unwrap();
    let line = format!("{RUN} --checkpoint 10 --resume");
    let mut child = start(&line, &file, &out);
    let kept = out.join("checkpoint.safetensors");
    while !kept.exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let good = fs::read(&kept).unwrap();
    // A state like any other, with its format.
    let head = u64::from_le_bytes(good[..8].try_into().unwrap()) as usize;
    let head: serde_json::Value = serde_json::from_slice(&good[8..8 + head]).unwrap();
    let told = head["__metadata__"]["apgstmd"].as_str().unwrap();
    assert!(told.contains("format = 1\n") && told.contains("of = \"run\"\n"), "{told}");

    let other = line.replace("--speed 1", "--speed 2");
    apgstmd(&other, &file, &out).fails(1, &["checkpoint.safetensors", "was made with", "but here it is"]);
    apgstmd(&format!("{line} --start 3"), &file, &out).fails(1, &["--start", "Frames(0)"]);
    let mut damaged = good.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    fs::write(&kept, &damaged).unwrap();
    apgstmd(&line, &file, &out).fails(1, &["damaged", "checksum"]);
    fs::write(&kept, &good[..good.len() - 9]).unwrap();
    apgstmd(&line, &file, &out).fails(1, &["no state"]);
    fs::write(&kept, &good).unwrap();
    fs::write(out.join("tracks.csv"), "frame\n").unwrap();
    apgstmd(&line, &file, &out).fails(1, &["tracks.csv", "6 bytes"]);
    assert_eq!(fs::read(&kept).unwrap(), good, "what is refused is left as it was");

    for (flags, parts) in [
        ("--checkpoint 0 --out {out}", "at least 1"),
        ("--checkpoint 9 --out -", "--out -"),
        ("--checkpoint 9 --out {out}/a --report {out}/a.html", "--report"),
        ("--checkpoint 9 --out {out}/a --overlay", "--overlay"),
        ("--resume --force --out {out}/a", "--force"),
    ] {
        let ran = apgstmd(&format!("run {{in}} --speed 1 {flags}"), &file, &out);
        assert!(ran.code == 2 && ran.stderr.contains(parts), "{flags}: {}", ran.stderr);
    }
}
