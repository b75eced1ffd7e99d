//! Everything a user can get wrong: one line that says what and what to do, the right exit code, no panic, no debris.

use std::fs::{self, File};
use std::io::BufWriter;
use std::path::Path;

use crate::common::{HEIGHT, WIDTH, apgstmd, command, csv_rows, folder, json, picture, results};
use image::GrayImage;
use tiff::encoder::{TiffEncoder, colortype};

/// Runs on `input` with further flags.
fn run(input: &Path, flags: &str) -> crate::common::Ran {
    let (_parent, out) = results();
    let ran = apgstmd(&format!("run {{in}} --out {{out}} {flags}"), input, &out);
    if ran.code == 2 {
        assert!(!out.exists(), "a refused run leaves nothing");
    }
    ran
}

fn float_tiff(path: &Path, at: usize, value: f32) {
    let mut samples = vec![0.5f32; (WIDTH * HEIGHT) as usize];
    samples[at] = value;
    let mut encoder = TiffEncoder::new(BufWriter::new(File::create(path).unwrap())).unwrap();
    encoder.write_image::<colortype::Gray32Float>(WIDTH, HEIGHT, &samples).unwrap();
}

#[test]
fn inputs_that_are_not_there() {
    let empty = tempfile::tempdir().unwrap();
    run(empty.path(), "").fails(1, &["there are no pictures in", &empty.path().display().to_string()]);
    fs::write(empty.path().join("a.txt"), "x").unwrap();
    run(empty.path(), "").fails(1, &["1 other file"]);
    run(&empty.path().join("missing"), "").fails(1, &["there is no file or folder"]);
    run(&empty.path().join("*.png"), "").fails(1, &["no picture matches"]);
    run(&empty.path().join("f_%05d.png"), "").fails(1, &["no picture matches"]);
    run(&empty.path().join("[.png"), "").fails(2, &["pattern"]);
    run(&empty.path().join("missing/f_%05d.png"), "").fails(1, &["cannot read the folder", "no such file"]);
}

#[test]
fn a_single_picture_is_no_sequence() {
    let frames = folder(1);
    let ran = run(&frames.path().join("f_0.png"), "").fails(1, &["one picture", "sequence"]);
    assert!(ran.stderr.contains("give the folder"), "{}", ran.stderr);
}

#[test]
fn an_unquoted_pattern() {
    let ran: crate::common::Ran = command().args(["run", "a.png", "b.png", "c.png"]).output().unwrap().into();
    let ran = ran.fails(2, &["unexpected argument 'b.png'"]);
    assert!(ran.stderr.contains("quotes"), "{}", ran.stderr);
}

/// A hole in the numbers is told, only where it is used; a link that leads nowhere is a picture that cannot be used, a folder
/// is none.
#[cfg(unix)]
#[test]
fn pictures_that_are_missing() {
    let frames = folder(10);
    let name = |frame: usize| frames.path().join(format!("f_{frame}.png"));
    fs::remove_file(name(4)).unwrap();
    fs::remove_file(name(5)).unwrap();
    fs::create_dir(name(5)).unwrap();
    let told = "warning: 2 pictures missing by the numbers in the names, the first after f_3.png; put them back";
    let ran = run(frames.path(), "--speed 1").ok();
    assert!(ran.stderr.contains(told), "{}", ran.stderr);
    for (flags, count) in [("--stop 4", 4), ("--start 4", 4), ("--step 2", 4)] {
        let (_parent, out) = results();
        let ran = apgstmd(&format!("run {{in}} --out {{out}} --speed 1 {flags}"), frames.path(), &out).ok();
        let record = json(&out.join("run.json"));
        let tells = record["warnings"].as_array().unwrap().iter().any(|warning| warning["about"] == "missing");
        assert_eq!((record["frames"].as_u64(), tells), (Some(count), flags == "--step 2"), "{flags}: {}", ran.stderr);
    }

    std::os::unix::fs::symlink("gone.png", name(4)).unwrap();
    for input in [frames.path().to_owned(), frames.path().join("*.png"), frames.path().join("f_%d.png")] {
        run(&input, "--speed 1").fails(1, &["f_4.png", "no such file"]);
        let ran = run(&input, "--speed 1 --on-error skip").ok();
        assert!(ran.stderr.contains("1 skipped, the first f_4.png: no such file"), "{}", ran.stderr);
        assert!(ran.stderr.contains("1 picture missing by the numbers"), "{}", ran.stderr);
    }
}

