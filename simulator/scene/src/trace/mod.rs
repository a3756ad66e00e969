//! Reads and writes traces, one state at a time: memory does not grow with the length of a trace.
//!
//! A trace holds the initial state and one state after every step.

pub mod csv;
pub mod energy;
pub mod fosssim;

mod derived;

use std::io;
use std::path::{Path, PathBuf};

use crate::schema::StepEquation;
use crate::state::StateView;
use crate::{Dimension, Scene};

/// How many numbers a state has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// Coordinates of a particle.
    pub dimension: Dimension,
    /// Particles.
    pub n_particles: usize,
}

impl Shape {
    /// The shape of the states of `scene`.
    pub fn of(scene: &Scene) -> Self {
        Self { dimension: scene.dimension, n_particles: scene.particles.len() }
    }

    /// Numbers in the positions of a state, and as many in its velocities.
    pub fn n_coordinates(self) -> usize {
        self.dimension.count() * self.n_particles
    }
}

/// A trace's file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TraceFormat {
    /// Comma-separated text, one row a state.
    Csv,
    /// FOSSSim's raw little-endian f64.
    Fosssim,
}

impl TraceFormat {
    /// Every format.
    pub const ALL: [Self; 2] = [Self::Csv, Self::Fosssim];

    /// Its name on a command line, where its extension stands for it too.
    pub fn name(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Fosssim => "fosssim",
        }
    }

    /// Its description.
    pub fn summary(self) -> &'static str {
        match self {
            Self::Csv => "Comma-separated text, one row a state",
            Self::Fosssim => "FOSSSim's raw little-endian f64",
        }
    }

    /// The extension of its files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Fosssim => "bin",
        }
    }

    /// The format that the extension of `path` names.
    pub fn of_path(path: &Path) -> Option<Self> {
        let extension = path.extension()?;
        Self::ALL.into_iter().find(|format| extension == format.extension())
    }
}

/// A state of a trace.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Time in seconds, if the format stores it.
    pub time: Option<f64>,
    /// Positions, `n·D`, particle-major.
    pub positions: Vec<f64>,
    /// Velocities, the same shape.
    pub velocities: Vec<f64>,
}

impl State {
    /// A state of this shape, all zero.
    pub fn zeros(shape: Shape) -> Self {
        let zeros = vec![0.0; shape.n_coordinates()];
        Self { time: None, positions: zeros.clone(), velocities: zeros }
    }
}

/// A sink of states.
pub trait TraceWriter {
    /// Writes the next state.
    ///
    /// # Errors
    /// If writing fails.
    fn write(&mut self, state: StateView<'_>) -> io::Result<()>;
}

/// A source of states.
pub trait TraceReader: Send {
    /// Reads the next state into `state`. Returns false at the end of the trace.
    ///
    /// # Errors
    /// If the trace cannot be read, or does not continue with a state of the expected shape.
    fn read(&mut self, state: &mut State) -> Result<bool, TraceError>;

    /// Whether the trace holds velocities. Otherwise they are derived from positions, if the reader does so, or 0.
    fn has_velocities(&self) -> bool {
        true
    }
}

/// Opens the trace at `path` for reading.
///
/// # Errors
/// If it cannot be opened, or its first lines are not those of such a trace.
pub fn open(
    path: &Path,
    format: TraceFormat,
    shape: Shape,
) -> Result<Box<dyn TraceReader>, TraceError> {
    let file = crate::input::open(path)
        .map_err(|source| TraceError::Unreadable { path: path.to_path_buf(), source })?;
    Ok(match format {
        TraceFormat::Csv => Box::new(csv::CsvReader::new(file, path, shape)?),
        TraceFormat::Fosssim => Box::new(fosssim::FosssimReader::new(file, path, shape)),
    })
}

/// Opens the trace of `scene` at `path`. If the scene's method computes no velocities, as the local-global
/// solver, rows of a CSV file may hold positions alone; velocities are then differences of positions.
///
/// # Errors
/// As [`open`].
pub fn open_of_scene(
    path: &Path,
    format: TraceFormat,
    scene: &Scene,
) -> Result<Box<dyn TraceReader>, TraceError> {
    let shape = Shape::of(scene);
    let is_optional = scene.integrator.equation == StepEquation::LocalGlobal;
    if format != TraceFormat::Csv || !is_optional {
        return open(path, format, shape);
    }
    let file = crate::input::open(path)
        .map_err(|source| TraceError::Unreadable { path: path.to_path_buf(), source })?;
    let reader = csv::CsvReader::with_optional_velocities(file, path, shape)?;
    Ok(if reader.has_velocities() {
        Box::new(reader)
    } else {
        Box::new(derived::DerivedVelocities::new(reader, scene))
    })
}

/// A trace that cannot be read.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what the variants and their fields are")]
pub enum TraceError {
    #[error("{}: cannot be read: {source}", path.display())]
    Unreadable { path: PathBuf, source: io::Error },
    #[error("{}:{line}: {fault}", path.display())]
    Line { path: PathBuf, line: u64, fault: TraceFault },
    #[error("{}: record {record}: {fault}", path.display())]
    Record { path: PathBuf, record: u64, fault: TraceFault },
}

/// A fault in the content of a trace.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say what the variants and their fields are")]
pub enum TraceFault {
    #[error("there is no header line; it starts with `{expected}`")]
    NoHeader { expected: String },
    #[error("column {column} of the header is {found:?}, not {expected:?}")]
    Header { column: usize, expected: String, found: String },
    #[error("the number of columns in the header is {found}, not {expected}: {header:?}")]
    HeaderLength { expected: usize, found: usize, header: String },
    #[error("the number of fields is {found}, not {expected}")]
    RowLength { expected: usize, found: usize },
    #[error("column {column}: {text:?} is not a number")]
    NotANumber { column: String, text: String },
    #[error("the step is {found:?} where {expected} comes next")]
    StepOrder { expected: u64, found: String },
    #[error("the line is longer than {limit} bytes")]
    LineTooLong { limit: usize },
    #[error("the file ends after {found} of the record's {expected} bytes")]
    PartialRecord { expected: usize, found: usize },
}

impl TraceFault {
    /// Whether the first row has step 1.
    pub fn starts_at_one(&self) -> bool {
        matches!(self, Self::StepOrder { expected: 0, found } if found == "1")
    }
}
