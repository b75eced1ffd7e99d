//! The rules of a scene.

use super::error::SceneError;
use super::path::Path;
use super::scene::{Background, Object, Scene, Shade, Target};

/// Most rows and columns.
const MOST_SIDE: usize = 16_384;
/// Farthest a coordinate may lie from the picture, px: beyond it sub-pixel places lose their digits.
const FAR: f64 = 1e6;

/// Checks numbers of one table of the file.
struct Table<'a>(&'a str);

impl Table<'_> {
    fn check(&self, name: &str, value: impl ToString, holds: bool, rule: &str) -> Result<(), SceneError> {
        if holds {
            return Ok(());
        }
        let field = if self.0.is_empty() { name.to_owned() } else { format!("{}.{name}", self.0) };
        Err(SceneError::OutOfRange { field, value: value.to_string(), rule: rule.to_owned() })
    }

    fn between(&self, name: &str, value: f64, low: f64, high: f64) -> Result<(), SceneError> {
        self.check(name, value, (low..=high).contains(&value), &format!("must lie between {low} and {high}"))
    }

    fn place(&self, name: &str, place: &[f64]) -> Result<(), SceneError> {
        place.iter().try_for_each(|value| self.between(name, *value, -FAR, FAR))
    }

    fn life(&self, start: usize, stop: Option<usize>) -> Result<(), SceneError> {
        match stop {
            Some(stop) => self.check("stop", stop, stop > start, &format!("must be greater than start = {start}")),
            None => Ok(()),
        }
    }

    fn path(&self, path: &Path) -> Result<(), SceneError> {
        match path {
            Path::Straight { start, speed, direction } => {
                self.place("path.start", start)?;
                self.between("path.speed", *speed, -FAR, FAR)?;
                self.between("path.direction", *direction, -FAR, FAR)
            }
            Path::Sinusoidal { start, speed, direction, amplitude, frequency } => {
                self.place("path.start", start)?;
                self.between("path.speed", *speed, -FAR, FAR)?;
                self.between("path.direction", *direction, -FAR, FAR)?;
                self.between("path.amplitude", *amplitude, -FAR, FAR)?;
                self.between("path.frequency", *frequency, 0.0, FAR)
            }
            Path::Circular { center, radius, speed, angle } => {
                self.place("path.center", center)?;
                self.between("path.radius", *radius, 0.01, FAR)?;
                self.between("path.speed", *speed, -FAR, FAR)?;
                self.between("path.angle", *angle, -FAR, FAR)
            }
            Path::Waypoints { points, speed, .. } => {
                self.check("path.points", "empty", !points.is_empty(), "must hold at least one point")?;
                points.iter().try_for_each(|point| self.place("path.points", point))?;
                self.between("path.speed", *speed, 0.0, FAR)
            }
        }
    }
}

impl Scene {
    /// Checks every value.
    ///
    /// # Errors
    /// Names the field, its value and the rule it breaks.
    pub fn validate(&self) -> Result<(), SceneError> {
        let scene = Table("");
        let side = format!("must lie between 1 and {MOST_SIDE}");
        scene.check("width", self.width, (1..=MOST_SIDE).contains(&self.width), &side)?;
        scene.check("height", self.height, (1..=MOST_SIDE).contains(&self.height), &side)?;
        scene.between("rate", self.rate, 1e-3, FAR)?;
        scene.check("frames", self.frames, self.frames > 0, "must be at least 1")?;
        scene.check("seed", self.seed, self.seed <= i64::MAX as u64, "must be below 2^63")?;
        scene.between("noise", self.noise, 0.0, 1.0)?;
        background(&self.background)?;
        let camera = Table("camera");
        camera.between("roll", self.camera.roll, -FAR, FAR)?;
        camera.between("zoom", self.camera.zoom, -FAR, FAR)?;
        camera.between("period", self.camera.period, 0.0, FAR)?;
        camera.between("shake", self.camera.shake, 0.0, FAR)?;
        for (i, object) in self.objects.iter().enumerate() {
            rectangle(object, &Table(&format!("object[{i}]")))?;
        }
        for (i, target) in self.targets.iter().enumerate() {
            self::target(target, &Table(&format!("target[{i}]")))?;
        }
        for (i, occluder) in self.occluders.iter().enumerate() {
            rectangle(occluder, &Table(&format!("occluder[{i}]")))?;
        }
        Ok(())
    }
}

