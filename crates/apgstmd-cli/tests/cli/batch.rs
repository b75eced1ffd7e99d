//! Many videos: each whole or not there, none lost, none twice, whatever dies in the middle.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::common::{HEIGHT, Ran, WIDTH, command, json, picture, results};
use serde_json::Value;
use sha2::{Digest, Sha256};
use tempfile::TempDir;

const FRAMES: usize = 12;

/// A folder of pictures, the target moved by `shift` frames.
fn clip(folder: &Path, shift: usize) {
    fs::create_dir_all(folder).unwrap();
    for frame in 0..FRAMES {
        picture(frame + shift).save(folder.join(format!("f_{frame}.png"))).unwrap();
    }
}

/// Folders of pictures in one place.
fn clips(names: &[&str]) -> TempDir {
    let place = tempfile::tempdir().unwrap();
    for (shift, name) in names.iter().enumerate() {
        clip(&place.path().join(name), shift);
    }
    place
}

/// `apgstmd batch`, single detectors that list everything, in the folder `place`.
fn batch<W: AsRef<OsStr>>(place: &Path, out: &Path, words: impl IntoIterator<Item = W>) -> Ran {
    let mut batch = command();
    batch.current_dir(place).args(["batch", "--speed", "1", "--rejection", "off", "--out"]).arg(out).args(words);
    batch.output().unwrap().into()
}

/// The clips of the manifest by their names.
fn manifest(out: &Path) -> BTreeMap<String, Value> {
    let manifest = json(&out.join("manifest.json"));
    assert_eq!((&manifest["schema_version"], &manifest["command"]), (&1.into(), &"batch".into()));
    let clips = manifest["clips"].as_array().unwrap();
    let named: BTreeMap<String, Value> =
        clips.iter().map(|clip| (clip["name"].as_str().unwrap().to_owned(), clip.clone())).collect();
    assert_eq!(named.len(), clips.len(), "no name twice");
    let done = clips.iter().filter(|clip| clip["status"] == "done").count();
    assert_eq!((&manifest["done"], &manifest["failed"]), (&done.into(), &(clips.len() - done).into()));
    named
}

/// Every folder is whole: its files are those of its record, and that is the manifest's.
fn assert_whole(out: &Path) {
    let clips = manifest(out);
    let listed = |folder: &str| fs::read_dir(out.join(folder)).unwrap().count();
    assert_eq!(listed("clips") + listed("failed"), clips.len());
    for (name, record) in &clips {
        let folder = out.join(record["folder"].as_str().unwrap());
        assert_eq!(&json(&folder.join("clip.json")), record);
        let files = record["files"].as_object().unwrap();
        assert_eq!(fs::read_dir(&folder).unwrap().count(), files.len() + 1, "{name}");
        for (file, about) in files {
            let bytes = fs::read(folder.join(file)).unwrap();
            let sum: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
            assert_eq!((&about["bytes"], &about["sha256"]), (&bytes.len().into(), &sum.into()), "{name} {file}");
        }
    }
    assert!(!out.join("part").exists(), "nothing half done is left");
}

fn changed(out: &Path, name: &str) -> SystemTime {
    fs::metadata(out.join("clips").join(name).join("clip.json")).unwrap().modified().unwrap()
}

