//! Checks of functions in Python by the engine.
//!
//! A callback that raises ends the check: nothing is called any more, and the exception is raised by the check, with its
//! traceback. Signals are handled between calls, so Ctrl-C works.

use std::cell::RefCell;

use jacobian::check::{Matrices, Worst};
use jacobian::structure::Property;
use jacobian::{Derivative, Domain, Function, Settings, Triplet, check};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Callbacks into Python, and the first exception of one.
struct Callbacks<'py> {
    py: Python<'py>,
    failure: RefCell<Option<PyErr>>,
}

impl<'py> Callbacks<'py> {
    /// Runs `call` unless an exception was raised before.
    fn run(&self, call: impl FnOnce() -> PyResult<bool>) -> bool {
        if self.failure.borrow().is_some() {
            return false;
        }
        let result = self.py.check_signals().and_then(|()| call());
        result.unwrap_or_else(|error| {
            *self.failure.borrow_mut() = Some(error);
            false
        })
    }

    /// `function(x)` as a vector of the length of `values`.
    fn fill(
        &self,
        function: &Bound<'py, PyAny>,
        what: &str,
        x: &[f64],
        values: &mut [f64],
    ) -> PyResult<bool> {
        let result = function.call1((PyArray1::from_slice(self.py, x),))?;
        let array: PyReadonlyArray1<'_, f64> = result.extract()?;
        let found = array.as_slice()?;
        if found.len() != values.len() {
            return Err(PyValueError::new_err(format!(
                "{what} returned {} numbers; it must return {}",
                found.len(),
                values.len()
            )));
        }
        values.copy_from_slice(found);
        Ok(true)
    }
}

