//! The scene model: plain data, resolved and validated, independent of any file format.
//!
//! Particles, edges and forces are numbered from 0 in the order of the file. Units are whatever the
//! scene's author chose, used consistently. Sources: the course's XML schema (hand-outs of
//! milestones 1 to 3), in [`xml`]; the JSON and OBJ files of the fast mass-spring assignment, in [`json`].

pub mod error;
pub mod input;
pub mod json;
pub mod output;
pub mod printable;
pub mod schema;
pub mod spelling;
pub mod state;
pub mod trace;
pub mod write;
pub mod xml;

mod lines;
mod resolve;

use std::path::{Path, PathBuf};

use smallvec::{SmallVec, smallvec};

use error::{Problem, SceneError};
pub use resolve::is_flat;
use schema::{
    Coordinate, Dependence, ForceSchema, IntegratorOptions, IntegratorSchema, PartSchema,
    Potential, Vocabulary,
};

/// The most steps a scene may ask for.
pub const MAX_STEPS: u64 = 1_000_000_000;

/// The largest scene file that is read, in bytes.
pub const MAX_FILE_SIZE: u64 = 256 << 20;

/// Remarks beyond this many are counted, and not kept.
const MAX_WARNINGS: usize = 100;

/// The radius of a particle for which none is given.
pub const PARTICLE_RADIUS: f64 = 0.1;

/// The radius of an edge for which none is given.
pub const EDGE_RADIUS: f64 = 0.015;

/// A place in a scene file, both counted from 1; columns count characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub struct Location {
    /// Line, from 1.
    pub line: u32,
    /// Column, from 1.
    pub column: u32,
}

/// How many coordinates a particle has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// `x`, `y`: the scene has no `pz`, `vz` or `fz` anywhere.
    Two,
    /// `x`, `y`, `z`.
    Three,
}

impl Dimension {
    /// 2 or 3.
    pub fn count(self) -> usize {
        match self {
            Self::Two => 2,
            Self::Three => 3,
        }
    }
}

/// A scene: physics, timeline and the data for drawing it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Name of the scene in messages: its path, as given.
    pub name: String,
    /// `<description text>`.
    pub description: Option<String>,
    /// `<scenetag tag>`: the name of a scripted scene.
    pub tag: Option<String>,
    /// Whether states carry a z coordinate.
    pub dimension: Dimension,
    /// Simulated time, in seconds.
    pub duration: f64,
    /// Time step `h`, in seconds.
    pub time_step: f64,
    /// The time integrator.
    pub integrator: &'static IntegratorSchema,
    /// The values of its options.
    pub integrator_options: IntegratorOptions,
    /// `<maxsimfreq max>`: steps a second when shown live.
    pub max_simulation_frequency: Option<f64>,
    /// The particles.
    pub particles: Vec<Particle>,
    /// The edges. An edge is drawn; it exerts no force unless a spring names it.
    pub edges: Vec<Edge>,
    /// The forces, one entry an element of the file.
    pub forces: Vec<ForceElement>,
    /// Data for drawing.
    pub rendering: Rendering,
}

impl Scene {
    /// A scene without particles and with a duration of 0. Its time step is 1 s.
    pub fn new(
        name: impl Into<String>,
        dimension: Dimension,
        integrator: &'static IntegratorSchema,
    ) -> Self {
        Self {
            name: name.into(),
            description: None,
            tag: None,
            dimension,
            duration: 0.0,
            time_step: 1.0,
            integrator,
            integrator_options: IntegratorOptions::defaults(integrator),
            max_simulation_frequency: None,
            particles: Vec::new(),
            edges: Vec::new(),
            forces: Vec::new(),
            rendering: Rendering::default(),
        }
    }

    /// Initial positions, `n·D`, particle-major.
    pub fn positions(&self) -> Vec<f64> {
        self.flattened(|particle| &particle.position)
    }

    /// Initial velocities, `n·D`, particle-major.
    pub fn velocities(&self) -> Vec<f64> {
        self.flattened(|particle| &particle.velocity)
    }

