//! `--video` and `--report`: files that are to be looked at, decoded and read again.
#![cfg(unix)]

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{
    HEIGHT, ROW, Ran, WIDTH, apgstmd, column, command, csv_rows, ffmpeg, folder, json, page_data, picture, piped,
    programs, results, with_path,
};

const LINE: &str = "run {in} --out {out} --speed 1 --rejection off";
/// Canvas pixels a picture pixel: small frames are enlarged.
const SCALE: usize = 6;

struct Decoded {
    width: usize,
    height: usize,
    rate: String,
    codec: String,
    frames: Vec<Vec<u8>>,
}

/// A video as ffmpeg sees it.
fn decode(path: &Path) -> Decoded {
    let entries = "stream=codec_name,width,height,r_frame_rate,pix_fmt";
    let output = Command::new("ffprobe")
        .args(["-v", "error", "-select_streams", "v:0", "-show_entries", entries, "-of", "default=nw=1"])
        .arg(path)
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let value = |key: &str| {
        let line = text.lines().find_map(|line| line.strip_prefix(&format!("{key}=")));
        line.unwrap_or_else(|| panic!("no {key} in {text}")).to_owned()
    };
    assert_eq!(value("pix_fmt"), "yuv420p");
    let (width, height): (usize, usize) = (value("width").parse().unwrap(), value("height").parse().unwrap());
    let words = ["-i", path.to_str().unwrap(), "-fps_mode", "passthrough", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"];
    let bytes = ffmpeg(words);
    assert_eq!(bytes.len() % (3 * width * height), 0);
    let frames = bytes.chunks_exact(3 * width * height).map(<[u8]>::to_vec).collect();
    Decoded { width, height, rate: value("r_frame_rate"), codec: value("codec_name"), frames }
}

impl Decoded {
    /// How far the colours of a pixel are apart, and its mean.
    fn pixel(&self, frame: usize, x: f64, y: f64) -> (f64, f64) {
        let at = 3 * (y.floor() as usize * self.width + x.floor() as usize);
        let pixel: Vec<f64> = self.frames[frame][at..at + 3].iter().map(|c| f64::from(*c)).collect();
        let (low, high) = (pixel.iter().copied().fold(255.0, f64::min), pixel.iter().copied().fold(0.0, f64::max));
        (high - low, pixel.iter().sum::<f64>() / 3.0)
    }

    /// Mean colourfulness along a circle around the truth, `radius` in pixels of the picture.
    fn colour(&self, frame: usize, radius: f64) -> f64 {
        let (cx, cy) = ((column(frame) + 0.5) * SCALE as f64, (ROW + 0.5) * SCALE as f64);
        let round = |k: usize| {
            let angle = k as f64 * std::f64::consts::TAU / 360.0;
            let radius = radius * SCALE as f64;
            self.pixel(frame, cx + radius * angle.cos(), cy + radius * angle.sin()).0
        };
        (0..360).map(round).sum::<f64>() / 360.0
    }
}

/// As many frames as there were, enlarged, with a ring around the target and nothing upon it.
#[test]
fn rings_leave_targets_visible() {
    let frames = folder(40);
    let (parent, out) = results();
    let file = parent.path().join("found.mp4");
    let line = format!("{LINE} --fps 30 --video {}", file.display());
    let ran = apgstmd(&line, frames.path(), &out).ok();
    assert!(ran.stderr.contains("found.mp4"), "{}", ran.stderr);
    let video = decode(&file);
    assert_eq!((video.frames.len(), video.rate.as_str(), video.codec.as_str()), (40, "30/1", "h264"));
    assert_eq!(video.width, WIDTH as usize * SCALE);
    assert!(video.height > HEIGHT as usize * SCALE && video.height.is_multiple_of(2));
    for frame in [25, 32, 38] {
        // A detection may be a pixel off the truth: the ring is looked for around where it should be.
        let ring = [7.0, 7.5, 8.0, 8.5, 9.0].map(|radius| video.colour(frame, radius)).into_iter().fold(0.0, f64::max);
        let (target, clear) = (video.colour(frame, 1.0), video.colour(frame, 5.0));
        assert!(ring > 20.0 && target < 8.0 && clear < 8.0, "frame {frame}: {ring} {target} {clear}");
        let (cx, cy) = ((column(frame) + 0.5) * SCALE as f64, (ROW + 0.5) * SCALE as f64);
        assert!(video.pixel(frame, cx, cy).1 < 50.0, "the target is dark, as it was");
        // Its way lies behind it: to the left.
        let trail = (12..16).map(|back| video.pixel(frame, cx - (back * SCALE) as f64, cy)).map(|(colour, _)| colour);
        assert!(trail.fold(0.0, f64::max) > 30.0, "frame {frame} has no trail");
    }
    assert!(video.colour(2, 8.0) < 8.0, "nothing is known in the third frame");
    assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 2, "no half files stay");
}

