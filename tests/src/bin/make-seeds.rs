//! Writes the seeds of the fuzz targets into the folder that is named: small files of every kind that a boundary takes.
//! What fuzzing found lies beside them under the name `found-...` and stays.

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use apgstmd_core::stimulus::Scene;
use apgstmd_core::{BankParams, Detector, Model, Params, Preset, Size};
use apgstmd_tests::boundary::ALL;
use image::{DynamicImage, ImageFormat};

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn main() -> Outcome {
    let root = PathBuf::from(std::env::args_os().nth(1).ok_or("usage: make-seeds FOLDER")?);
    for boundary in ALL {
        fs::create_dir_all(root.join(boundary.name))?;
    }
    let write = |boundary: &str, name: &str, bytes: &[u8]| fs::write(root.join(boundary).join(name), bytes);
    for model in Model::ALL {
        let text = Params::for_model(*model).to_toml();
        let plain: Vec<&str> = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty()).collect();
        write("parameters", &format!("{model}.toml"), plain.join("\n").as_bytes())?;
    }
    let bank = BankParams::with_members(Params::preset(Preset::Practical), &[1.0], &[5.0]).to_toml();
    let plain: Vec<&str> = bank.lines().filter(|line| !line.starts_with('#')).collect();
    write("parameters", "bank.toml", plain.join("\n").as_bytes())?;
    scenes(&write)?;
    tables(&write)?;
    lines(&write)?;
    pictures(&root.join("picture"))?;
    pipes(&write)?;
    let mut detector = Detector::with_threads(Size::new(16, 16), &Params::for_model(Model::Estmd), 1)?;
    write("state", "estmd.safetensors", &detector.state().to_bytes())?;
    for name in ["state", "written", "detector", "extremes", "tracker", "evaluator", "track_evaluator"] {
        for seed in 0..4u64 {
            write(name, &format!("bytes-{seed}"), &bytes(seed, 60 << seed))?;
        }
    }
    Ok(())
}

/// A stream of bytes: xorshift.
fn bytes(seed: u64, count: usize) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 1;
    (0..count)
        .map(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 24) as u8
        })
        .collect()
}

fn scenes(write: &impl Fn(&str, &str, &[u8]) -> std::io::Result<()>) -> Outcome {
    let all = "\
width = 40\nheight = 30\nrate = 25.0\nframes = 9\nseed = 3\nnoise = 0.01\n\
[background]\nkind = 'natural'\nmean = 0.5\ncontrast = 0.1\nvelocity = [0.5, -0.25]\n\
[camera]\nroll = 1.0\nzoom = 0.1\nperiod = 10.0\nshake = 0.5\n\
[[object]]\nwidth = 9\nheight = 12\nluminance = 0.25\npath = { kind = 'straight', start = [30, 20] }\n\
[[target]]\nwidth = 3\nheight = 3\nshade = { dark = 0.2 }\nhidden = [[3, 5]]\n\
path = { kind = 'sinusoidal', start = [5, 12], speed = 2, amplitude = 3, frequency = 1 }\n\
[[target]]\npath = { kind = 'circular', center = [20, 15], radius = 6, speed = 1 }\nshade = { light = 0.4 }\n\
[[occluder]]\nwidth = 5\nheight = 30\nluminance = 0.8\npath = { kind = 'waypoints', points = [[1, 2], [9, 9]], speed = 1 }\n";
    Scene::from_toml(all)?;
    write("scene", "all.toml", all.as_bytes())?;
    write("scene", "least.toml", b"width = 8\nheight = 8\n")?;
    Ok(())
}

fn tables(write: &impl Fn(&str, &str, &[u8]) -> std::io::Result<()>) -> Outcome {
    write("truth", "boxes.csv", b"frame,x,y,w,h,visible,id,ignore\n3,497.0,122,3,6,1,2,0\n4,498,122,3,6,0,2,1\n")?;
    write("truth", "synth.csv", b"frame,id,x,y,w,h,visible,contrast\n3,2,497.000,122.000,3.000,6.000,1,0.3000\n")?;
    let mot = b"1,1,10,10,4,4,1,1,1\n2,1,11,10,4,4,0,1,0.5\n3,-1,10,10,4,4,0.7,-1,-1,-1\n";
    write("truth", "mot.txt", mot)?;
    write("detections", "mot.txt", mot)?;
    write(
        "detections",
        "own.csv",
        b"frame,name,x,y,score,direction_rad\n4,\"a,b.png\",10.5,20,0.25,-1.5\n5,=1+1,1,2,3e-4,\n",
    )?;
    write("detections", "tracks.csv", b"frame,time_s,track,x,y,vx,vy,score,state,age\n3,,0,1.5,2,0,0,1,confirmed,0\n")?;
    write("detections", "own.jsonl", b"{\"frame\":4,\"x\":1.5,\"y\":2,\"score\":0.5,\"direction_rad\":null}\n")?;
    Ok(())
}

