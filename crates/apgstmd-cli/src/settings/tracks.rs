//! Files of tracks: tracks.csv, `--mot`, `--coco`, `--box-size`.

use std::path::{Path, PathBuf};

use apgstmd_core::Params;

use super::Destination;
use crate::Outcome;
use crate::args::RunArgs;
use crate::failure::Failure;
use crate::sink::results::{SINGLE_FILES, TRACKS};

/// What is written of tracks, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackSettings {
    /// tracks.csv.
    pub csv: Option<PathBuf>,
    /// MOTChallenge text.
    pub mot: Option<PathBuf>,
    /// COCO JSON.
    pub coco: Option<PathBuf>,
    /// Side of the box that stands for a point, px.
    pub box_size: f64,
}

impl TrackSettings {
    /// Whether tracks are wanted at all.
    pub fn any(&self) -> bool {
        self.csv.is_some() || self.mot.is_some() || self.coco.is_some()
    }

    pub(super) fn resolve(args: &RunArgs, params: &Params, destination: &Destination) -> Outcome<Self> {
        const LARGEST: f64 = 1000.0;
        if let Some(side) = args.box_size {
            if args.mot.is_none() && args.coco.is_none() {
                return Err(Failure::usage("--box-size is for --mot and --coco: tracks.csv holds points"));
            }
            if !(side > 0.0 && side <= LARGEST) {
                return Err(Failure::usage(format_args!(
                    "--box-size is {side}, but it must be a number of pixels above 0, at most {LARGEST}"
                )));
            }
        }
        let files = [("--mot", &args.mot), ("--coco", &args.coco)];
        for (flag, file) in files.iter().filter_map(|(flag, file)| Some((*flag, file.as_deref()?))) {
            check_file(flag, file, args, destination)?;
        }
        if let (Some(mot), Some(coco)) = (&args.mot, &args.coco)
            && same_place(mot) == same_place(coco)
        {
            return Err(Failure::usage(format_args!("--mot and --coco are both {}", mot.display())));
        }
        let csv = match destination {
            Destination::Folder(folder) if !args.no_tracks => Some(folder.join(TRACKS)),
            _ => None,
        };
        Ok(Self {
            csv,
            mot: args.mot.clone(),
            coco: args.coco.clone(),
            box_size: args.box_size.unwrap_or_else(|| params.target_size()),
        })
    }
}

/// A file named on the command line, before anything is computed.
pub(super) fn check_file(flag: &str, file: &Path, args: &RunArgs, destination: &Destination) -> Outcome {
    if file.file_name().is_none() || file.as_os_str() == "-" || file.is_dir() {
        return Err(Failure::usage(format_args!(
            "{flag} needs the name of a file, not {:?}",
            file.display().to_string()
        )));
    }
    if same_place(file) == same_place(&args.input) {
        return Err(Failure::usage(format_args!("{flag} {} would replace INPUT", file.display())));
    }
    // All but MOTChallenge text are moved to their place as a whole.
    if file.is_symlink() && flag != "--mot" {
        return Err(Failure::usage(format_args!("{flag} {} is a link, which would be replaced", file.display()))
            .hint("name the file that it leads to"));
    }
    if file.exists() && !(args.force || args.resume) {
        return Err(Failure::failed(format_args!("{} is there already", file.display()))
            .hint(format_args!("choose another file with {flag}, or replace it with --force")));
    }
    let results = match destination {
        Destination::Folder(folder) => Some(folder),
        Destination::Stdout => None,
    };
    let is = |path: &Path| same_place(path) == same_place(file);
    if let Some(name) = results.and_then(|folder| SINGLE_FILES.iter().find(|name| is(&folder.join(name)))) {
        return Err(Failure::usage(format_args!("{flag} {}: {name} is another result's name", file.display())));
    }
    // The folder of results is made when there is something to write.
    let made = results.zip(file.file_name()).is_some_and(|(folder, name)| is(&folder.join(name)));
    match file.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.is_dir() && !made) {
        Some(folder) => Err(Failure::failed(format_args!(
            "cannot write {}: there is no folder {}",
            file.display(),
            folder.display()
        ))
        .hint(format_args!("make it first, or choose another file with {flag}"))),
        None => Ok(()),
    }
}

/// The same for two names of one file, whether it is there or not.
pub(super) fn same_place(file: &Path) -> PathBuf {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (file.canonicalize(), folder.canonicalize(), file.file_name()) {
        (Ok(full), ..) => full,
        (_, Ok(folder), Some(name)) => folder.join(name),
        _ => std::path::absolute(file).unwrap_or_else(|_| file.to_owned()),
    }
}
