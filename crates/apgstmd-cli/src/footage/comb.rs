//! Interlaced frames: where something moves, rows of one parity are alike and neighbours differ. In a progressive picture
//! a row is never less like its neighbours than like the rows after them.

use serde::{Deserialize, Serialize};

use super::Warning;
use super::levels::Sample;

/// Change from frame to frame that is motion and not noise, of the full scale.
const MOVED: f32 = 0.03;
/// Share of the samples that must have moved: small things tell too little.
const SHARE: f64 = 0.02;
/// How much more neighbours differ than next-but-one rows in a frame that is combed. Progressive clips, panning too, have
/// 0.55 to 0.75, noise alone 1, fields that lie some px apart 1.3 to 1.8.
const RATIO: f64 = 1.1;
/// Share of the moving frames that are combed in interlaced footage.
const COMBED: f64 = 0.3;

#[derive(Default, Serialize, Deserialize)]
pub(super) struct Comb {
    before: Option<Sample>,
    moving: usize,
    combed: usize,
}

impl Comb {
    pub fn add(&mut self, now: Sample) {
        if let Some(before) = &self.before {
            let columns = now.columns;
            let (values, last) = (&now.values, &before.values);
            let (mut near, mut far, mut moved) = (0.0, 0.0, 0usize);
            let rows = values.len() / columns.max(1);
            for at in 2 * columns..columns * rows.saturating_sub(2) {
                let value = values[at];
                if (value - last[at]).abs() > MOVED {
                    let differs = |other: usize| f64::from((value - values[other]).abs());
                    near += differs(at - columns) + differs(at + columns);
                    far += differs(at - 2 * columns) + differs(at + 2 * columns);
                    moved += 1;
                }
            }
            if moved as f64 > SHARE * values.len() as f64 {
                self.moving += 1;
                self.combed += usize::from(near > RATIO * far);
            }
        }
        self.before = Some(now);
    }

    pub fn warning(&self) -> Option<Warning> {
        let interlaced = self.combed >= super::FEWEST && self.combed as f64 >= COMBED * self.moving as f64;
        interlaced.then(|| {
            let text = format!(
                "{} of {} frames with much motion are interlaced: each holds two moments, in its even and its odd rows",
                self.combed, self.moving
            );
            Warning::new("interlaced", text, "deinterlace first: ffmpeg -i IN -vf bwdif -c:v ffv1 OUT.mkv")
        })
    }
}
