//! Files made by somebody who means ill: each ends with an error that says what is wrong, or is harmless.
#![cfg(unix)]

use std::fs;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::common::{apgstmd, command, csv_rows, folder, json, picture, piped, results, video};

/// A PNG of nothing that claims a size.
fn png_of(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Sixteen);
    let mut writer = encoder.write_header().unwrap();
    writer.write_chunk(png::chunk::IDAT, &[0x78, 0x9c]).unwrap();
    // What is missing is seen when it is dropped, and no matter here.
    std::mem::forget(writer);
    bytes
}

#[test]
fn headers_that_claim_the_largest_there_is() {
    let (_parent, out) = results();
    for (name, bytes) in [
        ("f.png", png_of(65535, 65535)),
        ("f.pgm", b"P5 65535 65535 255\n".to_vec()),
        ("f.bmp", bmp_of(65535, 65535)),
        ("f.tif", tiff_of(65535, 65535)),
    ] {
        let frames = folder(2);
        fs::write(frames.path().join(name), bytes).unwrap();
        let ran = apgstmd("run {in} --out {out} --force", frames.path(), &out);
        ran.fails(1, &[name, "65535 x 65535", "at most 64 million pixels", "--largest-frame"]);
    }
    piped("run - --out {out} --force", b"YUV4MPEG2 W65535 H65535 F25:1 C444p16\nFRAME\n", &out)
        .fails(1, &["65535 x 65535", "--largest-frame"]);
    let scene = out.with_extension("toml");
    fs::write(&scene, "width = 16384\nheight = 16384\n").unwrap();
    apgstmd("run {in} --out {out}", &scene, &out).fails(2, &["16384 x 16384", "--largest-frame"]);
    // The limit is the user's.
    let frames = folder(3);
    let ran = apgstmd("run {in} --out {out} --force --largest-frame 0", frames.path(), &out);
    assert_eq!(ran.code, 2);
    let large = image::GrayImage::new(1100, 1000);
    let frames = folder(0);
    large.save(frames.path().join("1.png")).unwrap();
    apgstmd("run {in} --out {out} --force --largest-frame 1", frames.path(), &out)
        .fails(1, &["1000 x 1100", "at most 1 million pixels", "--largest-frame"]);
}

fn bmp_of(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = b"BM\x36\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0".to_vec();
    bytes.extend(width.to_le_bytes());
    bytes.extend(height.to_le_bytes());
    bytes.extend([1, 0, 24, 0]);
    bytes.extend([0; 24]);
    bytes
}

