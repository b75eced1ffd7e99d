//! What comes from outside, each boundary as a function of bytes that panics where a promise is broken.
//!
//! The fuzz targets in `fuzz/` call these with what libFuzzer makes up; the suite `boundary` calls them with the seeds, with
//! every finding there ever was, and with changes of both.

mod judging;
mod model;
mod pictures;
mod text;

use std::borrow::Cow;

use arbitrary::Unstructured;

pub use model::is_finite;

/// A boundary: its name, which is that of its fuzz target and of its folder of seeds, and what holds it to its promises.
pub struct Boundary {
    /// Name.
    pub name: &'static str,
    /// Panics where the promise is broken.
    pub check: fn(&[u8]),
}

/// All of them.
pub const ALL: &[Boundary] = &[
    Boundary { name: "parameters", check: text::parameters },
    Boundary { name: "scene", check: text::scene },
    Boundary { name: "truth", check: text::truth },
    Boundary { name: "detections", check: text::detections },
    Boundary { name: "written", check: text::written },
    Boundary { name: "arguments", check: text::arguments },
    Boundary { name: "names", check: text::names },
    Boundary { name: "picture", check: pictures::picture },
    Boundary { name: "pipe", check: pictures::pipe },
    Boundary { name: "ffmpeg", check: pictures::ffmpeg },
    Boundary { name: "state", check: model::state },
    Boundary { name: "detector", check: model::detector },
    Boundary { name: "extremes", check: model::extremes },
    Boundary { name: "tracker", check: model::tracker },
    Boundary { name: "evaluator", check: judging::evaluator },
    Boundary { name: "track_evaluator", check: judging::track_evaluator },
];

/// The boundary of this name.
///
/// # Panics
/// There is none.
pub fn check(name: &str, bytes: &[u8]) {
    let boundary = ALL.iter().find(|boundary| boundary.name == name);
    (boundary.unwrap_or_else(|| panic!("there is no boundary {name}")).check)(bytes);
}

/// Bytes as text: what is no UTF-8 is made that, so that no input is wasted.
fn text_of(bytes: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(bytes)
}

/// A whole number in the range.
fn whole(input: &mut Unstructured<'_>, range: std::ops::RangeInclusive<u32>) -> u32 {
    input.int_in_range(range).unwrap_or_default()
}

/// A number in the range, often one of its ends.
fn real(input: &mut Unstructured<'_>, (low, high): (f64, f64)) -> f64 {
    match whole(input, 0..=7) {
        0 => low,
        1 => high,
        // Near the lower end, where most of the magnitudes are.
        2 => low + (high - low) * 10f64.powi(-(whole(input, 1..=12) as i32)),
        _ => low + (high - low) * f64::from(whole(input, 0..=1 << 16)) / f64::from(1u32 << 16),
    }
}

/// Any float at all.
fn any_float(input: &mut Unstructured<'_>) -> f64 {
    const ODD: [f64; 12] =
        [0.0, -0.0, 1.0, 1e-30, 1e30, 1e-320, 1e308, -1e308, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 0.5];
    match whole(input, 0..=3) {
        0 => ODD[whole(input, 0..=11) as usize],
        1 => input.arbitrary().unwrap_or_default(),
        2 => f64::from(input.arbitrary::<f32>().unwrap_or_default()),
        _ => f64::from(input.arbitrary::<i16>().unwrap_or_default()) / 16.0,
    }
}
