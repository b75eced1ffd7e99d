//! Shared scenes for the benchmarks.
