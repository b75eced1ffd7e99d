//! INPUT of `apgstmd run`: pictures or a scene.

use std::path::Path;

use super::{FrameSource, Listing, PictureFiles, SceneFile, SceneFrames, Selection, is_scene};
use crate::Outcome;

/// What there is to see.
pub enum Input {
    /// Picture files.
    Pictures(Listing),
    /// A scene, drawn on the way.
    Scene(Box<SceneFile>),
}

impl Input {
    /// Finds the pictures, or reads the scene where the name ends in `.toml`.
    ///
    /// # Errors
    /// Nothing there, no pictures, a scene that cannot be drawn.
    pub fn of(path: &Path) -> Outcome<Self> {
        if is_scene(path) {
            return Ok(Self::Scene(Box::new(SceneFile::read(path)?)));
        }
        Listing::of(path).map(Self::Pictures)
    }

    /// How many frames it has.
    pub fn count(&self) -> usize {
        match self {
            Self::Pictures(listing) => listing.files.len(),
            Self::Scene(file) => file.scene().frames,
        }
    }

    /// What results are named after.
    pub fn name(&self) -> String {
        match self {
            Self::Pictures(listing) => {
                let folder = if listing.folder.as_os_str().is_empty() { Path::new(".") } else { &listing.folder };
                let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
                folder.file_name().map_or("frames".into(), |name| name.to_string_lossy()).into_owned()
            }
            Self::Scene(file) => file.stem(),
        }
    }

    /// The selected frames as streams that take turns, at most `parts` of them, to be read side by side.
    pub fn open(&self, selection: Selection, bit_depth: Option<u32>, parts: usize) -> Vec<Box<dyn FrameSource + '_>> {
        let open = |part: Selection| -> Box<dyn FrameSource + '_> {
            match self {
                Self::Pictures(listing) => Box::new(PictureFiles::new(listing, part, bit_depth)),
                Self::Scene(file) => Box::new(SceneFrames::new(file.renderer(), part)),
            }
        };
        selection.turns(parts).map(open).collect()
    }
}