/// Each spoils picture 5 of 10 in its own way and says what the message must hold.
#[test]
fn a_bad_picture_in_the_middle() {
    type Spoil = fn(&Path);
    let cases: [(&str, Spoil, &[&str]); 8] = [
        ("f_5.png", |path| fs::write(path, "no picture").unwrap(), &["it is no PNG"]),
        ("f_5.png", |path| fs::write(path, "").unwrap(), &["empty"]),
        ("f_5.png", |path| truncate(path, |p| picture(5).save(p).unwrap()), &["truncated"]),
        ("f_5.jpg", |path| truncate(path, |p| busy().save(p).unwrap()), &["truncated"]),
        ("f_5.bmp", |path| truncate(path, |p| picture(5).save(p).unwrap()), &[]),
        ("f_5.pgm", |path| truncate(path, |p| picture(5).save(p).unwrap()), &["truncated"]),
        ("f_5.tif", |path| truncate(path, |p| picture(5).save(p).unwrap()), &[]),
        (
            "f_5.png",
            |path| GrayImage::new(50, 40).save(path).unwrap(),
            &["40 x 50 (height x width)", "f_0.png is 64 x 96", "one size"],
        ),
    ];
    for (name, spoil, parts) in cases {
        let frames = folder(10);
        fs::remove_file(frames.path().join("f_5.png")).unwrap();
        spoil(&frames.path().join(name));
        let ran = run(frames.path(), "").fails(1, &[&["cannot use", name], parts].concat());
        assert!(ran.stderr.contains("--on-error skip"), "{}", ran.stderr);

        let (_parent, out) = results();
        let ran = apgstmd("run {in} --out {out} --on-error skip", frames.path(), &out).ok();
        assert!(ran.stderr.contains("1 skipped") && ran.stderr.contains(name), "{}", ran.stderr);
        let record = json(&out.join("run.json"));
        assert_eq!(record["frames"], 9);
        assert_eq!(record["skipped"].as_array().unwrap().len(), 1);
        assert_eq!((&record["skipped"][0]["frame"], &record["skipped"][0]["name"]), (&5.into(), &name.into()));
        assert!(record["skipped"][0]["reason"].as_str().unwrap().len() > 5);
    }
}

/// Rows so far and the reason stay on disk when a run stops in the middle.
#[test]
fn a_stopped_run_leaves_its_rows() {
    let frames = folder(36);
    fs::write(frames.path().join("f_35.png"), "x").unwrap();
    let (_parent, out) = results();
    apgstmd("run {in} --out {out} --speed 1", frames.path(), &out).fails(1, &["f_35.png"]);
    assert!(!csv_rows(&out.join("detections.csv")).is_empty());
    let record = json(&out.join("run.json"));
    assert_eq!(record["frames"], 35);
    assert!(record["error"].as_str().unwrap().contains("f_35.png"));
}

fn truncate(path: &Path, write: impl Fn(&Path)) {
    write(path);
    let bytes = fs::read(path).unwrap();
    fs::write(path, &bytes[..bytes.len() / 2]).unwrap();
}

fn busy() -> image::RgbImage {
    image::RgbImage::from_fn(WIDTH, HEIGHT, |x, y| image::Rgb([(x * 37) as u8, (y * 91) as u8, (x * y) as u8]))
}

#[test]
fn floats_that_are_no_luminance() {
    for (value, text) in [(f32::NAN, "NaN"), (f32::INFINITY, "inf"), (255.0, "255"), (-0.5, "-0.5")] {
        let frames = tempfile::tempdir().unwrap();
        for frame in 0..4 {
            let at = (2 * WIDTH + 3) as usize;
            float_tiff(&frames.path().join(format!("{frame}.tif")), at, if frame == 2 { value } else { 0.5 });
        }
        run(frames.path(), "").fails(1, &["2.tif", "column 3, row 2", text]);
        run(frames.path(), "--on-error skip").ok();
    }
}

#[test]
fn pictures_too_small_or_too_large() {
    let frames = tempfile::tempdir().unwrap();
    GrayImage::new(40, 15).save(frames.path().join("a.png")).unwrap();
    run(frames.path(), "").fails(1, &["a.png", "15 x 40", "16 x 16"]);

    // Headers that promise far more than the file holds.
    let frames = tempfile::tempdir().unwrap();
    fs::write(frames.path().join("a.pgm"), "P5 200000 200000 255\n").unwrap();
    run(frames.path(), "").fails(1, &["a.pgm", "200000 x 200000"]);
    let frames = tempfile::tempdir().unwrap();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 60_000, 60_000);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Sixteen);
    drop(encoder.write_header().unwrap());
    fs::write(frames.path().join("a.png"), bytes).unwrap();
    run(frames.path(), "").fails(1, &["a.png"]);
}

#[test]
fn bit_depth_must_fit() {
    let frames = folder(3);
    run(frames.path(), "--bit-depth 12").fails(1, &["f_0.png", "8 bits"]);
    run(frames.path(), "--bit-depth 8").fails(2, &["--bit-depth is 8", "between 9 and 16"]);
    let frames = tempfile::tempdir().unwrap();
    image::ImageBuffer::from_pixel(WIDTH, HEIGHT, image::Luma([5000u16])).save(frames.path().join("a.png")).unwrap();
    run(frames.path(), "--bit-depth 12").fails(1, &["a.png", "5000", "4095", "more bits"]);
}

