//! A rendered scene on disk: `scene_000000.png` and so on, `truth.csv`, `scene.toml`. As with results, nothing is
//! overwritten unasked, and asked, only what this program wrote. Pictures of others are refused altogether: they would
//! be read as frames.

use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

use apgstmd_core::stimulus::{Renderer, Scene, Truth, truth_to_csv};
use ndarray::Array2;
use png::{BitDepth, ColorType};

use super::png as picture;
use crate::Outcome;
use crate::failure::{Failure, reason};
use crate::source::{frame_name, is_picture};

/// Ground truth.
pub const TRUTH: &str = "truth.csv";
/// The scene as it was drawn.
pub const SCENE: &str = "scene.toml";
const SCENE_MARK: &str = "# Rendered by apgstmd ";

/// A folder that a scene is rendered into.
pub struct SceneFolder {
    folder: PathBuf,
    depth: BitDepth,
    truth: Option<File>,
}

impl SceneFolder {
    /// Pictures of 8 or 16 bits.
    pub fn new(folder: PathBuf, sixteen: bool) -> Self {
        Self { folder, depth: if sixteen { BitDepth::Sixteen } else { BitDepth::Eight }, truth: None }
    }

    /// Refuses what must not be overwritten or mixed.
    ///
    /// # Errors
    /// A file in the way; an earlier scene without `force`; anything of the same names, or pictures, by others.
    pub fn check(&self, force: bool) -> Outcome {
        let place = self.folder.display();
        if self.folder.exists() && !self.folder.is_dir() {
            return Err(Failure::failed(format_args!("{place} is a file, but a folder is needed there"))
                .hint("choose a folder with --out"));
        }
        let (ours, others) = self.earlier()?;
        if let Some(path) = others.first() {
            return Err(Failure::failed(format_args!(
                "{} is there already, and not from a scene: it is not replaced, nor mixed with frames",
                path.display()
            ))
            .hint("choose another folder with --out"));
        }
        match ours.first() {
            Some(path) if !force => {
                Err(Failure::failed(format_args!("{} is there already from an earlier scene", path.display()))
                    .hint("choose another folder with --out, or replace the earlier scene with --force"))
            }
            _ => Ok(()),
        }
    }

    /// Makes the folder, clears it of an earlier scene, writes `scene.toml` and the head of `truth.csv`.
    ///
    /// # Errors
    /// The system refuses.
    pub fn begin(&mut self, scene: &Scene) -> Outcome {
        fs::create_dir_all(&self.folder)
            .map_err(|error| Failure::write(&self.folder, error).hint("choose a folder you may write to with --out"))?;
        for path in self.earlier()?.0 {
            fs::remove_file(&path).map_err(|error| Failure::write(&path, error))?;
        }
        let path = self.folder.join(SCENE);
        fs::write(&path, scene_text(scene)).map_err(|error| Failure::write(&path, error))?;
        let path = self.folder.join(TRUTH);
        let file = File::create(&path).and_then(|mut file| file.write_all(truth_to_csv(&[]).as_bytes()).map(|()| file));
        self.truth = Some(file.map_err(|error| Failure::write(&path, error))?);
        Ok(())
    }

    /// Draws and writes a frame; several threads may do so at once.
    ///
    /// # Errors
    /// Writing failed.
    pub fn write_frame(&self, renderer: &Renderer, frame: usize) -> Outcome<Vec<Truth>> {
        let luminance = renderer.frame(frame);
        let path = self.folder.join(format!("{}.png", frame_name(frame)));
        let size = (luminance.ncols() as u32, luminance.nrows() as u32);
        picture::write(&path, size, (ColorType::Grayscale, self.depth), &samples(&luminance, self.depth))?;
        Ok(renderer.truth(frame))
    }

    /// Adds the truth of the next frames.
    ///
    /// # Errors
    /// Writing failed.
    pub fn write_truth(&mut self, rows: &[Truth]) -> Outcome {
        let text = truth_to_csv(rows);
        let body = text.split_once('\n').map_or("", |(_, body)| body);
        let Some(file) = &mut self.truth else { return Ok(()) };
        file.write_all(body.as_bytes()).map_err(|error| Failure::write(&self.folder.join(TRUTH), error))
    }

    /// Files of an earlier scene, and files in the way that are none of it.
    fn earlier(&self) -> Outcome<(Vec<PathBuf>, Vec<PathBuf>)> {
        if !self.folder.is_dir() {
            return Ok((Vec::new(), Vec::new()));
        }
        let unreadable = |error: io::Error| {
            Failure::failed(format_args!("cannot read the folder {}: {}", self.folder.display(), reason(&error)))
        };
        let (mut ours, mut others) = (Vec::new(), Vec::new());
        for entry in fs::read_dir(&self.folder).map_err(unreadable)? {
            let path = entry.map_err(unreadable)?.path();
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            let own = match name {
                TRUTH => begins_with(&path, truth_to_csv(&[]).trim_end()),
                SCENE => begins_with(&path, SCENE_MARK),
                _ if is_picture(&path) => is_frame(name) && picture::is_ours(&path),
                _ => continue,
            };
            if own { ours.push(path) } else { others.push(path) }
        }
        ours.sort();
        others.sort();
        Ok((ours, others))
    }
}

/// A scene as `scene.toml` holds it.
pub fn scene_text(scene: &Scene) -> String {
    format!("{SCENE_MARK}{}: `apgstmd synth` draws it again.\n\n{}", env!("CARGO_PKG_VERSION"), scene.to_toml())
}

fn is_frame(name: &str) -> bool {
    let digits = name.strip_prefix("scene_").and_then(|rest| rest.strip_suffix(".png"));
    digits.is_some_and(|digits| digits.len() >= 6 && digits.bytes().all(|b| b.is_ascii_digit()))
}

fn begins_with(path: &Path, text: &str) -> bool {
    let mut line = String::new();
    File::open(path).is_ok_and(|file| BufReader::new(file).read_line(&mut line).is_ok()) && line.starts_with(text)
}

/// Luminance rounded to the nearest level.
fn samples(luminance: &Array2<f32>, depth: BitDepth) -> Vec<u8> {
    match depth {
        BitDepth::Sixteen => {
            luminance.iter().flat_map(|value| ((value * 65535.0).round() as u16).to_be_bytes()).collect()
        }
        _ => luminance.iter().map(|value| (value * 255.0).round() as u8).collect(),
    }
}
