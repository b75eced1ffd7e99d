//! One vector from and to a row, without a check of each.

use fearless_simd::{Simd, prelude::*};

/// One vector from `src[at..]`.
///
/// # Safety
/// `at + S::f32s::LEN <= src.len()`.
#[inline(always)]
#[allow(unsafe_code)]
pub(super) unsafe fn load<S: Simd>(simd: S, src: &[f32], at: usize) -> S::f32s {
    debug_assert!(at + S::f32s::LEN <= src.len());
    // SAFETY: the caller keeps the range inside the slice.
    S::f32s::from_slice(simd, unsafe { src.get_unchecked(at..at + S::f32s::LEN) })
}

/// One vector into `dst[at..]`.
///
/// # Safety
/// `at + S::f32s::LEN <= dst.len()`.
#[inline(always)]
#[allow(unsafe_code)]
pub(super) unsafe fn store<S: Simd>(value: S::f32s, dst: &mut [f32], at: usize) {
    debug_assert!(at + S::f32s::LEN <= dst.len());
    // SAFETY: the caller keeps the range inside the slice.
    value.store_slice(unsafe { dst.get_unchecked_mut(at..at + S::f32s::LEN) });
}
