//! `--roi` and `--mask`.

use std::fs;
use std::path::PathBuf;

use crate::common::{apgstmd, csv_rows, json, results};
use image::{DynamicImage, GrayImage, Luma, Rgba, RgbaImage};
use tempfile::TempDir;

/// A target above and one below.
fn scene() -> (TempDir, PathBuf) {
    let text = "width = 160\nheight = 120\nrate = 100.0\nframes = 60\n[background]\nkind = 'uniform'\nluminance = 0.85\n\
        [[target]]\npath = { kind = 'straight', start = [30.0, 30.0], speed = 100.0 }\n\
        [[target]]\npath = { kind = 'straight', start = [30.0, 90.0], speed = 100.0 }\n";
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("two.toml");
    fs::write(&file, text).unwrap();
    (folder, file)
}

#[test]
fn targets_are_looked_for_where_it_is_said() {
    let (folder, file) = scene();
    let upper = GrayImage::from_fn(160, 120, |_, y| Luma([if y < 60 { 1 } else { 0 }]));
    upper.save(folder.path().join("upper.png")).unwrap();
    // Colours count, transparency does not.
    let lower = RgbaImage::from_fn(160, 120, |_, y| Rgba([0, if y < 60 { 0 } else { 7 }, 0, 255]));
    DynamicImage::from(lower).save(folder.path().join("lower.png")).unwrap();
    let place = folder.path().display().to_string();
    for engine in ["--speed 1", "--speeds 1 --sizes 5,10"] {
        let rows = |flags: &str| {
            let (_parent, out) = results();
            let flags = flags.replace("HERE", &place);
            apgstmd(&format!("run {{in}} --out {{out}} {engine} {flags}"), &file, &out).ok();
            let rows = csv_rows(&out.join("detections.csv"));
            let near = |y: f64| rows.iter().filter(|row| (row.y - y).abs() < 3.0).count();
            (near(30.0), near(90.0), json(&out.join("run.json"))["region"].clone())
        };
        let (above, below, none) = rows("");
        assert!(above > 25 && below > 25 && none.is_null(), "{engine}: {above}, {below}");
        let (found, other, record) = rows("--roi 160x60+0+0");
        assert_eq!((found, other), (above, 0), "{engine}");
        assert_eq!((&record["roi"][0], &record["share"]), (&"160x60+0+0".into(), &0.5.into()));
        let (found, other, record) = rows("--mask HERE/upper.png");
        assert_eq!((found, other), (above, 0), "{engine}");
        assert!(record["mask"].as_str().unwrap().ends_with("upper.png"));
        let (other, found, _) = rows("--mask HERE/lower.png");
        assert_eq!((other, found), (0, below), "{engine}");
        let (both, all, _) = rows("--roi 160x50+0+0 --roi 999x50+0+70");
        assert_eq!((both, all), (above, below), "{engine}");
        let (half, other, record) = rows("--mask HERE/upper.png --roi 60x120+0+0");
        assert!(half > 5 && half < above && other == 0, "{engine}: {half} of {above}");
        assert_eq!(record["share"], 0.1875);
    }
}

#[test]
fn a_clip_is_tuned_where_it_is_looked_at() {
    let (_folder, file) = scene();
    let (_parent, out) = results();
    let line = "tune {in} --out {out} --speed 1 --false-alarms 1";
    // In the lower half there is a target, between both there is nothing.
    let ran = apgstmd(&format!("{line} --roi 160x20+0+50"), &file, &out).ok();
    assert!(ran.stderr.contains("least score 0.0"), "{}", ran.stderr);
}

#[test]
fn regions_that_cannot_be_are_refused() {
    let (folder, file) = scene();
    GrayImage::new(160, 120).save(folder.path().join("black.png")).unwrap();
    GrayImage::from_pixel(120, 160, Luma([9])).save(folder.path().join("turned.png")).unwrap();
    fs::write(folder.path().join("no.png"), b"no picture").unwrap();
    let corner = GrayImage::from_fn(160, 120, |x, y| Luma([u8::from(x < 20 && y < 20)]));
    corner.save(folder.path().join("corner.png")).unwrap();
    let place = folder.path().display().to_string();
    for (flags, parts) in [
        ("--roi 10x10", &["10x10", "WxH+X+Y"][..]),
        ("--roi 0x10+0+0", &["WxH+X+Y"]),
        ("--roi 10x10+-3+0", &["WxH+X+Y"]),
        ("--roi 99999999999999999999x1+0+0", &["WxH+X+Y"]),
        ("--roi 10x10+160+0", &["10 x 10 px at column 160, row 0", "120 x 160"]),
        ("--mask HERE/turned.png", &["turned.png", "160 x 120", "120 x 160"]),
        ("--mask HERE/black.png", &["black.png", "nothing of the picture"]),
        ("--mask HERE/no.png", &["no.png", "no PNG"]),
        ("--mask HERE/missing.png", &["missing.png"]),
        ("--mask HERE/corner.png --roi 10x10+40+40", &["nothing in common"]),
    ] {
        let (_parent, out) = results();
        let ran =
            apgstmd(&format!("run {{in}} --out {{out}} --speed 1 {}", flags.replace("HERE", &place)), &file, &out);
        assert_eq!(ran.code, 2, "{flags}: {}", ran.stderr);
        parts.iter().for_each(|part| assert!(ran.stderr.contains(part), "{flags}: {}", ran.stderr));
        assert!(!out.join("run.json").exists());
    }
}
