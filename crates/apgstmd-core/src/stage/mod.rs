//! Anatomy.