    fn flattened(&self, vector: fn(&Particle) -> &[f64; 3]) -> Vec<f64> {
        let components = |particle| vector(particle)[..self.dimension.count()].iter().copied();
        self.particles.iter().flat_map(components).collect()
    }

    /// Number of steps: `ceil(duration / time_step)`, in f64 as the course's oracle computes it.
    pub fn n_steps(&self) -> u64 {
        step_count(self.duration, self.time_step) as u64
    }

    /// Whether the last step ends at the duration, but for rounding.
    pub fn is_divided(&self) -> bool {
        let end = self.n_steps() as f64 * self.time_step;
        (end - self.duration).abs() <= 1e-9 * self.duration
    }
}

/// `ceil(duration / time_step)`, still as an f64: it may be larger than any integer.
pub fn step_count(duration: f64, time_step: f64) -> f64 {
    (duration / time_step).ceil()
}

/// `<particle>`.
#[derive(Debug, Clone, PartialEq)]
pub struct Particle {
    /// Mass; positive.
    pub mass: f64,
    /// Position; z is 0 in a scene of two dimensions.
    pub position: [f64; 3],
    /// Velocity; z is 0 in a scene of two dimensions.
    pub velocity: [f64; 3],
    /// A fixed particle feels no force: it keeps its velocity, and moves with it.
    pub fixed: bool,
    /// Radius it is drawn with.
    pub radius: f64,
    /// `tag`, a name scripts use.
    pub tag: Option<String>,
}

/// `<edge>`.
#[derive(Debug, Clone, PartialEq)]
pub struct Edge {
    /// The two particles it joins.
    pub particles: [usize; 2],
    /// Radius it is drawn with.
    pub radius: f64,
}

/// Particles of a force element: two without an allocation.
pub type Particles = SmallVec<[usize; 2]>;

/// Parameters of a force element: four without an allocation.
pub type Parameters = SmallVec<[f64; 4]>;

/// One force element, such as one `<springforce>`.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceElement {
    /// Which force it is.
    pub schema: &'static ForceSchema,
    /// The particles it acts on, in the order of its [`Stencil`](schema::Stencil); none in a field, which acts on
    /// each particle of the scene by itself.
    pub particles: Particles,
    /// The edge it was attached to by the file, if it was.
    pub edge: Option<usize>,
    /// Its parameters, in the order of the schema.
    pub parameters: Parameters,
    /// Where it stands in the file.
    pub location: Location,
}

impl ForceElement {
    /// An element of no file, on these particles; on none for a field.
    pub fn new(
        schema: &'static ForceSchema,
        particles: &[usize],
        edge: Option<usize>,
        parameters: Parameters,
    ) -> Self {
        let location = Location::default();
        Self { schema, particles: particles.into(), edge, parameters, location }
    }

    /// Its particles, if they are two.
    pub fn pair(&self) -> Option<[usize; 2]> {
        self.particles[..].try_into().ok()
    }

    /// Each list of particles that its law is evaluated on, in a scene of `n_particles`.
    pub fn stencils(&self, n_particles: usize) -> impl Iterator<Item = Particles> {
        let is_field = self.schema.stencil.is_field();
        let each = (0..if is_field { n_particles } else { 0 }).map(|each| smallvec![each]);
        (!is_field).then(|| self.particles.clone()).into_iter().chain(each)
    }

    /// The length of the path through its particles, in their order.
    pub fn path_length(&self, particles: &[Particle]) -> f64 {
        let length = |pair: &[usize]| {
            let [a, b] = [pair[0], pair[1]].map(|number| particles[number].position);
            (0..3).map(|axis| (b[axis] - a[axis]).powi(2)).sum::<f64>().sqrt()
        };
        self.particles.windows(2).map(length).sum()
    }

    /// `3 |ē|²/Ā`, with `ē` the edge from its first particle to the second, and `Ā` the area of the two triangles on it and
    /// on the third particle and the fourth.
    ///
    /// # Panics
    /// If it has fewer than four particles.
    pub fn hinge_weight(&self, particles: &[Particle]) -> f64 {
        let place = |corner: usize| particles[self.particles[corner]].position;
        let [edge, a, b] = [1, 2, 3].map(|corner| resolve::difference(place(corner), place(0)));
        let areas = [a, b].map(|side| 0.5 * resolve::norm(resolve::cross(edge, side)));
        3.0 * resolve::norm(edge).powi(2) / (areas[0] + areas[1])
    }

