//! Second simulator, written from the hand-outs alone like a student's: two dimensions, dense matrices over all
//! particles, fixed particles held by clearing rows and columns. Fast mass-spring is a separate program, in three
//! dimensions.
//!
//! It shares only the parsed scene with the simulator crate: no force, Jacobian, integrator or solver. Every formula
//! and rule is a field of [`Student`], so that a mistake replaces one field and the code here stays correct.
//!
//! ```text
//! explicit, symplectic    v' = v + h F(q, v)/m                      q' = q + h v  or  q + h v'
//! linearized, implicit    (M − h² ∂F/∂q − h ∂F/∂v) δ = −M (u − v) + h F(q + h u, u),  u ← u + δ
//! projected Newton        student/projected_newton.rs
//! elastic bodies          student/elastic.rs
//! those in space          student/space.rs, by the same methods without deviations
//! fast mass-spring        student/fast_mass_spring.rs
//! ```
//!
//! A force or an explicit method that has no formula here is computed by the `reference` crate's law or substeps, in
//! the student's own loop; `Others` holds the mistakes made with them.
//!
//! Sources: hand-out of milestone 2, section 3; of milestone 3, sections 5 to 10; the course's
//! definition of the vortex force, of which the Jacobians are derived by hand; the hand-out on elastic bodies; the lecture on
//! elastodynamics; the hand-out on fast mass-spring systems.

mod elastic;
mod fast_mass_spring;
mod projected_newton;
mod space;

use std::ops::Index;

use nalgebra::{DMatrix, DVector, Matrix2, Vector2, Vector3};
use reference::laws::Laws;
use reference::method::{Method, Substep, Tableau};
use scene::schema::{Family, StepEquation};
use scene::trace::State;
use scene::{Dimension, ForceElement, Particle, Scene};

use grader::submission::StateSource;
use grader::verdict::Failure;

pub(crate) use elastic::{Hinge, NineBlocks, Three, Triangle, cross, path_length};
pub(crate) use fast_mass_spring::{FastMassSpring, wind};
pub(crate) use projected_newton::{ProjectedNewton, largest, largest_row};
pub use space::knows_in_space;
pub(crate) use space::{
    Fold, Gradient, Lame, Simplex, Solids, Square, area, cofactors, corotated_stress,
    damping_change, damping_stress, polar, rotation_along, second_stress, strain, strain_along,
};

pub(crate) type Vec2 = Vector2<f64>;
pub(crate) type Vec3 = Vector3<f64>;
pub(crate) type Mat2 = Matrix2<f64>;

/// Blocks of a matrix for the particles i and j.
pub(crate) type Blocks = [[Mat2; 2]; 2];

/// Parameters of a force element, by their attributes: `p["k"]`.
pub(crate) struct Parameters(ForceElement);

impl Index<&str> for Parameters {
    type Output = f64;

    fn index(&self, name: &str) -> &f64 {
        &self.0.parameters[self.0.schema.parameter_idx(name)]
    }
}

/// Maximum number of Newton iterations; afterwards the step continues with the last iterate.
const MAX_NEWTON_ITERATIONS: usize = 50;

/// A particle, as an argument of forces on single particles.
pub(crate) struct Body {
    pub(crate) number: usize,
    pub(crate) m: f64,
    pub(crate) v: Vec2,
}

/// Particles i and j, as an argument of pair forces.
pub(crate) struct Pair {
    pub(crate) x: [Vec2; 2],
    pub(crate) v: [Vec2; 2],
    pub(crate) m: [f64; 2],
    /// The length of a vector.
    pub(crate) length: fn(Vec2) -> f64,
}

impl Pair {
    /// From j to i.
    pub(crate) fn d(&self) -> Vec2 {
        self.x[0] - self.x[1]
    }

    /// Distance.
    pub(crate) fn l(&self) -> f64 {
        (self.length)(self.d())
    }

    /// Unit vector from j to i; 0 where both are in one place.
    pub(crate) fn n(&self) -> Vec2 {
        let d = self.d();
        if d == Vec2::zeros() { d } else { d / self.l() }
    }

    /// `n nᵀ`.
    pub(crate) fn nn(&self) -> Mat2 {
        self.n() * self.n().transpose()
    }

    /// `I − n nᵀ`.
    pub(crate) fn across(&self) -> Mat2 {
        Mat2::identity() - self.nn()
    }

    /// `v_i − v_j`.
    pub(crate) fn w(&self) -> Vec2 {
        self.v[0] - self.v[1]
    }
}

/// A formula over a pair of particles.
pub(crate) type PairFormula<T> = fn(&Pair, &Parameters) -> T;

/// A force on a single particle.
pub(crate) type BodyForce = fn(&Body, &Parameters) -> Vec2;

/// A force between two particles.
#[derive(Clone, Copy)]
pub(crate) struct PairForce {
    /// The force on i.
    pub(crate) on_i: PairFormula<Vec2>,
    /// The forces on i and j, from that on i.
    pub(crate) share: fn(Vec2) -> [Vec2; 2],
    /// The sum of all forces on a particle, with this one.
    pub(crate) add: fn(Vec2, Vec2) -> Vec2,
}

/// A Jacobian of a force between two particles.
#[derive(Clone, Copy)]
pub(crate) struct Jacobian {
    /// The derivative of the force on i by i.
    pub(crate) block: PairFormula<Mat2>,
    /// All four blocks, from that one.
    pub(crate) spread: fn(Mat2) -> Blocks,
    /// Block rows and columns of the global matrix for particles i and j.
    pub(crate) place: fn([usize; 2]) -> [usize; 2],
    /// A block of the global matrix with one of the four, of this row and column.
    pub(crate) add: fn(Mat2, Mat2, [usize; 2]) -> Mat2,
}

