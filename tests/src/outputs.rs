//! What this version finds, kept: the tables of `apgstmd run` on a small scene, for every model and preset and the bank. Numbers may
//! differ between instruction sets, whose rounding differs, and nowhere else.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use apgstmd_cli::host::Host;

/// The runs: a name, and the flags.
pub const RUNS: [(&str, &str); 7] = [
    ("practical", "--speed 1"),
    ("paper", "--speed 1 --preset paper"),
    ("bank", "--speeds 0.5,1,2 --sizes 5"),
    ("stmd-plus", "--speed 1 --model stmd-plus"),
    ("dstmd", "--speed 1 --model dstmd"),
    ("cascaded", "--speed 1 --model cascaded"),
    ("estmd", "--speed 1 --model estmd"),
];
/// Tables that are kept of each.
pub const TABLES: [&str; 2] = ["detections", "tracks"];
/// Rows are kept from this frame on: everything that came before has a part in them.
const FROM: f64 = 88.0;

/// Three targets before a ground that moves.
const SCENE: &str = "
width = 80
height = 64
rate = 100.0
frames = 96
seed = 5
[background]
kind = 'natural'
velocity = [-30.0, 0.0]
[[target]]
path = { kind = 'straight', start = [0.0, 18.0], speed = 70.0 }
[[target]]
path = { kind = 'straight', start = [-10.0, 32.0], speed = 100.0 }
[[target]]
path = { kind = 'straight', start = [70.0, 46.0], speed = 60.0, direction = 3.14159265 }
";

/// Where the repository keeps them.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/outputs")
}

/// The tables of a run, as far as they are kept. `simd` is an instruction set, the machine's best where there is none.
///
/// # Errors
/// The run failed.
pub fn tables(flags: &str, simd: Option<&str>) -> Result<[String; 2], String> {
    let place = tempfile::tempdir().map_err(|error| error.to_string())?;
    let (scene, out) = (place.path().join("scene.toml"), place.path().join("out"));
    fs::write(&scene, SCENE).map_err(|error| error.to_string())?;
    let mut words: Vec<OsString> = ["apgstmd", "run", "--quiet", "--threads", "1", "--out"].map(OsString::from).into();
    words.extend([out.clone().into(), scene.into()]);
    words.extend(flags.split_whitespace().map(OsString::from));
    words.extend(simd.into_iter().flat_map(|level| ["--simd", level]).map(OsString::from));
    apgstmd_cli::run_with(words, Host::default()).map_err(|failure| failure.text().unwrap_or_default())?;
    let mut kept = [String::new(), String::new()];
    for (name, kept) in TABLES.iter().zip(&mut kept) {
        let text = fs::read_to_string(out.join(format!("{name}.csv"))).map_err(|error| error.to_string())?;
        let frame = |row: &str| row.split(',').next().and_then(|frame| frame.parse::<f64>().ok());
        kept.extend(text.split_inclusive('\n').filter(|row| frame(row).is_none_or(|frame| frame >= FROM)));
    }
    Ok(kept)
}

/// A row as far as its numbers may differ by rounding, and the row.
struct Row<'a> {
    frame: &'a str,
    place: (f64, f64),
    cells: Vec<&'a str>,
}

/// Numbers that rounding changes, how far it may, and of what: nothing (absolute), or the number itself.
const ROUNDED: [(&str, f64, bool); 7] = [
    ("x", 0.02, false),
    ("y", 0.02, false),
    ("score", 2e-3, true),
    ("direction_rad", 0.01, false),
    ("contrast", 2e-3, true),
    ("vx", 0.01, false),
    ("vy", 0.01, false),
];
/// Rows are of one target where they are nearer, px.
const NEAR: f64 = 0.5;

/// What became of the numbers of a table, in words; empty where nothing changed but by rounding.
pub fn changes(before: &str, now: &str) -> Vec<String> {
    let (head, was) = rows(before);
    let (new_head, mut is) = rows(now);
    if head != new_head {
        return vec![format!("the columns were {}, now {}", head.join(","), new_head.join(","))];
    }
    let mut told = Vec::new();
    for row in was {
        let distance = |other: &Row<'_>| (other.place.0 - row.place.0).hypot(other.place.1 - row.place.1);
        let near = is.iter().enumerate().filter(|(_, other)| other.frame == row.frame && distance(other) < NEAR);
        match near.min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b))).map(|(index, _)| index) {
            Some(index) => told.extend(differences(&head, &row, &is.swap_remove(index))),
            None => told.push(format!("no longer there: {}", row.cells.join(","))),
        }
    }
    told.extend(is.iter().map(|row| format!("new: {}", row.cells.join(","))));
    told
}

fn rows(table: &str) -> (Vec<&str>, Vec<Row<'_>>) {
    let mut lines = table.lines();
    let head: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let column = |name: &str| head.iter().position(|column| *column == name).unwrap_or(0);
    let (x, y) = (column("x"), column("y"));
    let rows = lines.map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |index: usize| cells.get(index).and_then(|cell| cell.parse().ok()).unwrap_or(f64::NAN);
        Row { frame: cells[0], place: (number(x), number(y)), cells }
    });
    let rows = rows.collect();
    (head, rows)
}

fn differences(head: &[&str], was: &Row<'_>, is: &Row<'_>) -> Option<String> {
    let differs = |name: &str, a: &str, b: &str| {
        let rule = ROUNDED.iter().find(|(column, ..)| *column == name);
        let (Some((_, most, relative)), Ok(a), Ok(b)) = (rule, a.parse::<f64>(), b.parse::<f64>()) else {
            // Numbers of traces and tracks depend on every one before: only what they are of is looked at.
            return a != b && !["trace", "track", "name"].contains(&name);
        };
        let off = (a - b).abs();
        // Directions meet at half a turn.
        let off = if name == "direction_rad" { off.min((off - std::f64::consts::TAU).abs()) } else { off };
        off > most * if *relative { a.abs().max(b.abs()) } else { 1.0 }
    };
    let cells = head.iter().zip(&was.cells).zip(&is.cells);
    let changed: Vec<String> =
        cells.filter(|((name, a), b)| differs(name, a, b)).map(|((name, a), b)| format!("{name} {a} -> {b}")).collect();
    (!changed.is_empty())
        .then(|| format!("frame {} at ({:.1}, {:.1}): {}", was.frame, was.place.0, was.place.1, changed.join(", ")))
}
