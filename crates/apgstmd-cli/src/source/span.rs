//! `--start --stop --step`: which frames of a source are used. Every source asks the same [`Picker`], so that the flags
//! mean the same for all.

use std::fmt;
use std::str::FromStr;
use std::vec::IntoIter;

use crate::Outcome;
use crate::failure::Failure;

/// Some containers keep times to a millisecond: frames this much early are taken for punctual, s.
const SLACK: f64 = 0.0005;

/// A place in a source, or a distance: frames, or seconds of its own time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Frames, counted from 0.
    Frames(usize),
    /// Seconds, as in the column time_s.
    Seconds(f64),
}

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let seconds = text.strip_suffix('s').and_then(|number| number.trim_end().parse().ok());
        match seconds.filter(|seconds: &f64| seconds.is_finite() && *seconds >= 0.0) {
            Some(seconds) => Ok(Self::Seconds(seconds)),
            None => text.parse().map(Self::Frames).map_err(|_| {
                "expected a number of frames such as 120, or seconds such as 2.5s, neither below 0".to_owned()
            }),
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frames(frames) => write!(f, "{frames}"),
            Self::Seconds(seconds) => write!(f, "{seconds}s"),
        }
    }
}

impl Place {
    fn reached(self, frame: usize, time: Option<f64>) -> bool {
        match self {
            Self::Frames(place) => frame >= place,
            Self::Seconds(place) => time.is_some_and(|time| time >= place - SLACK),
        }
    }

    /// Frames, where it is that.
    pub fn frames(self) -> Option<usize> {
        match self {
            Self::Frames(frames) => Some(frames),
            Self::Seconds(_) => None,
        }
    }
}

/// The three flags, checked as far as that goes without the source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// First frame used.
    pub start: Place,
    /// First one no longer used.
    pub stop: Option<Place>,
    /// From one used frame to the next.
    pub step: Place,
}

impl Span {
    /// Everything.
    pub const ALL: Self = Self { start: Place::Frames(0), stop: None, step: Place::Frames(1) };

    /// Checks the flags against each other.
    ///
    /// # Errors
    /// A step of 0, an empty range.
    pub fn new(start: Place, stop: Option<Place>, step: Place) -> Outcome<Self> {
        if step == Place::Frames(0) || step == Place::Seconds(0.0) {
            return Err(Failure::usage(format_args!(
                "--step is {step}, but it must be at least 1 (1 uses every frame), or seconds above 0"
            )));
        }
        let empty = match (start, stop) {
            (Place::Frames(start), Some(Place::Frames(stop))) => stop <= start,
            (Place::Seconds(start), Some(Place::Seconds(stop))) => stop <= start,
            (_, Some(stop)) => stop == Place::Frames(0) || stop == Place::Seconds(0.0),
            (_, None) => false,
        };
        match stop {
            Some(stop) if empty => Err(Failure::usage(format_args!(
                "--stop {stop} is not above --start {start}: --stop is the first frame no longer used"
            ))),
            _ => Ok(Self { start, stop, step }),
        }
    }

    /// Whether times matter.
    pub fn in_seconds(&self) -> bool {
        [Some(self.start), self.stop, Some(self.step)].into_iter().flatten().any(|place| place.frames().is_none())
    }

    /// Distance of used frames where it is a number of frames, else 1: any frame may be the next.
    pub fn stride(&self) -> usize {
        self.step.frames().unwrap_or(1)
    }

    /// How many steps there are from one used frame to a later one, each with its time: 1, or more where frames that
    /// might have been used were left out.
    pub fn steps(&self, from: (usize, Option<f64>), to: (usize, Option<f64>)) -> usize {
        let frames = to.0.saturating_sub(from.0);
        let steps = match (self.step, from.1, to.1) {
            (Place::Frames(step), ..) => frames / step,
            // A step shorter than a frame uses every frame.
            (Place::Seconds(step), Some(from), Some(to)) => ((to - from) / step).round().min(frames as f64) as usize,
            (Place::Seconds(_), ..) => frames,
        };
        steps.max(1)
    }

    /// The frames used of `count` that are `rate` a second.
    ///
    /// # Errors
    /// None is left; seconds where no rate is known.
    pub fn of(self, count: usize, rate: Option<f64>) -> Outcome<Selection> {
        self.check_rate(rate)?;
        let mut picker = Picker::new(self);
        let mut frames = Vec::new();
        for frame in 0..count {
            match picker.pick(frame, rate.map(|rate| frame as f64 / rate)) {
                Pick::Pass => {}
                Pick::Use => frames.push(frame),
                Pick::End => break,
            }
        }
        if frames.is_empty() { Err(self.nothing_left(count)) } else { Ok(Selection { frames }) }
    }