/// The Jacobian of the drag.
#[derive(Clone, Copy)]
pub(crate) struct DragJacobian {
    /// The derivative of the force on a particle by its velocity.
    pub(crate) block: fn(&Body, &Parameters) -> Mat2,
    /// Block row and column of the global matrix for a particle.
    pub(crate) place: fn(usize) -> usize,
}

/// Explicit and symplectic Euler.
#[derive(Clone, Copy)]
pub(crate) struct Explicit {
    /// Where the force is evaluated: `(q, v, h)`.
    pub(crate) force_at: fn(Vec2, Vec2, f64) -> Vec2,
    /// The new velocity: `(v, F, m, h)`.
    pub(crate) velocity: fn(Vec2, Vec2, f64, f64) -> Vec2,
    /// The new position: `(q, v, v', h)`.
    pub(crate) position: fn(Vec2, Vec2, Vec2, f64) -> Vec2,
    pub(crate) keeps: Keeps,
}

/// The content of the arrays at the start of a step.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Keeps {
    /// They are set to zero.
    Nothing,
    /// The forces, which it adds to.
    Forces,
    /// The Jacobians, which it adds to.
    Jacobians,
    /// The Jacobians of the first step, which it uses.
    FirstJacobians,
}

/// Linearized implicit and implicit Euler.
#[derive(Clone, Copy)]
pub(crate) struct Implicit {
    /// Where the force is evaluated: `(q, u, h)`.
    pub(crate) force_at: fn(Vec2, Vec2, f64) -> Vec2,
    /// Where its Jacobians are evaluated: `(q, u, h)`.
    pub(crate) jacobians_at: fn(Vec2, Vec2, f64) -> Vec2,
    /// Where ∂F/∂q is evaluated, if elsewhere.
    pub(crate) dx_at: Option<fn(Vec2, Vec2, f64) -> Vec2>,
    /// An entry of the matrix, of those of the mass matrix and the Jacobians: `(M, ∂F/∂q, ∂F/∂v, h)`.
    pub(crate) matrix: fn(f64, f64, f64, f64) -> f64,
    /// An entry of the right-hand side: `(m, v, u, F, h)`.
    pub(crate) right_hand_side: fn(f64, f64, f64, f64, f64) -> f64,
    /// The entry of the matrix that its solver reads at this row and column.
    pub(crate) solved: fn(&DMatrix<f64>, usize, usize) -> f64,
    /// The solution of a linear system; `None` where there is none.
    pub(crate) solve: fn(DMatrix<f64>, &DVector<f64>) -> Option<DVector<f64>>,
    /// The entry of the mass matrix for a mass.
    pub(crate) mass: fn(f64) -> f64,
    /// The new position: `(q, v, v', h)`.
    pub(crate) position: fn(Vec2, Vec2, Vec2, f64) -> Vec2,
    pub(crate) max_iterations: usize,
    pub(crate) tolerance: f64,
    pub(crate) keeps: Keeps,
}

/// Coefficient of a term in a method that minimises: `scale · quantityᵃ · hᵇ`.
#[derive(Clone, Copy)]
pub(crate) struct Coefficient {
    pub(crate) scale: f64,
    /// `a`, of the mass or stiffness that the term belongs to.
    pub(crate) of_quantity: i32,
    /// `b`.
    pub(crate) of_h: i32,
}

impl Coefficient {
    /// Without a mistake, its scale is 1.
    fn new(of_quantity: i32, of_h: i32) -> Self {
        Self { scale: 1.0, of_quantity, of_h }
    }

    fn value(self, quantity: f64, h: f64) -> f64 {
        self.scale * quantity.powi(self.of_quantity) * h.powi(self.of_h)
    }
}

/// Treatment of fixed particles.
#[derive(Clone, Copy)]
pub(crate) struct Fixed {
    /// Its velocity with an explicit method, from its old velocity and that of a free particle.
    pub(crate) held: fn(Vec2, Vec2) -> Vec2,
    /// Holds a particle, with this number and mass, in the system of an implicit method.
    pub(crate) hold: fn(&mut DMatrix<f64>, &mut DVector<f64>, usize, f64),
    /// Its final velocity, from its velocity and the change by simple gravity of a free particle.
    pub(crate) velocity: fn(Vec2, Vec2) -> Vec2,
    /// Its position at the evaluation point of an implicit method, from its old position and that of a free particle.
    pub(crate) ahead: fn(Vec2, Vec2) -> Vec2,
    /// Its new position, from the same.
    pub(crate) position: fn(Vec2, Vec2) -> Vec2,
}

/// The formulas and rules of the simulator.
#[derive(Clone)]
pub struct Student {
    /// Reading of the scene; may change it.
    pub(crate) read: fn(&mut Scene),
    /// The length of a vector between two particles.
    pub(crate) length: fn(Vec2) -> f64,
    pub(crate) simple_gravity: BodyForce,
    pub(crate) constant_force: BodyForce,
    pub(crate) drag: BodyForce,
    pub(crate) elastic: PairForce,
    pub(crate) green: PairForce,
    pub(crate) green_energy: PairFormula<f64>,
    pub(crate) damping: PairForce,
    pub(crate) gravitation: PairForce,
    pub(crate) vortex: PairForce,
    pub(crate) elastic_dx: Jacobian,
    pub(crate) green_dx: Jacobian,
    pub(crate) damping_dx: Jacobian,
    pub(crate) damping_dv: Jacobian,
    pub(crate) gravitation_dx: Jacobian,
    pub(crate) drag_dv: DragJacobian,
    pub(crate) vortex_dx: Jacobian,
    pub(crate) vortex_dv: Jacobian,
    pub(crate) bar: PairForce,
    pub(crate) bar_dx: Jacobian,
    pub(crate) hinge: Hinge,
    pub(crate) hinge_dx: Hinge,
    pub(crate) triangle: Triangle,
    pub(crate) triangle_dx: Triangle,
    pub(crate) solids: Solids,
    pub(crate) explicit: Explicit,
    pub(crate) symplectic: Explicit,
    pub(crate) linearized: Implicit,
    pub(crate) implicit: Implicit,
    pub(crate) projected_newton: ProjectedNewton,
    pub(crate) fast_mass_spring: FastMassSpring,
    pub(crate) fixed: Fixed,
    pub(crate) others: Others,
}

