//! How much memory a detector holds, counted by what it owns.

use std::collections::VecDeque;
use std::hint::black_box;
use std::ops::Add;

use crate::error::ParamError;
use crate::frame::Size;

#[cfg(all(target_os = "linux", not(miri)))]
mod available;
#[cfg(all(target_os = "linux", not(miri)))]
use available::available;

/// Elsewhere nobody tells.
#[cfg(any(not(target_os = "linux"), miri))]
fn available() -> Option<u64> {
    None
}

/// Bytes on the heap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Memory {
    /// Reserved at construction: what it can come to at most. Linear in the pixels of a frame.
    pub bound: usize,
    /// Of these, what has been written to so far and so takes memory: the memorizer counts by the tiles that were ever
    /// predicted in, everything else in full.
    pub resident: usize,
}

impl Add for Memory {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { bound: self.bound + other.bound, resident: self.resident + other.resident }
    }
}

/// What owns memory, and says how much.
pub(crate) trait Heap {
    fn heap(&self) -> Memory;
}

/// Asks the system for all of it at once and gives it back: what it refuses now would end the program in the middle of
/// its allocations. A system promises more than it has, so that what is sure to be written to must be there.
pub(crate) fn ask_for(size: Size, needs: Memory) -> Result<(), ParamError> {
    if let Some(available) = available().filter(|available| *available < needs.resident as u64) {
        return Err(ParamError::Memory { size, bytes: needs.resident, available: Some(available) });
    }
    let mut all = Vec::<u8>::new();
    let refused = |_| ParamError::Memory { size, bytes: needs.bound, available: None };
    all.try_reserve_exact(needs.bound).map_err(refused)?;
    // What nobody looks at is not asked for.
    black_box(all.as_mut_ptr());
    Ok(())
}

/// Bytes that are written to in full.
pub(crate) fn owned(bytes: usize) -> Memory {
    Memory { bound: bytes, resident: bytes }
}

impl<T: Heap> Heap for Vec<T> {
    fn heap(&self) -> Memory {
        self.iter().map(Heap::heap).fold(owned(self.capacity() * size_of::<T>()), Add::add)
    }
}

impl<T: Heap> Heap for VecDeque<T> {
    fn heap(&self) -> Memory {
        self.iter().map(Heap::heap).fold(owned(self.capacity() * size_of::<T>()), Add::add)
    }
}

impl<T: Heap, const N: usize> Heap for [T; N] {
    fn heap(&self) -> Memory {
        self.iter().map(Heap::heap).fold(Memory::default(), Add::add)
    }
}

impl<T: Heap> Heap for Option<T> {
    fn heap(&self) -> Memory {
        self.as_ref().map_or(Memory::default(), Heap::heap)
    }
}

impl<A: Heap, B: Heap> Heap for (A, B) {
    fn heap(&self) -> Memory {
        self.0.heap() + self.1.heap()
    }
}

impl<A: Heap, B: Heap, C: Heap> Heap for (A, B, C) {
    fn heap(&self) -> Memory {
        self.0.heap() + self.1.heap() + self.2.heap()
    }
}

/// Types that own memory through the fields named, and types that own none.
macro_rules! heap {
    (const $n:ident => $name:ty { $($field:ident),* }) => {
        impl<const $n: usize> $crate::memory::Heap for $name {
            fn heap(&self) -> $crate::memory::Memory {
                $crate::memory::Memory::default() $(+ $crate::memory::Heap::heap(&self.$field))*
            }
        }
    };
    ($name:ident { $($field:ident),* }) => {
        impl $crate::memory::Heap for $name {
            fn heap(&self) -> $crate::memory::Memory {
                $crate::memory::Memory::default() $(+ $crate::memory::Heap::heap(&self.$field))*
            }
        }
    };
    ($($name:ty),*) => {
        $(impl $crate::memory::Heap for $name {
            #[inline(always)]
            fn heap(&self) -> $crate::memory::Memory {
                $crate::memory::Memory::default()
            }
        })*
    };
}
pub(crate) use heap;

heap!(f32, f64, u8, u16, u32, u64, usize, isize, bool, std::ops::Range<usize>);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detector::Detector;
    use crate::params::{Model, Params, Preset};
    use crate::row::machine::Machine;

    /// What is asked for beforehand is what is held then, or a little more: what follows the background takes no more samples
    /// from larger frames.
    #[test]
    #[cfg_attr(miri, ignore = "minutes to hours")]
    fn what_is_asked_for_is_what_is_held() {
        let presets = [Preset::Paper, Preset::Practical].map(Params::preset);
        for params in presets.into_iter().chain(Model::ALL[1..].iter().map(|model| Params::for_model(*model))) {
            let params = params.for_speed(1.0).unwrap();
            for (size, threads, together) in
                [((270, 480), 1, 4), ((1000, 333), 3, 1), ((70, 2000), 1, 1), ((1080, 1920), 2, 4)]
            {
                let size = Size::new(size.0, size.1);
                let machine = Machine { together, ..Machine::with_threads(threads) };
                let needs = Detector::needs(size, &params, &machine);
                let held = Detector::with_options(size, &params, &machine).unwrap().memory();
                for (needs, held) in [(needs.bound, held.bound), (needs.resident, held.resident)] {
                    // Tiles are counted whole.
                    let (times, most) = (needs as f64 / held as f64, if size.height < 256 { 1.15 } else { 1.05 });
                    assert!(times > 0.99 && times < most, "{}, {size}: {needs} {held}", params.model);
                }
            }
        }
    }

    #[test]
    #[cfg_attr(miri, ignore = "Miri ends where memory is refused")]
    fn what_there_is_not_is_refused() {
        let size = Size::new(20, 30);
        assert_eq!(ask_for(size, owned(1 << 20)), Ok(()));
        for bytes in [1 << 62, usize::MAX] {
            // What may never be written to must be promised only.
            let promised = ask_for(size, Memory { bound: bytes, resident: 1 << 20 });
            assert_eq!(promised, Err(ParamError::Memory { size, bytes, available: None }));
            let Err(ParamError::Memory { bytes: asked, available, .. }) = ask_for(size, owned(bytes)) else {
                panic!("{bytes} bytes were given");
            };
            assert!(asked == bytes && available.is_none_or(|available| available < bytes as u64), "{available:?}");
        }
    }
}
