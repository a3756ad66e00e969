//! Mistakes that no single block shows, each with the properties that it violates.

use grader::white_box::{Property, Subject, simulated};
use reference::law::Jacobians;
use scene::Scene;
use simulator::force::{Coupling, Degenerate};

/// A mistake, and the properties that it violates.
pub(crate) struct Broken {
    pub(crate) force: &'static str,
    pub(crate) description: &'static str,
    pub(crate) breaks: &'static [Property],
    pub(crate) make: fn(Box<dyn Subject>, &Scene) -> Box<dyn Subject>,
}

pub(crate) fn all() -> Vec<Broken> {
    let broken = |force, description, breaks, make| Broken { force, description, breaks, make };
    vec![
        broken(
            "gravitationalforce",
            "a force twice as large, with the Jacobian that belongs to it",
            &[Property::Force, Property::Gradient, Property::Hessian],
            |inner, _| Box::new(Scaled { inner, force: 2.0, jacobians: 2.0, energy: 1.0 }),
        ),
        broken(
            "springforce",
            "force and Jacobian off by a millionth",
            &[Property::Force, Property::Gradient, Property::Hessian],
            |inner, _| {
                let factor = 1.0 + 1e-6;
                Box::new(Scaled { inner, force: factor, jacobians: factor, energy: 1.0 })
            },
        ),
        broken(
            "greenspringforce",
            "an energy twice as large",
            &[Property::Gradient, Property::Hessian],
            |inner, _| Box::new(Scaled { inner, force: 1.0, jacobians: 1.0, energy: 2.0 }),
        ),
        broken(
            "constantforce",
            "an energy of the wrong sign",
            &[Property::Gradient],
            |inner, _| Box::new(Scaled { inner, force: 1.0, jacobians: 1.0, energy: -1.0 }),
        ),
        broken("vortexforce", "said to be symmetric", &[Property::Symmetry], |inner, _| {
            Box::new(Claims { inner, claim: symmetric })
        }),
        broken("springforce", "couplings left out", &[Property::Stencil], |inner, _| {
            Box::new(Claims { inner, claim: |_| None })
        }),
        broken(
            "springforce",
            "couplings of a pair said to be of single particles",
            &[Property::Symmetry, Property::Stencil],
            |inner, _| {
                Box::new(Claims {
                    inner,
                    claim: |coupling| match coupling {
                        Coupling::Stencil { particles, .. } => {
                            Some(Coupling::Diagonal(particles[0]))
                        }
                        other => Some(other),
                    },
                })
            },
        ),
        broken(
            "gravitationalforce",
            "stretched along x, with the Jacobian that belongs to it",
            &[Property::Force, Property::Rotation, Property::Gradient, Property::Hessian],
            |inner, scene| Box::new(Stretched { inner, dimension: scene.dimension.count() }),
        ),
    ]
}

fn symmetric(coupling: Coupling) -> Option<Coupling> {
    match coupling {
        Coupling::Stencil { particles, .. } => {
            Some(Coupling::Stencil { particles, symmetric: true })
        }
        other => Some(other),
    }
}

/// Everything times a factor.
struct Scaled {
    inner: Box<dyn Subject>,
    force: f64,
    jacobians: f64,
    energy: f64,
}

impl Subject for Scaled {
    fn force(&self, x: &[f64], v: &[f64], time: f64, force: &mut [f64]) -> Result<(), Degenerate> {
        self.inner.force(x, v, time, force)?;
        force.iter_mut().for_each(|component| *component *= self.force);
        Ok(())
    }

    fn jacobians(&self, x: &[f64], v: &[f64], time: f64) -> Result<Jacobians, Degenerate> {
        let mut jacobians = self.inner.jacobians(x, v, time)?;
        jacobians.by_position *= self.jacobians;
        jacobians.by_velocity *= self.jacobians;
        Ok(jacobians)
    }

    fn energy(&self, x: &[f64], v: &[f64], time: f64) -> Option<f64> {
        self.inner.energy(x, v, time).map(|energy| energy * self.energy)
    }

    fn couplings(&self) -> Vec<Coupling> {
        self.inner.couplings()
    }
}

/// A subject that claims other couplings.
struct Claims {
    inner: Box<dyn Subject>,
    claim: fn(Coupling) -> Option<Coupling>,
}

