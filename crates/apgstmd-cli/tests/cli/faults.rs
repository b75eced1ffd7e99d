//! Disks that fill, folders and frames that go, programs that die: the error says what happened, every file is valid to its
//! last whole row, and `--resume` ends as if nothing had been. Signals are in `resume.rs`; a reader that goes away in
//! `output.rs`; truncated files in `video.rs`; a camera that falls silent, and dropped frames, in `live.rs`.
#![cfg(unix)]

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{
    Ran, apgstmd, command, folder, json, picture, programs, record, results, scene, start, tables, video,
};
use tempfile::TempDir;

/// Every table is whole rows of as many cells as its head, JSON is JSON, and nothing is there in part.
#[track_caller]
fn assert_valid(out: &Path) {
    for (name, table) in tables(out) {
        assert!(table.is_empty() || table.ends_with(b"\n"), "{name} ends with a part of a row");
        if name.ends_with("jsonl") {
            let text = String::from_utf8(table).unwrap();
            text.lines().for_each(|line| drop(serde_json::from_str::<serde_json::Value>(line).unwrap()));
        } else {
            let mut rows = csv::ReaderBuilder::new().has_headers(false).from_reader(&table[..]);
            rows.records().for_each(|row| drop(row.unwrap_or_else(|error| panic!("{name}: {error}"))));
        }
    }
    if out.join("run.json").exists() {
        assert_eq!(json(&out.join("run.json"))["schema_version"], 1);
    }
    for entry in [out.to_owned(), out.join("overlay"), out.join("dump")].iter().flat_map(fs::read_dir).flatten() {
        let path = entry.unwrap().path();
        let bytes = || fs::read(&path).unwrap();
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("part") => panic!("{} is left", path.display()),
            Some("png") => {
                drop(image::load_from_memory(&bytes()).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
            }
            Some("npy") => assert_eq!(bytes().len(), 128 + 4 * 80 * 64, "{}", path.display()),
            _ => {}
        }
    }
}

