//! Parser for scenes of the fast mass-spring assignment: a JSON file with an OBJ mesh.
//!
//! ```text
//! {"obj": "net.obj", "k": 300, "m": 1, "b": [1, 5], "wind": false, "png": "net.png"}
//!
//! particles   the vertices, at rest; those of b (counted from 1) fixed; of mass m, or of their area
//! springs     each pair of vertices of a face, and the segments of lines; stiffness k, undamped
//! forces      constantforce (0, −9.8, 0); windforce where wind is true
//! steps       30 of 1/30 s, by fast-mass-spring, which holds the fixed particles by a penalty
//! ```
//!
//! Only `obj` and `k` are required. Lengths, masses and stiffness are in the author's units, time is in
//! seconds. Time and memory are in proportion to the two files and the pairs of vertices. Source:
//! *Computer Graphics – Mass-MeshSpring Systems*, the assignment's hand-out.

mod document;
mod masses;
mod obj;
mod source;
mod springs;

use std::path::Path;

use super::error::{JsonProblem, Problem, SceneError};
use super::resolve::{refuse_force, set_options};
use super::schema::{Domain, ForceSchema, IntegratorOptions, IntegratorSchema, Vocabulary};
use super::{
    Dimension, EDGE_RADIUS, Edge, ForceElement, Location, MAX_STEPS, MeshFile, PARTICLE_RADIUS,
    ParseOptions, Parsed, Particle, Particles, Rendering, Scene, SceneLimits, Surface, decode,
    is_below, read_at_most, read_bounded, step_count,
};
use document::{Document, NoDocument, parse_number, wrong_value};
use obj::Mesh;
use source::{Source, Warnings, excerpt};

/// The assignment's external force on each vertex, along y.
const GRAVITY: f64 = -9.8;

/// The assignment's time step, in seconds.
const TIME_STEP: f64 = 1.0 / 30.0;

/// For how long a scene is simulated that does not say so, in seconds.
const DURATION: f64 = 1.0;

/// The assignment's method, and how it holds pinned vertices.
const INTEGRATOR: &str = "fast-mass-spring";
const PINS: (&str, &str) = ("pins", "penalty");

/// Whether the file at `path` is taken for JSON: its extension is `json`, in upper or lower case.
pub fn is_json(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json"))
}

/// Whether the JSON file at `path` is meant to be a scene: it is an object with a key `obj` or `k`. A file that
/// cannot be read, or is malformed, counts as a scene, so that its error is reported.
pub fn is_scene(path: &Path) -> bool {
    // Opening a pipe would block.
    if path.metadata().is_ok_and(|metadata| !metadata.is_file()) {
        return false;
    }
    let Ok(bytes) = read_bounded(path) else { return true };
    let Ok(text) = decode(&bytes, "") else { return true };
    match Document::read(&mut Source::new("", text)) {
        Ok(document) => document.is_scene(),
        Err(NoDocument::Malformed(_)) => true,
        Err(NoDocument::NotAnObject(_)) => false,
    }
}

