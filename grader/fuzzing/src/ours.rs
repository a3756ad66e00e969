//! Our own simulator, tested as any program is: against the second one, and by other code paths against itself.
//!
//! | path | differs in |
//! | --- | --- |
//! | second | laws, step equations and linear systems of `reference`, dense |
//! | dense, sparse | the solver of every coupled component |
//! | in 3D | a scene of two dimensions in the plane z = 0 |
//! | threads | one thread, and several |
//!
//! The envelope is that of our own simulator alone, with other last bits and other orders of sums: a mistake that the second
//! simulator would show does not widen it.

use std::panic::{AssertUnwindSafe, catch_unwind};

use grader::compare::calibration::Class;
use grader::grading::panic_message;
use grader::submission::{StateSource, builtin};
use grader::verdict::{Failure, Verdict};
use reference::second::{Second, Style};
use scene::trace::{Shape, State};
use scene::{Dimension, Scene};
use simulator::solver::linear::LinearSolver;

use crate::judge::{Judge, Subject};
use crate::motion::Held;

/// A way to simulate a scene that is not the usual one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Path {
    /// The second simulator.
    Second,
    /// Our own with this solver.
    Solver(LinearSolver),
    /// Our own in three dimensions.
    Embedded,
    /// Our own in one thread.
    OneThread,
}

impl Path {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Second,
        Self::Solver(LinearSolver::Dense),
        Self::Solver(LinearSolver::Sparse),
        Self::Embedded,
        Self::OneThread,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Second => "the second simulator",
            Self::Solver(LinearSolver::Dense) => "our own with dense matrices",
            Self::Solver(_) => "our own with sparse matrices",
            Self::Embedded => "our own in three dimensions",
            Self::OneThread => "our own in one thread",
        }
    }

    /// The judge of this path.
    pub fn judge(self) -> Judge {
        let classes = |class| matches!(class, Class::Order | Class::Start | Class::Rounding);
        Judge { classes, ..Judge::default() }
    }
}

impl Subject for Path {
    fn start(&self, scene: &Scene, _text: &str) -> Result<Box<dyn StateSource>, Verdict> {
        let states = catch_unwind(AssertUnwindSafe(|| self.states(scene)));
        let states = states.unwrap_or_else(|panic| {
            let reason = format!("a panic: {}", panic_message(panic.as_ref()));
            Err(Verdict::Fail(Failure::GaveUp { reason: reason.into() }))
        })?;
        Ok(Box::new(Held::of(states)))
    }
}

impl Path {
    /// The states of a scene. The second simulator has none of methods whose result depends on how they go about it.
    fn states(self, scene: &Scene) -> Result<Vec<State>, Verdict> {
        match self {
            Self::Second => second(scene),
            Self::Solver(solver) => ours(scene, solver),
            Self::OneThread => {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
                match pool {
                    Ok(pool) => pool.install(|| ours(scene, LinearSolver::Auto)),
                    Err(_) => ours(scene, LinearSolver::Auto),
                }
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
            let reason = "the second simulator has no answer".to_owned();
            return Err(Verdict::Fail(Failure::GaveUp { reason: reason.into() }));
        }
        states.push(state);
    }
    Ok(states)
}
