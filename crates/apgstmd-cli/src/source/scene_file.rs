//! A scene file made ready to be drawn. The core opens no files: the picture of a panorama is opened here.

use std::path::{Path, PathBuf};

use apgstmd_core::stimulus::{Background, Renderer, Scene, SceneError};
use ndarray::Array2;

use super::{Limit, decode};
use crate::Outcome;
use crate::failure::{Failure, reason, without_snippet};
use crate::text::read_settings;

/// Whether a path names a scene: it ends in `.toml`.
pub fn is_scene(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) && !path.is_dir()
}

/// A scene that can be drawn, and where it came from.
pub struct SceneFile {
    origin: PathBuf,
    renderer: Renderer,
}

/// What the command line sets in place of the file.
#[derive(Clone, Copy, Debug, Default)]
pub struct Overrides {
    /// Number of frames.
    pub frames: Option<usize>,
    /// Seed of background and noise.
    pub seed: Option<u64>,
}

impl SceneFile {
    /// Reads a scene file. A panorama is looked for beside it.
    ///
    /// # Errors
    /// An unreadable file or panorama; an unknown key, a value out of range, a target that is never in the picture.
    pub fn read(path: &Path) -> Outcome<Self> {
        Self::read_with(path, Overrides::default())
    }

    /// The same, with some values of the command line.
    ///
    /// # Errors
    /// As [`SceneFile::read`].
    pub fn read_with(path: &Path, overrides: Overrides) -> Outcome<Self> {
        let text = read_settings(path).map_err(|error| {
            Failure::failed(format_args!("cannot read the scene {}: {}", path.display(), reason(&error)))
        })?;
        Self::parse(&text, path, overrides)
    }

    /// From text. `origin` names it in messages, and a panorama is looked for beside it.
    ///
    /// # Errors
    /// As [`SceneFile::read`].
    pub fn parse(text: &str, origin: &Path, overrides: Overrides) -> Outcome<Self> {
        let scene = Scene::from_toml(text).map_err(|error| {
            let what = without_snippet(&error);
            Failure::usage(format_args!("{}: {}", origin.display(), what.trim_start_matches("scene: ")))
                .hint("`apgstmd synth --print` prints an example with every key")
        })?;
        Self::new(scene, origin, overrides)
    }

    /// From a scene.
    ///
    /// # Errors
    /// As [`SceneFile::read`].
    pub fn new(mut scene: Scene, origin: &Path, overrides: Overrides) -> Outcome<Self> {
        let written_for = scene.frames;
        scene.frames = overrides.frames.unwrap_or(scene.frames);
        scene.seed = overrides.seed.unwrap_or(scene.seed);
        let named = |error: SceneError| {
            let what = error.to_string();
            Failure::usage(format_args!("{}: {}", origin.display(), what.trim_start_matches("scene: ")))
        };
        scene.validate().map_err(named)?;
        let renderer = match &mut scene.background {
            Background::Panorama { file, .. } => {
                let (path, picture) = panorama(file, origin)?;
                *file = path;
                Renderer::with_panorama(&scene, picture.view())
            }
            _ => Renderer::new(&scene),
        };
        let renderer = renderer.map_err(named)?;
        // A scene cut short may well end before a target comes.
        check_targets(&renderer, written_for.max(scene.frames), origin)?;
        Ok(Self { origin: origin.to_owned(), renderer })
    }

    /// The scene, with the full path of its panorama.
    pub fn scene(&self) -> &Scene {
        self.renderer.scene()
    }

    /// Draws it.
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// Its name without folder and ending.
    pub fn stem(&self) -> String {
        self.origin.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy()).into_owned()
    }
}

/// Full path and luminance of the picture that a scene names.
fn panorama(file: &str, origin: &Path) -> Outcome<(String, Array2<f32>)> {
    if file.is_empty() {
        return Err(Failure::usage(format_args!(
            "{}: background.file is empty, but a panorama needs a picture",
            origin.display()
        )));
    }
    let path = origin.parent().unwrap_or(Path::new("")).join(file);
    let failed = |reason: String| {
        Failure::failed(format_args!("cannot use the panorama {} of {}: {reason}", path.display(), origin.display()))
    };
    let picture = decode::read(&path, None, Limit::default()).map_err(failed)?;
    let luminance = picture.frame().luminance().map_err(|error| failed(error.to_string()))?;
    let full = path.canonicalize().map_err(|error| failed(reason(&error)))?;
    let full = full.to_str().ok_or_else(|| failed("its path is no Unicode text".to_owned()))?;
    Ok((full.to_owned(), luminance.mapv_into(|value| value.clamp(0.0, 1.0))))
}

/// A target that nobody ever sees is a slip of the pen. A scene may claim to be endless: it is not looked at to its end.
fn check_targets(renderer: &Renderer, frames: usize, origin: &Path) -> Outcome {
    const LOOK: usize = 1_000_000;
    if frames > LOOK {
        return Ok(());
    }
    let scene = renderer.scene();
    let mut missing: Vec<usize> = (0..scene.targets.len()).collect();
    for t in 0..frames {
        if missing.is_empty() {
            return Ok(());
        }
        let there = renderer.truth(t);
        missing.retain(|id| there.iter().all(|row| row.id != *id));
    }
    match missing.first() {
        None => Ok(()),
        Some(id) => Err(Failure::usage(format_args!(
            "{}: target[{id}] is never in the picture: columns 0 to {}, rows 0 to {}, frames 0 to {}",
            origin.display(),
            scene.width - 1,
            scene.height - 1,
            frames - 1
        ))),
    }
}
