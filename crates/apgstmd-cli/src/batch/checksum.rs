//! SHA-256 of what goes in and of what comes out.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use apgstmd_core::stimulus::Background;
use sha2::{Digest, Sha256};

use super::record::{FileRecord, InputRecord};
use crate::Outcome;
use crate::failure::{Failure, reason};
use crate::source::{Listing, SceneFile, is_picture, is_scene};

/// Read at a time, bytes.
const PIECE: usize = 1 << 20;

/// What is known of an input: of one file its SHA-256; of several that of the text that `sha256sum` prints for them, with
/// their names in the listing.
///
/// # Errors
/// It cannot be read; interrupted by `stop`.
pub(super) fn input(path: &Path, stop: &dyn Fn() -> bool) -> Outcome<InputRecord> {
    let files = files_of(path)?;
    let mut record = InputRecord::named(path);
    let mut listed = String::new();
    for (name, file) in &files {
        let about = fs::metadata(file).map_err(|error| unreadable(file, &error))?;
        let seconds = about.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        let latest = record.modified.unwrap_or(0.0).max(seconds.map_or(0.0, |time| time.as_secs_f64()));
        let sum = of_file(file, stop)?;
        record.modified = Some(super::rounded(latest));
        record.files += 1;
        record.bytes += sum.bytes;
        listed.push_str(&format!("{}  {name}\n", sum.sha256));
        record.sha256 = Some(sum.sha256);
    }
    if files.len() > 1 {
        record.sha256 = Some(hex(&Sha256::digest(listed)));
    }
    Ok(record)
}

/// Size and SHA-256 of a file.
///
/// # Errors
/// It cannot be read; interrupted by `stop`.
pub(super) fn of_file(path: &Path, stop: &dyn Fn() -> bool) -> Outcome<FileRecord> {
    let mut file = File::open(path).map_err(|error| unreadable(path, &error))?;
    let mut sum = Sha256::new();
    let mut piece = vec![0; PIECE];
    let mut bytes = 0;
    loop {
        if stop() {
            return Err(Failure::Interrupted);
        }
        match file.read(&mut piece).map_err(|error| unreadable(path, &error))? {
            0 => return Ok(FileRecord { bytes, sha256: hex(&sum.finalize()) }),
            read => {
                sum.update(&piece[..read]);
                bytes += read as u64;
            }
        }
    }
}

/// The files an input is made of, with the names they have in it.
fn files_of(input: &Path) -> Outcome<Vec<(String, PathBuf)>> {
    let own = |path: &Path| (path.file_name().unwrap_or_default().to_string_lossy().into_owned(), path.to_owned());
    if is_scene(input) {
        let mut files = vec![own(input)];
        if let Background::Panorama { file, .. } = &SceneFile::read(input)?.scene().background {
            files.push(own(Path::new(file)));
        }
        return Ok(files);
    }
    if input.is_file() && !is_picture(input) {
        return Ok(vec![own(input)]);
    }
    let listing = Listing::of(input)?;
    Ok(listing.files.iter().map(|file| (listing.name(file), file.clone())).collect())
}

fn unreadable(path: &Path, error: &std::io::Error) -> Failure {
    Failure::failed(format_args!("cannot read {}: {}", path.display(), reason(error)))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_sha256sum() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            fs::write(&path, text).unwrap();
            path
        };
        let never = || false;
        let video = input(&write("x.mp4", "abc"), &never).unwrap();
        assert_eq!((video.files, video.bytes), (1, 3));
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(video.sha256.as_deref(), Some(abc));
        write("2.png", "abc");
        write("10.png", "");
        let pictures = input(folder.path(), &never).unwrap();
        assert_eq!((pictures.files, pictures.bytes), (2, 3));
        // printf '%s  2.png\n%s  10.png\n' $(printf abc | sha256sum | cut -c-64) $(printf '' | sha256sum | cut -c-64) | sha256sum
        let nothing = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
        let listed = hex(&Sha256::digest(format!("{abc}  2.png\n{nothing}  10.png\n")));
        assert_eq!(pictures.sha256, Some(listed));
        assert!(matches!(input(folder.path(), &|| true), Err(Failure::Interrupted)));
    }
}
