//! `synth`, and scenes as input of `run`.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{Ran, apgstmd, csv_rows, json, results};
use apgstmd_core::stimulus::{Renderer, Scene, Truth, truth_from_csv};
use tempfile::TempDir;

/// A black square on light grey, 1 px/frame, as in the other tests.
const SMALL: &str = "width = 96\nheight = 64\nrate = 100.0\nframes = 40\n\
    [background]\nkind = 'uniform'\nluminance = 0.85\n\
    [[target]]\npath = { kind = 'straight', start = [20.0, 32.0], speed = 100.0 }\n";

fn scene_file(text: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("small.toml");
    fs::write(&file, text).unwrap();
    (folder, file)
}

fn synth(text: &str, flags: &str) -> Ran {
    let (folder, file) = scene_file(text);
    let out = folder.path().join("out");
    let ran = apgstmd(&format!("synth {{in}} --out {{out}} {flags}"), &file, &out);
    if ran.code == 2 {
        assert!(!out.exists(), "a refused scene leaves nothing");
    }
    ran
}

fn truth_of(scene: &Scene) -> Vec<Truth> {
    let renderer = Renderer::new(scene).unwrap();
    (0..scene.frames).flat_map(|t| renderer.truth(t)).collect()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_scene_on_disk_is_the_scene() {
    let natural = SMALL.replace("'uniform'\nluminance = 0.85", "'natural'\nvelocity = [-20.0, 0.0]");
    let (_folder, file) = scene_file(&natural);
    for (flags, levels) in [("", 255.0f32), ("--bit-depth 16", 65535.0)] {
        let (_parent, out) = results();
        let ran = apgstmd(&format!("synth {{in}} --out {{out}} --frames 12 --seed 9 {flags}"), &file, &out).ok();
        assert!(ran.stderr.contains("12 frames of 64 x 96") && ran.stderr.contains("--speed 1"), "{}", ran.stderr);
        let scene = Scene { frames: 12, seed: 9, ..Scene::from_toml(&natural).unwrap() };
        assert_eq!(Scene::from_toml(&fs::read_to_string(out.join("scene.toml")).unwrap()).unwrap(), scene);
        let renderer = Renderer::new(&scene).unwrap();
        for t in 0..12 {
            let picture = image::open(out.join(format!("scene_{t:06}.png"))).unwrap();
            assert_eq!(picture.color().bytes_per_pixel(), if levels > 255.0 { 2 } else { 1 });
            let (picture, frame) = (picture.into_luma16(), renderer.frame(t));
            for ((y, x), value) in frame.indexed_iter() {
                let seen = f32::from(picture.get_pixel(x as u32, y as u32).0[0]) / 65535.0;
                assert!((seen - value).abs() < 0.501 / levels, "{t}: {seen} is not {value}");
            }
        }
        let rows = truth_from_csv(&fs::read_to_string(out.join("truth.csv")).unwrap()).unwrap();
        let truth = truth_of(&scene);
        assert_eq!(rows.len(), truth.len());
        for (a, b) in rows.iter().zip(&truth) {
            assert_eq!((a.frame, a.id, a.visible), (b.frame, b.id, b.visible));
            let off = [a.x - b.x, a.y - b.y, a.width - b.width, a.height - b.height];
            assert!(off.iter().all(|d| d.abs() < 6e-4) && (a.contrast - b.contrast).abs() < 6e-5, "{a:?} {b:?}");
        }
        assert_eq!(names(&out).len(), 14);
    }
}

/// The same frames by both ways: what the folder loses is the rounding to 8 bits.
#[test]
fn a_scene_is_run_as_its_pictures_are() {
    let (_folder, file) = scene_file(SMALL);
    let (_parent, out) = results();
    let (pictures, by_folder, by_scene) = (out.join("small"), out.join("folder"), out.join("scene"));
    apgstmd("synth {in} --out {out} --bit-depth 16 -q", &file, &pictures).ok();
    let flags = "--speed 1 --preset paper --rejection off --overlay --start 2 --stop 39 --step 1";
    let ran = apgstmd(&format!("run {{in}} --out {{out}} {flags}"), &pictures, &by_folder).ok();
    assert!(ran.stderr.contains("37 frames"), "{}", ran.stderr);
    apgstmd(&format!("run {{in}} --out {{out}} {flags} --dump P --dump-frames 5"), &file, &by_scene).ok();
    let (a, b) = (csv_rows(&by_folder.join("detections.csv")), csv_rows(&by_scene.join("detections.csv")));
    let strong = |rows: &[crate::common::Row]| {
        let most = rows.iter().map(|row| row.score).fold(0.0, f64::max);
        rows.iter().filter(|row| row.score > 0.1 * most).cloned().collect::<Vec<_>>()
    };
    let (a, b) = (strong(&a), strong(&b));
    assert!(a.len() > 10 && a.len() == b.len(), "{} {}", a.len(), b.len());
    for (a, b) in a.iter().zip(&b) {
        assert_eq!((a.frame, &a.name), (b.frame, &format!("{}.png", b.name)));
        // 16 bits round luminance by 1e-5 of its contrast at most, and the response is its cube.
        assert!((a.x - b.x).abs() < 0.01 && (a.y - b.y).abs() < 0.01 && (a.score / b.score - 1.0).abs() < 1e-3);
    }
    let record = json(&by_scene.join("run.json"));
    assert_eq!((&record["input"]["pictures"], &record["input"]["start"]), (&40.into(), &2.into()));
    assert_eq!(record["input"]["scene"]["width"], 96);
    assert!(json(&by_folder.join("run.json"))["input"].get("scene").is_none());
    assert!(by_scene.join("dump/P_000005.npy").is_file() && by_scene.join("overlay/scene_000007.png").is_file());
}

#[test]
fn eight_bits_find_the_same_target() {
    let (folder, file) = scene_file(SMALL);
    let pictures = folder.path().join("small");
    apgstmd("synth {in} --out {out}", &file, &pictures).ok();
    for input in [&pictures, &file] {
        let (_parent, out) = results();
        apgstmd("run {in} --out {out} --speed 1", input, &out).ok();
        let rows = csv_rows(&out.join("detections.csv"));
        for frame in [30, 39] {
            crate::common::assert_found(&rows, frame);
        }
    }
}

#[test]
fn built_in_scenes_and_the_example() {
    let print = |flags: &str| apgstmd(&format!("synth {flags} --print"), Path::new(""), Path::new("")).ok().stdout;
    assert_eq!(Scene::from_toml(&print("--paper")).unwrap(), Scene::paper());
    let demo = Scene { frames: 7, seed: 3, ..Scene::demo() };
    assert_eq!(Scene::from_toml(&print("--demo --frames 7 --seed 3")).unwrap(), demo);
    let example = print("");
    assert!(example.lines().filter(|line| line.contains('#')).count() > 25, "keys are explained");
    let scene = Scene::from_toml(&example).unwrap();
    for key in scene.to_toml().split(|c: char| !c.is_alphabetic()).chain(["panorama", "uniform", "file", "luminance"]) {
        assert!(example.contains(key), "{key}");
    }
    assert_eq!((scene.targets.len(), scene.objects.len(), scene.occluders.len()), (4, 1, 1));
    let (_folder, file) = scene_file(&example);
    let printed = apgstmd("synth {in} --print --frames 9", &file, Path::new("")).ok().stdout;
    assert_eq!(Scene::from_toml(&printed).unwrap(), Scene { frames: 9, ..scene });
    let (_parent, out) = results();
    apgstmd("synth --demo --frames 2 --out {out} --quiet", Path::new(""), &out).ok();
    assert_eq!(names(&out), ["scene.toml", "scene_000000.png", "scene_000001.png", "truth.csv"]);
}

#[test]
fn a_panorama_lies_beside_its_scene() {
    let (folder, file) = scene_file("");
    let picture = image::RgbImage::from_fn(50, 30, |x, y| image::Rgb([x as u8 * 5, y as u8 * 8, 40]));
    picture.save(folder.path().join("hills.png")).unwrap();
    let text = "width = 48\nheight = 30\nframes = 2\n[background]\nkind = 'panorama'\nfile = 'hills.png'\n";
    fs::write(&file, text).unwrap();
    let out = folder.path().join("out");
    apgstmd("synth {in} --out {out} --bit-depth 16", &file, &out).ok();
    let drawn = image::open(out.join("scene_000001.png")).unwrap().into_luma16();
    for (x, y) in [(0, 0), (20, 11), (47, 29)] {
        let [r, g, b] = picture.get_pixel(x, y).0.map(f64::from);
        let expected = (0.299 * r + 0.587 * g + 0.114 * b) / 255.0 * 65535.0;
        assert!((f64::from(drawn.get_pixel(x, y).0[0]) - expected).abs() < 2.0, "{x}, {y}");
    }
    // The scene that was written finds its picture from where it lies now.
    let again = folder.path().join("again");
    apgstmd("synth {in} --out {out} --bit-depth 16", &out.join("scene.toml"), &again).ok();
    assert_eq!(fs::read(out.join("scene_000001.png")).unwrap(), fs::read(again.join("scene_000001.png")).unwrap());

    fs::remove_file(folder.path().join("hills.png")).unwrap();
    apgstmd("synth {in} --out {out} --force", &file, &again).fails(1, &["panorama", "hills.png", "no such file"]);
    fs::write(folder.path().join("hills.png"), "x").unwrap();
    apgstmd("run {in} --out {out} --force", &file, &again).fails(1, &["panorama", "hills.png", "no PNG"]);
    fs::write(&file, text.replace("'hills.png'", "''")).unwrap();
    apgstmd("run {in} --out {out}", &file, &again).fails(2, &["background.file"]);
}

#[test]
fn scenes_that_cannot_be_drawn() {
    let with = |line: &str| format!("{SMALL}{line}\n");
    let target = "[[target]]\npath = { kind = 'straight', start = [500.0, 32.0] }";
    let cases: [(String, &[&str]); 6] = [
        (SMALL.replace("height", "heigth"), &["small.toml", "line 2, column 1", "heigth", "height"]),
        (with("shape = 'round'"), &["line 10, column 1", "shape"]),
        (SMALL.replace("rate = 100.0", "rate = -1.0"), &["small.toml", "rate is -1", "between"]),
        (with("width = 0.0"), &["target[0].width is 0"]),
        (with(target), &["target[1] is never in the picture", "columns 0 to 95", "frames 0 to 39"]),
        ("[[target]\n".to_owned(), &["line 1"]),
    ];
    for (text, parts) in &cases {
        synth(text, "").fails(2, parts);
        let (_folder, file) = scene_file(text);
        let (_parent, out) = results();
        apgstmd("run {in} --out {out}", &file, &out).fails(2, parts);
        assert!(!out.exists());
    }
    // A scene cut short need not show every target.
    synth(&with("start = 30"), "--frames 10").ok();
    synth(&with("start = 50"), "--frames 60").ok();
    for (flags, parts) in [
        ("--frames 0", &["frames is 0", "at least 1"][..]),
        ("--bit-depth 12", &["--bit-depth is 12", "8 or 16"]),
        ("--seed 9223372036854775808", &["seed"]),
        ("--threads 0", &["--threads is 0"]),
        ("--paper", &["--paper"]),
        ("--demo", &["--demo"]),
    ] {
        synth(SMALL, flags).fails(2, parts);
    }
    let (folder, file) = scene_file(SMALL);
    let out = folder.path().join("out");
    apgstmd("synth --out {out}", &file, &out).fails(2, &["no scene"]);
    apgstmd("synth {in}", &file, &out).fails(2, &["--out"]);
    apgstmd("synth {in} --out {out}", folder.path(), &out).fails(2, &["no scene", ".toml"]);
    apgstmd("synth {in} --out {out}", &folder.path().join("no.toml"), &out).fails(1, &["no.toml", "no such file"]);
    apgstmd("run {in} --out {out}", &folder.path().join("no.toml"), &out).fails(1, &["no.toml", "no such file"]);
    apgstmd("run {in} --out {out} --bit-depth 12", &file, &out).fails(2, &["--bit-depth"]);
    apgstmd("run {in} --out {out} --start 40", &file, &out).fails(2, &["--start 40", "0 to 39"]);
}

#[test]
fn folders_that_hold_something() {
    let (folder, file) = scene_file(SMALL);
    let out = folder.path().join("out");
    apgstmd("synth {in} --out {out} --frames 9", &file, &out).ok();
    apgstmd("synth {in} --out {out} --frames 3", &file, &out)
        .fails(1, &["scene.toml is there already", "earlier scene"]);
    fs::write(out.join("notes.txt"), "mine").unwrap();
    apgstmd("synth {in} --out {out} --frames 3 --force", &file, &out).ok();
    assert_eq!(names(&out).len(), 3 + 2 + 1, "frames 3 to 8 of the earlier scene are gone");
    for foreign in ["a.png", "scene_000001.png", "truth.csv", "scene.toml"] {
        fs::write(out.join(foreign), "mine").unwrap();
        apgstmd("synth {in} --out {out} --force", &file, &out).fails(1, &[foreign, "not from a scene"]);
        assert_eq!(fs::read(out.join(foreign)).unwrap(), b"mine");
        fs::remove_file(out.join(foreign)).unwrap();
    }
    apgstmd("synth {in} --out {out}", &file, &file).fails(1, &["is a file"]);
    apgstmd("synth {in} --out {out}", &file, &file.join("below")).fails(1, &["cannot write"]);
}
