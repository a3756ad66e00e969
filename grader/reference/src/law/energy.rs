//! Energies of the laws that have one, with `f_a = −∂U/∂x_a`, `l = |x_i − x_j|` and the parameters at the time.
//!
//! ```text
//! simple gravity  −m g·x      spring, scripted, elastic  ½ k (l − l0)²             of three or more particles: as in
//! constant force  −F·x        green spring               ½ k l0² (l²/l0² − 1)²     stencil.rs, material.rs and solid.rs
//!                             gravitation                −G m_i m_j / l
//! ```

use super::{At, Expectation, Form, Law, difference, dot, material, named, norm, solid, stencil};

/// Energy of a stencil, by parameters and particles.
type EnergyLaw = fn(&[f64], &[At<'_, f64>]) -> f64;

/// The energies by the tags of their forces.
static ENERGIES: &[(&str, EnergyLaw)] = &[
    ("simplegravity", |p, at| at[0].mass * constant_force(p, at)),
    ("constantforce", constant_force),
    ("springforce", spring),
    ("scriptedspringforce", spring),
    ("elasticbodyspringforce", spring),
    ("gravitationalforce", gravitation),
    ("greenspringforce", green_spring),
    ("elasticbodybendingforce", |p, at| stencil::bending_energy(p, at, &positions(at))),
    ("elasticbodycstforce", |p, at| stencil::triangle_energy(p, at, &positions(at))),
    ("stvktriangle", |p, at| material::st_venant_kirchhoff_energy(p, at, &positions(at))),
    ("corotatedtriangle", |p, at| material::corotated_energy(p, at, &positions(at))),
    ("neohookeantriangle", |p, at| material::neo_hookean_energy(p, at, &positions(at))),
    ("stvktetrahedron", |p, at| solid::st_venant_kirchhoff_energy(p, &positions(at))),
    ("corotatedtetrahedron", |p, at| solid::corotated_energy(p, &positions(at))),
    ("hingebendingforce", |p, at| stencil::hinge_energy(p, at, &positions(at))),
    ("neohookeantetrahedron", |p, at| solid::neo_hookean_energy(p, &positions(at))),
];

impl Expectation<'_> {
    /// The energy of all elements; `None` if the law has none.
    pub fn energy(&self, x: &[f64], v: &[f64], time: f64) -> Option<f64> {
        let (_, energy) = ENERGIES.iter().find(|(tag, _)| *tag == self.law.tag)?;
        let of_stencil = |stencil: &super::Stencil<'_>| {
            energy(
                &self.law.parameters_at(&stencil.element.parameters, time),
                &self.all_at(stencil, x, v, time),
            )
        };
        Some(self.stencils.iter().map(of_stencil).sum())
    }
}

impl Law {
    fn parameters_at(&self, parameters: &[f64], time: f64) -> scene::Parameters {
        match self.form {
            Form::Pair { at, .. } => at(parameters, time),
            Form::Field { .. } | Form::Stencil { .. } => parameters.into(),
        }
    }
}

fn positions(at: &[At<'_, f64>]) -> Vec<super::Vector<f64>> {
    at.iter().map(|at| at.position).collect()
}

fn constant_force(p: &[f64], at: &[At<'_, f64>]) -> f64 {
    -dot(named(p), at[0].position)
}

fn length(at: &[At<'_, f64>]) -> f64 {
    norm(&difference(&at[0].position, &at[1].position))
}

fn spring(p: &[f64], at: &[At<'_, f64>]) -> f64 {
    let [k, l0, _] = named(p);
    0.5 * k * (length(at) - l0).powi(2)
}

fn gravitation(p: &[f64], at: &[At<'_, f64>]) -> f64 {
    let [g] = named(p);
    -g * at[0].mass * at[1].mass / length(at)
}

fn green_spring(p: &[f64], at: &[At<'_, f64>]) -> f64 {
    let [k, l0] = named(p);
    0.5 * k * l0 * l0 * ((length(at) / l0).powi(2) - 1.0).powi(2)
}
