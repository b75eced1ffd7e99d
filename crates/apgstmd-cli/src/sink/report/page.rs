//! The page: one file, nothing from the network, and the browser is told to allow nothing else.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, context};
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::{Gathered, Mark, bins, frames, histogram, paths, thumbnails};
use crate::footage::Warning;
use crate::sink::WEAK;
use crate::sink::outline::Outline;

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Raised when a field of the page's data changes its meaning or goes away.
const SCHEMA_VERSION: u32 = 1;

/// What is said of a run besides what was gathered.
#[derive(Debug, Serialize)]
pub struct About {
    /// INPUT.
    pub title: String,
    /// One line: frames, size, rate.
    pub subtitle: String,
    /// The sums.
    pub facts: Vec<Fact>,
    /// What is wrong with the footage.
    pub warnings: Vec<Warning>,
    /// Why there is nothing to show of the camera's motion, where there is nothing.
    pub still: Option<String>,
    /// What the reader should know of the page.
    pub notes: Vec<String>,
    /// Milliseconds of each stage of the model, a frame.
    pub stages: Vec<Share>,
    /// What these are.
    pub stages_note: String,
    /// Reading, computing, writing.
    pub work: Vec<Share>,
    /// Which of them the others waited for.
    pub work_note: String,
    /// Detectors of a bank.
    pub members: Vec<String>,
    /// Parameters as TOML.
    pub params: String,
    /// Lines in the histogram of scores.
    pub score_marks: Vec<Mark>,
    /// Lines in that of contrasts.
    pub contrast_marks: Vec<Mark>,
    /// Frames a second, where known.
    pub rate: Option<f64>,
}

/// A number, what it is, a remark.
#[derive(Debug, Serialize)]
pub struct Fact {
    /// With its unit.
    pub value: String,
    /// What it is.
    pub name: String,
    /// More about it.
    pub remark: String,
}

/// A part of the time.
#[derive(Debug, Serialize)]
pub struct Share {
    /// Of what.
    pub name: String,
    /// As text.
    pub value: String,
    /// 0 to 100, for a bar.
    pub percent: f64,
}

#[derive(Serialize)]
struct Data<'a> {
    schema_version: u32,
    width: usize,
    height: usize,
    rate: Option<f64>,
    frames: frames::Columns,
    thumbnails: thumbnails::Columns,
    bins: bins::Columns,
    tracks: Vec<paths::Record>,
    histograms: Vec<histogram::Record>,
    /// Null where targets were looked for everywhere.
    outline: Option<&'a Outline>,
    title: &'a str,
    /// Share of the best score below which a track is weak.
    weak: f64,
}

pub(super) fn page(gathered: &Gathered, about: &About) -> String {
    let (width, height) = gathered.size.map_or((0, 0), |size| (size.width, size.height));
    let histograms = [
        gathered.scores.record("score", about.score_marks.clone()),
        gathered.contrasts.record("equivalent contrast", about.contrast_marks.clone()),
    ];
    let data = Data {
        schema_version: SCHEMA_VERSION,
        width,
        height,
        rate: about.rate,
        frames: gathered.frames.columns(about.still.is_none()),
        thumbnails: gathered.thumbnails.columns(),
        bins: gathered.bins.columns(about.still.is_none()),
        tracks: gathered.paths.records(),
        histograms: histograms.into_iter().flatten().collect(),
        outline: gathered.outline.as_deref(),
        title: &about.title,
        weak: super::significant(f64::from(WEAK)),
    };
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    let values = context! {
        about => Serde(about),
        version => env!("CARGO_PKG_VERSION"),
        style => STYLE,
        script => SCRIPT,
        style_hash => hash(STYLE),
        script_hash => hash(SCRIPT),
        data => embedded(&data),
    };
    environment.render_str(TEMPLATE, values).expect("the template is ours and a test renders it")
}

/// JSON that no text in it can end.
fn embedded(data: &Data<'_>) -> String {
    serde_json::to_string(data).expect("numbers and text are JSON").replace('<', "\\u003c")
}

fn hash(text: &str) -> String {
    format!("sha256-{}", STANDARD.encode(Sha256::digest(text)))
}
