//! Golden data: frames and the stages of some of them, in `.npz` files.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

use apgstmd_core::params::BackgroundMotion;
use apgstmd_core::{Params, Preset, Size, Stage};
use ndarray::{Array3, ArrayD, Axis, Ix3};
use ndarray_npy::{NpzReader, ReadNpzError};

use crate::naive::map::Map;
use crate::stimulus::Scene;

/// Stages of some frames, and the frames that give them.
pub struct Golden {
    /// 8-bit frames: (frames, rows, columns).
    pub frames: Array3<u8>,
    /// By frame, then in file order: (planes, rows, columns).
    pub stages: BTreeMap<usize, Vec<(Stage, Array3<f32>)>>,
}

impl Golden {
    /// The independent program's golden, where this checkout has it beside it.
    pub fn independent() -> Option<Self> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/golden/apg_48x80.npz");
        path.exists().then(|| Self::read(&path))
    }

    /// The golden that the repository keeps.
    pub fn own() -> Self {
        Self::read(&own_path())
    }

    /// Reads `frames` and every `NAME_FFFFFF`.
    pub fn read(path: &Path) -> Self {
        Self::try_read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    fn try_read(path: &Path) -> Result<Self, ReadNpzError> {
        let mut npz = NpzReader::new(File::open(path).map_err(|error| ReadNpzError::Zip(error.into()))?)?;
        let mut stages = BTreeMap::<usize, Vec<_>>::new();
        for name in npz.names()? {
            let name = name.trim_end_matches(".npy");
            let Some((stage, frame)) = name.rsplit_once('_') else { continue };
            let (Ok(stage), Ok(frame)) = (stage.parse::<Stage>(), frame.parse::<usize>()) else { continue };
            let array: ArrayD<f32> = npz.by_name(name)?;
            let array = if array.ndim() == 2 { array.insert_axis(Axis(0)) } else { array };
            let array = array.into_dimensionality::<Ix3>().expect("a stage is (H, W) or (planes, H, W)");
            stages.entry(frame).or_default().push((stage, array));
        }
        Ok(Self { frames: npz.by_name("frames")?, stages })
    }

    /// Frame `t` as luminance.
    pub fn luminance(&self, t: usize) -> Map {
        self.frames.index_axis(Axis(0), t).mapv(|v| f64::from(v) / 255.0)
    }
}

/// Where the repository keeps its golden.
pub fn own_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/practical_20x36.npz")
}

/// Frames in the repository's golden.
pub const OWN_FRAMES: usize = 34;
/// Of which these have their stages kept: before the first prediction can be attended to, and long after.
pub const OWN_STAGES: [usize; 2] = [7, 32];

/// Parameters of the repository's golden: `practical` at 1 px/frame, so that a short clip shows rejection by motion
/// and a region that fades in, which the independent golden does not.
pub fn own_params() -> Params {
    let mut params = Params::preset(Preset::Practical).for_speed(1.0).expect("a valid speed");
    // What the preset lets go moves the edge of the attended region by a pixel here and there.
    params.prediction.negligible = Params::default().prediction.negligible;
    // So small a picture has too little besides its targets.
    params.rejection.background = BackgroundMotion::Translation;
    params
}

/// The scene of the repository's golden.
pub fn own_scene() -> Scene {
    Scene::lively(Size::new(20, 36), 1.0, 2)
}
