//! Fast mass-spring, as in the hand-out: a local step for each spring, then a global solve, for a number of rounds.
//!
//! ```text
//! Q p = b     Q = k AᵀA + M/h² + w CᵀC     b = k Aᵀd + M/h² y + w CᵀC p_rest + f     y = q + h v
//! d = l0 v/|v| with v = A p, of each spring; p = q at first; v' = (p − q)/h
//! ```
//!
//! In three dimensions; in the plane, z stays 0. `Q` is dense, and inverted once. Each round solves for the change of `p`,
//! from `b − Q p`, which keeps the digits of small changes. Pins that are eliminated have a row of the identity in `Q`, and
//! their place in `b`. A pin keeps its velocity, and its place moves with it. External forces are those at the start of the
//! step: the constant force and the wind by the formulas here, others by the `reference` crate.
//!
//! Source: hand-out "Computer Graphics – Mass-Spring Systems"; the wind is that of its program.

use nalgebra::DMatrix;
use reference::laws::Laws;
use scene::{ForceElement, Particle, Scene};

use super::{Coefficient, Motion, Vec3};

/// Arguments of the wind.
pub(crate) struct Gust {
    /// Where the particle is at the start of the step: its x over the diagonal of the box around all at the start of the run.
    pub(crate) place: f64,
    /// Where it was at the start of the run.
    pub(crate) start: f64,
    /// Time at the start of the step.
    pub(crate) time: f64,
    pub(crate) h: f64,
    pub(crate) mass: f64,
}

/// The formulas and rules of the method.
#[derive(Clone, Copy)]
pub(crate) struct FastMassSpring {
    /// Of `AᵀA`, the identity and `CᵀC` in `Q`; the quantities are stiffness, mass and weight.
    pub(crate) matrix: [Coefficient; 3],
    /// Of `Aᵀd`, `y`, `CᵀC p_rest` and `f` in `b`; the quantities are the same, and the mass for `f`.
    pub(crate) right: [Coefficient; 4],
    /// Entries of `A` for the ends of a spring.
    pub(crate) incidence: [f64; 2],
    /// `d`: `(v, l0)`.
    pub(crate) local: fn(Vec3, f64) -> Vec3,
    /// Number of rounds, from that of the scene.
    pub(crate) rounds: fn(u64) -> u64,
    /// `p` of the first local step: `(q, v, h)`.
    pub(crate) first: fn(Vec3, Vec3, f64) -> Vec3,
    /// `y`: `(q, v, h)`.
    pub(crate) ahead: fn(Vec3, Vec3, f64) -> Vec3,
    /// Where a penalty holds a pin: `(p_rest, q)`.
    pub(crate) pinned_at: fn(Vec3, Vec3) -> Vec3,
    /// The constant force: `(f, m)`.
    pub(crate) constant_force: fn(Vec3, f64) -> Vec3,
    /// The wind of strength 1.
    pub(crate) wind: fn(&Gust) -> Vec3,
    /// The new velocity: `(q, p, v, h)`.
    pub(crate) velocity: fn(Vec3, Vec3, Vec3, f64) -> Vec3,
}

impl FastMassSpring {
    pub(super) fn faultless() -> Self {
        let (quantity, inertia) = (Coefficient::new(1, 0), Coefficient::new(1, -2));
        Self {
            matrix: [quantity, inertia, quantity],
            right: [quantity, inertia, quantity, Coefficient::new(0, 0)],
            incidence: [1.0, -1.0],
            local: |v, l0| if l0 == 0.0 { Vec3::zeros() } else { l0 * v.normalize() },
            rounds: |rounds| rounds,
            first: |q, _, _| q,
            ahead: |q, v, h| q + h * v,
            pinned_at: |rest, _| rest,
            constant_force: |f, _| f,
            wind: |gust| wind(gust.place + gust.time),
            velocity: |q, p, _, h| (p - q) / h,
        }
    }
}

/// The wind of strength 1 at a phase.
pub(crate) fn wind(phi: f64) -> Vec3 {
    Vec3::new(3.0 + 1.5 * (1.0 + (5.0 * phi).cos()), 1.0 + (0.3 + phi).cos(), phi.sin())
}

struct Spring {
    ends: [usize; 2],
    l0: f64,
    /// Its coefficients in `Q` and `b`.
    of: [f64; 2],
}

