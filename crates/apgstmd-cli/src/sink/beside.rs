//! A file that is valid only as a whole: it grows beside its place and is moved there at the end.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::Outcome;
use crate::failure::Failure;

/// Removed when dropped, unless it was moved.
pub(crate) struct Beside {
    path: PathBuf,
    part: PathBuf,
}

impl Beside {
    /// Sees at once whether it will be possible to write.
    ///
    /// # Errors
    /// It is not.
    pub fn new(path: &Path) -> Outcome<Self> {
        Ok(Self::open(path)?.0)
    }

    /// The same, with the file itself. What stands there is replaced, and a link to elsewhere is not followed.
    ///
    /// # Errors
    /// It is not.
    pub fn open(path: &Path) -> Outcome<(Self, File)> {
        let part = Self::clear(path)?;
        // The place is named as the user knows it.
        let file = File::create_new(&part).map_err(|error| Failure::write(path, error))?;
        Ok((Self { path: path.to_owned(), part }, file))
    }

    /// Removes what a run that was killed left, and tells where that was.
    ///
    /// # Errors
    /// The system refuses.
    pub fn clear(path: &Path) -> Outcome<PathBuf> {
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(".part");
        let part = path.with_file_name(name);
        match fs::remove_file(&part) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(Failure::write(path, error)),
            _ => Ok(part),
        }
    }

    /// Where it will be.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Where it grows.
    pub fn part(&self) -> &Path {
        &self.part
    }

    /// Writes all of it, and moves it.
    ///
    /// # Errors
    /// Writing failed.
    pub fn write(&self, text: &str) -> Outcome {
        fs::write(&self.part, text).map_err(|error| Failure::write(&self.path, error))?;
        self.place()
    }

    /// Moves it to its place.
    ///
    /// # Errors
    /// The system refuses.
    pub fn place(&self) -> Outcome {
        fs::rename(&self.part, &self.path).map_err(|error| Failure::write(&self.path, error))
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        // Moved away, unless something failed.
        let _ = fs::remove_file(&self.part);
    }
}
