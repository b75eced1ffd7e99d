//! Median of many values by counting.

use crate::memory::heap;

/// Median by counting: the bits of positive floats are in the order of the floats.
pub(crate) struct Median {
    counts: Vec<u32>,
    /// The values that share the median's first bits.
    near: Vec<f32>,
}

heap!(Median { counts, near });

impl Median {
    /// Sign, exponent and three bits of the fraction.
    const BITS: u32 = 12;

    /// Room for `most` values.
    pub fn new(most: usize) -> Self {
        Self { counts: vec![0; 1 << Self::BITS], near: Vec::with_capacity(most) }
    }

    /// The upper median of |values|, which are not empty.
    pub fn of_absolute(&mut self, values: &[f32]) -> f32 {
        self.of_least(values, values.len())
    }

    /// The upper median of the `count` smallest |values|, at least one.
    pub fn of_least(&mut self, values: &[f32], count: usize) -> f32 {
        let bin = |value: f32| (value.abs().to_bits() >> (32 - Self::BITS)) as usize;
        self.counts.fill(0);
        values.iter().for_each(|value| self.counts[bin(*value)] += 1);
        let (mut before, mut middle) = (0, 0);
        while before + self.counts[middle] as usize <= count / 2 {
            before += self.counts[middle] as usize;
            middle += 1;
        }
        self.near.clear();
        self.near.extend(values.iter().filter(|value| bin(**value) == middle).map(|value| value.abs()));
        *self.near.select_nth_unstable_by(count / 2 - before, f32::total_cmp).1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_one() {
        let mut seed = 3u32;
        for count in [1, 2, 7, 100, 1001] {
            let values: Vec<f32> = (0..count)
                .map(|_| {
                    seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    (seed as f32 / u32::MAX as f32 - 0.4).powi(3)
                })
                .collect();
            let mut sorted: Vec<f32> = values.iter().map(|value| value.abs()).collect();
            sorted.sort_unstable_by(f32::total_cmp);
            assert_eq!(Median::new(count).of_absolute(&values), sorted[count / 2]);
            assert_eq!(Median::new(count).of_least(&values, count.div_ceil(3)), sorted[count.div_ceil(3) / 2]);
        }
        assert_eq!(Median::new(3).of_absolute(&[0.0; 3]), 0.0);
    }
}
