//! camera.csv: how the background moved from frame to frame, one row a frame. Flushed after each.

use std::io::Write as _;
use std::path::Path;

use super::table::{Target, microseconds};
use super::{Seen, Sink};
use crate::Outcome;

/// Columns of camera.csv.
pub const COLUMNS: &str =
    "frame,time_s,detections,background_x,background_y,rotation_rad,zoom,residual,unexplained,cut";

/// The table.
pub struct CameraCsv(Target);

impl CameraCsv {
    /// Writes the header; with `length` the table is there, and goes on behind so many bytes.
    ///
    /// # Errors
    /// Writing failed.
    pub fn new(path: &Path, length: Option<u64>) -> Outcome<Self> {
        if let Some(length) = length {
            return Ok(Self(Target::resume(path, length)?));
        }
        Ok(Self(Target::file(path)?.headed(COLUMNS)?))
    }
}

impl Sink for CameraCsv {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        let Seen { frame, detections, background_shift: (x, y), ego_motion, cut, .. } = seen;
        let (time, count) = (seen.time.map_or(String::new(), |time| microseconds(time).to_string()), detections.len());
        let (rotation, zoom) = (ego_motion.rotation, ego_motion.zoom);
        let (residual, unexplained, cut) = (ego_motion.residual, u8::from(ego_motion.unexplained), u8::from(*cut));
        // Of a shift a thousandth of a pixel is known at best.
        let moved = format_args!("{x:.4},{y:.4},{rotation:.7},{zoom:.7},{residual:.6}");
        let _ = writeln!(self.0.rows, "{frame},{time},{count},{moved},{unexplained},{cut}");
        self.0.flush()
    }

    fn grows(&self) -> Option<&Path> {
        Some(self.0.path())
    }
}