    /// # Errors
    /// Seconds where no rate is known.
    pub fn check_rate(&self, rate: Option<f64>) -> Outcome {
        if rate.is_none() && self.in_seconds() {
            return Err(Failure::usage(
                "--start, --stop and --step in seconds need the times of frames, which INPUT does not tell",
            )
            .hint("say how many frames there are a second with --fps, or count frames"));
        }
        Ok(())
    }

    /// Why no frame of `count` is used.
    pub fn nothing_left(&self, count: usize) -> Failure {
        let there = match count {
            0 => "INPUT has none".to_owned(),
            count => format!("INPUT has {count}, numbered 0 to {}", count - 1),
        };
        match self.stop {
            Some(stop) if self.start.frames().is_none_or(|start| start < count) => {
                Failure::usage(format_args!("no frame lies between --start {} and --stop {stop}: {there}", self.start))
            }
            _ => Failure::usage(format_args!("--start {} is behind the last frame: {there}", self.start)),
        }
    }
}

/// What to do with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pick {
    /// Not this one.
    Pass,
    /// This one.
    Use,
    /// Neither this nor any later one.
    End,
}

/// Decides frame by frame, in order.
#[derive(Clone, Debug)]
pub struct Picker {
    span: Span,
    first: Option<(usize, f64)>,
    /// Steps from the first frame to the next that is due.
    due: f64,
}

impl Picker {
    /// Before the first frame.
    pub fn new(span: Span) -> Self {
        Self { span, first: None, due: 0.0 }
    }

    /// What to do with the next frame.
    pub fn pick(&mut self, frame: usize, time: Option<f64>) -> Pick {
        if self.span.stop.is_some_and(|stop| stop.reached(frame, time)) {
            return Pick::End;
        }
        if self.first.is_none() && !self.span.start.reached(frame, time) {
            return Pick::Pass;
        }
        let (first, began) = *self.first.get_or_insert((frame, time.unwrap_or(0.0)));
        let due = match self.span.step {
            Place::Frames(step) => (frame - first).is_multiple_of(step),
            Place::Seconds(step) => {
                let steps = (time.unwrap_or(0.0) - began + SLACK) / step;
                let due = steps >= self.due;
                if due {
                    self.due = steps.floor() + 1.0;
                }
                due
            }
        };
        if due { Pick::Use } else { Pick::Pass }
    }
}

/// Frames that are used, in order, where they are known beforehand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Selection {
    frames: Vec<usize>,
}

impl Selection {
    /// All of a sequence.
    pub fn all(count: usize) -> Self {
        Self { frames: (0..count).collect() }
    }

