//! What comes in its own time: dropping, delays, ends; and ffmpeg itself going wrong.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{Ran, command, csv_rows, folder, json, programs, results, video, with_path};

/// A frame every 5 ms of a size that takes far longer: some are dropped, the last is not, what is left is judged as if
/// nothing else had been there.
#[test]
fn frames_that_come_too_fast_are_dropped_and_counted() {
    const FRAMES: usize = 120;
    let (_parent, out) = results();
    let mut child = command()
        .args([
            "run",
            "-",
            "--raw",
            "960x720",
            "--fps",
            "200",
            "--live",
            "--rejection",
            "off",
            "--threads",
            "1",
            "--out",
        ])
        .arg(&out)
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let begin = Instant::now();
    for frame in 0..FRAMES {
        let picture: Vec<u8> = (0..960 * 720u32)
            .map(|i| if (i % 960).abs_diff(100 + frame as u32) < 3 && (i / 960).abs_diff(300) < 3 { 20 } else { 200 })
            .collect();
        std::thread::sleep((Duration::from_millis(5) * frame as u32).saturating_sub(begin.elapsed()));
        stdin.write_all(&picture).unwrap();
    }
    drop(stdin);
    let ran: Ran = child.wait_with_output().unwrap().into();
    let ran = ran.ok();
    let record = json(&out.join("run.json"));
    let (done, dropped) = (record["frames"].as_u64().unwrap(), record["live"]["dropped"].as_u64().unwrap());
    assert_eq!(done + dropped, FRAMES as u64);
    assert!(dropped > 10 && done > 1, "{dropped} dropped");
    assert!(ran.stderr.contains(&format!("live: {dropped} frames dropped")), "{}", ran.stderr);
    assert_eq!(record["input"]["pictures"], FRAMES);
    let rows = csv_rows(&out.join("detections.csv"));
    assert!(rows.iter().all(|row| row.time == Some(row.frame as f64 / 200.0)));
    assert!(rows.is_sorted_by_key(|row| row.frame));
    let left_out = record["input"]["left_out"].as_str().unwrap();
    let last = left_out.rsplit(['.', ',']).next().unwrap().parse::<usize>().unwrap();
    assert!(last < FRAMES - 1, "the newest is computed");
    // One frame waits while one is computed and one is written.
    let longest = record["live"]["delay"]["most"].as_f64().unwrap();
    let frame = record["seconds_per_frame"]["compute"]["median"].as_f64().unwrap();
    assert!(longest > 0.0 && longest < 1.0 + 10.0 * frame, "{longest} s late, {frame} s a frame");
    // What was never seen is no miss.
    let truth = out.join("truth.csv");
    let boxes: String = (0..FRAMES).map(|frame| format!("{frame},{},298,5,5\n", 98 + frame)).collect();
    fs::write(&truth, format!("frame,x,y,w,h\n{boxes}")).unwrap();
    let judged: Ran = command().arg("eval").arg(&out).arg(&truth).arg("--json").output().unwrap().into();
    let judged: serde_json::Value = serde_json::from_str(&judged.ok().stdout).unwrap();
    assert_eq!(judged["frames"], done);
}

/// A file is played at its own speed; every row is there when its frame has been computed.
#[test]
fn a_live_file_takes_its_time() {
    let frames = folder(60);
    let path = frames.path().join("clip.avi");
    video(frames.path(), "-pix_fmt gray -c:v ffv1", &path);
    let mut child = command()
        .args(["run", "--live", "--speed", "1", "--rejection", "off", "--out", "-"])
        .arg(&path)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(lines.next().unwrap().unwrap().starts_with("frame,"));
    let mut late: f64 = 0.0;
    let first = lines.next().unwrap().unwrap();
    let time = |line: &str| line.split(',').nth(2).unwrap().parse::<f64>().unwrap();
    let offset = begin.elapsed().as_secs_f64() - time(&first);
    for line in lines {
        late = late.max(begin.elapsed().as_secs_f64() - offset - time(&line.unwrap()));
    }
    assert!(begin.elapsed() > Duration::from_millis(1300), "two seconds of film");
    assert!(late < 0.7, "{late} s");
    let ran: Ran = child.wait_with_output().unwrap().into();
    assert!(ran.ok().stderr.contains("live: "));
}

/// Key frames far apart, and frames that are coded before earlier ones: all come, in order.
#[test]
fn a_live_file_is_whole() {
    let frames = folder(45);
    let path = frames.path().join("clip.mp4");
    video(frames.path(), "-pix_fmt yuv420p -c:v libx264 -bf 3 -g 250", &path);
    let (_parent, out) = results();
    let words = ["run", "--live", "--speed", "1", "--rejection", "off", "--threads", "1", "--out"];
    let ran: Ran = command().args(words).arg(&out).arg(&path).output().unwrap().into();
    ran.ok();
    let record = json(&out.join("run.json"));
    assert_eq!((&record["input"]["pictures"], &record["input"]["start"]), (&45.into(), &0.into()));
    assert_eq!(record["frames"].as_u64().unwrap() + record["live"]["dropped"].as_u64().unwrap(), 45);
    for row in csv_rows(&out.join("detections.csv")) {
        assert!((row.time.unwrap() - row.frame as f64 / 30.0).abs() < 1e-6, "{row:?}");
    }
}

