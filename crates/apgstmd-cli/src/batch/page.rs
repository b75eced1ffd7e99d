//! The page over all clips: one file, nothing from the network, and the browser is told to allow nothing else. It links to
//! each clip's own page.

use std::fs;
use std::path::Path;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use minijinja::{AutoEscape, Environment, Value, context};
use sha2::{Digest, Sha256};

use super::record::{Manifest, Record};
use super::{REPORT, THUMBNAIL};

const TEMPLATE: &str = include_str!("page.html");
/// The look of the pages of runs, and what only this one has.
const STYLE: &str = concat!(include_str!("../sink/report/page.css"), include_str!("page.css"));
const SCRIPT: &str = include_str!("page.js");
/// Bytes of small pictures that the page holds at most.
const PICTURES: usize = 6 << 20;
/// Width of a small picture on the page, px.
const WIDTH: u64 = 120;

pub(super) fn page(out: &Path, manifest: &Manifest<'_>) -> String {
    let mut room = PICTURES;
    let (done, failed): (Vec<&Record>, Vec<&Record>) = manifest.clips.iter().partition(|record| record.is_done());
    let shown: Vec<Value> = done.iter().map(|record| clip(out, record, &mut room)).collect();
    let failures: Vec<Value> = failed
        .iter()
        .map(|record| {
            context! {
                name => &record.name,
                path => &record.input.path,
                folder => &record.folder,
                error => record.error.as_deref().unwrap_or_default(),
            }
        })
        .collect();
    let mut notes = Vec::new();
    if manifest.interrupted {
        notes.push("The batch was interrupted: with --resume it goes on.".to_owned());
    }
    if manifest.waiting > 0 {
        notes.push(format!("Clips that have not been tried yet: {}.", manifest.waiting));
    }
    if done.iter().any(|record| record.files.contains_key(THUMBNAIL)) && room == 0 {
        notes.push("There are too many clips to show a picture of each.".to_owned());
    }
    let title = out.file_name().map_or_else(|| "Batch".into(), |name| name.to_string_lossy());
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    let values = context! {
        title,
        subtitle => out.to_string_lossy(),
        facts => facts(&done, &failed),
        notes,
        failed => failures,
        done => shown,
        columns => ["frames", "size, px", "tracks", "detections", "frames/s", "processor"],
        version => env!("CARGO_PKG_VERSION"),
        style => STYLE,
        script => SCRIPT,
        style_hash => hash(STYLE),
        script_hash => hash(SCRIPT),
    };
    environment.render_str(TEMPLATE, values).expect("the template is ours and a test renders it")
}

fn facts(done: &[&Record], failed: &[&Record]) -> Vec<Value> {
    let sum = |of: fn(&Record) -> Option<u64>| done.iter().filter_map(|record| of(record)).sum::<u64>();
    let frames = sum(|record| record.frames);
    let processor: f64 = done.iter().filter_map(|record| record.processor_seconds).sum();
    let each = 1e3 * processor / frames.max(1) as f64;
    let fact = |name: &str, value: String, remark: String| context! { name, value, remark };
    let remark = match failed.len() {
        0 => "none failed".to_owned(),
        n => format!("{n} failed"),
    };
    vec![
        fact("clips done", done.len().to_string(), remark),
        fact("tracks", sum(|record| record.tracks).to_string(), "clutter included".to_owned()),
        fact("detections", sum(|record| record.detections).to_string(), String::new()),
        fact("frames", frames.to_string(), format!("{each:.1} ms of processor time each")),
        fact("processor time", duration(processor), "of all clips together".to_owned()),
    ]
}

fn clip(out: &Path, record: &Record, room: &mut usize) -> Value {
    let image = thumbnail(out, record, room);
    let height = record.size.map_or(WIDTH, |size| (WIDTH * size.height).div_ceil(size.width.max(1)));
    let link = match record.files.contains_key(REPORT) {
        true => format!("{}/{REPORT}", record.folder),
        false => format!("{}/", record.folder),
    };
    let cell = |key: Option<f64>, text: String| match key {
        Some(key) => context! { key, text },
        None => context! { key => -1, text => "" },
    };
    let whole = |n: Option<u64>| cell(n.map(|n| n as f64), n.unwrap_or(0).to_string());
    let size = record.size.map(|size| ((size.width * size.height) as f64, format!("{} x {}", size.width, size.height)));
    let (pixels, size) = size.unzip();
    let cells = [
        whole(record.frames),
        cell(pixels, size.unwrap_or_default()),
        whole(record.tracks),
        whole(record.detections),
        cell(record.rate(), record.rate().map_or_else(String::new, |rate| format!("{rate:.1}"))),
        cell(record.processor_seconds, record.processor_seconds.map_or_else(String::new, duration)),
    ];
    context! {
        name => &record.name,
        path => &record.input.path,
        folder => &record.folder,
        link,
        image,
        width => WIDTH,
        height,
        cells => cells.to_vec(),
    }
}

/// As an address that holds the picture itself; none where there is none, or no room any more.
fn thumbnail(out: &Path, record: &Record, room: &mut usize) -> Option<String> {
    record.files.get(THUMBNAIL)?;
    let jpeg = fs::read(out.join(&record.folder).join(THUMBNAIL)).ok()?;
    match room.checked_sub(jpeg.len()) {
        Some(rest) => *room = rest,
        None => {
            *room = 0;
            return None;
        }
    }
    Some(format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg)))
}

fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 100.0 => format!("{s:.1} s"),
        s if s < 6000.0 => format!("{:.1} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

fn hash(text: &str) -> String {
    format!("sha256-{}", STANDARD.encode(Sha256::digest(text)))
}
