//! The check of a force written in Python, on the hard states and by the laws of the simulator's own forces.
//!
//! A force is a [`Subject`] whose functions are callbacks. A callback takes flat vectors of the particles of one element, and what
//! the element is given: parameters by name, masses, time, initial positions. Elements are added up here.

use std::sync::{Arc, Mutex};

use grader::white_box::{
    BlockFinding, By, CheckState, Config, Given, JacobianCheck, Property, PropertyFinding, Subject,
    Verdict, check_given, states_given,
};
use jacobian::check::common;
use jacobian::likeness::Likeness;
use jacobian::{Derivative, Function, Settings};
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyModule};
use reference::law::{self, Expectation, Jacobians};
use scene::{Dimension, ForceElement, Particles, Scene};
use simulator::force::{Coupling, Degenerate, ForceKind, REGISTRY};
use smallvec::smallvec;

use crate::scenes::force_schema;

/// Number of random states, besides that of the worst entry, at which a mistake is described.
const LIKENESSES: usize = 4;

/// The callbacks of a force. Those that are missing were not asked for.
#[derive(Clone)]
struct Callbacks {
    force: Arc<Py<PyAny>>,
    jacobians: [Option<Arc<Py<PyAny>>>; 2],
    energy: Option<Arc<Py<PyAny>>>,
    /// The first exception; nothing is called after it.
    failure: Arc<Mutex<Option<PyErr>>>,
}

impl Callbacks {
    /// `None` after an exception.
    fn run<T>(&self, call: impl FnOnce(Python<'_>) -> PyResult<T>) -> Option<T> {
        let mut failure = self.failure.lock().ok()?;
        if failure.is_some() {
            return None;
        }
        Python::attach(|py| match py.check_signals().and_then(|()| call(py)) {
            Ok(value) => Some(value),
            Err(error) => {
                *failure = Some(error);
                None
            }
        })
    }
}

/// An element with what its callbacks are given.
struct Element {
    particles: Particles,
    given: Py<PyAny>,
    is_symmetric: bool,
}

/// A force in Python, of a scene.
struct InPython {
    callbacks: Callbacks,
    elements: Vec<Element>,
    axes: usize,
}

impl InPython {
    fn new(callbacks: &Callbacks, scene: &Scene) -> Self {
        let elements = scene.forces.iter().flat_map(|force| {
            force.stencils(scene.particles.len()).map(move |particles| (force, particles))
        });
        let element = |(force, particles): (&ForceElement, Particles)| {
            let given = callbacks.run(|py| given(py, scene, force, &particles))?;
            Some(Element { particles, given, is_symmetric: force.is_variational() })
        };
        Self {
            callbacks: callbacks.clone(),
            elements: elements.filter_map(element).collect(),
            axes: scene.dimension.count(),
        }
    }

    /// The coordinates of the particles of an element.
    fn of(&self, element: &Element, values: &[f64]) -> Vec<f64> {
        let particle = |number: &usize| &values[number * self.axes..(number + 1) * self.axes];
        element.particles.iter().flat_map(particle).copied().collect()
    }

    /// Calls `callback` for each element, and passes its place in the whole and the result to `add`.
    fn each<T>(
        &self,
        callback: &Py<PyAny>,
        [x, v]: [&[f64]; 2],
        time: f64,
        mut add: impl FnMut(&Element, Bound<'_, PyAny>) -> PyResult<T>,
    ) -> Option<()> {
        self.callbacks.run(|py| {
            for element in &self.elements {
                element.given.setattr(py, "time", time)?;
                let [x, v] = [x, v].map(|of| PyArray1::from_vec(py, self.of(element, of)));
                let result = callback.bind(py).call1((x, v, element.given.bind(py)))?;
                add(element, result)?;
            }
            Ok(())
        })
    }

    /// The coordinate in the whole that coordinate `place` of an element is.
    fn place(&self, element: &Element, place: usize) -> usize {
        element.particles[place / self.axes] * self.axes + place % self.axes
    }
}

fn degenerate() -> Degenerate {
    Degenerate { element: 0, particles: smallvec![] }
}

fn wrong_size(what: &str, found: &[usize], expected: &[usize]) -> PyErr {
    PyValueError::new_err(format!("{what} is {found:?}; it must be {expected:?}"))
}

impl Subject for InPython {
    fn force(&self, x: &[f64], v: &[f64], time: f64, force: &mut [f64]) -> Result<(), Degenerate> {
        force.fill(0.0);
        let add = |element: &Element, result: Bound<'_, PyAny>| {
            let values: PyReadonlyArray1<'_, f64> = result.extract()?;
            let size = element.particles.len() * self.axes;
            if values.len() != size {
                return Err(wrong_size("the force", values.shape(), &[size]));
            }
            for (place, value) in values.as_slice()?.iter().enumerate() {
                force[self.place(element, place)] += value;
            }
            Ok(())
        };
        self.each(&self.callbacks.force, [x, v], time, add).ok_or_else(degenerate)
    }