/// Reads a scene from the text of the JSON file at `path`, and from the OBJ file that it names.
///
/// # Errors
/// If either file is not as it must be, or the scene is not one this vocabulary can express. The
/// error names file, line and column.
pub fn parse(
    text: &str,
    path: &Path,
    vocabulary: &Vocabulary,
    options: &ParseOptions,
) -> Result<Parsed, SceneError> {
    let name = path.display().to_string();
    let source = &mut Source::new(&name, text);
    let mut warnings = Warnings { strict: options.strict, kept: Vec::new(), count: 0 };
    let settings = Settings::read(source, &mut warnings)?;

    let folder = path.parent().unwrap_or(Path::new(""));
    let mesh_path = folder.join(&settings.mesh);
    let texture = settings.texture.as_ref().map(|texture| folder.join(texture));
    if options.confined {
        let named = [("obj", Some(&mesh_path)), ("png", texture.as_ref())];
        for (key, path) in named.into_iter().filter_map(|(key, path)| Some((key, path?))) {
            if !is_below(folder, path) {
                let name = excerpt(&path.display().to_string());
                let offset = settings.offsets[usize::from(key == "png")];
                return Err(source.error(offset, JsonProblem::Outside { key, name }));
            }
        }
    }
    let mesh_name = mesh_path.display().to_string();
    let limits = &options.limits;
    let bytes = read_mesh(&mesh_path, limits.bytes, &settings, source)?;
    let mesh_source = &mut Source::new(&mesh_name, decode(&bytes, &mesh_name)?);
    let mesh = Mesh::read(mesh_source, &mut warnings)?;
    SceneLimits::check(mesh.positions.len(), limits.particles, "particles")
        .map_err(|problem| SceneError::whole_file(&mesh_name, problem))?;
    let springs = springs::springs(&mesh, limits.forces, mesh_source, &mut warnings)?;
    let masses = match settings.mass {
        Some(mass) => vec![mass; mesh.positions.len()],
        None => areas(&mesh, mesh_source)?,
    };

    let particle = |(position, mass): (&[f64; 3], f64)| Particle {
        mass,
        position: *position,
        velocity: [0.0; 3],
        fixed: false,
        radius: PARTICLE_RADIUS,
        tag: None,
    };
    let mut particles: Vec<Particle> = mesh.positions.iter().zip(masses).map(particle).collect();
    pin(&mut particles, &settings, source, &mut warnings)?;

    let spring_force = force(vocabulary, &name, "springforce")?;
    let mut edges = Vec::with_capacity(springs.len());
    let mut forces = settings.external_forces(vocabulary, &name)?;
    for (edge, spring) in springs.into_iter().enumerate() {
        edges.push(Edge { particles: spring.particles, radius: EDGE_RADIUS });
        forces.push(ForceElement {
            schema: spring_force,
            particles: spring.particles.into(),
            edge: Some(edge),
            parameters: spring_force
                .values(&[("k", settings.stiffness), ("l0", spring.rest_length)]),
            location: settings.stiffness_location,
        });
    }

    let overrides = &options.overrides;
    let duration = overrides.duration.unwrap_or(DURATION);
    let time_step = overrides.time_step.unwrap_or(TIME_STEP);
    let (integrator, mut integrator_options) = integrator(vocabulary, &name, overrides.integrator)?;
    set_options(&name, integrator, &mut integrator_options, &overrides.options)?;
    for force in &forces {
        refuse_force(&name, integrator, force)?;
    }
    let steps = step_count(duration, time_step);
    if steps > MAX_STEPS as f64 {
        let problem = Problem::TooManySteps { duration, time_step, steps, limit: MAX_STEPS };
        return Err(SceneError::whole_file(&name, problem));
    }

    let faces = mesh.faces();
    let Mesh { libraries, materials, .. } = mesh;
    let confined_to = options.confined.then(|| folder.to_path_buf());
    let surface =
        Surface { faces, texture, mesh: mesh_path.clone(), libraries, materials, confined_to };
    let scene = Scene {
        rendering: Rendering { surface, ..Rendering::default() },
        duration,
        time_step,
        integrator_options,
        particles,
        edges,
        forces,
        ..Scene::new(name.clone(), Dimension::Three, integrator)
    };
    Ok(Parsed {
        integrator_spelling: integrator.name.to_owned(),
        scene,
        warnings: warnings.kept,
        n_warnings: warnings.count,
        mesh: Some(MeshFile { path: mesh_path, bytes }),
    })
}

/// Settings from the JSON file.
struct Settings<'a> {
    mesh: String,
    /// Where the values of `obj` and `png` stand.
    offsets: [usize; 2],
    texture: Option<String>,
    stiffness: f64,
    stiffness_location: Location,
    mass: Option<f64>,
    pinned: Vec<&'a str>,
    wind: Option<Location>,
    start: Location,
}

impl<'a> Settings<'a> {
    fn read(source: &mut Source<'a>, warnings: &mut Warnings) -> Result<Self, SceneError> {
        let document = Document::read(source).map_err(|error| match error {
            NoDocument::Malformed(error) | NoDocument::NotAnObject(error) => error,
        })?;
        document.check_keys(source, warnings)?;
        let missing = |source: &Source<'_>, key, example| {
            source.whole(JsonProblem::MissingKey { key, example })
        };
        let mesh = document.string(source, "obj")?;
        let mesh = mesh.ok_or_else(|| missing(source, "obj", "\"obj\": \"net.obj\""))?;
        let mesh_text = document.find("obj").unwrap_or_default();
        if mesh.is_empty() {
            return Err(wrong_value(source, "obj", mesh_text, "the name of a file"));
        }
        let stiffness = document.number(source, "k", Domain::NonNegative)?;
        let stiffness = stiffness.ok_or_else(|| missing(source, "k", "\"k\": 100"))?;
        let mass = document.number(source, "m", Domain::Positive)?;
        let wind = document.boolean(source, "wind")?;
        let texture = document.string(source, "png")?;
        let mut locate = |key: &str| {
            let offset = document.find(key).map_or(0, |text| source.offset_of(text));
            source.locate(offset)
        };
        Ok(Self {
            stiffness_location: locate("k"),
            wind: wind.then(|| locate("wind")),
            start: locate(""),
            mesh,
            offsets: ["obj", "png"]
                .map(|key| document.find(key).map_or(0, |text| source.offset_of(text))),
            texture,
            stiffness,
            mass,
            pinned: document.list("b"),
        })
    }

    /// The forces that act on every particle.
    fn external_forces(
        &self,
        vocabulary: &Vocabulary,
        name: &str,
    ) -> Result<Vec<ForceElement>, SceneError> {
        let on_all = |tag, given: &[(&str, f64)], location| {
            let schema = force(vocabulary, name, tag)?;
            let parameters = schema.values(given);
            Ok(ForceElement {
                schema,
                particles: Particles::new(),
                edge: None,
                parameters,
                location,
            })
        };
        let mut forces = vec![on_all("constantforce", &[("fy", GRAVITY)], self.start)?];
        if let Some(location) = self.wind {
            forces.push(on_all("windforce", &[], location)?);
        }
        Ok(forces)
    }
}

