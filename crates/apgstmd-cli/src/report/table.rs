//! The table on a terminal.

use super::{Report, degrees, pixels, score};

/// The whole table.
pub fn text(report: &Report) -> String {
    let mut text = format!("{} against {}\n\n", report.detections.display(), report.truth.display());
    text += &facts(&report.facts());
    let mut rows = vec![
        ["false alarms/frame", "detection rate", "score at least", "position off by", "direction off by"]
            .map(str::to_owned),
    ];
    for row in report.operating_points() {
        let within = if row.point.limit.is_some() { "<= " } else { "" };
        let alarms = match (row.point.limit, row.point.point) {
            (None, Some(point)) => format!("{}: {:.2}", row.name, point.false_alarms),
            _ => format!("{within}{}", row.name),
        };
        rows.push([
            alarms,
            format!("{:.3}", row.point.detection_rate),
            row.point.point.map_or("-".to_owned(), |point| score(point.threshold)),
            pixels(row.point.localisation_error),
            degrees(row.point.direction_error),
        ]);
    }
    text.push('\n');
    text += &align(&rows);
    let tracks = report.track_facts();
    if !tracks.is_empty() {
        text += &format!("\n{}", facts(&tracks));
    }
    for note in report.notes() {
        text += &format!("\nnote: {note}\n");
    }
    text
}

/// A name, a value, a remark a line.
fn facts(rows: &[[String; 3]]) -> String {
    let widths = [0, 1].map(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0));
    let mut text = String::new();
    for [name, value, remark] in rows {
        text += format!("{name:<0$}   {value:>1$}   {remark}", widths[0], widths[1]).trim_end();
        text.push('\n');
    }
    text
}

/// Columns to the right, three blanks between.
pub fn align<const N: usize>(rows: &[[String; N]]) -> String {
    let widths: [usize; N] =
        std::array::from_fn(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0));
    let mut text = String::new();
    for row in rows {
        let cells: Vec<String> = row.iter().zip(widths).map(|(cell, width)| format!("{cell:>width$}")).collect();
        text += cells.join("   ").trim_end();
        text.push('\n');
    }
    text
}