fn wait(what: &str, mut so: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !so() {
        assert!(begin.elapsed() < Duration::from_secs(60), "{what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn rows(table: &Path) -> usize {
    fs::read_to_string(table).map_or(0, |text| text.lines().count())
}

/// A small disk; where none can be mounted, a limit to how large a file may become, which is as good a reason to refuse.
enum Disk {
    Mounted(TempDir),
    Limited(TempDir, u64),
}

impl Disk {
    fn of(bytes: u64) -> Self {
        let place = tempfile::tempdir().unwrap();
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", &format!("size={bytes}"), "tmpfs"]).arg(place.path());
        let mounted = mount.stderr(Stdio::null()).status().is_ok_and(|status| status.success());
        if mounted { Self::Mounted(place) } else { Self::Limited(place, bytes) }
    }

    fn out(&self) -> PathBuf {
        let (Self::Mounted(place) | Self::Limited(place, _)) = self;
        place.path().join("out")
    }

    fn enlarge(&mut self) {
        match self {
            Self::Mounted(place) => {
                let status = Command::new("mount").args(["-o", "remount,size=64m"]).arg(place.path()).status();
                assert!(status.unwrap().success());
            }
            Self::Limited(_, most) => *most = 64 << 20,
        }
    }

    fn run(&self, line: &str, input: &Path) -> Ran {
        let out = self.out();
        match self {
            Self::Mounted(_) => apgstmd(line, input, &out),
            Self::Limited(_, most) => {
                let put = |word: &str| {
                    word.replace("{in}", &input.display().to_string()).replace("{out}", &out.display().to_string())
                };
                let script = format!("trap '' XFSZ; ulimit -f {}; exec \"$@\"", most / 512);
                let mut shell = Command::new("sh");
                shell.args(["-c", &script, "sh", env!("CARGO_BIN_EXE_apgstmd")]);
                shell.args(line.split_whitespace().map(put)).output().unwrap().into()
            }
        }
    }

    fn reason(&self) -> &'static str {
        match self {
            Self::Mounted(_) => "no space left on device",
            Self::Limited(..) => "file too large",
        }
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        if let Self::Mounted(place) = self {
            // A failing test must not fail twice.
            let _ = Command::new("umount").arg("-l").arg(place.path()).status();
        }
    }
}

const RUN: &str = "run {in} --out {out} --speed 1 --threads 1 --format csv,jsonl --mot {out}/tracks.mot --quiet";
const KEPT: &str = "--checkpoint 10 --resume";

/// The disk is full while tables are written, in the middle of a checkpoint, and while COCO JSON and the page grow.
#[test]
fn a_full_disk() {
    let (_folder, scene) = scene(150);
    let (_parent, whole) = results();
    fs::create_dir(&whole).unwrap();
    apgstmd(RUN, &scene, &whole).ok();
    let truth = tables(&whole);
    let all: u64 = truth.values().map(|table| table.len() as u64).sum();
    let largest = truth.values().map(|table| table.len() as u64).max().unwrap();
    let checkpoint = checkpoint(&scene);
    // Of a limit to each file only the largest feels something.
    let mounted = matches!(Disk::of(1 << 20), Disk::Mounted(_));
    let half = if mounted { all / 2 } else { largest / 2 };
    let cases = [
        (RUN.to_owned(), half),
        (format!("{RUN} {KEPT}"), checkpoint / 2 + all),
        (format!("{RUN} {KEPT}"), checkpoint * 3 / 2 + all),
        (format!("{RUN} --coco {{out}}/t.json --report {{out}}/r.html"), half),
        (format!("{RUN} --overlay --dump P"), if mounted { 4 * all } else { half }),
    ];
    for (line, bytes) in cases {
        let mut disk = Disk::of(bytes);
        let out = disk.out();
        fs::create_dir(&out).unwrap();
        let ran = disk.run(&line, &scene).fails(1, &["cannot write", disk.reason()]);
        assert!(ran.stderr.contains(&out.display().to_string()), "it names the file: {}", ran.stderr);
        assert_valid(&out);
        for (name, part) in tables(&out) {
            assert!(truth[name].starts_with(&part), "{line}, {bytes} bytes: {name}");
        }
        assert!(tables(&out) != truth);
        assert!(!out.join("t.json").exists() && !out.join("r.html").exists(), "what is only valid as a whole");
        disk.enlarge();
        let line = if line.contains("--resume") { line } else { format!("{line} --resume") };
        disk.run(&line, &scene).ok();
        assert!(tables(&out) == truth, "{line}, {bytes} bytes");
    }
}

/// All is there but the page, which is made at the end: the run is not through.
#[test]
fn a_disk_that_is_too_small_for_the_page() {
    let (_folder, scene) = scene(150);
    let (_parent, whole) = results();
    let line = format!("{RUN} --report {{out}}/r.html --resume");
    apgstmd(&line, &scene, &whole).ok();
    let bytes = |name: &str| fs::metadata(whole.join(name)).unwrap().len();
    let rest: u64 = fs::read_dir(&whole).unwrap().map(|entry| entry.unwrap().metadata().unwrap().len()).sum();
    let (page, truth) = (bytes("r.html"), tables(&whole));
    assert!(
        truth.values().all(|table| (table.len() as u64) < page / 2),
        "of a limit to each file the page alone feels something"
    );
    let mounted = matches!(Disk::of(1 << 20), Disk::Mounted(_));
    let mut disk = Disk::of(if mounted { rest - page / 2 } else { page / 2 });
    let out = disk.out();
    disk.run(&line, &scene).fails(1, &["cannot write", "r.html", disk.reason()]);
    assert_valid(&out);
    assert!(tables(&out) == truth && !out.join("r.html").exists());
    assert!(json(&out.join("run.json"))["error"].as_str().unwrap().contains("r.html"));
    disk.enlarge();
    disk.run(&line, &scene).ok();
    assert!(fs::read_to_string(out.join("r.html")).unwrap().trim_end().ends_with("</html>"));
    assert!(tables(&out) == truth);
}

/// Bytes of a checkpoint of that run.
fn checkpoint(scene: &Path) -> u64 {
    let (_parent, out) = results();
    fs::create_dir(&out).unwrap();
    let mut child = start(&format!("{RUN} {KEPT}"), scene, &out);
    let kept = out.join("checkpoint.safetensors");
    wait("a checkpoint", || kept.exists());
    child.kill().unwrap();
    child.wait().unwrap();
    fs::metadata(kept).unwrap().len()
}

#[test]
fn a_folder_that_is_removed() {
    let (_folder, scene) = scene(20_000);
    let (_parent, whole) = results();
    fs::create_dir(&whole).unwrap();
    apgstmd(&format!("{RUN} --stop 150"), &scene, &whole).ok();
    for flags in ["--resume", KEPT] {
        let (_parent, out) = results();
        fs::create_dir(&out).unwrap();
        let child = start(&format!("{RUN} {flags}"), &scene, &out);
        wait("rows", || rows(&out.join("camera.csv")) > 20);
        // What is written beside its place may come and go meanwhile.
        fs::remove_dir_all(&out).or_else(|_| fs::remove_dir_all(&out)).unwrap();
        let begin = Instant::now();
        Ran::from(child.wait_with_output().unwrap()).fails(1, &["cannot write", "out/"]);
        assert!(begin.elapsed() < Duration::from_secs(2), "it does not compute for nothing");
        assert!(!out.exists(), "nothing comes back");
        fs::create_dir(&out).unwrap();
        apgstmd(&format!("{RUN} {flags} --stop 150"), &scene, &out).ok();
        assert!(tables(&out) == tables(&whole));
    }
}

/// Thousands of pictures in no time: one file under many names.
fn many(frames: usize) -> TempDir {
    let place = folder(60);
    for frame in 60..frames {
        let like = place.path().join(format!("f_{}.png", frame % 60));
        fs::hard_link(like, place.path().join(format!("f_{frame}.png"))).unwrap();
    }
    place
}

/// A picture goes, and another comes, after the folder was read.
#[test]
fn a_frame_that_vanishes() {
    let frames = many(1500);
    for (flags, code) in [("", 1), ("--on-error skip", 0)] {
        let last = frames.path().join("f_1499.png");
        let (_parent, out) = results();
        fs::create_dir(&out).unwrap();
        let line = format!("{RUN} --rejection off {flags}");
        let child = start(&line, frames.path(), &out);
        wait("rows", || rows(&out.join("detections.csv")) > 1);
        fs::remove_file(&last).unwrap();
        picture(3).save(frames.path().join("f_1500.png")).unwrap();
        let ran = Ran::from(child.wait_with_output().unwrap());
        assert_eq!(ran.code, code, "{}", ran.stderr);
        assert!(
            code == 0 || ran.stderr.contains("f_1499.png") && ran.stderr.contains("no such file"),
            "{}",
            ran.stderr
        );
        assert_valid(&out);
        let told = record(&out);
        assert_eq!((&told["frames"], &told["input"]["pictures"]), (&1499.into(), &1500.into()));
        assert_eq!(told["frames_skipped"], 1 - code);
        // Once it is there again, the run goes on to the end it would have had.
        fs::remove_file(frames.path().join("f_1500.png")).unwrap();
        picture(1499 % 60).save(&last).unwrap();
    }
}

/// A video that still grows while it is read: what is there is read, and every row of it is right.
#[test]
fn a_file_that_grows() {
    let pictures = folder(60);
    let file = pictures.path().join("clip.mkv");
    video(pictures.path(), "-pix_fmt gray -c:v ffv1", &file);
    let line = "run {in} --out {out} --speed 1 --rejection off --force --quiet";
    let (_parent, whole) = results();
    apgstmd(line, &file, &whole).ok();
    let table = |out: &Path| fs::read_to_string(out.join("detections.csv")).unwrap();
    let truth = table(&whole);
    let bytes = fs::read(&file).unwrap();
    let (begun, rest) = bytes.split_at(bytes.len() / 2);
    fs::write(&file, begun).unwrap();
    let (_parent, out) = results();
    fs::create_dir(&out).unwrap();
    let child = start(line, &file, &out);
    let mut growing = fs::File::options().append(true).open(&file).unwrap();
    for piece in rest.chunks(512) {
        growing.write_all(piece).unwrap();
        std::thread::sleep(Duration::from_millis(1));
    }
    let ran = Ran::from(child.wait_with_output().unwrap());
    assert!(ran.code == 0 || ran.code == 1 && ran.stderr.contains("clip.mkv"), "{}", ran.stderr);
    assert_valid(&out);
    // What a decoder makes of half a frame is not known.
    let came = record(&out)["frames"].as_u64().unwrap() as usize;
    assert!(came > 10, "{came} frames");
    let before = |text: &str| {
        let frame = |row: &str| row.split(',').next().unwrap().parse::<usize>().unwrap();
        text.lines().skip(1).filter(|row| frame(row) + 2 < came).map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(before(&table(&out)), before(&truth));
    apgstmd(line, &file, &out).ok();
    assert_eq!(table(&out), truth);
}

/// ffmpeg dies in the middle, is well again, and the run goes on.
#[test]
fn a_killed_ffmpeg_and_the_same_run_again() {
    let pictures = folder(60);
    let file = pictures.path().join("clip.avi");
    video(pictures.path(), "-pix_fmt gray -c:v ffv1", &file);
    let line = format!("{RUN} {KEPT}");
    let (_parent, whole) = results();
    fs::create_dir(&whole).unwrap();
    apgstmd(&line, &file, &whole).ok();
    // Forty frames and a half.
    let dying = programs(Some(r#""$REAL/ffmpeg" "$@" | head -c 248832; kill -9 $$"#));
    let (_parent, out) = results();
    fs::create_dir(&out).unwrap();
    let mut words: Vec<String> = line.split_whitespace().skip(1).map(str::to_owned).collect();
    words.remove(0);
    let words: Vec<String> = words.iter().map(|word| word.replace("{out}", &out.display().to_string())).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let ran = Ran::from(crate::common::with_path(dying.path(), &words, &file).output().unwrap());
    ran.fails(1, &["cannot use frame 40", "ffmpeg was killed by signal 9"]);
    assert_valid(&out);
    assert_eq!(record(&out)["frames"], 40);
    let again = line.replace(" --quiet", "");
    let ran = apgstmd(&again, &file, &out).ok();
    assert!(ran.stderr.contains("going on after"), "{}", ran.stderr);
    assert!(tables(&out) == tables(&whole));
}

fn camera(out: &Path, flags: &[&str]) -> Child {
    let mut run = command();
    run.args(["run", "-", "--raw", "96x64", "--fps", "30", "--speed", "1", "--rejection", "off", "--quiet", "--out"]);
    run.arg(out).args(flags).stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// A camera that says nothing for a while: nothing is lost, nothing is added.
#[test]
fn a_camera_that_stalls() {
    let frames: Vec<u8> = (0..60).flat_map(|frame| picture(frame).into_raw()).collect();
    let table = |pause: Duration| {
        let (_parent, out) = results();
        let mut child = camera(&out, &[]);
        let mut stdin = child.stdin.take().unwrap();
        // In the middle of a frame.
        let (first, rest) = frames.split_at(frames.len() / 2 + 999);
        stdin.write_all(first).unwrap();
        std::thread::sleep(pause);
        stdin.write_all(rest).unwrap();
        drop(stdin);
        Ran::from(child.wait_with_output().unwrap()).ok();
        assert_eq!(record(&out)["frames"], 60);
        fs::read_to_string(out.join("detections.csv")).unwrap()
    };
    let steady = table(Duration::ZERO);
    assert!(steady.lines().count() > 30);
    assert_eq!(table(Duration::from_millis(700)), steady);
}

/// A control group with a limit of memory, as containers and services are.
struct Group(PathBuf);

impl Group {
    /// None where this process may not make any.
    fn new(bytes: usize) -> Option<Self> {
        let kinds = [("/sys/fs/cgroup/memory", "memory.limit_in_bytes"), ("/sys/fs/cgroup", "memory.max")];
        kinds.iter().find_map(|(place, limit)| {
            let group = Self(Path::new(place).join(format!("apgstmd-test-{}", std::process::id())));
            fs::create_dir(&group.0).ok()?;
            fs::OpenOptions::new()
                .write(true)
                .open(group.0.join(limit))
                .ok()?
                .write_all(bytes.to_string().as_bytes())
                .ok()?;
            Some(group)
        })
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        // A failing test must not fail twice.
        let _ = fs::remove_dir(&self.0);
    }
}

/// What would take more memory than there is, is refused before it is begun, with the number of bytes: one detector, and
/// the usual bank. A group may have less than the system promises.
#[test]
fn too_little_memory() {
    let limits = ("ulimit -v 1500000".to_owned(), "which the system does not give");
    let group = Group::new(500 << 20);
    let enter = |Group(place): &Group| format!("echo $$ > {}/cgroup.procs", place.display());
    let limits = [limits].into_iter().chain(group.as_ref().map(|group| (enter(group), "are left")));
    for (limit, reason) in limits {
        is_refused(&limit, reason);
    }
}

fn is_refused(limit: &str, reason: &str) {
    let (_parent, out) = results();
    for (flags, size) in [("--speed 1", (4096, 2048)), ("", (2048, 1024))] {
        let (width, height) = size;
        let line = format!(
            "{limit}; exec {} run - --raw {width}x{height} --quiet --threads 1 --force {flags} --out {}",
            env!("CARGO_BIN_EXE_apgstmd"),
            out.display()
        );
        let mut child = Command::new("sh")
            .args(["-c", &line])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // It may have gone by then.
        let _ = child.stdin.take().unwrap().write_all(&vec![90; width * height]);
        let ran = Ran::from(child.wait_with_output().unwrap());
        ran.fails(1, &[&format!("frames of {height} x {width}"), "bytes of memory", reason]);
        assert!(!out.exists(), "nothing is left behind");
    }
}
