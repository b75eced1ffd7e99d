//! `eval`: numbers worked by hand, the way from a scene to its report, every error.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::{Ran, apgstmd, json};
use serde_json::Value;
use tempfile::TempDir;

/// 4 frames with a target each at column 20, row 20; scores 9 true, 8 false, 7 true and false, 6 true, 5 false three times.
const TRUTH: &str = "frame,x,y,w,h\n0,18.5,18.5,4,4\n1,18.5,18.5,4,4\n2,18.5,18.5,4,4\n3,18.5,18.5,4,4\n";
const FOUND: &str =
    "frame,x,y,score\n0,20,21,9\n0,90,90,8\n1,20,21,7\n3,90,90,7\n2,20,21,6\n1,90,90,5\n2,90,90,5\n3,90,90,5\n";

struct Case {
    folder: TempDir,
}

impl Case {
    fn new(found: &str, truth: &str) -> Self {
        let case = Self { folder: tempfile::tempdir().unwrap() };
        fs::write(case.path("found.csv"), found).unwrap();
        fs::write(case.path("truth.csv"), truth).unwrap();
        case
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn eval(&self, flags: &str) -> Ran {
        apgstmd(&format!("eval {{in}} {{out}} {flags}"), &self.path("found.csv"), &self.path("truth.csv"))
    }

    fn json(&self, flags: &str) -> Value {
        serde_json::from_str(&self.eval(&format!("{flags} --json")).ok().stdout).unwrap()
    }
}

fn rates(value: &Value) -> Vec<f64> {
    value["at"].as_array().unwrap().iter().map(|at| at["detection_rate"].as_f64().unwrap()).collect()
}

#[test]
fn numbers_worked_by_hand() {
    let case = Case::new(FOUND, TRUTH);
    let all = case.json("--frames 4");
    assert_eq!((&all["targets"], &all["true_detections"], &all["false_detections"]), (&4.into(), &3.into(), &5.into()));
    // Rate 1/4 over 0..2/4 false alarms a frame, 3/4 over 2/4..1.
    assert_eq!(all["area"], 0.5 * 0.25 + 0.5 * 0.75);
    assert_eq!(rates(&all), [0.25, 0.75, 0.75, 0.75, 0.75]);
    assert_eq!(all["average_precision"], 0.25 * 1.0 + 0.25 * 0.5 + 0.25 * 0.6);
    assert_eq!((&all["frames_from"], &all["schema_version"]), (&"given".into(), &1.into()));
    // Twice as many frames: half as many false alarms a frame.
    let long = case.json("--frames 8");
    assert_eq!(long["area"], 0.25 * 0.25 + 0.75 * 0.75);
    let part = case.json("--frames 8 --start 1 --stop 3");
    assert_eq!((&part["targets"], &part["frames"], &part["first_frame"]), (&2.into(), &2.into(), &1.into()));
    assert_eq!((&part["detections_outside"], &part["truth_outside"]), (&4.into(), &2.into()));
    let named = case.json("");
    assert_eq!((&named["frames_from"], &named["frames"]), (&"named".into(), &4.into()));
    // 1 px off: a radius of 0.9 px misses, but the box grown by 2 px still holds it.
    assert_eq!(case.json("--radius 0.9")["true_detections"], 3);
    assert_eq!(case.json("--radius 0.9 --margin 0")["true_detections"], 3);
    assert_eq!(
        Case::new(&FOUND.replace(",20,21,", ",20,23,"), TRUTH).json("--radius 2.9 --margin 0")["true_detections"],
        0
    );
}

#[test]
fn table_curve_and_page_say_the_same() {
    let case = Case::new(FOUND, TRUTH);
    let (page, curve) = (case.path("report.html"), case.path("curve.csv"));
    let flags = format!("--frames 4 --html {} --csv {}", page.display(), curve.display());
    let table = case.eval(&flags).ok().stdout;
    let line = |start: &str| table.lines().find(|line| line.trim_start().starts_with(start)).unwrap_or_default();
    assert!(line("area").contains("0.500") && line("detections").contains("3 true, 5 false"), "{table}");
    assert!(line("<= 0.1").contains("0.250") && line("<= 10").contains("0.750"), "{table}");
    assert!(line("<= 0.5").contains("1.00 px"), "{table}");
    assert_eq!(
        fs::read_to_string(curve).unwrap(),
        "threshold,true_detections,false_detections,detection_rate,false_alarms,precision,f1\n\
         9,1,0,0.25,0,1,0.4\n8,1,1,0.25,0.25,0.5,0.3333333333333333\n7,2,2,0.5,0.5,0.5,0.5\n\
         6,3,2,0.75,0.5,0.6,0.6666666666666666\n5,3,5,0.75,1.25,0.375,0.5\n"
    );
    let html = fs::read_to_string(&page).unwrap();
    assert_eq!(html.matches("<svg").count(), 2);
    for part in ["0.500", "3 true, 5 false", "at most 0.1", "prefers-color-scheme", "found.csv"] {
        assert!(html.contains(part), "{part}");
    }
    for foreign in ["<script", "src=", "href=", "url("] {
        assert!(!html.contains(foreign), "{foreign}");
    }
    assert_eq!(case.eval(&format!("{flags} --quiet")).ok().stdout, "", "files may be replaced, nothing is said");
    assert!(case.eval("").ok().stdout.contains("--frames"), "a guess is called one");
}

/// A name is text in the page, whatever it holds.
#[test]
fn names_are_escaped() {
    let case = Case::new(FOUND, TRUTH);
    let odd = case.path("<b>&.csv");
    fs::write(&odd, FOUND).unwrap();
    let page = case.path("p.html");
    apgstmd(&format!("eval {{in}} {{out}} --html {}", page.display()), &odd, &case.path("truth.csv")).ok();
    let html = fs::read_to_string(page).unwrap();
    assert!(html.contains("&lt;b&gt;&amp;.csv") && !html.contains("<b>"));
}

#[test]
fn nothing_found_and_nothing_to_find() {
    let empty = Case::new("frame,x,y,score\n", TRUTH);
    let page = empty.path("p.html");
    let ran = empty.eval(&format!("--frames 4 --html {}", page.display())).ok();
    assert!(ran.stdout.contains("nothing was found"), "{}", ran.stdout);
    assert!(fs::read_to_string(page).unwrap().contains("nothing was found"));
    let none = Case::new(FOUND, "frame,x,y,w,h,visible\n0,18,18,4,4,0\n");
    let ran = none.eval("--frames 4").ok();
    assert!(ran.stdout.contains("note: the truth has no visible target"), "{}", ran.stdout);
    assert_eq!(none.json("--frames 4")["neutral_detections"], 1);
    Case::new("frame,x,y,score\n", "frame,x,y,w,h\n").eval("").fails(2, &["--frames"]);
}

#[test]
fn all_formats_of_the_same() {
    let case = Case::new(FOUND, TRUTH);
    let expected = case.json("");
    let mot = |text: &str| {
        let rows = text.lines().skip(1).map(|row| {
            let v: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
            // Found: a box of 2 x 2 px around the point; truth: the box itself. Both count from 1.
            match v[..] {
                [frame, x, y, score] => format!("{},-1,{},{},2,2,{score},-1,-1,-1\n", frame + 1.0, x + 0.5, y + 0.5),
                _ => format!("{},1,{},{},{},{},1,1,1\n", v[0] + 1.0, v[1] + 1.0, v[2] + 1.0, v[3], v[4]),
            }
        });
        rows.collect::<String>()
    };
    let lines = FOUND.lines().skip(1).map(|row| {
        let v: Vec<&str> = row.split(',').collect();
        format!(
            "{{\"frame\":{},\"name\":\"a\",\"x\":{},\"y\":{},\"score\":{},\"direction_rad\":null}}\n",
            v[0], v[1], v[2], v[3]
        )
    });
    fs::write(case.path("found.jsonl"), lines.collect::<String>()).unwrap();
    fs::write(case.path("found.txt"), mot(FOUND)).unwrap();
    fs::write(case.path("truth.txt"), mot(TRUTH)).unwrap();
    for (found, truth) in [("found.txt", "truth.csv"), ("found.jsonl", "truth.txt"), ("found.csv", ".")] {
        let ran = apgstmd("eval {in} {out} --json", &case.path(found), &case.path(truth)).ok();
        let value: Value = serde_json::from_str(&ran.stdout).unwrap();
        for key in ["area", "at", "curve", "targets", "frames"] {
            assert_eq!(value[key], expected[key], "{found} {truth} {key}");
        }
    }
}

const SCENE: &str = "width = 128\nheight = 80\nrate = 1000.0\nframes = 260\n\
    [[target]]\npath = { kind = 'straight', start = [20.0, 40.0], speed = 250.0 }\n";

/// The paper's stimulus, smaller: made, run with the paper's constants, judged.
#[test]
fn from_a_scene_to_its_report() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("scene.toml"), SCENE).unwrap();
    apgstmd("synth {in} --out {out} -q", &path("scene.toml"), &path("pictures")).ok();
    let flags = "--preset paper --rejection off --localise target -q";
    apgstmd(&format!("run {{in}} --out {{out}} {flags}"), &path("pictures"), &path("found")).ok();
    let judged = |found: &Path, truth: &Path, flags: &str| -> Value {
        let ran = apgstmd(&format!("eval {{in}} {{out}} --json {flags}"), found, truth).ok();
        serde_json::from_str(&ran.stdout).unwrap()
    };
    let whole = judged(&path("found"), &path("pictures"), "");
    assert_eq!(
        (&whole["frames"], &whole["targets"], &whole["frames_from"]),
        (&260.into(), &260.into(), &"run.json".into())
    );
    // Once the response is there (SPEC: some 45 frames) the target is found in every frame, within 2 px and 10 degrees.
    let settled = judged(&path("found"), &path("pictures"), "--start 60");
    assert_eq!((&settled["frames"], rates(&settled)[0]), (&200.into(), 1.0));
    let first = &settled["at"][0];
    assert!(first["localisation_error"].as_f64().unwrap() < 2.0, "{first}");
    assert!(first["direction_error"].as_f64().unwrap() < 0.17, "{first}");
    // The table alone, the scene as truth: the same numbers.
    for (found, truth) in [("found/detections.csv", "scene.toml"), ("found", "pictures/truth.csv")] {
        let again = judged(&path(found), &path(truth), "");
        assert_eq!((&again["area"], &again["curve"]), (&whole["area"], &whole["curve"]), "{found} {truth}");
    }
    apgstmd("eval {in} {out} --frames 100", &path("found"), &path("scene.toml")).fails(2, &["--frames is 100", "260"]);
    assert_eq!(judged(&path("found"), &path("scene.toml"), "--frames 260")["area"], whole["area"]);

    // Every fourth frame, straight from the scene: a target of 1 px a frame, in 65 frames.
    apgstmd("run {in} --out {out} --step 4 --speed 1 --rejection off -q", &path("scene.toml"), &path("fourth")).ok();
    let fourth = judged(&path("fourth"), &path("scene.toml"), "");
    assert_eq!(
        (&fourth["frames"], &fourth["targets"], &fourth["truth_outside"]),
        (&65.into(), &65.into(), &195.into())
    );
    assert!(rates(&fourth)[2] > 0.6, "{:?}", rates(&fourth));
    assert_eq!(json(&path("fourth/run.json"))["input"]["step"], 4);
}

