//! Anatomy: one file a brain region or module, each with `new`, `process` and `reset`.

pub(crate) mod attention;
pub(crate) mod background;
pub(crate) mod contrast;
pub(crate) mod emd;
pub(crate) mod estmd;
pub(crate) mod facilitation;
pub(crate) mod lamina;
pub(crate) mod lamina_inhibition;
pub(crate) mod lobula;
pub(crate) mod median;
pub(crate) mod medulla;
pub(crate) mod memorizer;
pub(crate) mod normal;
pub(crate) mod prediction;
pub(crate) mod pyramid;
pub(crate) mod readout;
pub(crate) mod rejection;
pub(crate) mod retina;
pub(crate) mod similarity;
pub(crate) mod source;
pub(crate) mod speckle;
pub(crate) mod traces;
pub(crate) mod translation;
