//! `reproduce`: what it writes, prints and returns; names; folders.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common::{apgstmd, command, json, results};

const UNUSED: &str = "unused";

/// Cheap ones, one of each kind of record that is cheap.
const CHEAP: [&str; 3] = ["kernels", "contrast-tuning", "facilitation-space"];

#[test]
fn figures_numbers_page_and_summary() {
    let (_parent, out) = results();
    let names = CHEAP.join(" ");
    let ran = apgstmd(&format!("reproduce {names} --quick --out {{out}}"), Path::new(UNUSED), &out).ok();
    assert_eq!(ran.stderr, "", "no progress in a pipe");
    let rows = ran.stdout.lines().filter(|line| line.ends_with("  yes")).count();
    assert!(rows >= 9 && ran.stdout.contains(&format!("{rows} of {rows} hold")), "{}", ran.stdout);

    let summary = json(&out.join("summary.json"));
    assert_eq!((&summary["schema_version"], &summary["command"]), (&1.into(), &"reproduce".into()));
    assert_eq!(
        (&summary["holds"], &summary["quick"], &summary["interrupted"]),
        (&true.into(), &true.into(), &false.into())
    );
    let experiments = summary["experiments"].as_array().unwrap();
    assert_eq!(experiments.iter().map(|e| e["name"].as_str().unwrap()).collect::<Vec<_>>(), CHEAP);
    let page = fs::read_to_string(out.join("index.html")).unwrap();
    for experiment in experiments {
        for check in experiment["checks"].as_array().unwrap() {
            assert!(check["measured"].is_number() && check["wanted"].is_object() && check["holds"] == true, "{check}");
            assert!(ran.stdout.contains(check["what"].as_str().unwrap()));
        }
        assert!(page.contains(&format!("<section id=\"{}\">", experiment["name"].as_str().unwrap())));
        for file in experiment["files"].as_array().unwrap() {
            let path = out.join(file.as_str().unwrap());
            match path.extension().and_then(|e| e.to_str()).unwrap() {
                "png" => assert!(image::open(&path).unwrap().width() > 1000),
                "svg" => {
                    let svg = fs::read_to_string(&path).unwrap();
                    assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
                    assert_eq!(svg.matches("<text").count(), svg.matches("</text>").count());
                    assert!(page.contains(&svg), "the page holds the figure itself");
                }
                _ => assert_table(&path),
            }
        }
    }
    assert_eq!(page.matches("<svg").count(), CHEAP.len());
    assert!(page.contains("prefers-color-scheme") && page.contains("Weber contrast"));
    for foreign in ["<script", "src=", "href=\"http", "url(", "@import"] {
        assert!(!page.contains(foreign), "{foreign}");
    }
    let files = fs::read_dir(&out).unwrap().count();
    assert_eq!(files, 2 + experiments.iter().map(|e| e["files"].as_array().unwrap().len()).sum::<usize>());

    // The numbers of the table are those of the check: E at half the contrast is an eighth.
    let e = |contrast: &str| -> f64 {
        let text = fs::read_to_string(out.join("contrast-tuning.csv")).unwrap();
        let row = text.lines().find(|line| line.starts_with(&format!("{contrast},response,0,"))).unwrap().to_owned();
        row.split(',').nth(3).unwrap().parse().unwrap()
    };
    let measured = experiments[1]["checks"][1]["measured"].as_f64().unwrap();
    assert!((e("0.5") / e("1") - measured).abs() < 1e-12);

    // Not over earlier results, unless asked; then nothing of them is left.
    let line = "reproduce kernels --quick -q --out {out}";
    apgstmd(line, Path::new(UNUSED), &out).fails(1, &["is there already from an earlier run"]);
    fs::write(out.join("notes.txt"), "mine").unwrap();
    let again = apgstmd(&format!("{line} --force"), Path::new(UNUSED), &out).ok();
    assert_eq!((again.stdout.as_str(), again.stderr.as_str()), ("", ""));
    assert!(!out.join("contrast-tuning.csv").exists() && out.join("kernels.svg").exists());
    assert_eq!(fs::read_to_string(out.join("notes.txt")).unwrap(), "mine");
    fs::write(out.join("index.html"), "<p>a page of somebody else").unwrap();
    apgstmd(&format!("{line} --force"), Path::new(UNUSED), &out).fails(1, &["index.html", "not from this program"]);
}

/// A header of distinct names, at least one row, as many cells in each, and numbers but for the recorder.
fn assert_table(path: &Path) {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let head = reader.headers().unwrap().clone();
    let recorder = head.iter().position(|name| name == "recorder");
    let mut rows = 0;
    for row in reader.records() {
        for (column, cell) in row.unwrap().iter().enumerate() {
            assert!(Some(column) == recorder || cell.parse::<f64>().unwrap().is_finite(), "{}: {cell}", path.display());
        }
        rows += 1;
    }
    assert!(rows > 0 && head.len() >= 3, "{}", path.display());
}

/// The numbers do not depend on the threads.
#[test]
fn threads_change_nothing() {
    let written = ["1", "3"].map(|threads| {
        let (_parent, out) = results();
        let line = format!("reproduce facilitation-time --quick -q --threads {threads} --out {{out}}");
        apgstmd(&line, Path::new(UNUSED), &out).ok();
        ["facilitation-time.csv", "facilitation-time.svg"].map(|name| fs::read_to_string(out.join(name)).unwrap())
    });
    assert_eq!(written[0], written[1]);
}

#[test]
fn names_and_folders() {
    let (_parent, out) = results();
    let listed = apgstmd("reproduce --list", Path::new(UNUSED), &out).ok().stdout;
    for name in ["kernels", "velocity-tuning", "attention", "primer-direction", "occlusion"] {
        assert!(listed.lines().any(|line| line.starts_with(name)), "{listed}");
    }
    let ran = apgstmd("reproduce velocity --out {out}", Path::new(UNUSED), &out)
        .fails(2, &["there is no experiment `velocity`", "velocity-tuning", "occlusion"]);
    assert!(ran.stderr.contains("hint: perhaps `velocity-tuning` is meant"), "{}", ran.stderr);
    let ran = apgstmd("reproduce xyz --out {out}", Path::new(UNUSED), &out).fails(2, &["`xyz`"]);
    assert!(ran.stderr.contains("--list"), "{}", ran.stderr);
    apgstmd("reproduce --threads 0 --out {out}", Path::new(UNUSED), &out).fails(2, &["--threads is 0"]);
    assert!(!out.exists(), "nothing is made for what is refused");
    fs::write(&out, "a file").unwrap();
    apgstmd("reproduce kernels --out {out}", Path::new(UNUSED), &out).fails(1, &["is a file"]);
}

/// What was finished is there, whole; the exit code says that it is not all.
#[cfg(unix)]
#[test]
fn an_interrupted_run_is_complete_in_itself() {
    let (_parent, out) = results();
    let mut child = command()
        .args(["reproduce", "kernels", "occlusion", "--threads", "1", "--out"])
        .arg(&out)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    // The kernels take no time, the occlusion many seconds.
    while !out.join("kernels-prediction.csv").exists() {
        assert!(begin.elapsed() < Duration::from_secs(120) && child.try_wait().unwrap().is_none(), "no figure came");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    let summary = json(&out.join("summary.json"));
    assert_eq!(summary["interrupted"], true);
    assert_eq!(summary["experiments"].as_array().unwrap().len(), 1);
    assert!(fs::read_to_string(out.join("index.html")).unwrap().contains("Interrupted"));
    assert!(image::open(out.join("kernels.png")).is_ok() && !out.join("occlusion.png").exists());
}
