//! Files of settings: parameters and scenes.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Larger ones are something else: a complete parameter file has 20 kB.
const MOST_BYTES: u64 = 16 << 20;

/// Reads a file of settings.
///
/// # Errors
/// It cannot be read, is no text, or is larger than any such file.
pub(crate) fn read_settings(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    File::open(path)?.take(MOST_BYTES + 1).read_to_string(&mut text)?;
    if text.len() as u64 > MOST_BYTES {
        return Err(io::Error::other(format!("it has more than {} MiB, which no such file has", MOST_BYTES >> 20)));
    }
    Ok(text)
}
