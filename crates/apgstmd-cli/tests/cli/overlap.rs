//! Reading, computing and writing go on side by side: order, errors and ends must not show it.

use std::fs;
use std::path::Path;

use crate::common::{HEIGHT, WIDTH, apgstmd, csv_rows, folder, json, picture, results};
use tiff::encoder::{TiffEncoder, colortype};

const LINE: &str = "run {in} --out {out} --speed 1 --rejection off";

fn names(path: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(path).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    alphanumeric_sort::sort_str_slice(&mut names);
    names
}

/// Pictures that take very different times to decode still come in order, from one reader or from four.
#[test]
fn order_is_that_of_the_names() {
    let frames = folder(40);
    for frame in (0..40).step_by(3) {
        // Sixteen bits, uncompressed, compressed hard: other formats take other times.
        let path = frames.path().join(format!("f_{frame}.png"));
        let wide = image::DynamicImage::from(picture(frame)).into_luma16();
        fs::remove_file(&path).unwrap();
        wide.save(path.with_extension(if frame % 2 == 0 { "tif" } else { "png" })).unwrap();
    }
    let table = |threads: usize| {
        let (_parent, out) = results();
        apgstmd(&format!("{LINE} --threads {threads}"), frames.path(), &out).ok();
        let rows = csv_rows(&out.join("detections.csv"));
        assert!(rows.is_sorted_by_key(|row| row.frame));
        assert!(rows.iter().all(|row| row.name.starts_with(&format!("f_{}.", row.frame))));
        fs::read_to_string(out.join("detections.csv")).unwrap()
    };
    let one = table(1);
    assert!(one.lines().count() > 20);
    assert_eq!(one, table(2));
    assert_eq!(one, table(5));
}

/// What came before a bad picture is written, what comes after is not.
#[test]
fn stopping_at_a_bad_picture_keeps_what_came_before() {
    let frames = folder(60);
    fs::write(frames.path().join("f_41.png"), "no picture").unwrap();
    let odd = folder(41);
    not_luminance(&odd.path().join("f_41.tif"));
    let whole = {
        let (_parent, out) = results();
        apgstmd(&format!("{LINE} --stop 41"), frames.path(), &out).ok();
        fs::read_to_string(out.join("detections.csv")).unwrap()
    };
    for threads in [1, 3] {
        let (_parent, out) = results();
        let line = format!("{LINE} --threads {threads}");
        apgstmd(&line, odd.path(), &out).fails(1, &["f_41.tif", "NaN"]);
        assert_eq!(fs::read_to_string(out.join("detections.csv")).unwrap(), whole);
        let line = format!("{line} --overlay --force");
        apgstmd(&line, frames.path(), &out).fails(1, &["f_41.png", "no PNG"]);
        assert_eq!(fs::read_to_string(out.join("detections.csv")).unwrap(), whole);
        assert_eq!(names(&out.join("overlay")).len(), 41);
        let record = json(&out.join("run.json"));
        assert_eq!(record["frames"], 41);
        assert!(record["error"].as_str().unwrap().contains("f_41.png"));
    }
}

/// A float picture that is no luminance: it can be read, but not computed.
fn not_luminance(path: &Path) {
    let file = fs::File::create(path).unwrap();
    let samples = vec![f32::NAN; (WIDTH * HEIGHT) as usize];
    TiffEncoder::new(file).unwrap().write_image::<colortype::Gray32Float>(WIDTH, HEIGHT, &samples).unwrap();
}

