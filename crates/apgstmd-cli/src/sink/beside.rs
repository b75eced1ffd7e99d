//! A file that is valid only as a whole: it grows beside its place and is moved there at the end.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
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

    /// The same, with the file itself. What stands there is replaced, also a link, but no device
    /// or pipe.
    ///
    /// # Errors
    /// It is not.
    pub fn open(path: &Path) -> Outcome<(Self, File)> {
        let special = |about: fs::Metadata| !(about.is_file() || about.is_dir());
        if fs::metadata(path).is_ok_and(special) {
            let what =
                format_args!("cannot write {}: it is a device or a pipe, which a file would replace", path.display());
            return Err(Failure::failed(what).hint("name a file"));
        }
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
    pub fn write(&self, content: impl AsRef<[u8]>) -> Outcome {
        fs::write(&self.part, content).map_err(|error| Failure::write(&self.path, error))?;
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

/// Writes a file as a whole or not at all; what a link or a device leads to is written to as it is.
///
/// # Errors
/// Writing failed.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> Outcome {
    match fs::symlink_metadata(path) {
        Ok(about) if !about.is_file() => fs::write(path, content).map_err(|error| Failure::write(path, error)),
        _ => Beside::new(path)?.write(content),
    }
}

/// Writes a file that is not there yet, as a whole or not at all.
///
/// # Errors
/// It is there; writing failed.
pub fn create(path: &Path, fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Outcome {
    if fs::symlink_metadata(path).is_ok() {
        return Err(Failure::failed(format_args!("cannot write {}: it is there already", path.display())));
    }
    let (beside, file) = Beside::open(path)?;
    let mut out = BufWriter::new(file);
    fill(&mut out).and_then(|()| out.flush()).map_err(|error| Failure::write(path, error))?;
    beside.place()
}

impl Drop for Beside {
    fn drop(&mut self) {
        // Moved away, unless something failed.
        let _ = fs::remove_file(&self.part);
    }
}
