//! The compiled part of the Python package, `apgstmd._core`: thin, private, described in `python/apgstmd/_core.pyi`.
//! What users see (keywords, results, their documentation) is Python and lives in `python/apgstmd`.

mod arrays;
mod bank;
mod batch;
mod detector;
mod errors;
mod evaluation;
mod maps;
mod params;
mod program;
mod scene;
mod seen;
mod state;

use pyo3::prelude::*;
use pyo3::types::PyTuple;

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let stages = apgstmd_core::Stage::ALL.iter().map(|stage| stage.name());
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("STAGES", PyTuple::new(module.py(), stages)?)?;
    let models = apgstmd_core::Model::ALL.iter().map(|model| model.name());
    module.add("MODELS", PyTuple::new(module.py(), models)?)?;
    module.add_class::<bank::Bank>()?;
    module.add_class::<batch::Batch>()?;
    module.add_class::<detector::Detector>()?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<seen::Running>()?;
    module.add_function(wrap_pyfunction!(batch::batch, module)?)?;
    module.add_function(wrap_pyfunction!(batch::clip, module)?)?;
    module.add_function(wrap_pyfunction!(evaluation::evaluate, module)?)?;
    module.add_function(wrap_pyfunction!(params::fields, module)?)?;
    module.add_function(wrap_pyfunction!(params::kernels, module)?)?;
    module.add_function(wrap_pyfunction!(params::resolve, module)?)?;
    module.add_function(wrap_pyfunction!(program::run, module)?)?;
    module.add_function(wrap_pyfunction!(program::run_cli, module)?)?;
    program::say_who_we_are(module.py())
}