/// The border of the region: a thin line on every picture, the video and the page, and nothing upon a target that it goes through.
#[test]
fn the_border_of_a_region() {
    let frames = folder(40);
    let edge = 34 * SCALE;
    let run = |flags: &str| {
        let (parent, out) = results();
        let line = format!("{LINE} --overlay --video {{out}}.mkv --report {{out}}.html {flags}");
        apgstmd(&line, frames.path(), &out).ok();
        let overlay = image::open(out.join("overlay/f_38.png")).unwrap().into_rgb8();
        assert_eq!(csv_rows(&out.join("detections.csv")).iter().filter(|row| row.frame == 38).count(), 1);
        let page = page_data(&out.with_extension("html"));
        (overlay, decode(&out.with_extension("mkv")), page, parent)
    };
    let (free, video_free, page_free, _a) = run("");
    let (bound, video_bound, page_bound, _b) = run("--roi 96x34+0+0");
    let (cx, cy) = ((column(38) + 0.5) * SCALE as f64, (ROW + 0.5) * SCALE as f64);
    let mut lines = [0, 0];
    // To the left there are detections of the first frames, in which what is outside has its part.
    let width = WIDTH as usize * SCALE;
    for (x, y, pixel) in bound.enumerate_pixels().filter(|(x, ..)| *x as usize > width / 3) {
        let before = free.get_pixel(x, y);
        let difference = f64::from(pixel.0[1]) - f64::from(before.0[1]);
        let (dx, dy) = (f64::from(x) + 0.5 - cx, f64::from(y) + 0.5 - cy);
        match y as usize + 1 {
            _ if dx.hypot(dy) < 7.0 * SCALE as f64 => assert_eq!(pixel, before, "({x}, {y}) is at the target"),
            row if row == edge => lines[0] += usize::from(difference > 4.0),
            row if row == edge + 1 => lines[1] += usize::from(difference < -40.0),
            _ => assert_eq!(pixel, before, "({x}, {y})"),
        }
    }
    // But for the ring.
    assert!(lines.iter().all(|line| *line > 2 * width / 3 - 110), "{lines:?}");
    let dark = |video: &Decoded, x: f64| video.pixel(38, x, edge as f64).1;
    for x in [40.0, 100.0, 540.0] {
        assert!(dark(&video_bound, x) < dark(&video_free, x) - 25.0, "{x}");
    }
    assert!(page_free.1["outline"].is_null() && !page_free.0.contains("within the thin line"));
    assert_eq!(page_bound.1["outline"], serde_json::json!([[0, 34, 96, 34]]));
    assert!(page_bound.0.contains("within the thin line only, in 53.1 % of the picture"));
}

/// The response is bright at the target and dark far from it.
#[test]
fn the_response_beside_it() {
    let frames = folder(36);
    let (parent, out) = results();
    let file = parent.path().join("both.mkv");
    let line = format!("{LINE} --fps 29.97 --video {} --video-response", file.display());
    apgstmd(&line, frames.path(), &out).ok();
    let video = decode(&file);
    assert_eq!((video.frames.len(), video.rate.as_str(), video.codec.as_str()), (36, "2997/100", "h264"));
    let right = WIDTH as usize * SCALE + 4;
    assert_eq!(video.width, right + WIDTH as usize * SCALE);
    let bright = |x: f64| {
        let level =
            |dx: i32| video.pixel(34, right as f64 + (x + f64::from(dx)) * SCALE as f64, ROW * SCALE as f64 + 3.0).1;
        (-6..=6).map(level).fold(0.0, f64::max)
    };
    assert!(bright(column(34)) > 120.0 && bright(85.0) < 60.0, "{} {}", bright(column(34)), bright(85.0));
}

