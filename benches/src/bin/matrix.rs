//! What the bank finds of targets of every speed, size and contrast, before sky, foliage and sea, with a camera that stands
//! still, pans or shakes: `matrix DIR [threads] [alone]` writes `matrix.csv`, a row for each kind of target in each scene, and
//! `matrix.md`, the table of its means.
//!
//! A scene has one speed, ground and camera, and eight targets: of the sixteen pairs of size and contrast those that a
//! chessboard pattern, which changes from scene to scene, gives it. With `alone` each scene comes once for every contrast, with
//! one target of each size. Seeds are fixed.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use apgstmd_benches::matrix::{FRAMES, Found, Setting, settings, settings_of_one_contrast};

fn main() {
    let mut args = std::env::args().skip(1);
    let folder = args.next().expect("matrix DIR [threads] [alone]");
    let threads: usize = args.next().map_or(2, |threads| threads.parse().expect("threads"));
    let all = match args.next().as_deref() {
        None => settings(),
        Some("alone") => settings_of_one_contrast(),
        Some(other) => panic!("alone or nothing, not {other}"),
    };
    let (next, done) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(setting) = all.get(index) else { return };
                    let found = setting.run();
                    eprintln!("{} of {}: {setting:?}", index + 1, all.len());
                    done.lock().expect("no thread panics").insert(index, found);
                }
            });
        }
    });
    let done = done.into_inner().expect("no thread panics");
    let rows: Vec<(&Setting, &Found)> =
        done.iter().flat_map(|(index, found)| found.iter().map(|f| (&all[*index], f))).collect();
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder).expect("a folder that can be made");
    std::fs::write(folder.join("matrix.csv"), csv(&rows)).expect("a file that can be written");
    let text = markdown(&rows);
    std::fs::write(folder.join("matrix.md"), &text).expect("a file that can be written");
    print!("{text}");
}

fn csv(rows: &[(&Setting, &Found)]) -> String {
    let mut text = String::from("ground,camera,speed,size,contrast,frames,rate_at_0.1,rate_at_1\n");
    for (setting, found) in rows {
        let Setting { ground, camera, speed, .. } = setting;
        let Found { size, contrast, visible, rates } = found;
        let (ground, camera) = (ground.name(), camera.name());
        let _ = writeln!(text, "{ground},{camera},{speed},{size},{contrast},{visible},{:.3},{:.3}", rates[0], rates[1]);
    }
    text
}

/// Means of the rates over all rows of which `key` gives the same text, in the order in which it first comes.
fn means(rows: &[(&Setting, &Found)], key: impl Fn(&Setting, &Found) -> String) -> Vec<(String, [f64; 2], usize)> {
    let mut out: Vec<(String, [f64; 2], usize)> = Vec::new();
    for (setting, found) in rows {
        let name = key(setting, found);
        let at = out.iter().position(|(known, ..)| *known == name).unwrap_or_else(|| {
            out.push((name, [0.0; 2], 0));
            out.len() - 1
        });
        out[at].2 += 1;
        for (sum, rate) in out[at].1.iter_mut().zip(found.rates) {
            *sum += rate;
        }
    }
    for (_, rates, count) in &mut out {
        rates.iter_mut().for_each(|rate| *rate /= *count as f64);
    }
    out
}

fn markdown(rows: &[(&Setting, &Found)]) -> String {
    let mut text = format!(
        "Share of the frames of a target in which it is found at 0.1 / 1 false alarms a frame, means over all that a cell\n\
         leaves open; {FRAMES} frames of 320 x 240, of which the first 30 do not count.\n\n"
    );
    let cell = |rates: &[f64; 2]| format!("{:.2} / {:.2}", rates[0], rates[1]);
    let mut table = |title: &str, keys: &dyn Fn(&Setting, &Found) -> (String, String)| {
        let cells = means(rows, |s, f| {
            let (row, column) = keys(s, f);
            format!("{row}|{column}")
        });
        let part = |index: usize| {
            let mut names: Vec<String> = Vec::new();
            for (name, ..) in &cells {
                let name = name.split('|').nth(index).unwrap_or("").to_owned();
                if !names.contains(&name) {
                    names.push(name);
                }
            }
            names.sort_by(|a, b| {
                let number = |name: &str| name.split(' ').next().and_then(|first| first.parse::<f64>().ok());
                number(a).partial_cmp(&number(b)).unwrap_or(std::cmp::Ordering::Equal)
            });
            names
        };
        let (down, across) = (part(0), part(1));
        let _ = writeln!(text, "| {title} | {} |\n|---|{}", across.join(" | "), "---|".repeat(across.len()));
        for row in &down {
            let values: Vec<String> = across
                .iter()
                .map(|column| {
                    let name = format!("{row}|{column}");
                    cells.iter().find(|(known, ..)| *known == name).map_or("".to_owned(), |(_, rates, _)| cell(rates))
                })
                .collect();
            let _ = writeln!(text, "| {row} | {} |", values.join(" | "));
        }
        text.push('\n');
    };
    table("ground, camera", &|s, _| {
        (format!("{}, {}", s.ground.name(), s.camera.name()), format!("{} px/frame", s.speed))
    });
    table("contrast", &|s, f| (f.contrast.to_string(), format!("{} px/frame", s.speed)));
    table("size, px", &|s, f| (f.size.to_string(), format!("{} px/frame", s.speed)));
    table("contrast", &|s, f| (f.contrast.to_string(), format!("{}, {}", s.ground.name(), s.camera.name())));
    table("size, px", &|_, f| (f.size.to_string(), format!("{} contrast", f.contrast)));
    text
}
