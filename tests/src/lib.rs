//! The naive float64 model: the oracle for every fast path.
