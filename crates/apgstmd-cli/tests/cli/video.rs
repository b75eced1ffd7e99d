//! Video through ffmpeg and standard input: the same rows as from pictures, and whatever can be wrong with a file.

use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{HEIGHT, Ran, Row, WIDTH, apgstmd, command, csv_rows, ffmpeg, json, piped, results, video};
use image::{ImageBuffer, Luma};
use tempfile::TempDir;

const LINE: &str = "--speed 1 --rejection off --threshold 1e-12";

/// Rows without the names of frames, and run.json.
fn rows(line: &str, input: &Path) -> (Vec<Row>, serde_json::Value) {
    let (_parent, out) = results();
    apgstmd(&format!("run {{in}} --out {{out}} {LINE} {line}"), input, &out).ok();
    read(&out)
}

fn piped_rows(line: &str, bytes: &[u8]) -> (Vec<Row>, serde_json::Value) {
    let (_parent, out) = results();
    piped(&format!("run - --out {{out}} {LINE} {line}"), bytes, &out).ok();
    read(&out)
}

fn read(out: &Path) -> (Vec<Row>, serde_json::Value) {
    let rows = csv_rows(&out.join("detections.csv")).into_iter().map(|row| Row { name: String::new(), ..row });
    (rows.collect(), json(&out.join("run.json")))
}

fn run(input: &Path, flags: &str) -> Ran {
    let (_parent, out) = results();
    apgstmd(&format!("run {{in}} --out {{out}} --speed 1 {flags}"), input, &out)
}

/// A dark square before a texture that drifts by a pixel every other frame: many detections, which have to agree.
fn textured(frame: usize) -> image::GrayImage {
    let mut picture = crate::common::picture(frame);
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        let x = (x + frame as u32 / 2).wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b);
        pixel.0[0] = pixel.0[0] / 2 + ((x ^ (x >> 15)).wrapping_mul(0x2c1b_3c6d) >> 24) as u8 / 3;
    }
    picture
}

fn clip(count: usize, words: &str, name: &str) -> (TempDir, PathBuf) {
    let frames = tempfile::tempdir().unwrap();
    for frame in 0..count {
        textured(frame).save(frames.path().join(format!("f_{frame}.png"))).unwrap();
    }
    let path = frames.path().join(name);
    video(frames.path(), words, &path);
    (frames, path)
}

/// A dark square before a pattern that uses every bit of its samples.
fn deep(frame: usize, bits: u32) -> ImageBuffer<Luma<u16>, Vec<u16>> {
    let most = (1u32 << bits) - 1;
    ImageBuffer::from_fn(WIDTH, HEIGHT, |x, y| {
        let inside = (f64::from(x) - crate::common::column(frame)).abs() < 3.0
            && (f64::from(y) - crate::common::ROW).abs() < 3.0;
        let level = if inside { most / 10 } else { most / 2 };
        let grain = (x + frame as u32 / 2).wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b);
        Luma([(level + (grain ^ (grain >> 15)).wrapping_mul(0x2c1b_3c6d) % (most / 3)) as u16])
    })
}

/// The same clip from a folder, a lossless video, and both forms of standard input.
#[test]
fn every_source_gives_the_same_rows() {
    let (frames, path) = clip(40, "-pix_fmt gray -c:v ffv1", "clip.avi");
    let (pictures, _) = rows("--fps 30", frames.path());
    assert!(pictures.len() > 50 && pictures.iter().all(|row| row.time.is_some()));
    let (file, record) = rows("", &path);
    assert_eq!(file, pictures);
    assert_eq!((&record["frames"], &record["input"]["pictures"]), (&40.into(), &40.into()));
    assert_eq!((&record["input"]["fps"], &record["input"]["stop"]), (&30.0.into(), &40.into()));
    let input = ["-i", path.to_str().unwrap()];
    let (y4m, record) = piped_rows("", &ffmpeg(input.into_iter().chain(["-f", "yuv4mpegpipe", "-strict", "-1", "-"])));
    assert_eq!(y4m, pictures);
    assert_eq!(record["frames"], 40);
    let raw = ffmpeg(input.into_iter().chain(["-f", "rawvideo", "-"]));
    assert_eq!(raw.len(), 40 * (WIDTH * HEIGHT) as usize);
    assert_eq!(piped_rows("--raw 96x64 --fps 30", &raw).0, pictures);
    assert!(piped_rows("--raw 96x64", &raw).0.iter().all(|row| row.time.is_none()));
}

