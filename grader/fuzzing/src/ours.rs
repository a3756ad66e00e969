//! Our own simulator, tested as any program is: against the second one, and by other code paths against itself.
//!
//! | path | differs in |
//! | --- | --- |
//! | second | laws, step equations and linear systems of `reference`, dense |
//! | dense, sparse | the solver of every coupled component |
//! | in 3D | a scene of pairs and uniform fields in the plane z = 0 |
//! | threads | so many elements that threads share the particles, by one thread and by several: the same bits |
//! | symmetries | transformed scenes, transformed back, where the facts of the forces say that they move correspondingly |
//!
//! The envelope is that of our own simulator alone, with other last bits and other orders of sums: a mistake that the second
//! simulator would show does not widen it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::LazyLock;

use grader::compare::calibration::Class;
use grader::grading::panic_message;
use grader::submission::{StateSource, builtin};
use grader::verdict::{Failure, Lack, Verdict};
use rayon::{ThreadPool, ThreadPoolBuilder};
use reference::second::{Second, Style};
use scene::schema::Stencil;
use scene::trace::{Shape, State};
use scene::{Dimension, ForceElement, Scene};
use simulator::force::{self, ForceKind};
use simulator::sizes::PARALLEL;
use simulator::solver::linear::LinearSolver;

use crate::judge::{Judge, Strictness, Subject};
use crate::motion::Held;
use crate::symmetry::{self, Symmetry};

/// A way to simulate a scene that is not the usual one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Path {
    /// The second simulator.
    Second,
    /// Our own with this solver.
    Solver(LinearSolver),
    /// Our own in three dimensions.
    Embedded,
    /// Our own in one thread and in several.
    Threads,
    /// Our own on transformed scenes, transformed back.
    Symmetry(Symmetry),
}

/// Ratio of a residual to its tolerance from which another solver, or the second simulator, differs. Elimination errs by some
/// `n κ ε` of the solution, `n` up to 120 unknowns and `κ` up to 1,000 (`Strictness::amplification`), and a tolerance is 40 ε or
/// more. A shift rounds coordinates near 0 as those of the size of the scene, which no variant does. The other paths compute the
/// same formulas, and are judged as programs are.
const CLEAR: f64 = 3e3;

/// Particles of copies side by side, of which each thread has several.
const COPIED: usize = 64;

/// Steps by several threads: each step divides the same work, and waking the threads takes longer than it.
const STEPS: f64 = 4.0;

/// Ratio of the square of the longest edge to the area from which a triangle is not compared with the second simulator, which
/// loses twice as many digits by it as ours.
const FLAT: f64 = 100.0;

impl Path {
    /// All of them.
    pub fn all() -> Vec<Self> {
        let solvers = [LinearSolver::Dense, LinearSolver::Sparse].map(Self::Solver);
        let others = [Self::Embedded, Self::Threads];
        let symmetries = Symmetry::ALL.map(Self::Symmetry);
        [&[Self::Second], &solvers[..], &others, &symmetries].concat()
    }

    /// Its name.
    pub fn name(self) -> String {
        match self {
            Self::Second => "the second simulator".to_owned(),
            Self::Solver(LinearSolver::Dense) => "our own with dense matrices".to_owned(),
            Self::Solver(_) => "our own with sparse matrices".to_owned(),
            Self::Embedded => "our own in three dimensions".to_owned(),
            Self::Threads => "our own in one thread and in several".to_owned(),
            Self::Symmetry(symmetry) => format!("our own on {}", symmetry.words()),
        }
    }

    /// The judge of this path.
    pub fn judge(self) -> Judge {
        let classes: fn(Class) -> bool = match self {
            // The variants of the stop of an iteration are those of the second simulator.
            Self::Second => |class| matches!(class, Class::Order | Class::Start | Class::Rounding),
            _ => |class| !matches!(class, Class::Formula | Class::Solver),
        };
        let clear = match self {
            Self::Second | Self::Solver(_) => CLEAR,
            Self::Symmetry(Symmetry::Translation | Symmetry::SideBySide) => CLEAR,
            _ => Strictness::default().clear,
        };
        let strictness = Strictness { clear, clear_alone: clear, ..Strictness::default() };
        Judge { strictness, classes }
    }
}

