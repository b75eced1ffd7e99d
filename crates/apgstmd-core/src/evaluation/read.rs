//! Detections and truth from text.

use super::table::{ReadError, Row, Table};
use super::{Scored, Tracked, TruthBox};

/// Columns of a MOTChallenge truth file; there is no header. Files of results share the first seven.
const MOT: [&str; 9] = ["frame", "id", "left", "top", "width", "height", "conf", "class", "visibility"];
/// How many of them every file has.
const LEAST: usize = 7;

/// Reads detections: a CSV with the columns frame, x, y, score, perhaps direction_rad (others are left aside), or,
/// recognised by its missing header, MOTChallenge text, whose boxes give their centres and whose `conf` is the score.
///
/// # Errors
/// Names the line, what stands there and what was expected.
pub fn detections_from_text(text: &str) -> Result<Vec<Scored>, ReadError> {
    if is_mot(text) {
        let table = Table::without_header(text, &MOT, LEAST)?;
        return table
            .rows()
            .map(|row| {
                let (found, score) = (mot_box(&row)?, row.number("conf")?);
                let (x, y) = found.center();
                Ok(Scored::new(found.frame, x, y, score))
            })
            .collect();
    }
    let table = Table::with_header(text)?;
    table.check_columns(&["frame", "x", "y", "score"], None)?;
    table
        .rows()
        .map(|row| {
            let known = row.text("direction_rad").filter(|text| !text.eq_ignore_ascii_case("nan"));
            Ok(Scored {
                frame: row.count("frame")?,
                x: row.number("x")?,
                y: row.number("y")?,
                score: row.number("score")?,
                direction: known.map(|_| row.number("direction_rad")).transpose()?,
            })
        })
        .collect()
}

/// Reads tracks: a CSV with the columns frame, track, x, y (others are left aside), or, recognised by its missing header,
/// MOTChallenge text, whose boxes give their centres. None where the text says nothing of tracks: no column `track`, or
/// ids below 0.
///
/// # Errors
/// Names the line, what stands there and what was expected.
pub fn tracks_from_text(text: &str) -> Result<Option<Vec<Tracked>>, ReadError> {
    let mot = is_mot(text);
    let table = if mot { Table::without_header(text, &MOT, LEAST)? } else { Table::with_header(text)? };
    let name = if mot { "id" } else { "track" };
    if !mot {
        if !table.has("track") {
            return Ok(None);
        }
        table.check_columns(&["frame", "track", "x", "y"], None)?;
    }
    let mut tracks = Vec::new();
    for row in table.rows() {
        let Some(track) = row.integer(name)?.filter(|id| *id >= 0) else {
            row.require(mot, name, "a whole number of at least 0")?;
            return Ok(None);
        };
        let (frame, (x, y)) = if mot {
            let found = mot_box(&row)?;
            (found.frame, found.center())
        } else {
            (row.count("frame")?, (row.number("x")?, row.number("y")?))
        };
        tracks.push(Tracked { frame, track, x, y });
    }
    Ok(Some(tracks))
}

/// Reads truth: a CSV with the columns frame, x, y, w, h and perhaps visible, id, ignore, contrast; or, recognised by
/// its missing header, MOTChallenge text.
///
/// In the CSV frames count from 0 and x, y is the upper left edge, pixel i lying between edge i and edge i + 1. In
/// MOTChallenge text frames and pixels count from 1, so that the box of the first pixel is 1,1,1,1: frame, left and
/// top are lowered by one. There `conf` 0 means ignore, and in rows of 9 fields the last is the visible share, of
/// which 0 means not visible.
///
/// # Errors
/// Names the line, what stands there and what was expected.
pub fn truth_from_text(text: &str) -> Result<Vec<TruthBox>, ReadError> {
    if is_mot(text) {
        return mot_truth(text);
    }
    let table = Table::with_header(text)?;
    table.check_columns(&["frame", "x", "y", "w", "h"], Some(&["visible", "id", "ignore", "contrast"]))?;
    table
        .rows()
        .map(|row| {
            Ok(TruthBox {
                frame: row.count("frame")?,
                id: row.integer("id")?,
                x: row.number("x")?,
                y: row.number("y")?,
                width: row.length("w")?,
                height: row.length("h")?,
                visible: row.flag("visible", true)?,
                ignore: row.flag("ignore", false)?,
            })
        })
        .collect()
}

fn mot_truth(text: &str) -> Result<Vec<TruthBox>, ReadError> {
    let table = Table::without_header(text, &MOT, LEAST)?;
    table
        .rows()
        .map(|row| {
            let truth_file = row.len() == MOT.len();
            Ok(TruthBox {
                id: row.integer("id")?.filter(|id| *id >= 0),
                visible: !truth_file || row.number("visibility")? > 0.0,
                ignore: row.number("conf")? == 0.0,
                ..mot_box(&row)?
            })
        })
        .collect()
}

/// Frame and box of a MOTChallenge row, lowered to count from 0.
fn mot_box(row: &Row) -> Result<TruthBox, ReadError> {
    let frame = row.count("frame")?;
    row.require(frame >= 1, "frame", "frames that count from 1")?;
    let (left, top) = (row.number("left")? - 1.0, row.number("top")? - 1.0);
    Ok(TruthBox::new(frame - 1, [left, top, row.length("width")?, row.length("height")?]))
}