/// Ten to sixteen bits keep all of them.
#[test]
fn deep_samples_give_the_same_rows() {
    for bits in [16, 12, 10] {
        let frames = tempfile::tempdir().unwrap();
        let mut raw = Vec::new();
        for frame in 0..30 {
            let picture = deep(frame, bits);
            raw.extend(picture.as_raw().iter().flat_map(|sample| sample.to_le_bytes()));
            picture.save(frames.path().join(format!("f_{frame}.png"))).unwrap();
        }
        let depth = if bits == 16 { String::new() } else { format!("--bit-depth {bits}") };
        let (pictures, _) = rows(&format!("--fps 25 {depth}"), frames.path());
        assert!(pictures.len() > 50);
        let format = format!("gray{bits}le");
        let (_, record) = piped_rows(&format!("--raw 96x64:{format} --fps 25"), &raw);
        assert_eq!(record["frames"], 30);
        assert_eq!(piped_rows(&format!("--raw 96x64:{format} --fps 25"), &raw).0, pictures, "raw {bits}");
        let source = frames.path().join("raw");
        fs::write(&source, &raw).unwrap();
        let video = frames.path().join("clip.nut");
        let words = ["-f", "rawvideo", "-s", "96x64", "-r", "25", "-pix_fmt", &format, "-i", source.to_str().unwrap()];
        ffmpeg(words.into_iter().chain(["-c:v", "ffv1", "-strict", "-2", video.to_str().unwrap()]));
        assert_eq!(rows("", &video).0, pictures, "ffv1 {bits}");
        let y4m = ffmpeg(words.into_iter().chain(["-f", "yuv4mpegpipe", "-strict", "-1", "-"]));
        assert_eq!(piped_rows("", &y4m).0, pictures, "y4m {bits}");
        if bits == 16 {
            // What a camera of 16 bits leaves unused is said as for pictures.
            let (high, _) = rows("--fps 25 --bit-depth 16", frames.path());
            assert_eq!(high, pictures);
        }
    }
}

/// Luminance of a picture of one level, as the model sees it.
fn level(words: &str, y: u16, name: &str) -> f32 {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join(name);
    let source = format!("color=size=64x48:rate=10:duration=0.3,format=yuv420p,geq=lum={y}:cb=128:cr=128");
    let words = words.split_whitespace();
    ffmpeg(["-f", "lavfi", "-i", &source].into_iter().chain(words).chain([path.to_str().unwrap()]));
    let out = parent.path().join("out");
    apgstmd("run {in} --out {out} --dump P --dump-frames 2", &path, &out).ok();
    let bytes = fs::read(out.join("dump/P_000002.npy")).unwrap();
    let middle = bytes.len() - 4 * (24 * 64 + 32);
    f32::from_le_bytes(bytes[middle..middle + 4].try_into().unwrap())
}

#[test]
fn luma_of_either_range() {
    for y in [16, 17, 60, 126, 235] {
        let limited = f32::from(y - 16) / 219.0;
        let full = f32::from(y) / 255.0;
        for (words, expected, name) in [
            ("-c:v ffv1", limited, "limited.mkv"),
            ("-c:v ffv1 -color_range pc", full, "full.mkv"),
            ("-c:v libx264 -qp 0", limited, "x264.mp4"),
        ] {
            let seen = level(words, y, name);
            assert!((seen - expected).abs() < 2e-6, "{words} {y}: {seen} is not {expected}");
        }
    }
}

#[test]
fn colour_video_is_as_colour_pictures() {
    let frames = tempfile::tempdir().unwrap();
    for frame in 0..24 {
        let grey = textured(frame);
        let colour = image::RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
            image::Rgb([grey.get_pixel(x, y).0[0], (x * 2) as u8, grey.get_pixel(x, y).0[0] / 2])
        });
        colour.save(frames.path().join(format!("f_{frame}.png"))).unwrap();
    }
    let path = frames.path().join("clip.avi");
    video(frames.path(), "-pix_fmt bgr0 -c:v ffv1", &path);
    let (pictures, _) = rows("--fps 30", frames.path());
    assert!(pictures.len() > 50);
    assert_eq!(rows("", &path).0, pictures);
}

