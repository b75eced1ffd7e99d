//! `--video` and `--report`: files that are to be looked at.

use std::path::PathBuf;

use super::Destination;
use super::tracks::{TrackSettings, check_file, same_place};
use crate::Outcome;
use crate::args::RunArgs;
use crate::failure::Failure;
use crate::sink::video::{FORMATS, format_of};

/// What is made to be looked at, besides `--overlay`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureSettings {
    /// The annotated video.
    pub video: Option<PathBuf>,
    /// With the response map beside it.
    pub response: bool,
    /// The page.
    pub report: Option<PathBuf>,
}

impl PictureSettings {
    /// Whether anything is.
    pub fn any(&self) -> bool {
        self.video.is_some() || self.report.is_some()
    }

    pub(super) fn resolve(args: &RunArgs, tracks: &TrackSettings, destination: &Destination) -> Outcome<Self> {
        let files = [("--video", &args.video), ("--report", &args.report)];
        let taken = [("--mot", &tracks.mot), ("--coco", &tracks.coco)];
        let given = |(flag, file): (&'static str, &Option<PathBuf>)| Some((flag, file.clone()?));
        let mut taken: Vec<(&str, PathBuf)> = taken.into_iter().filter_map(given).collect();
        for (flag, file) in files.into_iter().filter_map(given) {
            check_file(flag, &file, args, destination)?;
            if let Some((other, _)) = taken.iter().find(|(_, other)| same_place(other) == same_place(&file)) {
                return Err(Failure::usage(format_args!("{other} and {flag} are both {}", file.display())));
            }
            taken.push((flag, file));
        }
        if let Some(video) = &args.video
            && format_of(video).is_none()
        {
            let names: Vec<String> = FORMATS.iter().map(|(name, _)| format!(".{name}")).collect();
            return Err(Failure::usage(format_args!(
                "--video {}: its name must end in one of {}",
                video.display(),
                names.join(", ")
            )));
        }
        Ok(Self { video: args.video.clone(), response: args.video_response, report: args.report.clone() })
    }
}
