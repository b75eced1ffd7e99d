//! First-order low-pass: taps proportional to exp(-i / tau), i = 0, 1, 2, ..., of unit sum.
//!
//! Input and output: one map a frame. State: one map, zero before the first frame.

use crate::frame::Size;
use crate::memory::heap;
use crate::plane::{Buffer, Plane, padded};
use crate::row::bands::{Bands, Rows};
use crate::row::recurse::{CascadeTaps, Prepare, cascade};
use crate::scroll::{Scroll, Scrolls, scroll_maps};
use crate::state::remember;

pub(crate) struct LowPass {
    size: Size,
    taps: CascadeTaps<1>,
    state: Buffer,
}

heap!(LowPass { taps, state });
remember!(LowPass { state });

impl Scrolls for LowPass {
    fn scroll(&mut self, scroll: &Scroll<'_>) {
        scroll_maps(&mut self.state, self.size, 1, scroll.by);
    }
}

impl LowPass {
    pub fn new(size: Size, tau: f64) -> Self {
        let pole = (-1.0 / tau).exp() as f32;
        // From the pole as rounded, so that the sum of the taps is one however near the pole comes to it.
        let direct = 1.0 - pole;
        let taps = CascadeTaps { pole, direct: [direct], feeds: vec![1.0], weights: vec![[direct * pole]] };
        Self { size, taps, state: Buffer::zeros(size.height * padded(size.width)) }
    }

    /// Takes the next frame; with `add` the output is added to what `out` holds.
    pub fn process(&mut self, bands: &Bands, input: &Plane, out: &mut Plane, add: bool) {
        let stride = input.stride();
        let Self { size, taps, state } = self;
        let rows = [Rows { data: state, stride }, Rows { data: out.data_mut(), stride }];
        bands.over(size.height, rows, |range, [mut state, mut out]| {
            for (row, y) in range.enumerate() {
                let input = input.padded_row(y);
                cascade(bands.level(), taps, Prepare::Keep, input, state.row(row), [out.row(row)], add);
            }
        });
    }

    /// As before the first frame.
    pub fn reset(&mut self) {
        self.state.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn impulse_response_and_sum() {
        let size = Size::new(1, 3);
        for tau in [0.02, 0.5, 3.0, 12.0, 300.0] {
            let mut filter = LowPass::new(size, tau);
            let (mut input, mut out) = (Plane::new(size), Plane::new(size));
            let decay = (-1.0f64 / tau).exp();
            let mut sum = 0.0;
            for i in 0..(20.0 * tau) as i32 + 5 {
                input.fill(if i == 0 { 1.0 } else { 0.0 });
                out.fill(0.25);
                filter.process(&Bands::single(), &input, &mut out, true);
                let tap = f64::from(out.row(0)[1]) - 0.25;
                // What is added to is rounded to 1.5e-8; the pole to 6e-8, which grows with its power.
                let expected = (1.0 - decay) * decay.powi(i);
                assert!((tap - expected).abs() < 3e-8 + 2e-4 * expected, "tau {tau}, tap {i}: {tap} {expected}");
                out.fill(9.0);
                sum += tap;
            }
            assert!((sum - 1.0).abs() < 1e-4, "tau {tau}: {sum}");
        }
    }
}
