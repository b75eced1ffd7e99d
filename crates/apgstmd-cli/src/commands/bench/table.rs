//! The measurements on a terminal.

use super::Record;
use super::measure::{Latency, Measured, MemoryRecord};
use super::peak::Peak;
use crate::report::align;

pub(super) fn text(record: &Record<'_>) -> String {
    let mut text = format!("{}, {} core{}\n", record.cpu, record.cores, if record.cores == 1 { "" } else { "s" });
    for run in &record.runs {
        let peak = record.peaks.iter().find(|peak| peak.threads == run.threads);
        text += &one(run, peak);
    }
    text
}

fn one(run: &Measured, peak: Option<&Peak>) -> String {
    let Measured { model, width, height, threads, simd, rejection, frames, latency_ms, memory_bytes, .. } = run;
    let Latency { min, p50, p99, max, .. } = latency_ms;
    let MemoryRecord { bound, resident } = memory_bytes;
    let mib = |bytes: &usize| *bytes as f64 / f64::from(1 << 20);
    let rejection = format!("{rejection:?}").to_lowercase();
    let mut text = format!(
        "\n{model}, {width} x {height} px, {threads} thread{}, {simd}, rejection {rejection}\n\
         {:.0} frames/s over {frames} frames, one by one: {p50:.2} ms (median), {min:.2} to {max:.2}, 99 % below {p99:.2}\n\
         {:.1} MiB in use, {:.1} reserved at most; {:.1} detections a frame\n\n",
        if *threads == 1 { "" } else { "s" },
        run.frames_per_second,
        mib(resident),
        mib(bound),
        run.detections_per_frame,
    );
    let mut rows = vec![["stage", "ms", "time", "tiles", "G FMA/s", "of peak", "GB/s", "of peak"].map(str::to_owned)];
    let whole: f64 = run.stages.iter().map(|stage| stage.ms).sum();
    let rate = |rate: Option<f64>| rate.map_or("-".to_owned(), |rate| format!("{rate:.1}"));
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let of_peak = |rate: Option<f64>, peak: Option<f64>| {
        rate.zip(peak).map_or("-".to_owned(), |(rate, peak)| percent(rate / peak.max(1e-9)))
    };
    let (fma, copy) = (peak.map(|peak| peak.gfma_per_s), peak.map(|peak| peak.gbytes_per_s));
    let mut add = |name: &str, ms: f64, tiles: String, operations: Option<f64>, bytes: Option<f64>| {
        rows.push([
            name.to_owned(),
            format!("{ms:.3}"),
            percent(ms / whole.max(1e-9)),
            tiles,
            rate(operations),
            of_peak(operations, fma),
            rate(bytes),
            of_peak(bytes, copy),
        ]);
    };
    for stage in run.stages.iter().filter(|stage| stage.ms > 0.0) {
        let tiles = format!("{:.1} %", 100.0 * stage.active);
        add(stage.name, stage.ms, tiles, stage.gfma_per_s, stage.gbytes_per_s);
    }
    add("all", whole, String::new(), run.gfma_per_s, run.gbytes_per_s);
    text += &align(&rows);
    if let Some(Peak { gfma_per_s, gbytes_per_s, .. }) = peak {
        text += &format!("peak of {threads} thread{}, measured just now: ", if *threads == 1 { "" } else { "s" });
        text += &format!("{gfma_per_s:.0} G FMA/s, {gbytes_per_s:.0} GB/s\n");
    }
    text
}
