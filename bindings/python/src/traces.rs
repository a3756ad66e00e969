//! Traces as arrays, and their comparison.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use grader::compare::{self as comparison, Comparison, Expectation, FirstWrong, Tolerances};
use grader::submission::StateSource;
use grader::verdict::{Failure, Quantity};
use numpy::{PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use scene::Dimension;
use scene::trace::{self, Shape, State, TraceError as ReadError, TraceFormat, TraceReader};

use crate::scenes::PyScene;

pyo3::create_exception!(spring_oracle, TraceError, PyValueError, "A trace that cannot be read.");

fn unreadable(error: impl ToString) -> PyErr {
    TraceError::new_err(error.to_string())
}

/// The shape that the header of a CSV trace names.
fn shape_of(path: &Path) -> PyResult<Shape> {
    let named = |problem: &str| unreadable(format!("{}: {problem}", path.display()));
    let file =
        scene::input::open(path).map_err(|error| named(&format!("cannot be read: {error}")))?;
    let mut header = String::new();
    BufReader::new(file).read_line(&mut header).map_err(|error| named(&error.to_string()))?;
    let columns: Vec<&str> = header.trim().split(',').collect();
    let dimension = if columns.contains(&"z0") { Dimension::Three } else { Dimension::Two };
    let n_particles = columns.iter().filter(|column| column.starts_with('x')).count();
    Ok(Shape { dimension, n_particles })
}

/// Reads a trace: its times, if the format has them, positions, velocities, and whether these are the file's own.
#[pyfunction]
#[expect(clippy::type_complexity, reason = "a tuple of arrays for Python")]
pub(crate) fn read_trace<'py>(
    py: Python<'py>,
    path: PathBuf,
    scene: Option<&PyScene>,
    format: Option<&str>,
) -> PyResult<(
    Option<Bound<'py, PyArray1<f64>>>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
    bool,
)> {
    let format = match format {
        None => TraceFormat::of_path(&path).unwrap_or(TraceFormat::Csv),
        Some(name) => {
            let found = TraceFormat::ALL.into_iter().find(|format| format.name() == name);
            let names = TraceFormat::ALL.map(TraceFormat::name).join(", ");
            found.ok_or_else(|| {
                unreadable(format!("there is no format {name:?}; there are {names}"))
            })?
        }
    };
    if scene.is_none() && format == TraceFormat::Fosssim {
        let message = "a binary trace does not name its columns: give its scene";
        return Err(unreadable(format!("{}: {message}", path.display())));
    }
    let scene = scene.map(|scene| &scene.scene);
    let shape = scene.map_or_else(|| shape_of(&path), |scene| Ok(Shape::of(scene)))?;
    let (times, positions, velocities, own) = py
        .detach(|| {
            let mut reader = match scene {
                Some(scene) => trace::open_of_scene(&path, format, scene),
                None => trace::open(&path, format, shape),
            }?;
            let mut state = State::zeros(shape);
            let (mut times, mut positions, mut velocities) = (Vec::new(), Vec::new(), Vec::new());
            while TraceReader::read(reader.as_mut(), &mut state)? {
                times.extend(state.time);
                positions.extend_from_slice(&state.positions);
                velocities.extend_from_slice(&state.velocities);
            }
            Ok::<_, ReadError>((
                times,
                positions,
                velocities,
                TraceReader::has_velocities(reader.as_ref()),
            ))
        })
        .map_err(unreadable)?;
    let states = positions.len() / shape.n_coordinates().max(1);
    let shape = [states, shape.n_particles, shape.dimension.count()];
    Ok((
        (times.len() == states).then(|| PyArray1::from_vec(py, times)),
        PyArray1::from_vec(py, positions).reshape(shape)?,
        PyArray1::from_vec(py, velocities).reshape(shape)?,
        own,
    ))
}

/// The states of two arrays.
struct Arrays<'a> {
    positions: &'a [f64],
    velocities: Option<&'a [f64]>,
    /// Numbers in a state.
    size: usize,
    next: usize,
}