/// MOTChallenge text has no header: its first field is a number.
fn is_mot(text: &str) -> bool {
    let first = text.trim_start_matches('\u{feff}').trim_start();
    first.split([',', '\n']).next().is_some_and(|field| field.trim().parse::<f64>().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn our_detections() {
        let text = "frame,name,x,y,score,direction_rad,trace\n4,\"a,b.png\",10.5,20,0.25,-1.5,7\n5,c.png,1,2,3e-4,,8\n";
        let found = detections_from_text(text).unwrap();
        assert_eq!(found[0], Scored { direction: Some(-1.5), ..Scored::new(4, 10.5, 20.0, 0.25) });
        assert_eq!(found[1], Scored::new(5, 1.0, 2.0, 3e-4));
        assert_eq!(detections_from_text("frame,x,y,score\n").unwrap(), []);
        assert_eq!(detections_from_text("y,x,score,frame\r\n1,2,3,4\r\n").unwrap(), [Scored::new(4, 2.0, 1.0, 3.0)]);
    }

    #[test]
    fn box_csv_in_all_its_forms() {
        let plain = TruthBox::new(3, [497.0, 122.0, 3.0, 6.0]);
        let read = |text: &str| truth_from_text(text).unwrap();
        assert_eq!(read("frame,x,y,w,h\n3,497.00,122,3,6\n"), [plain]);
        assert_eq!(read("frame,x,y,w,h,visible\n3,497,122,3,6,0\n"), [TruthBox { visible: false, ..plain }]);
        assert_eq!(read("\u{feff}frame,x,y,w,h,visible,id\n3,497,122,3,6,1,2"), [TruthBox { id: Some(2), ..plain }]);
        assert_eq!(read("frame,x,y,w,h,ignore\n3,497,122,3,6,1\n"), [TruthBox { ignore: true, ..plain }]);
        let own = "frame,id,x,y,w,h,visible,contrast\n3,2,497.000,122.000,3.000,6.000,1,0.3000\n";
        assert_eq!(read(own), [TruthBox { id: Some(2), ..plain }]);
    }

    #[test]
    fn mot_text_counts_from_one() {
        let target = TruthBox { id: Some(5), ..TruthBox::new(0, [0.0, 0.0, 3.0, 3.0]) };
        let truth = truth_from_text("1,5,1,1,3,3,1,-1,-1,-1\n2, 5, 2, 1, 3, 3, 0, -1, -1, -1\n").unwrap();
        let next = TruthBox { frame: 1, x: 1.0, ignore: true, ..target };
        assert_eq!(truth, [target, next]);
        assert_eq!(target.center(), (1.0, 1.0));
        let truth = truth_from_text("1,5,1,1,3,3,1,1,0.0\n1,5,1,1,3,3,1,1,0.4\n").unwrap();
        assert_eq!(truth, [TruthBox { visible: false, ..target }, target]);
        assert_eq!(detections_from_text("1,-1,1,1,3,3,0.7,-1,-1,-1\n").unwrap(), [Scored::new(0, 1.0, 1.0, 0.7)]);
    }

    #[test]
    fn tracks_in_both_forms() {
        let read = |text: &str| tracks_from_text(text).unwrap();
        let point = |frame, track, x, y| Tracked { frame, track, x, y };
        let own = "frame,time_s,track,x,y,vx,vy,score,state,age\n4,,7,10.5,20,1,0,0.25,confirmed,0\n";
        assert_eq!(read(own), Some(vec![point(4, 7, 10.5, 20.0)]));
        assert_eq!(read("1,5,1,1,3,3,0.7,-1,-1,-1\n"), Some(vec![point(0, 5, 1.0, 1.0)]));
        assert_eq!(read("frame,track,x,y\n"), Some(vec![]));
        for nothing in ["frame,x,y,score,trace\n1,2,3,4,5\n", "1,-1,1,1,3,3,0.7,-1,-1,-1\n"] {
            assert_eq!(read(nothing), None, "{nothing}");
        }
        let error = tracks_from_text("frame,track,x,y\n1,-1,3,4\n").unwrap_err().to_string();
        assert_eq!(error, "line 2: found track = \"-1\", but expected a whole number of at least 0");
    }

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn errors_name_line_given_and_expected() {
        let truth = |text| truth_from_text(text).unwrap_err().to_string();
        let found = |text| detections_from_text(text).unwrap_err().to_string();
        for (got, expected) in [
            (truth(""), "line 1: found an empty file, but expected a first line with the names of the columns"),
            (
                truth("frame,x,y,w\n"),
                "line 1: found the columns frame,x,y,w, but expected a column \"h\" (needed: frame,x,y,w,h)",
            ),
            (
                truth("frame,x,y,w,h,visibl\n"),
                "line 1: found column \"visibl\", but expected only frame,x,y,w,h,visible,id,ignore,contrast",
            ),
            (truth("frame,x,y,w,h\n0,1,2,3\n"), "line 2: found 4 fields, but expected 5 as in the first line"),
            (truth("frame,x,y,w,h\n0,1,2,-3,4\n"), "line 2: found w = \"-3\", but expected a number of at least 0"),
            (
                truth("frame,x,y,w,h,visible\n0,1,2,3,4,1\n1,1,2,3,4,yes\n"),
                "line 3: found visible = \"yes\", but expected 0 or 1",
            ),
            (
                truth("frame,x,y,w,h\n-1,1,2,3,4\n"),
                "line 2: found frame = \"-1\", but expected a whole number of at least 0",
            ),
            (truth("1,1,5,5,3\n"), "line 1: found 5 fields, but expected at least frame,id,left,top,width,height,conf"),
            (truth("0,1,5,5,3,3,1\n"), "line 1: found frame = \"0\", but expected frames that count from 1"),
            (found("frame,x,y,score\n0,1,2,nan\n"), "line 2: found score = \"nan\", but expected a finite number"),
            (found("frame,x,y,score\n0,,2,1\n"), "line 2: found x = \"\", but expected a finite number"),
            (found("frame,x,x,y,score\n"), "line 1: found column \"x\" twice, but expected each column once"),
        ] {
            assert_eq!(got, expected);
        }
    }
}
