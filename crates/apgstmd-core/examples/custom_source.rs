//! A source of your own: whatever lies in memory as rows of samples is read in place. Here a camera's buffer of 12-bit
//! samples in 16, its rows padded, of which a part is looked at by a bank for targets of 1 to 4 px/frame.
//!
//!     cargo run --release --package apgstmd-core --example custom_source

use std::error::Error;

use apgstmd_core::{Bank, BankParams, Frame, Params, Preset, Size};
use ndarray::{ArrayView2, s};

const HEIGHT: usize = 120;
const WIDTH: usize = 200;
/// Samples from one row to the next: cameras pad rows.
const STRIDE: usize = 256;
const WHITE: u16 = 4095;

/// What a driver would hand over.
struct Camera {
    buffer: Vec<u16>,
    frame: usize,
}

impl Camera {
    fn new() -> Self {
        Self { buffer: vec![0; HEIGHT * STRIDE], frame: 0 }
    }

    /// The next frame, until there is none: a bright field with a dark speck of 4 x 4 px that crosses it at 2 px/frame.
    fn grab(&mut self) -> Option<&[u16]> {
        if self.frame == 70 {
            return None;
        }
        let left = 20 + 2 * self.frame;
        for (y, row) in self.buffer.chunks_exact_mut(STRIDE).enumerate() {
            for (x, sample) in row[..WIDTH].iter_mut().enumerate() {
                let speck = (58..62).contains(&y) && (left..left + 4).contains(&x);
                // Something of a texture, so that not all is one luminance.
                *sample = if speck { WHITE / 2 } else { WHITE - 200 + ((x * 7 + y * 13) % 50) as u16 };
            }
        }
        self.frame += 1;
        Some(&self.buffer)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut camera = Camera::new();
    // The upper ten rows are of no use here.
    let size = Size::new(HEIGHT - 10, WIDTH);
    let base = Params::preset(Preset::Practical);
    let mut bank = Bank::new(size, &BankParams::with_members(base, &[1.0, 2.0, 4.0], &[5.0]))?;
    let mut response = bank.make_response();
    let mut last = None;
    while let Some(buffer) = camera.grab() {
        // No copy: a view of the buffer, any strides, any part of it.
        let picture = ArrayView2::from_shape((HEIGHT, STRIDE), buffer)?;
        let part = picture.slice(s![10.., ..WIDTH]);
        // 12 bits: white is 4095, not 65535.
        bank.process_into(Frame::from(part).with_bits(12), &mut response)?;
        last = response.detections.first().copied().or(last);
    }
    let best = last.ok_or("nothing was found")?;
    println!(
        "at ({:.1}, {:.1}), score {:.2}, best seen by the detector for {} px/frame",
        best.x,
        best.y + 10.0,
        best.score,
        best.speed
    );
    assert!((best.y + 10.0 - 59.5).abs() < 2.0 && best.score > 0.1 && best.speed >= 1.0);
    Ok(())
}

#[test]
fn runs() {
    main().unwrap();
}