    /// Its particles' places in the undeformed element; none if the force has no such parameters.
    pub fn undeformed(&self) -> SmallVec<[[f64; 3]; 3]> {
        let mut places: SmallVec<[[f64; 3]; 3]> = SmallVec::new();
        for (parameter, value) in self.schema.parameters.iter().zip(&self.parameters) {
            if let Some(Coordinate { particle, axis }) = parameter.coordinate {
                places.resize(places.len().max(particle + 1), [0.0; 3]);
                places[particle][axis] = *value;
            }
        }
        places
    }

    /// The parameter `name`.
    ///
    /// # Panics
    /// Where the force has no such parameter.
    pub fn parameter(&self, name: &str) -> f64 {
        self.parameters[self.schema.parameter_idx(name)]
    }

    /// The parameter `name`, to be changed.
    ///
    /// # Panics
    /// Where the force has no such parameter.
    pub fn parameter_mut(&mut self, name: &str) -> &mut f64 {
        &mut self.parameters[self.schema.parameter_idx(name)]
    }

    /// Whether the element has this part of its force: one of the parameters that scale it is not zero.
    pub fn has_part(&self, part: &PartSchema) -> bool {
        part.scaled_by.iter().any(|name| self.parameter(name) != 0.0)
    }

    /// Dependence of the parts that act in this element.
    pub fn depends_on(&self) -> Dependence {
        let parts = self.schema.parts.iter().filter(|part| self.has_part(part));
        parts.fold(Dependence::NOTHING, |sum, part| sum.or(part.depends_on))
    }

    /// Takes this part out of the element.
    pub fn remove_part(&mut self, part: &PartSchema) {
        for name in part.scaled_by {
            *self.parameter_mut(name) = 0.0;
        }
    }

    /// Whether the element follows from functions of the state, an energy or a dissipation function. Its Jacobians
    /// are symmetric then. The first part counts whatever its parameters are, each other one where it is there.
    pub fn is_variational(&self) -> bool {
        let counts = |(number, part): (usize, &PartSchema)| {
            (number == 0 || self.has_part(part)).then_some(part.derives_from)
        };
        let mut potentials = self.schema.parts.iter().enumerate().filter_map(counts);
        potentials.all(|potential| potential != Potential::Neither)
    }
}

/// Colour with components from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Color {
    /// Red.
    pub r: f64,
    /// Green.
    pub g: f64,
    /// Blue.
    pub b: f64,
}

/// Rendering data of a scene. It does not affect the physics.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rendering {
    /// `<viewport>`, the camera.
    pub viewport: Option<Viewport>,
    /// `<backgroundcolor>`.
    pub background: Option<Color>,
    /// `<particlecolor>`: particle and its colour.
    pub particle_colors: Vec<(usize, Color)>,
    /// `<edgecolor>`: edge and its colour.
    pub edge_colors: Vec<(usize, Color)>,
    /// `<particlepath>`: trails.
    pub particle_paths: Vec<ParticlePath>,
    /// The surface of a scene in JSON: the faces of its mesh.
    pub surface: Surface,
}

/// A surface through particles. It covers them, and the edges within a face.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surface {
    /// Polygons of three corners or more.
    pub faces: Vec<Vec<SurfaceCorner>>,
    /// `png`: the file of its texture, which need not exist.
    pub texture: Option<PathBuf>,
    /// The OBJ file.
    pub mesh: PathBuf,
    /// `mtllib`: the material libraries that it names, which need not exist.
    pub libraries: Vec<Mention>,
    /// `usemtl`: materials, each with the number of the first face that has it.
    pub materials: Vec<(usize, Mention)>,
    /// The folder that all these files must be below, if any.
    pub confined_to: Option<PathBuf>,
}

/// A name in an OBJ file.
#[derive(Debug, Clone, PartialEq)]
pub struct Mention {
    /// Several words are separated by one space.
    pub name: String,
    /// Where it stands.
    pub location: Location,
}