fn lines(write: &impl Fn(&str, &str, &[u8]) -> std::io::Result<()>) -> Outcome {
    let words = "run\nframes/\n--start\n2.5s\n--stop\n120\n--raw\n640x512:gray16le\n--speed\n30px/s\n--speeds\n1,2\n--simd\navx2\n--dump\nE,Q\n--false-alarms\noff\n--out=-";
    write("arguments", "run", words.as_bytes())?;
    write("arguments", "eval", b"eval\nfound/\nscene/\n--json\n--frames\n750")?;
    write("names", "plain", b"f_10.png\nf_9.png\nf_%05d.png\nF 010.PNG\nb/2.png")?;
    let odd = "a\u{301}1.png\n\u{661}\u{662}.png\n-rf.png\n=1+1.png\n<script>.png\nhttp://a:b@c/d.mp4\nrtsp://x\n..\n99999999999999999999999.png";
    write("names", "odd", odd.as_bytes())?;
    let told = "[Parsed_showinfo_1 @ 0x5] [info] config in time_base: 1/15360, frame_rate: 30/1\n[Parsed_showinfo_1 @ 0x5] [info] n:   0 pts:    512 pts_time:0 fmt:gray s:96x64 i:P\n[h264 @ 0x1] [error] Invalid\n";
    write("ffmpeg", "told", told.as_bytes())?;
    Ok(())
}

fn pictures(folder: &Path) -> Outcome {
    let grey = DynamicImage::new_luma8(7, 5);
    let kinds = [
        ("grey8", grey.clone()),
        ("grey16", DynamicImage::ImageLuma16(grey.to_luma16())),
        ("rgb8", DynamicImage::ImageRgb8(grey.to_rgb8())),
        ("rgba16", DynamicImage::ImageRgba16(grey.to_rgba16())),
    ];
    for (name, picture) in &kinds {
        for (ending, format) in [
            ("png", ImageFormat::Png),
            ("jpg", ImageFormat::Jpeg),
            ("tif", ImageFormat::Tiff),
            ("bmp", ImageFormat::Bmp),
            ("pnm", ImageFormat::Pnm),
        ] {
            let mut file = Cursor::new(vec![0]);
            file.set_position(1);
            // Not every format has every kind.
            if picture.write_to(&mut Behind(&mut file), format).is_ok() {
                fs::write(folder.join(format!("{name}.{ending}")), file.into_inner())?;
            }
        }
    }
    Ok(())
}

/// A file behind its first byte, which chooses the bit depth.
struct Behind<'a>(&'a mut Cursor<Vec<u8>>);

impl std::io::Write for Behind<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write(bytes)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl std::io::Seek for Behind<'_> {
    fn seek(&mut self, to: std::io::SeekFrom) -> std::io::Result<u64> {
        use std::io::SeekFrom::{Current, End, Start};
        let to = match to {
            Start(at) => Start(at + 1),
            Current(by) => Current(by),
            End(by) => End(by),
        };
        self.0.seek(to).map(|at| at - 1)
    }
}

fn pipes(write: &impl Fn(&str, &str, &[u8]) -> std::io::Result<()>) -> Outcome {
    write("pipe", "mono.y4m", b"YUV4MPEG2 W2 H2 F25:1 Cmono XCOLORRANGE=FULL\nFRAME\n\x01\x02\x03\x04FRAME Ip\nabcd")?;
    write(
        "pipe",
        "420p10.y4m",
        b"YUV4MPEG2 W2 H2 F30000:1001 Ip A1:1 C420p10\nFRAME\n\x01\x02\x03\x02\x01\x00\x00\x00uvuv",
    )?;
    write("pipe", "raw", &bytes(5, 300))?;
    Ok(())
}