#[test]
fn a_failed_clip_is_reported_and_the_others_are_as_run_alone() {
    let place = clips(&["a", "b", "more/a"]);
    fs::write(place.path().join("bad.mp4"), "no video").unwrap();
    let (_parent, out) = results();
    let words = ["a", "b", "bad.mp4", "more/a", "a", "nowhere.mkv", "--jobs", "2", "--mot", "--report", "--quiet"];
    batch(place.path(), &out, words).fails(1, &["2 of 5 clips failed", "cannot read", "bad.mp4"]);
    assert_whole(&out);
    let found = manifest(&out);
    assert_eq!(found.keys().collect::<Vec<_>>(), ["a", "a-2", "b", "bad", "nowhere"]);
    for (name, folder) in [("a", "a"), ("a-2", "more/a"), ("b", "b")] {
        let alone = place.path().join(format!("{name}-alone"));
        let mut run = command();
        run.current_dir(place.path()).args(["run", "--speed", "1", "--rejection", "off", folder, "--out"]).arg(&alone);
        Ran::from(run.arg("--mot").arg(place.path().join(format!("{name}.txt"))).output().unwrap()).ok();
        for table in ["detections.csv", "tracks.csv"] {
            let same =
                fs::read(alone.join(table)).unwrap() == fs::read(out.join("clips").join(name).join(table)).unwrap();
            assert!(same, "{name} {table}");
        }
        let record = &found[name];
        assert_eq!(
            (&record["status"], &record["frames"], &record["input"]["files"]),
            (&"done".into(), &FRAMES.into(), &FRAMES.into())
        );
        assert_eq!(record["input"]["path"], place.path().join(folder).to_str().unwrap());
        assert_eq!(record["flags"], serde_json::json!(["--speed=1", "--rejection=off", "--mot", "--report"]));
        assert_eq!(record["detections"], json(&alone.join("run.json"))["found"]["detections"]);
        let spent = record["processor_seconds"].as_f64().unwrap();
        assert!(spent > 0.0 && spent < 60.0 && record["wall_seconds"].as_f64().unwrap() > 0.0);
        for file in ["tracks.txt", "report.html", "thumbnail.jpg", "stderr.txt", "run.json"] {
            assert!(record["files"].get(file).is_some(), "{name} {file}");
        }
    }
    assert!(found["bad"]["error"].as_str().unwrap().contains("as video"));
    assert!(found["nowhere"]["error"].as_str().unwrap().contains("no file or folder"));
    assert!(fs::read_to_string(out.join("failed/bad/stderr.txt")).unwrap().contains("error: cannot read"));
    // The template writes slashes so.
    let page = fs::read_to_string(out.join("index.html")).unwrap().replace("&#x2f;", "/");
    assert!(page.contains("clips/a-2/report.html") && page.contains("failed/bad/stderr.txt"));
}

/// Several rectangles and a mask reach every clip, as they do `run`.
#[test]
fn a_region_is_that_of_every_clip() {
    let place = clips(&["a", "b"]);
    // The target is in the left half.
    let half = image::GrayImage::from_fn(WIDTH, HEIGHT, |x, _| image::Luma([u8::from(x < WIDTH / 2)]));
    half.save(place.path().join("half.png")).unwrap();
    let (_parent, out) = results();
    let region = ["--roi", "30x20+0+0", "--roi", "96x20+0+22", "--mask", "half.png"];
    batch(place.path(), &out, ["a", "b"].iter().chain(&region)).ok();
    assert_whole(&out);
    let mask = place.path().join("half.png");
    let alone = place.path().join("alone");
    let mut run = command();
    run.current_dir(place.path()).args(["run", "b", "--speed", "1", "--rejection", "off"]).args(region);
    Ran::from(run.arg("--out").arg(&alone).output().unwrap()).ok();
    for (name, record) in manifest(&out) {
        let flags = ["--speed=1", "--rejection=off", "--roi=30x20+0+0", "--roi=96x20+0+22"].map(str::to_owned);
        let flags: Vec<String> = flags.into_iter().chain([format!("--mask={}", mask.display())]).collect();
        assert_eq!(record["flags"], serde_json::json!(flags), "{name}");
        assert!(record["flag_files"]["--mask"].is_string() && record["detections"].as_u64().unwrap() > 0, "{record}");
        // 30 x 20 and 48 x 20 px of 96 x 64.
        let region = json(&out.join("clips").join(&name).join("run.json"))["region"].clone();
        assert_eq!(region["share"], (30.0 * 20.0 + 48.0 * 20.0) / (96.0 * 64.0), "{region}");
    }
    assert_eq!(fs::read(alone.join("detections.csv")).unwrap(), fs::read(out.join("clips/b/detections.csv")).unwrap());
    // Another mask under the same name is another region.
    let b = changed(&out, "b");
    image::GrayImage::from_pixel(WIDTH, HEIGHT, image::Luma([9])).save(&mask).unwrap();
    batch(place.path(), &out, ["b", "--resume"].iter().chain(&region)).ok();
    assert!(changed(&out, "b") > b);
    fs::write(&mask, "no picture").unwrap();
    let (_parent, other) = results();
    batch(place.path(), &other, ["b"].iter().chain(&region)).fails(2, &["--mask ", "half.png: it is no PNG"]);
    batch(place.path(), &other, ["b", "--checkpoint", "5"]).fails(2, &["--checkpoint"]);
}

