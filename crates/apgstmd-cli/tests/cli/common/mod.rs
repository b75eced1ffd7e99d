//! Frames that the tests write themselves, and the program under test.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use image::{GrayImage, Luma};
use tempfile::TempDir;

pub const WIDTH: u32 = 96;
pub const HEIGHT: u32 = 64;
/// Row of the target's centre.
pub const ROW: f64 = 32.0;

/// Column of the target's centre: 1 px/frame to the right.
pub fn column(frame: usize) -> f64 {
    20.0 + frame as f64
}

/// A dark 5 x 5 square on light grey.
pub fn picture(frame: usize) -> GrayImage {
    GrayImage::from_fn(WIDTH, HEIGHT, |x, y| {
        let inside = (f64::from(x) - column(frame)).abs() < 3.0 && (f64::from(y) - ROW).abs() < 3.0;
        Luma([if inside { 20 } else { 220 }])
    })
}

/// `frames` PNG files f_0.png, f_1.png, ... in a new folder.
pub fn folder(frames: usize) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for frame in 0..frames {
        picture(frame).save(folder.path().join(format!("f_{frame}.png"))).unwrap();
    }
    folder
}

pub struct Ran {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl From<Output> for Ran {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

impl Ran {
    #[track_caller]
    pub fn ok(self) -> Self {
        assert_eq!(self.code, 0, "{}", self.stderr);
        self
    }

    /// One line `error: ...` that holds all of `parts`, at most one line `hint: ...`, and this exit code.
    #[track_caller]
    pub fn fails(self, code: i32, parts: &[&str]) -> Self {
        assert_eq!(self.code, code, "stdout: {} stderr: {}", self.stdout, self.stderr);
        let lines: Vec<&str> = self.stderr.lines().collect();
        assert!(lines.len() <= 2 && lines[0].starts_with("error: "), "{}", self.stderr);
        assert!(lines.get(1).is_none_or(|line| line.starts_with("hint: ")), "{}", self.stderr);
        for part in parts {
            assert!(lines[0].contains(part), "`{part}` is not in: {}", lines[0]);
        }
        assert!(!self.stderr.contains("panicked"), "{}", self.stderr);
        self
    }
}

pub fn command() -> Command {
    Command::new(env!("CARGO_BIN_EXE_apgstmd"))
}

/// The system's ffmpeg, which these tests need.
#[track_caller]
pub fn ffmpeg<I: AsRef<std::ffi::OsStr>>(arguments: impl IntoIterator<Item = I>) -> Vec<u8> {
    let output = Command::new("ffmpeg")
        .args(["-nostdin", "-hide_banner", "-loglevel", "error", "-y"])
        .args(arguments)
        .output()
        .expect("these tests need ffmpeg: apt-get install ffmpeg");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}

/// The pictures of [`folder`] as a video at 30 frames a second, made with these further words.
#[track_caller]
pub fn video(frames: &Path, words: &str, to: &Path) {
    let mut arguments: Vec<std::ffi::OsString> =
        ["-framerate", "30", "-start_number", "0", "-i"].map(Into::into).into();
    arguments.push(frames.join("f_%d.png").into());
    arguments.extend(words.split_whitespace().map(Into::into));
    let mut name = std::ffi::OsString::from("file:");
    name.push(to);
    arguments.push(name);
    ffmpeg(arguments);
}

/// Runs the program with `bytes` on its standard input.
pub fn piped(line: &str, bytes: &[u8], out: &Path) -> Ran {
    use std::io::Write;
    use std::process::Stdio;
    let mut child = command()
        .args(line.split_whitespace().map(|word| word.replace("{out}", &out.display().to_string())))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    std::thread::scope(|scope| {
        // A program that has enough closes its end.
        scope.spawn(move || drop(stdin.write_all(bytes)));
        child.wait_with_output().unwrap().into()
    })
}

/// Runs the program with arguments separated by blanks; `{in}` and `{out}` stand for the two paths.
pub fn apgstmd(line: &str, input: &Path, out: &Path) -> Ran {
    words(line, input, out).output().unwrap().into()
}

fn words(line: &str, input: &Path, out: &Path) -> Command {
    let put =
        |word: &str| word.replace("{in}", &input.display().to_string()).replace("{out}", &out.display().to_string());
    let mut command = command();
    command.args(line.split_whitespace().map(put));
    command
}

/// Three squares before moving clutter: tracks begin, end and cross.
pub fn scene(frames: usize) -> (TempDir, PathBuf) {
    let target = |y: f64, speed: f64| {
        format!("[[target]]\npath = {{ kind = 'straight', start = [10.0, {y:.1}], speed = {speed:.1} }}\n")
    };
    let text = format!(
        "width = 80\nheight = 64\nrate = 100.0\nframes = {frames}\nseed = 5\n\
         [background]\nkind = 'natural'\nvelocity = [-30.0, 0.0]\n{}{}{}",
        target(20.0, 60.0),
        target(32.0, 100.0),
        target(44.0, 40.0)
    );
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.toml");
    fs::write(&file, text).unwrap();
    (folder, file)
}

/// Tables of the lines of these tests.
pub const TABLES: [&str; 5] = ["detections.csv", "detections.jsonl", "tracks.csv", "tracks.mot", "camera.csv"];

/// Every table, as far as it is there.
pub fn tables(out: &Path) -> std::collections::BTreeMap<&'static str, Vec<u8>> {
    TABLES.into_iter().filter_map(|name| Some((name, fs::read(out.join(name)).ok()?))).collect()
}

/// What run.json says but for times and threads.
pub fn record(out: &Path) -> serde_json::Value {
    let mut record = json(&out.join("run.json"));
    let object = record.as_object_mut().unwrap();
    for timed in
        ["seconds", "processor_seconds", "seconds_per_frame", "stage_seconds_per_frame", "threads", "resumed_after"]
    {
        object.remove(timed);
    }
    record
}

/// Starts the program as [`apgstmd`] runs it.
pub fn start(line: &str, input: &Path, out: &Path) -> std::process::Child {
    words(line, input, out)
        .stdin(std::process::Stdio::null())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap()
}

/// A place for results that is not there yet.
pub fn results() -> (TempDir, PathBuf) {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("out");
    (parent, path)
}

#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    pub frame: usize,
    pub name: String,
    /// Seconds, where they are known.
    pub time: Option<f64>,
    pub x: f64,
    pub y: f64,
    pub score: f64,
    pub direction: f64,
    pub trace: u64,
}