/// Rates of sources that tell none, gaps, slow motion, a single frame.
#[test]
fn rates_and_times() {
    let raw: Vec<u8> = (0..12).flat_map(|frame| picture(frame).into_raw()).collect();
    let one = raw[..(WIDTH * HEIGHT) as usize].to_vec();
    let y4m = {
        let head = b"YUV4MPEG2 W96 H64 F10:1 Ip A1:1 Cmono\n".to_vec();
        raw.chunks((WIDTH * HEIGHT) as usize).fold(head, |mut all, frame| {
            all.extend(b"FRAME\n");
            all.extend(frame);
            all
        })
    };
    for (flags, bytes, rate, frames) in [
        ("--raw 96x64", &raw, "25/1", 12),
        ("--raw 96x64 --fps 1000", &raw, "30/1", 12),
        ("--raw 96x64 --fps 30 --step 3", &raw, "10/1", 4),
        ("--raw 96x64", &one, "25/1", 1),
        ("", &y4m, "10/1", 12),
    ] {
        let (parent, out) = results();
        let file = parent.path().join("found.mov");
        piped(&format!("run - --out {{out}} --speed 1 {flags} --video {}", file.display()), bytes, &out).ok();
        let video = decode(&file);
        assert_eq!((video.rate.as_str(), video.frames.len()), (rate, frames), "{flags}");
    }
    // A frame whose successor is late is shown until it comes.
    let frames = folder(10);
    let clip = frames.path().join("gap.mkv");
    crate::common::video(frames.path(), "-vf setpts=PTS+gte(N\\,5)*0.2/TB -fps_mode passthrough -c:v ffv1", &clip);
    let (parent, out) = results();
    let file = parent.path().join("found.mp4");
    apgstmd(&format!("{LINE} --video {}", file.display()), &clip, &out).ok();
    let video = decode(&file);
    assert_eq!((video.rate.as_str(), video.frames.len()), ("30/1", 16));
    assert_eq!(csv_rows(&out.join("detections.csv")).iter().map(|row| row.frame).max(), Some(9));
}

/// What cannot be is said before anything is computed.
#[test]
fn names_that_cannot_be() {
    let frames = folder(3);
    let (parent, out) = results();
    let run = |flags: &str| apgstmd(&format!("{LINE} {flags}"), frames.path(), &out);
    run("--video found.avi").fails(2, &["--video found.avi", ".mp4", ".mkv"]);
    run("--video-response").fails(2, &["--video"]);
    let there = parent.path().join("there.mp4");
    fs::write(&there, "mine").unwrap();
    run(&format!("--video {}", there.display())).fails(1, &["there.mp4", "is there already"]);
    run(&format!("--report {0} --mot {0}", parent.path().join("x").display()))
        .fails(2, &["--mot and --report are both"]);
    run("--report {out}/run.json").fails(2, &["run.json is another result's name"]);
    for flag in [
        "--report /nowhere/at/all.html",
        "--video /nowhere/at/all.mp4",
        "--mot /nowhere/at/all",
        "--coco /nowhere/at/all",
    ] {
        run(flag).fails(1, &["cannot write /nowhere/at/all", "no folder /nowhere/at"]);
    }
    run("--report {out}/deeper/all.html").fails(1, &["all.html", "there is no folder"]);
    assert!(!out.exists(), "nothing was begun");
    run("--video {out}/./all.mp4 --report {out}/all.mp4").fails(2, &["--video and --report are both"]);
    // The folder of results itself need not be there.
    run("--report {out}/all.html --video {out}/all.mp4 --mot {out}/all.txt --coco {out}/all.json").ok();
    assert!(["html", "mp4", "txt", "json"].iter().all(|kind| out.join("all").with_extension(kind).is_file()));
    fs::remove_dir_all(&out).unwrap();
    assert_eq!(fs::read_to_string(&there).unwrap(), "mine");
    run(&format!("--video {} --force", there.display())).ok();
    assert_eq!(decode(&there).frames.len(), 3);
}

