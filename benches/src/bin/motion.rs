//! How well the camera's motion is found, and a target before it: `motion`. Pan, roll, zoom and shake one by one, before
//! natural clutter, as the tables of `docs/motion.md`.
//!
//! `motion FILE WIDTHxHEIGHT` prints the motion from frame to frame of raw 8-bit grey frames instead (`ffmpeg -i CLIP -f
//! rawvideo -pix_fmt gray FILE`).
//!
//! 480 x 270 px, 48 frames, contrast 0.15 and noise 0.004; a dark target of 5 x 5 px that crosses the picture at 1
//! px/frame, or, in the tables "in the world", the world that the camera sees in its first frame. Error: median and largest over frames, in the worst corner of the picture.

use apgstmd_benches::practical;
use apgstmd_core::evaluation::{Options, Scored, TruthBox, evaluate};
use apgstmd_core::params::BackgroundMotion;
use apgstmd_core::stimulus::{Background, Camera, Path, Renderer, Scene, Shade, Target};
use apgstmd_core::{Bank, BankParams, Detector, Params, Response, Size};
use ndarray::Array2;

const SIZE: (usize, usize) = (270, 480);
const FRAMES: usize = 48;
const RATE: f64 = 60.0;
/// Frames in which filters and traces settle.
const SETTLING: usize = 16;
const SEEDS: [u64; 3] = [1, 2, 3];

/// Of the target: its first place, (x, y) px, direction, radians, and contrast.
const CONTRAST: f64 = 0.4;
const START: (f64, f64) = (120.0, 90.0);
const DIRECTION: f64 = 0.3;

/// Background velocity, px/frame, and camera.
type Case = ([f64; 2], Camera);

/// What the target's path is straight in.
#[derive(Clone, Copy, PartialEq)]
enum Along {
    Picture,
    World,
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    if let [file, size] = &args[..] {
        return clip(file, size);
    }
    let along = match &args[..] {
        [] => [Along::Picture, Along::World].as_slice(),
        [which] if which == "world" => &[Along::World],
        _ => panic!("motion, motion world, or motion FILE WIDTHxHEIGHT"),
    };
    along.iter().for_each(|along| tables(*along));
}

fn tables(along: Along) {
    let still = [0.0; 2];
    // Forth and back, so that the picture stays sharp: 5 % a frame would enlarge it tenfold.
    let period = 24.0 / RATE;
    type Values = &'static [f64];
    let (pans, rolls, zooms, shakes): (Values, Values, Values, Values) = match along {
        Along::Picture => (
            &[0.0, 2.0, 6.0, 10.0, 16.0, 20.0, 24.0, 28.0, 32.0],
            &[0.5, 1.0, 2.0, 3.0, 4.0, 5.0],
            &[0.5, 1.0, 2.0, 3.0, 4.0, 5.0],
            &[0.5, 1.0, 2.0, 4.0, 8.0],
        ),
        // Beyond these it moves faster in the picture than the bank's fastest member.
        Along::World => (&[0.0, 1.0, 2.0], &[0.25, 0.5, 1.0], &[0.5, 1.0, 2.0], &[0.5, 1.0, 2.0]),
    };
    table("pan, px/frame", along, pans, |v| ([0.8 * v * RATE, 0.6 * v * RATE], Camera::default()));
    table("roll, degrees/frame", along, rolls, |degrees| {
        (still, Camera { roll: degrees.to_radians() * RATE, period, ..Camera::default() })
    });
    table("zoom, %/frame", along, zooms, |percent| {
        (still, Camera { zoom: (1.0 + percent / 100.0).ln() * RATE, period, ..Camera::default() })
    });
    table("shake, px", along, shakes, |shake| (still, Camera { shake, ..Camera::default() }));
}

fn clip(file: &str, size: &str) {
    let (width, height) = size.split_once('x').expect("WIDTHxHEIGHT");
    let size = Size::new(height.parse().expect("rows"), width.parse().expect("columns"));
    let frames = std::fs::read(file).expect("a file of raw frames");
    let mut params = practical();
    params.rejection.background = BackgroundMotion::Similarity;
    let mut detector = Detector::with_threads(size, &params, 1).expect("parameters");
    let mut response = detector.make_response();
    println!("frame,shift_x,shift_y,rotation,zoom,residual,unexplained,cut");
    for (t, frame) in frames.chunks_exact(size.area()).enumerate() {
        let frame = ndarray::ArrayView2::from_shape((size.height, size.width), frame).expect("rows and columns");
        detector.process_into(frame, &mut response).expect("a frame");
        let ((x, y), ego, cut) = (response.background_shift, response.ego_motion, response.cut);
        let apgstmd_core::EgoMotion { rotation, zoom, residual, unexplained } = ego;
        println!("{t},{x:.3},{y:.3},{rotation:.5},{zoom:.5},{residual:.5},{unexplained},{cut}");
    }
}

