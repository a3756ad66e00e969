//! A scene during parsing, before references are resolved.

use smallvec::SmallVec;

use crate::schema::{ForceSchema, IntegratorOptions};
use crate::{Color, Location, Parameters, Particle, Viewport};

/// The elements read so far. References by number keep the attribute they came from.
#[derive(Default)]
pub(super) struct UnresolvedScene {
    pub(super) description: Once<String>,
    pub(super) tag: Once<String>,
    pub(super) duration: Once<f64>,
    pub(super) integrator: Once<UnresolvedIntegrator>,
    pub(super) max_simulation_frequency: Once<f64>,
    pub(super) viewport: Once<Viewport>,
    pub(super) background: Once<Color>,
    pub(super) particles: Vec<Particle>,
    pub(super) three_dimensional: bool,
    pub(super) edges: Vec<([Reference; 2], f64)>,
    pub(super) forces: Vec<UnresolvedForce>,
    pub(super) particle_colors: Vec<(Reference, Color)>,
    pub(super) edge_colors: Vec<(Reference, Color)>,
    pub(super) particle_paths: Vec<(Reference, f64, Color)>,
}

pub(super) struct UnresolvedIntegrator {
    pub(super) spelling: String,
    pub(super) type_offset: usize,
    pub(super) time_step: f64,
    /// Of the integrator that the spelling names; `None` if it names none.
    pub(super) options: Option<IntegratorOptions>,
}

/// A coordinate that the file leaves out. No file holds this number.
pub(super) const FROM_INITIAL: f64 = f64::NAN;

pub(super) struct UnresolvedForce {
    pub(super) schema: &'static ForceSchema,
    /// References to the particles or the edge of its stencil.
    pub(super) stencil: SmallVec<[Reference; 2]>,
    /// [`FROM_INITIAL`] where the particle's initial position is to be taken.
    pub(super) parameters: Parameters,
    pub(super) location: Location,
}

/// A reference to a particle or an edge, with its place in the text.
#[derive(Clone, Copy)]
pub(super) struct Reference {
    pub(super) index: usize,
    pub(super) tag: &'static str,
    pub(super) attribute: &'static str,
    pub(super) offset: usize,
}

/// The value of an element that may occur once, with its place.
pub(super) struct Once<T>(pub(super) Option<(T, Location)>);

impl<T> Default for Once<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T> Once<T> {
    pub(super) fn into_value(self) -> Option<T> {
        self.0.map(|(value, _)| value)
    }
}