#[test]
fn several_pages_are_refused() {
    let frames = tempfile::tempdir().unwrap();
    let file = BufWriter::new(File::create(frames.path().join("stack.tif")).unwrap());
    let mut encoder = TiffEncoder::new(file).unwrap();
    for _ in 0..2 {
        encoder.write_image::<colortype::Gray8>(WIDTH, HEIGHT, picture(0).as_raw()).unwrap();
    }
    drop(encoder);
    run(frames.path(), "").fails(1, &["stack.tif", "pages"]);
}

#[test]
fn nothing_usable_at_all() {
    let frames = tempfile::tempdir().unwrap();
    for name in ["a.png", "b.png"] {
        fs::write(frames.path().join(name), "x").unwrap();
    }
    run(frames.path(), "--on-error skip").fails(1, &["none of 2 pictures", "a.png"]);
}

#[test]
fn places_that_cannot_be_written() {
    let frames = folder(3);
    let parent = tempfile::tempdir().unwrap();
    let file = parent.path().join("file");
    fs::write(&file, "x").unwrap();
    apgstmd("run {in} --out {out}", frames.path(), &file).fails(1, &["is a file", "folder"]);
    apgstmd("run {in} --out {out}", frames.path(), &file.join("below")).fails(1, &["cannot write"]);
    let dumps = format!("run {{in}} --out {{out}} --dump E --dump-dir {}", file.display());
    apgstmd(&dumps, frames.path(), &parent.path().join("out")).fails(1, &["is a file"]);
    apgstmd("run {in} --out {in}", frames.path(), &file).fails(2, &["is the INPUT folder"]);
}

#[cfg(unix)]
#[test]
fn a_folder_without_permission() {
    use std::os::unix::fs::PermissionsExt;
    let frames = folder(3);
    let parent = tempfile::tempdir().unwrap();
    let locked = parent.path().join("locked");
    fs::create_dir(&locked).unwrap();
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).unwrap();
    // The superuser may write anywhere: then there is nothing to see.
    if File::create(locked.join("probe")).is_err() {
        apgstmd("run {in} --out {out}", frames.path(), &locked.join("out"))
            .fails(1, &["cannot write", "permission denied"]);
    }
}

#[test]
fn nonsense_on_the_command_line() {
    let frames = folder(12);
    let cases: [(&str, &[&str]); 23] = [
        ("--start 5 --stop 5", &["--stop 5", "--start 5"]),
        ("--start 12", &["--start 12", "INPUT has 12", "0 to 11"]),
        ("--step 0", &["--step is 0"]),
        ("--speed 0", &["--speed", "speed 0 px/frame", "0.01"]),
        ("--speed -1", &["-1"]),
        ("--speed nan", &["NaN"]),
        ("--speed fast", &["fast"]),
        ("--threshold -1", &["detection.threshold", "-1"]),
        ("--threshold nan", &["detection.threshold", "NaN"]),
        ("--threads 0", &["--threads is 0", "between 1 and"]),
        ("--threads 100000", &["--threads is 100000"]),
        ("--rejection none", &["none", "motion"]),
        ("--localise here", &["here", "target"]),
        ("--preset best", &["best", "practical"]),
        ("--format xml", &["xml", "jsonl"]),
        ("--dump X", &["there is no stage `X`", "Tm1_4", "ALL"]),
        ("--dump ,", &["names no stage"]),
        ("--model estmd --dump E", &["the model estmd has no stage `E`", "L1", "ALL"]),
        ("--dump E --dump-frames 12", &["12 is not in this run", "0 to 11"]),
        ("--dump E --dump-frames 5..20", &["5..20"]),
        ("--dump E --dump-frames x", &["`x`"]),
        ("--dump-frames 3", &["--dump"]),
        ("--overlayy", &["--overlayy"]),
    ];
    for (flags, parts) in cases {
        run(frames.path(), flags).fails(2, parts);
    }
    for flags in ["--overlay", "--format csv,jsonl", "--dump E"] {
        let line = format!("run {{in}} --out - {flags}");
        apgstmd(&line, frames.path(), Path::new("unused")).fails(2, &["--out -"]);
    }
}

#[test]
fn parameter_files_that_are_wrong() {
    let frames = folder(3);
    let parent = tempfile::tempdir().unwrap();
    let file = parent.path().join("p.toml");
    let flags = format!("--params {}", file.display());
    run(frames.path(), &flags).fails(2, &["p.toml", "no such file"]);
    let cases: [(&str, &[&str]); 5] = [
        ("[retina]\nsigma = 1.0\n[attention]\nalpa = 2.0\n", &["p.toml", "line 4, column 1", "alpa", "alpha"]),
        ("[retnia]\nsigma = 1.0\n", &["line 1", "retnia"]),
        ("[retina]\nsigma = -3.0\n", &["retina.sigma is -3.0", "between"]),
        ("[retina]\nsigma = 'a'\n", &["line 2"]),
        ("[retina\n", &["line 1"]),
    ];
    for (text, parts) in cases {
        fs::write(&file, text).unwrap();
        run(frames.path(), &flags).fails(2, parts);
    }
    fs::write(&file, "").unwrap();
    run(frames.path(), &format!("{flags} --preset paper")).fails(2, &["--preset", "--params"]);
    run(frames.path(), &flags).ok();
}