#[test]
fn going_on_does_what_is_not_done_of_the_same_input_with_the_same_flags() {
    let place = clips(&["a", "b", "c"]);
    let params = place.path().join("p.toml");
    fs::write(&params, "[detection]\nmax_peaks = 50\n").unwrap();
    let (_parent, out) = results();
    batch(place.path(), &out, ["a", "b", "--params", "p.toml"]).ok();
    batch(place.path(), &out, ["c"]).fails(1, &["manifest.json is there already"]);
    let before = |name: &str| changed(&out, name);
    let (a, b) = (before("a"), before("b"));
    // More clips, in another order; one changes; a failed one waits for its file.
    clip(&place.path().join("b"), 5);
    let ran = batch(place.path(), &out, ["later", "c", "b", "a", "--params", "p.toml", "--resume"]);
    assert_eq!(ran.code, 1, "{}", ran.stderr);
    assert!(
        ran.stderr.contains(" a: done before\n") && ran.stderr.contains("1 done before, 1 failed"),
        "{}",
        ran.stderr
    );
    assert_eq!(before("a"), a);
    assert!(before("b") > b);
    assert_whole(&out);
    let found = manifest(&out);
    assert_eq!(found.keys().collect::<Vec<_>>(), ["a", "b", "c", "later"]);
    // Only what failed is tried again; clips that are not in the list stay.
    clip(&place.path().join("later"), 3);
    let (b, c) = (before("b"), before("c"));
    batch(place.path(), &out, ["later", "b", "--params", "p.toml", "--resume"]).ok();
    assert!(before("b") == b && before("c") == c);
    assert_whole(&out);
    assert!(manifest(&out).values().all(|clip| clip["status"] == "done"));
    // Another file at the same place is another flag, and a result that lost a file is none.
    fs::write(&params, "[detection]\nmax_peaks = 40\n").unwrap();
    batch(place.path(), &out, ["b", "--params", "p.toml", "--resume"]).ok();
    assert!(before("b") > b && before("c") == c);
    let b = before("b");
    fs::remove_file(out.join("clips/b/tracks.csv")).unwrap();
    batch(place.path(), &out, ["b", "--params", "p.toml", "--resume"]).ok();
    assert!(before("b") > b);
    assert_whole(&out);
}

#[test]
fn lists_patterns_and_names() {
    let place = clips(&["cam0", "-dash", "two\nlines", "<script>alert(1)", "..."]);
    let folder = |name: &str| place.path().join(name);
    let (_parent, out) = results();
    let zeros: Vec<u8> = ["two\nlines", "-dash", "./...", "<script>alert(1)"].join("\0").into_bytes();
    fs::write(folder("list.txt"), zeros).unwrap();
    fs::write(folder("@other"), "cam0/*.png\r\n\n").unwrap();
    batch(place.path(), &out, ["@@other", "list.txt"]).ok();
    assert_whole(&out);
    let found = manifest(&out);
    assert_eq!(found.keys().collect::<Vec<_>>(), ["_script_alert_1_", "cam0", "clip", "dash", "two_lines"]);
    assert_eq!(found["cam0"]["frames"], FRAMES);
    assert!(found["two_lines"]["input"]["path"].as_str().unwrap().ends_with("two\nlines"));
    let page = fs::read_to_string(out.join("index.html")).unwrap();
    assert!(!page.contains("<script>alert") && page.contains("&lt;script&gt;alert(1)"));
    // A pattern stands for what matches, pictures beside videos left away; hidden ones are not meant.
    let (_parent, out) = results();
    crate::common::video(&folder("cam0"), "-c:v ffv1", &folder("sky.mkv"));
    fs::copy(folder("cam0/f_0.png"), folder("s.png")).unwrap();
    fs::copy(folder("sky.mkv"), folder(".sky.mkv")).unwrap();
    batch(place.path(), &out, ["s*", "*.mkv"]).ok();
    assert_eq!(manifest(&out).keys().collect::<Vec<_>>(), ["sky"]);
    let (sky, cam0) = (manifest(&out)["sky"].clone(), &found["cam0"]);
    assert_eq!((&sky["frames"], &sky["detections"]), (&cam0["frames"], &cam0["detections"]));
}

