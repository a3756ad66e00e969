//! Scenes and their simulation, with states as arrays.
//!
//! Shapes: positions and velocities of a scene are n × D, those of a trace (steps + 1) × n × D. Additions to a scene are read
//! by the parser of scene files: messages and limits are those of files.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray3};
use numpy::{PyUntypedArrayMethods, ToPyArray};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use reference::laws::Laws;
use scene::schema::{ForceSchema, OptionValue, Stencil};
use scene::state::StateView;
use scene::{
    Dimension, EDGE_RADIUS, Edge, Overrides, PARTICLE_RADIUS, ParseOptions, Parsed, Particle,
    Scene, write, xml,
};
use simulator::simulation::{Simulation, SimulationOptions};
use simulator::vocabulary;

pyo3::create_exception!(
    spring_oracle,
    SceneError,
    PyValueError,
    "A scene that cannot be read or built."
);
pyo3::create_exception!(spring_oracle, SimulationError, PyRuntimeError, "A step that failed.");

/// How often signals are handled during a simulation.
const SIGNALS: Duration = Duration::from_millis(50);

pub(crate) fn refused(error: impl ToString) -> PyErr {
    SceneError::new_err(error.to_string())
}

/// A scene.
#[pyclass(name = "Scene", module = "spring_oracle._native")]
#[derive(Clone)]
pub(crate) struct PyScene {
    pub(crate) scene: Scene,
    warnings: Vec<String>,
}

impl From<Parsed> for PyScene {
    fn from(Parsed { scene, warnings, .. }: Parsed) -> Self {
        Self { scene, warnings: warnings.iter().map(ToString::to_string).collect() }
    }
}

/// Attributes of an element, in XML.
fn attributes(given: &Bound<'_, PyDict>) -> PyResult<String> {
    let mut text = String::new();
    for (name, value) in given {
        let value = match (value.extract::<i64>(), value.extract::<f64>()) {
            (Ok(number), _) => number.to_string(),
            (_, Ok(number)) => format!("{number:?}"),
            _ => value.str()?.to_string(),
        };
        let value = value.replace('&', "&amp;").replace('"', "&quot;").replace('<', "&lt;");
        let _ = write!(text, " {name}=\"{value}\"");
    }
    Ok(text)
}

/// Reads the text of a scene, refusing what is unknown.
fn parse(text: &str, name: &str) -> PyResult<Scene> {
    let strict = ParseOptions { strict: true, ..ParseOptions::default() };
    Ok(xml::parse(text, name, &vocabulary(), &strict).map_err(refused)?.scene)
}

fn dimension_of(count: usize) -> PyResult<Dimension> {
    match count {
        2 => Ok(Dimension::Two),
        3 => Ok(Dimension::Three),
        _ => Err(refused(format!("the dimension is {count}; it must be 2 or 3"))),
    }
}

pub(crate) fn force_schema(tag: &str) -> PyResult<&'static ForceSchema> {
    let vocabulary = vocabulary();
    let found = vocabulary.force(tag).or_else(|| vocabulary.force(&format!("{tag}force")));
    found.ok_or_else(|| {
        let tags: Vec<&str> = vocabulary.forces.iter().map(|schema| schema.tag).collect();
        let meant = scene::spelling::closest(tag, &tags);
        let meant = meant.map(|tag| format!("; did you mean {tag:?}?")).unwrap_or_default();
        refused(format!("there is no force {tag:?}{meant}; there are {}", tags.join(", ")))
    })
}

impl PyScene {
    fn axes(&self) -> usize {
        self.scene.dimension.count()
    }

    fn particle_at(&self, number: usize) -> PyResult<&Particle> {
        let count = self.scene.particles.len();
        let missing = || refused(format!("there is no particle {number}; there are {count}"));
        self.scene.particles.get(number).ok_or_else(missing)
    }

