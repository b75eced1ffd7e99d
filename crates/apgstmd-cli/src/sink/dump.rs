//! Inner maps as NumPy files, `{stage}_{frame:06}.npy`: (rows, columns), or (directions, rows, columns).

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use apgstmd_core::Stage;
use ndarray::{ArrayViewD, Axis};

use super::{Seen, Sink, beside};
use crate::Outcome;
use crate::failure::Failure;
use crate::settings::DumpSettings;

/// Writes the maps that come with a frame.
pub struct Dump {
    folder: PathBuf,
}

impl Dump {
    /// Makes the folder.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn new(settings: &DumpSettings) -> Outcome<Self> {
        let folder = settings.folder.clone();
        fs::create_dir_all(&folder).map_err(|error| Failure::write(&folder, error))?;
        Ok(Self { folder })
    }
}

impl Sink for Dump {
    fn frame(&mut self, seen: &Seen) -> Outcome {
        for (stage, maps) in &seen.maps {
            let path = self.folder.join(file_name(*stage, seen.frame));
            let view =
                if stage.planes() == 1 { maps.index_axis(Axis(0), 0).into_dyn() } else { maps.view().into_dyn() };
            beside::create(&path, |out| write_npy(out, &view))?;
        }
        Ok(())
    }
}

fn file_name(stage: Stage, frame: usize) -> String {
    format!("{stage}_{frame:06}.npy")
}

/// Whether a file in a dump folder is one of ours by its name.
pub fn is_dump(path: &Path) -> bool {
    let stem = path.file_name().and_then(|name| name.to_str()).and_then(|name| name.strip_suffix(".npy"));
    let parts = stem.and_then(|stem| stem.rsplit_once('_'));
    parts.is_some_and(|(stage, frame)| {
        frame.len() >= 6 && frame.bytes().all(|b| b.is_ascii_digit()) && stage.parse::<Stage>().is_ok()
    })
}

/// NumPy's format 1.0: magic, version, length of the header, header padded so that data start at a multiple of 64.
fn write_npy(out: &mut impl Write, array: &ArrayViewD<'_, f32>) -> io::Result<()> {
    const PREAMBLE: usize = 10;
    let shape: Vec<String> = array.shape().iter().map(usize::to_string).collect();
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({},), }}", shape.join(", "));
    let length = (PREAMBLE + header.len() + 1).next_multiple_of(64) - PREAMBLE;
    header += &" ".repeat(length - header.len() - 1);
    header.push('\n');
    let length = u16::try_from(length).map_err(io::Error::other)?;
    out.write_all(b"\x93NUMPY\x01\x00")?;
    out.write_all(&length.to_le_bytes())?;
    out.write_all(header.as_bytes())?;
    for value in array {
        out.write_all(&value.to_le_bytes())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_names() {
        assert_eq!(file_name(Stage::Tm1_4, 60), "Tm1_4_000060.npy");
        for (name, ours) in
            [("Tm1_4_000060.npy", true), ("E_1234567.npy", true), ("E_60.npy", false), ("X_000001.npy", false)]
        {
            assert_eq!(is_dump(Path::new(name)), ours, "{name}");
        }
    }

    #[test]
    fn header_is_aligned_and_says_the_shape() {
        let array = ndarray::Array3::from_shape_fn((8, 3, 5), |(k, y, x)| (100 * k + 10 * y + x) as f32);
        let mut bytes = Vec::new();
        write_npy(&mut bytes, &array.view().into_dyn()).unwrap();
        assert_eq!(bytes.len() % 64, (8 * 3 * 5 * 4) % 64);
        assert!(String::from_utf8_lossy(&bytes[..128]).contains("'shape': (8, 3, 5,)"));
        assert_eq!(bytes[bytes.len() - 4..], 724f32.to_le_bytes());
    }
}