    /// Selections that take turns, at most `parts` of them: one frame of each, over and over, gives these frames.
    pub fn turns(&self, parts: usize) -> impl Iterator<Item = Self> + '_ {
        let parts = parts.clamp(1, self.frames.len().max(1));
        (0..parts).map(move |part| Self { frames: self.frames.iter().skip(part).step_by(parts).copied().collect() })
    }

    /// Those after a frame.
    pub fn after(&self, done: Option<usize>) -> Self {
        Self { frames: self.frames.iter().copied().filter(|frame| Some(*frame) > done).collect() }
    }

    /// The selected frames in order.
    pub fn frames(&self) -> &[usize] {
        &self.frames
    }

    /// The same, to be taken one by one.
    pub fn into_frames(self) -> IntoIter<usize> {
        self.frames.into_iter()
    }

    /// Whether `frame` is among them.
    pub fn contains(&self, frame: usize) -> bool {
        self.frames.binary_search(&frame).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(start: &str, stop: Option<&str>, step: &str) -> Outcome<Span> {
        let place = |text: &str| text.parse::<Place>().unwrap();
        Span::new(place(start), stop.map(place), place(step))
    }

    #[test]
    fn places() {
        assert_eq!("120".parse(), Ok(Place::Frames(120)));
        assert_eq!("2.5s".parse(), Ok(Place::Seconds(2.5)));
        assert_eq!("0.5 s".parse(), Ok(Place::Seconds(0.5)));
        for bad in ["", "s", "-1", "-1s", "2.5", "1m", "nans", "infs", "1e400s"] {
            assert!(bad.parse::<Place>().is_err(), "{bad}");
        }
        assert_eq!((Place::Frames(3).to_string(), Place::Seconds(0.25).to_string()), ("3".into(), "0.25s".into()));
    }

    #[test]
    fn turns_are_the_whole() {
        for (start, stop, step) in [("0", "10", "1"), ("3", "11", "4"), ("2", "3", "1"), ("5", "100", "7")] {
            let selection = span(start, Some(stop), step).unwrap().of(100, None).unwrap();
            for parts in 0..5 {
                let turns: Vec<Selection> = selection.turns(parts).collect();
                assert!(turns.len() <= parts.max(1) && turns.iter().all(|turn| !turn.frames().is_empty()));
                let longest = turns[0].frames().len();
                let whole =
                    (0..longest).flat_map(|i| turns.iter().filter_map(move |turn| turn.frames().get(i).copied()));
                assert_eq!(whole.collect::<Vec<_>>(), selection.frames());
            }
        }
    }

    #[test]
    fn selects_as_a_python_slice_does() {
        let selection = span("3", Some("11"), "4").unwrap().of(100, None).unwrap();
        assert_eq!(selection.frames(), [3, 7]);
        assert!(selection.contains(7) && !selection.contains(8) && !selection.contains(11));
        assert_eq!(span("0", Some("999"), "1").unwrap().of(5, None).unwrap().frames().len(), 5);
        for (start, stop, step) in [("0", None, "0"), ("0", None, "0s"), ("3", Some("3"), "1"), ("3s", Some("2s"), "1")]
        {
            assert!(span(start, stop, step).is_err());
        }
        for (start, count) in [("5", 5), ("0", 0), ("1s", 5)] {
            assert!(span(start, None, "1").unwrap().of(count, Some(10.0)).is_err());
        }
        assert!(span("1s", None, "1").unwrap().of(100, None).is_err(), "no rate");
    }

    #[test]
    fn seconds_are_frames_at_their_rate() {
        let of = |start, stop, step| span(start, stop, step).unwrap().of(100, Some(30.0)).unwrap().frames().to_vec();
        assert_eq!(of("1s", Some("2s"), "0.1s"), of("30", Some("60"), "3"));
        assert_eq!(of("0.2s", None, "2"), of("6", None, "2"));
        assert_eq!(of("0", Some("7"), "0.05s"), [0, 2, 3, 5, 6]);
        assert_eq!(of("0", Some("4"), "0.001s"), [0, 1, 2, 3]);
    }

    #[test]
    fn frames_left_out_are_steps() {
        let steps = |step: &str, from: usize, to: usize, rate: f64| {
            let at = |frame: usize| (frame, Some(frame as f64 / rate));
            span("0", None, step).unwrap().steps(at(from), at(to))
        };
        assert_eq!((steps("1", 3, 4, 30.0), steps("1", 3, 9, 30.0)), (1, 6));
        assert_eq!((steps("3", 3, 6, 30.0), steps("3", 3, 12, 30.0)), (1, 3));
        assert_eq!((steps("0.1s", 3, 6, 30.0), steps("0.1s", 3, 12, 30.0)), (1, 3));
        // 0, 3, 5, 8, ... of 25 a second.
        assert_eq!((steps("0.1s", 0, 3, 25.0), steps("0.1s", 3, 5, 25.0), steps("0.1s", 0, 8, 25.0)), (1, 1, 3));
        assert_eq!((steps("0.001s", 3, 4, 30.0), steps("0.001s", 3, 6, 30.0)), (1, 3));
        assert_eq!(Span::ALL.steps((3, None), (5, None)), 2);
        assert_eq!(span("0", None, "1s").unwrap().steps((3, Some(2.0)), (5, Some(1.0))), 1, "times that run back");
    }

    /// Times that a container rounded to a millisecond choose the frames that exact ones do.
    #[test]
    fn rounded_times_choose_the_same() {
        for step in ["0.1s", "0.0666667s", "0.5s"] {
            let pick = |time: &dyn Fn(usize) -> f64| {
                let mut picker = Picker::new(span("0.2s", Some("3s"), step).unwrap());
                let picked = (0..200).filter(|frame| picker.pick(*frame, Some(time(*frame))) == Pick::Use);
                picked.collect::<Vec<_>>()
            };
            let rounded = |frame: usize| (frame as f64 / 30.0 * 1000.0).round() / 1000.0;
            assert_eq!(pick(&rounded), pick(&|frame| frame as f64 / 30.0));
        }
    }

    #[test]
    fn a_gap_in_time_is_no_reason_to_hurry_after_it() {
        let mut picker = Picker::new(span("0", None, "1s").unwrap());
        let times = [0.0, 0.5, 3.2, 3.3, 3.9, 4.0, 4.1];
        let picked: Vec<f64> = times
            .into_iter()
            .enumerate()
            .filter(|(i, t)| picker.pick(*i, Some(*t)) == Pick::Use)
            .map(|p| p.1)
            .collect();
        assert_eq!(picked, [0.0, 3.2, 4.0]);
    }
}