#[test]
fn what_is_refused() {
    let place = clips(&["a"]);
    let (_parent, out) = results();
    fs::write(place.path().join("empty.txt"), "\n").unwrap();
    let outside = place.path().to_str().unwrap();
    for (words, code, parts) in [
        ("a --jobs 0", 2, "--jobs is 0"),
        ("a --threads 1000", 2, "--threads is 1000"),
        ("a --bit-depth 99", 2, "--bit-depth is 99"),
        ("a --params none.toml", 2, "none.toml: no such file"),
        ("a --box-size 5", 2, "--box-size is for"),
        ("a --speeds 1", 2, "--speed and --speeds"),
        ("a --start 5 --stop 3", 2, "--stop"),
        ("a --raw 3x3", 2, "unexpected argument '--raw'"),
        ("- rtsp://me:secret@cam/1", 2, "standard input cannot be read again"),
        ("rtsp://me:secret@cam/1", 2, "rtsp://cam/1 cannot be read again"),
        ("empty.txt", 2, "names no videos"),
        ("@none", 1, "cannot read the list none"),
        ("@/dev/zero", 1, "it has more than 256 MiB"),
        ("*.mkv", 1, "nothing matches the pattern *.mkv"),
    ] {
        let ran = batch(place.path(), &out, words.split(' ')).fails(code, &[parts]);
        assert!(!ran.stderr.contains("secret"));
        assert!(!out.exists(), "{words}: nothing was begun");
    }
    batch(place.path(), Path::new(outside), ["a"]).fails(2, &["lies in --out"]);
    let file = place.path().join("a/f_0.png");
    batch(place.path(), &file, ["a"]).fails(1, &["is a file, but a folder is needed"]);
}

#[cfg(unix)]
mod unix {
    use super::*;
    use std::os::unix::fs::symlink;
    use std::process::{Child, Command, Stdio};
    use std::thread::sleep;
    use std::time::{Duration, Instant};

    #[test]
    fn no_link_leads_out_of_the_folder() {
        let place = clips(&["a", "b"]);
        let (_parent, out) = results();
        let elsewhere = tempfile::tempdir().unwrap();
        fs::create_dir_all(out.join("clips")).unwrap();
        symlink(elsewhere.path(), out.join("clips/a")).unwrap();
        batch(place.path(), &out, ["a", "b", "--resume", "--quiet"]).fails(1, &["1 of 2", "clips/a is in the way"]);
        let found = manifest(&out);
        assert_eq!((&found["a"]["status"], &found["b"]["status"]), (&"failed".into(), &"done".into()));
        let (_parent, out) = results();
        fs::create_dir_all(&out).unwrap();
        symlink(elsewhere.path(), out.join("clips")).unwrap();
        batch(place.path(), &out, ["a", "--resume"]).fails(1, &["cannot write", "clips"]);
        assert_eq!(fs::read_dir(elsewhere.path()).unwrap().count(), 0);
        // What is not of this program is not replaced.
        let (_parent, out) = results();
        fs::create_dir_all(out.join("clips/a")).unwrap();
        fs::write(out.join("clips/a/mine.txt"), "mine").unwrap();
        batch(place.path(), &out, ["a", "--resume", "--quiet"]).fails(1, &["clips/a is in the way"]);
        assert_eq!(fs::read_to_string(out.join("clips/a/mine.txt")).unwrap(), "mine");
    }