/// A lossy clip and its copy on standard input: the Y plane of both.
#[test]
fn a_lossy_clip_is_its_own_y4m() {
    let (_frames, path) = clip(40, "-pix_fmt yuv420p -c:v libx264", "clip.mp4");
    let (file, _) = rows("", &path);
    assert!(file.len() > 50);
    let y4m = ffmpeg(["-i", path.to_str().unwrap(), "-f", "yuv4mpegpipe", "-"]);
    assert_eq!(piped_rows("", &y4m).0, file);
}

#[test]
fn times_of_a_variable_rate() {
    let late = "setpts='(N+gte(N,10)*7+gte(N,20)*N)/30/TB'";
    let (_frames, path) = clip(36, &format!("-vf {late} -vsync 0 -pix_fmt gray -c:v ffv1"), "clip.mkv");
    let time = |frame: usize| {
        let late = if frame >= 10 { 7 } else { 0 } + if frame >= 20 { frame } else { 0 };
        (frame + late) as f64 / 30.0
    };
    let (rows_, record) = rows("", &path);
    assert_eq!(record["frames"], 36);
    let mut seen = 0;
    for row in &rows_ {
        // This container keeps milliseconds.
        assert!((row.time.unwrap() - time(row.frame)).abs() < 6e-4, "{row:?} {}", time(row.frame));
        seen = seen.max(row.frame);
    }
    assert_eq!(seen, 35);
    // From 1 s on, one each 0.2 s: frames 20, 23, 26, ... are 0.2 s apart, and 17 comes before 0.8 s.
    let (_, record) = rows("--start 1s --step 0.2s", &path);
    let expected: Vec<usize> = (20..36).step_by(3).collect();
    assert_eq!(record["frames"], expected.len());
    assert_eq!((&record["input"]["start"], &record["input"]["step"]), (&20.into(), &1.into()));
    assert_eq!(record["input"]["left_out"], "21..22,24..25,27..28,30..31,33..34");
}

/// Time stamps of a video past 2^32 milliseconds. (ffmpeg takes gaps of more than 30 hours for errors.)
#[test]
fn times_of_a_long_video() {
    let (_frames, path) = clip(48, "-vf setpts=N*(100000+1/30)/TB -vsync 0 -pix_fmt gray -c:v ffv1", "clip.mkv");
    let (rows, record) = rows("", &path);
    assert_eq!(record["frames"], 48);
    assert!(rows.iter().any(|row| row.time.unwrap() * 1e3 > 2f64.powi(32)));
    // This container keeps milliseconds.
    assert!(
        rows.iter().all(|row| (row.time.unwrap() - (100_000.0 + 1.0 / 30.0) * row.frame as f64).abs() < 6e-4),
        "{:?}",
        rows.last()
    );
}

/// Frames are as players show them, and as ffmpeg writes them to pictures.
#[test]
fn rotation_is_applied() {
    let (frames, upright) = clip(30, "-pix_fmt gray -c:v png", "clip.mov");
    let turned = frames.path().join("turned.mov");
    turn(&upright, &turned);
    let pictures = frames.path().join("turned");
    fs::create_dir(&pictures).unwrap();
    ffmpeg([Path::new("-i"), &turned, &pictures.join("f_%03d.png")]);
    let (expected, record) = rows("--fps 30", &pictures);
    assert_eq!((&record["size"]["height"], &record["size"]["width"]), (&WIDTH.into(), &HEIGHT.into()));
    assert!(expected.len() > 50);
    assert_eq!(rows("", &turned).0, expected);
}