fn background(background: &Background) -> Result<(), SceneError> {
    let table = Table("background");
    match background {
        Background::Uniform { luminance } => table.between("luminance", *luminance, 0.0, 1.0),
        Background::Natural { mean, contrast, velocity } => {
            table.between("mean", *mean, 0.05, 0.95)?;
            // Half of what two luminances, black and white, could reach: beyond it little is left of the spectrum.
            let most = 0.5 * (mean * (1.0 - mean)).sqrt();
            table.check(
                "contrast",
                contrast,
                (0.0..=most).contains(contrast),
                &format!("must lie between 0 and {most:.3} at mean = {mean}"),
            )?;
            table.place("velocity", velocity)
        }
        Background::Panorama { velocity, .. } => table.place("velocity", velocity),
    }
}

fn target(target: &Target, table: &Table) -> Result<(), SceneError> {
    table.between("width", target.width, 0.1, 1000.0)?;
    table.between("height", target.height, 0.1, 1000.0)?;
    match target.shade {
        Shade::Luminance(value) => table.between("shade.luminance", value, 0.0, 1.0)?,
        Shade::Dark(value) => table.between("shade.dark", value, 0.0, 1.0)?,
        Shade::Light(value) => table.between("shade.light", value, 0.0, 1.0)?,
    }
    for [first, end] in &target.hidden {
        table.check("hidden", format!("[{first}, {end}]"), first < end, "must hold ranges [first, end) of frames")?;
    }
    table.life(target.start, target.stop)?;
    table.path(&target.path)
}

fn rectangle(object: &Object, table: &Table) -> Result<(), SceneError> {
    table.between("width", object.width, 0.1, FAR)?;
    table.between("height", object.height, 0.1, FAR)?;
    table.between("luminance", object.luminance, 0.0, 1.0)?;
    table.life(object.start, object.stop)?;
    table.path(&object.path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_rules_name_field_value_and_rule() {
        let path = "path = { kind = 'straight', start = [1, 2] }";
        let target = |line: &str| format!("[[target]]\n{path}\n[[target]]\n{line}\n{path}\n");
        let own = |path: &str| format!("[[occluder]]\nwidth = 9\nheight = 9\nluminance = 1\npath = {path}\n");
        for (text, expected) in [
            ("width = 0".into(), "scene: width is 0, but it must lie between 1 and 16384"),
            ("frames = 0".into(), "scene: frames is 0, but it must be at least 1"),
            ("rate = nan".into(), "scene: rate is NaN, but it must lie between 0.001 and 1000000"),
            ("noise = -0.1".into(), "scene: noise is -0.1, but it must lie between 0 and 1"),
            (
                "[background]\nkind = 'natural'\nmean = 0.5\ncontrast = 0.4".into(),
                "scene: background.contrast is 0.4, but it must lie between 0 and 0.250 at mean = 0.5",
            ),
            (target("width = 0"), "scene: target[1].width is 0, but it must lie between 0.1 and 1000"),
            (target("shade = { dark = 2 }"), "scene: target[1].shade.dark is 2, but it must lie between 0 and 1"),
            (target("start = 7\nstop = 7"), "scene: target[1].stop is 7, but it must be greater than start = 7"),
            (
                target("hidden = [[5, 4]]"),
                "scene: target[1].hidden is [5, 4], but it must hold ranges [first, end) of frames",
            ),
            (
                own("{ kind = 'circular', center = [5, 5], radius = 0, speed = 1 }"),
                "scene: occluder[0].path.radius is 0, but it must lie between 0.01 and 1000000",
            ),
            (
                own("{ kind = 'waypoints', points = [], speed = 1 }"),
                "scene: occluder[0].path.points is empty, but it must hold at least one point",
            ),
        ] {
            assert_eq!(Scene::from_toml(&text).unwrap_err().to_string(), expected);
        }
    }
}