fn clip(frames: usize) -> (tempfile::TempDir, std::path::PathBuf) {
    let frames = folder(frames);
    let path = frames.path().join("clip.avi");
    video(frames.path(), "-pix_fmt gray -c:v ffv1", &path);
    (frames, path)
}

#[test]
fn without_ffmpeg() {
    let (_frames, path) = clip(3);
    let empty = programs(None);
    let ran: Ran = with_path(empty.path(), &["--out", "-"], &path).output().unwrap().into();
    let ran = ran.fails(1, &["reading", "clip.avi", "needs the program ffprobe", "not on the PATH"]);
    for way in ["apt-get install ffmpeg", "brew install ffmpeg", "winget install ffmpeg"] {
        assert!(ran.stderr.contains(way), "{}", ran.stderr);
    }
    let half = programs(Some("exit 0"));
    fs::remove_file(half.path().join("ffmpeg")).unwrap();
    let ran: Ran = with_path(half.path(), &["--out", "-"], &path).output().unwrap().into();
    ran.fails(1, &["needs the program ffmpeg"]);
    // Standard input needs none.
    let (_parent, out) = results();
    let mut run = with_path(empty.path(), &["--raw", "64x64", "--out"], &out);
    let file = empty.path().join("raw");
    fs::write(&file, vec![9; 3 * 64 * 64]).unwrap();
    let ran: Ran = run.arg("-").stdin(fs::File::open(&file).unwrap()).output().unwrap().into();
    assert!(ran.ok().stderr.contains("3 frames"));
}