pub fn csv_rows(path: &Path) -> Vec<Row> {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.ends_with('\n'), "the last row is complete");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("frame,name,time_s,x,y,score,direction_rad,trace,speed,size,contrast"));
    let rows = lines.map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), 11, "{line}");
        Row {
            frame: cells[0].parse().unwrap(),
            name: cells[1].to_owned(),
            time: (!cells[2].is_empty()).then(|| cells[2].parse().unwrap()),
            x: cells[3].parse().unwrap(),
            y: cells[4].parse().unwrap(),
            score: cells[5].parse().unwrap(),
            // Empty where the model has no directions.
            direction: if cells[6].is_empty() { f64::NAN } else { cells[6].parse().unwrap() },
            trace: cells[7].parse().unwrap(),
        }
    });
    rows.collect()
}

pub fn json(path: &Path) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

/// The strongest detection of a frame lies on the target.
#[track_caller]
pub fn assert_found(rows: &[Row], frame: usize) {
    let best = rows.iter().filter(|row| row.frame == frame).max_by(|a, b| a.score.total_cmp(&b.score));
    let best = best.unwrap_or_else(|| panic!("nothing found in frame {frame}"));
    let off = (best.x - column(frame)).hypot(best.y - ROW);
    assert!(off < 3.0, "frame {frame}: {best:?} is {off} px off");
    assert!(best.direction.abs() < 0.4, "{best:?} moves to the right");
}

/// `ffmpeg` and `ffprobe` as a test wants them. In scripts, $REAL is the folder of the true ones.
#[cfg(unix)]
pub fn programs(ffmpeg: Option<&str>) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let real = which("ffmpeg");
    let real = real.parent().unwrap().display();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, format!("#!/bin/sh\nREAL={real}\nHERE={}\n{text}\n", folder.path().display())).unwrap();
        fs::set_permissions(&path, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    };
    if let Some(ffmpeg) = ffmpeg {
        write("ffprobe", r#"exec "$REAL/ffprobe" "$@""#);
        write("ffmpeg", ffmpeg);
    }
    folder
}

#[cfg(unix)]
fn which(program: &str) -> PathBuf {
    let path = std::env::var_os("PATH").unwrap();
    std::env::split_paths(&path).map(|folder| folder.join(program)).find(|path| path.is_file()).unwrap()
}

/// `run` with that folder as its path.
#[cfg(unix)]
pub fn with_path(folder: &Path, words: &[&str], input: &Path) -> Command {
    let mut path = std::ffi::OsString::from(folder);
    // The scripts need the usual tools, but no other ffmpeg.
    if folder.join("ffmpeg").exists() {
        path.push(":/usr/bin:/bin");
    }
    let mut run = command();
    run.arg("run").args(words).arg(input).env("PATH", path).stdin(std::process::Stdio::null());
    run
}

/// A page, and the data in it.
pub fn page_data(path: &Path) -> (String, serde_json::Value) {
    let text = fs::read_to_string(path).unwrap();
    let begin = text.find(r#"id="data">"#).unwrap() + r#"id="data">"#.len();
    let end = begin + text[begin..].find("</script>").unwrap();
    let data = serde_json::from_str(&text[begin..end]).unwrap();
    (text, data)
}