/// The part of `b` that rounds leave alone, and the diagonal of `Q` without springs, of a particle.
struct Load {
    right: Vec3,
    diagonal: f64,
}

/// A motion by this method.
pub(super) struct Net {
    rules: FastMassSpring,
    scene: Scene,
    springs: Vec<Spring>,
    /// Of the forces without a formula here.
    laws: Laws,
    /// The diagonal of the box around all particles at the start.
    diagonal: f64,
    q: Vec<Vec3>,
    v: Vec<Vec3>,
    n_steps: u64,
    /// `w`, if pins are held by a penalty.
    weight: Option<f64>,
    inverse: DMatrix<f64>,
}

impl Net {
    pub(super) fn new(rules: FastMassSpring, scene: Scene) -> Self {
        let spring = |element| spring(rules, element, scene.time_step);
        let springs: Vec<Spring> = scene.forces.iter().filter_map(spring).collect();
        let options = &scene.integrator_options;
        let weight = (options.choice("pins") == "penalty").then(|| options.number("pin_weight"));
        let q: Vec<Vec3> =
            scene.particles.iter().map(|particle| particle.position.into()).collect();
        let others: Vec<ForceElement> = scene.forces.iter().filter_map(other).collect();
        Self {
            inverse: inverse(&matrix(rules, &scene, &springs, weight)),
            laws: Laws::of(&scene, &others),
            diagonal: diagonal(&q),
            q,
            v: scene.particles.iter().map(|particle| particle.velocity.into()).collect(),
            n_steps: 0,
            rules,
            springs,
            weight,
            scene,
        }
    }

    /// External forces at the start of the step.
    fn external(&self, time: f64) -> Vec<Vec3> {
        let dimension = self.scene.dimension.count();
        let [q, v] = self.state();
        let mut force = vec![Vec3::zeros(); self.q.len()];
        for (force, by_law) in force.iter_mut().zip(self.laws.force(&q, &v, time).chunks(dimension))
        {
            force.iter_mut().zip(by_law).for_each(|(force, by_law)| *force += by_law);
        }
        for element in &self.scene.forces {
            for (i, force) in force.iter_mut().enumerate() {
                let Particle { mass, position: [start, ..], .. } = self.scene.particles[i];
                *force += match element.schema.tag {
                    "constantforce" => {
                        let f = ["fx", "fy", "fz"].map(|name| element.parameter(name));
                        (self.rules.constant_force)(f.into(), mass)
                    }
                    "windforce" => {
                        let [place, start] = [self.q[i].x, start].map(|x| self.place(x));
                        let gust = Gust { place, start, time, h: self.scene.time_step, mass };
                        element.parameter("strength") * (self.rules.wind)(&gust)
                    }
                    _ => Vec3::zeros(),
                };
            }
        }
        for force in &mut force {
            force.as_mut_slice()[dimension..].fill(0.0);
        }
        force
    }

    /// An x in the wind.
    fn place(&self, x: f64) -> f64 {
        if self.diagonal == 0.0 { 0.0 } else { x / self.diagonal }
    }

    fn load(&self, i: usize, external: Vec3, time: f64) -> Load {
        let (h, rules) = (self.scene.time_step, self.rules);
        let Particle { mass, fixed, position, .. } = self.scene.particles[i];
        let ([_, inertia, pins], [_, ahead, places, force]) = (rules.matrix, rules.right);
        let y = (rules.ahead)(self.q[i], self.v[i], h);
        let mut load = Load {
            right: ahead.value(mass, h) * y + force.value(mass, h) * external,
            diagonal: inertia.value(mass, h),
        };
        if fixed {
            let rest = Vec3::from(position) + (time + h) * self.v[i];
            match self.weight {
                Some(weight) => {
                    let held = (rules.pinned_at)(rest, self.q[i]);
                    load.right += places.value(weight, h) * held;
                    load.diagonal += pins.value(weight, h);
                }
                None => load = Load { right: self.q[i] + h * self.v[i], diagonal: 1.0 },
            }
        }
        load
    }

    /// `b − Q p`.
    fn residual(&self, p: &[Vec3], loads: &[Load]) -> DMatrix<f64> {
        let row = |(p, load): (&Vec3, &Load)| load.right - load.diagonal * p;
        let mut rows: Vec<Vec3> = p.iter().zip(loads).map(row).collect();
        let [a, b] = self.rules.incidence;
        for Spring { ends: [i, j], l0, of: [in_matrix, in_right] } in &self.springs {
            let v = a * p[*i] + b * p[*j];
            let pull = *in_right * (self.rules.local)(v, *l0) - *in_matrix * v;
            for (end, sign) in [(*i, a), (*j, b)] {
                if !self.is_eliminated(end) {
                    rows[end] += sign * pull;
                }
            }
        }
        DMatrix::from_fn(p.len(), 3, |i, axis| rows[i][axis])
    }