impl Subject for Claims {
    fn force(&self, x: &[f64], v: &[f64], time: f64, force: &mut [f64]) -> Result<(), Degenerate> {
        self.inner.force(x, v, time, force)
    }

    fn jacobians(&self, x: &[f64], v: &[f64], time: f64) -> Result<Jacobians, Degenerate> {
        self.inner.jacobians(x, v, time)
    }

    fn energy(&self, x: &[f64], v: &[f64], time: f64) -> Option<f64> {
        self.inner.energy(x, v, time)
    }

    fn couplings(&self) -> Vec<Coupling> {
        self.inner.couplings().into_iter().filter_map(self.claim).collect()
    }
}

/// Space is stretched along x, by `S = diag(2, 1, …)`: `F' = S F(S x)` has the Jacobian `S K S`, exactly.
struct Stretched {
    inner: Box<dyn Subject>,
    dimension: usize,
}

impl Stretched {
    fn factor(&self, place: usize) -> f64 {
        if place.is_multiple_of(self.dimension) { 2.0 } else { 1.0 }
    }

    fn stretched(&self, values: &[f64]) -> Vec<f64> {
        values.iter().enumerate().map(|(place, value)| value * self.factor(place)).collect()
    }
}

impl Subject for Stretched {
    fn force(&self, x: &[f64], v: &[f64], time: f64, force: &mut [f64]) -> Result<(), Degenerate> {
        self.inner.force(&self.stretched(x), &self.stretched(v), time, force)?;
        force.copy_from_slice(&self.stretched(force));
        Ok(())
    }

    fn jacobians(&self, x: &[f64], v: &[f64], time: f64) -> Result<Jacobians, Degenerate> {
        let mut jacobians = self.inner.jacobians(&self.stretched(x), &self.stretched(v), time)?;
        for matrix in [&mut jacobians.by_position, &mut jacobians.by_velocity] {
            for row in 0..matrix.nrows() {
                for column in 0..matrix.ncols() {
                    matrix[(row, column)] *= self.factor(row) * self.factor(column);
                }
            }
        }
        Ok(jacobians)
    }

    fn energy(&self, x: &[f64], v: &[f64], time: f64) -> Option<f64> {
        // This is not the energy of this force.
        self.inner.energy(x, v, time)
    }

    fn couplings(&self) -> Vec<Coupling> {
        self.inner.couplings()
    }
}

/// The simulator's force with a kink at the checked state: `max(x₀ − x₀(0), 0)` on particle 0.
pub(crate) struct Kinked {
    inner: Box<dyn Subject>,
    start: f64,
}

impl Kinked {
    pub(crate) fn new(scene: &Scene) -> Self {
        Self { inner: simulated(scene), start: scene.particles[0].position[0] }
    }
}

impl Subject for Kinked {
    fn force(&self, x: &[f64], v: &[f64], time: f64, force: &mut [f64]) -> Result<(), Degenerate> {
        self.inner.force(x, v, time, force)?;
        force[0] += (x[0] - self.start).max(0.0);
        Ok(())
    }

    fn jacobians(&self, x: &[f64], v: &[f64], time: f64) -> Result<Jacobians, Degenerate> {
        self.inner.jacobians(x, v, time)
    }

    fn energy(&self, _: &[f64], _: &[f64], _: f64) -> Option<f64> {
        None
    }

    fn couplings(&self) -> Vec<Coupling> {
        self.inner.couplings()
    }
}

/// A force that is defined nowhere.
pub(crate) struct Undefined;

impl Subject for Undefined {
    fn force(&self, _: &[f64], _: &[f64], _: f64, _: &mut [f64]) -> Result<(), Degenerate> {
        Err(Degenerate { element: 0, particles: [0, 1].into() })
    }

    fn jacobians(&self, _: &[f64], _: &[f64], _: f64) -> Result<Jacobians, Degenerate> {
        Err(Degenerate { element: 0, particles: [0, 1].into() })
    }

    fn energy(&self, _: &[f64], _: &[f64], _: f64) -> Option<f64> {
        None
    }

    fn couplings(&self) -> Vec<Coupling> {
        Vec::new()
    }
}
