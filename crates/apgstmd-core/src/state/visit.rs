//! One walk over everything that remembers, for saving, checking and loading: they cannot disagree.

use std::collections::{BTreeMap, BTreeSet};

use ndarray::Array2;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{Array, StateError, Values};
use crate::plane::{Buffer, Plane, Series};

/// What goes on from frame to frame.
pub(crate) trait Remember {
    /// Shows every part to the visit, always in the same order. While nothing is loaded, nothing changes.
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError>;
}

/// Types that remember through the fields named.
macro_rules! remember {
    (const $n:ident => $name:ty { $($field:ident),* }) => {
        impl<const $n: usize> $crate::state::Remember for $name {
            fn show(&mut self, visit: &mut $crate::state::Visit<'_>) -> Result<(), $crate::state::StateError> {
                $(visit.part(stringify!($field), &mut self.$field)?;)*
                Ok(())
            }
        }
    };
    ($name:ident { $($field:ident),* }) => {
        impl $crate::state::Remember for $name {
            fn show(&mut self, visit: &mut $crate::state::Visit<'_>) -> Result<(), $crate::state::StateError> {
                $(visit.part(stringify!($field), &mut self.$field)?;)*
                Ok(())
            }
        }
    };
}
pub(crate) use remember;

enum Pass<'a> {
    Save(&'a mut BTreeMap<String, Array>),
    Check(&'a BTreeMap<String, Array>, BTreeSet<String>),
    Load(&'a BTreeMap<String, Array>),
}

pub(crate) struct Visit<'a> {
    path: String,
    pass: Pass<'a>,
}

impl<'a> Visit<'a> {
    pub fn save(into: &'a mut BTreeMap<String, Array>) -> Self {
        Self { path: String::new(), pass: Pass::Save(into) }
    }

    pub fn check(from: &'a BTreeMap<String, Array>) -> Self {
        Self { path: String::new(), pass: Pass::Check(from, BTreeSet::new()) }
    }

    pub fn load(from: &'a BTreeMap<String, Array>) -> Self {
        Self { path: String::new(), pass: Pass::Load(from) }
    }

    /// After a check: whether there are arrays that nothing asked for.
    pub fn end(self) -> Result<(), StateError> {
        let Pass::Check(from, asked) = self.pass else { return Ok(()) };
        match from.keys().find(|name| !asked.contains(*name)) {
            Some(name) => Err(StateError::Array { name: name.clone(), problem: "is not known here".to_owned() }),
            None => Ok(()),
        }
    }

    pub fn loads(&self) -> bool {
        matches!(self.pass, Pass::Load(_))
    }

    pub fn part(&mut self, name: &str, part: &mut dyn Remember) -> Result<(), StateError> {
        self.inside(name, |visit| part.show(visit))
    }

    fn inside<T>(&mut self, name: &str, of: impl FnOnce(&mut Self) -> T) -> T {
        let length = self.path.len();
        if length > 0 {
            self.path.push('.');
        }
        self.path += name;
        let result = of(self);
        self.path.truncate(length);
        result
    }

    fn problem(&self, problem: impl Into<String>) -> StateError {
        StateError::Array { name: self.path.clone(), problem: problem.into() }
    }

    /// Values of a number that does not change.
    pub fn values<T: Element>(&mut self, shape: &[usize], values: &mut [T]) -> Result<(), StateError> {
        if let Some(from) = self.array::<T>(Some(shape), || values.to_vec())? {
            values.copy_from_slice(from);
        }
        Ok(())
    }

    /// Values of any number up to `most`; `valid` says of them all whether they can be.
    pub fn some_values<T: Element>(
        &mut self,
        name: &str,
        most: usize,
        save: impl FnOnce() -> Vec<T>,
        valid: impl FnOnce(&[T]) -> bool,
    ) -> Result<Option<&'a [T]>, StateError> {
        self.inside(name, |visit| {
            let from = visit.peek::<T>(None)?;
            if from.is_some_and(|from| from.len() > most || !valid(from)) {
                return Err(visit.problem("holds what cannot be"));
            }
            visit.array::<T>(None, save)
        })
    }

    /// A number below `end`.
    pub fn index(&mut self, name: &str, index: &mut usize, end: usize) -> Result<(), StateError> {
        self.inside(name, |visit| {
            if visit.peek::<u64>(Some(&[1]))?.is_some_and(|given| given[0] >= end as u64) {
                return Err(visit.problem(format!("must be below {end}")));
            }
            let mut value = *index as u64;
            visit.values(&[1], std::slice::from_mut(&mut value))?;
            *index = value as usize;
            Ok(())
        })
    }

    /// What has no shape, as bytes. What is loaded is handed back.
    pub fn record<T: Serialize + DeserializeOwned>(
        &mut self,
        name: &str,
        save: impl FnOnce() -> T,
        valid: impl FnOnce(&T) -> bool,
    ) -> Result<Option<T>, StateError> {
        self.inside(name, |visit| {
            let decode = |bytes: &[u8]| match postcard::take_from_bytes::<T>(bytes) {
                Ok((record, [])) => Some(record),
                _ => None,
            };
            if let Some(bytes) = visit.peek::<u8>(None)?
                && !decode(bytes).is_some_and(|record| valid(&record))
            {
                return Err(visit.problem("holds what cannot be"));
            }
            let loaded = visit.array(None, || postcard::to_stdvec(&save()).expect("plain data"))?;
            Ok(loaded.map(|bytes| decode(bytes).expect("it was checked")))
        })
    }

    /// What is to be checked, if this is a check.
    fn peek<T: Element>(&mut self, shape: Option<&[usize]>) -> Result<Option<&'a [T]>, StateError> {
        let Pass::Check(from, _) = &self.pass else { return Ok(None) };
        self.find(from, shape).map(Some)
    }

    fn find<T: Element>(
        &self,
        from: &'a BTreeMap<String, Array>,
        shape: Option<&[usize]>,
    ) -> Result<&'a [T], StateError> {
        let array = from.get(&self.path).ok_or_else(|| self.problem("is missing"))?;
        let values = T::of(&array.values)
            .ok_or_else(|| self.problem(format!("is of {}, but {} is expected", array.values.name(), T::NAME)))?;
        if let Some(shape) = shape.filter(|shape| *shape != array.shape) {
            return Err(self.problem(format!("has the shape {:?}, but {shape:?} is expected", array.shape)));
        }
        match values.iter().all(|value| value.sound()) {
            true => Ok(values),
            false => Err(self.problem("holds a value that is not finite, or too large to count from")),
        }
    }

    fn array<T: Element>(
        &mut self,
        shape: Option<&[usize]>,
        save: impl FnOnce() -> Vec<T>,
    ) -> Result<Option<&'a [T]>, StateError> {
        match &mut self.pass {
            Pass::Save(into) => {
                let values = save();
                let shape = shape.map_or_else(|| vec![values.len()], <[usize]>::to_vec);
                let before = into.insert(self.path.clone(), Array { shape, values: T::wrap(values) });
                assert!(before.is_none(), "two arrays are named {}", self.path);
                Ok(None)
            }
            Pass::Check(from, asked) => {
                asked.insert(self.path.clone());
                let from = *from;
                self.find::<T>(from, shape).map(|_| None)
            }
            Pass::Load(from) => {
                let from = *from;
                self.find(from, shape).map(Some)
            }
        }
    }
}