impl Subject for Path {
    fn start(&self, scene: &Scene, _text: &str) -> Result<Box<dyn StateSource>, Verdict> {
        let states = |scene: &Scene| {
            let states = catch_unwind(AssertUnwindSafe(|| self.states(scene)));
            let states = states.unwrap_or_else(|panic| {
                Err(gave_up(&format!("a panic: {}", panic_message(panic.as_ref()))))
            })?;
            Ok(Box::new(Held::of(states)))
        };
        match self {
            Self::Symmetry(symmetry) if !symmetry.holds(scene) => Err(lacks("this symmetry")),
            Self::Symmetry(symmetry) => Ok(symmetry.back(scene, states(&symmetry.of(scene))?)),
            _ => Ok(states(scene)?),
        }
    }

    fn has_symmetries(&self) -> bool {
        !matches!(self, Self::Symmetry(_))
    }
}

impl Path {
    /// The states of a scene. The second simulator has none of methods whose result depends on how they go about it.
    fn states(self, scene: &Scene) -> Result<Vec<State>, Verdict> {
        match self {
            Self::Second if scene.forces.iter().any(is_flat) => Err(lacks("flat elements")),
            Self::Second => second(scene),
            Self::Solver(solver) => ours(scene, solver),
            Self::Symmetry(_) => ours(scene, LinearSolver::Auto),
            Self::Threads => threads(scene),
            // Wind blows along z, and an angle in space has no sign.
            Self::Embedded if !scene.forces.iter().all(is_same_in_space) => {
                Err(lacks("a force that differs in three dimensions"))
            }
            Self::Embedded => {
                let flat = Scene { dimension: Dimension::Three, ..scene.clone() };
                let mut states = ours(&flat, LinearSolver::Auto)?;
                if scene.dimension == Dimension::Two {
                    for state in &mut states {
                        for values in [&mut state.positions, &mut state.velocities] {
                            *values = values.chunks(3).flat_map(|row| row[..2].to_vec()).collect();
                        }
                    }
                }
                Ok(states)
            }
        }
    }
}

fn gave_up(reason: &str) -> Verdict {
    Verdict::Fail(Failure::GaveUp { reason: reason.to_owned().into() })
}

fn lacks(words: &str) -> Verdict {
    Verdict::Fail(Failure::NotImplemented(Lack::LeftOut { words: words.to_owned() }))
}

/// Whether an undeformed triangle is nearly on a line, or an undeformed tetrahedron nearly in a plane.
fn is_flat(force: &ForceElement) -> bool {
    let places = force.undeformed();
    let &[a, b, c] = &places[..places.len().min(3)] else { return false };
    let edge = |from: [f64; 3], to: [f64; 3]| [0, 1, 2].map(|axis| to[axis] - from[axis]);
    let dot = |u: [f64; 3], v: [f64; 3]| u.iter().zip(v).map(|(u, v)| u * v).sum::<f64>();
    let (u, v, w) = (edge(a, b), edge(a, c), edge(b, c));
    let mut longest = [u, v, w].map(|edge| dot(edge, edge)).into_iter().fold(0.0, f64::max);
    let area = 0.5 * (dot(u, u) * dot(v, v) - dot(u, v).powi(2)).max(0.0).sqrt();
    let mut size = area;
    if let Some(top) = places.get(3) {
        let edges = [a, b, c].map(|corner| edge(corner, *top));
        longest = edges.into_iter().map(|edge| dot(edge, edge)).fold(longest, f64::max);
        let normal = [0, 1, 2].map(|axis| {
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            u[next] * v[last] - u[last] * v[next]
        });
        // The area of a triangle of the height of the tetrahedron.
        let height = dot(normal, edges[0]).abs() / (2.0 * area);
        size = area.min(0.5 * longest.sqrt() * height);
    }
    longest > FLAT * size
}

