//! How much memory a detector holds, counted by what it owns.

use std::ops::Add;

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

/// Bytes that are written to in full.
pub(crate) fn owned(bytes: usize) -> Memory {
    Memory { bound: bytes, resident: bytes }
}

impl<T: Heap> Heap for Vec<T> {
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