/// A corner of a face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceCorner {
    /// The particle.
    pub particle: usize,
    /// Its place in the texture, if the mesh says it.
    pub texture: Option<[f64; 2]>,
}

/// `<viewport>`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewport {
    /// Centre of the view.
    pub center: [f64; 2],
    /// Size of the view.
    pub size: f64,
}

/// `<particlepath>`: a trail behind a particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParticlePath {
    /// The particle that leaves the trail.
    pub particle: usize,
    /// How many seconds the trail lasts.
    pub duration: f64,
    /// Its colour.
    pub color: Color,
}

/// How to read a scene.
#[derive(Debug, Clone, Default)]
pub struct ParseOptions {
    /// Unknown elements, attributes and keys are errors instead of warnings.
    pub strict: bool,
    /// Values that replace those of the file.
    pub overrides: Overrides,
    /// Meshes, material libraries and pictures must be below the scene's folder; links count where they lead.
    pub confined: bool,
    /// The sizes of scenes that are read.
    pub limits: SceneLimits,
}

/// Sizes that a scene may have.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneLimits {
    /// Bytes of each of its files.
    pub bytes: u64,
    /// Particles.
    pub particles: u64,
    /// Forces, one an element.
    pub forces: u64,
}

impl Default for SceneLimits {
    fn default() -> Self {
        Self { bytes: MAX_FILE_SIZE, particles: u64::MAX, forces: u64::MAX }
    }
}

impl SceneLimits {
    /// The names of the limits.
    pub const NAMES: [&str; 3] = ["bytes", "particles", "forces"];

    /// The limit of this name; `None` if there is none.
    pub fn named(&mut self, name: &str) -> Option<&mut u64> {
        match name {
            "bytes" => Some(&mut self.bytes),
            "particles" => Some(&mut self.particles),
            "forces" => Some(&mut self.forces),
            _ => None,
        }
    }

    /// A problem if there are more.
    fn check(count: usize, limit: u64, what: &'static str) -> Result<(), Problem> {
        if count as u64 <= limit { Ok(()) } else { Err(Problem::Exceeds { what, limit }) }
    }
}

/// Values that replace the file's own.
#[derive(Debug, Clone, Default)]
pub struct Overrides {
    /// Another integrator. Options that the file gives to its own do not count for another.
    pub integrator: Option<&'static IntegratorSchema>,
    /// Options of the integrator: name and value.
    pub options: Vec<(String, String)>,
    /// Another time step, in seconds; positive.
    pub time_step: Option<f64>,
    /// Another duration, in seconds; not negative.
    pub duration: Option<f64>,
}

/// A parsed scene with its warnings.
#[derive(Debug)]
pub struct Parsed {
    /// The scene.
    pub scene: Scene,
    /// Warnings in the order of the file; at most the first hundred.
    pub warnings: Vec<SceneError>,
    /// The number of all warnings.
    pub n_warnings: usize,
    /// The integrator as the file spells it: its name or one of its aliases.
    pub integrator_spelling: String,
    /// The mesh that a scene in JSON names; `None` for a scene in XML.
    pub mesh: Option<MeshFile>,
}

/// The second of the two files that make up a scene in JSON.
#[derive(Debug)]
pub struct MeshFile {
    /// Its path.
    pub path: PathBuf,
    /// All that it holds.
    pub bytes: Vec<u8>,
}

/// Reads the scene file at `path`: JSON with an OBJ file where its extension is `.json`, in upper or
/// lower case, and XML otherwise.
///
/// # Errors
/// If the file cannot be read, is larger than [`MAX_FILE_SIZE`], is not UTF-8 text, or is not a
/// scene that this vocabulary can express; the same of the mesh that it names.
pub fn load(
    path: &Path,
    vocabulary: &Vocabulary,
    options: &ParseOptions,
) -> Result<Parsed, SceneError> {
    let bytes = read_at_most(path, options.limits.bytes)?;
    parse_bytes(&bytes, path, vocabulary, options)
}