/// Changes of the forces and methods without a formula here.
#[derive(Clone)]
pub(crate) struct Others {
    /// The tag of a force, its factor, and its Jacobians'.
    pub(crate) spoilt: Option<(&'static str, [f64; 2])>,
    /// Changes of descriptions of methods, by the method's name.
    pub(crate) methods: Vec<(&'static str, Deviation)>,
}

impl Others {
    fn factors(&self, tag: &str) -> [f64; 2] {
        self.spoilt.filter(|(spoilt, _)| *spoilt == tag).map_or([1.0; 2], |(_, factors)| factors)
    }
}

/// Another description of a method.
#[derive(Clone, Copy)]
pub(crate) enum Deviation {
    /// Of its substeps.
    Substeps(fn(&[Substep]) -> Vec<Substep>),
    /// Of the rows of its stages, that of the end last.
    Stages(fn(Vec<Row>) -> Vec<Row>),
    /// Of the part of the step that it solves for.
    Part(fn(f64) -> f64),
    /// Of the part of the step before that it repeats.
    Repeated(fn(f64) -> f64),
}

/// Coefficients of velocities in a stage's position, and of accelerations in its velocity.
pub(crate) type Row = [Vec<f64>; 2];

/// The forces that have a formula here.
pub(crate) const OWN_FORCES: [&str; 10] = [
    "simplegravity",
    "constantforce",
    "dragdamping",
    "springforce",
    "greenspringforce",
    "gravitationalforce",
    "vortexforce",
    BAR,
    HINGE,
    TRIANGLE,
];

const BAR: &str = "elasticbodyspringforce";
const HINGE: &str = "elasticbodybendingforce";
const TRIANGLE: &str = "elasticbodycstforce";

/// Whether the student has formulas for the steps of this equation.
pub(crate) fn steps_by_itself(equation: StepEquation) -> bool {
    use StepEquation::{ExplicitEuler, ImplicitEuler, LinearizedImplicitEuler, SymplecticEuler};
    matches!(equation, ExplicitEuler | SymplecticEuler | LinearizedImplicitEuler | ImplicitEuler)
}

/// `F = m g`.
pub(crate) fn simple_gravity(body: &Body, p: &Parameters) -> Vec2 {
    body.m * Vec2::new(p["fx"], p["fy"])
}

/// `F = f`.
pub(crate) fn constant_force(_body: &Body, p: &Parameters) -> Vec2 {
    Vec2::new(p["fx"], p["fy"])
}

/// `F = −b v`.
pub(crate) fn drag(body: &Body, p: &Parameters) -> Vec2 {
    -p["b"] * body.v
}

/// `F_i = −k (l − l0) n`.
fn elastic(pair: &Pair, p: &Parameters) -> Vec2 {
    -p["k"] * (pair.l() - p["l0"]) * pair.n()
}

/// Whether an element damps by `beta`. In the plane, the student takes such elements from the reference, whose invariants
/// lose digits of slender ones.
fn has_damped_element(scene: &Scene) -> bool {
    let damps = |of: &ForceElement| of.schema.has_parameter("beta") && of.parameter("beta") != 0.0;
    scene.forces.iter().any(damps)
}

/// Whether the student supports the scene, but for those [in space](knows_in_space): fast mass-spring without acceleration; otherwise two dimensions, with the
/// methods and forces below, and without error control. The simulator's tests compare other scenes with other references.
pub fn knows(scene: &Scene) -> bool {
    let by_time = scene.forces.iter().any(|force| force.schema.depends_on().time);
    let is_plane = scene.dimension == Dimension::Two && !by_time;
    match Method::of(scene.integrator.equation) {
        _ if has_damped_element(scene) => false,
        Method::Controlled(_) => false,
        Method::Rounds => scene.integrator_options.choice("acceleration") == "none",
        _ if is_minimised(scene) => {
            let has_energy =
                |of: &ForceElement| projected_newton::ENERGIES.contains(&of.schema.tag);
            let is_usual = |(option, value)| scene.integrator_options.choice(option) == value;
            let options =
                [("projection", "clamp"), ("direction", "newton"), ("line_search", "backtracking")];
            is_plane && options.into_iter().all(is_usual) && scene.forces.iter().all(has_energy)
        }
        _ => is_plane,
    }
}

/// Whether a step minimises by projected Newton.
fn is_minimised(scene: &Scene) -> bool {
    scene.integrator.family == Family::Minimization
        && scene.integrator.equation == StepEquation::ImplicitEuler
}

/// `F_i = −α/l0 (l − l0) n`.
fn bar(pair: &Pair, p: &Parameters) -> Vec2 {
    -p["alpha"] / p["l0"] * (pair.l() - p["l0"]) * pair.n()
}

/// `−α/l0 (n nᵀ + (l − l0)/l (I − n nᵀ))`.
fn bar_dx(pair: &Pair, p: &Parameters) -> Mat2 {
    -p["alpha"] / p["l0"] * (pair.nn() + (pair.l() - p["l0"]) / pair.l() * pair.across())
}

/// `l0² k/2 (l²/l0² − 1)²`.
fn green_energy(pair: &Pair, p: &Parameters) -> f64 {
    0.5 * p["k"] * p["l0"].powi(2) * ((pair.l() / p["l0"]).powi(2) - 1.0).powi(2)
}

/// `F_i = −2 k (l²/l0² − 1) (x_i − x_j)`.
fn green(pair: &Pair, p: &Parameters) -> Vec2 {
    -2.0 * p["k"] * ((pair.l() / p["l0"]).powi(2) - 1.0) * pair.d()
}

/// `F_i = −b n·(v_i − v_j) n`.
fn damping(pair: &Pair, p: &Parameters) -> Vec2 {
    -p["b"] * pair.n().dot(&pair.w()) * pair.n()
}

/// `F_i = −G m_i m_j / l² n`.
fn gravitation(pair: &Pair, p: &Parameters) -> Vec2 {
    -p["G"] * pair.m[0] * pair.m[1] / pair.l().powi(2) * pair.n()
}

/// `F_i = (kvc / l²) (kbs R n − (v_i − v_j))`.
fn vortex(pair: &Pair, p: &Parameters) -> Vec2 {
    p["kvc"] / pair.l().powi(2) * (p["kbs"] * quarter_turn() * pair.n() - pair.w())
}

/// R: `(x, y) → (−y, x)`.
pub(crate) fn quarter_turn() -> Mat2 {
    Mat2::new(0.0, -1.0, 1.0, 0.0)
}

/// `−k (n nᵀ + (l − l0)/l (I − n nᵀ))`.
fn elastic_dx(pair: &Pair, p: &Parameters) -> Mat2 {
    let strain = if p["l0"] == 0.0 { 1.0 } else { (pair.l() - p["l0"]) / pair.l() };
    -p["k"] * (pair.nn() + strain * pair.across())
}

/// `−2 k ((l²/l0² − 1) I + 2 l²/l0² n nᵀ)`.
fn green_dx(pair: &Pair, p: &Parameters) -> Mat2 {
    let ratio = (pair.l() / p["l0"]).powi(2);
    -2.0 * p["k"] * ((ratio - 1.0) * Mat2::identity() + 2.0 * ratio * pair.nn())
}

/// `−(b/l) (n·w I + n wᵀ) (I − n nᵀ)`.
fn damping_dx(pair: &Pair, p: &Parameters) -> Mat2 {
    if p["b"] == 0.0 {
        return Mat2::zeros();
    }
    let (n, w) = (pair.n(), pair.w());
    -p["b"] / pair.l() * (n.dot(&w) * Mat2::identity() + n * w.transpose()) * pair.across()
}

/// `−b n nᵀ`.
fn damping_dv(pair: &Pair, p: &Parameters) -> Mat2 {
    -p["b"] * pair.nn()
}

/// `−(G m_i m_j / l³) (I − 3 n nᵀ)`.
fn gravitation_dx(pair: &Pair, p: &Parameters) -> Mat2 {
    let strength = p["G"] * pair.m[0] * pair.m[1] / pair.l().powi(3);
    -strength * (Mat2::identity() - 3.0 * pair.nn())
}

/// `−b I`.
pub(crate) fn drag_dv(_body: &Body, p: &Parameters) -> Mat2 {
    -p["b"] * Mat2::identity()
}

/// `(kvc / l³) (kbs (R − 3 R n nᵀ) + 2 w nᵀ)`.
fn vortex_dx(pair: &Pair, p: &Parameters) -> Mat2 {
    let turn = quarter_turn();
    let rotation = p["kbs"] * (turn - 3.0 * turn * pair.nn());
    p["kvc"] / pair.l().powi(3) * (rotation + 2.0 * pair.w() * pair.n().transpose())
}

/// `−(kvc / l²) I`.
fn vortex_dv(pair: &Pair, p: &Parameters) -> Mat2 {
    -p["kvc"] / pair.l().powi(2) * Mat2::identity()
}

/// Newton's third law.
fn action_and_reaction(f: Vec2) -> [Vec2; 2] {
    [f, -f]
}

/// The derivatives, by Newton's third law.
pub(crate) fn four_blocks(k: Mat2) -> Blocks {
    [[k, -k], [-k, k]]
}

/// Clears rows, columns and right-hand side of a particle, and puts ones on the diagonal.
fn clear(matrix: &mut DMatrix<f64>, right: &mut DVector<f64>, particle: usize, _mass: f64) {
    for dof in [2 * particle, 2 * particle + 1] {
        matrix.row_mut(dof).fill(0.0);
        matrix.column_mut(dof).fill(0.0);
        matrix[(dof, dof)] = 1.0;
        right[dof] = 0.0;
    }
}

impl Student {
    /// A student without mistakes.
    pub fn faultless() -> Self {
        let force =
            |on_i| PairForce { on_i, share: action_and_reaction, add: |sum, force| sum + force };
        let jacobian = |block| Jacobian {
            block,
            spread: four_blocks,
            place: |pair| pair,
            add: |sum, block, _| sum + block,
        };
        let explicit = Explicit {
            force_at: |q, _, _| q,
            velocity: |v, f, m, h| v + h / m * f,
            position: |q, old, _, h| q + h * old,
            keeps: Keeps::Nothing,
        };
        let implicit = Implicit {
            force_at: |q, u, h| q + h * u,
            jacobians_at: |q, u, h| q + h * u,
            dx_at: None,
            matrix: |m, dx, dv, h| m - (h * h * dx + h * dv),
            right_hand_side: |m, v, u, f, h| -m * (u - v) + h * f,
            solved: |matrix, row, column| matrix[(row, column)],
            solve: |matrix, right| matrix.lu().solve(right),
            mass: |m| m,
            position: |q, _, new, h| q + h * new,
            max_iterations: MAX_NEWTON_ITERATIONS,
            tolerance: 1e-9,
            keeps: Keeps::Nothing,
        };
        Self {
            read: |_| (),
            length: |d| d.norm(),
            simple_gravity,
            constant_force,
            drag,
            elastic: force(elastic),
            green: force(green),
            green_energy,
            damping: force(damping),
            gravitation: force(gravitation),
            vortex: force(vortex),
            elastic_dx: jacobian(elastic_dx),
            green_dx: jacobian(green_dx),
            damping_dx: jacobian(damping_dx),
            damping_dv: jacobian(damping_dv),
            gravitation_dx: jacobian(gravitation_dx),
            drag_dv: DragJacobian { block: drag_dv, place: |particle| particle },
            vortex_dx: jacobian(vortex_dx),
            vortex_dv: jacobian(vortex_dv),
            bar: force(bar),
            bar_dx: jacobian(bar_dx),
            hinge: Hinge::FAULTLESS,
            hinge_dx: Hinge::FAULTLESS,
            triangle: Triangle::FAULTLESS,
            triangle_dx: Triangle::FAULTLESS,
            solids: Solids::faultless(),
            explicit,
            symplectic: Explicit { position: |q, _, new, h| q + h * new, ..explicit },
            linearized: Implicit { max_iterations: 1, ..implicit },
            implicit,
            projected_newton: ProjectedNewton::faultless(),
            fast_mass_spring: FastMassSpring::faultless(),
            fixed: Fixed {
                held: |old, _| old,
                hold: clear,
                velocity: |v, _| v,
                ahead: |_, moved| moved,
                position: |_, moved| moved,
            },
            others: Others { spoilt: None, methods: Vec::new() },
        }
    }

    /// Whether it reads scenes wrongly.
    pub(crate) fn misreads(&self) -> bool {
        !std::ptr::fn_addr_eq(self.read, Self::faultless().read)
    }

    /// The states of a scene, computed lazily.
    ///
    /// # Panics
    /// If it does not support the scene, [in the plane](knows) or [in space](knows_in_space).
    pub fn simulate(&self, scene: &Scene) -> Run {
        let mut scene = scene.clone();
        (self.read)(&mut scene);
        let (time_step, n_steps) =
            (scene.time_step, (scene.duration / scene.time_step).ceil() as u64);
        let motion: Box<dyn Motion> = match scene.integrator.equation {
            StepEquation::LocalGlobal => {
                Box::new(fast_mass_spring::Net::new(self.fast_mass_spring, scene))
            }
            _ if knows_in_space(&scene) => Box::new(space::Space::new(self.solids, scene)),
            _ => Box::new(Plane::new(self.clone(), scene)),
        };
        Run { motion, time_step, next_state: 0, n_steps }
    }
}

/// Steps of a scene.
trait Motion: Send {
    /// Advances by one step.
    fn step(&mut self);

    /// Positions and velocities, particle by particle.
    fn state(&self) -> [Vec<f64>; 2];
}

/// The rows of a method's stages, and that of its end.
fn rows(tableau: &Tableau) -> Vec<Row> {
    let all = tableau.stages.iter().chain([&tableau.end]);
    all.map(|stage| [stage.position.to_vec(), stage.velocity.to_vec()]).collect()
}

/// A running simulation.
pub struct Run {
    motion: Box<dyn Motion>,
    time_step: f64,
    next_state: u64,
    n_steps: u64,
}

impl StateSource for Run {
    fn read(&mut self, state: &mut State) -> Result<bool, Failure> {
        if self.next_state > self.n_steps {
            return Ok(false);
        }
        if self.next_state > 0 {
            self.motion.step();
        }
        state.time = Some(self.next_state as f64 * self.time_step);
        [state.positions, state.velocities] = self.motion.state();
        self.next_state += 1;
        Ok(true)
    }
}

/// A motion in the plane.
struct Plane {
    student: Student,
    scene: Scene,
    q: Vec<Vec2>,
    v: Vec<Vec2>,
    /// Both one step before.
    earlier: Option<[Vec<Vec2>; 2]>,
    /// Forces and Jacobians that are kept.
    kept: (Option<Vec<Vec2>>, Option<[DMatrix<f64>; 2]>),
}

impl Motion for Plane {
    /// The scene names the integrator.
    fn step(&mut self) {
        let before = [self.q.clone(), self.v.clone()];
        let Student { explicit, symplectic, linearized, implicit, projected_newton, .. } =
            self.student;
        let equation = self.scene.integrator.equation;
        match equation {
            _ if is_minimised(&self.scene) => self.projected_newton_step(projected_newton),
            StepEquation::ExplicitEuler => self.explicit_step(explicit),
            StepEquation::SymplecticEuler => self.explicit_step(symplectic),
            StepEquation::LinearizedImplicitEuler => self.implicit_step(linearized),
            StepEquation::ImplicitEuler => self.implicit_step(implicit),
            _ => {
                let has_earlier = self.earlier.is_some();
                self.described_step(Method::of(equation).with_earlier(has_earlier));
            }
        }
        self.earlier = Some(before);
    }

    fn state(&self) -> [Vec<f64>; 2] {
        [flat(&self.q), flat(&self.v)]
    }
}

impl Plane {
    fn new(student: Student, scene: Scene) -> Self {
        assert_eq!(scene.dimension, Dimension::Two, "{}: the student knows no z", scene.name);
        let xy = |vector: &[f64; 3]| Vec2::new(vector[0], vector[1]);
        Self {
            student,
            q: scene.particles.iter().map(|particle| xy(&particle.position)).collect(),
            v: scene.particles.iter().map(|particle| xy(&particle.velocity)).collect(),
            scene,
            earlier: None,
            kept: (None, None),
        }
    }

    /// A step by the description of a method, with its deviations.
    fn described_step(&mut self, method: Method) {
        let name = self.scene.integrator.name;
        let own = self.student.others.methods.iter().filter(|(of, _)| *of == name);
        let deviations: Vec<Deviation> = own.map(|(_, deviation)| *deviation).collect();
        match method {
            Method::Explicit(substeps) => {
                let made = deviations.iter().fold(substeps.to_vec(), |made, deviation| {
                    if let Deviation::Substeps(make) = deviation { make(&made) } else { made }
                });
                self.substeps(made);
            }
            Method::Stages(tableau) => {
                let made = deviations.iter().fold(rows(tableau), |made, deviation| {
                    if let Deviation::Stages(make) = deviation { make(made) } else { made }
                });
                self.stages(made);
            }
            Method::Backward { linearized: false, part } => {
                let made = deviations.iter().fold(part, |made, deviation| {
                    if let Deviation::Part(make) = deviation { make(made) } else { made }
                });
                self.implicit_part(made);
            }
            Method::Differences { repeated } => {
                let made = deviations.iter().fold(repeated, |made, deviation| {
                    if let Deviation::Repeated(make) = deviation { make(made) } else { made }
                });
                self.implicit_rest(made);
            }
            method => panic!("the student cannot step by {method:?}"),
        }
        let (velocity, fall) = (self.student.fixed.velocity, self.scene.time_step * self.gravity());
        for (v, _) in self.v.iter_mut().zip(&self.scene.particles).filter(|(_, p)| p.fixed) {
            *v = velocity(*v, fall);
        }
    }

    fn substeps(&mut self, substeps: Vec<Substep>) {
        let h = self.scene.time_step;
        for substep in substeps {
            let old = self.v.clone();
            if let Substep::Both(c) | Substep::Kick(c) = substep {
                let force = self.force(&self.q, &self.v);
                for (i, particle) in self.scene.particles.iter().enumerate() {
                    let free = self.v[i] + c * h / particle.mass * force[i];
                    let held = self.student.fixed.held;
                    self.v[i] = if particle.fixed { held(self.v[i], free) } else { free };
                }
            }
            if let Substep::Both(c) | Substep::Drift(c) = substep {
                let along = if matches!(substep, Substep::Both(_)) { &old } else { &self.v };
                for (i, particle) in self.scene.particles.iter().enumerate() {
                    let moved = self.q[i] + c * h * along[i];
                    let fixed = self.student.fixed.position;
                    self.q[i] = if particle.fixed { fixed(self.q[i], moved) } else { moved };
                }
            }
        }
    }

    /// Stages from the start of the step, the last of which is the end.
    fn stages(&mut self, rows: Vec<Row>) {
        let h = self.scene.time_step;
        let fixed = self.student.fixed;
        let (mut velocities, mut forces): (Vec<Vec<Vec2>>, Vec<Vec<Vec2>>) = Default::default();
        for (number, [of_velocities, of_forces]) in rows.iter().enumerate() {
            let mut u = self.v.clone();
            for (c, force) in of_forces.iter().zip(&forces) {
                for (i, particle) in self.scene.particles.iter().enumerate() {
                    let free = u[i] + c * h / particle.mass * force[i];
                    u[i] = if particle.fixed { (fixed.held)(u[i], free) } else { free };
                }
            }
            velocities.push(u.clone());
            let mut q = self.q.clone();
            for (i, particle) in self.scene.particles.iter().enumerate() {
                let along = of_velocities.iter().zip(&velocities).map(|(c, u)| c * h * u[i]);
                let moved = q[i] + along.sum::<Vec2>();
                q[i] = if particle.fixed { (fixed.position)(q[i], moved) } else { moved };
            }
            if number + 1 == rows.len() {
                (self.q, self.v) = (q, u);
                return;
            }
            forces.push(self.force(&q, &u));
        }
    }

    /// Implicit Euler for a part of the step, and the same again for the rest of it.
    fn implicit_part(&mut self, part: f64) {
        let (q, v) = (self.q.clone(), self.v.clone());
        self.implicit_of(part);
        let whole = |start: Vec2, end: Vec2| start + (end - start) / part;
        self.q = q.iter().zip(&self.q).map(|(start, end)| whole(*start, *end)).collect();
        self.v = v.iter().zip(&self.v).map(|(start, end)| whole(*start, *end)).collect();
    }

    /// A part of the step before once more, and implicit Euler for the rest of the step.
    fn implicit_rest(&mut self, part: f64) {
        let h = self.scene.time_step;
        let [q, v] = self.earlier.clone().unwrap_or_else(|| [self.q.clone(), self.v.clone()]);
        for (i, particle) in self.scene.particles.iter().enumerate() {
            if particle.fixed {
                let moved = self.q[i] + part * h * self.v[i];
                self.q[i] = (self.student.fixed.position)(self.q[i], moved);
            } else {
                self.q[i] = (1.0 + part) * self.q[i] - part * q[i];
                self.v[i] = (1.0 + part) * self.v[i] - part * v[i];
            }
        }
        self.implicit_of(1.0 - part);
    }

    /// Implicit Euler for a part of the step, without deviations.
    fn implicit_of(&mut self, part: f64) {
        let h = self.scene.time_step;
        let Student { implicit, fixed, .. } = Student::faultless();
        let velocity = std::mem::replace(&mut self.student.fixed.velocity, fixed.velocity);
        self.scene.time_step = part * h;
        self.implicit_step(implicit);
        self.scene.time_step = h;
        self.student.fixed.velocity = velocity;
    }

    fn explicit_step(&mut self, method: Explicit) {
        let h = self.scene.time_step;
        let at: Vec<Vec2> =
            self.q.iter().zip(&self.v).map(|(q, v)| (method.force_at)(*q, *v, h)).collect();
        let force = self.force(&at, &self.v);
        let force = self.kept_force(method.keeps, force);
        let new = (0..self.v.len()).map(|i| {
            let Particle { mass, fixed, .. } = self.scene.particles[i];
            let free = (method.velocity)(self.v[i], force[i], mass, h);
            if fixed { (self.student.fixed.held)(self.v[i], free) } else { free }
        });
        let new = new.collect();
        self.finish(new, method.position);
    }

    fn implicit_step(&mut self, method: Implicit) {
        let h = self.scene.time_step;
        let mut u = self.v.clone();
        for _ in 0..method.max_iterations {
            let force = self.force(&self.ahead(&u, method.force_at), &u);
            let force = self.kept_force(method.keeps, force);
            let at = self.ahead(&u, method.jacobians_at);
            let (mut dx, dv) = self.jacobians(&at, &u, |blocks| blocks);
            if let Some(at) = method.dx_at {
                dx = self.jacobians(&self.ahead(&u, at), &u, |blocks| blocks).0;
            }
            let [dx, dv] = self.kept_jacobians(method.keeps, [dx, dv]);
            let mass = self.mass_matrix(method.mass);
            let mut matrix = DMatrix::from_fn(2 * u.len(), 2 * u.len(), |row, column| {
                let entry = (row, column);
                (method.matrix)(mass[entry], dx[entry], dv[entry], h)
            });
            let mut right = DVector::from_fn(2 * u.len(), |dof, _| {
                let (i, axis) = (dof / 2, dof % 2);
                let v = self.v[i][axis];
                (method.right_hand_side)(mass[(dof, dof)], v, u[i][axis], force[i][axis], h)
            });
            for (i, particle) in self.scene.particles.iter().enumerate().filter(|(_, p)| p.fixed) {
                (self.student.fixed.hold)(&mut matrix, &mut right, i, particle.mass);
            }
            let nonsense = || DVector::repeat(2 * u.len(), f64::NAN);
            let read = |row, column| (method.solved)(&matrix, row, column);
            let matrix = DMatrix::from_fn(2 * u.len(), 2 * u.len(), read);
            let delta = (method.solve)(matrix, &right).unwrap_or_else(nonsense);
            for (i, u) in u.iter_mut().enumerate() {
                *u += delta.fixed_rows::<2>(2 * i);
            }
            if delta.norm() < method.tolerance {
                break;
            }
        }
        self.finish(u, method.position);
    }

    fn kept_force(&mut self, keeps: Keeps, mut force: Vec<Vec2>) -> Vec<Vec2> {
        if keeps == Keeps::Forces {
            let before = self.kept.0.take().unwrap_or_else(|| vec![Vec2::zeros(); force.len()]);
            force.iter_mut().zip(before).for_each(|(force, before)| *force += before);
            self.kept.0 = Some(force.clone());
        }
        force
    }

    fn kept_jacobians(&mut self, keeps: Keeps, new: [DMatrix<f64>; 2]) -> [DMatrix<f64>; 2] {
        let kept = match (keeps, self.kept.1.take()) {
            (Keeps::Jacobians, Some([dx, dv])) => [dx + &new[0], dv + &new[1]],
            (Keeps::FirstJacobians, Some(first)) => first,
            _ => new,
        };
        self.kept.1 = Some(kept.clone());
        kept
    }

    /// The positions at which an implicit method evaluates.
    fn ahead(&self, u: &[Vec2], at: fn(Vec2, Vec2, f64) -> Vec2) -> Vec<Vec2> {
        let position = |i: usize| {
            let moved = at(self.q[i], u[i], self.scene.time_step);
            let fixed = self.scene.particles[i].fixed;
            if fixed { (self.student.fixed.ahead)(self.q[i], moved) } else { moved }
        };
        (0..u.len()).map(position).collect()
    }

    /// Replaces the state, given the new velocities.
    fn finish(&mut self, mut new: Vec<Vec2>, position: fn(Vec2, Vec2, Vec2, f64) -> Vec2) {
        let h = self.scene.time_step;
        let fall = h * self.gravity();
        for (i, particle) in self.scene.particles.iter().enumerate() {
            let fixed = self.student.fixed;
            if particle.fixed {
                new[i] = (fixed.velocity)(new[i], fall);
            }
            let moved = position(self.q[i], self.v[i], new[i], h);
            let moved = if particle.fixed { (fixed.position)(self.q[i], moved) } else { moved };
            self.q[i] = moved;
        }
        self.v = new;
    }

    /// The acceleration of simple gravity.
    fn gravity(&self) -> Vec2 {
        let elements = self.scene.forces.iter().filter(|e| e.schema.tag == "simplegravity");
        elements.map(|e| Vec2::new(e.parameter("fx"), e.parameter("fy"))).sum()
    }

    fn body(&self, number: usize, v: &[Vec2]) -> Body {
        Body { number, m: self.scene.particles[number].mass, v: v[number] }
    }

    fn pair(&self, [i, j]: [usize; 2], q: &[Vec2], v: &[Vec2]) -> Pair {
        let mass = |particle: usize| self.scene.particles[particle].mass;
        let length = self.student.length;
        Pair { x: [q[i], q[j]], v: [v[i], v[j]], m: [mass(i), mass(j)], length }
    }

    fn three(&self, element: &ForceElement, q: &[Vec2]) -> Three {
        let start = |particle: usize| {
            let [x, y, _] = self.scene.particles[particle].position;
            Vec2::new(x, y)
        };
        let particles = [0, 1, 2].map(|place| element.particles[place]);
        Three { x: particles.map(|particle| q[particle]), start: particles.map(start) }
    }

    /// The force on every particle, fixed ones included.
    fn force(&self, q: &[Vec2], v: &[Vec2]) -> Vec<Vec2> {
        let student = &self.student;
        let mut force = vec![Vec2::zeros(); q.len()];
        let on_every_particle = |law: BodyForce, p: &Parameters, force: &mut [Vec2]| {
            for (i, force) in force.iter_mut().enumerate() {
                *force += law(&self.body(i, v), p);
            }
        };
        let on_pair = |law: PairForce, ij: [usize; 2], p: &Parameters, force: &mut [Vec2]| {
            let shares = (law.share)((law.on_i)(&self.pair(ij, q, v), p));
            for (i, share) in ij.into_iter().zip(shares) {
                force[i] = (law.add)(force[i], share);
            }
        };
        for element in &self.scene.forces {
            let (p, ij) = (&Parameters(element.clone()), element.pair().unwrap_or_default());
            match element.schema.tag {
                "simplegravity" => on_every_particle(student.simple_gravity, p, &mut force),
                "constantforce" => on_every_particle(student.constant_force, p, &mut force),
                "dragdamping" => on_every_particle(student.drag, p, &mut force),
                "springforce" => {
                    on_pair(student.elastic, ij, p, &mut force);
                    on_pair(student.damping, ij, p, &mut force);
                }
                "greenspringforce" => on_pair(student.green, ij, p, &mut force),
                "gravitationalforce" => on_pair(student.gravitation, ij, p, &mut force),
                "vortexforce" => on_pair(student.vortex, ij, p, &mut force),
                BAR => on_pair(student.bar, ij, p, &mut force),
                HINGE | TRIANGLE => {
                    let three = self.three(element, q);
                    let shares = match element.schema.tag {
                        HINGE => student.hinge.force(&three, p),
                        _ => student.triangle.force(&three, p),
                    };
                    element.particles.iter().zip(shares).for_each(|(i, share)| force[*i] += share);
                }
                tag => {
                    let [factor, _] = student.others.factors(tag);
                    let laws = Laws::of(&self.scene, std::slice::from_ref(element));
                    let by_law = laws.force(&flat(q), &flat(v), 0.0);
                    for (force, law) in force.iter_mut().zip(by_law.as_chunks::<2>().0) {
                        *force += factor * Vec2::from(*law);
                    }
                }
            }
        }
        force
    }

    /// `∂F/∂q` and `∂F/∂v`, of every particle by every particle; those of a pair as `made` of its blocks.
    fn jacobians(
        &self,
        q: &[Vec2],
        v: &[Vec2],
        made: impl Fn(Blocks) -> Blocks,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let student = &self.student;
        let mut dx = DMatrix::zeros(2 * q.len(), 2 * q.len());
        let mut dv = dx.clone();
        let of_pair = |law: Jacobian, ij: [usize; 2], p: &Parameters, matrix: &mut DMatrix<f64>| {
            let blocks = made((law.spread)((law.block)(&self.pair(ij, q, v), p)));
            let at = (law.place)(ij);
            for (place, block) in blocks.into_iter().flatten().enumerate() {
                let place = [place / 2, place % 2];
                let [row, column] = place.map(|end| at[end]);
                let mut view = matrix.fixed_view_mut::<2, 2>(2 * row, 2 * column);
                let sum = (law.add)(view.clone_owned(), block, place);
                view.copy_from(&sum);
            }
        };
        for element in &self.scene.forces {
            let (p, ij) = (&Parameters(element.clone()), element.pair().unwrap_or_default());
            match element.schema.tag {
                "springforce" => {
                    of_pair(student.elastic_dx, ij, p, &mut dx);
                    of_pair(student.damping_dx, ij, p, &mut dx);
                    of_pair(student.damping_dv, ij, p, &mut dv);
                }
                "greenspringforce" => of_pair(student.green_dx, ij, p, &mut dx),
                "gravitationalforce" => of_pair(student.gravitation_dx, ij, p, &mut dx),
                "dragdamping" => {
                    for i in 0..q.len() {
                        let at = (student.drag_dv.place)(i);
                        let block = (student.drag_dv.block)(&self.body(i, v), p);
                        add_block(&mut dv, at, at, &block);
                    }
                }
                "vortexforce" => {
                    of_pair(student.vortex_dx, ij, p, &mut dx);
                    of_pair(student.vortex_dv, ij, p, &mut dv);
                }
                BAR => of_pair(student.bar_dx, ij, p, &mut dx),
                HINGE | TRIANGLE => {
                    let three = self.three(element, q);
                    let blocks = match element.schema.tag {
                        HINGE => student.hinge_dx.jacobian(&three, p),
                        _ => student.triangle_dx.jacobian(&three, p),
                    };
                    for (row, blocks) in element.particles.iter().zip(blocks) {
                        for (column, block) in element.particles.iter().zip(blocks) {
                            add_block(&mut dx, *row, *column, &block);
                        }
                    }
                }
                tag if OWN_FORCES.contains(&tag) => {
                    // Simple gravity and the constant force are the same everywhere.
                }
                tag => {
                    let [_, factor] = student.others.factors(tag);
                    let laws = Laws::of(&self.scene, std::slice::from_ref(element));
                    let by_law = laws.jacobians(&flat(q), &flat(v), 0.0);
                    dx += factor * by_law.by_position;
                    dv += factor * by_law.by_velocity;
                }
            }
        }
        (dx, dv)
    }

    fn mass_matrix(&self, mass: fn(f64) -> f64) -> DMatrix<f64> {
        let particles = self.scene.particles.iter();
        let diagonal = particles.flat_map(|particle| [mass(particle.mass); 2]).collect();
        DMatrix::from_diagonal(&DVector::from_vec(diagonal))
    }
}

fn add_block(matrix: &mut DMatrix<f64>, row: usize, column: usize, block: &Mat2) {
    let mut view = matrix.fixed_view_mut::<2, 2>(2 * row, 2 * column);
    view += block;
}

fn flat(vectors: &[Vec2]) -> Vec<f64> {
    vectors.iter().flat_map(|vector| [vector.x, vector.y]).collect()
}
