//! INPUT to a list of picture files: a folder, a shell pattern (`frames/*.png`) or a printf pattern (`f_%05d.tif`).

use std::fs;
use std::path::{Path, PathBuf};

use crate::Outcome;
use crate::failure::{Failure, reason};

/// File name endings of pictures.
const ENDINGS: [&str; 9] = ["png", "jpg", "jpeg", "tif", "tiff", "bmp", "pgm", "ppm", "pnm"];
/// What can be given.
pub(super) const KINDS: &str = "INPUT is a video, a folder of pictures, a quoted pattern such as 'frames/*.png', \
                                SCENE.toml, /dev/video0, an rtsp:// or http:// address, or - for standard input";
const FORMATS: &str = "PNG, JPEG, TIFF, BMP, PGM and PPM are read";

/// The pictures of an INPUT in natural order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Listing {
    /// The folder all of them are in or below.
    pub folder: PathBuf,
    /// Paths, 2 before 10.
    pub files: Vec<PathBuf>,
}

impl Listing {
    /// Finds the pictures. Hidden files and files that are no pictures by their name are left out.
    ///
    /// # Errors
    /// Nothing there, or no pictures in it.
    pub fn of(input: &Path) -> Outcome<Self> {
        let (folder, candidates) = if input.is_dir() {
            (input.to_owned(), folder_files(input)?)
        } else if input.is_file() {
            return Err(single_file(input));
        } else if let Some(pattern) = Numbered::parse(input) {
            let files = folder_files(&pattern.folder)?;
            let files = files.into_iter().filter(|path| pattern.matches(path)).collect();
            (pattern.folder, files)
        } else if let Some(pattern) = input.to_str().filter(|text| text.contains(['*', '?', '['])) {
            (fixed_part(pattern), glob_files(pattern)?)
        } else {
            return Err(Failure::failed(format_args!("there is no file or folder {}", input.display())).hint(KINDS));
        };
        let found = candidates.len();
        let mut files: Vec<PathBuf> = candidates.into_iter().filter(|path| is_named_as_picture(path)).collect();
        if files.is_empty() {
            let others = match found {
                0 => String::new(),
                1 => " (1 other file)".to_owned(),
                n => format!(" ({n} other files)"),
            };
            let place = if input.is_dir() { "there are no pictures in" } else { "no picture matches" };
            return Err(Failure::failed(format_args!("{place} {}{others}: {FORMATS}", input.display())));
        }
        sort(&mut files);
        Ok(Self { folder, files })
    }

    /// What a table calls this file: its name, with the folders below [`Listing::folder`] where there are any.
    pub fn name(&self, path: &Path) -> String {
        let path = path.strip_prefix(&self.folder).unwrap_or(path);
        path.to_string_lossy().replace('\\', "/")
    }
}

/// In natural order.
pub(super) fn sort(files: &mut [PathBuf]) {
    alphanumeric_sort::sort_path_slice(files);
}

fn single_file(input: &Path) -> Failure {
    Failure::failed(format_args!("{} is a file with one picture, but motion shows only in a sequence", input.display()))
        .hint("give the folder, or a pattern such as 'frames/*.png'")
}

/// Whether a file is taken for a frame, by its name.
pub(crate) fn is_picture(path: &Path) -> bool {
    is_named_as_picture(path) && may_be_file(path)
}

fn is_named_as_picture(path: &Path) -> bool {
    let hidden = path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    !hidden && ending.is_some_and(|ending| ENDINGS.contains(&ending.as_str()))
}

/// Whether it is a file, or cannot be looked at (a link that leads nowhere, a disk that fails): reading that says so, where
/// otherwise a frame would be missing without a word.
fn may_be_file(path: &Path) -> bool {
    fs::metadata(path).map_or(true, |about| about.is_file())
}

fn folder_files(folder: &Path) -> Outcome<Vec<PathBuf>> {
    let unreadable =
        |error| Failure::failed(format_args!("cannot read the folder {}: {}", folder.display(), reason(&error)));
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        if may_be_file(&path) {
            files.push(path);
        }
    }
    Ok(files)
}

fn glob_files(pattern: &str) -> Outcome<Vec<PathBuf>> {
    let paths = glob::glob(pattern)
        .map_err(|error| Failure::usage(format_args!("the pattern {pattern} cannot be used: {}", error.msg)))?;
    let mut files = Vec::new();
    for path in paths {
        let path = path.map_err(|error| {
            Failure::failed(format_args!("cannot read {}: {}", error.path().display(), reason(error.error())))
        })?;
        if may_be_file(&path) {
            files.push(path);
        }
    }
    Ok(files)
}

/// The folders of a shell pattern before its first wildcard.
fn fixed_part(pattern: &str) -> PathBuf {
    let fixed = &pattern[..pattern.find(['*', '?', '[']).unwrap_or(pattern.len())];
    let end = fixed.rfind(std::path::is_separator).map_or(0, |at| at + 1);
    PathBuf::from(&fixed[..end])
}

/// A printf pattern: one `%d` or `%05d` in the file name.
pub(crate) struct Numbered {
    folder: PathBuf,
    before: String,
    after: String,
    least_digits: usize,
}

impl Numbered {
    pub(crate) fn parse(input: &Path) -> Option<Self> {
        let name = input.file_name()?.to_str()?;
        let (before, rest) = name.split_once('%')?;
        let (digits, after) = rest.split_once('d')?;
        if !digits.chars().all(|c| c.is_ascii_digit()) || after.contains('%') {
            return None;
        }
        let least_digits = match digits {
            "" => 1,
            digits => digits.parse::<usize>().ok()?.max(1),
        };
        let folder = match input.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
            _ => PathBuf::from("."),
        };
        Some(Self { folder, before: before.to_owned(), after: after.to_owned(), least_digits })
    }

    pub fn matches(&self, path: &Path) -> bool {
        let name = path.file_name().and_then(|name| name.to_str());
        let digits = name.and_then(|name| name.strip_prefix(&*self.before)?.strip_suffix(&*self.after));
        digits.is_some_and(|digits| digits.len() >= self.least_digits && digits.bytes().all(|b| b.is_ascii_digit()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printf_patterns() {
        let pattern = Numbered::parse(Path::new("a/f_%03d.tif")).unwrap();
        assert_eq!(pattern.folder, Path::new("a"));
        for (name, matches) in [("f_001.tif", true), ("f_1000.tif", true), ("f_01.tif", false), ("f_00x.tif", false)] {
            assert_eq!(pattern.matches(Path::new(name)), matches, "{name}");
        }
        assert!(Numbered::parse(Path::new("f%d.png")).unwrap().matches(Path::new("f7.png")));
        assert!(Numbered::parse(Path::new("100%.png")).is_none());
    }

    #[test]
    fn fixed_part_of_patterns() {
        for (pattern, fixed) in [("a/b/*.png", "a/b/"), ("*.png", ""), ("a/b?/c.png", "a/"), ("/x[0-9]/y", "/")] {
            assert_eq!(fixed_part(pattern), Path::new(fixed));
        }
    }
}
