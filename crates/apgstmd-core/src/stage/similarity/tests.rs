use super::*;
use crate::row::machine::SimdLevel;

/// Waves of 5 to 500 px whose amplitude grows with their length, as in natural pictures.
struct Waves(Vec<[f64; 4]>);

impl Waves {
    fn new(seed: u32) -> Self {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state) / f64::from(u32::MAX)
        };
        let waves = (0..30).map(|_| {
            let length = 5.0 * 100f64.powf(next());
            let (angle, phase) = (std::f64::consts::TAU * next(), std::f64::consts::TAU * next());
            let k = std::f64::consts::TAU / length;
            [k * angle.cos(), k * angle.sin(), phase, 0.055 * (length / 100.0).sqrt()]
        });
        Self(waves.collect())
    }

    /// The picture after a motion from the middle (`motion` leads from the picture at rest to this one).
    fn picture(&self, size: Size, motion: &Motion) -> Plane {
        let mut plane = Plane::new(size);
        let (c, s) = (1.0 + motion.stretch, motion.turn);
        let n = c * c + s * s;
        for y in 0..size.height {
            for (x, value) in plane.row_mut(y).iter_mut().enumerate() {
                let u = x as f64 - motion.middle.0 - motion.shift.0;
                let v = y as f64 - motion.middle.1 - motion.shift.1;
                let (u, v) = ((c * u + s * v) / n, (c * v - s * u) / n);
                let sum: f64 = self.0.iter().map(|[kx, ky, phase, a]| a * (kx * u + ky * v + phase).sin()).sum();
                *value = (0.5 + sum).clamp(0.0, 1.0) as f32;
            }
        }
        plane
    }
}

const SIZE: Size = Size { height: 180, width: 320 };

fn motion(shift: (f64, f64), degrees: f64, zoom: f64) -> Motion {
    let angle = degrees.to_radians();
    Motion { shift, stretch: zoom * angle.cos() - 1.0, turn: -zoom * angle.sin(), ..Motion::still(SIZE) }
}

fn see(similarity: &mut Similarity, p: &Plane) -> Finding {
    let level = SimdLevel::best().level();
    similarity.look(level, p, 0);
    similarity.follow(level, p, 0)
}