    /// Whatever stands in the folder of a batch, nothing else is written through it, and whatever inputs are called, their
    /// results stay inside.
    #[test]
    fn nothing_is_written_through_links_or_names() {
        let place = clips(&["a", "in/b"]);
        let elsewhere = tempfile::tempdir().unwrap();
        let mine = elsewhere.path().join("mine");
        fs::write(&mine, "mine").unwrap();
        let (_parent, out) = results();
        fs::create_dir(&out).unwrap();
        for (name, to) in [
            ("manifest.json", "mine"),
            ("manifest.json.part", "mine"),
            ("index.html", "new"),
            ("index.html.part", "new"),
        ] {
            symlink(elsewhere.path().join(to), out.join(name)).unwrap();
        }
        fs::create_dir(out.join("failed")).unwrap();
        symlink(elsewhere.path(), out.join("failed/a")).unwrap();
        let list = format!("../a\n{}\n./../in/../in/b\n", place.path().join("a").display());
        fs::write(place.path().join("in/list.txt"), list).unwrap();
        batch(&place.path().join("in"), &out, ["@list.txt", "--resume"]).ok();
        assert_whole(&out);
        assert_eq!(manifest(&out).keys().collect::<Vec<_>>(), ["a", "b"]);
        let listed = |folder: &Path| fs::read_dir(folder).unwrap().count();
        assert_eq!((listed(elsewhere.path()), fs::read_to_string(&mine).unwrap().as_str()), (1, "mine"));
        assert_eq!(listed(out.parent().unwrap()), 1, "nothing beside the folder");
        let (_parent, out) = results();
        fs::create_dir(&out).unwrap();
        symlink(elsewhere.path().join("lock"), out.join("batch.lock")).unwrap();
        batch(place.path(), &out, ["a"]).fails(1, &["batch.lock is no file of this program"]);
        assert_eq!(listed(elsewhere.path()), 1);
    }

    /// One picture under many names, as work that takes long.
    fn long(place: &Path, name: &str) {
        let folder = place.join(name);
        fs::create_dir(&folder).unwrap();
        picture(0).save(folder.join("0.png")).unwrap();
        for frame in 1..20_000 {
            fs::hard_link(folder.join("0.png"), folder.join(format!("{frame}.png"))).unwrap();
        }
    }

    fn until(what: &str, so: impl Fn() -> bool) {
        let begin = Instant::now();
        while !so() {
            assert!(begin.elapsed() < Duration::from_secs(120), "{what}");
            sleep(Duration::from_millis(20));
        }
    }

    /// A batch of a short clip and long ones, the short one done and the long ones at work.
    fn at_work(place: &Path, out: &Path) -> Child {
        for name in ["long1", "long2"] {
            long(place, name);
        }
        let mut batch = command();
        batch
            .current_dir(place)
            .args(["batch", "--speed", "1", "short", "long1", "long2", "--jobs", "2", "--out"])
            .arg(out);
        let child = batch.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let parts = || fs::read_dir(out.join("part")).into_iter().flatten().flatten().map(|entry| entry.path());
        let begun = || parts().filter(|part| part.join("detections.csv").exists()).count();
        until("two long ones", || out.join("clips/short").exists() && begun() == 2);
        child
    }

    fn signal(name: &str, process: u32) {
        assert!(Command::new("kill").args([name, &process.to_string()]).status().unwrap().success());
    }