/// Whether a force in the plane is the same in three dimensions.
fn is_same_in_space(force: &ForceElement) -> bool {
    force.schema.stencil.size() <= 2 && !force.schema.depends_on().time
}

/// One thread, and several.
static POOLS: LazyLock<Result<[ThreadPool; 2], String>> = LazyLock::new(|| {
    let pool = |count| ThreadPoolBuilder::new().num_threads(count).build();
    let pool = |count| pool(count).map_err(|error| error.to_string());
    Ok([pool(1)?, pool(3)?])
});

/// The states of a scene, if copies of it have the same bits by one thread and by several.
fn threads(scene: &Scene) -> Result<Vec<State>, Verdict> {
    let count = scene.particles.len();
    let mut large = symmetry::copies(scene, COPIED.div_ceil(count).max(2));
    large.duration = large.duration.min(STEPS * large.time_step);
    // So many elements without an effect, between two copies, that threads begin.
    let is_pair = |kind: &&&ForceKind| {
        kind.schema.stencil.size() == 2 && kind.schema.stencil != Stencil::Edge
    };
    if let Some(kind) = force::REGISTRY.iter().find(is_pair) {
        let idle = ForceElement::new(&kind.schema, &[0, count], None, kind.schema.zeros());
        let missing = PARALLEL.saturating_sub(large.forces.len());
        large.forces.extend(std::iter::repeat_n(idle, missing));
    }
    let pools = POOLS.as_ref().map_err(|error| gave_up(error))?;
    let [one, several] =
        pools.each_ref().map(|pool| pool.install(|| ours(&large, LinearSolver::Auto)));
    // A step that fails does so by any number of threads.
    if one != several {
        return Err(gave_up("one thread and several give different bits"));
    }
    ours(scene, LinearSolver::Auto)
}

fn ours(scene: &Scene, solver: LinearSolver) -> Result<Vec<State>, Verdict> {
    let mut source = builtin::start(scene, solver);
    let (mut state, mut states) = (State::zeros(Shape::of(scene)), Vec::new());
    while source.read(&mut state).map_err(Verdict::Fail)? {
        states.push(state.clone());
    }
    Ok(states)
}

fn second(scene: &Scene) -> Result<Vec<State>, Verdict> {
    let Some(mut second) = Second::new(scene, Style::default(), 0) else {
        return ours(scene, LinearSolver::Auto);
    };
    let first = State { time: None, positions: scene.positions(), velocities: scene.velocities() };
    let mut states = vec![first];
    for step in 0..scene.n_steps() {
        let mut state = states[states.len() - 1].clone();
        let earlier = states.len().checked_sub(2).map(|earlier| &states[earlier]);
        if !second.step(step, earlier, &mut state.positions, &mut state.velocities) {
            return Err(gave_up("the second simulator has no answer"));
        }
        states.push(state);
    }
    Ok(states)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::campaign::{Campaign, Plan, run};
    use crate::draw::Scope;
    use crate::report::text;
    use crate::shrink::Effort;

    /// Asserts that no path differs in so many scenes.
    fn assert_agree(seed: u64, scenes: u64) {
        for path in Path::all() {
            let plan = Plan {
                scope: Scope::all(),
                seed,
                time: Duration::MAX,
                scenes,
                failures: 1,
                effort: Effort::default(),
            };
            let campaign: Campaign = run(&path, &path.judge(), &plan, &|| false, &|_| {});
            let mut report = Vec::new();
            text::write(&mut report, &path.name(), &campaign, 100).unwrap();
            assert_eq!(campaign.tally.wrong, 0, "{}", String::from_utf8_lossy(&report));
            // Three dimensions and symmetries are refused of some forces.
            assert!(4 * campaign.tally.right > scenes, "{}", String::from_utf8_lossy(&report));
        }
    }

    #[test]
    fn every_path_agrees_on_drawn_scenes() {
        assert_agree(1, 80);
    }

    #[test]
    #[ignore = "long: some minutes"]
    fn long_every_path_agrees_on_many_drawn_scenes() {
        assert_agree(2, 5000);
    }
}
