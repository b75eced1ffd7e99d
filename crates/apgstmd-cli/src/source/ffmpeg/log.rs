//! What ffmpeg says on stderr, read as it comes so that it never has to wait: the time and size of each frame (from its
//! filter `showinfo`), and what went wrong.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use apgstmd_core::Size;

/// Complaints that are kept.
const LAST: usize = 20;

/// What is told of a frame before its samples come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stamp {
    pub size: Size,
    /// Seconds, exact: a count of the stream's own unit.
    pub time: Option<f64>,
}

/// What went wrong.
#[derive(Clone, Debug, Default)]
pub(crate) struct Complaints {
    /// Errors, and packets known to be damaged.
    pub errors: usize,
    /// The first of them.
    pub first: Option<String>,
    /// The last lines that were not mere information.
    pub last: VecDeque<String>,
}

impl Complaints {
    /// The line that says most: the last.
    pub fn reason(&self) -> Option<&str> {
        self.last.back().map(String::as_str)
    }

    fn add(&mut self, level: &str, text: &str) {
        if text.is_empty() || matches!(level, "info" | "verbose" | "debug") {
            return;
        }
        if self.last.len() == LAST {
            self.last.pop_front();
        }
        self.last.push_back(text.to_owned());
        if matches!(level, "error" | "fatal" | "panic") || text.to_lowercase().contains("corrupt") {
            self.errors += 1;
            self.first.get_or_insert_with(|| text.to_owned());
        }
    }
}

/// Starts the thread that reads `stderr`; `clean` takes from a line what nobody should see.
pub(crate) fn listen(
    stderr: impl Read + Send + 'static,
    clean: impl Fn(&str) -> String + Send + 'static,
) -> std::io::Result<(Receiver<Stamp>, JoinHandle<Complaints>)> {
    let (sender, stamps) = channel();
    let thread = std::thread::Builder::new()
        .name("apgstmd-ffmpeg".to_owned())
        .spawn(move || read(BufReader::new(stderr), &sender, clean))?;
    Ok((stamps, thread))
}

/// Reads to the end.
pub(crate) fn read(mut stderr: impl BufRead, stamps: &Sender<Stamp>, clean: impl Fn(&str) -> String) -> Complaints {
    let mut complaints = Complaints::default();
    let mut unit = None;
    let mut line = Vec::new();
    while stderr.read_until(b'\n', &mut line).is_ok_and(|read| read > 0) {
        let text = String::from_utf8_lossy(&line);
        let Line { context, level, text } = Line::parse(text.trim_end());
        if context.starts_with("Parsed_showinfo") {
            if let Some(told) = text.strip_prefix("config in time_base: ") {
                unit = told.split(',').next().and_then(ratio);
            } else if let Some(stamp) = stamp(text, unit) {
                // Read on even if nobody wants to know: ffmpeg must not wait.
                let _ = stamps.send(stamp);
            }
        } else {
            complaints.add(level, &clean(text));
        }
        line.clear();
    }
    complaints
}

/// `[context @ 0x55] [level] text`, the first two perhaps missing.
struct Line<'a> {
    context: &'a str,
    level: &'a str,
    text: &'a str,
}

impl<'a> Line<'a> {
    fn parse(line: &'a str) -> Self {
        const LEVELS: [&str; 7] = ["panic", "fatal", "error", "warning", "info", "verbose", "debug"];
        let (mut context, mut level, mut text) = ("", "", line);
        while let Some((inside, rest)) = text.strip_prefix('[').and_then(|rest| rest.split_once("] ")) {
            if LEVELS.contains(&inside) {
                level = inside;
            } else if level.is_empty() && inside.contains(" @ ") {
                context = inside;
            } else {
                break;
            }
            text = rest;
        }
        Self { context, level, text: text.trim() }
    }
}