/// Little endian, eight entries, grey of 8 bits in one strip that is not there.
fn tiff_of(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = b"II*\0\x08\0\0\0\x08\0".to_vec();
    for (tag, value) in [(256, width), (257, height), (258, 8), (259, 1), (262, 1), (273, 8), (278, height), (279, 9)] {
        bytes.extend(u16::to_le_bytes(tag));
        bytes.extend([4, 0, 1, 0, 0, 0]);
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend([0; 4]);
    bytes
}

/// A gigapixel of nothing in a small file: refused by its size, before it is unpacked.
#[test]
fn a_picture_that_unpacks_to_gigabytes() {
    let (_parent, out) = results();
    let frames = folder(2);
    let mut encoder = png::Encoder::new(fs::File::create(frames.path().join("f_2.png")).unwrap(), 40_000, 25_000);
    encoder.set_compression(png::Compression::Fastest);
    let mut rows = encoder.write_header().unwrap().into_stream_writer().unwrap();
    let row = vec![0; 40_000];
    // A part of it is enough to be a bomb.
    for _ in 0..2_000 {
        rows.write_all(&row).unwrap();
    }
    drop(rows);
    let begin = Instant::now();
    apgstmd("run {in} --out {out} --speed 1", frames.path(), &out).fails(1, &["25000 x 40000", "--largest-frame"]);
    assert!(begin.elapsed() < Duration::from_secs(60));
}

#[test]
fn names_that_are_markup_formulas_or_lines() {
    let frames = folder(0);
    let names = [
        "-rf.png",
        "--out=x.png",
        "=1+1.png",
        "@SUM(1).png",
        "a\nb.png",
        "a\"b,c.png",
        "it's.png",
        "<script>alert(1)<!--.png",
        "%s%n.png",
        "$(id).png",
    ];
    let ordered = {
        let mut paths: Vec<_> = names.iter().map(std::path::PathBuf::from).collect();
        apgstmd_cli::boundary::in_natural_order(&mut paths);
        paths
    };
    for (t, name) in ordered.iter().enumerate() {
        picture(t).save(frames.path().join(name)).unwrap();
    }
    let (_parent, out) = results();
    let (report, coco) = (out.with_extension("html"), out.with_extension("json"));
    let ran = command()
        .args(["run", "--quiet", "--overlay", "--format", "csv,jsonl", "--speed", "1", "--preset", "practical"])
        .arg("--report")
        .arg(&report)
        .arg("--coco")
        .arg(&coco)
        .arg("--out")
        .arg(&out)
        .arg(frames.path())
        .output()
        .unwrap();
    crate::common::Ran::from(ran).ok();
    let table = fs::read(out.join("detections.csv")).unwrap();
    let mut reader = csv::ReaderBuilder::new().from_reader(&table[..]);
    for row in reader.records() {
        let row = row.unwrap();
        assert!(!row[1].starts_with(['=', '+', '-', '@']), "{:?} is a formula", &row[1]);
        assert!(frames.path().join(&row[1]).is_file(), "{:?} still names the picture", &row[1]);
    }
    let images = json(&coco)["images"].as_array().unwrap().clone();
    let told: Vec<_> = images.iter().map(|image| image["file_name"].as_str().unwrap().to_owned()).collect();
    assert_eq!(told, ordered.iter().map(|path| path.to_str().unwrap().to_owned()).collect::<Vec<_>>());
    let page = fs::read_to_string(&report).unwrap();
    assert!(!page.contains("<script>alert") && !page.contains("<!--"), "markup from a name");
    let drawn: Vec<_> = fs::read_dir(out.join("overlay")).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(drawn.len(), names.len());
    assert!(drawn.iter().all(|path| path.parent() == Some(&out.join("overlay"))));
}

/// What a clip whose name is a trick of ffmpeg's does, and a playlist that reaches for other files and the network.
#[test]
fn ffmpeg_opens_only_what_was_named() {
    let frames = folder(8);
    let place = folder(0);
    let at = |name: &str| place.path().join(name);
    video(frames.path(), "-c:v mpeg4 -q:v 2", &at("true.mp4"));
    for name in ["concat:true.mp4|true.mp4", "pipe:0", "-i", "a\nb", "'\"", "subfile,,start,0,end,9,,:true.mp4"] {
        fs::copy(at("true.mp4"), at(name)).unwrap();
        let (_parent, out) = results();
        let ran = command()
            .current_dir(place.path())
            .args(["run", "--quiet", "--speed", "1", "--out"])
            .arg(&out)
            .arg(Path::new(".").join(name))
            .output()
            .unwrap();
        crate::common::Ran::from(ran).ok();
        assert_eq!(json(&out.join("run.json"))["frames"], 8, "{name:?}");
    }
    // Where there is no file of that name, nothing is opened.
    let (_parent, out) = results();
    let ran =
        command().current_dir(place.path()).args(["run", "concat:true.mp4|other.mp4", "--out"]).arg(&out).output();
    crate::common::Ran::from(ran.unwrap()).fails(1, &["there is no file or folder"]);
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.set_nonblocking(true).unwrap();
    let address = listener.local_addr().unwrap();
    video(frames.path(), "-c:v mpeg4 -q:v 2", &at("true.ts"));
    let secret = at("secret.txt");
    fs::write(&secret, "the secret").unwrap();
    for (name, text) in [
        ("own.m3u8", "#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\ntrue.ts\n#EXT-X-ENDLIST\n".to_owned()),
        ("own.ffconcat", "ffconcat version 1.0\nfile true.mp4\n".to_owned()),
        ("list.m3u8", format!("#EXTM3U\n#EXT-X-TARGETDURATION:9\n#EXTINF:9,\nhttp://{address}/a.ts\n#EXT-X-ENDLIST\n")),
        ("list.ffconcat", format!("ffconcat version 1.0\nfile http://{address}/a.mp4\n")),
        ("list.sdp", format!("v=0\nc=IN IP4 {}\nm=video {} RTP/AVP 96\n", address.ip(), address.port())),
    ] {
        fs::write(at(name), text).unwrap();
        let (_parent, out) = results();
        let ran = apgstmd("run {in} --out {out}", &at(name), &out);
        assert_eq!(ran.code, 1, "{name}: {}", ran.stderr);
        assert!(!name.starts_with("own") || ran.stderr.contains("only a file that you name"), "{}", ran.stderr);
        assert!(!ran.stderr.contains("the secret"), "{}", ran.stderr);
        let error = listener.accept().map(|(mut peer, _)| peer.read(&mut [0])).unwrap_err();
        assert_eq!(error.kind(), std::io::ErrorKind::WouldBlock, "{name}: somebody called");
    }
}

#[test]
fn settings_that_never_end() {
    let (_parent, out) = results();
    let frames = folder(2);
    for depth in [200, 100_000] {
        let file = out.with_extension("toml");
        for text in [
            format!("a = {}{}", "[".repeat(depth), "]".repeat(depth)),
            format!("a{} = 1", ".a".repeat(depth)),
            format!("[{}a]", "a.".repeat(depth)),
            format!("a = {}1{}", "{a = ".repeat(depth), "}".repeat(depth)),
        ] {
            fs::write(&file, text).unwrap();
            let words = format!("run {} --out {{out}} --params {{in}}", frames.path().display());
            apgstmd(&words, &file, &out).fails(2, &[]);
            apgstmd("run {in} --out {out}", &file, &out).fails(2, &[]);
        }
    }
    apgstmd(&format!("run {} --out {{out}} --params /dev/zero", frames.path().display()), &out, &out)
        .fails(2, &["/dev/zero", "16 MiB"]);
    let scene = out.with_extension("toml");
    for (text, parts) in [
        ("frames = 9000000000000000000\n[[target]]\npath = { kind = 'straight', start = [-90, 1] }", &["frame"][..]),
        ("[background]\nkind = 'panorama'\nfile = '/dev/zero'\n", &["/dev/zero", "no file"]),
        ("[background]\nkind = 'panorama'\nfile = '/etc/passwd'\n", &["/etc/passwd", "no PNG"]),
    ] {
        fs::write(&scene, text).unwrap();
        let ran = apgstmd("run {in} --out {out} --stop 1 --force --quiet", &scene, &out);
        assert!(!ran.stderr.contains("root:"), "{}", ran.stderr);
        if parts != ["frame"] {
            ran.fails(1, parts);
        }
    }
}

#[test]
fn json_that_never_ends() {
    let (_parent, out) = results();
    let lines = out.with_extension("jsonl");
    let truth = out.with_extension("csv");
    fs::write(&truth, "frame,x,y,w,h\n0,1,1,4,4\n").unwrap();
    for text in ["[".repeat(200_000), format!("{{\"frame\":0,\"x\":{}", "[".repeat(200_000)), "{\"a\":".repeat(200_000)]
    {
        fs::write(&lines, text).unwrap();
        apgstmd("eval {in} {out}", &lines, &truth).fails(1, &["line 1"]);
    }
    fs::create_dir(&out).unwrap();
    fs::write(out.join("detections.csv"), "frame,x,y,score\n0,1,1,1\n").unwrap();
    fs::write(out.join("run.json"), "{\"a\":".repeat(200_000)).unwrap();
    apgstmd("eval {in} {out}", &out, &truth).fails(1, &["run.json"]);
}

#[test]
fn a_picture_that_is_a_device() {
    let frames = folder(2);
    std::os::unix::fs::symlink("/dev/zero", frames.path().join("f_2.png")).unwrap();
    let (_parent, out) = results();
    // It is no file, so it is no picture either.
    apgstmd("run {in} --out {out} --quiet --speed 1", frames.path(), &out).ok();
    assert_eq!(json(&out.join("run.json"))["frames"], 2);
    assert!(csv_rows(&out.join("detections.csv")).iter().all(|row| row.frame < 2));
}

/// Links in the results folder that lead out of it: nothing is written through them, unasked or asked.
/// A file that is moved to its place would take that of a device: `--coco /dev/null` as root.
#[test]
fn devices_and_pipes_stay() {
    let frames = folder(6);
    for flag in ["--coco", "--report", "--video"] {
        let (parent, out) = results();
        let special = parent.path().join("found.mp4");
        let _socket = std::os::unix::net::UnixListener::bind(&special).unwrap();
        let line = format!("run {{in}} --out {{out}} --speed 1 --force {flag} {}", special.display());
        apgstmd(&line, frames.path(), &out).fails(1, &["found.mp4", "a device or a pipe"]);
        let link = parent.path().join("link.mp4");
        std::os::unix::fs::symlink(parent.path().join("nowhere"), &link).unwrap();
        apgstmd(&format!("run {{in}} --out {{out}} {flag} {}", link.display()), frames.path(), &out)
            .fails(2, &[flag, "is a link"]);
        assert!(link.is_symlink());
        let about = fs::symlink_metadata(&special).unwrap();
        assert!(!about.is_file() && !about.is_dir(), "{flag} has left it as it was");
    }
}

#[test]
fn links_in_the_results_folder() {
    let frames = folder(6);
    let elsewhere = folder(0);
    let mine = elsewhere.path().join("mine");
    fs::write(&mine, "mine").unwrap();
    let line = "run {in} --out {out} --speed 1 --overlay --dump P";
    for (name, to) in [
        ("detections.csv", "mine"),
        ("tracks.csv", "new"),
        ("camera.csv", "new"),
        ("run.json", "mine"),
        ("strip.png", "new"),
        ("run.json.part", "mine"),
    ] {
        let (_parent, out) = results();
        fs::create_dir(&out).unwrap();
        std::os::unix::fs::symlink(elsewhere.path().join(to), out.join(name)).unwrap();
        let ran = apgstmd(line, frames.path(), &out);
        if name != "run.json.part" {
            ran.fails(1, &[name, "is there already"]);
            apgstmd(&format!("{line} --force"), frames.path(), &out).ok();
        }
        assert!(!out.join(name).is_symlink(), "{name} is a file now, or gone");
        assert_eq!(fs::read_to_string(&mine).unwrap(), "mine", "{name}");
        assert_eq!(fs::read_dir(elsewhere.path()).unwrap().count(), 1, "{name}");
    }
    for name in ["overlay", "dump"] {
        let (_parent, out) = results();
        fs::create_dir(&out).unwrap();
        std::os::unix::fs::symlink(elsewhere.path(), out.join(name)).unwrap();
        apgstmd(&format!("{line} --force"), frames.path(), &out).fails(1, &[name, "is a link"]);
    }
    for name in ["overlay/f_3.png", "dump/P_000003.npy"] {
        let (_parent, out) = results();
        fs::create_dir_all(out.join(name).parent().unwrap()).unwrap();
        std::os::unix::fs::symlink(elsewhere.path().join("new"), out.join(name)).unwrap();
        apgstmd(line, frames.path(), &out).fails(1, &[name]);
    }
    assert_eq!(fs::read_dir(elsewhere.path()).unwrap().count(), 1);
}
