//! The quick half of fuzzing: every boundary with its seeds, with every finding there ever was, and with changes of both.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use apgstmd_tests::boundary::ALL;

/// Changes of each boundary's seeds, the same on every machine, where BOUNDARY_CHANGES asks for no other number. What fuzzing
/// finds does not fit here: see `make fuzz`.
const CHANGES: u64 = 100;

fn seeds(name: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/seeds").join(name);
    let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// A stream of numbers: xorshift.
struct Dice(u64);

impl Dice {
    fn below(&mut self, most: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) as usize % most.max(1)
    }

    /// Some bytes other, gone, twice or new.
    fn change(&mut self, bytes: &[u8]) -> Vec<u8> {
        const ODD: [&[u8]; 10] =
            [b"nan", b"-1", b"1e308", b"99999999999999999999", b"\0", b"\xff\xff\xff\xff", b"\n", b"[", b"\"", b","];
        let mut bytes = bytes.to_vec();
        for _ in 0..=self.below(4) {
            let at = self.below(bytes.len() + 1);
            let length = self.below(9).min(bytes.len() - at);
            match self.below(5) {
                0 if length > 0 => bytes[at] ^= 1 << self.below(8),
                1 if length > 0 => bytes[at] = self.below(256) as u8,
                2 => drop(bytes.drain(at..at + length)),
                3 => {
                    let piece = bytes[at..at + length].to_vec();
                    bytes.splice(at..at, piece);
                }
                _ => {
                    let odd = ODD[self.below(ODD.len())];
                    bytes.splice(at..at, odd.iter().copied());
                }
            }
        }
        bytes
    }
}

#[test]
fn seeds_findings_and_changes_of_them() {
    let changes = std::env::var("BOUNDARY_CHANGES").map_or(CHANGES, |changes| changes.parse().expect("a number"));
    for boundary in ALL {
        let files = seeds(boundary.name);
        assert!(!files.is_empty(), "{} has no seeds: see make-seeds", boundary.name);
        let contents: Vec<Vec<u8>> = files.iter().map(|file| fs::read(file).unwrap()).collect();
        (boundary.check)(&[]);
        for (file, bytes) in files.iter().zip(&contents) {
            println!("{}", file.display());
            (boundary.check)(bytes);
        }
        let (mut dice, begin) = (Dice(0x5eed), Instant::now());
        for rounds in 0..changes {
            let seed = dice.below(contents.len());
            let bytes = dice.change(&contents[seed]);
            let shown = Shown { name: boundary.name, rounds, bytes: &bytes };
            (boundary.check)(&bytes);
            drop(shown);
        }
        println!("{}: {} seeds, {changes} changes in {:.1?}", boundary.name, files.len(), begin.elapsed());
    }
}

/// Says what was tried where that failed.
struct Shown<'a> {
    name: &'static str,
    rounds: u64,
    bytes: &'a [u8],
}

impl Drop for Shown<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            let file = std::env::temp_dir().join(format!("boundary-{}-{}", self.name, self.rounds));
            let kept = fs::write(&file, self.bytes).is_ok();
            eprintln!("{}: change {} fails; it is kept in {} ({kept})", self.name, self.rounds, file.display());
        }
    }
}
