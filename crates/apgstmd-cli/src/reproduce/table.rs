//! Numbers as CSV: one row for each thing measured.

use super::record::{Record, Recording, Records};

/// A file of numbers.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Part of the file's name behind the experiment's; may be empty.
    pub name: &'static str,
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty one.
    pub fn new<S: Into<String>>(name: &'static str, columns: impl IntoIterator<Item = S>) -> Self {
        Self { name, columns: columns.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// Adds a row, as many cells as there are columns.
    pub fn push<S: ToString>(&mut self, cells: impl IntoIterator<Item = S>) {
        let row: Vec<String> = cells.into_iter().map(|cell| cell.to_string()).collect();
        debug_assert_eq!(row.len(), self.columns.len());
        self.rows.push(row);
    }

    /// The file.
    pub fn csv(&self) -> String {
        let mut writer = csv::WriterBuilder::new().from_writer(Vec::new());
        for row in std::iter::once(&self.columns).chain(&self.rows) {
            writer.write_record(row).expect("memory takes every row, and all are of one length");
        }
        let bytes = writer.into_inner().expect("memory takes every row");
        String::from_utf8(bytes).expect("text in, text out")
    }

    /// Everything that was recorded, a table for each kind of record.
    pub fn of(records: &Records) -> Vec<Self> {
        let mut tables: Vec<Self> = Vec::new();
        for record in &records.0 {
            for (name, kept) in &record.kept {
                append(&mut tables, record, name, kept);
            }
        }
        if let [only] = &mut tables[..] {
            only.name = "";
        }
        tables
    }
}

fn append(tables: &mut Vec<Table>, record: &Record, name: &str, kept: &Recording) {
    let row = |cells: &[f64]| -> Vec<String> {
        let factors = record.factors.iter().map(|factor| factor.1.to_string());
        factors.chain([name.to_owned()]).chain(cells.iter().map(f64::to_string)).collect()
    };
    match kept {
        Recording::Peaks(peaks) => {
            let table = of_kind(tables, "peaks", record, &["direction_deg", "E", "Q"]);
            for k in 0..peaks.e.len() {
                table.push(row(&[45.0 * k as f64, peaks.e[k], peaks.q[k]]));
            }
        }
        Recording::Course(course) => {
            let table = of_kind(tables, "course", record, &["frame", "E", "Q"]);
            for (frame, e, q) in course {
                table.push(row(&[*frame as f64, *e, *q]));
            }
        }
        Recording::Line(lines) => {
            let names: Vec<&str> = std::iter::once("x").chain(lines.iter().map(|line| line.0)).collect();
            let table = of_kind(tables, "line", record, &names);
            for x in 0..lines.first().map_or(0, |line| line.1.len()) {
                let cells: Vec<f64> = std::iter::once(x as f64).chain(lines.iter().map(|line| line.1[x])).collect();
                table.push(row(&cells));
            }
        }
        Recording::Map { corner, e, q } => {
            let table = of_kind(tables, "map", record, &["x", "y", "E", "Q"]);
            for ((y, x), value) in e.indexed_iter() {
                table.push(row(&[(corner.0 + x) as f64, (corner.1 + y) as f64, *value, q[(y, x)]]));
            }
        }
        // A picture is no table: the figure shows it.
        Recording::Picture(_) => {}
    }
}

/// The table of a kind, made when first asked for: the numbers of the condition, the recorder, then `columns`.
fn of_kind<'a>(tables: &'a mut Vec<Table>, kind: &'static str, record: &Record, columns: &[&str]) -> &'a mut Table {
    let place = tables.iter().position(|table| table.name == kind).unwrap_or_else(|| {
        let factors = record.factors.iter().map(|factor| factor.0);
        tables.push(Table::new(kind, factors.chain(["recorder"]).chain(columns.iter().copied())));
        tables.len() - 1
    });
    &mut tables[place]
}