#[test]
fn files_that_cannot_be_judged() {
    let case = Case::new(FOUND, TRUTH);
    let (found, truth) = (case.path("found.csv"), case.path("truth.csv"));
    let ran = apgstmd("eval {in} {out}", &truth, &found).fails(1, &["truth.csv: line 1", "score"]);
    assert!(ran.stderr.contains("hint: DETECTIONS comes first"), "{}", ran.stderr);
    apgstmd("eval {in} {out}", &case.path("no.csv"), &truth).fails(1, &["cannot read", "no.csv", "no such file"]);
    apgstmd("eval {in} {out}", &found, &case.path("no.csv")).fails(1, &["cannot read", "no.csv"]);
    apgstmd("eval {in} {out}", case.folder.path(), &truth).fails(1, &["no detections.csv"]);
    let empty = tempfile::tempdir().unwrap();
    apgstmd("eval {in} {out}", &found, empty.path()).fails(1, &["no truth.csv"]);
    fs::write(case.path("scene.toml"), "widht = 3\n").unwrap();
    apgstmd("eval {in} {out}", &found, &case.path("scene.toml")).fails(2, &["scene.toml", "line 1", "widht"]);

    let broken = |found: &str, truth: &str, parts: &[&str]| Case::new(found, truth).eval("").fails(1, parts);
    broken("frame,x,y,score\n0,1,2,x\n", TRUTH, &["found.csv: line 2", "score = \"x\"", "finite number"]);
    broken("frame,x,y,score\n0,1,2,nan\n", TRUTH, &["line 2", "nan", "finite number"]);
    broken("frame,x,y,score\n0,1,2\n", TRUTH, &["line 2", "3 fields", "4"]);
    broken(FOUND, "frame,x,y,w,h\n0,1,2,3,4\n0,1,2,-3,4\n", &["truth.csv: line 3", "w = \"-3\"", "at least 0"]);
    broken(FOUND, "", &["truth.csv: line 1", "empty file"]);
    broken(FOUND, "0,1,2,3,4,5,6\n", &["truth.csv: line 1", "frame = \"0\"", "count from 1"]);
    fs::write(&found, b"frame,x,y,score\n0,1,2,\xff\n").unwrap();
    case.eval("").fails(1, &["found.csv: line 2", "UTF-8"]);
    fs::write(
        case.path("found.jsonl"),
        "{\"frame\":0,\"x\":1,\"y\":2,\"score\":3,\"direction_rad\":0}\n{\"frame\":0}\n",
    )
    .unwrap();
    apgstmd("eval {in} {out}", &case.path("found.jsonl"), &truth).fails(1, &["found.jsonl: line 2", "missing field"]);
}