/// `n:   0 pts:    512 pts_time:0.0333 ... s:96x64 ...`.
fn stamp(text: &str, unit: Option<f64>) -> Option<Stamp> {
    let text = text.strip_prefix("n:")?;
    let after = |key: &str| text.split_once(key).and_then(|(_, rest)| rest.split_whitespace().next());
    let (width, height) = after(" s:")?.split_once('x')?;
    let size = Size { height: height.parse().ok()?, width: width.parse().ok()? };
    let pts = after(" pts:").and_then(|pts| pts.parse::<i64>().ok());
    let time = pts.zip(unit).map(|(pts, unit)| pts as f64 * unit).filter(|time| time.is_finite());
    Some(Stamp { size, time })
}

/// `1001/30000`.
pub(super) fn ratio(text: &str) -> Option<f64> {
    let (above, below) = text.trim().split_once('/')?;
    let ratio = above.parse::<f64>().ok()? / below.parse::<f64>().ok()?;
    (ratio.is_finite() && ratio > 0.0).then_some(ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLD: &str = "\
[info] Input #0, mov,mp4,m4a,3gp,3g2,mj2, from 'file:y.mp4':
[Parsed_showinfo_1 @ 0x561a4cb30b00] [info] config in time_base: 1/15360, frame_rate: 30/1
[Parsed_showinfo_1 @ 0x561a4cb30b00] [info] config out time_base: 0/0, frame_rate: 0/0
[Parsed_showinfo_1 @ 0x561a4cb30b00] [info] n:   0 pts:      0 pts_time:0       pos:     1474 fmt:gray sar:1/1 s:96x64 i:P iskey:1 type:I
[Parsed_showinfo_1 @ 0x561a4cb30b00] [info]   side data - User Data Unregistered:
[Parsed_showinfo_1 @ 0x561a4cb30b00] [info] color_range:unknown color_space:unknown
[h264 @ 0x1] [error] Invalid NAL unit size (484 > 351).
[Parsed_showinfo_1 @ 0x561a4cb30b00] [info] n:   1 pts: 153600512 pts_time:10000 duration: 512 fmt:gray cl:left sar:1/1 s:64x96 i:P
[Parsed_showinfo_1 @ 0x561a4cb30b00] [info] n:   2 pts:  NOPTS pts_time:NOPTS fmt:gray sar:0/1 s:64x96 i:P
[avi @ 0x2] [warning] Packet corrupt (stream = 0, dts = 27).
[warning] something harmless
Unrecognized option 'fps_mode'.
";

    #[test]
    fn stamps_and_complaints() {
        let (sender, stamps) = channel();
        let complaints = read(TOLD.as_bytes(), &sender, str::to_owned);
        let stamps: Vec<Stamp> = stamps.try_iter().collect();
        assert_eq!(stamps[0], Stamp { size: Size::new(64, 96), time: Some(0.0) });
        // Its own pts_time has six digits: too few after some hours.
        assert_eq!(stamps[1], Stamp { size: Size::new(96, 64), time: Some(153_600_512.0 / 15360.0) });
        assert_eq!(stamps[2].time, None);
        assert_eq!((stamps.len(), complaints.errors), (3, 2));
        assert_eq!(complaints.first.as_deref(), Some("Invalid NAL unit size (484 > 351)."));
        assert_eq!(complaints.reason(), Some("Unrecognized option 'fps_mode'."));
    }

    #[test]
    fn a_time_that_is_none() {
        let text = "n:   0 pts:  99999999999 fmt:gray s:96x64 i:P";
        assert_eq!(stamp(text, Some(1e308)), Some(Stamp { size: Size::new(64, 96), time: None }));
    }

    #[test]
    fn only_the_last_lines_are_kept() {
        let told: String = (0..100).map(|i| format!("[error] line {i}\n")).collect();
        let complaints = read(told.as_bytes(), &channel().0, str::to_owned);
        assert_eq!((complaints.errors, complaints.last.len(), complaints.last[0].as_str()), (100, LAST, "line 80"));
    }

    #[test]
    fn bytes_that_are_no_text() {
        let complaints = read(&b"[error] \xff\xfe\n\n\r\n[error]"[..], &channel().0, str::to_owned);
        assert!(complaints.errors == 1);
    }
}
