//! INPUT of `apgstmd batch` to clips: lists and patterns spelled out, each input once, and a safe name for each.

use std::collections::HashSet;
use std::path::{Path, PathBuf, absolute};

use crate::Outcome;
use crate::failure::{Failure, reason};
use crate::source::ffmpeg::Location;
use crate::source::{Numbered, is_picture};
use crate::text::read_list;

/// Longest name of a clip's folder, bytes: file systems take 255, and more is added to it.
const LONGEST_NAME: usize = 100;

/// Each input once, as a full path, in the order given.
///
/// # Errors
/// A list that cannot be read, a pattern that nothing matches, what is no clip on disk.
pub(super) fn expand(words: &[PathBuf]) -> Outcome<Vec<PathBuf>> {
    let mut all = Vec::new();
    for word in words {
        match list_of(word) {
            Some(list) => {
                for line in lines(&list)? {
                    all.extend(clips(&line)?);
                }
            }
            None => all.extend(clips(word)?),
        }
    }
    let mut seen = HashSet::new();
    all.retain(|path| seen.insert(real(path)));
    match all.is_empty() {
        true => Err(Failure::usage("the list names no videos: nothing is to be done")),
        false => Ok(all),
    }
}

/// Without links and detours, where it is there.
pub(super) fn real(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// The list that a word names.
fn list_of(word: &Path) -> Option<PathBuf> {
    if let Some(list) = word.to_str().and_then(|text| text.strip_prefix('@')) {
        return Some(PathBuf::from(list));
    }
    let is_text = word.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("txt"));
    (is_text && word.is_file()).then(|| word.to_owned())
}

fn lines(list: &Path) -> Outcome<Vec<PathBuf>> {
    let bytes = read_list(list).map_err(|error| {
        Failure::failed(format_args!("cannot read the list {}: {}", list.display(), reason(&error)))
            .hint("several lists can be given, and patterns")
    })?;
    // As `find -print0` writes it: names may hold anything else.
    let end = if bytes.contains(&0) { 0 } else { b'\n' };
    bytes
        .split(|byte| *byte == end)
        .map(|line| if end == 0 { line } else { line.strip_suffix(b"\r").unwrap_or(line) })
        .filter(|line| !line.is_empty())
        .map(|line| path_of(line, list))
        .collect()
}

#[cfg(unix)]
fn path_of(line: &[u8], _: &Path) -> Outcome<PathBuf> {
    use std::os::unix::ffi::OsStrExt;
    Ok(PathBuf::from(std::ffi::OsStr::from_bytes(line)))
}

#[cfg(not(unix))]
fn path_of(line: &[u8], list: &Path) -> Outcome<PathBuf> {
    let text = std::str::from_utf8(line)
        .map_err(|_| Failure::failed(format_args!("the list {} is no UTF-8 text", list.display())))?;
    Ok(PathBuf::from(text))
}

/// What one word stands for. What is not there is a clip nevertheless: it will be reported as failed.
fn clips(word: &Path) -> Outcome<Vec<PathBuf>> {
    let elsewhere = Location::of(word).map(|location| location.shown());
    if let Some(shown) = elsewhere.or_else(|| (word.as_os_str() == "-").then(|| "standard input".to_owned())) {
        return Err(Failure::usage(format_args!(
            "{shown} cannot be read again, but a batch takes clips on disk: videos, folders of pictures, scenes"
        ))
        .hint("`apgstmd run` takes cameras, addresses and standard input"));
    }
    let full = |path: &Path| {
        absolute(path).map_err(|error| {
            Failure::usage(format_args!("{:?} is no path: {}", path.display().to_string(), reason(&error)))
        })
    };
    let pattern = word.to_str().filter(|text| text.contains(['*', '?', '[']));
    let (Some(pattern), false) = (pattern, word.exists()) else { return Ok(vec![full(word)?]) };
    let options = glob::MatchOptions { require_literal_leading_dot: true, ..glob::MatchOptions::new() };
    let found = glob::glob_with(pattern, options)
        .map_err(|error| Failure::usage(format_args!("the pattern {pattern} cannot be used: {}", error.msg)))?;
    let mut found: Vec<PathBuf> = found.collect::<Result<_, _>>().map_err(|error| {
        Failure::failed(format_args!("cannot read {}: {}", error.path().display(), reason(error.error())))
    })?;
    if found.is_empty() {
        return Err(Failure::failed(format_args!("nothing matches the pattern {pattern}")));
    }
    let any = found.len();
    found.retain(|path| !is_picture(path));
    // Pictures are frames of one clip, as for `run`; beside videos they are no clips.
    if found.is_empty() && any > 0 {
        return Ok(vec![full(word)?]);
    }
    alphanumeric_sort::sort_path_slice(&mut found);
    found.iter().map(|path| full(path)).collect()
}