fn with_ffmpeg(script: Option<&str>, frames: &Path, file: &Path, out: &Path) -> Ran {
    let folder = programs(script);
    let words =
        ["--speed", "1", "--rejection", "off", "--video", file.to_str().unwrap(), "--out", out.to_str().unwrap()];
    with_path(folder.path(), &words, frames).output().unwrap().into()
}

#[test]
fn an_ffmpeg_that_is_missing_or_has_other_encoders() {
    let frames = folder(30);
    let (parent, out) = results();
    let file = parent.path().join("found.mp4");
    let ran = with_ffmpeg(None, frames.path(), &file, &out).fails(1, &["--video needs the program ffmpeg"]);
    assert!(ran.stderr.contains("apt-get install ffmpeg"), "{}", ran.stderr);
    let without = |names: &str| {
        format!(
            r#"case "$*" in *-encoders*) "$REAL/ffmpeg" "$@" | grep -v -E '{names}';; *) exec "$REAL/ffmpeg" "$@";; esac"#
        )
    };
    let none = without("libx264|libopenh264|mpeg4");
    with_ffmpeg(Some(&none), frames.path(), &file, &out).fails(1, &["encoders libx264, libopenh264, mpeg4"]);
    assert!(!out.exists(), "nothing was begun");
    with_ffmpeg(Some(&without("libx264|libopenh264")), frames.path(), &file, &out).ok();
    let video = decode(&file);
    assert_eq!((video.codec.as_str(), video.frames.len()), ("mpeg4", 30));
}

/// Killed, or no room on the disk: an error that says so, no half video, and the tables whole up to there.
#[test]
fn an_ffmpeg_that_fails() {
    let frames = folder(40);
    let whole = {
        let (_parent, out) = results();
        apgstmd(LINE, frames.path(), &out).ok();
        csv_rows(&out.join("detections.csv"))
    };
    let fails = |end: &str, said: &str| {
        let (parent, out) = results();
        let file = parent.path().join("found.mp4");
        let script = format!(
            r#"case "$*" in *-encoders*) exec "$REAL/ffmpeg" "$@";; *) head -c 3000000 > /dev/null; {end};; esac"#
        );
        with_ffmpeg(Some(&script), frames.path(), &file, &out).fails(1, &["--video", said]);
        let rows = csv_rows(&out.join("detections.csv"));
        assert_eq!(rows, whole[..rows.len()]);
        let record = json(&out.join("run.json"));
        assert!(record["error"].as_str().unwrap().contains(said), "{}", record["error"]);
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 1, "no half video stays");
    };
    fails("kill -9 $$", "killed by signal 9");
    fails(
        "echo '[out#0/mp4 @ 0x1] [error] Error writing: No space left on device' >&2; exit 228",
        "No space left on device",
    );
    fails("cat > /dev/null; exit 1", "exit status 1");
}