    fn jacobians(&self, x: &[f64], v: &[f64], time: f64) -> Result<Jacobians, Degenerate> {
        let mut sum = Jacobians::zeros(x.len());
        let Jacobians { by_position, by_velocity } = &mut sum;
        for (matrix, callback) in
            [by_position, by_velocity].into_iter().zip(&self.callbacks.jacobians)
        {
            let Some(callback) = callback else { continue };
            let add = |element: &Element, result: Bound<'_, PyAny>| {
                let entries: PyReadonlyArray2<'_, f64> = result.extract()?;
                let size = element.particles.len() * self.axes;
                if entries.shape() != [size; 2] {
                    return Err(wrong_size("the Jacobian", entries.shape(), &[size; 2]));
                }
                for (place, value) in entries.as_slice()?.iter().enumerate() {
                    let [row, column] =
                        [place / size, place % size].map(|place| self.place(element, place));
                    matrix[(row, column)] += value;
                }
                Ok(())
            };
            self.each(callback, [x, v], time, add).ok_or_else(degenerate)?;
        }
        Ok(sum)
    }

    fn energy(&self, x: &[f64], v: &[f64], time: f64) -> Option<f64> {
        let mut sum = 0.0;
        self.each(self.callbacks.energy.as_ref()?, [x, v], time, |_, result| {
            sum += result.extract::<f64>()?;
            Ok(())
        })?;
        Some(sum)
    }

    fn couplings(&self) -> Vec<Coupling> {
        let coupling = |element: &Element| Coupling::Stencil {
            particles: element.particles.clone(),
            symmetric: element.is_symmetric && self.callbacks.jacobians.iter().all(Option::is_some),
        };
        self.elements.iter().map(coupling).collect()
    }
}

/// The argument of a callback: a `SimpleNamespace`.
fn given(
    py: Python<'_>,
    scene: &Scene,
    element: &ForceElement,
    particles: &[usize],
) -> PyResult<Py<PyAny>> {
    let axes = scene.dimension.count();
    let starts = PyArray1::from_vec(py, scene.positions());
    let of: Vec<f64> = particles
        .iter()
        .flat_map(|number| scene.particles[*number].position[..axes].iter().copied())
        .collect();
    let masses = particles.iter().map(|number| scene.particles[*number].mass);
    let facts = PyDict::new(py);
    for (parameter, value) in element.schema.parameters.iter().zip(&element.parameters) {
        facts.set_item(parameter.name, value)?;
    }
    facts.set_item("masses", PyArray1::from_iter(py, masses))?;
    facts.set_item("time", 0.0)?;
    facts.set_item("start", PyArray1::from_vec(py, of))?;
    facts.set_item("all_starts", starts)?;
    let namespace = PyModule::import(py, "types")?.getattr("SimpleNamespace")?;
    Ok(namespace.call((), Some(&facts))?.unbind())
}