    /// A scene with the same settings, these particles, an edge between the first two, and the elements `more`.
    fn parse_beside(&self, particles: Vec<Particle>, name: &str, more: &str) -> PyResult<Scene> {
        let Scene { duration, time_step, integrator, ref integrator_options, dimension, .. } =
            self.scene;
        let edge = Edge { particles: [0, 1], radius: EDGE_RADIUS };
        let beside = Scene {
            edges: if particles.len() > 1 { vec![edge] } else { Vec::new() },
            particles,
            duration,
            time_step,
            integrator_options: integrator_options.clone(),
            ..Scene::new(name, dimension, integrator)
        };
        let text = text_of(&beside)?.replace("</scene>", &format!("{more}\n</scene>"));
        parse(&text, name)
    }

    fn vectors<'py>(
        &self,
        py: Python<'py>,
        values: Vec<f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        PyArray1::from_vec(py, values).reshape([self.scene.particles.len(), self.axes()])
    }

    /// The numbers of an array of one state.
    fn state_of(&self, values: &PyReadonlyArray1<'_, f64>) -> PyResult<Vec<f64>> {
        let expected = self.scene.particles.len() * self.axes();
        if values.len() == expected {
            return Ok(values.as_slice()?.to_vec());
        }
        let found = values.len();
        Err(PyValueError::new_err(format!(
            "the state has {found} numbers; it must have {expected}"
        )))
    }
}

fn text_of(scene: &Scene) -> PyResult<String> {
    let mut text = Vec::new();
    write::write(scene, &mut text).map_err(refused)?;
    String::from_utf8(text).map_err(refused)
}