/// By a quarter, without touching a sample. Versions of ffmpeg differ in how that is said.
fn turn(from: &Path, to: &Path) {
    let [from, to] = [from, to].map(|path| path.to_str().unwrap());
    let new = ["-display_rotation", "90", "-i", from, "-c", "copy", to];
    let old = ["-i", from, "-c", "copy", "-metadata:s:v", "rotate=90", to];
    let turned = |words: &[&str]| {
        let quiet = Command::new("ffmpeg").args(["-nostdin", "-loglevel", "quiet", "-y"]).args(words).status().unwrap();
        let probe = ["-v", "error", "-of", "json", "-show_streams", to];
        let told = Command::new("ffprobe").args(probe).output().unwrap();
        quiet.success() && String::from_utf8_lossy(&told.stdout).contains("rotation")
    };
    assert!(turned(&new) || turned(&old), "this ffmpeg turns nothing");
}

/// `--start --stop --step` mean the same everywhere.
#[test]
fn selections_agree() {
    let (frames, path) = clip(40, "-pix_fmt gray -c:v ffv1", "clip.avi");
    let file = path.to_str().unwrap();
    let y4m = ffmpeg(["-i", file, "-f", "yuv4mpegpipe", "-strict", "-1", "-"]);
    let raw = ffmpeg(["-i", file, "-f", "rawvideo", "-"]);
    for (flags, count) in [
        ("--start 3 --stop 37 --step 2", 17),
        ("--start 0.2s --stop 1.2s", 30),
        ("--start 5 --step 0.05s", 23),
        ("--stop 1s --step 0.1s", 10),
        ("--start 0.5s --step 3", 9),
        ("--start 39", 1),
    ] {
        let (pictures, expected) = rows(&format!("--fps 30 {flags}"), frames.path());
        assert_eq!(expected["frames"], count, "{flags}");
        for (rows, record) in
            [rows(flags, &path), piped_rows(flags, &y4m), piped_rows(&format!("--raw 96x64 --fps 30 {flags}"), &raw)]
        {
            assert_eq!(rows, pictures, "{flags}");
            for key in ["frames", "skipped"] {
                assert_eq!(record[key], expected[key], "{flags}");
            }
            for key in ["start", "step", "left_out"] {
                assert_eq!(record["input"][key], expected["input"][key], "{flags}");
            }
        }
    }
    let (_parent, out) = results();
    for flags in ["--start 40", "--start 2s"] {
        let place = flags.split(' ').next_back().unwrap();
        let parts = [place, "INPUT has 40", "0 to 39"];
        run(&path, flags).fails(2, &parts);
        run(frames.path(), &format!("--fps 30 {flags}")).fails(2, &parts);
        piped(&format!("run - --out {{out}} {flags}"), &y4m, &out).fails(2, &parts);
    }
    run(frames.path(), "--start 1s").fails(2, &["seconds", "times"]);
    piped("run - --out {out} --raw 96x64 --start 1s", &raw, &out).fails(2, &["seconds", "times"]);
    run(&path, "--start 2.5").fails(2, &["2.5", "2.5s"]);
}

/// The container says 30: who knows better says so.
#[test]
fn fps_in_place_of_a_wrong_rate() {
    let (_frames, path) = clip(30, "-pix_fmt gray -c:v ffv1", "clip.avi");
    let (rows, record) = rows("--fps 1000 --stop 0.02s", &path);
    assert_eq!((&record["frames"], &record["input"]["fps"]), (&20.into(), &1000.0.into()));
    assert!(!rows.is_empty() && rows.iter().all(|row| row.time == Some(row.frame as f64 / 1000.0)));
}

#[test]
fn names_are_literal() {
    let (frames, path) = clip(20, "-pix_fmt gray -c:v ffv1", "plain.avi");
    let (expected, _) = rows("", &path);
    let names = [
        "with blanks.avi",
        "it's \"quoted\".avi",
        "-leading.avi",
        "--help",
        "new\nline.avi",
        "p%03d.avi",
        "concat:a|b.avi",
        "pipe:0",
        "http:",
        "[x]*?.avi",
        "\u{4e2d}\u{6587}.avi",
        "a,b=c;d'e.avi",
        "{x}.avi",
        "no ending",
    ];
    for name in names {
        let file = frames.path().join(name);
        fs::copy(&path, &file).unwrap();
        let (_parent, out) = results();
        // As an argument of its own, and from its folder: a leading dash is then the first character.
        let output = command()
            .args(["run", "--out", out.to_str().unwrap()])
            .args(LINE.split(' '))
            .args(["--", name])
            .current_dir(frames.path())
            .output()
            .unwrap();
        let ran = Ran::from(output).ok();
        assert!(ran.stderr.contains("20 frames"), "{name}: {}", ran.stderr);
        assert_eq!(read_anyhow(&out), expected.len(), "{name}");
        fs::remove_file(file).unwrap();
    }
    run(Path::new("concat:a.avi|b.avi"), "").fails(1, &["there is no file or folder concat:a.avi|b.avi"]);
    run(Path::new("ftp://a/b.mp4"), "").fails(1, &["there is no file or folder ftp://a/b.mp4"]);
}

