//! Files of settings, parameters and scenes, and lists: small ones, read whole.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Larger ones are something else: a complete parameter file has 20 kB.
const MOST_BYTES: u64 = 16 << 20;

/// Of a list: a million lines and more.
const MOST_LISTED: u64 = 256 << 20;

/// Reads a file of settings.
///
/// # Errors
/// It cannot be read, is no text, or is larger than any such file.
pub(crate) fn read_settings(path: &Path) -> io::Result<String> {
    let text = String::from_utf8(read(path, MOST_BYTES)?);
    text.map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "stream did not contain valid UTF-8"))
}

/// Reads a list.
///
/// # Errors
/// It cannot be read, or is larger than any list.
pub(crate) fn read_list(path: &Path) -> io::Result<Vec<u8>> {
    read(path, MOST_LISTED)
}

fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > most {
        true => Err(io::Error::other(format!("it has more than {} MiB, which no such file has", most >> 20))),
        false => Ok(bytes),
    }
}
