//! Which inner maps `run` writes: `--dump`, `--dump-frames`, `--dump-dir`.

use std::collections::HashSet;
use std::ops::RangeInclusive;
use std::path::PathBuf;

use apgstmd_core::{MissingStage, Model, Stage};

use super::Destination;
use crate::Outcome;
use crate::args::RunArgs;
use crate::failure::Failure;
use crate::source::{Selection, Span};

/// Which inner maps go where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DumpSettings {
    /// The stages.
    pub stages: Vec<Stage>,
    /// The frames; `None` is all.
    pub frames: Option<FrameList>,
    /// The folder.
    pub folder: PathBuf,
}

impl DumpSettings {
    /// The stages to write of `frame`.
    pub fn stages_of(&self, frame: usize) -> &[Stage] {
        let wanted = self.frames.as_ref().is_none_or(|frames| frames.contains(frame));
        if wanted { &self.stages } else { &[] }
    }

    /// `selection` are the frames of `span` where they are known.
    pub(super) fn resolve(
        args: &RunArgs,
        model: Model,
        (span, selection): (Span, Option<&Selection>),
        destination: &Destination,
    ) -> Outcome<Option<Self>> {
        let Some(stages) = &args.dump else { return Ok(None) };
        let folder = match (&args.dump_dir, destination) {
            (Some(folder), _) => folder.clone(),
            (None, Destination::Folder(folder)) => folder.join("dump"),
            (None, Destination::Stdout) => return Err(Failure::usage("--dump with --out - needs --dump-dir DIR")),
        };
        let list = args.dump_frames.as_ref();
        Ok(Some(Self {
            stages: stage_list(stages, model)?,
            frames: list.map(|list| FrameList::parse(list, span, selection)).transpose()?,
            folder,
        }))
    }
}

fn stage_list(text: &str, model: Model) -> Outcome<Vec<Stage>> {
    let mut stages = Vec::new();
    for name in text.split(',').map(str::trim).filter(|name| !name.is_empty()) {
        if name.eq_ignore_ascii_case("all") {
            stages.extend(model.stages());
        } else {
            let stage: Stage = name.parse().map_err(|error| Failure::usage(format_args!("--dump: {error}, or ALL")))?;
            if !model.stages().contains(&stage) {
                return Err(Failure::usage(format_args!("--dump: {}, or ALL", MissingStage { stage, model })));
            }
            stages.push(stage);
        }
    }
    if stages.is_empty() {
        return Err(Failure::usage("--dump names no stage: e.g. --dump E,Q, or --dump ALL"));
    }
    let mut seen = HashSet::new();
    stages.retain(|stage| seen.insert(*stage));
    Ok(stages)
}

/// Frames and ranges of frames, both ends included.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameList(Vec<RangeInclusive<usize>>);

impl FrameList {
    /// Whether the list names `frame`.
    pub fn contains(&self, frame: usize) -> bool {
        self.0.iter().any(|range| range.contains(&frame))
    }

    /// `selection` are the frames of `span` where they are known.
    fn parse(text: &str, span: Span, selection: Option<&Selection>) -> Outcome<Self> {
        let mut ranges = Vec::new();
        for item in text.split(',').map(str::trim).filter(|item| !item.is_empty()) {
            let range = parse_range(item).ok_or_else(|| {
                Failure::usage(format_args!("--dump-frames: `{item}` is no frame number or range such as 120..130"))
            })?;
            let (first, last) = (*range.start(), *range.end());
            if first > last {
                return Err(Failure::usage(format_args!("--dump-frames: the range {item} ends before it starts")));
            }
            if let Some((start, end)) =
                selection.and_then(|used| Some((*used.frames().first()?, *used.frames().last()?)))
            {
                let in_run = |frame: usize| (start..=end).contains(&frame);
                let used = |frame| selection.is_some_and(|used| used.contains(frame));
                if !in_run(first) || !in_run(last) || !range.clone().any(used) {
                    return Err(Failure::usage(format_args!(
                        "--dump-frames: {item} is not in this run, which uses frames {start} to {end} in steps of {}",
                        span.step
                    )));
                }
            }
            ranges.push(range);
        }
        if ranges.is_empty() {
            return Err(Failure::usage("--dump-frames names no frame: e.g. 60,120..130"));
        }
        Ok(Self(ranges))
    }
}

/// `7` or `3..9`, both ends included.
pub(crate) fn parse_range(item: &str) -> Option<RangeInclusive<usize>> {
    match item.split_once("..") {
        None => item.parse().ok().map(|frame| frame..=frame),
        Some((first, last)) => Some(first.trim().parse().ok()?..=last.trim_start_matches('=').trim().parse().ok()?),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::Place;

    #[test]
    fn frame_lists() {
        let span = Span::new(Place::Frames(10), Some(Place::Frames(200)), Place::Frames(2)).unwrap();
        let selection = span.of(500, None).unwrap();
        let parse = |text| FrameList::parse(text, span, Some(&selection));
        let list = parse("60, 120..130").unwrap();
        assert!(list.contains(60) && list.contains(120) && list.contains(130));
        assert!(!list.contains(61) && !list.contains(131));
        for bad in ["", "x", "61", "8", "500", "190..210", "20..10", "1..", "-3"] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn stage_lists() {
        let of = |text, model| stage_list(text, model);
        assert_eq!(of("E,Q,E", Model::ApgStmd).unwrap(), [Stage::E, Stage::Q]);
        assert_eq!(of("ALL", Model::ApgStmd).unwrap(), Model::ApgStmd.stages());
        assert_eq!(of("all", Model::Estmd).unwrap(), Model::Estmd.stages());
        for (text, model, said) in [("E,X", Model::ApgStmd, "Tm1_4"), ("Q", Model::Estmd, "estmd has no stage `Q`")] {
            let Err(Failure::Usage(message)) = of(text, model) else { panic!("{model} has no {text}") };
            assert!(format!("{message:?}").contains(said), "{message:?}");
        }
    }
}
