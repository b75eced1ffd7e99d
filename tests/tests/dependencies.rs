//! Every dependency is listed with its reason, and nothing else.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Packages that a Cargo.toml names, but for those of this project.
fn of_manifest(path: &Path) -> Vec<String> {
    let manifest: toml::Table = toml::from_str(&read(path)).unwrap();
    let tables = ["dependencies", "dev-dependencies", "build-dependencies"];
    let systems = manifest.get("target").and_then(|target| target.as_table());
    let everywhere = systems.into_iter().flat_map(|systems| systems.values().filter_map(|system| system.as_table()));
    let named = everywhere
        .chain([&manifest])
        .flat_map(|place| tables.iter().filter_map(|table| place.get(*table)?.as_table()))
        .flat_map(|table| table.keys());
    named.filter(|name| !name.starts_with("apgstmd-")).cloned().collect()
}

/// Packages that a file for pip names.
fn of_requirements(path: &Path) -> Vec<String> {
    let text = read(path);
    let lines = text.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_alphanumeric()));
    lines.filter_map(|line| Some(line.split_once("==")?.0.to_owned())).collect()
}

#[test]
fn every_dependency_has_its_reason() {
    let manifests = ["crates/apgstmd-core", "crates/apgstmd-cli", "crates/apgstmd-py", "tests", "benches", "fuzz"];
    let requirements = [
        "tools/requirements-test.txt",
        "tools/requirements-dist.txt",
        "tools/requirements-docs.txt",
        "benches/compare/requirements.txt",
    ];
    let used: BTreeSet<String> = manifests
        .iter()
        .flat_map(|folder| of_manifest(&root().join(folder).join("Cargo.toml")))
        .chain(requirements.iter().flat_map(|file| of_requirements(&root().join(file))))
        .collect();
    let page = read(&root().join("docs/dependencies.md"));
    let rows = page.lines().filter_map(|line| line.strip_prefix("| ")?.split_once(" | "));
    let (mut told, mut twice) = (BTreeSet::new(), Vec::new());
    for (name, reason) in rows.filter(|(name, _)| *name != "package") {
        assert!(reason.len() > 10, "{name} has no reason");
        if !told.insert(name.to_owned()) {
            twice.push(name);
        }
    }
    assert!(twice.is_empty(), "{twice:?} stand twice in docs/dependencies.md");
    let missing: Vec<_> = used.difference(&told).collect();
    let stale: Vec<_> = told.difference(&used).collect();
    assert!(missing.is_empty(), "docs/dependencies.md lacks {missing:?}: say why they are needed");
    assert!(stale.is_empty(), "docs/dependencies.md still has {stale:?}");
}