/// Rows of a table, also where names hold quotes.
fn read_anyhow(out: &Path) -> usize {
    csv::Reader::from_path(out.join("detections.csv")).unwrap().records().map(Result::unwrap).count()
}

/// What a file names is not opened: not from the network.
#[test]
fn playlists_reach_nothing() {
    let parent = tempfile::tempdir().unwrap();
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    server.set_nonblocking(true).unwrap();
    let address = format!("http://{}/a.ts", server.local_addr().unwrap());
    for (name, text) in [
        ("list.m3u8", format!("#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\n{address}\n#EXT-X-ENDLIST\n")),
        ("list.ffconcat", format!("ffconcat version 1.0\nfile '{address}'\n")),
        ("list.txt", format!("ffconcat version 1.0\nfile '{address}'\n")),
        ("list.sdp", "v=0\nc=IN IP4 127.0.0.1\nm=video 5004 RTP/AVP 96\na=rtpmap:96 H264/90000\n".to_owned()),
    ] {
        let path = parent.path().join(name);
        fs::write(&path, text).unwrap();
        run(&path, "").fails(1, &["cannot read", name]);
    }
    assert!(server.accept().is_err(), "something was asked for");
}

#[test]
fn files_that_are_no_video() {
    let parent = tempfile::tempdir().unwrap();
    let path = parent.path().join("notes.mp4");
    fs::write(&path, "").unwrap();
    run(&path, "").fails(1, &["notes.mp4", "the file is empty"]);
    fs::write(&path, "these are notes").unwrap();
    let ran = run(&path, "").fails(1, &["cannot read", "notes.mp4 as video", "Invalid data"]);
    assert!(ran.stderr.contains("hint: INPUT is a video, a folder"), "{}", ran.stderr);
    let sound = parent.path().join("sound.wav");
    ffmpeg(["-f", "lavfi", "-i", "sine=duration=0.2", sound.to_str().unwrap()]);
    run(&sound, "").fails(1, &["there is no video in", "sound.wav", "WAV"]);
    let (_frames, clip) = clip(5, "-pix_fmt gray -c:v ffv1", "clip.avi");
    run(&clip, "--bit-depth 12").fails(2, &["clip.avi", "8 bits", "--bit-depth 12"]);
    run(&clip, "--raw 96x64").fails(2, &["--raw", "INPUT must be -"]);
    run(&clip, "--fps 0").fails(2, &["--fps is 0", "between"]);
    run(&clip, "--fps nan").fails(2, &["--fps is NaN"]);
    run(&clip, "--live=maybe").fails(2, &["maybe", "yes"]);
}

/// What came before the end of a file that was cut is written; the error says so; skipping ends well.
#[test]
fn truncated_files() {
    for (words, name) in [
        ("-pix_fmt gray -c:v ffv1", "clip.avi"),
        ("-pix_fmt gray -c:v ffv1", "clip.mkv"),
        ("-pix_fmt yuv420p -c:v libx264 -g 5 -movflags +faststart", "clip.mp4"),
    ] {
        let (frames, path) = clip(60, words, name);
        let (whole, _) = rows("", &path);
        let bytes = fs::read(&path).unwrap();
        let cut = frames.path().join(format!("cut_{name}"));
        fs::write(&cut, &bytes[..bytes.len() * 7 / 10]).unwrap();
        let (_parent, out) = results();
        let line = format!("run {{in}} --out {{out}} {LINE}");
        apgstmd(&line, &cut, &out).fails(1, &["cannot use frame", &format!("cut_{name}"), "damaged or ends early"]);
        let (rows, record) = read(&out);
        let came = record["frames"].as_u64().unwrap() as usize;
        assert!((20..60).contains(&came), "{name}: {came}");
        // The last frames may show the damage already: what a decoder makes of half a frame is no reason to keep silent.
        let sound = came - 4;
        let before = |rows: &[Row]| rows.iter().filter(|row| row.frame < sound).cloned().collect::<Vec<_>>();
        assert_eq!(before(&rows), before(&whole), "{name}");
        assert!(record["error"].as_str().unwrap().contains("damaged"));
        let (_parent, out) = results();
        let ran = apgstmd(&format!("{line} --on-error skip"), &cut, &out).ok();
        assert!(ran.stderr.contains("1 skipped") && ran.stderr.contains("damaged"), "{}", ran.stderr);
        assert_eq!(read(&out).0, rows);
    }
}