impl Arrays<'_> {
    fn next(&mut self, state: &mut State) -> bool {
        let range = self.next * self.size..(self.next + 1) * self.size;
        self.next += 1;
        let Some(positions) = self.positions.get(range.clone()) else { return false };
        state.positions.copy_from_slice(positions);
        match self.velocities {
            Some(velocities) => state.velocities.copy_from_slice(&velocities[range]),
            None => state.velocities.fill(0.0),
        }
        true
    }
}

impl TraceReader for Arrays<'_> {
    fn read(&mut self, state: &mut State) -> Result<bool, ReadError> {
        Ok(self.next(state))
    }
}

impl StateSource for Arrays<'_> {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        Ok(self.next(state))
    }

    fn has_velocities(&self) -> bool {
        self.velocities.is_some()
    }
}

/// Compares a trace with the oracle's: positions and velocities of both; of the trace, velocities may be missing.
#[pyfunction]
pub(crate) fn compare<'py>(
    py: Python<'py>,
    got: (PyReadonlyArray3<'py, f64>, Option<PyReadonlyArray3<'py, f64>>),
    oracle: (PyReadonlyArray3<'py, f64>, PyReadonlyArray3<'py, f64>),
    time_step: f64,
    tolerances: (f64, f64),
) -> PyResult<Bound<'py, PyDict>> {
    let [n_states, n_particles, axes] = *oracle.0.shape() else {
        return Err(PyValueError::new_err("the oracle's positions must be [step, particle, axis]"));
    };
    if got.0.shape()[1..] != [n_particles, axes] || !(2..=3).contains(&axes) {
        let shape = &got.0.shape()[1..];
        let message =
            format!("a state of the trace is {shape:?}, one of the oracle [{n_particles}, {axes}]");
        return Err(PyValueError::new_err(message));
    }
    if oracle.1.shape() != oracle.0.shape()
        || got.1.as_ref().is_some_and(|velocities| velocities.shape() != got.0.shape())
    {
        return Err(PyValueError::new_err("positions and velocities must have the same shape"));
    }
    let size = n_particles * axes;
    let velocities = got.1.as_ref().map(|velocities| velocities.as_slice()).transpose()?;
    let mut actual = Arrays { positions: got.0.as_slice()?, velocities, size, next: 0 };
    let (positions, velocities) = (oracle.0.as_slice()?, Some(oracle.1.as_slice()?));
    let mut expected = Arrays { positions, velocities, size, next: 0 };
    let dimension = if axes == 2 { Dimension::Two } else { Dimension::Three };
    let shape = Shape { dimension, n_particles };
    let expectation = Expectation { shape, time_step, n_states: n_states as u64 };
    let (largest, accumulated) = tolerances;
    let tolerances = Tolerances { largest, accumulated };
    let found =
        py.detach(|| comparison::compare(&mut expected, &mut actual, expectation, tolerances));
    let Comparison { verdict, states, position, velocity, first_wrong, .. } = found;
    let result = PyDict::new(py);
    result.set_item("verdict", verdict.name())?;
    result.set_item("message", verdict.to_string())?;
    result.set_item("states", states)?;
    for (name, residuals) in [("position", position), ("velocity", velocity)] {
        result.set_item(name, (residuals.largest, residuals.accumulated))?;
    }
    if let Some(first) = first_wrong {
        let FirstWrong { place, time, expected, got, residual, tolerance, .. } = first;
        let wrong = PyDict::new(py);
        wrong.set_item("step", place.step)?;
        wrong.set_item("time", time)?;
        wrong.set_item("particle", place.particle)?;
        let is_position = place.quantity == Quantity::Position;
        wrong.set_item("quantity", if is_position { "position" } else { "velocity" })?;
        wrong.set_item("axis", ["x", "y", "z"][place.axis])?;
        wrong.set_item("expected", expected)?;
        wrong.set_item("got", got)?;
        wrong.set_item("residual", residual)?;
        wrong.set_item("tolerance", tolerance)?;
        result.set_item("first_wrong", wrong)?;
    }
    Ok(result)
}
