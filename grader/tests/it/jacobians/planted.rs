//! A subject with a planted mistake or variant.

use grader::white_box::{BlockKind, By, Part, Subject, simulated};
use reference::law::Jacobians;
use scene::Scene;
use simulator::force::{Coupling, Degenerate};

use super::element::{Blocks, Element, assemble};

/// The planted change.
#[derive(Clone, Copy)]
pub(crate) enum Plant {
    /// Another law for every element.
    Law(fn(&Element) -> Blocks),
    /// A change to the simulator's Jacobians.
    After(fn(&Moment<'_>, &mut Jacobians)),
}

/// The inputs of a planted change.
pub(crate) struct Moment<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) x: &'a [f64],
    pub(crate) v: &'a [f64],
    pub(crate) dimension: usize,
}

/// The simulator's force with changed Jacobians.
pub(crate) struct Planted {
    inner: Box<dyn Subject>,
    scene: Scene,
    plant: Plant,
}

impl Planted {
    pub(crate) fn new(scene: &Scene, plant: Plant) -> Self {
        Self { inner: simulated(scene), scene: scene.clone(), plant }
    }
}

impl Subject for Planted {
    fn force(&self, x: &[f64], v: &[f64], time: f64, force: &mut [f64]) -> Result<(), Degenerate> {
        self.inner.force(x, v, time, force)
    }

    fn jacobians(&self, x: &[f64], v: &[f64], time: f64) -> Result<Jacobians, Degenerate> {
        match self.plant {
            Plant::Law(law) => Ok(assemble(&self.scene, x, v, law)),
            Plant::After(change) => {
                let mut jacobians = self.inner.jacobians(x, v, time)?;
                let dimension = self.scene.dimension.count();
                change(&Moment { scene: &self.scene, x, v, dimension }, &mut jacobians);
                Ok(jacobians)
            }
        }
    }

    fn energy(&self, x: &[f64], v: &[f64], time: f64) -> Option<f64> {
        self.inner.energy(x, v, time)
    }

    fn couplings(&self) -> Vec<Coupling> {
        self.inner.couplings()
    }
}

const fn kind(by: By, part: Part) -> BlockKind {
    BlockKind { by, part }
}

pub(crate) const XD: BlockKind = kind(By::Position, Part::Direct);
pub(crate) const XC: BlockKind = kind(By::Position, Part::Cross);
pub(crate) const VD: BlockKind = kind(By::Velocity, Part::Direct);
pub(crate) const VC: BlockKind = kind(By::Velocity, Part::Cross);