#[pymethods]
impl PyScene {
    /// A scene without particles.
    #[new]
    fn new(
        integrator: &str,
        time_step: f64,
        duration: f64,
        dimension: usize,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<Self> {
        let options = attributes(options)?;
        let text = format!(
            "<scene>\n<duration time=\"{duration:?}\"/>\n\
             <integrator type=\"{integrator}\" dt=\"{time_step:?}\"{options}/>\n\
             <particle m=\"1\" px=\"0\" py=\"0\" vx=\"0\" vy=\"0\" fixed=\"0\"/>\n</scene>"
        );
        // A file has a particle; this scene gets its own.
        let parsed = Scene { particles: Vec::new(), ..parse(&text, "scene")? };
        let scene = Scene { dimension: dimension_of(dimension)?, ..parsed };
        Ok(Self { scene, warnings: Vec::new() })
    }

    /// The scene of a file.
    #[staticmethod]
    fn read(path: PathBuf, strict: bool) -> PyResult<Self> {
        let options = ParseOptions { strict, ..ParseOptions::default() };
        let parsed = scene::load(&path, &vocabulary(), &options);
        parsed.map(Self::from).map_err(refused)
    }

    /// The scene of a text in XML.
    #[staticmethod]
    fn parse(text: &str, name: &str, strict: bool) -> PyResult<Self> {
        let options = ParseOptions { strict, ..ParseOptions::default() };
        xml::parse(text, name, &vocabulary(), &options).map(Self::from).map_err(refused)
    }

    /// The same scene by another integrator, over another time.
    fn changed(
        &self,
        integrator: Option<&str>,
        time_step: Option<f64>,
        duration: Option<f64>,
        options: &Bound<'_, PyDict>,
    ) -> PyResult<Self> {
        let vocabulary = vocabulary();
        let integrator = match integrator {
            None => None,
            Some(name) => Some(vocabulary.integrator(name).ok_or_else(|| {
                let names: Vec<&str> = vocabulary.integrators.iter().map(|of| of.name).collect();
                refused(format!("there is no integrator {name:?}; there are {}", names.join(", ")))
            })?),
        };
        let options: Vec<(String, String)> = options
            .iter()
            .map(|(name, value)| Ok((name.extract()?, value.str()?.to_string())))
            .collect::<PyResult<_>>()?;
        let overrides = Overrides { integrator, options, time_step, duration };
        let options = ParseOptions { overrides, ..ParseOptions::default() };
        let parsed = xml::parse(&text_of(&self.scene)?, &self.scene.name, &vocabulary, &options);
        let scene = Scene { dimension: self.scene.dimension, ..parsed.map_err(refused)?.scene };
        Ok(Self { scene, warnings: self.warnings.clone() })
    }

    /// Adds a particle, and returns its number.
    fn particle(
        &mut self,
        position: Vec<f64>,
        velocity: Vec<f64>,
        mass: f64,
        fixed: bool,
    ) -> PyResult<usize> {
        for (name, values) in [("position", &position), ("velocity", &velocity)] {
            if values.len() != self.axes() {
                let (found, axes) = (values.len(), self.axes());
                return Err(refused(format!(
                    "the {name} has {found} numbers; it must have {axes}"
                )));
            }
        }
        let mut text = format!("<particle m=\"{mass:?}\" fixed=\"{}\"", u8::from(fixed));
        for (prefix, values) in [("p", &position), ("v", &velocity)] {
            for (axis, value) in ["x", "y", "z"].into_iter().zip(values) {
                let _ = write!(text, " {prefix}{axis}=\"{value:?}\"");
            }
        }
        let parsed = self.parse_beside(Vec::new(), "particle", &(text + "/>"))?;
        self.scene.particles.extend(parsed.particles);
        Ok(self.scene.particles.len() - 1)
    }

    /// Adds an edge, and returns its number.
    fn edge(&mut self, i: usize, j: usize) -> PyResult<usize> {
        let pair = [self.particle_at(i)?.clone(), self.particle_at(j)?.clone()];
        let second = usize::from(i != j);
        self.parse_beside(pair.into(), "edge", &format!("<edge i=\"0\" j=\"{second}\"/>"))?;
        self.scene.edges.push(Edge { particles: [i, j], radius: EDGE_RADIUS });
        Ok(self.scene.edges.len() - 1)
    }

    /// Adds a force element, and returns its number.
    fn force(&mut self, tag: &str, given: &Bound<'_, PyDict>) -> PyResult<usize> {
        let schema = force_schema(tag)?;
        let given = given.copy()?;
        let mut edge = None;
        let mut particles: Vec<usize> = Vec::new();
        match schema.stencil {
            Stencil::Edge => {
                if let Some(number) = given.get_item("edge")? {
                    let number: usize = number.extract()?;
                    let (edges, count) = (&self.scene.edges, self.scene.edges.len());
                    let missing =
                        || refused(format!("there is no edge {number}; there are {count}"));
                    particles.extend(edges.get(number).ok_or_else(missing)?.particles);
                    given.set_item("edge", 0)?;
                    edge = Some(number);
                }
            }
            Stencil::Named(names) => {
                for name in names {
                    let Some(number) = given.get_item(name)? else { continue };
                    let number = number.extract()?;
                    let place = particles.iter().position(|known| *known == number);
                    given.set_item(*name, place.unwrap_or(particles.len()))?;
                    if place.is_none() {
                        particles.push(number);
                    }
                }
            }
            Stencil::EveryParticle => {}
        }
        let mut beside: Vec<Particle> = particles
            .iter()
            .map(|number| self.particle_at(*number).cloned())
            .collect::<PyResult<_>>()?;
        if beside.is_empty() {
            let [position, velocity] = [[0.0; 3]; 2];
            let radius = PARTICLE_RADIUS;
            beside.push(Particle {
                mass: 1.0,
                position,
                velocity,
                fixed: false,
                radius,
                tag: None,
            });
        }
        let text = format!("<{}{}/>", schema.tag, attributes(&given)?);
        let mut parsed = self.parse_beside(beside, schema.tag, &text)?;
        for mut element in parsed.forces.drain(..) {
            element.particles.iter_mut().for_each(|number| *number = particles[*number]);
            element.edge = edge;
            self.scene.forces.push(element);
        }
        Ok(self.scene.forces.len() - 1)
    }

    /// The scene as a file of the course's schema.
    fn xml(&self) -> PyResult<String> {
        text_of(&self.scene)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.scene.name
    }

    #[getter]
    fn description(&self) -> Option<&str> {
        self.scene.description.as_deref()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    #[getter]
    fn dimension(&self) -> usize {
        self.axes()
    }

    #[getter]
    fn time_step(&self) -> f64 {
        self.scene.time_step
    }

    #[getter]
    fn duration(&self) -> f64 {
        self.scene.duration
    }

    #[getter]
    fn n_steps(&self) -> u64 {
        self.scene.n_steps()
    }

    #[getter]
    fn integrator(&self) -> &'static str {
        self.scene.integrator.name
    }

    #[getter]
    fn options<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let options = PyDict::new(py);
        for (option, value) in self.scene.integrator_options.iter() {
            match value {
                OptionValue::Number(number) => options.set_item(option.name, number)?,
                OptionValue::Count(count) => options.set_item(option.name, count)?,
                OptionValue::Choice(choice) => options.set_item(option.name, choice)?,
            }
        }
        Ok(options)
    }

    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.vectors(py, self.scene.positions())
    }

    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.vectors(py, self.scene.velocities())
    }

    #[getter]
    fn masses<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.scene.particles.iter().map(|particle| particle.mass))
    }

    #[getter]
    fn fixed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_iter(py, self.scene.particles.iter().map(|particle| particle.fixed))
    }

    #[getter]
    fn edges(&self) -> Vec<(usize, usize)> {
        self.scene.edges.iter().map(|edge| edge.particles.into()).collect()
    }

    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let force = |element: &scene::ForceElement| {
            let force = PyDict::new(py);
            force.set_item("kind", element.schema.tag)?;
            force.set_item("particles", element.particles.to_vec())?;
            for (parameter, value) in element.schema.parameters.iter().zip(&element.parameters) {
                force.set_item(parameter.name, value)?;
            }
            Ok(force)
        };
        self.scene.forces.iter().map(force).collect()
    }

    /// All states, without the lock of the interpreter: times, positions, velocities.
    #[expect(clippy::type_complexity, reason = "a tuple of arrays for Python")]
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        robust: bool,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray3<f64>>, Bound<'py, PyArray3<f64>>)>
    {
        let states = py.detach(|| simulate(&self.scene, robust))?;
        let shape = [states.times.len(), self.scene.particles.len(), self.axes()];
        Ok((
            PyArray1::from_vec(py, states.times),
            PyArray1::from_vec(py, states.positions).reshape(shape)?,
            PyArray1::from_vec(py, states.velocities).reshape(shape)?,
        ))
    }

    /// Kinetic and potential energy of each state.
    #[expect(clippy::type_complexity, reason = "a tuple of arrays for Python")]
    fn energies<'py>(
        &self,
        py: Python<'py>,
        positions: PyReadonlyArray3<'py, f64>,
        velocities: PyReadonlyArray3<'py, f64>,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
        let expected = [self.scene.particles.len(), self.axes()];
        if [&positions, &velocities].into_iter().any(|array| array.shape()[1..] != expected) {
            let shape = &positions.shape()[1..];
            let message =
                format!("a state of the trace is {shape:?}, one of the scene {expected:?}");
            return Err(PyValueError::new_err(message));
        }
        let (positions, velocities) = (positions.as_slice()?, velocities.as_slice()?);
        let (kinetic, potential): (Vec<f64>, Vec<f64>) = py.detach(|| {
            let simulation = Simulation::new(&self.scene);
            let size = (expected[0] * expected[1]).max(1);
            let states = positions.chunks_exact(size).zip(velocities.chunks_exact(size));
            let energies = (0..).zip(states).map(|(step, (positions, velocities))| {
                let time = step as f64 * self.scene.time_step;
                simulation.energies_of(StateView { step, time, positions, velocities })
            });
            energies.map(|energies| (energies.kinetic, energies.potential)).unzip()
        });
        Ok((PyArray1::from_vec(py, kinetic), PyArray1::from_vec(py, potential)))
    }

    /// The force and its Jacobians by position and velocity, by the reference laws.
    #[expect(clippy::type_complexity, reason = "a tuple of arrays for Python")]
    fn laws<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f64>,
        v: PyReadonlyArray1<'py, f64>,
        time: f64,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>)>
    {
        let (x, v) = (self.state_of(&x)?, self.state_of(&v)?);
        let laws = Laws::new(&self.scene);
        let jacobians = laws.jacobians(&x, &v, time);
        let array = |matrix: &nalgebra::DMatrix<f64>| {
            // Column by column is the transpose, row by row.
            PyArray1::from_slice(py, matrix.transpose().as_slice()).reshape([x.len(); 2])
        };
        let force = laws.force(&x, &v, time).to_pyarray(py);
        Ok((force, array(&jacobians.by_position)?, array(&jacobians.by_velocity)?))
    }
}