/// Largest error in the corners of the picture, px.
fn error(found: &Motion, truth: &Motion) -> f64 {
    let corners = [(0.0, 0.0), (319.0, 0.0), (0.0, 179.0), (319.0, 179.0)];
    let at = corners.map(|corner| (found.at(corner), truth.at(corner)));
    at.iter().map(|(a, b)| (a.0 - b.0).hypot(a.1 - b.1)).fold(0.0, f64::max)
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn finds_shift_rotation_and_zoom_from_rest() {
    for seed in 1..4 {
        let waves = Waves::new(seed);
        let rest = waves.picture(SIZE, &Motion::still(SIZE));
        for (shift, degrees, zoom) in [
            ((0.0, 0.0), 0.0, 1.0),
            ((0.3, -0.2), 0.1, 1.001),
            ((-6.0, 2.5), 0.0, 1.0),
            ((24.0, -3.0), 0.0, 1.0),
            ((0.0, 0.0), 3.0, 1.0),
            ((0.0, 0.0), 0.0, 1.04),
            ((9.0, 5.0), -2.0, 0.97),
        ] {
            let truth = motion(shift, degrees, zoom);
            let mut similarity = Similarity::new(SIZE, 1);
            see(&mut similarity, &rest);
            let found = see(&mut similarity, &waves.picture(SIZE, &truth));
            // Bilinear interpolation of waves of 5 px and more, under robust weights.
            let error = error(&found.motion, &truth);
            assert!(error < 0.15 && !found.unexplained && !found.cut, "{shift:?} {degrees} {zoom}: {error} {found:?}");
        }
    }
}

/// What a run of pictures leads to after the first.
fn findings(pictures: impl Iterator<Item = Plane>) -> Vec<Finding> {
    let mut pictures = pictures.peekable();
    let mut similarity = Similarity::new(pictures.peek().expect("a picture").size(), 1);
    pictures.map(|p| see(&mut similarity, &p)).skip(1).collect()
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn a_cut_is_one_cut() {
    for seed in 1..9 {
        let (one, other) = (Waves::new(seed), Waves::new(seed + 100));
        let found = findings((0..10).map(|t| {
            let moved = motion((1.5 * f64::from(t), 0.0), 0.0, 1.0);
            if t < 5 { &one } else { &other }.picture(SIZE, &moved)
        }));
        let cuts: Vec<bool> = found.iter().map(|found| found.cut).collect();
        assert_eq!(cuts, (1..10).map(|t| t == 5).collect::<Vec<_>>(), "{seed}");
        assert!(found.iter().enumerate().all(|(t, found)| t == 4 || (found.motion.shift.0 - 1.5).abs() < 0.05));
    }
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn light_after_darkness_is_a_cut() {
    let waves = Waves::new(2).picture(SIZE, &Motion::still(SIZE));
    let dark = Plane::new(SIZE);
    let found =
        findings([0, 0, 0, 1, 1, 0, 0].map(|lit| if lit == 1 { waves.clone() } else { dark.clone() }).into_iter());
    assert_eq!(found.iter().map(|found| found.cut).collect::<Vec<_>>(), [false, false, true, false, true, false]);
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn flicker_pans_and_large_objects_are_no_cuts() {
    let waves = Waves::new(7);
    let still = Motion::still(SIZE);
    let flicker = findings((0..10).map(|t| {
        let mut plane = waves.picture(SIZE, &still);
        // Gain of a lamp up to 10 %, then an exposure that jumps by 30 %.
        let gain = [1.0, 0.95, 1.0, 0.9, 0.95, 1.0, 0.7, 1.0, 0.7, 1.0][t];
        plane.data_mut().iter_mut().for_each(|value| *value = gain * *value + 0.05 * (t % 2) as f32);
        plane
    }));
    assert!(flicker.iter().all(|found| !found.cut && error(&found.motion, &still) < 2.0), "{flicker:?}");
    assert!(flicker[..5].iter().all(|found| error(&found.motion, &still) < 0.4), "{flicker:?}");

    // From rest to 24 px a frame at once.
    let places = [0.0, 0.0, 0.0, 24.0, 48.0, 72.0, 72.0, 72.0];
    let pans = findings(places.iter().map(|x| waves.picture(SIZE, &motion((*x, 0.0), 0.0, 1.0))));
    for (found, pair) in pans.iter().zip(places.windows(2)) {
        assert!(!found.cut && (found.motion.shift.0 - (pair[1] - pair[0])).abs() < 0.1, "{found:?} {pair:?}");
    }

    // Two fifths of the picture, black, that comes in at once and goes on at 5 px a frame.
    let object = findings((0..8).map(|t| {
        let mut plane = waves.picture(SIZE, &still);
        if t > 3 {
            (0..SIZE.height).for_each(|y| plane.row_mut(y)[5 * t..5 * t + 128].fill(0.0));
        }
        plane
    }));
    assert!(object.iter().all(|found| !found.cut && error(&found.motion, &still) < 0.5), "{object:?}");
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn noise_and_emptiness_tell_of_no_motion() {
    let mut state = 5u32;
    let noise = findings((0..12).map(|_| {
        let mut plane = Plane::new(SIZE);
        for value in plane.data_mut() {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *value = 0.5 + 0.1 * (state as f32 / u32::MAX as f32 - 0.5);
        }
        plane
    }));
    assert!(
        noise.iter().all(|f| f.unexplained && !f.cut && f.motion == Motion::still(SIZE) && f.residual > 0.01),
        "{noise:?}"
    );
    let empty = findings((0..3).map(|_| {
        let mut plane = Plane::new(SIZE);
        plane.fill(0.7);
        plane
    }));
    assert!(empty.iter().all(|f| f.unexplained && !f.cut && f.motion == Motion::still(SIZE)));
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn a_bird_in_an_empty_sky_is_no_background() {
    for speed in [1, 4, 8, 16] {
        let sky = findings((0..8).map(|t| {
            let mut plane = Plane::new(SIZE);
            plane.fill(0.9);
            (80..91).for_each(|y| plane.row_mut(y)[20 + speed * t..31 + speed * t].fill(0.2));
            plane
        }));
        assert!(sky[1..].iter().all(|f| f.unexplained && !f.cut && f.motion == Motion::still(SIZE)), "{sky:?}");
    }
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn two_birds_in_a_small_empty_sky_are_no_background() {
    let sky = findings((0..8).map(|t| {
        let size = Size::new(64, 96);
        let mut plane = Plane::new(size);
        plane.fill(0.9);
        for (top, left) in [(12, 10), (44, 40)] {
            (top..top + 9).for_each(|y| plane.row_mut(y)[left + 2 * t..left + 2 * t + 9].fill(0.2));
        }
        plane
    }));
    assert!(sky[1..].iter().all(|f| f.unexplained && !f.cut && f.motion.shift == (0.0, 0.0)), "{sky:?}");
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn smooth_sky_has_no_say() {
    // Above trees that move, three quarters of sky, in which what a codec left of it stays where it is.
    for shift in [1.5, -6.0, 14.0] {
        let pan = findings((0..8).map(|t| {
            let mut plane = Waves::new(3).picture(SIZE, &motion((shift * f64::from(t), 0.0), 0.0, 1.0));
            let top = |x: usize| {
                let along = (x as f64 - shift * f64::from(t)) / 9.0;
                (130.0 + 6.0 * along.sin() + 4.0 * (2.3 * along).sin()) as usize
            };
            for y in 0..SIZE.height {
                let residue = |x: usize| 0.002 * ((x / 8 + 3 * (y / 8)) % 5) as f32;
                let row = plane.row_mut(y).iter_mut().enumerate();
                row.filter(|(x, _)| y < top(*x)).for_each(|(x, value)| *value = 0.8 + residue(x));
            }
            plane
        }));
        for found in &pan {
            let off = (found.motion.shift.0 - shift).hypot(found.motion.shift.1);
            assert!(!found.unexplained && !found.cut && off < 0.3, "{shift} {found:?}");
        }
    }
}

#[test]
#[cfg_attr(miri, ignore = "minutes to hours")]
fn the_smallest_pictures() {
    for (height, width) in [(16, 16), (17, 90), (64, 64), (65, 16)] {
        let size = Size::new(height, width);
        let mut similarity = Similarity::new(size, 1);
        for t in 0..4 {
            let truth = Motion { shift: (0.5 * f64::from(t), 0.0), ..Motion::still(size) };
            let found = see(&mut similarity, &Waves::new(3).picture(size, &truth));
            assert!(!found.cut && found.motion.shift.0.is_finite());
        }
        similarity.reset();
        assert_eq!(see(&mut similarity, &Plane::new(size)), Finding::nothing(size));
    }
}