    fn is_eliminated(&self, particle: usize) -> bool {
        self.weight.is_none() && self.scene.particles[particle].fixed
    }
}

impl Motion for Net {
    fn step(&mut self) {
        let (h, rules) = (self.scene.time_step, self.rules);
        let time = self.n_steps as f64 * h;
        let external = self.external(time);
        let loads: Vec<Load> = (0..self.q.len()).map(|i| self.load(i, external[i], time)).collect();
        let start = self.q.iter().zip(&self.v).map(|(q, v)| (rules.first)(*q, *v, h));
        let mut p: Vec<Vec3> = start.collect();
        let tolerance = self.scene.integrator_options.number("tolerance");
        for _ in 0..(rules.rounds)(self.scene.integrator_options.count("iterations")) {
            let change = &self.inverse * self.residual(&p, &loads);
            for (i, p) in p.iter_mut().enumerate() {
                *p += Vec3::from_fn(|axis, _| change[(i, axis)]);
            }
            if change.amax() / h < tolerance {
                break;
            }
        }
        for (i, _) in self.scene.particles.iter().enumerate().filter(|(_, p)| !p.fixed) {
            self.v[i] = (rules.velocity)(self.q[i], p[i], self.v[i], h);
        }
        self.q = p;
        self.n_steps += 1;
    }

    fn state(&self) -> [Vec<f64>; 2] {
        let dimension = self.scene.dimension.count();
        [&self.q, &self.v].map(|vectors| {
            vectors.iter().flat_map(|vector| vector.iter().take(dimension).copied()).collect()
        })
    }
}

/// `Q`.
fn matrix(
    rules: FastMassSpring,
    scene: &Scene,
    springs: &[Spring],
    weight: Option<f64>,
) -> DMatrix<f64> {
    let (h, n) = (scene.time_step, scene.particles.len());
    let [_, inertia, pins] = rules.matrix;
    let mut matrix = DMatrix::zeros(n, n);
    for Spring { ends, of: [stiffness, _], .. } in springs {
        for (row, a) in ends.iter().zip(rules.incidence) {
            for (column, b) in ends.iter().zip(rules.incidence) {
                matrix[(*row, *column)] += stiffness * a * b;
            }
        }
    }
    for (i, particle) in scene.particles.iter().enumerate() {
        matrix[(i, i)] += inertia.value(particle.mass, h);
        match weight {
            Some(weight) if particle.fixed => matrix[(i, i)] += pins.value(weight, h),
            None if particle.fixed => {
                matrix.row_mut(i).fill(0.0);
                matrix[(i, i)] = 1.0;
            }
            _ => {}
        }
    }
    matrix
}

/// The inverse, or a matrix of NaN if there is none.
fn inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let nonsense = || DMatrix::repeat(matrix.nrows(), matrix.ncols(), f64::NAN);
    matrix.clone().try_inverse().unwrap_or_else(nonsense)
}

fn spring(rules: FastMassSpring, element: &ForceElement, h: f64) -> Option<Spring> {
    let is_spring = element.schema.tag == "springforce";
    let ends = element.pair().filter(|_| is_spring)?;
    let of = [rules.matrix[0], rules.right[0]].map(|of| of.value(element.parameter("k"), h));
    Some(Spring { ends, l0: element.parameter("l0"), of })
}

/// The element without what has a formula here; `None` if nothing is left.
fn other(element: &ForceElement) -> Option<ForceElement> {
    let mut element = element.clone();
    match element.schema.tag {
        "constantforce" | "windforce" => return None,
        "springforce" if element.parameter("b") == 0.0 => return None,
        "springforce" => *element.parameter_mut("k") = 0.0,
        _ => {}
    }
    Some(element)
}

/// The diagonal of the box around all.
fn diagonal(q: &[Vec3]) -> f64 {
    let mut corners = [q[0], q[0]];
    for q in q {
        corners = [corners[0].inf(q), corners[1].sup(q)];
    }
    (corners[1] - corners[0]).norm()
}
