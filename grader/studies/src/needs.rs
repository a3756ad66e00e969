//! Resources that the steps of a scene need and use, and the cost of the general code path.
//!
//! ```text
//! scene ──> as it is            ──> solver, assemblies, factorisations, bytes of state, time a step
//!   └─────> embedded in 3D, every force that the method takes present with coefficients of zero,
//!           every part of the matrix sparse ──> the same, the largest difference of a state, how much slower
//! ```
//!
//! This module derives the needs from the scene alone and compares them with the statistics of the run ([`Excess`]).
//! Cost: every scene runs four times each way; the fastest run counts.

use std::collections::BTreeSet;
use std::time::Instant;

use reference::laws::Laws;
use scene::schema::Matrix;
use scene::{Dimension, ForceElement, Scene};
use simulator::force;
use simulator::simulation::{Simulation, SimulationError};
use simulator::solver::linear::LinearSolver;
use simulator::statistics::Statistics;
use sparse::sizes::MAX_SMALL_BLOCKS;

/// Number of runs; the fastest counts.
const RUNS: u32 = 4;

/// Cost of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Cost {
    /// The counts of the run.
    pub statistics: Statistics,
    /// The kinds of force that were evaluated.
    pub forces: Vec<&'static str>,
    /// Bytes of positions and velocities.
    pub state_bytes: usize,
    /// Time per step of the fastest run, in seconds, without building the system.
    pub seconds: f64,
}

/// A scene with its cost as it is and by the general path.
#[derive(Debug, Clone, PartialEq)]
pub struct Need {
    /// Name of the scene in tables.
    pub scene: String,
    /// Its method.
    pub method: &'static str,
    /// Cost of the scene as it is.
    pub given: Cost,
    /// Cost by the general path.
    pub general: Cost,
    /// The largest difference of a position or velocity between the two, relative to the largest of them.
    pub difference: f64,
    /// Resources used beyond the scene's needs.
    pub excess: Vec<Excess>,
}

/// A resource used but not needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Excess {
    /// An explicit method with a matrix.
    MatrixOfExplicit,
    /// A factorisation although no force couples particles.
    FactorsWithoutCoupling,
    /// A sparse solver although no part has more than [`MAX_SMALL_BLOCKS`] particles.
    SparseForSmall,
    /// A sparsity pattern analysed more than once.
    AnalysedAgain,
    /// A constant matrix factorised more than once.
    FactorisedAgain,
    /// More coordinates than the scene has.
    MoreCoordinates,
    /// An evaluation of a kind of force that the scene does not contain.
    ForceNotMentioned,
}

impl Excess {
    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::MatrixOfExplicit => "a matrix for an explicit method",
            Self::FactorsWithoutCoupling => "a factorisation without a coupling",
            Self::SparseForSmall => "a sparse solver for a small part",
            Self::AnalysedAgain => "a pattern analysed again",
            Self::FactorisedAgain => "a constant matrix factorised again",
            Self::MoreCoordinates => "more coordinates than the scene has",
            Self::ForceNotMentioned => "a force that the scene does not mention",
        }
    }
}

/// Measures a scene both ways.
///
/// # Errors
/// If a step fails.
pub fn measure(name: &str, scene: &Scene) -> Result<Need, SimulationError> {
    let given = cost(scene, LinearSolver::Auto)?;
    let mut general_scene = general(scene);
    if cost(&general_scene, LinearSolver::Sparse).is_err() {
        // The two particles meet, where a force between them is undefined.
        let mentioned = |force: &ForceElement| {
            scene.forces.iter().any(|each| each.schema == force.schema)
                || force.particles.is_empty()
                || is_defined_everywhere(scene, force)
        };
        general_scene.forces.retain(mentioned);
    }
    Ok(Need {
        scene: name.to_owned(),
        method: scene.integrator.name,
        general: cost(&general_scene, LinearSolver::Sparse)?,
        difference: difference(scene, &general_scene)?,
        excess: excess(scene, &given),
        given,
    })
}

