//! What a run leaves behind: tables, record, inner maps, pictures.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::Stdio;

use crate::common::{HEIGHT, WIDTH, apgstmd, assert_found, command, csv_rows, folder, json, picture, results};
use apgstmd_core::SimdLevel;

#[test]
fn csv_and_jsonl_hold_the_same() {
    let frames = folder(36);
    let (_parent, out) = results();
    let ran = apgstmd("run {in} --out {out} --speed 1 --format csv,jsonl", frames.path(), &out).ok();
    assert!(ran.stdout.is_empty());
    assert!(ran.stderr.contains("36 frames") && ran.stderr.contains("detections.csv"), "{}", ran.stderr);
    let rows = csv_rows(&out.join("detections.csv"));
    assert_found(&rows, 35);
    let text = fs::read_to_string(out.join("detections.jsonl")).unwrap();
    let objects: Vec<serde_json::Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(objects.len(), rows.len());
    assert!(!rows.is_empty());
    for (row, object) in rows.iter().zip(&objects) {
        assert_eq!(object.as_object().unwrap().len(), 11);
        assert!(object["time_s"].is_null() && row.time.is_none(), "pictures tell no time");
        assert_eq!(object["frame"], row.frame);
        assert_eq!(object["name"], *row.name);
        for (key, value) in [("x", row.x), ("y", row.y), ("score", row.score), ("direction_rad", row.direction)] {
            assert_eq!(object[key].as_f64().unwrap(), value, "{key}");
        }
        assert_eq!(object["trace"], row.trace);
    }
}

/// Every output of every other model: tables, pictures, all the maps it has.
#[test]
fn other_models() {
    let frames = folder(30);
    for (model, maps) in [("stmd-plus", 11), ("dstmd", 12), ("cascaded", 11), ("estmd", 8)] {
        let (_parent, out) = results();
        let line = format!(
            "run {{in}} --out {{out}} --model {model} --speed 1 --rejection off --format csv,jsonl --overlay --dump ALL \
             --dump-frames 29"
        );
        apgstmd(&line, frames.path(), &out).ok();
        let rows = csv_rows(&out.join("detections.csv"));
        let best = rows.iter().filter(|row| row.frame == 29).max_by(|a, b| a.score.total_cmp(&b.score)).unwrap();
        // Without a direction the response stays behind the target.
        assert!(
            (best.x - crate::common::column(29)).abs() < 8.0 && (best.y - crate::common::ROW).abs() < 1.0,
            "{model}: {best:?}"
        );
        let text = fs::read_to_string(out.join("detections.jsonl")).unwrap();
        let last: serde_json::Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
        assert_eq!(last["direction_rad"].is_null(), model == "estmd");
        assert!(rows.iter().all(|row| row.direction.is_nan() == (model == "estmd")));
        assert_eq!(fs::read_dir(out.join("dump")).unwrap().count(), maps, "{model}");
        assert!(out.join("overlay/f_29.png").exists() && out.join("strip.png").exists());
        assert_eq!(json(&out.join("run.json"))["params"]["model"], model);
    }
}