/// Unreadable, of another size, not computable, unreadable again at the end: all named in order, the rest as if they had
/// not been there.
#[test]
fn skipping_leaves_the_others_as_they_are() {
    let frames = folder(50);
    let bad = [0, 7, 8, 20, 30, 49];
    let good = tempfile::tempdir().unwrap();
    for frame in (0..50).filter(|frame| !bad.contains(frame)) {
        fs::copy(frames.path().join(format!("f_{frame}.png")), good.path().join(format!("f_{frame}.png"))).unwrap();
    }
    for frame in bad {
        let path = frames.path().join(format!("f_{frame}.png"));
        match frame {
            20 => image::GrayImage::new(30, 30).save(path).unwrap(),
            30 => {
                fs::remove_file(&path).unwrap();
                not_luminance(&path.with_extension("tif"));
            }
            _ => fs::write(path, "no picture").unwrap(),
        }
    }
    let places = |input: &Path, threads: usize, flags: &str| {
        let (_parent, out) = results();
        apgstmd(&format!("{LINE} --threads {threads} {flags}"), input, &out).ok();
        let rows = csv_rows(&out.join("detections.csv"));
        let record = json(&out.join("run.json"));
        (rows.into_iter().map(|row| (row.name, row.x, row.y, row.score)).collect::<Vec<_>>(), record)
    };
    let (expected, _) = places(good.path(), 2, "");
    for threads in [1, 4] {
        let (rows, record) = places(frames.path(), threads, "--on-error skip");
        assert_eq!(rows, expected);
        assert_eq!(record["frames"], 44);
        let skipped: Vec<_> = record["skipped"].as_array().unwrap().iter().map(|s| s["frame"].clone()).collect();
        assert_eq!(skipped, bad);
    }
}

/// A folder where a picture should go: the run ends there, with what is written whole.
#[test]
fn a_sink_that_fails_ends_the_run() {
    let frames = folder(400);
    let (_parent, out) = results();
    fs::create_dir_all(out.join("overlay/f_5.png")).unwrap();
    for threads in [1, 3] {
        let line = format!("{LINE} --overlay --force --threads {threads}");
        apgstmd(&line, frames.path(), &out).fails(1, &["cannot write", "f_5.png"]);
        let record = json(&out.join("run.json"));
        assert_eq!(record["frames"], 5);
        assert_eq!(names(&out.join("overlay")).len(), 6);
        assert!(csv_rows(&out.join("detections.csv")).iter().all(|row| row.frame <= 5));
    }
}

#[test]
fn the_record_says_what_limits() {
    let frames = folder(30);
    let (_parent, out) = results();
    apgstmd(&format!("{LINE} --overlay"), frames.path(), &out).ok();
    let timing = &json(&out.join("run.json"))["seconds_per_frame"];
    let of = |value: &serde_json::Value| value.as_f64().unwrap();
    let busy = ["decode", "compute", "write"].map(|part| of(&timing["busy"][part]));
    assert!(of(&timing["wall"]) > 0.0);
    assert!(busy.iter().all(|share| (0.0..=1.01).contains(share)), "{busy:?}");
    let limit = timing["limited_by"].as_str().unwrap();
    let largest = busy.iter().copied().fold(0.0, f64::max);
    assert_eq!(of(&timing["busy"][limit]), largest);
    // Drawing sixfold enlarged pictures costs most here.
    assert_eq!(limit, "write");
}

/// Pictures are read faster than they are computed; what waits must not grow with their number.
#[test]
#[cfg(target_os = "linux")]
fn memory_does_not_grow_with_the_number_of_pictures() {
    const PICTURES: usize = 150;
    let frames = tempfile::tempdir().unwrap();
    let first = frames.path().join("0.tif");
    let (width, height) = (800, 600);
    image::ImageBuffer::from_fn(width, height, |x, y| image::Rgb([(x * 60) as u16, (y * 60) as u16, 9000]))
        .save(&first)
        .unwrap();
    let bytes = 2 * 3 * (width * height) as usize;
    for frame in 1..PICTURES {
        fs::hard_link(&first, frames.path().join(format!("{frame}.tif"))).unwrap();
    }
    let mut child = crate::common::command()
        .args(["run", "--quiet", "--threads", "1", "--out", "-", "--model", "estmd"])
        .arg(frames.path())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let mut peak = 0;
    while child.try_wait().unwrap().is_none() {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or_default();
        peak = line.trim().trim_end_matches(" kB").parse::<usize>().map_or(peak, |kib| kib << 10);
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert!(child.wait().unwrap().success());
    assert!(peak > 8 << 20 && peak < PICTURES * bytes / 2, "{} MiB", peak >> 20);
}