/// Checks a force of a registered kind. `jacobians` are by position and velocity.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "arguments by name in Python")]
pub(crate) fn check_force<'py>(
    py: Python<'py>,
    force: Py<PyAny>,
    jacobians: (Option<Py<PyAny>>, Option<Py<PyAny>>),
    energy: Option<Py<PyAny>>,
    kind: &str,
    dimension: usize,
    parameters: &Bound<'py, PyDict>,
    masses: Vec<f64>,
    settings: (u32, u64),
) -> PyResult<Bound<'py, PyDict>> {
    let schema = force_schema(kind)?;
    let kind: &'static ForceKind = REGISTRY
        .iter()
        .copied()
        .find(|kind| kind.schema == *schema)
        .ok_or_else(|| PyRuntimeError::new_err("the force is not registered"))?;
    let mut values = vec![None; schema.parameters.len()];
    for (name, value) in parameters {
        let name: String = name.extract()?;
        let known = schema
            .parameters
            .iter()
            .position(|of| of.name == name || of.meaning.replace(' ', "_") == name);
        let place = known.ok_or_else(|| {
            let names: Vec<&str> = schema.parameters.iter().map(|of| of.name).collect();
            let names = names.join(", ");
            PyValueError::new_err(format!("{} has no parameter {name}; it has {names}", schema.tag))
        })?;
        let value = value.extract()?;
        let domain = schema.parameters[place].domain;
        if !domain.contains(value) {
            let must_be = domain.describe();
            return Err(PyValueError::new_err(format!("{name} is {value}; it must be {must_be}")));
        }
        values[place] = Some(value);
    }
    if !masses.is_empty() && masses.len() != schema.stencil.size() {
        let (found, size) = (masses.len(), schema.stencil.size());
        return Err(PyValueError::new_err(format!(
            "there are {found} masses, and {size} particles"
        )));
    }
    let dimension = if dimension == 2 { Dimension::Two } else { Dimension::Three };
    if !schema.exists_in(dimension) {
        let tag = schema.tag;
        return Err(PyValueError::new_err(format!("{tag} exists in three dimensions only")));
    }
    let callbacks = Callbacks {
        force: Arc::new(force),
        jacobians: [jacobians.0, jacobians.1].map(|of| of.map(Arc::new)),
        energy: energy.map(Arc::new),
        failure: Arc::new(Mutex::new(None)),
    };
    let (states, seed) = settings;
    let given = Given { parameters: values, masses };
    let make = |scene: &Scene| -> Box<dyn Subject> { Box::new(InPython::new(&callbacks, scene)) };
    let found = check_given(kind, dimension, Config { states, seed }, &given, &make);
    let found = found.ok_or_else(|| PyRuntimeError::new_err("the force has no law"))?;
    let mut random = states_given(kind, dimension, states, seed, &given);
    random.truncate(LIKENESSES);
    let report = reported(py, &callbacks, &found, &random);
    if let Some(error) = callbacks.failure.lock().ok().and_then(|mut failure| failure.take()) {
        return Err(error);
    }
    report
}

fn reported<'py>(
    py: Python<'py>,
    callbacks: &Callbacks,
    found: &JacobianCheck,
    random: &[CheckState],
) -> PyResult<Bound<'py, PyDict>> {
    let [by_position, by_velocity] = &callbacks.jacobians;
    let is_asked = |by: By| match by {
        By::Position => by_position.is_some(),
        By::Velocity => by_velocity.is_some(),
    };
    let blocks = found.blocks.iter().filter(|block| is_asked(block.kind.by));
    let blocks = blocks.map(|finding| block(py, callbacks, finding, random));
    // The projection and the couplings are this module's own.
    let is_users = |finding: &&PropertyFinding| {
        !matches!(finding.property, Property::Stencil | Property::Projection)
            && finding.verdict != Verdict::NotApplicable
            && (finding.property == Property::Force
                || callbacks.jacobians.iter().any(Option::is_some))
    };
    let properties = found.properties.iter().filter(is_users);
    let properties = properties.map(|finding| property(py, callbacks, finding));
    let report = PyDict::new(py);
    report.set_item("kind", found.tag)?;
    report.set_item("dimension", found.dimension.count())?;
    report.set_item("states", found.states)?;
    report.set_item("blocks", blocks.collect::<PyResult<Vec<_>>>()?)?;
    report.set_item("properties", properties.collect::<PyResult<Vec<_>>>()?)?;
    Ok(report)
}

fn verdict_of<'py>(py: Python<'py>, name: &str, verdict: Verdict) -> PyResult<Bound<'py, PyDict>> {
    let of = PyDict::new(py);
    of.set_item("name", name)?;
    of.set_item("verdict", verdict.name())?;
    of.set_item("reason", verdict.reason().map(|reason| reason.meaning()))?;
    Ok(of)
}

fn block<'py>(
    py: Python<'py>,
    callbacks: &Callbacks,
    finding: &BlockFinding,
    random: &[CheckState],
) -> PyResult<Bound<'py, PyDict>> {
    let of = verdict_of(py, finding.kind.name(), finding.verdict)?;
    of.set_item("evidence", finding.evidence)?;
    of.set_item("undecided", finding.undecided)?;
    of.set_item("unseen", &finding.unseen)?;
    if let Some(exhibit) = &finding.exhibit {
        let relative = exhibit.relative_error();
        of.set_item("error", relative.value)?;
        of.set_item("bound", relative.uncertainty)?;
        let rows = exhibit.state.scene.dimension.count();
        let yours: Vec<f64> = exhibit.entries.iter().map(|entry| entry.analytic).collect();
        let measured = exhibit.entries.iter().map(|entry| entry.sharpest());
        let measured: Vec<f64> = measured.map(|of| of.map_or(f64::NAN, |of| of.value)).collect();
        for (name, values) in [("yours", yours), ("measured", measured)] {
            let rows: Vec<Vec<f64>> = values.chunks_exact(rows).map(<[f64]>::to_vec).collect();
            of.set_item(name, rows)?;
        }
        of.set_item("particles", (exhibit.row, exhibit.column))?;
        of.set_item("state", state(py, &exhibit.state)?)?;
        if finding.verdict == Verdict::Wrong {
            let states = random.iter().chain([&exhibit.state]);
            let likenesses: Vec<Likeness> =
                states.filter_map(|at| likeness(callbacks, at, finding.kind.by)).collect();
            let likeness = common(&likenesses);
            of.set_item("likeness", likeness.map(|likeness| likeness.to_string()))?;
        }
    }
    Ok(of)
}