#[test]
fn a_killed_ffmpeg() {
    let (_frames, path) = clip(60);
    // Twelve frames and a half, then no more.
    let dying = programs(Some(r#""$REAL/ffmpeg" "$@" | head -c 76800; kill -9 $$"#));
    let (_parent, out) = results();
    let out = out.to_str().unwrap();
    let words = ["--speed", "1", "--rejection", "off", "--out", out];
    let ran: Ran = with_path(dying.path(), &words, &path).output().unwrap().into();
    ran.fails(1, &["cannot use frame 12 of", "clip.avi", "ffmpeg was killed by signal 9"]);
    let out = Path::new(out);
    assert_eq!(json(&out.join("run.json"))["frames"], 12);
    let expected = tempfile::tempdir().unwrap();
    let whole = expected.path().join("out");
    let ran: Ran = command()
        .arg("run")
        .args(&words[..4])
        .args(["--stop", "12", "--out"])
        .arg(&whole)
        .arg(&path)
        .output()
        .unwrap()
        .into();
    ran.ok();
    let rows = |out: &Path| fs::read_to_string(out.join("detections.csv")).unwrap();
    assert_eq!(rows(out), rows(&whole));
    let failing = programs(Some("echo 'out of luck' >&2; exit 3"));
    let ran: Ran = with_path(failing.path(), &["--out", "-"], &path).output().unwrap().into();
    ran.fails(1, &["cannot use frame 0", "exit status 3", "out of luck"]);
}

/// Before 5.1 there was no -fps_mode.
#[test]
fn an_old_ffmpeg() {
    let (_frames, path) = clip(20);
    let old = programs(Some(
        r#"case "$*" in *-fps_mode*) echo "Unrecognized option 'fps_mode'." >&2; exit 1;; esac
echo "$*" > "$HERE/words"; exec "$REAL/ffmpeg" "$@""#,
    ));
    let run = |mut command: Command| Ran::from(command.output().unwrap()).ok().stdout;
    let words = ["--speed", "1", "--rejection", "off", "--out", "-"];
    let rows = run(with_path(old.path(), &words, &path));
    let mut now = command();
    now.arg("run").args(words).arg(&path);
    assert_eq!(rows, run(now));
    assert!(rows.lines().count() > 5);
    assert!(fs::read_to_string(old.path().join("words")).unwrap().contains("-vsync 0"));
}

/// Every line of what ffmpeg says is read, however much it is.
#[test]
fn a_talkative_ffmpeg() {
    let (_frames, path) = clip(10);
    let loud = programs(Some(
        r#"i=0; while [ $i -lt 20000 ]; do echo "[info] nothing of interest, $i" >&2; i=$((i+1)); done; exec "$REAL/ffmpeg" "$@""#,
    ));
    let ran: Ran = with_path(loud.path(), &["--out", "-"], &path).output().unwrap().into();
    assert!(ran.ok().stderr.contains("10 frames"));
}

/// Ctrl-C while waiting for a frame that does not come: at once, with complete files, and nothing goes on behind us.
#[test]
fn ctrl_c_ends_a_silent_stream() {
    let (_frames, path) = clip(60);
    let silent = programs(Some(r#"echo $$ > "$HERE/pid"; "$REAL/ffmpeg" "$@" | head -c 184320; exec sleep 600"#));
    for live in ["yes", "no"] {
        let (_parent, out) = results();
        let words = ["--speed", "1", "--rejection", "off", &format!("--live={live}"), "--out", out.to_str().unwrap()];
        let child = with_path(silent.path(), &words, &path).stderr(Stdio::piped()).spawn().unwrap();
        let begin = Instant::now();
        let table = out.join("detections.csv");
        while fs::read_to_string(&table).map_or(0, |text| text.lines().count()) < 3 {
            assert!(begin.elapsed() < Duration::from_secs(60), "no rows came");
            std::thread::sleep(Duration::from_millis(20));
        }
        let asked = Instant::now();
        assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
        let ran: Ran = child.wait_with_output().unwrap().into();
        assert_eq!(ran.code, 130, "{}", ran.stderr);
        assert!(asked.elapsed() < Duration::from_secs(5), "{:?}", asked.elapsed());
        let record = json(&out.join("run.json"));
        assert_eq!((&record["interrupted"], &record["error"]), (&true.into(), &serde_json::Value::Null));
        let pid = fs::read_to_string(silent.path().join("pid")).unwrap();
        assert!(!alive(pid.trim()), "ffmpeg goes on");
    }
}

/// The same where standard input stays silent.
#[test]
fn ctrl_c_ends_a_silent_pipe() {
    let (_parent, out) = results();
    let mut child = command()
        // Rows that do not wait for what follows: that the file is there tells that the program waits for more.
        .args(["run", "-", "--raw", "96x64", "--false-alarms", "off", "--out"])
        .arg(&out)
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(&[100; 3 * 96 * 64]).unwrap();
    let begin = Instant::now();
    while !out.join("detections.csv").exists() {
        assert!(begin.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let ran: Ran = child.wait_with_output().unwrap().into();
    assert_eq!(ran.code, 130, "{}", ran.stderr);
    drop(stdin);
}

fn alive(pid: &str) -> bool {
    Command::new("kill").args(["-0", pid]).stderr(Stdio::null()).status().unwrap().success()
}

/// A camera that is not there, and one behind an address with a password, which nobody gets to see.
#[test]
fn cameras_that_do_not_answer() {
    let run = |words: &[&str]| -> Ran { command().arg("run").args(words).output().unwrap().into() };
    run(&["/dev/video99"]).fails(1, &["cannot read /dev/video99", "No such file"]);
    let ran = run(&["rtsp://me:s3cret@127.0.0.1:9/x"]).fails(1, &["cannot read rtsp://127.0.0.1:9/x", "refused"]);
    assert!(!ran.stderr.contains("s3cret"));
    run(&["http://127.0.0.1:9/x.mp4"]).fails(1, &["cannot read http://127.0.0.1:9/x.mp4", "refused"]);
    run(&["/dev/video99", "--fps", "30"]).fails(2, &["--fps", "/dev/video99"]);
    let frames = folder(3);
    run(&[frames.path().to_str().unwrap(), "--live"]).fails(2, &["--live", "pictures"]);
}

/// Frames that come so slowly that they pass 2^32 milliseconds, and enough of them that memory would show if it grew; of a
/// million, see `make long`.
#[cfg(target_os = "linux")]
#[test]
fn a_long_stream() {
    const FRAMES: u64 = 5000;
    const SECONDS: u64 = 1000;
    let (_parent, out) = results();
    let words = ["run", "-", "--raw", "32x24", "--speed", "1", "--threads", "1", "--quiet", "--fps", "0.001", "--out"];
    let mut child = command().args(words).arg(&out).stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let resident = |process: u32| {
        let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap().trim();
        line.trim_end_matches(" kB").parse::<u64>().unwrap()
    };
    let mut memory = Vec::new();
    for frame in 0..FRAMES {
        let at = frame % 60;
        let picture: Vec<u8> = (0..32 * 24u64)
            .map(|i| {
                if (i % 32 + 10).abs_diff(at) < 3 && (i / 32).abs_diff(12) < 3 {
                    20
                } else {
                    200 + (i * frame % 7) as u8
                }
            })
            .collect();
        stdin.write_all(&picture).unwrap();
        if (frame + 1).is_multiple_of(FRAMES / 5) {
            memory.push(resident(child.id()));
        }
    }
    drop(stdin);
    Ran::from(child.wait_with_output().unwrap()).ok();
    assert!(memory[4] < memory[0] + 2048, "kB: {memory:?}");
    for table in ["detections.csv", "camera.csv", "tracks.csv"] {
        let mut rows = csv::Reader::from_path(out.join(table)).unwrap();
        let column = |name: &str, rows: &mut csv::Reader<fs::File>| {
            rows.headers().unwrap().iter().position(|c| c == name).unwrap()
        };
        let (frame, time) = (column("frame", &mut rows), column("time_s", &mut rows));
        let mut last = 0;
        for row in rows.records() {
            let row = row.unwrap();
            let (frame, time): (u64, f64) = (row[frame].parse().unwrap(), row[time].parse().unwrap());
            assert_eq!(time, (frame * SECONDS) as f64, "{table}");
            last = last.max(frame);
        }
        assert!(last * SECONDS * 1000 > 1 << 32, "{table} ends with frame {last}");
    }
}
