//! What a scene is made of, as a TOML file or a struct. Every field has a default: the paper's white background.

use serde::{Deserialize, Serialize};

use super::camera::Camera;
use super::error::SceneError;
use super::path::Path;

/// A synthetic scene. Lengths in pixels, times in frames where a field counts frames, else in seconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Scene {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Frames per second, Hz.
    pub rate: f64,
    /// Number of frames.
    pub frames: usize,
    /// Seed of the background and of the noise; below 2^63, the largest integer of TOML.
    pub seed: u64,
    /// Standard deviation of the Gaussian noise of every pixel in every frame, luminance.
    pub noise: f64,
    /// What lies behind everything.
    pub background: Background,
    /// How the camera moves before the background.
    #[serde(skip_serializing_if = "Camera::is_still")]
    pub camera: Camera,
    /// Large moving rectangles, drawn behind the targets.
    #[serde(rename = "object", skip_serializing_if = "Vec::is_empty")]
    pub objects: Vec<Object>,
    /// Small moving targets, the only things the ground truth names.
    #[serde(rename = "target", skip_serializing_if = "Vec::is_empty")]
    pub targets: Vec<Target>,
    /// Rectangles drawn over the targets.
    #[serde(rename = "occluder", skip_serializing_if = "Vec::is_empty")]
    pub occluders: Vec<Object>,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            width: 500,
            height: 250,
            rate: 1000.0,
            frames: 1000,
            seed: 1,
            noise: 0.0,
            background: Background::Uniform { luminance: 1.0 },
            camera: Camera::default(),
            objects: Vec::new(),
            targets: Vec::new(),
            occluders: Vec::new(),
        }
    }
}

/// What lies behind everything.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum Background {
    /// One luminance everywhere.
    Uniform {
        /// Luminance in [0, 1].
        luminance: f64,
    },
    /// Random clutter with the power spectrum of natural scenes, 1/f^2. It repeats after the next power of two at or
    /// above each side of the scene (at most 2048 px), so that it can move for ever.
    Natural {
        /// Mean luminance over one period.
        #[serde(default = "half")]
        mean: f64,
        /// Root-mean-square contrast: standard deviation of the luminance over one period.
        #[serde(default = "fifth")]
        contrast: f64,
        /// Velocity (right, down), px/s.
        #[serde(default)]
        velocity: [f64; 2],
    },
    /// A picture of the caller, repeated horizontally and mirrored vertically, so that it can move for ever.
    Panorama {
        /// Where the caller finds the picture. The core opens no files: see [`super::Renderer::with_panorama`].
        #[serde(default)]
        file: String,
        /// Velocity (right, down), px/s.
        #[serde(default)]
        velocity: [f64; 2],
    },
}

fn half() -> f64 {
    0.5
}

fn fifth() -> f64 {
    0.2
}

/// How dark or light a target is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Shade {
    /// This luminance in every frame.
    Luminance(f64),
    /// Darker than its neighbourhood by this Weber contrast in every frame, as far as black allows.
    Dark(f64),
    /// Lighter than its neighbourhood by this Weber contrast in every frame, as far as white allows.
    Light(f64),
}

/// A small moving target.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// Width, px; need not be whole.
    #[serde(default = "five")]
    pub width: f64,
    /// Height, px; need not be whole.
    #[serde(default = "five")]
    pub height: f64,
    /// `{ luminance = 0.0 }`, `{ dark = 0.3 }` or `{ light = 0.3 }`.
    #[serde(default = "black")]
    pub shade: Shade,
    /// Where its centre moves.
    pub path: Path,
    /// First frame in which it exists; its path begins here.
    #[serde(default)]
    pub start: usize,
    /// First frame in which it no longer exists; none: it stays to the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop: Option<usize>,
    /// Frame ranges [first, end) in which it is there but cannot be seen, as if the background covered it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hidden: Vec<[usize; 2]>,
}

impl Target {
    /// A black 5 x 5 px target that exists in every frame.
    pub fn new(path: Path) -> Self {
        Self { width: 5.0, height: 5.0, shade: black(), path, start: 0, stop: None, hidden: Vec::new() }
    }
}

fn five() -> f64 {
    5.0
}

fn black() -> Shade {
    Shade::Luminance(0.0)
}

/// A rectangle of one luminance that is no target: a large object or an occluder.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// Width, px.
    pub width: f64,
    /// Height, px.
    pub height: f64,
    /// Luminance in [0, 1].
    pub luminance: f64,
    /// Where its centre moves; `{ kind = "straight", start = [x, y] }` stands still.
    pub path: Path,
    /// First frame in which it exists; its path begins here.
    #[serde(default)]
    pub start: usize,
    /// First frame in which it no longer exists; none: it stays to the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop: Option<usize>,
}

impl Scene {
    /// Reads a scene file. What it leaves out keeps its default.
    ///
    /// # Errors
    /// Unknown keys and wrong types, with line and column; values that break a rule.
    pub fn from_toml(text: &str) -> Result<Self, SceneError> {
        let scene: Self = toml::from_str(text)
            .map_err(|error| SceneError::Toml { message: error.to_string().trim_end().to_owned() })?;
        scene.validate()?;
        Ok(scene)
    }

    /// The scene as a file that [`Scene::from_toml`] reads.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a valid scene is plain tables")
    }

    /// Seconds at frame `t` since frame `start`.
    pub(super) fn seconds(&self, t: usize, start: usize) -> f64 {
        (t as f64 - start as f64) / self.rate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_round_trip() {
        for scene in [Scene::default(), Scene::demo(), Scene::paper()] {
            assert_eq!(Scene::from_toml(&scene.to_toml()).unwrap(), scene);
        }
    }

    #[test]
    fn a_short_file_is_enough() {
        let scene =
            Scene::from_toml("[[target]]\npath = { kind = 'straight', start = [10, 20], speed = 250 }").unwrap();
        let path = Path::Straight { start: [10.0, 20.0], speed: 250.0, direction: 0.0 };
        assert_eq!(scene, Scene { targets: vec![Target::new(path)], ..Scene::default() });
    }

    #[test]
    fn errors_say_where() {
        let case = |text: &str, parts: &[&str]| {
            let error = Scene::from_toml(text).unwrap_err().to_string();
            assert!(parts.iter().all(|part| error.contains(part)), "{error}");
        };
        case("width = 64\nheigth = 48\n", &["line 2, column 1", "heigth", "height"]);
        case("width = 'wide'\n", &["line 1", "string", "usize"]);
        case("[background]\nkind = 'cloudy'\n", &["cloudy", "natural", "line"]);
        case("[background]\nkind = 'natural'\ncontrst = 0.1\n", &["contrst", "contrast"]);
        case("[[target]]\nwidth = 3\n", &["path", "line 1"]);
        case("[[target]]\nshade = { darker = 1 }\npath = { kind = 'straight', start = [1, 2] }\n", &["darker", "dark"]);
    }
}