/// Checks a Jacobian. `value(x)` returns a vector; `jacobian` a matrix, flattened by row (`"dense"`), arrays of rows, columns
/// and values (`"sparse"`), or, of `(x, v)`, the product with `v` (`"product"`).
#[pyfunction]
pub(crate) fn check_jacobian<'py>(
    py: Python<'py>,
    value: Bound<'py, PyAny>,
    jacobian: Bound<'py, PyAny>,
    kind: &str,
    shape: (usize, usize),
    settings: Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyDict>> {
    let callbacks = Callbacks { py, failure: RefCell::new(None) };
    let (rows, columns) = shape;
    let fill = |x: &[f64], values: &mut [f64]| {
        callbacks.run(|| callbacks.fill(&value, "the function", x, values))
    };
    let dense = |x: &[f64], values: &mut [f64]| {
        callbacks.run(|| callbacks.fill(&jacobian, "the Jacobian", x, values))
    };
    let sparse = |x: &[f64], triplets: &mut Vec<Triplet>| {
        callbacks.run(|| {
            let result = jacobian.call1((PyArray1::from_slice(py, x),))?;
            type Arrays<'a> =
                (PyReadonlyArray1<'a, i64>, PyReadonlyArray1<'a, i64>, PyReadonlyArray1<'a, f64>);
            let (row, column, entry): Arrays<'_> = result.extract()?;
            let places = row.as_slice()?.iter().zip(column.as_slice()?);
            triplets.extend(places.zip(entry.as_slice()?).map(|((row, column), value)| Triplet {
                row: *row as usize,
                column: *column as usize,
                value: *value,
            }));
            Ok(true)
        })
    };
    let product = |x: &[f64], v: &[f64], values: &mut [f64]| {
        callbacks.run(|| {
            let along = PyArray1::from_slice(py, v);
            let of_x = jacobian.call1((PyArray1::from_slice(py, x), along))?;
            let array: PyReadonlyArray1<'_, f64> = of_x.extract()?;
            if array.len() != values.len() {
                let message =
                    format!("the product has {} numbers; it must have {rows}", array.len());
                return Err(PyValueError::new_err(message));
            }
            values.copy_from_slice(array.as_slice()?);
            Ok(true)
        })
    };
    let derivative = match kind {
        "dense" => Derivative::Dense(Box::new(dense)),
        "sparse" => Derivative::Sparse(Box::new(sparse)),
        _ => Derivative::Product(Box::new(product)),
    };
    let settings = settings_of(&settings, columns)?;
    let mut function = Function::new(rows, columns, Box::new(fill), derivative);
    let report = check(&mut function, &settings);
    drop(function);
    if let Some(error) = callbacks.failure.into_inner() {
        return Err(error);
    }
    let found = PyDict::new(py);
    found.set_item("verdict", report.verdict.name())?;
    found.set_item("reason", report.verdict.reason().map(|reason| reason.name()))?;
    found.set_item("likeness", report.likeness.as_ref().map(ToString::to_string))?;
    found.set_item("on_branch", report.is_on_branch())?;
    found.set_item("wrong", report.wrong.iter().copied().collect::<Vec<_>>())?;
    found.set_item("undecided", report.open.iter().copied().collect::<Vec<_>>())?;
    found.set_item("bound", report.bound)?;
    found.set_item("slope", report.window.map(|window| window.slope))?;
    found.set_item("window", report.window.map(|window| window.steps))?;
    found.set_item("calls", (report.calls.values, report.calls.jacobians))?;
    found.set_item("single_precision", (report.single[0], report.single[1]))?;
    let states = report.states.iter().map(|finding| {
        let state = PyDict::new(py);
        state.set_item("name", &finding.state.name)?;
        state.set_item("x", PyArray1::from_slice(py, &finding.state.x))?;
        state.set_item("verdict", finding.verdict.name())?;
        state.set_item("wrong", finding.wrong)?;
        state.set_item("kinks", finding.kinks)?;
        state.set_item("jumps", finding.jumps)?;
        state.set_item("noise", finding.noise)?;
        Ok(state)
    });
    found.set_item("states", states.collect::<PyResult<Vec<_>>>()?)?;
    let properties = report.properties.iter();
    let properties = properties.map(|p| (p.property.name(), p.verdict.name(), p.error));
    found.set_item("properties", properties.collect::<Vec<_>>())?;
    if let Some(Worst { finding, state, size, matrices }) = &report.worst {
        if let Some(Matrices { stated, measured }) = matrices {
            // Column by column is the transpose, row by row.
            let array = |values: &Vec<f64>| {
                PyArray1::from_slice(py, values).reshape([columns, rows])?.transpose()
            };
            found.set_item("matrices", (array(stated)?, array(measured)?))?;
        }
        let worst = PyDict::new(py);
        worst.set_item("row", finding.row)?;
        worst.set_item("column", finding.column)?;
        worst.set_item("yours", finding.entry.analytic)?;
        let sharpest = finding.entry.sharpest();
        worst.set_item("measured", sharpest.map(|estimate| estimate.value))?;
        worst.set_item("bound", sharpest.map(|e| e.uncertainty + finding.entry.rounding))?;
        worst.set_item("state", &state.name)?;
        worst.set_item("x", PyArray1::from_slice(py, &state.x))?;
        worst.set_item("largest", *size)?;
        found.set_item("worst", worst)?;
    }
    found.set_item("text", report.to_string())?;
    Ok(found)
}

fn settings_of(given: &Bound<'_, PyDict>, columns: usize) -> PyResult<Settings> {
    let mut settings = Settings::default();
    let get = |name: &str| given.get_item(name);
    if let Some(points) = get("points")? {
        let points: PyReadonlyArray2<'_, f64> = points.extract()?;
        settings.points = points.as_slice()?.chunks_exact(columns).map(<[f64]>::to_vec).collect();
    }
    if let Some(domain) = get("domain")? {
        let (lower, upper) = domain.extract()?;
        settings.domain = Some(Domain { lower, upper });
    }
    if let Some(draws) = get("draws")? {
        settings.draws = draws.extract()?;
    }
    if let Some(search) = get("search")? {
        settings.search = search.extract()?;
    }
    if let Some(seed) = get("seed")? {
        settings.seed = seed.extract()?;
    }
    if let Some(block) = get("block")? {
        settings.block = block.extract()?;
    }
    if let Some(factors) = get("factors")? {
        settings.factors = factors.extract()?;
    }
    if let Some(properties) = get("properties")? {
        for name in properties.extract::<Vec<String>>()? {
            let known = Property::ALL.into_iter().find(|property| property.name() == name);
            settings.properties.push(known.ok_or_else(|| {
                let names = Property::ALL.map(Property::name).join(", ");
                PyValueError::new_err(format!("there is no property {name:?}; there are {names}"))
            })?);
        }
    }
    Ok(settings)
}