/// What arrays are of.
pub(crate) trait Element: Copy + 'static {
    const NAME: &'static str;
    fn wrap(values: Vec<Self>) -> Values;
    fn of(values: &Values) -> Option<&[Self]>;
    fn sound(self) -> bool {
        true
    }
}

macro_rules! element {
    ($type:ty, $name:literal, $variant:ident $(, $sound:expr)?) => {
        impl Element for $type {
            const NAME: &'static str = $name;
            fn wrap(values: Vec<Self>) -> Values {
                Values::$variant(values)
            }
            fn of(values: &Values) -> Option<&[Self]> {
                match values {
                    Values::$variant(values) => Some(values),
                    _ => None,
                }
            }
            $(fn sound(self) -> bool {
                $sound(self)
            })?
        }
    };
}

element!(f32, "f32", F32, f32::is_finite);
element!(f64, "f64", F64, f64::is_finite);
element!(u8, "u8", U8);
element!(u32, "u32", U32);
element!(u64, "u64", U64, is_count);

/// What counts frames, traces, tracks goes on to count from what a file says.
pub(crate) fn is_count(count: u64) -> bool {
    count < 1 << 62
}

macro_rules! scalar {
    ($($type:ty),*) => {
        $(impl Remember for $type {
            fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
                visit.values(&[1], std::slice::from_mut(self))
            }
        })*
    };
}

scalar!(f32, f64, u64);

impl Remember for (f64, f64) {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        let mut both = [self.0, self.1];
        visit.values(&[2], &mut both)?;
        *self = both.into();
        Ok(())
    }
}

impl Remember for bool {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        std::slice::from_mut(self).show(visit)
    }
}

impl Remember for [bool] {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        let mut values: Vec<u8> = self.iter().map(|value| u8::from(*value)).collect();
        visit.values(&[self.len()], &mut values)?;
        self.iter_mut().zip(values).for_each(|(to, value)| *to = value != 0);
        Ok(())
    }
}

impl Remember for [f32] {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        visit.values(&[self.len()], self)
    }
}

impl Remember for Vec<bool> {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        self[..].show(visit)
    }
}

impl Remember for Vec<f32> {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        self[..].show(visit)
    }
}

impl Remember for Buffer {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        self[..].show(visit)
    }
}

impl<const N: usize> Remember for [Vec<f32>; N] {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        self.iter_mut().enumerate().try_for_each(|(index, part)| visit.part(&index.to_string(), part))
    }
}

impl Remember for Array2<f32> {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        let shape = [self.nrows(), self.ncols()];
        let mut values: Vec<f32> = self.iter().copied().collect();
        visit.values(&shape, &mut values)?;
        self.iter_mut().zip(values).for_each(|(to, from)| *to = from);
        Ok(())
    }
}

/// A map of angles, NaN where there is none.
pub(crate) struct Angles<'a>(pub &'a mut Array2<f32>);

/// In a state, for NaN: no angle, and finite, as all that a state holds.
const NO_ANGLE: f32 = 8.0;

impl Remember for Angles<'_> {
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        let mut finite = self.0.mapv(|angle| if angle.is_nan() { NO_ANGLE } else { angle });
        finite.show(visit)?;
        self.0.zip_mut_with(&finite, |to, from| *to = if *from == NO_ANGLE { f32::NAN } else { *from });
        Ok(())
    }
}

impl Remember for Plane {
    /// With the padding behind each row, which the filters take along.
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        let shape = [self.size().height, self.stride()];
        visit.values(&shape, self.data_mut())
    }
}

impl Remember for Series {
    /// The last frame, which comes before the next ones.
    fn show(&mut self, visit: &mut Visit<'_>) -> Result<(), StateError> {
        if visit.loads() {
            self.begin(1);
        }
        let last = self.maps().len() - 1;
        visit.part("last", &mut self.maps_mut()[last])
    }
}
