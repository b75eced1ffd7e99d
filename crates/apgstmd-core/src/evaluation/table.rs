//! Tables from text, with errors that say where and what.

use std::str::FromStr;

use csv::{ReaderBuilder, StringRecord, Trim};
use thiserror::Error;

/// A table that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("line {line}: found {given}, but expected {expected}")]
pub struct ReadError {
    /// Line, counted from 1.
    pub line: u64,
    /// What stands there.
    pub given: String,
    /// What should.
    pub expected: String,
}

/// A table of text whose rows all have one length.
pub(crate) struct Table {
    columns: Vec<String>,
    rows: Vec<(u64, StringRecord)>,
}

impl Table {
    /// With the names of its columns in the first line.
    pub fn with_header(text: &str) -> Result<Self, ReadError> {
        let mut rows = records(text)?;
        if rows.is_empty() {
            let expected = "a first line with the names of the columns".into();
            return Err(ReadError { line: 1, given: "an empty file".into(), expected });
        }
        let columns: Vec<String> = rows.remove(0).1.iter().map(str::to_owned).collect();
        let expected = columns.len();
        if let Some((line, row)) = rows.iter().find(|(_, row)| row.len() != expected) {
            let (given, expected) = (format!("{} fields", row.len()), format!("{expected} as in the first line"));
            return Err(ReadError { line: *line, given, expected });
        }
        Ok(Self { columns, rows })
    }

    /// Without header: the columns are named here, and every row must have the first `least` of them.
    pub fn without_header(text: &str, columns: &[&str], least: usize) -> Result<Self, ReadError> {
        let rows = records(text)?;
        if let Some((line, row)) = rows.iter().find(|(_, row)| row.len() < least) {
            let (given, expected) =
                (format!("{} fields", row.len()), format!("at least {}", columns[..least].join(",")));
            return Err(ReadError { line: *line, given, expected });
        }
        Ok(Self { columns: columns.iter().map(|name| (*name).to_owned()).collect(), rows })
    }

    /// Fails unless every `required` column is there and, if `others` is given, no column besides both.
    pub fn check_columns(&self, required: &[&str], others: Option<&[&str]>) -> Result<(), ReadError> {
        let given = format!("the columns {}", self.columns.join(","));
        if let Some(missing) = required.iter().find(|name| !self.columns.iter().any(|c| c == **name)) {
            let expected = format!("a column \"{missing}\" (needed: {})", required.join(","));
            return Err(ReadError { line: 1, given, expected });
        }
        for (i, column) in self.columns.iter().enumerate() {
            let name = column.as_str();
            if self.columns[..i].contains(column) {
                let expected = "each column once".into();
                return Err(ReadError { line: 1, given: format!("column \"{column}\" twice"), expected });
            }
            if let Some(others) = others.filter(|others| !required.contains(&name) && !others.contains(&name)) {
                let expected = format!("only {},{}", required.join(","), others.join(","));
                return Err(ReadError { line: 1, given: format!("column \"{column}\""), expected });
            }
        }
        Ok(())
    }

    /// Whether there is a column of this name.
    pub fn has(&self, column: &str) -> bool {
        self.columns.iter().any(|name| name == column)
    }

    pub fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.rows.iter().map(|(line, record)| Row { columns: &self.columns, line: *line, record })
    }
}

fn records(text: &str) -> Result<Vec<(u64, StringRecord)>, ReadError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader =
        ReaderBuilder::new().has_headers(false).flexible(true).trim(Trim::All).from_reader(text.as_bytes());
    reader
        .records()
        .map(|record| {
            let record = record.map_err(|error| ReadError {
                line: error.position().map_or(1, csv::Position::line),
                given: error.to_string(),
                expected: "comma-separated values".into(),
            })?;
            Ok((record.position().map_or(1, csv::Position::line), record))
        })
        .collect()
}

/// One row of a table.
pub(crate) struct Row<'a> {
    columns: &'a [String],
    line: u64,
    record: &'a StringRecord,
}

impl Row<'_> {
    /// Number of fields.
    pub fn len(&self) -> usize {
        self.record.len()
    }

    /// The text of a column; none when the table has no such column or the field is empty.
    pub fn text(&self, column: &str) -> Option<&str> {
        let index = self.columns.iter().position(|name| name == column)?;
        self.record.get(index).filter(|text| !text.is_empty())
    }

    /// A count from 0.
    pub fn count(&self, column: &str) -> Result<usize, ReadError> {
        self.parse(column, "a whole number of at least 0")
    }

    /// A whole number where there is one.
    pub fn integer(&self, column: &str) -> Result<Option<i64>, ReadError> {
        self.text(column).map(|_| self.parse(column, "a whole number")).transpose()
    }

    /// A finite number.
    pub fn number(&self, column: &str) -> Result<f64, ReadError> {
        let value: f64 = self.parse(column, "a finite number")?;
        self.require(value.is_finite(), column, "a finite number").map(|()| value)
    }

    /// A number of at least 0.
    pub fn length(&self, column: &str) -> Result<f64, ReadError> {
        let value = self.number(column)?;
        self.require(value >= 0.0, column, "a number of at least 0").map(|()| value)
    }

    /// 0 or 1; `missing` without such a column.
    pub fn flag(&self, column: &str, missing: bool) -> Result<bool, ReadError> {
        match self.text(column) {
            Some("0" | "false") => Ok(false),
            Some("1" | "true") => Ok(true),
            None if !self.columns.iter().any(|name| name == column) => Ok(missing),
            _ => self.require(false, column, "0 or 1").map(|()| missing),
        }
    }

    /// Fails with what stands in a column unless `holds`.
    pub fn require(&self, holds: bool, column: &str, expected: &str) -> Result<(), ReadError> {
        if holds {
            return Ok(());
        }
        let given = format!("{column} = \"{}\"", self.text(column).unwrap_or_default());
        Err(ReadError { line: self.line, given, expected: expected.to_owned() })
    }

    fn parse<T: FromStr + Default>(&self, column: &str, expected: &str) -> Result<T, ReadError> {
        let value = self.text(column).and_then(|text| text.parse().ok());
        self.require(value.is_some(), column, expected)?;
        Ok(value.unwrap_or_default())
    }
}