#[test]
fn nonsense_on_the_command_line() {
    let case = Case::new(FOUND, TRUTH);
    let cases: [(&str, &[&str]); 10] = [
        ("--frames 0", &["--frames is 0", "at least 1"]),
        ("--start 4", &["--start 4", "0 to 3"]),
        ("--start 3 --stop 3", &["--stop 3", "--start 3"]),
        ("--radius -1", &["--radius is -1 px", "from 0 to 1e12"]),
        ("--radius nan", &["--radius is NaN"]),
        ("--margin inf", &["--margin is inf"]),
        ("--csv -", &["--csv needs the name of a file"]),
        ("--csv {in}", &["would replace"]),
        ("--html {out}", &["would replace"]),
        ("--html a.html --csv a.html", &["both a.html"]),
    ];
    for (flags, parts) in cases {
        case.eval(flags).fails(2, parts);
    }
    case.eval(&format!("--html {}", case.path("no/p.html").display())).fails(1, &["cannot write", "p.html"]);
    assert_eq!(fs::read_to_string(case.path("truth.csv")).unwrap(), TRUTH);

    fs::write(case.path("run.json"), "{\"program\": \"apgstmd\"}").unwrap();
    case.eval("").fails(1, &["run.json", "frames"]);
    fs::write(case.path("run.json"), "{\"program\": \"another\"}").unwrap();
    case.eval("").ok();
}
