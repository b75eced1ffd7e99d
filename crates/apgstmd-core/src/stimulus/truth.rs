//! Ground truth: one row per target and frame, and its CSV file `frame,id,x,y,w,h,visible,contrast`.

use serde::{Deserialize, Serialize};

use super::error::SceneError;

/// d of the Weber contrast: how far the neighbourhood of a target reaches beyond its edges, px.
pub const NEIGHBOURHOOD: f64 = 10.0;

/// A target in one frame: the box of its part inside the picture.
///
/// `x`, `y` is the upper left *edge* of the box, with pixel i between edge i and edge i + 1. The centre as an array
/// index, where pixel centres are integers as for detections, is [`Truth::center`]: (x + w/2 - 0.5, y + h/2 - 0.5).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// Frame, counted from 0.
    pub frame: usize,
    /// Number of the target in the scene.
    pub id: usize,
    /// Left edge, px.
    pub x: f64,
    /// Upper edge, px.
    pub y: f64,
    /// Width inside the picture, px.
    #[serde(rename = "w")]
    pub width: f64,
    /// Height inside the picture, px.
    #[serde(rename = "h")]
    pub height: f64,
    /// Whether at least half of the whole target can be seen.
    pub visible: bool,
    /// Weber contrast: |mean luminance of the target - mean luminance within 10 px around it|, without noise.
    pub contrast: f64,
}

impl Truth {
    /// Centre of the box as an array index, (x, y).
    pub fn center(&self) -> (f64, f64) {
        (self.x + self.width / 2.0 - 0.5, self.y + self.height / 2.0 - 0.5)
    }
}

/// First line of a truth file.
const HEADER: &str = "frame,id,x,y,w,h,visible,contrast";

/// The truth as CSV text.
pub fn truth_to_csv(rows: &[Truth]) -> String {
    let mut text = String::from(HEADER);
    text.push('\n');
    for row in rows {
        let Truth { frame, id, x, y, width, height, visible, contrast } = row;
        let visible = u8::from(*visible);
        text += &format!("{frame},{id},{x:.3},{y:.3},{width:.3},{height:.3},{visible},{contrast:.4}\n");
    }
    text
}