/// Runs a scene with this linear solver.
///
/// # Errors
/// If a step fails.
pub fn cost(scene: &Scene, solver: LinearSolver) -> Result<Cost, SimulationError> {
    let mut fastest = f64::INFINITY;
    for run in 1.. {
        let mut simulation = Simulation::with_solver(scene, solver);
        let started = Instant::now();
        while simulation.advance()? {}
        let steps = simulation.n_steps().max(1);
        fastest = fastest.min(started.elapsed().as_secs_f64() / steps as f64);
        if run == RUNS {
            let state = simulation.state();
            return Ok(Cost {
                statistics: simulation.statistics().clone(),
                forces: simulation.force_tags().to_vec(),
                state_bytes: size_of_val(state.positions) + size_of_val(state.velocities),
                seconds: fastest,
            });
        }
    }
    unreachable!("the loop returns after RUNS runs")
}

/// The scene embedded in 3D (unless it would be another one there), with every force that its method supports. Added forces have zero
/// coefficients; those that are no fields act on the first particle, the one farthest from it, and the ones after the
/// first.
pub fn general(scene: &Scene) -> Scene {
    let distance = |idx: &usize| -> f64 {
        let [a, b] = [0, *idx].map(|idx| scene.particles[idx].position);
        a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
    };
    let furthest = (1..scene.particles.len()).max_by(|a, b| distance(a).total_cmp(&distance(b)));
    let dimension = if is_other_in_space(scene) { scene.dimension } else { Dimension::Three };
    let mut general = Scene { dimension, ..scene.clone() };
    for kind in force::REGISTRY {
        let schema = &kind.schema;
        let is_there = scene.forces.iter().any(|force| force.schema == schema);
        if is_there || !schema.exists_in(dimension) {
            continue;
        }
        // The first particle, the one farthest from it, and the ones after the first.
        let others = || (1..scene.particles.len()).filter(|other| Some(*other) != furthest);
        let size = if schema.stencil.is_field() { 0 } else { schema.stencil.size() };
        let particles: Vec<usize> =
            [0].into_iter().chain(furthest).chain(others()).take(size).collect();
        if particles.len() < size {
            continue;
        }
        let parameters = schema.parameters.iter().map(|parameter| {
            // A rest length must be positive, and the corners of an element apart.
            let is_zero = parameter.domain.contains(0.0) && parameter.coordinate.is_none();
            if is_zero { 0.0 } else { parameter.typical.0 }
        });
        let element = ForceElement::new(schema, &particles, None, parameters.collect());
        // A flat triangle has no normal in space.
        let is_defined = is_defined_at(&general, &element, &general.positions());
        if is_defined && (scene.integrator.refuses)(&element).is_none() {
            general.forces.push(element);
        }
    }
    general
}

/// Whether an element is defined where all particles meet.
fn is_defined_everywhere(scene: &Scene, element: &ForceElement) -> bool {
    is_defined_at(scene, element, &vec![0.0; scene.particles.len() * scene.dimension.count()])
}

/// Whether an element is defined at these positions, at rest.
fn is_defined_at(scene: &Scene, element: &ForceElement, positions: &[f64]) -> bool {
    let laws = Laws::of(scene, std::slice::from_ref(element));
    let force = laws.force(positions, &vec![0.0; positions.len()], 0.0);
    force.iter().all(|component| component.is_finite())
}

/// Whether a scene in the plane has other forces in space, or forces across it: a wind, or an angle that has a sign in the
/// plane only. The mirror image of the scene has angles of the other sign.
fn is_other_in_space(scene: &Scene) -> bool {
    let space = Scene { dimension: Dimension::Three, ..scene.clone() };
    let force = |scene: &Scene, sign: f64| {
        let axes = scene.dimension.count();
        let mirrored = |mut values: Vec<f64>| {
            values.iter_mut().skip(1).step_by(axes).for_each(|y| *y *= sign);
            values
        };
        let (x, v) = (mirrored(scene.positions()), mirrored(scene.velocities()));
        Laws::new(scene).force(&x, &v, scene.time_step)
    };
    let axes = scene.dimension.count();
    [1.0, -1.0].into_iter().any(|sign| {
        let (flat, deep) = (force(scene, sign), force(&space, sign));
        let largest = flat.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let is_same = |(flat, deep): (&[f64], &[f64])| {
            let across = flat.get(2).copied().unwrap_or(0.0);
            let near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-12 * largest;
            deep[2] == across && flat.iter().zip(deep).all(near)
        };
        !flat.chunks(axes).zip(deep.chunks(3)).all(is_same)
    })
}

