//! Draws any frame of a scene on its own: frames may be asked for in any order, from several threads.

use ndarray::{Array2, ArrayView2};

use super::background::{Ground, natural};
use super::draw::{Rectangle, Window, draw, for_each_covered};
use super::error::SceneError;
use super::random::Random;
use super::scene::{Background, Object, Scene, Shade, Target};
use super::texture::{Texture, Vertical};
use super::truth::{NEIGHBOURHOOD, Truth};

/// A scene made ready to be drawn.
#[derive(Clone, Debug)]
pub struct Renderer {
    scene: Scene,
    ground: Ground,
}

impl Renderer {
    /// Checks the scene and computes its background.
    ///
    /// # Errors
    /// When a value breaks its rule, or the background is a panorama: see [`Renderer::with_panorama`].
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        scene.validate()?;
        let ground = match scene.background {
            Background::Uniform { luminance } => Ground::Uniform(luminance as f32),
            Background::Natural { mean, contrast, velocity } => {
                let texture = natural(scene.height, scene.width, scene.seed, mean, contrast);
                Ground::Moving(Box::new(texture), velocity)
            }
            Background::Panorama { .. } => {
                return Err(SceneError::Panorama {
                    kind: "a panorama",
                    given: "no picture was given",
                    advice: "give its luminance to Renderer::with_panorama",
                });
            }
        };
        Ok(Self { scene: scene.clone(), ground })
    }

    /// The same for a panorama background, with the luminance of its picture. At rest its upper left pixel is that of
    /// the scene.
    ///
    /// # Errors
    /// When a value breaks its rule, the background is no panorama, or the picture is empty or leaves [0, 1].
    pub fn with_panorama(scene: &Scene, picture: ArrayView2<'_, f32>) -> Result<Self, SceneError> {
        scene.validate()?;
        let Background::Panorama { velocity, .. } = scene.background else {
            return Err(SceneError::Panorama {
                kind: "not a panorama",
                given: "a picture was given",
                advice: "set background.kind to \"panorama\"",
            });
        };
        let broken = |value: String, rule: &str| SceneError::OutOfRange {
            field: "background.file".into(),
            value,
            rule: rule.into(),
        };
        if picture.is_empty() {
            return Err(broken("an empty picture".into(), "must hold at least one pixel"));
        }
        if let Some(((y, x), value)) = picture.indexed_iter().find(|(_, value)| !(0.0..=1.0).contains(*value)) {
            return Err(broken(format!("{value} at column {x}, row {y}"), "must be luminance in [0, 1]"));
        }
        let texture = Texture::new(&picture.mapv(f64::from), 1, Vertical::Mirror);
        Ok(Self { scene: scene.clone(), ground: Ground::Moving(Box::new(texture), velocity) })
    }

    /// The scene that is drawn.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// An array of the scene's size for [`Renderer::frame_into`].
    pub fn make_frame(&self) -> Array2<f32> {
        Array2::zeros((self.scene.height, self.scene.width))
    }

    /// Frame `t`, luminance in [0, 1].
    pub fn frame(&self, t: usize) -> Array2<f32> {
        let mut frame = self.make_frame();
        self.frame_into(t, &mut frame);
        frame
    }

    /// Draws frame `t` over whatever `into` holds. Frames at and beyond `scene.frames` are drawn as if it went on.
    ///
    /// # Panics
    /// When `into` has another size than the scene: make it with [`Renderer::make_frame`].
    pub fn frame_into(&self, t: usize, into: &mut Array2<f32>) {
        let Scene { width, height, .. } = self.scene;
        assert_eq!(into.dim(), (height, width), "the frame must have the scene's rows and columns");
        let window = self.window();
        self.paint_behind(t, window, into);
        for (target, place) in self.targets(t) {
            if !hidden(target, t) {
                draw(into, window, place, self.luminance(t, target, place).0);
            }
        }
        for (object, place) in self.present(&self.scene.occluders, t) {
            draw(into, window, place, object.luminance);
        }
        if self.scene.noise > 0.0 {
            let mut random = Random::new(self.scene.seed, 1 + t as u64);
            for value in into.iter_mut() {
                *value = (f64::from(*value) + self.scene.noise * random.normal()).clamp(0.0, 1.0) as f32;
            }
        }
    }

    /// The targets of frame `t` that lie at least partly in the picture, by their number.
    pub fn truth(&self, t: usize) -> Vec<Truth> {
        let picture = self.picture();
        let occluders: Vec<Rectangle> = self.present(&self.scene.occluders, t).map(|(_, place)| place).collect();
        let mut rows = Vec::new();
        for (id, target) in self.scene.targets.iter().enumerate() {
            let Some(place) = self.place(target, t) else { continue };
            let inside = place.within(picture);
            if inside.area() <= 0.0 {
                continue;
            }
            let seen = if hidden(target, t) { 0.0 } else { uncovered(inside, &occluders) };
            let (luminance, around) = self.luminance(t, target, place);
            rows.push(Truth {
                frame: t,
                id,
                x: inside.left,
                y: inside.top,
                width: inside.right - inside.left,
                height: inside.bottom - inside.top,
                // Half a target is enough; the slack keeps exact halves visible after rounding.
                visible: seen >= 0.5 * place.area() - 1e-9,
                contrast: (luminance - around).abs(),
            });
        }
        rows
    }

    /// Where the piece of background that is at a place (x, y) in frame `from` is in frame `to`.
    pub fn background_moves(&self, from: usize, to: usize, place: (f64, f64)) -> (f64, f64) {
        let Scene { camera, seed, .. } = &self.scene;
        let middle = self.middle();
        let pose = |t: usize| {
            let seconds = self.scene.seconds(t, 0);
            let mut pose = camera.pose(*seed, t, seconds);
            let [right, down] = self.ground.velocity();
            pose.shift = (pose.shift.0 + right * seconds, pose.shift.1 + down * seconds);
            pose
        };
        let (u, v) = pose(from).undo((place.0 - middle.0, place.1 - middle.1));
        let (u, v) = pose(to).apply((u, v));
        (middle.0 + u, middle.1 + v)
    }

    fn middle(&self) -> (f64, f64) {
        ((self.scene.width as f64 - 1.0) / 2.0, (self.scene.height as f64 - 1.0) / 2.0)
    }

    fn window(&self) -> Window {
        Window { top: 0, left: 0, height: self.scene.height, width: self.scene.width }
    }

    fn picture(&self) -> Rectangle {
        let (right, bottom) = (self.scene.width as f64, self.scene.height as f64);
        Rectangle { left: 0.0, top: 0.0, right, bottom }
    }

    fn paint_behind(&self, t: usize, window: Window, into: &mut Array2<f32>) {
        let Scene { camera, seed, .. } = &self.scene;
        let seconds = self.scene.seconds(t, 0);
        if camera.is_still() {
            self.ground.paint(window, seconds, into);
        } else {
            self.ground.paint_posed(window, seconds, self.middle(), camera.pose(*seed, t, seconds), into);
        }
        for (object, place) in self.present(&self.scene.objects, t) {
            draw(into, window, place, object.luminance);
        }
    }

    /// Where a target is in frame `t`, if it exists then.
    fn place(&self, target: &Target, t: usize) -> Option<Rectangle> {
        lives(t, target.start, target.stop).then(|| {
            let center = target.path.at(self.scene.seconds(t, target.start));
            Rectangle::around(center, target.width, target.height)
        })
    }

    fn targets(&self, t: usize) -> impl Iterator<Item = (&Target, Rectangle)> {
        let picture = self.picture();
        self.scene
            .targets
            .iter()
            .filter_map(move |target| Some((target, self.place(target, t)?)))
            .filter(move |(_, place)| place.within(picture).area() > 0.0)
    }

    fn present<'a>(&'a self, objects: &'a [Object], t: usize) -> impl Iterator<Item = (&'a Object, Rectangle)> {
        objects.iter().filter(move |object| lives(t, object.start, object.stop)).map(move |object| {
            let center = object.path.at(self.scene.seconds(t, object.start));
            (object, Rectangle::around(center, object.width, object.height))
        })
    }

    /// Luminance of a target and the mean luminance of its neighbourhood: what lies, without targets, occluders and
    /// noise, within 10 px around it and in the picture.
    fn luminance(&self, t: usize, target: &Target, place: Rectangle) -> (f64, f64) {
        let grown = place.grown(NEIGHBOURHOOD).within(self.picture());
        let window = Window::touched(grown);
        let mut behind = Array2::zeros((window.height, window.width));
        self.paint_behind(t, window, &mut behind);
        let sum = |rectangle: Rectangle| {
            let mut total = (0.0, 0.0);
            for_each_covered(window, rectangle, |at, share| {
                total = (total.0 + share, total.1 + share * f64::from(behind[at]));
            });
            total
        };
        let (with, without) = (sum(grown), sum(place.within(grown)));
        let area = with.0 - without.0;
        // A target that fills the picture has no neighbourhood: what it covers stands in for it.
        let around = if area > 1e-9 { (with.1 - without.1) / area } else { with.1 / with.0 };
        let luminance = match target.shade {
            Shade::Luminance(luminance) => luminance,
            Shade::Dark(contrast) => around - contrast,
            Shade::Light(contrast) => around + contrast,
        };
        (luminance.clamp(0.0, 1.0), around)
    }
}

