use super::*;
use crate::stimulus::{Camera, Path};

fn natural_scene(velocity: [f64; 2]) -> Scene {
    let background = Background::Natural { mean: 0.5, contrast: 0.15, velocity };
    Scene { width: 96, height: 64, rate: 60.0, frames: 40, background, ..Scene::default() }
}

fn straight(start: [f64; 2], speed: f64) -> Path {
    Path::Straight { start, speed, direction: 0.0 }
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn background_moves_by_whole_pixels_and_returns() {
    let renderer = Renderer::new(&natural_scene([120.0, -60.0])).unwrap();
    let (now, next) = (renderer.frame(7), renderer.frame(8));
    assert!((1..64).all(|y| (0..94).all(|x| next[[y - 1, x + 2]] == now[[y, x]])));
    // The period is 128 x 64 px.
    assert_eq!(renderer.frame(0), renderer.frame(64));
    assert_ne!(renderer.frame(0), renderer.frame(63));
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn background_moves_smoothly_between_pixels() {
    let renderer = Renderer::new(&natural_scene([6.0, 0.0])).unwrap();
    let step = |t: usize| {
        let difference = renderer.frame(t + 1) - renderer.frame(t);
        difference.mapv(|v| v * v).mean().unwrap().sqrt()
    };
    let steps: Vec<f32> = (0..10).map(step).collect();
    let mean = steps.iter().sum::<f32>() / 10.0;
    // Linear interpolation would make the steps differ by 30 %; what is left is content entering at the border.
    assert!(steps.iter().all(|s| (s / mean - 1.0).abs() < 0.01), "{steps:?}");
}

fn white_scene(targets: Vec<Target>) -> Scene {
    Scene { width: 60, height: 40, rate: 100.0, frames: 50, targets, ..Scene::default() }
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn darkness_on_white_is_the_area_at_any_place() {
    let path = Path::Straight { start: [20.0, 20.0], speed: 37.0, direction: 0.7 };
    let renderer = Renderer::new(&white_scene(vec![Target { width: 4.0, height: 3.5, ..Target::new(path) }])).unwrap();
    for t in 0..50 {
        let frame = renderer.frame(t);
        let dark: f64 = frame.iter().map(|v| 1.0 - f64::from(*v)).sum();
        // 30 pixels rounded to f32.
        assert!((dark - 14.0).abs() < 1e-5, "{t}: {dark}");
        let column: f64 = frame.indexed_iter().map(|((_, x), v)| (1.0 - f64::from(*v)) * x as f64).sum::<f64>() / dark;
        assert!((column - renderer.truth(t)[0].center().0).abs() < 1e-5);
    }
}

/// |mean of the box - mean of the 10 px around it| on the picture, for a box on whole pixels.
fn measured_contrast(frame: &Array2<f32>, truth: &Truth) -> f64 {
    let [x, y, w, h] = [truth.x, truth.y, truth.width, truth.height].map(|v| v as i64);
    let (mut on, mut around) = ((0.0, 0.0), (0.0, 0.0));
    for ((row, column), value) in frame.indexed_iter() {
        let (dx, dy) = (column as i64 - x, row as i64 - y);
        let within = |margin: i64| (-margin..w + margin).contains(&dx) && (-margin..h + margin).contains(&dy);
        let sum = if within(0) { &mut on } else { &mut around };
        if within(10) {
            *sum = (sum.0 + 1.0, sum.1 + f64::from(*value));
        }
    }
    (on.1 / on.0 - around.1 / around.0).abs()
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn weber_contrast_is_what_was_asked_for_in_every_frame() {
    for (shade, asked) in [(Shade::Dark(0.2), 0.2), (Shade::Light(0.15), 0.15), (Shade::Dark(0.05), 0.05)] {
        let target = Target { shade, ..Target::new(straight([10.0, 30.0], 60.0)) };
        let renderer = Renderer::new(&Scene { targets: vec![target], ..natural_scene([30.0, 7.0]) }).unwrap();
        for t in 0..40 {
            let truth = renderer.truth(t)[0];
            // Luminance is rounded to f32 and the picture read back from it.
            assert!((truth.contrast - asked).abs() < 1e-9, "{t}: {}", truth.contrast);
            assert!((measured_contrast(&renderer.frame(t), &truth) - asked).abs() < 1e-6, "{t}");
        }
    }
    // Black is the end.
    let target = Target { shade: Shade::Dark(0.9), ..Target::new(straight([30.0, 30.0], 0.0)) };
    let renderer = Renderer::new(&Scene { targets: vec![target], ..natural_scene([0.0, 0.0]) }).unwrap();
    assert!((0.2..0.8).contains(&renderer.truth(0)[0].contrast));
    assert_eq!(renderer.frame(0)[[30, 30]], 0.0);
}

#[test]
fn truth_is_clipped_to_the_picture_and_half_is_visible() {
    let renderer = Renderer::new(&white_scene(vec![Target::new(straight([-5.5, 20.0], 100.0))])).unwrap();
    let rows: Vec<Vec<Truth>> = (0..60).map(|t| renderer.truth(t)).collect();
    // Edges -7.5 + t and -2.5 + t.
    assert!(rows[2].is_empty());
    assert_eq!((rows[3][0].x, rows[3][0].width, rows[3][0].visible), (0.0, 0.5, false));
    assert_eq!((rows[4][0].visible, rows[5][0].visible, rows[5][0].width), (false, true, 2.5));
    assert_eq!((rows[20][0].x, rows[20][0].y, rows[20][0].width, rows[20][0].height), (12.5, 18.0, 5.0, 5.0));
    assert_eq!(rows[20][0].center(), (14.5, 20.0));
    assert_eq!((rows[20][0].frame, rows[20][0].contrast), (20, 1.0));
}

fn block(center: [f64; 2], width: f64, height: f64, luminance: f64) -> Object {
    let path = Path::Straight { start: center, speed: 0.0, direction: 0.0 };
    Object { width, height, luminance, path, start: 0, stop: None }
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn occluders_cover_and_objects_lie_behind() {
    let mut scene = white_scene(vec![Target::new(straight([10.0, 20.0], 100.0))]);
    // Two overlapping blocks with edges 20..30 and 26..32.
    scene.occluders = vec![block([24.5, 20.0], 10.0, 12.0, 0.25), block([28.5, 20.0], 6.0, 5.0, 0.75)];
    scene.objects = vec![block([50.0, 20.0], 12.0, 30.0, 0.5)];
    let renderer = Renderer::new(&scene).unwrap();
    let visible: Vec<bool> = (0..50).map(|t| renderer.truth(t)[0].visible).collect();
    // The target's edges are 8 + t and 13 + t: more than half of it is covered from t = 10 to 21.
    assert_eq!((0..35).filter(|t| !visible[*t]).collect::<Vec<_>>(), (10..=21).collect::<Vec<_>>());
    let frame = renderer.frame(14);
    assert_eq!((frame[[20, 24]], frame[[20, 31]]), (0.25, 0.75));
    assert_eq!((renderer.frame(40)[[20, 50]], renderer.frame(0)[[20, 50]]), (0.0, 0.5));
}

#[test]
fn life_and_hiding() {
    let hidden = vec![[8, 10]];
    let target = Target { start: 5, stop: Some(12), hidden, ..Target::new(straight([10.0, 20.0], 100.0)) };
    let renderer = Renderer::new(&white_scene(vec![target])).unwrap();
    let seen: Vec<Option<bool>> = (4..13).map(|t| renderer.truth(t).first().map(|row| row.visible)).collect();
    let (yes, no) = (Some(true), Some(false));
    assert_eq!(seen, [None, yes, yes, yes, no, no, yes, yes, None]);
    assert_eq!(renderer.truth(5)[0].center(), (10.0, 20.0));
    for (t, drawn) in [(4, false), (5, true), (8, false), (10, true), (12, false)] {
        assert_eq!(renderer.frame(t).iter().any(|v| *v < 1.0), drawn, "{t}");
    }
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn noise_is_gaussian_new_in_each_frame_and_kept_by_the_seed() {
    let background = Background::Uniform { luminance: 0.5 };
    let scene = Scene { noise: 0.02, background, seed: 9, ..Scene::default() };
    let renderer = Renderer::new(&scene).unwrap();
    let (a, b) = (renderer.frame(3), renderer.frame(4));
    // 125 000 pixels: the standard error of the deviation is 0.2 %.
    assert!((a.mapv(f64::from).std(0.0) / 0.02 - 1.0).abs() < 0.01);
    let product = ((&a - 0.5) * (&b - 0.5)).mean().unwrap() / 4e-4;
    assert!(product.abs() < 0.015, "{product}");
    assert_eq!(Renderer::new(&scene).unwrap().frame(3), a);
    assert_ne!(Renderer::new(&Scene { seed: 10, ..scene }).unwrap().frame(3), a);
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn a_panorama_repeats_and_moves() {
    let picture = Array2::from_shape_fn((50, 80), |(y, x)| ((3 * x * x + 5 * y) % 83) as f32 / 82.0);
    let background = Background::Panorama { file: String::new(), velocity: [-200.0, 0.0] };
    let scene = Scene { background, ..white_scene(Vec::new()) };
    let renderer = Renderer::with_panorama(&scene, picture.view()).unwrap();
    let frame = renderer.frame(15);
    // Interpolation returns the samples up to f32 rounding.
    assert!(frame.indexed_iter().all(|((y, x), v)| (v - picture[[y, (x + 30) % 80]]).abs() < 1e-5));
    assert_eq!(frame, renderer.frame(55));
    assert!(Renderer::new(&scene).unwrap_err().to_string().contains("with_panorama"));
    assert!(Renderer::with_panorama(&Scene::default(), picture.view()).unwrap_err().to_string().contains("kind"));
    let error = Renderer::with_panorama(&scene, (&picture * 2.0).view()).unwrap_err().to_string();
    assert!(error.contains("must be luminance in [0, 1]"), "{error}");
}

/// FNV-1a over the bits of every pixel.
fn hash(frame: &Array2<f32>) -> u64 {
    let bytes = frame.iter().flat_map(|v| v.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3))
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn the_same_picture_on_every_machine() {
    let path = Path::Circular { center: [48.0, 32.0], radius: 20.0, speed: 60.0, angle: 1.0 };
    let target = Target { shade: Shade::Dark(0.3), ..Target::new(path) };
    let scene = Scene { targets: vec![target], noise: 0.01, ..natural_scene([5.0, 3.0]) };
    let renderer = Renderer::new(&scene).unwrap();
    assert_eq!(hash(&renderer.frame(17)), 0xb9bf_e1b8_f0e8_2d8c);
    // In any order, over any old content.
    let mut frame = renderer.frame(30);
    renderer.frame_into(17, &mut frame);
    assert_eq!(frame, renderer.frame(17));
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn demo_targets_stay_inside_and_apart() {
    let renderer = Renderer::new(&Scene::demo()).unwrap();
    for t in 0..renderer.scene().frames {
        let rows = renderer.truth(t);
        assert_eq!(rows.len(), 4);
        for (i, row) in rows.iter().enumerate() {
            assert!(row.visible && row.contrast > 0.15 && row.contrast < 0.5, "{row:?}");
            assert!(row.x > 8.0 && row.y > 8.0 && row.x < 306.0 && row.y < 226.0, "{row:?}");
            let gap = |other: &Truth| (row.x - other.x).hypot(row.y - other.y);
            assert!(rows[..i].iter().all(|other| gap(other) > 15.0), "{t}");
        }
    }
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn the_camera_turns_and_enlarges_about_the_middle() {
    let plain = Renderer::new(&natural_scene([0.0; 2])).unwrap();
    let at_rest = plain.frame(0);
    let posed =
        |camera: Camera, t: usize| Renderer::new(&Scene { camera, ..natural_scene([0.0; 2]) }).unwrap().frame(t);
    // A quarter turn counter-clockwise: what was right of the middle is above it. 60 frames a second.
    let quarter = posed(Camera { roll: std::f64::consts::FRAC_PI_2 * 60.0, ..Camera::default() }, 1);
    for d in 1..30 {
        // The middle lies between pixels: (47.5, 31.5).
        assert!((quarter[[31 - d, 48]] - at_rest[[32, 48 + d]]).abs() < 1e-4, "{d}");
    }
    let twice = posed(Camera { zoom: 2f64.ln() * 60.0, ..Camera::default() }, 1);
    for d in 0..15 {
        let between = 0.5 * (at_rest[[31, 48 + d]] + at_rest[[32, 48 + d]]);
        assert!((0.5 * (twice[[31, 48 + 2 * d]] + twice[[32, 48 + 2 * d]]) - between).abs() < 0.1, "{d}");
    }
    // As a velocity does it.
    let shaken = posed(Camera { shake: 1.0, ..Camera::default() }, 3);
    assert!(shaken != at_rest && (shaken.mean().unwrap() - at_rest.mean().unwrap()).abs() < 0.02);
}