fn property<'py>(
    py: Python<'py>,
    callbacks: &Callbacks,
    finding: &PropertyFinding,
) -> PyResult<Bound<'py, PyDict>> {
    let of = verdict_of(py, finding.property.name(), finding.verdict)?;
    of.set_item("meaning", finding.property.meaning())?;
    of.set_item("evidence", finding.evidence)?;
    of.set_item("error", finding.error.map(|error| error.value))?;
    let Some(at) = &finding.state else { return Ok(of) };
    of.set_item("state", state(py, at)?)?;
    if let (Property::Force, Some(law)) =
        (finding.property, law::find(at.scene.forces[0].schema.tag))
    {
        let (x, v) = (at.positions(), at.velocities());
        let expected = Expectation::new(law, &at.scene).force(&x, &v, at.time);
        let mut yours = vec![0.0; x.len()];
        if InPython::new(callbacks, &at.scene).force(&x, &v, at.time, &mut yours).is_ok() {
            of.set_item("yours", PyArray1::from_vec(py, yours))?;
            of.set_item("law", PyArray1::from_vec(py, expected))?;
        }
    }
    Ok(of)
}

fn state<'py>(py: Python<'py>, at: &CheckState) -> PyResult<Bound<'py, PyDict>> {
    let of = PyDict::new(py);
    of.set_item("name", &at.name)?;
    of.set_item("x", PyArray1::from_vec(py, at.positions()))?;
    of.set_item("v", PyArray1::from_vec(py, at.velocities()))?;
    of.set_item("masses", at.masses())?;
    of.set_item("time", at.time)?;
    let elements = at.scene.forces.iter().map(|element| {
        let parameters = PyDict::new(py);
        for (parameter, value) in element.schema.parameters.iter().zip(&element.parameters) {
            parameters.set_item(parameter.name, value)?;
        }
        Ok(parameters)
    });
    of.set_item("elements", elements.collect::<PyResult<Vec<_>>>()?)?;
    Ok(of)
}

/// The pattern of the wrong entries of a Jacobian at a state.
fn likeness(callbacks: &Callbacks, at: &CheckState, by: By) -> Option<Likeness> {
    let subject = InPython::new(callbacks, &at.scene);
    let (x, v, time) = (at.positions(), at.velocities(), at.time);
    let size = x.len();
    let state = |moved: &[f64]| match by {
        By::Position => [moved.to_vec(), v.clone()],
        By::Velocity => [x.clone(), moved.to_vec()],
    };
    let value = |moved: &[f64], force: &mut [f64]| {
        let [x, v] = state(moved);
        subject.force(&x, &v, time, force).is_ok()
    };
    let dense = |moved: &[f64], entries: &mut [f64]| {
        let [x, v] = state(moved);
        let Ok(jacobians) = subject.jacobians(&x, &v, time) else { return false };
        let matrix =
            if by == By::Position { &jacobians.by_position } else { &jacobians.by_velocity };
        entries.copy_from_slice(matrix.transpose().as_slice());
        true
    };
    let element = &at.scene.forces[0];
    let parameters = element.schema.parameters.iter().zip(&element.parameters);
    let factors = parameters
        .filter(|(_, value)| **value != 0.0 && **value != 1.0)
        .map(|(parameter, value)| (parameter.name.to_owned(), *value));
    let settings = Settings {
        points: vec![if by == By::Position { x.clone() } else { v.clone() }],
        block: at.scene.dimension.count(),
        factors: factors.collect(),
        ..Settings::default()
    };
    let derivative = Derivative::Dense(Box::new(dense));
    let mut function = Function::new(size, size, Box::new(value), derivative);
    jacobian::check(&mut function, &settings).likeness
}