/// Reads the scene that `bytes`, the content of the file at `path`, hold. The mesh that a scene in JSON
/// names is read from its file.
///
/// # Errors
/// As [`load`], but for reading the file at `path`.
pub fn parse_bytes(
    bytes: &[u8],
    path: &Path,
    vocabulary: &Vocabulary,
    options: &ParseOptions,
) -> Result<Parsed, SceneError> {
    let name = path.display().to_string();
    let text = decode(bytes, &name)?;
    let parsed = if json::is_json(path) {
        json::parse(text, path, vocabulary, options)
    } else {
        xml::parse(text, &name, vocabulary, options)
    }?;
    let SceneLimits { particles, forces, .. } = options.limits;
    SceneLimits::check(parsed.scene.particles.len(), particles, "particles")
        .and_then(|()| SceneLimits::check(parsed.scene.forces.len(), forces, "forces"))
        .map_err(|problem| SceneError::whole_file(&name, problem))?;
    Ok(parsed)
}

/// Whether a file that a scene names is below its folder: by its path, and where links lead.
pub fn is_below(folder: &Path, path: &Path) -> bool {
    use std::path::Component;
    let is_inside = |part| matches!(part, Component::Normal(_) | Component::CurDir);
    let is_named_below =
        path.strip_prefix(folder).is_ok_and(|rest| rest.components().all(is_inside));
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let leads_below = match (input::real_path(folder), input::real_path(path)) {
        (Ok(folder), Ok(path)) => path.starts_with(folder),
        // It cannot be read either.
        _ => true,
    };
    is_named_below && leads_below
}

/// Decodes the content of the file `name` as text without its byte order mark.
fn decode<'b>(bytes: &'b [u8], name: &str) -> Result<&'b str, SceneError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|error| {
        let before = String::from_utf8_lossy(&bytes[..error.valid_up_to()]);
        let location = lines::LineCounter::new(&before).locate(before.len());
        let byte = bytes[error.valid_up_to()];
        SceneError::new(name, location, Problem::NotText { byte })
    })
}

/// The whole file, refused by its size before it is read.
///
/// # Errors
/// If it cannot be read, or is larger than [`MAX_FILE_SIZE`].
pub fn read_bounded(path: &Path) -> Result<Vec<u8>, SceneError> {
    read_at_most(path, MAX_FILE_SIZE)
}

fn read_at_most(path: &Path, limit: u64) -> Result<Vec<u8>, SceneError> {
    use std::io::Read;
    let unreadable = |source: std::io::Error| SceneError::unreadable(path, source);
    let too_large = |size| {
        let problem = if limit < MAX_FILE_SIZE {
            Problem::Exceeds { what: "bytes", limit }
        } else {
            Problem::TooLarge { size, limit }
        };
        SceneError::whole_file(&path.display().to_string(), problem)
    };
    let file = input::open(path).map_err(unreadable)?;
    let metadata = file.metadata().map_err(unreadable)?;
    if metadata.len() > limit {
        return Err(too_large(metadata.len()));
    }
    let mut bytes = Vec::new();
    // It may grow meanwhile.
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > limit {
        return Err(too_large(bytes.len() as u64));
    }
    Ok(bytes)
}

/// Every scene file below `folder`, sorted by path: `*.xml`, and what [`json::is_scene`] takes of
/// `*.json`, which it reads.
///
/// # Errors
/// If a folder cannot be listed.
pub fn find_scene_files(folder: &Path) -> Result<Vec<PathBuf>, SceneError> {
    let mut found = Vec::new();
    let mut pending = vec![folder.to_path_buf()];
    while let Some(folder) = pending.pop() {
        let unreadable = |source| SceneError::unreadable(&folder, source);
        for entry in std::fs::read_dir(&folder).map_err(unreadable)? {
            let entry = entry.map_err(unreadable)?;
            let path = entry.path();
            // Links to folders are not followed: they could form a loop.
            let kind = entry.file_type().map_err(unreadable)?;
            // A pipe would be waited for.
            let is_file = kind.is_file() || kind.is_symlink();
            let is_xml = path.extension().is_some_and(|extension| extension == "xml");
            if kind.is_dir() {
                pending.push(path);
            } else if is_file && (is_xml || (json::is_json(&path) && json::is_scene(&path))) {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}
