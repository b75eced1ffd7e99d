//! `apgstmd bench` on frames so small that it ends at once.

use std::fs;
use std::path::Path;

use crate::common::{Ran, apgstmd, json, results};
use apgstmd_core::SimdLevel;

const TINY: &str = "bench --size 48x32 --threads 1 --frames 12";

fn bench(line: &str, out: &Path) -> Ran {
    apgstmd(line, Path::new("unused"), out)
}

#[test]
fn a_table_says_what_was_measured() {
    let best = SimdLevel::best().name();
    let table = bench(TINY, Path::new("unused")).ok().stdout;
    for text in ["apg-stmd, 48 x 32 px, 1 thread", best, "frames/s", "99 %", "MiB in use", "G FMA/s", "of peak", "GB/s"]
    {
        assert!(table.contains(text), "{text} is not in\n{table}");
    }
    for stage in
        ["retina", "attention", "lamina", "medulla", "lobula", "rejection", "prediction", "facilitation", "all"]
    {
        assert!(table.lines().any(|line| line.trim_start().starts_with(stage)), "{stage} is not in\n{table}");
    }
}

#[test]
fn json_holds_every_combination() {
    let (parent, _) = results();
    let file = parent.path().join("speed.json");
    let line = "bench --size 48x32,64x48 --threads 1,2 --simd scalar,avx512 --model apg-stmd,estmd --frames 8 --json \
                --label now --out {out}";
    let ran = bench(line, &file).ok();
    let record = json(&file);
    assert_eq!(record, serde_json::from_str::<serde_json::Value>(&ran.stdout).unwrap());
    assert_eq!((&record["schema_version"], &record["label"]), (&1.into(), &"now".into()));
    assert!(record["cores"].as_u64().unwrap() >= 1 && !record["cpu"].as_str().unwrap().is_empty());
    let runs = record["runs"].as_array().unwrap();
    assert_eq!(runs.len(), 16);
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    for run in runs {
        assert_eq!(run["frames"], 8);
        assert!(number(&run["frames_per_second"]) > 0.0);
        let latency = ["min", "p50", "p99", "max"].map(|key| number(&run["latency_ms"][key]));
        assert!(latency[0] > 0.0 && latency.is_sorted(), "{latency:?}");
        let memory = &run["memory_bytes"];
        assert!(memory["resident"].as_u64() > Some(0) && memory["resident"].as_u64() <= memory["bound"].as_u64());
        let stages = run["stages"].as_array().unwrap();
        assert!(stages.iter().all(|stage| (0.0..=1.0).contains(&number(&stage["active"]))));
        let counted = run["model"] == "apg-stmd";
        assert_eq!(run["gfma_per_s"].is_number(), counted);
        assert!(stages.iter().all(|stage| stage["gbytes_per_s"].is_number() == counted));
    }
    let one = |key: &str| runs.iter().map(|run| run[key].clone()).collect::<std::collections::HashSet<_>>();
    assert_eq!((one("width").len(), one("threads").len(), one("model").len()), (2, 2, 2));
    assert!(one("simd").contains(&"scalar".into()));
    for peak in record["peaks"].as_array().unwrap() {
        assert!(number(&peak["gfma_per_s"]) > 0.0 && number(&peak["gbytes_per_s"]) > 0.0);
    }
    assert_eq!(record["peaks"].as_array().unwrap().len(), 2);
}

#[test]
fn wrong_arguments() {
    let cases: [(&str, &[&str]); 8] = [
        ("--size 480", &["480", "WIDTHxHEIGHT"]),
        ("--size 8x8", &["--size", "16"]),
        ("--threads 0", &["--threads is 0"]),
        ("--simd mmx", &["mmx", "avx512"]),
        ("--model best", &["best", "apg-stmd"]),
        ("--frames 0", &["--frames is 0"]),
        ("--speed 0", &["--speed"]),
        ("--scaling x --json", &["--json"]),
    ];
    for (flags, parts) in cases {
        bench(&format!("bench {flags}"), Path::new("unused")).fails(2, parts);
    }
    let line = format!("{TINY} --out {{out}}");
    bench(&line, Path::new("/no/such/folder/x.json")).fails(1, &["cannot write", "x.json"]);
}

#[test]
fn scaling_writes_a_table_and_a_picture_for_each_curve() {
    let (_parent, out) = results();
    // Two frames each: the values mean nothing, the files are all there.
    bench("bench --scaling {out} --frames 2 --largest 214x120", &out).ok();
    for (name, curves) in [("threads", 1), ("pixels", 1), ("tiles", 9), ("simd", 1)] {
        let table = fs::read_to_string(out.join(format!("{name}.csv"))).unwrap();
        let columns = table.lines().next().unwrap().split(',').count();
        assert!(
            table.lines().count() > curves && table.lines().all(|line| line.split(',').count() == columns),
            "{table}"
        );
        let picture = fs::read_to_string(out.join(format!("{name}.svg"))).unwrap();
        assert!(
            picture.starts_with("<svg")
                && picture.contains("ms a frame") | picture.contains("a pixel") | picture.contains("times")
        );
    }
}
