//! The part of the Python module that is written in Rust; `python/spring_oracle/` offers it with documentation.
//!
//! ```text
//! check    callbacks to the engine of jacobian, and its reports back
//! force    a force in Python among the checks of the simulator's forces
//! scenes   scenes, their simulation
//! traces   traces and comparisons
//! ```

mod check;
mod force;
mod scenes;
mod traces;

use pyo3::prelude::*;

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("SceneError", py.get_type::<scenes::SceneError>())?;
    module.add("SimulationError", py.get_type::<scenes::SimulationError>())?;
    module.add("TraceError", py.get_type::<traces::TraceError>())?;
    module.add_class::<scenes::PyScene>()?;
    module.add_function(wrap_pyfunction!(check::check_jacobian, module)?)?;
    module.add_function(wrap_pyfunction!(force::check_force, module)?)?;
    module.add_function(wrap_pyfunction!(scenes::forces, module)?)?;
    module.add_function(wrap_pyfunction!(scenes::integrators, module)?)?;
    module.add_function(wrap_pyfunction!(scenes::stable_steps, module)?)?;
    module.add_function(wrap_pyfunction!(traces::read_trace, module)?)?;
    module.add_function(wrap_pyfunction!(traces::compare, module)?)
}
