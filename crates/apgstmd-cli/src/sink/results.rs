//! The results folder: nothing in it is ever overwritten unasked, and asked, only what this program wrote.

use std::fs;
use std::path::{Path, PathBuf};

use super::dump::is_dump;
use super::png;
use crate::Outcome;
use crate::failure::Failure;

/// Tables and summary.
pub const CSV: &str = "detections.csv";
/// Tables and summary.
pub const JSONL: &str = "detections.jsonl";
/// Tables and summary.
pub const TRACKS: &str = "tracks.csv";
/// Tables and summary.
pub const RUN: &str = "run.json";
/// How the camera moved.
pub const CAMERA: &str = "camera.csv";
/// What a run can be resumed from.
pub const CHECKPOINT: &str = "checkpoint.safetensors";
/// Contact strip.
pub const STRIP: &str = "strip.png";
/// Readable summary of the demo.
pub const SUMMARY: &str = "summary.txt";
/// Folder of annotated pictures.
pub const OVERLAY: &str = "overlay";

/// Folder of inner maps, unless another is named.
pub const DUMP: &str = "dump";

/// All that stand in the folder itself.
pub const SINGLE_FILES: [&str; 8] = [CSV, JSONL, TRACKS, CAMERA, RUN, CHECKPOINT, STRIP, SUMMARY];

/// Folders that results go to.
#[derive(Clone, Debug)]
pub struct Results {
    folder: Option<PathBuf>,
    dumps: Option<PathBuf>,
}

impl Results {
    /// `folder` for tables and pictures; `dumps` where inner maps go, if they do.
    pub fn new(folder: PathBuf, dumps: Option<PathBuf>) -> Self {
        Self { dumps: Some(dumps.unwrap_or_else(|| folder.join(DUMP))), folder: Some(folder) }
    }

    /// Inner maps alone, beside a table on stdout.
    pub fn dumps_only(dumps: PathBuf) -> Self {
        Self { folder: None, dumps: Some(dumps) }
    }

    /// Refuses folders that cannot be, and without `force` those that hold results.
    ///
    /// # Errors
    /// A file in the way; earlier results.
    pub fn check(&self, force: bool) -> Outcome {
        for folder in [&self.folder, &self.dumps].into_iter().flatten() {
            refuse_file(folder)?;
        }
        if let Some(folder) = &self.folder {
            [OVERLAY, DUMP].iter().try_for_each(|name| refuse_link(&folder.join(name)))?;
        }
        match self.earlier().first() {
            Some(path) if !force => {
                Err(Failure::failed(format_args!("{} is there already from an earlier run", path.display()))
                    .hint("choose another folder with --out, replace the earlier results with --force, or go on with them with --resume"))
            }
            _ => Ok(()),
        }
    }

    /// Makes the folder and clears it of earlier results, which [`Results::check`] let pass.
    ///
    /// # Errors
    /// The system refuses.
    pub fn prepare(&self) -> Outcome {
        if let Some(folder) = &self.folder {
            fs::create_dir_all(folder)
                .map_err(|error| Failure::write(folder, error).hint("choose a folder you may write to with --out"))?;
        }
        for path in self.earlier() {
            fs::remove_file(&path).map_err(|error| Failure::write(&path, error))?;
        }
        Ok(())
    }

    /// Files of earlier runs.
    fn earlier(&self) -> Vec<PathBuf> {
        let mut files = Vec::new();
        if let Some(folder) = &self.folder {
            files.extend(SINGLE_FILES.iter().map(|name| folder.join(name)).filter(|path| stands(path)));
            files.extend(files_in(&folder.join(OVERLAY)).filter(|path| png::is_ours(path)));
        }
        if let Some(dumps) = &self.dumps {
            files.extend(files_in(dumps).filter(|path| is_dump(path)));
        }
        files
    }
}

/// Whether there is anything but a folder, a link to nowhere included.
fn stands(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|about| !about.is_dir())
}

/// A folder in the results folder is ours: through a link in its place nothing is written.
fn refuse_link(folder: &Path) -> Outcome {
    match fs::symlink_metadata(folder).is_ok_and(|about| about.is_symlink()) {
        true => Err(Failure::failed(format_args!("{} is a link, but a folder is needed there", folder.display()))
            .hint("remove the link, or choose another folder with --out")),
        false => Ok(()),
    }
}

fn refuse_file(folder: &Path) -> Outcome {
    if folder.exists() && !folder.is_dir() {
        return Err(Failure::failed(format_args!("{} is a file, but a folder is needed there", folder.display()))
            .hint("choose a folder with --out"));
    }
    Ok(())
}

fn files_in(folder: &Path) -> impl Iterator<Item = PathBuf> {
    fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).filter(|path| path.is_file())
}