/// Cut between two frames, this container gives no sign but its header.
#[test]
fn a_file_that_is_shorter_than_it_says() {
    let (frames, path) = clip(60, "-pix_fmt gray -c:v rawvideo", "clip.avi");
    let bytes = fs::read(&path).unwrap();
    let frame = bytes.windows(8).rposition(|tag| tag == *b"00dc\x00\x18\x00\x00").unwrap();
    let cut = frames.path().join("cut.avi");
    fs::write(&cut, &bytes[..frame - 30 * (8 + 6144)]).unwrap();
    let ran = run(&cut, "").ok();
    assert!(ran.stderr.contains("says that it has 60 frames, but 29 came"), "{}", ran.stderr);
    assert!(!run(&path, "").ok().stderr.contains("says that"));
    assert!(!run(&cut, "--stop 20").ok().stderr.contains("says that"));
}

#[test]
fn standard_input_that_is_wrong() {
    let (_frames, path) = clip(12, "-pix_fmt gray -c:v ffv1", "clip.avi");
    let y4m = ffmpeg(["-i", path.to_str().unwrap(), "-f", "yuv4mpegpipe", "-strict", "-1", "-"]);
    let (parent, out) = results();
    let piped = |flags: &str, bytes: &[u8]| piped(&format!("run - --out {{out}} --force {flags}"), bytes, &out);
    piped("", b"").fails(1, &["standard input", "is empty"]);
    piped("--raw 96x64", b"").fails(1, &["standard input", "is empty"]);
    piped("", b"\x89PNG\r\n\x1a\n").fails(1, &["YUV4MPEG2", "PNG"]);
    piped("", &y4m[..y4m.len() - 100]).fails(1, &["frame 11 of standard input", "in the middle", "of 6144 bytes"]);
    assert_eq!(json(&out.join("run.json"))["frames"], 11);
    piped("--on-error skip", &y4m[..y4m.len() - 100]).ok();
    piped("--raw 96x64:gray16le", &[0; 12 * 6144 + 1]).fails(1, &["frame 6 of standard input", "1 of 12288 bytes"]);
    piped("--raw 96x64", &[7; 6144]).ok();
    piped("--bit-depth 12", &y4m).fails(1, &["8 bits", "--bit-depth 12"]);
    piped("--raw 96x64:rgb24", b"").fails(2, &["rgb24", "gray16le"]);
    piped("--raw 96", b"").fails(2, &["96", "640x512:gray16le"]);
    assert!(parent.path().join("out/detections.csv").exists());
}

#[test]
fn results_are_named_after_the_source() {
    let (frames, _path) = clip(12, "-pix_fmt gray -c:v ffv1", "sky 1.avi");
    let run = |words: &[&str]| {
        let output =
            command().arg("run").args(words).args(["--overlay", "--speed", "1"]).current_dir(frames.path()).output();
        Ran::from(output.unwrap()).ok();
    };
    run(&["sky 1.avi"]);
    let out = frames.path().join("sky 1-apgstmd");
    assert!(out.join("overlay/sky 1_000011.png").is_file() && out.join("strip.png").is_file());
    assert_eq!(fs::read_dir(out.join("overlay")).unwrap().count(), 12);
    assert_eq!(json(&out.join("run.json"))["input"]["path"], "sky 1.avi");
}