fn lives(t: usize, start: usize, stop: Option<usize>) -> bool {
    t >= start && stop.is_none_or(|stop| t < stop)
}

fn hidden(target: &Target, t: usize) -> bool {
    target.hidden.iter().any(|[first, end]| (*first..*end).contains(&t))
}

/// Area of a rectangle that no occluder covers, however they overlap.
fn uncovered(rectangle: Rectangle, occluders: &[Rectangle]) -> f64 {
    let covers: Vec<Rectangle> = occluders.iter().map(|o| o.within(rectangle)).filter(|o| o.area() > 0.0).collect();
    let cuts = |edges: fn(&Rectangle) -> [f64; 2]| {
        let mut cuts: Vec<f64> = std::iter::once(&rectangle).chain(&covers).flat_map(edges).collect();
        cuts.sort_by(f64::total_cmp);
        cuts
    };
    let (columns, rows) = (cuts(|r| [r.left, r.right]), cuts(|r| [r.top, r.bottom]));
    let mut area = 0.0;
    for row in rows.windows(2) {
        for column in columns.windows(2) {
            let cell = Rectangle { left: column[0], top: row[0], right: column[1], bottom: row[1] };
            if !covers.iter().any(|cover| cover.within(cell).area() > 0.0) {
                area += cell.area();
            }
        }
    }
    area
}

#[cfg(test)]
mod tests;