/// The largest difference of a state between a scene in the plane or in space and the same in space.
fn difference(scene: &Scene, general: &Scene) -> Result<f64, SimulationError> {
    let mut first = Simulation::new(scene);
    let mut second = Simulation::with_solver(general, LinearSolver::Sparse);
    let [axes, more_axes] = [scene, general].map(|scene| scene.dimension.count());
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    loop {
        let (a, b) = (first.state(), second.state());
        for (a, b) in [(a.positions, b.positions), (a.velocities, b.velocities)] {
            for (a, b) in a.chunks(axes).zip(b.chunks(more_axes)) {
                for (axis, b) in b.iter().enumerate() {
                    let a = a.get(axis).copied().unwrap_or(0.0);
                    worst = worst.max((a - b).abs());
                    largest = largest.max(a.abs());
                }
            }
        }
        if !first.advance()? || !second.advance()? {
            return Ok(if worst == 0.0 { 0.0 } else { worst / largest });
        }
    }
}

/// Resources that the run of a scene used beyond its needs.
pub fn excess(scene: &Scene, cost: &Cost) -> Vec<Excess> {
    let statistics = &cost.statistics;
    let linear = &statistics.linear;
    let is_explicit = scene.integrator.matrix == Matrix::None;
    let is_constant = scene.integrator.matrix == Matrix::Constant;
    let parts = coupled_parts(scene);
    let has_matrix =
        statistics.assemblies + linear.factorisations > 0 || !statistics.linear_solver.is_empty();
    let is_sparse = statistics.linear_solver.contains("sparse");
    let mentioned: BTreeSet<&str> = scene.forces.iter().map(|force| force.schema.tag).collect();
    let axes = scene.dimension.count();
    let bytes = 2 * axes * scene.particles.len() * size_of::<f64>();
    let large = parts.iter().filter(|size| **size > MAX_SMALL_BLOCKS).count() as u64;
    let found = [
        (Excess::MatrixOfExplicit, is_explicit && has_matrix),
        (Excess::FactorsWithoutCoupling, parts.is_empty() && linear.factorisations > 0),
        (Excess::SparseForSmall, is_sparse && large == 0),
        (Excess::AnalysedAgain, linear.symbolic_analyses > large.max(u64::from(is_constant))),
        (Excess::FactorisedAgain, is_constant && linear.factorisations > 1),
        (Excess::MoreCoordinates, cost.state_bytes > bytes),
        (Excess::ForceNotMentioned, cost.forces.iter().any(|tag| !mentioned.contains(tag))),
    ];
    found.into_iter().filter_map(|(excess, is)| is.then_some(excess)).collect()
}

/// Sizes, in free particles, of the parts that forces couple. A particle without any coupling, not even to a fixed
/// particle, is in no part.
fn coupled_parts(scene: &Scene) -> Vec<usize> {
    let n = scene.particles.len();
    let mut root: Vec<usize> = (0..n).collect();
    let mut coupled = vec![false; n];
    let find = |root: &[usize], mut at: usize| {
        while root[at] != at {
            at = root[at];
        }
        at
    };
    for pair in scene.forces.iter().flat_map(|force| force.particles.windows(2)) {
        let [i, j] = [pair[0], pair[1]];
        let [free_i, free_j] = [i, j].map(|particle| !scene.particles[particle].fixed);
        coupled[i] |= free_i;
        coupled[j] |= free_j;
        if free_i && free_j {
            let (a, b) = (find(&root, i), find(&root, j));
            root[a] = b;
        }
    }
    let mut sizes = vec![0; n];
    for particle in (0..n).filter(|particle| coupled[*particle]) {
        sizes[find(&root, particle)] += 1;
    }
    sizes.into_iter().filter(|size| *size > 0).collect()
}
