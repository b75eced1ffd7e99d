//! Ground truth: one row per target and frame, and its CSV file `frame,id,x,y,w,h,visible,contrast`.

use serde::{Deserialize, Serialize};

use crate::evaluation::{ReadError, Table, TruthBox};

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

impl From<Truth> for TruthBox {
    fn from(truth: Truth) -> Self {
        let Truth { frame, id, x, y, width, height, visible, .. } = truth;
        Self { frame, id: Some(id as i64), x, y, width, height, visible, ignore: false }
    }
}

const COLUMNS: [&str; 8] = ["frame", "id", "x", "y", "w", "h", "visible", "contrast"];

/// The truth as CSV text.
pub fn truth_to_csv(rows: &[Truth]) -> String {
    let mut text = COLUMNS.join(",");
    text.push('\n');
    for row in rows {
        let Truth { frame, id, x, y, width, height, visible, contrast } = row;
        let visible = u8::from(*visible);
        text += &format!("{frame},{id},{x:.3},{y:.3},{width:.3},{height:.3},{visible},{contrast:.4}\n");
    }
    text
}

/// Reads what [`truth_to_csv`] wrote. For other truth files see [`crate::evaluation::truth_from_text`].
///
/// # Errors
/// Names the line, what stands there and what was expected.
pub fn truth_from_csv(text: &str) -> Result<Vec<Truth>, ReadError> {
    let table = Table::with_header(text)?;
    table.check_columns(&COLUMNS, Some(&[]))?;
    table
        .rows()
        .map(|row| {
            Ok(Truth {
                frame: row.count("frame")?,
                id: row.count("id")?,
                x: row.number("x")?,
                y: row.number("y")?,
                width: row.length("w")?,
                height: row.length("h")?,
                visible: row.flag("visible", true)?,
                contrast: row.number("contrast")?,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_round_trip() {
        let row = Truth { frame: 7, id: 2, x: 10.25, y: -0.5, width: 5.0, height: 4.125, visible: true, contrast: 0.3 };
        let rows = [row, Truth { frame: 8, visible: false, ..row }];
        let text = truth_to_csv(&rows);
        assert!(
            text.starts_with("frame,id,x,y,w,h,visible,contrast\n7,2,10.250,-0.500,5.000,4.125,1,0.3000\n"),
            "{text}"
        );
        assert_eq!(truth_from_csv(&text).unwrap(), rows);
        let boxes: Vec<TruthBox> = rows.iter().map(|row| (*row).into()).collect();
        assert_eq!(crate::evaluation::truth_from_text(&text).unwrap(), boxes);
        assert_eq!(boxes[0].center(), row.center());
        assert_eq!(row.center(), (12.25, 1.0625));
        let error = truth_from_csv("frame,id,x,y,w,h,visible\n").unwrap_err().to_string();
        assert!(error.contains("contrast"), "{error}");
    }
}