/// All states of a simulation.
struct States {
    times: Vec<f64>,
    positions: Vec<f64>,
    velocities: Vec<f64>,
}

fn simulate(scene: &Scene, robust: bool) -> PyResult<States> {
    let options = SimulationOptions { robust, ..SimulationOptions::default() };
    let mut simulation = Simulation::with_options(scene, options);
    let mut states = States { times: Vec::new(), positions: Vec::new(), velocities: Vec::new() };
    let mut last = Instant::now();
    loop {
        let StateView { time, positions, velocities, .. } = simulation.state();
        states.times.push(time);
        states.positions.extend_from_slice(positions);
        states.velocities.extend_from_slice(velocities);
        if last.elapsed() > SIGNALS {
            Python::attach(|py| py.check_signals())?;
            last = Instant::now();
        }
        let advanced = simulation.advance();
        if !advanced.map_err(|error| SimulationError::new_err(error.to_string()))? {
            return Ok(states);
        }
    }
}

/// A force or an integrator for Python: its facts by name.
#[pyfunction]
pub(crate) fn forces(py: Python<'_>) -> PyResult<Vec<Bound<'_, PyDict>>> {
    let force = |schema: &&'static ForceSchema| {
        let force = PyDict::new(py);
        force.set_item("kind", schema.tag)?;
        force.set_item("title", schema.title)?;
        force.set_item("formula", schema.formula)?;
        force.set_item("particles", schema.stencil.attributes())?;
        force.set_item("size", schema.stencil.size())?;
        force.set_item("field", schema.stencil.is_field())?;
        force.set_item("least_dimension", schema.least_dimension.count())?;
        let parameters = schema.parameters.iter().map(|parameter| {
            let of = PyDict::new(py);
            of.set_item("name", parameter.name)?;
            of.set_item("meaning", parameter.meaning)?;
            of.set_item("default", parameter.default)?;
            of.set_item("typical", parameter.typical)?;
            of.set_item("required", parameter.is_required())?;
            of.set_item("three_dimensional", parameter.three_dimensional)?;
            Ok(of)
        });
        force.set_item("parameters", parameters.collect::<PyResult<Vec<_>>>()?)?;
        Ok(force)
    };
    vocabulary().forces.iter().map(force).collect()
}

/// The stable steps of an integrator on an oscillator with this damping ratio, in units of 1/ω: up to the first, and again from
/// the second on.
#[pyfunction]
pub(crate) fn stable_steps(integrator: &str, damping_ratio: f64) -> PyResult<[f64; 2]> {
    let schema = vocabulary().integrator(integrator).ok_or_else(|| {
        PyValueError::new_err(format!("there is no integrator {integrator:?}; see integrators()"))
    })?;
    Ok(reference::method::stable_steps(schema.equation, damping_ratio))
}

/// The names of the integrators, with their summaries.
#[pyfunction]
pub(crate) fn integrators() -> Vec<(&'static str, &'static str)> {
    vocabulary().integrators.iter().map(|schema| (schema.name, schema.summary)).collect()
}