    /// Processes with this text in their arguments.
    #[cfg(target_os = "linux")]
    fn processes(text: &str) -> Vec<u32> {
        let entries = fs::read_dir("/proc").unwrap().flatten();
        let named = entries.filter(|entry| {
            let arguments = fs::read(entry.path().join("cmdline")).unwrap_or_default();
            String::from_utf8_lossy(&arguments).contains(text)
        });
        named.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).collect()
    }

    #[test]
    fn an_interrupted_batch_goes_on_later() {
        for name in ["-INT", "-TERM"] {
            let place = clips(&["short"]);
            let (_parent, out) = results();
            let child = at_work(place.path(), &out);
            // Nobody else gets into this folder meanwhile.
            batch(place.path(), &out, ["short", "--resume"]).fails(1, &["another batch is at work"]);
            signal(name, child.id());
            let output = child.wait_with_output().unwrap();
            let stderr = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(130), "{name}: {stderr}");
            assert!(stderr.contains("2 not tried") && stderr.contains("--resume goes on"), "{stderr}");
            assert_whole(&out);
            let record = json(&out.join("manifest.json"));
            assert_eq!((&record["interrupted"], &record["waiting"]), (&true.into(), &2.into()));
            #[cfg(target_os = "linux")]
            assert_eq!(processes(out.to_str().unwrap()), [0; 0], "all children have ended");
            for clip in ["long1", "long2"] {
                fs::remove_dir_all(place.path().join(clip)).unwrap();
                super::clip(&place.path().join(clip), 0);
            }
            let mut rest = command();
            rest.current_dir(place.path())
                .args(["batch", "--speed", "1", "short", "long1", "long2", "--resume", "--out"]);
            let rest = Ran::from(rest.arg(&out).output().unwrap()).ok();
            assert!(rest.stderr.contains(" short: done before"), "{}", rest.stderr);
            assert_whole(&out);
            assert_eq!(manifest(&out).len(), 3);
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn whatever_is_killed_nothing_is_half_done() {
        let place = clips(&["short"]);
        let (_parent, out) = results();
        let mut child = at_work(place.path(), &out);
        let text = out.to_str().unwrap();
        // A child, as the system does where memory runs out: its clip failed, the batch goes on.
        let others: Vec<u32> = processes(text).into_iter().filter(|process| *process != child.id()).collect();
        assert_eq!(others.len(), 2);
        let first = others.into_iter().find(|process| {
            fs::read_to_string(format!("/proc/{process}/cmdline")).unwrap_or_default().contains("long1-")
        });
        signal("-KILL", first.unwrap());
        until("the killed one is noted", || out.join("failed/long1").exists());
        let failed = json(&out.join("failed/long1/clip.json"));
        assert!(failed["error"].as_str().unwrap().contains("killed by signal 9"), "{failed}");
        // The batch itself: the other child does not outlive it.
        child.kill().unwrap();
        child.wait().unwrap();
        until("its child ends too", || processes(text).is_empty());
        assert!(!out.join("clips/long2").exists());
        assert_eq!(manifest(&out)["short"]["status"], "done");
        for clip in ["long1", "long2"] {
            fs::remove_dir_all(place.path().join(clip)).unwrap();
            super::clip(&place.path().join(clip), 0);
        }
        // Even without the manifest: the folders are the truth.
        fs::remove_file(out.join("manifest.json")).unwrap();
        let short = changed(&out, "short");
        let mut rest = command();
        rest.current_dir(place.path()).args(["batch", "--speed", "1", "short", "long1", "long2", "--resume", "--out"]);
        Ran::from(rest.arg(&out).output().unwrap()).ok();
        assert_whole(&out);
        assert_eq!(manifest(&out).len(), 3);
        assert_eq!(changed(&out, "short"), short);
    }
}

#[test]
fn paths_are_full() {
    let place = clips(&["a"]);
    // A folder of results that is named from elsewhere.
    batch(place.path(), Path::new("all/./here"), ["./a"]).ok();
    let out: PathBuf = place.path().join("all/here");
    assert_whole(&out);
    assert_eq!(manifest(&out)["a"]["input"]["path"], place.path().join("a").to_str().unwrap());
}
