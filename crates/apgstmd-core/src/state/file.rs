//! A state as a safetensors file.

use std::collections::{BTreeMap, HashMap};

use safetensors::tensor::{Dtype, SafeTensors, TensorView, serialize};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{Array, Origin, State, StateError, Values};

/// The one entry of the metadata, so that equal states are equal files.
const ENTRY: &str = "apgstmd";

#[derive(Serialize, Deserialize)]
struct Head {
    /// SHA-256 of the rest and of the arrays, hexadecimal.
    sha256: String,
    #[serde(flatten)]
    origin: Origin,
}

impl State {
    /// As a safetensors file. Equal states are equal files.
    pub fn to_bytes(&self) -> Vec<u8> {
        let bytes: BTreeMap<&String, Vec<u8>> =
            self.arrays.iter().map(|(name, array)| (name, array.values.to_bytes())).collect();
        let views = self.arrays.iter().map(|(name, array)| {
            let view = TensorView::new(array.values.dtype(), array.shape.clone(), &bytes[name]);
            (name, view.expect("as many values as the shape says"))
        });
        let head = Head { sha256: self.checksum(), origin: self.origin.clone() };
        let head = toml::to_string(&head).expect("plain values");
        let metadata = HashMap::from([(ENTRY.to_owned(), head)]);
        serialize(views, Some(metadata)).expect("names and sizes that fit into memory")
    }

    /// Reads what [`State::to_bytes`] wrote.
    ///
    /// # Errors
    /// Not such a file, or a damaged one.
    pub fn from_bytes(file: &[u8]) -> Result<Self, StateError> {
        let bad = |reason: String| StateError::File { reason };
        let tensors = SafeTensors::deserialize(file).map_err(|error| bad(error.to_string()))?;
        let (_, metadata) = SafeTensors::read_metadata(file).map_err(|error| bad(error.to_string()))?;
        let entry = metadata.metadata().as_ref().and_then(|entries| entries.get(ENTRY));
        let head = entry.ok_or_else(|| bad(format!("its metadata has no entry `{ENTRY}`")))?;
        let head: Head = toml::from_str(head).map_err(|error| bad(error.message().to_owned()))?;
        let arrays = tensors.iter().map(|(name, view)| {
            let values = Values::from_bytes(view.dtype(), view.data())
                .ok_or_else(|| bad(format!("array `{name}` is of the type {:?}", view.dtype())))?;
            Ok((name.to_owned(), Array { shape: view.shape().to_vec(), values }))
        });
        let state = Self::new(head.origin, arrays.collect::<Result<_, _>>()?)?;
        let found = state.checksum();
        if found != head.sha256 {
            return Err(StateError::Checksum { given: head.sha256, found });
        }
        Ok(state)
    }

    fn checksum(&self) -> String {
        let mut sum = Sha256::new();
        sum.update(toml::to_string(&self.origin).expect("plain values"));
        for (name, Array { shape, values }) in &self.arrays {
            sum.update(format!("\0{name}\0{}\0{shape:?}\0", values.name()));
            sum.update(values.to_bytes());
        }
        sum.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

impl Values {
    fn dtype(&self) -> Dtype {
        match self {
            Self::F32(_) => Dtype::F32,
            Self::F64(_) => Dtype::F64,
            Self::U8(_) => Dtype::U8,
            Self::U32(_) => Dtype::U32,
            Self::U64(_) => Dtype::U64,
        }
    }

    /// Little endian.
    fn to_bytes(&self) -> Vec<u8> {
        match self {
            Self::F32(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
            Self::F64(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
            Self::U8(values) => values.clone(),
            Self::U32(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
            Self::U64(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        }
    }

    fn from_bytes(dtype: Dtype, bytes: &[u8]) -> Option<Self> {
        fn each<const N: usize, T>(bytes: &[u8], of: fn([u8; N]) -> T) -> Vec<T> {
            bytes.as_chunks().0.iter().map(|chunk| of(*chunk)).collect()
        }
        Some(match dtype {
            Dtype::F32 => Self::F32(each(bytes, f32::from_le_bytes)),
            Dtype::F64 => Self::F64(each(bytes, f64::from_le_bytes)),
            Dtype::U8 => Self::U8(bytes.to_vec()),
            Dtype::U32 => Self::U32(each(bytes, u32::from_le_bytes)),
            Dtype::U64 => Self::U64(each(bytes, u64::from_le_bytes)),
            _ => return None,
        })
    }
}
