//! Median of many values by counting.

use crate::memory::heap;

/// Median by counting: the bits of positive floats are in the order of the floats.
pub(crate) struct Median {
    counts: Vec<u32>,
    /// The values that share the median's first bits.
    near: Vec<f32>,
    /// Weights in place of counts, and the values with theirs.
    sums: Vec<f32>,
    near_weighted: Vec<(f32, f32)>,
}

heap!(Median { counts, near, sums, near_weighted });

fn bin(value: f32) -> usize {
    (value.abs().to_bits() >> (32 - Median::BITS)) as usize
}

impl Median {
    /// Sign, exponent and three bits of the fraction.
    const BITS: u32 = 12;

    /// Room for `most` values.
    pub fn new(most: usize) -> Self {
        let bins = 1 << Self::BITS;
        Self {
            counts: vec![0; bins],
            near: Vec::with_capacity(most),
            sums: vec![0.0; bins],
            near_weighted: Vec::with_capacity(most),
        }
    }

    /// The upper median of |values|, which are not empty.
    pub fn of_absolute(&mut self, values: &[f32]) -> f32 {
        self.of_least(values, values.len())
    }

    /// The upper median of the `count` smallest |values|, at least one.
    pub fn of_least(&mut self, values: &[f32], count: usize) -> f32 {
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

    /// The least |value| of those below `end` that more than half of their weight does not exceed; 0 where they weigh nothing.
    pub fn weighted(&mut self, values: &[f32], weights: &[f32], end: f32) -> f32 {
        self.sums.fill(0.0);
        let inside = || values.iter().zip(weights).filter(|(value, _)| value.abs() < end);
        inside().for_each(|(value, weight)| self.sums[bin(*value)] += weight);
        let half = 0.5 * self.sums.iter().sum::<f32>();
        let (mut before, mut middle) = (0.0, 0);
        while middle < self.sums.len() && before + self.sums[middle] <= half {
            before += self.sums[middle];
            middle += 1;
        }
        self.near_weighted.clear();
        self.near_weighted
            .extend(inside().filter(|(value, _)| bin(**value) == middle).map(|(value, weight)| (value.abs(), *weight)));
        let mut near = &mut self.near_weighted[..];
        while near.len() > 1 {
            let split = near.len() / 2;
            near.select_nth_unstable_by(split, |a, b| a.0.total_cmp(&b.0));
            let (low, high) = near.split_at_mut(split);
            let below = before + low.iter().map(|(_, weight)| weight).sum::<f32>();
            if below > half {
                near = low;
            } else {
                (before, near) = (below, high);
            }
        }
        near.first().map_or(0.0, |(value, _)| *value)
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

    #[test]
    fn weights_count_as_often_as_they_are_large() {
        let mut seed = 9u32;
        let mut next = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            seed >> 8
        };
        for count in [1usize, 2, 7, 100, 1001] {
            let values: Vec<f32> = (0..count).map(|_| (next() as f32 / 16e6 - 0.4).powi(3)).collect();
            let weights: Vec<f32> = (0..count).map(|_| (next() % 5) as f32).collect();
            let mut many: Vec<f32> = values
                .iter()
                .zip(&weights)
                .filter(|(value, _)| value.abs() < 0.1)
                .flat_map(|(value, weight)| std::iter::repeat_n(value.abs(), *weight as usize))
                .collect();
            many.sort_unstable_by(f32::total_cmp);
            let expected = many.get(many.len() / 2).copied().unwrap_or(0.0);
            assert_eq!(Median::new(count).weighted(&values, &weights, 0.1), expected, "{count}");
        }
        assert_eq!(Median::new(3).weighted(&[1.0, 2.0, 3.0], &[0.0; 3], 9.0), 0.0);
    }
}
