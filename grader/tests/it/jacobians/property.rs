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
            |inner, _| Changed::scaled(inner, [2.0, 2.0, 1.0]),
        ),
        broken(
            "springforce",
            "force and Jacobian off by a millionth",
            &[Property::Force, Property::Gradient, Property::Hessian],
            |inner, _| Changed::scaled(inner, [1.0 + 1e-6, 1.0 + 1e-6, 1.0]),
        ),
        broken(
            "greenspringforce",
            "an energy twice as large",
            &[Property::Gradient, Property::Hessian],
            |inner, _| Changed::scaled(inner, [1.0, 1.0, 2.0]),
        ),
        broken(
            "constantforce",
            "an energy of the wrong sign",
            &[Property::Gradient],
            |inner, _| Changed::scaled(inner, [1.0, 1.0, -1.0]),
        ),
        broken("vortexforce", "said to be symmetric", &[Property::Symmetry], |inner, _| {
            Changed::claiming(inner, symmetric)
        }),
        broken("springforce", "couplings left out", &[Property::Stencil], |inner, _| {
            Changed::claiming(inner, |_| None)
        }),
        broken(
            "springforce",
            "couplings of a pair said to be of single particles",
            &[Property::Symmetry, Property::Stencil],
            |inner, _| {
                Changed::claiming(inner, |coupling| match coupling {
                    Coupling::Stencil { particles, .. } => Some(Coupling::Diagonal(particles[0])),
                    other => Some(other),
                })
            },
        ),
        broken(
            "gravitationalforce",
            "stretched along x, with the Jacobian that belongs to it",
            &[Property::Force, Property::Rotation, Property::Gradient, Property::Hessian],
            |inner, scene| {
                let stretched = Some(scene.dimension.count());
                Box::new(Changed { stretched, ..Changed::new(inner) })
            },
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

/// The simulator's force with changes. Space may be stretched along x, by `S = diag(2, 1, …)`: `F' = S F(S x)` has the
/// Jacobian `S K S`, exactly; its energy stays that of `F`.
struct Changed {
    inner: Box<dyn Subject>,
    /// Factors of the force, its Jacobians and its energy.
    factors: [f64; 3],
    /// The couplings that it states in the place of the simulator's.
    claim: fn(Coupling) -> Option<Coupling>,
    /// Dimension of the stretched space.
    stretched: Option<usize>,
}

impl Changed {
    fn new(inner: Box<dyn Subject>) -> Self {
        Self { inner, factors: [1.0; 3], claim: Some, stretched: None }
    }

    fn scaled(inner: Box<dyn Subject>, factors: [f64; 3]) -> Box<dyn Subject> {
        Box::new(Self { factors, ..Self::new(inner) })
    }

    fn claiming(
        inner: Box<dyn Subject>,
        claim: fn(Coupling) -> Option<Coupling>,
    ) -> Box<dyn Subject> {
        Box::new(Self { claim, ..Self::new(inner) })
    }

    fn factor(&self, place: usize) -> f64 {
        let is_x = self.stretched.is_some_and(|dimension| place.is_multiple_of(dimension));
        if is_x { 2.0 } else { 1.0 }
    }

    fn stretched(&self, values: &[f64]) -> Vec<f64> {
        values.iter().enumerate().map(|(place, value)| value * self.factor(place)).collect()
    }
}

impl Subject for Changed {
    fn force(&self, x: &[f64], v: &[f64], time: f64, force: &mut [f64]) -> Result<(), Degenerate> {
        self.inner.force(&self.stretched(x), &self.stretched(v), time, force)?;
        force.copy_from_slice(&self.stretched(force));
        force.iter_mut().for_each(|component| *component *= self.factors[0]);
        Ok(())
    }

    fn jacobians(&self, x: &[f64], v: &[f64], time: f64) -> Result<Jacobians, Degenerate> {
        let mut jacobians = self.inner.jacobians(&self.stretched(x), &self.stretched(v), time)?;
        let size = x.len();
        for matrix in [&mut jacobians.by_position, &mut jacobians.by_velocity] {
            for (row, column) in
                (0..size).flat_map(|row| (0..size).map(move |column| (row, column)))
            {
                matrix[(row, column)] *= self.factors[1] * self.factor(row) * self.factor(column);
            }
        }
        Ok(jacobians)
    }

    fn energy(&self, x: &[f64], v: &[f64], time: f64) -> Option<f64> {
        self.inner.energy(x, v, time).map(|energy| energy * self.factors[2])
    }

    fn couplings(&self) -> Vec<Coupling> {
        self.inner.couplings().into_iter().filter_map(self.claim).collect()
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