/// A name for the folder of a clip, from that of its input: letters, digits and some marks, never hidden, no way out of
/// any folder.
pub(super) fn name_of(input: &Path) -> String {
    let is_pattern =
        !input.exists() && (Numbered::parse(input).is_some() || input.to_string_lossy().contains(['*', '?', '[']));
    let named = if is_pattern { input.parent().unwrap_or(input) } else { input };
    let name = if named.is_dir() || is_pattern { named.file_name() } else { named.file_stem() };
    let plain = |c: char| if c.is_alphanumeric() || "-_.+ ".contains(c) { c } else { '_' };
    let name: String = name.unwrap_or_default().to_string_lossy().chars().map(plain).collect();
    let mut name = name.trim_start_matches(['.', '-', ' ']);
    while name.len() > LONGEST_NAME {
        let end = name.char_indices().next_back().map_or(0, |(at, _)| at);
        name = &name[..end];
    }
    match name.trim_end_matches(['.', ' ']) {
        "" => "clip".to_owned(),
        name if is_reserved(name) => format!("{name}_"),
        name => name.to_owned(),
    }
}

/// Windows keeps these names, with any ending, for devices.
fn is_reserved(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or_default().to_ascii_lowercase();
    let numbered =
        |port: &str| stem.strip_prefix(port).is_some_and(|n| n.len() == 1 && n.as_bytes()[0].is_ascii_digit());
    ["con", "prn", "aux", "nul"].contains(&stem.as_str()) || numbered("com") || numbered("lpt")
}

/// Makes a name that `taken` has not: `sky`, `sky-2`, `sky-3`. Large and small letters are one to some systems.
pub(super) fn distinct(name: &str, taken: &mut HashSet<String>) -> String {
    let numbered = (2..).map(|n| format!("{name}-{n}"));
    let free = std::iter::once(name.to_owned()).chain(numbered).find(|name| taken.insert(name.to_lowercase()));
    free.expect("there are enough numbers")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_safe() {
        for (input, name) in [
            ("/a/sky.mp4", "sky"),
            ("/a/..", "clip"),
            ("/", "clip"),
            ("/a/-x.avi", "x"),
            ("/a/.hidden", "hidden"),
            ("/a/<script>alert(1)<!--.mkv", "_script_alert_1___--"),
            ("/a/two\nlines.mp4", "two_lines"),
            ("/a/視頻 1.mp4", "視頻 1"),
            ("/a/NUL.mp4", "NUL_"),
            ("/a/com1.x.mp4", "com1.x_"),
            ("/a/cam0/f_%05d.tif", "cam0"),
            ("/a/cam0/*.png", "cam0"),
            ("/a/b\\..\\c.mp4", "b_.._c"),
        ] {
            let made = name_of(Path::new(input));
            assert_eq!(made, name, "{input:?}");
            assert!(!made.contains(['/', '\\', '<', '\n']) && !made.starts_with(['.', '-']), "{made:?}");
        }
        let long = name_of(Path::new(&format!("/a/{}.mp4", "é".repeat(300))));
        assert!(long.len() <= LONGEST_NAME && long.chars().all(|c| c == 'é'));
    }

    #[test]
    fn names_are_distinct() {
        let mut taken = HashSet::new();
        let names = ["sky", "Sky", "sky-2", "sky"].map(|name| distinct(name, &mut taken));
        assert_eq!(names, ["sky", "Sky-2", "sky-2-2", "sky-3"]);
    }
}