#[test]
fn record_says_what_was_done() {
    let frames = folder(36);
    let (_parent, out) = results();
    apgstmd(
        "run {in} --out {out} --speed 1 --threads 2 --rejection off --threshold 1e-9 --start 2 --stop 34",
        frames.path(),
        &out,
    )
    .ok();
    let record = json(&out.join("run.json"));
    let rows = csv_rows(&out.join("detections.csv"));
    assert_eq!(record["schema_version"], 1);
    assert_eq!(record["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(record["input"]["pictures"], 36);
    assert_eq!((&record["input"]["start"], &record["input"]["stop"]), (&2.into(), &34.into()));
    assert_eq!((&record["size"]["height"], &record["size"]["width"]), (&HEIGHT.into(), &WIDTH.into()));
    assert_eq!(record["frames"], 32);
    assert_eq!(record["threads"], 2);
    assert_eq!(record["interrupted"], false);
    assert_eq!(record["found"]["detections"], rows.len());
    let traces: std::collections::HashSet<u64> = rows.iter().map(|row| row.trace).collect();
    assert_eq!(record["found"]["traces"], traces.len());
    let with: std::collections::HashSet<usize> = rows.iter().map(|row| row.frame).collect();
    assert_eq!(record["found"]["frames_with_detections"], with.len());
    assert_eq!(record["params"]["rejection"]["mode"], "off");
    assert_eq!(record["params"]["detection"]["threshold"], 1e-9);
    assert_eq!(record["params"]["attention"]["gate"], "change");
    assert_eq!(record["params"]["prediction"]["horizon"], 6);
    for part in ["decode", "compute", "write", "total"] {
        assert!(record["seconds_per_frame"][part]["median"].as_f64().unwrap() > 0.0, "{part}");
    }
    assert!(rows.iter().all(|row| (2..34).contains(&row.frame)));
}

/// f_2 comes before f_10; hidden files and other files are no frames; the frame column counts in that order.
#[test]
fn natural_order_and_selection() {
    let frames = folder(12);
    fs::write(frames.path().join("notes.txt"), "x").unwrap();
    fs::write(frames.path().join("truth.csv"), "x").unwrap();
    fs::write(frames.path().join(".hidden.png"), "x").unwrap();
    fs::create_dir(frames.path().join("folder.png")).unwrap();
    let (_parent, out) = results();
    apgstmd("run {in} --out {out} --overlay --start 1 --stop 11 --step 3", frames.path(), &out).ok();
    let mut drawn: Vec<String> = fs::read_dir(out.join("overlay"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    alphanumeric_sort::sort_str_slice(&mut drawn);
    assert_eq!(drawn, ["f_1.png", "f_4.png", "f_7.png", "f_10.png"]);
    assert_eq!(json(&out.join("run.json"))["input"]["pictures"], 12);
}

#[test]
fn patterns_choose_files() {
    let frames = folder(12);
    let frames_run = |pattern: &str| {
        let (_parent, out) = results();
        apgstmd("run {in} --out {out}", &frames.path().join(pattern), &out).ok();
        json(&out.join("run.json"))["frames"].as_u64().unwrap()
    };
    assert_eq!(frames_run("*.png"), 12);
    assert_eq!(frames_run("f_?.png"), 10);
    assert_eq!(frames_run("f_1[01].png"), 2);
    assert_eq!(frames_run("f_%d.png"), 12);
    assert_eq!(frames_run("f_%02d.png"), 2);
}

#[test]
fn dumps_have_the_shape_they_should() {
    let frames = folder(12);
    let (parent, out) = results();
    let elsewhere = parent.path().join("maps");
    let line = format!(
        "run {{in}} --out {{out}} --dump P,C,E,M,Tm1_4 --dump-frames 3,6..8 --dump-dir {}",
        elsewhere.display()
    );
    apgstmd(&line, frames.path(), &out).ok();
    let mut names: Vec<String> =
        fs::read_dir(&elsewhere).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    let mut expected: Vec<String> = ["P", "C", "E", "M", "Tm1_4"]
        .iter()
        .flat_map(|stage| [3, 6, 7, 8].map(|frame| format!("{stage}_{frame:06}.npy")))
        .collect();
    expected.sort();
    assert_eq!(names, expected);
    for (stage, shape, planes) in [("P", "(64, 96,)", 1), ("C", "(4, 64, 96,)", 4), ("E", "(8, 64, 96,)", 8)] {
        let bytes = fs::read(elsewhere.join(format!("{stage}_000006.npy"))).unwrap();
        let header = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        let text = String::from_utf8_lossy(&bytes[10..10 + header]).into_owned();
        assert!(bytes.starts_with(b"\x93NUMPY\x01\x00") && text.contains("'<f4'") && text.contains(shape), "{text}");
        assert_eq!(bytes.len() - 10 - header, planes * (WIDTH * HEIGHT * 4) as usize);
    }
    let (_parent, out) = results();
    apgstmd("run {in} --out {out} --dump ALL --dump-frames 11", frames.path(), &out).ok();
    assert_eq!(fs::read_dir(out.join("dump")).unwrap().count(), 16);
}

#[test]
fn overlay_draws_every_frame_and_a_strip() {
    let frames = folder(36);
    let (_parent, out) = results();
    apgstmd("run {in} --out {out} --speed 1 --overlay", frames.path(), &out).ok();
    assert_eq!(fs::read_dir(out.join("overlay")).unwrap().count(), 36);
    let last = image::open(out.join("overlay/f_35.png")).unwrap().into_rgb8();
    assert!(last.width() >= 400, "small frames are enlarged: {}", last.width());
    // The target's centre keeps its colour, something coloured is drawn around it.
    let scale = last.width() as f64 / f64::from(WIDTH);
    let centre = (((crate::common::column(35) + 0.5) * scale) as u32, ((crate::common::ROW + 0.5) * scale) as u32);
    assert_eq!(last.get_pixel(centre.0, centre.1).0, [20; 3]);
    let ring = (8.0 * scale) as u32 + 2;
    let coloured = last.enumerate_pixels().filter(|(x, y, pixel)| {
        let [r, g, b] = pixel.0;
        x.abs_diff(centre.0) <= ring && y.abs_diff(centre.1) <= ring && r.abs_diff(g).max(g.abs_diff(b)) > 60
    });
    assert!(coloured.count() > 100);
    let strip = image::open(out.join("strip.png")).unwrap();
    assert!(strip.width() > 1000 && strip.height() > 500);
}

#[test]
fn earlier_results_are_replaced_only_by_force() {
    let frames = folder(20);
    let (_parent, out) = results();
    apgstmd("run {in} --out {out} --overlay --dump E --format csv,jsonl", frames.path(), &out).ok();
    let own = ["notes.txt", "overlay/mine.png", "overlay/notes.txt", "dump/mine.npy"].map(|name| out.join(name));
    for path in &own {
        fs::write(path, b"\x89PNG of the user").unwrap();
    }
    apgstmd("run {in} --out {out}", frames.path(), &out).fails(1, &["detections.csv", "earlier run"]);
    apgstmd("run {in} --out {out} --force --stop 5", frames.path(), &out).ok();
    assert_eq!(json(&out.join("run.json"))["frames"], 5);
    assert!(!out.join("detections.jsonl").exists() && !out.join("strip.png").exists());
    let left = |name: &str| fs::read_dir(out.join(name)).unwrap().count();
    assert_eq!((left("overlay"), left("dump")), (2, 1), "only the user's own files are left");
    assert!(own.iter().all(|path| fs::read(path).unwrap() == b"\x89PNG of the user"));
}

#[test]
fn a_folder_with_other_files_is_no_obstacle() {
    let frames = folder(3);
    let (_parent, out) = results();
    fs::create_dir(&out).unwrap();
    fs::write(out.join("notes.txt"), "x").unwrap();
    apgstmd("run {in} --out {out}", frames.path(), &out).ok();
}

#[test]
fn default_folder_is_named_after_the_input() {
    let parent = tempfile::tempdir().unwrap();
    let frames = parent.path().join("clip7");
    fs::create_dir(&frames).unwrap();
    for frame in 0..3 {
        picture(frame).save(frames.join(format!("{frame}.png"))).unwrap();
    }
    let output = command().args(["run", "clip7"]).current_dir(parent.path()).output().unwrap();
    assert!(output.status.success());
    assert!(parent.path().join("clip7-apgstmd/detections.csv").is_file());
    assert!(String::from_utf8_lossy(&output.stderr).contains("clip7-apgstmd"));
}

#[test]
fn quiet_prints_nothing() {
    let frames = folder(5);
    let (_parent, out) = results();
    let ran = apgstmd("run {in} --out {out} --quiet", frames.path(), &out).ok();
    assert_eq!((ran.stdout.as_str(), ran.stderr.as_str()), ("", ""));
}

#[test]
fn a_pipe_gets_rows_and_no_bar() {
    let frames = folder(36);
    let (_parent, out) = results();
    apgstmd("run {in} --out {out} --speed 1 --format csv,jsonl", frames.path(), &out).ok();
    for (format, file) in [("csv", "detections.csv"), ("jsonl", "detections.jsonl")] {
        let ran = apgstmd(&format!("run {{in}} --out - --speed 1 --format {format}"), frames.path(), &out).ok();
        assert_eq!(ran.stdout, fs::read_to_string(out.join(file)).unwrap());
        assert!(!ran.stderr.contains('\r') && !ran.stderr.contains("left"), "{}", ran.stderr);
    }
}

#[test]
fn a_closed_pipe_ends_quietly() {
    let frames = folder(60);
    let mut child = command()
        .args(["run", &frames.path().display().to_string(), "--out", "-", "--rejection", "off", "--speed", "1"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let mut stderr = String::new();
    child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0), "{stderr}");
    assert!(!stderr.contains("error") && !stderr.contains("panicked"), "{stderr}");
}

#[test]
fn threads_do_not_change_the_numbers() {
    let frames = folder(30);
    let table = |threads: usize| {
        let line = format!("run {{in}} --out - --speed 1 --rejection off --threads {threads}");
        apgstmd(&line, frames.path(), Path::new("unused")).ok().stdout
    };
    let one = table(1);
    assert!(one.lines().count() > 10);
    assert_eq!(one, table(3));
}

/// The level is clamped to the machine, named in the record, and changes numbers by rounding only.
#[test]
fn instruction_sets() {
    let frames = folder(30);
    let run = |level: &str| {
        let (_parent, out) = results();
        let ran = apgstmd(&format!("run {{in}} --out {{out}} --speed 1 --simd {level}"), frames.path(), &out).ok();
        let used = json(&out.join("run.json"))["simd"].as_str().unwrap().to_owned();
        assert!(ran.stderr.contains(&used), "{}", ran.stderr);
        (used, csv_rows(&out.join("detections.csv")))
    };
    let (used, scalar) = run("scalar");
    assert_eq!(used, "scalar");
    let best = SimdLevel::best().name();
    for level in SimdLevel::ALL {
        let (used, rows) = run(level.name());
        assert_eq!(used, level.clamped().name());
        assert_eq!(rows.len(), scalar.len());
        for (a, b) in rows.iter().zip(&scalar) {
            assert!((a.score - b.score).abs() < 1e-3 * b.score && (a.x - b.x).abs() < 1e-2, "{a:?} {b:?}");
        }
    }
    apgstmd("run {in} --out {out} --simd mmx", frames.path(), Path::new("unused")).fails(2, &["mmx", "avx512"]);
    let version = apgstmd("--version", frames.path(), Path::new("unused")).ok().stdout;
    assert!(version.contains(&format!("instruction set: {best}")) && version.contains("scalar"), "{version}");
    let short = apgstmd("-V", frames.path(), Path::new("unused")).ok().stdout;
    assert_eq!(short.trim(), concat!("apgstmd ", env!("CARGO_PKG_VERSION")));
}
