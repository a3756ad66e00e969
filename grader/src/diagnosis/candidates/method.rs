//! Candidates: another method, Newton's method ended early, fixed particles, other evaluation points.

use nalgebra::DVector;
use simulator::scene::ForceElement;

use super::{Culprit, Prepared, Trial, Vectors, exactly, factor};
use crate::diagnosis::physics::{Method, Point};
use crate::diagnosis::steps::Sample;

impl Trial<'_> {
    /// Mistakes in the method itself.
    pub(super) fn integrator(&mut self) {
        let (h, method) = (self.physics.h, self.physics.method);
        let culprit = Culprit::Integrator;
        let sum = |step: &Prepared| {
            step.terms.iter().map(|parts| self.effective(parts, &step.delta)).sum::<DVector<f64>>()
        };
        if self.terms.is_empty() {
            return;
        }
        let whole = self.each(sum);
        self.try_factor(&whole, culprit, |c| factor("the sum of all forces", c, h));
        if method == Method::Linearized {
            let alone = self
                .each(|step| step.terms.iter().map(|parts| &parts.force * h).sum::<DVector<f64>>());
            self.try_factor(&alone, culprit, |c| factor("the right-hand side", c, h));
        }
        self.forces_of_fixed();
        let physics = self.physics;
        let forces = |step: &Prepared| {
            step.terms.iter().map(|parts| parts.force.clone()).sum::<DVector<f64>>()
        };
        let by_mass = |vector: DVector<f64>| physics.momentum(&vector);
        let massless = self.each(|step| &step.residual - by_mass(step.delta.clone()) + &step.delta);
        self.try_rest(&massless, culprit, "the mass is missing".to_owned());
        let multiplied = self.each(|step| &step.delta - by_mass(forces(step)) * h);
        if self.physics.is_implicit() {
            self.jacobians_of_all();
            self.newton();
        } else {
            self.try_rest(&multiplied, culprit, "forces are multiplied by the mass".to_owned());
        }
        self.places();
    }

    /// Forces between a fixed and a free particle.
    pub(super) fn forces_of_fixed(&mut self) {
        let scene = self.physics.scene;
        let is_held = |element: &&ForceElement| {
            element.pair.is_some_and(|pair| pair.iter().any(|&each| scene.particles[each].fixed))
        };
        let held: Vec<ForceElement> = scene.forces.iter().filter(is_held).cloned().collect();
        if held.is_empty() {
            return;
        }
        let g = self.each(|step| self.effective(&self.parts(&held, &step.at), &step.delta));
        self.try_factor(&g, Culprit::Fixed, |c| {
            exactly("the force between a fixed and a free particle", c)
        });
    }

    /// Newton's method ended early.
    pub(super) fn newton(&mut self) {
        const MOST: usize = 4;
        if self.physics.method != Method::Implicit {
            return;
        }
        let all: Vec<Vec<Vec<f64>>> =
            self.samples.iter().map(|sample| self.physics.newton(sample, MOST)).collect();
        for made in 1..=MOST {
            let rest: Option<Vectors> = self
                .samples
                .iter()
                .zip(&all)
                .map(|(sample, iterates)| {
                    let iterate = DVector::from_vec(iterates.get(made - 1)?.clone());
                    let new = DVector::from_vec(sample.after.velocities.clone());
                    Some(self.physics.free(self.physics.momentum(&(new - iterate))))
                })
                .collect();
            if let Some(rest) = rest {
                let times = if made == 1 { "iteration" } else { "iterations" };
                let words = format!("Newton's method ends after {made} {times}");
                self.try_rest(&rest, Culprit::Integrator, words);
            }
        }
    }

    /// Forces evaluated at another point.
    pub(super) fn places(&mut self) {
        let physics = self.physics;
        let h = physics.h;
        let elements = &physics.scene.forces;
        let momentum = |step: &Prepared| physics.momentum(&step.delta);
        let time = |sample: &Sample| sample.step as f64 * h;
        let old = |sample: &Sample, time: f64| Point {
            x: sample.before.positions.clone(),
            v: sample.before.velocities.clone(),
            time,
        };
        let mut found: Vec<(&str, Culprit, Vectors)> = Vec::new();
        let mut add = |words, culprit, of: &dyn Fn(&Sample, &Prepared) -> DVector<f64>| {
            let steps = self.samples.iter().zip(&self.prepared);
            let rest = steps.map(|(sample, step)| physics.free(of(sample, step))).collect();
            found.push((words, culprit, rest));
        };
        let integrator = Culprit::Integrator;
        match physics.method {
            Method::Explicit | Method::Symplectic => {
                add("forces are evaluated at q + h v", integrator, &|sample, step| {
                    let mut at = old(sample, time(sample));
                    at.x = physics.along(&at.x, &at.v);
                    momentum(step) - physics.force(elements, &at) * h
                });
            }
            Method::Linearized => {
                let with = |force: &Point, jacobians: &Point, step: &Prepared| {
                    let (k, b) = physics.jacobians(elements, jacobians);
                    let matrix = (k * &step.delta) * (h * h) + (b * &step.delta) * h;
                    momentum(step) - physics.force(elements, force) * h - matrix
                };
                add(
                    "forces and Jacobians are evaluated at q, not q + h v",
                    integrator,
                    &|sample, step| {
                        let at = old(sample, time(sample) + h);
                        with(&at, &at, step)
                    },
                );
                add("forces are evaluated at q, not q + h v", integrator, &|sample, step| {
                    with(&old(sample, time(sample) + h), &step.at, step)
                });
                add("Jacobians are evaluated at q, not q + h v", integrator, &|sample, step| {
                    with(&step.at, &old(sample, time(sample) + h), step)
                });
            }
            Method::Implicit => {
                add("forces are evaluated at q, not q + h v'", integrator, &|sample, step| {
                    let mut at = old(sample, time(sample) + h);
                    at.v.clone_from(&sample.after.velocities);
                    momentum(step) - physics.force(elements, &at) * h
                });
            }
        }
        if physics.is_implicit() && physics.fixed.contains(&true) {
            let words = "forces use the old positions of fixed particles, not the new ones";
            add(words, Culprit::Fixed, &|sample, step| {
                let mut at =
                    Point { x: step.at.x.clone(), v: step.at.v.clone(), time: step.at.time };
                for (dof, x) in at.x.iter_mut().enumerate().filter(|(dof, _)| physics.fixed[*dof]) {
                    *x = sample.before.positions[dof];
                }
                let force = momentum(step) - physics.force(elements, &at) * h;
                if physics.method == Method::Implicit {
                    return force;
                }
                let (k, b) = physics.jacobians(elements, &at);
                force - (k * &step.delta) * (h * h) - (b * &step.delta) * h
            });
        }
        for (words, culprit, rest) in found {
            self.try_rest(&rest, culprit, words.to_owned());
        }
    }
}