/// A stream that does not end by itself: Ctrl-C leaves a video and a page that are whole.
#[test]
fn interrupted_files_are_whole() {
    let (parent, out) = results();
    let (video, page) = (parent.path().join("found.mp4"), parent.path().join("found.html"));
    let mut child = command()
        .args(["run", "-", "--raw", "96x64", "--fps", "30", "--speed", "1", "--rejection", "off", "--live", "--out"])
        .arg(&out)
        .arg("--video")
        .arg(&video)
        .arg("--report")
        .arg(&page)
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let begin = Instant::now();
    let rows = || fs::read_to_string(out.join("detections.csv")).map_or(0, |text| text.lines().count());
    for frame in 0.. {
        assert!(begin.elapsed() < Duration::from_secs(60), "no rows came");
        stdin.write_all(&picture(frame % 60).into_raw()).unwrap();
        std::thread::sleep(Duration::from_millis(15));
        if rows() > 10 {
            break;
        }
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    let record = json(&out.join("run.json"));
    // Frames that were dropped are bridged by the one before.
    assert!(decode(&video).frames.len() >= record["frames"].as_u64().unwrap() as usize);
    let text = fs::read_to_string(&page).unwrap();
    assert!(text.ends_with("</html>") && text.contains("The run was interrupted"));
}

/// All that was found is in the page, for each frame; names are data and nothing else.
#[test]
fn a_page_holds_what_was_found() {
    let frames = folder(40);
    let (parent, out) = results();
    let odd = parent.path().join("<script>alert(1)<!-- \"'&amp;");
    fs::rename(frames.path(), &odd).unwrap();
    let page = parent.path().join("found.html");
    apgstmd_with(&odd, &out, &["--fps", "30", "--report", page.to_str().unwrap()]).ok();
    let (text, data) = page_data(&page);
    assert_eq!(text.matches("<script").count(), 2, "the data and the program");
    assert!(!text.contains("<script>alert") && !text.contains("<!--"));
    assert!(
        !text.contains("http:") || text.matches("http:").count() == text.matches("http://www.w3.org/2000/svg").count()
    );
    assert!(data["title"].as_str().unwrap().contains("<script>alert(1)<!-- \"'&amp;"));
    let rows = csv_rows(&out.join("detections.csv"));
    let columns = &data["frames"];
    assert_eq!((columns["frame"].as_array().unwrap().len(), columns["every"].as_u64()), (40, Some(1)));
    assert_eq!(columns["x"].as_array().unwrap().len(), rows.len());
    for (index, row) in rows.iter().enumerate() {
        assert!((columns["x"][index].as_f64().unwrap() - row.x).abs() < 0.051, "{row:?}");
        let from = |frame: usize| columns["from"][frame].as_u64().unwrap() as usize;
        assert!((from(row.frame)..from(row.frame + 1)).contains(&index));
    }
    assert_eq!(data["thumbnails"]["frame"].as_array().unwrap().len(), 40);
    let record = json(&out.join("run.json"));
    assert_eq!(data["tracks"].as_array().unwrap().len() as u64, record["found"]["tracks"].as_u64().unwrap());
    assert!(record["stage_seconds_per_frame"]["lobula"].as_f64().unwrap() > 0.0);
    assert!(text.contains("<th scope=\"row\">lobula</th>"));
}

fn apgstmd_with(input: &Path, out: &Path, words: &[&str]) -> Ran {
    let mut run = command();
    run.args(["run", "--speed", "1", "--rejection", "off", "--out"]).arg(out).args(words).arg(input);
    run.output().unwrap().into()
}

/// What is wrong with the footage is told in run.json, on the terminal and on the page.
#[test]
fn warnings_are_told() {
    let frames = tempfile::tempdir().unwrap();
    for frame in 0..40 {
        picture(frame / 2).save(frames.path().join(format!("f_{frame}.png"))).unwrap();
    }
    let (parent, out) = results();
    let page = parent.path().join("found.html");
    let ran = apgstmd_with(frames.path(), &out, &["--report", page.to_str().unwrap()]).ok();
    let warning = "20 of 40 frames are identical to the one before (50 %)";
    assert!(ran.stderr.contains(&format!("warning: {warning}")) && ran.stderr.contains("--step 2"), "{}", ran.stderr);
    let record = json(&out.join("run.json"));
    assert_eq!(record["warnings"][0]["about"], "duplicates");
    assert!(record["warnings"][0]["advice"].as_str().unwrap().contains("--step 2"));
    assert!(page_data(&page).0.contains(warning));
    // Twice as fast as the detector is tuned to, and more.
    for frame in 0..30 {
        picture(2 * frame).save(frames.path().join(format!("f_{frame}.png"))).unwrap();
    }
    let ran = apgstmd_with(frames.path(), &out, &["--stop", "30", "--force"]).ok();
    assert!(
        ran.stderr.contains("warning: tracks move about 2.0 px/frame, but detectors are tuned to 1.0"),
        "{}",
        ran.stderr
    );
    assert_eq!(json(&out.join("run.json"))["warnings"][0]["about"], "fast");
}
