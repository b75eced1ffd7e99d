//! Where results go. As with other results: nothing is overwritten unasked, and asked, only what this program wrote.

use std::fs;
use std::path::PathBuf;

use serde_json::Value;

use super::bench::Done;
use super::{EXPERIMENTS, Experiment};
use crate::Outcome;
use crate::failure::{Failure, reason};
use crate::plot::{Drawing, draw};

/// The page.
pub const PAGE: &str = "index.html";
/// Everything but the numbers of the tables.
pub const SUMMARY: &str = "summary.json";
/// By this the page is known again.
pub const MARK: &str = "<meta name=\"generator\" content=\"apgstmd";
/// By this the summary is.
const PROGRAM: &str = "\"program\": \"apgstmd\"";

/// A folder of results.
pub struct Folder(PathBuf);

/// An experiment on the disk.
pub struct Written {
    /// What it found.
    pub done: Done,
    /// Names of its files.
    pub files: Vec<String>,
    /// For the page.
    pub svg: String,
}

impl Folder {
    /// It need not be there.
    pub fn new(path: PathBuf) -> Self {
        Self(path)
    }

    /// A file in it.
    pub fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Refuses what must not be overwritten.
    ///
    /// # Errors
    /// A file in the way; earlier results without `force`; anything of the same names by others.
    pub fn check(&self, force: bool) -> Outcome {
        let place = self.0.display();
        if self.0.exists() && !self.0.is_dir() {
            return Err(Failure::failed(format_args!("{place} is a file, but a folder is needed there"))
                .hint("choose a folder with --out"));
        }
        for (name, mark) in [(PAGE, MARK), (SUMMARY, PROGRAM)] {
            let path = self.file(name);
            if path.exists() && !fs::read_to_string(&path).is_ok_and(|text| text.contains(mark)) {
                return Err(Failure::failed(format_args!(
                    "{} is there already, and not from this program",
                    path.display()
                ))
                .hint("choose another folder with --out"));
            }
        }
        match self.earlier()?.first() {
            Some(path) if !force => {
                Err(Failure::failed(format_args!("{} is there already from an earlier run", path.display()))
                    .hint("choose another folder with --out, or replace the earlier results with --force"))
            }
            _ => Ok(()),
        }
    }

    /// Makes the folder and clears it of earlier results, which [`Folder::check`] let pass.
    ///
    /// # Errors
    /// The system refuses.
    pub fn prepare(&self) -> Outcome {
        fs::create_dir_all(&self.0)
            .map_err(|error| Failure::write(&self.0, error).hint("choose a folder you may write to with --out"))?;
        for path in self.earlier()? {
            fs::remove_file(&path).map_err(|error| Failure::write(&path, error))?;
        }
        Ok(())
    }

    /// Files of an earlier run: what its summary names, and what has the name of a figure or a lone table.
    fn earlier(&self) -> Outcome<Vec<PathBuf>> {
        if !self.0.is_dir() {
            return Ok(Vec::new());
        }
        let entries = fs::read_dir(&self.0).map_err(|error| {
            Failure::failed(format_args!("cannot read the folder {}: {}", self.0.display(), reason(&error)))
        })?;
        let listed = self.listed();
        let ours = |path: &PathBuf| {
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            path.is_file() && (is_ours(name) || listed.iter().any(|listed| listed == name))
        };
        let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).filter(ours).collect();
        files.sort();
        Ok(files)
    }

    /// Files that the summary of an earlier run names.
    fn listed(&self) -> Vec<String> {
        let text = fs::read_to_string(self.file(SUMMARY)).unwrap_or_default();
        let summary: Value = serde_json::from_str(&text).unwrap_or_default();
        let experiments = summary["experiments"].as_array().into_iter().flatten();
        let files = experiments.flat_map(|experiment| experiment["files"].as_array().into_iter().flatten());
        files.filter_map(|file| file.as_str().map(str::to_owned)).collect()
    }

    /// Writes a file.
    ///
    /// # Errors
    /// The system refuses.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> Outcome {
        let path = self.file(name);
        fs::write(&path, content).map_err(|error| Failure::write(&path, error))
    }

    /// Writes the figure and the tables of an experiment.
    ///
    /// # Errors
    /// The system refuses.
    pub fn keep(&self, done: Done) -> Outcome<Written> {
        let name = done.experiment.name;
        let Drawing { svg, png } = draw(&done.findings.figure);
        let mut files = vec![format!("{name}.svg"), format!("{name}.png")];
        self.write(&files[0], &svg)?;
        self.write(&files[1], &png)?;
        for table in &done.findings.tables {
            let file = table_name(done.experiment, table.name);
            self.write(&file, table.csv())?;
            files.push(file);
        }
        Ok(Written { done, files, svg })
    }
}

fn table_name(experiment: &Experiment, table: &str) -> String {
    let dash = if table.is_empty() { "" } else { "-" };
    format!("{}{dash}{table}.csv", experiment.name)
}

fn is_ours(name: &str) -> bool {
    let of_an_experiment = EXPERIMENTS.iter().any(|experiment| {
        let rest = name.strip_prefix(experiment.name).unwrap_or_default();
        matches!(rest, ".svg" | ".png" | ".csv")
    });
    name == PAGE || name == SUMMARY || of_an_experiment
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_we_wrote_is_replaced() {
        let place = tempfile::tempdir().unwrap();
        let put = |name: &str, text: &str| fs::write(place.path().join(name), text).unwrap();
        for name in
            ["velocity-tuning.csv", "velocity-tuning.svg", "occlusion-map.csv", "occlusion-notes.csv", "notes.md"]
        {
            put(name, "x");
        }
        fs::create_dir(place.path().join("occlusion.png")).unwrap();
        let folder = Folder::new(place.path().to_owned());
        let names = || {
            let files = folder.earlier().unwrap();
            files.iter().map(|path| path.file_name().unwrap().to_str().unwrap().to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(names(), ["velocity-tuning.csv", "velocity-tuning.svg"]);
        put(SUMMARY, r#"{"program": "apgstmd", "experiments": [{"files": ["occlusion-map.csv", "gone.csv", 3]}]}"#);
        assert_eq!(names(), ["occlusion-map.csv", SUMMARY, "velocity-tuning.csv", "velocity-tuning.svg"]);
        assert!(folder.check(false).is_err() && folder.check(true).is_ok());
    }
}