fn table(what: &str, along: Along, values: &[f64], case: impl Fn(f64) -> Case) {
    let world = if along == Along::World { "in the world: " } else { "" };
    println!("| {world}{what} | error, px | largest | unexplained | cuts | area | area, translation | area, off |");
    println!("|---|---|---|---|---|---|---|---|");
    for &value in values {
        let (mut errors, mut unexplained, mut cuts, mut areas) = (Vec::new(), 0, 0, [0.0; 3]);
        let modes = [BackgroundMotion::Similarity, BackgroundMotion::Translation, BackgroundMotion::Off];
        for seed in SEEDS {
            let (velocity, camera) = case(value);
            let renderer = Renderer::new(&scene(seed, velocity, camera, along)).expect("a valid scene");
            let (frames, boxes): (Vec<_>, Vec<_>) = (0..FRAMES).map(|t| seen(&renderer, t, along)).unzip();
            for (mode, area) in modes.iter().zip(&mut areas) {
                let mut params = practical();
                params.rejection.background = *mode;
                let mut finder = Finder::new(&params, along);
                let mut response = finder.make_response();
                let (mut found, mut truth) = (Vec::new(), Vec::<TruthBox>::new());
                for (t, frame) in frames.iter().enumerate() {
                    finder.process(frame, &mut response);
                    let scored = |d: &apgstmd_core::Detection| Scored::new(t, d.x.into(), d.y.into(), d.score.into());
                    found.extend(response.detections.iter().map(scored));
                    truth.extend(&boxes[t]);
                    if *mode == BackgroundMotion::Similarity && t > 0 {
                        errors.push(error(&response, &renderer, t));
                        unexplained += usize::from(response.ego_motion.unexplained);
                        cuts += usize::from(response.cut);
                    }
                }
                let judged =
                    |found: &Vec<Scored>| found.iter().filter(|f| f.frame >= SETTLING).copied().collect::<Vec<_>>();
                truth.retain(|truth| truth.frame >= SETTLING);
                let options = Options::new(SETTLING..FRAMES);
                *area += evaluate(&judged(&found), &truth, &options).expect("detections and truth").area;
            }
        }
        errors.sort_by(f64::total_cmp);
        let [similarity, translation, off] = areas.map(|area| area / SEEDS.len() as f64);
        println!(
            "| {value} | {:.3} | {:.2} | {:.0} % | {cuts} | {similarity:.2} | {translation:.2} | {off:.2} |",
            errors[errors.len() / 2],
            errors[errors.len() - 1],
            100.0 * unexplained as f64 / errors.len() as f64,
        );
    }
    println!();
}

enum Finder {
    One(Box<Detector>),
    Several(Box<Bank>),
}

impl Finder {
    /// A target that is straight in the world has many speeds in the picture.
    fn new(params: &Params, along: Along) -> Self {
        let size = Size::new(SIZE.0, SIZE.1);
        match along {
            Along::Picture => Self::One(Box::new(Detector::with_threads(size, params, 1).expect("parameters"))),
            Along::World => {
                let params = BankParams::with_members(params.clone(), &[1.0, 2.0, 4.0], &[5.0]);
                Self::Several(Box::new(Bank::new(size, &params).expect("parameters")))
            }
        }
    }

    fn make_response(&self) -> Response {
        match self {
            Self::One(detector) => detector.make_response(),
            Self::Several(bank) => bank.make_response(),
        }
    }

    fn process(&mut self, frame: &Array2<f32>, response: &mut Response) {
        match self {
            Self::One(detector) => detector.process_into(frame.view(), response),
            Self::Several(bank) => bank.process_into(frame.view(), response),
        }
        .expect("a frame");
    }
}

/// A frame, and where the target is in it.
fn seen(renderer: &Renderer, t: usize, along: Along) -> (Array2<f32>, Vec<TruthBox>) {
    let mut frame = renderer.frame(t);
    if along == Along::Picture {
        return (frame, renderer.truth(t).into_iter().map(TruthBox::from).collect());
    }
    // Where it would be before a camera at rest, and from there with the background.
    let (sin, cos) = DIRECTION.sin_cos();
    let place = (START.0 + cos * t as f64, START.1 - sin * t as f64);
    let (x, y) = renderer.background_moves(0, t, place);
    let covered = |pixel: usize, center: f64| {
        let pixel = pixel as f64;
        ((pixel + 0.5).min(center + 2.5) - (pixel - 0.5).max(center - 2.5)).clamp(0.0, 1.0)
    };
    for ((row, column), value) in frame.indexed_iter_mut() {
        *value *= 1.0 - (CONTRAST * covered(row, y) * covered(column, x)) as f32;
    }
    let inside = x >= 0.0 && y >= 0.0 && x < SIZE.1 as f64 && y < SIZE.0 as f64;
    let found = TruthBox::new(t, [x - 2.0, y - 2.0, 5.0, 5.0]);
    (frame, if inside { vec![found] } else { Vec::new() })
}

fn scene(seed: u64, velocity: [f64; 2], camera: Camera, along: Along) -> Scene {
    let path = Path::Straight { start: START.into(), speed: RATE, direction: DIRECTION };
    let target = Target { shade: Shade::Dark(CONTRAST), ..Target::new(path) };
    Scene {
        width: SIZE.1,
        height: SIZE.0,
        rate: RATE,
        frames: FRAMES,
        seed,
        noise: 0.004,
        background: Background::Natural { mean: 0.5, contrast: 0.15, velocity },
        camera,
        targets: if along == Along::Picture { vec![target] } else { Vec::new() },
        ..Scene::default()
    }
}

/// Error of the motion since the last frame in the worst corner, px.
fn error(response: &Response, renderer: &Renderer, t: usize) -> f64 {
    let (height, width) = (SIZE.0 as f64 - 1.0, SIZE.1 as f64 - 1.0);
    let (dx, dy) = response.background_shift;
    let ego = response.ego_motion;
    let (sin, cos) = f64::from(ego.rotation).sin_cos();
    let corners = [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)];
    let off = corners.map(|(x, y)| {
        let (u, v) = (x - width / 2.0, y - height / 2.0);
        let zoom = f64::from(ego.zoom);
        let found = (
            width / 2.0 + f64::from(dx) + zoom * (cos * u + sin * v),
            height / 2.0 + f64::from(dy) + zoom * (cos * v - sin * u),
        );
        let truth = renderer.background_moves(t - 1, t, (x, y));
        (found.0 - truth.0).hypot(found.1 - truth.1)
    });
    off.into_iter().fold(0.0, f64::max)
}