/// Reads the mesh file. A missing mesh is an error of the scene file.
fn read_mesh(
    path: &Path,
    limit: u64,
    settings: &Settings<'_>,
    source: &mut Source<'_>,
) -> Result<Vec<u8>, SceneError> {
    let mut unreadable = |read_error| {
        let mesh = path.display().to_string();
        let problem = JsonProblem::MeshUnreadable { mesh, source: read_error };
        source.error(settings.offsets[0], problem)
    };
    read_at_most(path, limit).map_err(|error| match *error.problem {
        Problem::Unreadable { source } => unreadable(source),
        problem => SceneError { problem: Box::new(problem), ..error },
    })
}

/// The area around each vertex, as its mass.
fn areas(mesh: &Mesh, source: &mut Source<'_>) -> Result<Vec<f64>, SceneError> {
    let areas = masses::voronoi_areas(mesh);
    let is_mass = |area: &f64| Domain::Positive.contains(*area);
    let Some(vertex) = areas.iter().position(|area| !is_mass(area)) else { return Ok(areas) };
    let problem = if areas[vertex] == 0.0 {
        JsonProblem::NoArea { vertex: vertex + 1 }
    } else {
        JsonProblem::AreaOverflow { vertex: vertex + 1 }
    };
    Err(source.error(mesh.places[vertex] as usize, problem))
}

/// Fixes the vertices of `b`.
fn pin(
    particles: &mut [Particle],
    settings: &Settings<'_>,
    source: &mut Source<'_>,
    warnings: &mut Warnings,
) -> Result<(), SceneError> {
    let count = particles.len();
    for text in &settings.pinned {
        let Some(vertex) = parse_number(text).filter(|number| number.fract() == 0.0) else {
            return Err(wrong_value(source, "b", text, "a whole number, or a list of them"));
        };
        let offset = source.offset_of(text);
        if !(1.0..=count as f64).contains(&vertex) {
            let problem = JsonProblem::NoSuchPin { text: excerpt(text), count };
            return Err(source.error(offset, problem));
        }
        let vertex = vertex as usize;
        if std::mem::replace(&mut particles[vertex - 1].fixed, true) {
            warnings.add(source, offset, JsonProblem::PinnedTwice { vertex })?;
        }
    }
    Ok(())
}

/// The integrator asked for, or the assignment's.
fn integrator(
    vocabulary: &Vocabulary,
    name: &str,
    wanted: Option<&'static IntegratorSchema>,
) -> Result<(&'static IntegratorSchema, IntegratorOptions), SceneError> {
    let Some(schema) = wanted.or_else(|| vocabulary.integrator(INTEGRATOR)) else {
        let known: Vec<&str> = vocabulary.integrators.iter().map(|schema| schema.name).collect();
        let found = INTEGRATOR.to_owned();
        let known = known.join(", ");
        let problem = Problem::UnknownIntegrator { found, suggestion: None, known };
        return Err(SceneError::whole_file(name, problem));
    };
    let mut options = IntegratorOptions::defaults(schema);
    if schema.name == INTEGRATOR {
        let (option, value) = PINS;
        set_options(name, schema, &mut options, &[(option.to_owned(), value.to_owned())])?;
    }
    Ok((schema, options))
}

fn force(
    vocabulary: &Vocabulary,
    name: &str,
    tag: &'static str,
) -> Result<&'static ForceSchema, SceneError> {
    vocabulary.force(tag).ok_or_else(|| {
        SceneError::whole_file(name, Problem::UnmodelledPhysics { tag: tag.to_owned() })
    })
}
