//! Undoes a fault of the output in all traces, so that the steps in them can be examined for other mistakes.
//!
//! A fault is undone only where that makes traces right: in some scenes every step is right then, from the scene's own
//! initial state on. In the others, what is wrong then is another mistake.

use std::cmp::Ordering;

use rayon::prelude::*;
use scene::Scene;
use scene::schema::StepEquation;
use scene::trace::State;

use super::evidence::Marked;
use super::feature::Feature;
use super::form::{Kind, SAME, largest, same};
use super::judged::{JudgedScene, Outcome};
use super::{FEW, TIME_STEPS, constant_step, time_step_rule};
use crate::steps::{self, Evidence, WrongSteps};

/// Orders of the numbers that are tried: more than one where scenes hardly tell them apart.
const MOST: usize = 4;

/// A transformation of the states of a trace into those of the program's steps.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Undo {
    /// Numbers written in one order and read in another.
    Order {
        written: Layout,
        read: Layout,
    },
    Negated,
    /// Each state is that of the step before.
    Late,
    /// The scene's initial state is not written.
    Missing,
    /// Rows have wrong numbers or times alone.
    Renumbered,
    /// The velocities are those of the step before.
    VelocitiesLate,
    /// Each velocity is multiplied by the mass.
    Momenta,
    /// Velocities along this axis are not written: differences of positions give them.
    Unwritten(usize),
    /// The time step is another one, by this rule of [`TIME_STEPS`].
    TimeStep(usize),
    /// It is this one.
    ConstantStep(f64),
    /// Positions and velocities of the first state, in the place of the scene's.
    Start,
    /// The same, and masses in single precision; parameters of forces and the time step as well, if so.
    Single {
        everywhere: bool,
    },
}

/// An order of the numbers of a state.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Layout {
    /// The nested loops, the slowest first: position or velocity, particle, axis.
    loops: [usize; 3],
    velocities_first: bool,
    /// Whether the axes of positions, of velocities, count down.
    axes_down: [bool; 2],
    particles_down: bool,
}

/// Orders of three loops.
const LOOPS: [[usize; 3]; 6] = [[1, 0, 2], [0, 1, 2], [0, 2, 1], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

impl Layout {
    /// The orders in which traces are read: a row of CSV, a record of FOSSSim's binary format.
    const READ: [Self; 2] = [Self::plain(LOOPS[0]), Self::plain(LOOPS[1])];

    const fn plain(loops: [usize; 3]) -> Self {
        Self { loops, velocities_first: false, axes_down: [false; 2], particles_down: false }
    }

    fn all() -> impl Iterator<Item = Self> {
        let flags = (0..16_u8).map(|bits| [1, 2, 4, 8].map(|bit| bits & bit != 0));
        flags.flat_map(|[velocities_first, x_down, v_down, particles_down]| {
            LOOPS.map(|loops| Self {
                loops,
                velocities_first,
                axes_down: [x_down, v_down],
                particles_down,
            })
        })
    }

    /// The place of each number, counted as all positions, then all velocities.
    fn places(self, particles: usize, axes: usize) -> Vec<usize> {
        let sizes = [2, particles, axes];
        let all = (0..2).flat_map(|kind| {
            (0..particles)
                .flat_map(move |particle| (0..axes).map(move |axis| [kind, particle, axis]))
        });
        let place = |[kind, particle, axis]: [usize; 3]| {
            let down = |is_down: bool, number: usize, size: usize| match is_down {
                true => size - 1 - number,
                false => number,
            };
            let counts = [
                down(self.velocities_first, kind, 2),
                down(self.particles_down, particle, particles),
                down(self.axes_down[kind], axis, axes),
            ];
            self.loops.iter().fold(0, |place, &one| place * sizes[one] + counts[one])
        };
        all.map(place).collect()
    }
}

impl Layout {
    /// How it differs from another one, in words.
    fn beside(self, other: Self) -> String {
        let mut all = Vec::new();
        if self.loops != other.loops || self.velocities_first != other.velocities_first {
            let mut names = [("positions", "position"), ("velocities", "velocity")];
            if self.velocities_first {
                names.reverse();
            }
            let [(first, one), (second, two)] = names;
            all.push(match self.loops {
                [0, 1, 2] => format!("all {first} stand before all {second}"),
                [0, 2, 1] => format!("all {first} stand before all {second}, each axis by axis"),
                [1, 0, 2] => format!("the {one} of each particle stands before its {two}"),
                [1, 2, 0] => {
                    format!("of each particle, the {one} and the {two} along x stand before those along y")
                }
                [2, 0, 1] => format!("all numbers along x stand before those along y, {first} first"),
                _ => format!("all numbers along x stand before those along y, the {one} of each particle before its {two}"),
            });
        }
        match self.axes_down {
            [true, true] => all.push("x and y are exchanged".to_owned()),
            [true, false] => all.push("x and y of positions are exchanged".to_owned()),
            [false, true] => all.push("x and y of velocities are exchanged".to_owned()),
            [false, false] => {}
        }
        if self.particles_down {
            all.push("the last particle comes first".to_owned());
        }
        all.join("; ")
    }
}

impl Undo {
    /// The order that it undoes, in words; `None` where its kind says all.
    fn layout(self) -> Option<String> {
        match self {
            Self::Order { written, read } => Some(written.beside(read)),
            _ => None,
        }
    }

    /// The candidates for undoing a fault of this kind in these scenes.
    fn of(kind: &Kind, scenes: &[Marked<'_>]) -> Vec<Self> {
        match kind {
            Kind::Times => {
                let rule = time_step_rule(scenes).map(Self::TimeStep);
                rule.or(constant_step(scenes).map(Self::ConstantStep)).into_iter().collect()
            }
            Kind::Order => {
                let orders = Layout::all()
                    .flat_map(|written| Layout::READ.map(|read| Self::Order { written, read }));
                orders.collect()
            }
            Kind::Negated => vec![Self::Negated],
            Kind::Late => vec![Self::Late],
            Kind::InitialMissing => vec![Self::Missing],
            Kind::CountsFromOne | Kind::TimeColumn(_) => vec![Self::Renumbered],
            Kind::VelocitiesLate => vec![Self::VelocitiesLate],
            Kind::Momenta => vec![Self::Momenta],
            Kind::Column([of, _]) => of.checked_sub(2).map(Self::Unwritten).into_iter().collect(),
            Kind::InitialVelocity
            | Kind::FixedStopped
            | Kind::InitialState
            | Kind::InitialRead(_) => vec![Self::Start],
            Kind::InitialRounded => {
                let single = [false, true].map(|everywhere| Self::Single { everywhere });
                [Self::Start].into_iter().chain(single).collect()
            }
            Kind::ReadInSingle => vec![Self::Single { everywhere: true }],
            _ => Vec::new(),
        }
    }

    /// The scene that the program stepped, and its states; `None` where there is no step.
    fn undone(self, scene: &Scene, states: &[State]) -> Option<(Scene, Vec<State>)> {
        let [first, _, ..] = states else { return None };
        let mut scene = scene.clone();
        let mut states = states.to_vec();
        let (particles, axes) = (scene.particles.len(), scene.dimension.count());
        match self {
            Self::Order { written, read } => {
                let [written, read] = [written, read].map(|one| one.places(particles, axes));
                states.iter_mut().for_each(|state| *state = ordered(state, &written, &read));
            }
            Self::Negated => {
                let numbers = states
                    .iter_mut()
                    .flat_map(|state| state.positions.iter_mut().chain(&mut state.velocities));
                numbers.for_each(|value| *value = -*value);
            }
            Self::Momenta => {
                for state in &mut states {
                    let each = state.velocities.chunks_mut(axes).zip(&scene.particles);
                    each.for_each(|(v, one)| v.iter_mut().for_each(|v| *v /= one.mass));
                }
            }
            Self::Unwritten(axis) => derive_velocities(&scene, &mut states, axis)?,
            Self::TimeStep(rule) => scene.time_step = TIME_STEPS[rule].1(&scene),
            Self::ConstantStep(step) => scene.time_step = step,
            Self::Renumbered => {}
            Self::Late => drop(states.drain(..1)),
            Self::Missing => {
                let (positions, velocities) = (scene.positions(), scene.velocities());
                states.insert(0, State { time: None, positions, velocities });
            }
            Self::VelocitiesLate => {
                for number in 1..states.len() {
                    states[number - 1].velocities = states[number].velocities.clone();
                }
                states.pop();
            }
            Self::Start | Self::Single { .. } => {
                for (number, particle) in scene.particles.iter_mut().enumerate() {
                    let of = number * axes..(number + 1) * axes;
                    particle.position[..axes].copy_from_slice(&first.positions[of.clone()]);
                    particle.velocity[..axes].copy_from_slice(&first.velocities[of]);
                }
                if let Self::Single { everywhere } = self {
                    let single = |value: &mut f64| *value = f64::from(*value as f32);
                    scene.particles.iter_mut().for_each(|particle| single(&mut particle.mass));
                    if everywhere {
                        let all = scene.forces.iter_mut().flat_map(|force| &mut force.parameters);
                        all.for_each(single);
                        single(&mut scene.time_step);
                    }
                }
            }
        }
        Some((scene, states))
    }

    /// The relative error of the velocities that it computes from positions.
    fn rounding(self, scene: &Scene, states: &[State]) -> f64 {
        if !matches!(self, Self::Unwritten(_)) {
            return 0.0;
        }
        let size = |of: fn(&State) -> &Vec<f64>| {
            states.iter().map(|state| largest(of(state))).fold(0.0, f64::max)
        };
        let [x, v] = [size(|state| &state.positions), size(|state| &state.velocities)];
        2.0 * f64::EPSILON * (1.0 + x / (scene.time_step * v).max(f64::MIN_POSITIVE))
    }

    /// Whether the first state is that of the scene then; true where there is no step.
    fn starts_right(self, judged: &JudgedScene<'_>) -> bool {
        let first_two = &judged.states[..judged.states.len().min(2)];
        let undone = self.undone(judged.scene, first_two);
        undone.is_none_or(|(stepped, states)| is_start(&stepped, &states[0]))
    }
}

/// The numbers of a state, each from the place where it was written.
fn ordered(state: &State, written: &[usize], read: &[usize]) -> State {
    let numbers = [state.positions.as_slice(), &state.velocities].concat();
    let mut file = vec![0.0; numbers.len()];
    for (number, place) in numbers.iter().zip(read) {
        file[*place] = *number;
    }
    let right: Vec<f64> = written.iter().map(|place| file[*place]).collect();
    let (positions, velocities) = right.split_at(state.positions.len());
    State { time: state.time, positions: positions.to_vec(), velocities: velocities.to_vec() }
}

/// A scene whose trace is put right.
pub(super) struct Restored {
    /// Its number.
    pub(super) number: usize,
    /// Where the fault is that is undone.
    pub(super) feature: Feature,
    /// The order of its numbers, in words, where it is another one and no second order explains as much.
    pub(super) layout: Option<String>,
    /// Relative error of its velocities, where they are computed from positions.
    pub(super) rounding: f64,
    scene: Scene,
    states: Vec<State>,
    envelope: Vec<[f64; 2]>,
    /// Whether it passed, whatever the fault.
    pub(super) passed: bool,
    /// Whether every step is right then, up to the rounding of numbers that the program computes from others.
    pub(super) is_right: bool,
}

impl Restored {
    /// The scene that was stepped, with the states of its steps.
    pub(super) fn judged<'a>(&'a self, of: &JudgedScene<'a>) -> JudgedScene<'a> {
        JudgedScene {
            name: of.name,
            scene: &self.scene,
            is_required: of.is_required,
            outcome: if self.passed { Outcome::Passed } else { Outcome::Differs },
            was_run: true,
            first_wrong: None,
            largest: of.largest,
            has_positions_alone: of.has_positions_alone,
            has_other_root: of.has_other_root,
            envelope: self.envelope.clone(),
            states: &self.states,
        }
    }
}

/// Whether a state is the scene's initial one, up to the order of operations.
pub(super) fn is_start(scene: &Scene, state: &State) -> bool {
    same(&state.positions, &scene.positions()) && same(&state.velocities, &scene.velocities())
}

/// Takes the velocities along an axis from the positions after and before; the last state goes where they are those before
/// the step. `None` where the steps of the method do not say which.
fn derive_velocities(scene: &Scene, states: &mut Vec<State>, axis: usize) -> Option<()> {
    let of_method = match scene.integrator.equation {
        StepEquation::ExplicitEuler => true,
        StepEquation::SymplecticEuler
        | StepEquation::LinearizedImplicitEuler
        | StepEquation::ImplicitEuler => false,
        _ => return None,
    };
    let (h, axes) = (scene.time_step, scene.dimension.count());
    let moved = |pair: &[State]| -> Vec<f64> {
        let both = pair[0].positions.iter().zip(&pair[1].positions);
        both.map(|(before, after)| (after - before) / h).collect()
    };
    let mut differences: Vec<Vec<f64>> = states.windows(2).map(moved).collect();
    // Positions along other axes show with which velocity the program moves them.
    let most = |which: usize| {
        let pairs = states.windows(2).flat_map(|pair| {
            let both = pair[0].positions.iter().zip(&pair[1].positions);
            let each = both.zip(&pair[which].velocities).enumerate();
            each.filter(|(dof, _)| dof % axes != axis).map(|(_, ((x, after), v))| after - x - h * v)
        });
        pairs.map(f64::abs).fold(0.0, f64::max)
    };
    let [old, new] = [most(0), most(1)];
    if old < SAME * new || of_method && new >= SAME * old {
        states.pop();
    } else {
        differences.insert(0, scene.velocities());
    }
    for (state, from) in states.iter_mut().zip(differences) {
        let along = state.velocities.iter_mut().zip(from).skip(axis).step_by(axes);
        along.for_each(|(velocity, difference)| *velocity = difference);
    }
    Some(())
}

/// Whether a step is off by no more than differences of positions, in the place of velocities, are.
fn is_near(Evidence { sample, defect, .. }: &Evidence) -> bool {
    let sizes = [&sample.after.positions, &sample.after.velocities].map(|all| largest(all));
    (0..2).all(|kind| defect[kind] <= SAME * sizes[kind])
}

/// The steps of a scene.
type Examined = (WrongSteps, Vec<Evidence>);

/// The wrong scenes without a fault of the output, and their steps, if undoing it makes the steps of some right; otherwise
/// none.
pub(super) fn all(scenes: &[Marked<'_>]) -> Vec<(Restored, Examined)> {
    let kind_of = |scene: &Marked<'_>| match scene.kind.clone() {
        Some(Kind::OrderOpen) => Some(Kind::Order),
        Some(Kind::TimeStep(_)) => Some(Kind::Times),
        kind => kind,
    };
    let kinds: Vec<Option<Kind>> = scenes.iter().map(kind_of).collect();
    let count = |kind: &&Kind| kinds.iter().flatten().filter(|other| other == kind).count();
    let known = kinds.iter().flatten().filter(|kind| !Undo::of(kind, scenes).is_empty());
    let Some(kind) = known.max_by_key(count) else { return Vec::new() };
    let is_of_kind = |scene: &Marked<'_>| kind_of(scene).as_ref() == Some(kind);
    let Some(feature) = kind.feature() else { return Vec::new() };
    let starts_right = |undo: &Undo| {
        let mut faulty = scenes.iter().filter(|scene| is_of_kind(scene));
        faulty.all(|scene| undo.starts_right(scene.judged))
    };
    // A trace that starts as the scene does, and not without the fault, is free of it: others may be.
    let is_everywhere = |undo: Undo| {
        !matches!(undo, Undo::Start | Undo::Single { .. })
            && scenes.iter().filter(|scene| !is_of_kind(scene)).all(|scene| {
                let judged = scene.judged;
                let first = judged.states.first();
                let is_start = first.is_some_and(|first| is_start(judged.scene, first));
                // One that starts so and moves has its initial state.
                let moves = judged.states.windows(2).any(|pair| pair[0] != pair[1]);
                let has_it = undo == Undo::Missing && moves;
                !is_start || undo.starts_right(judged) && !has_it
            })
    };
    // If the program has another mistake as well, its first state equals no state of the oracle.
    let is_other = |kind: &Kind, undo: Undo| match kind {
        Kind::InitialState | Kind::InitialOpen => undo == Undo::Missing,
        kind => *kind == Kind::Wrong,
    };
    let restore = |undo: Undo| -> Vec<(Restored, Examined)> {
        let is_everywhere = is_everywhere(undo);
        let of = |(number, scene): (usize, &Marked<'_>)| {
            let judged = scene.judged;
            let has_both =
                || scene.kind.as_ref().is_some_and(|kind| is_everywhere && is_other(kind, undo));
            // Masses are rounded in scenes whose first states have few digits as well, whether they pass or not.
            let passed = scene.passed;
            let has_states = scene.kind.as_ref().is_none_or(Kind::keeps_states);
            let is_rounded = matches!(undo, Undo::Single { .. }) && has_states;
            let is_faulty = is_of_kind(scene) || has_both() || is_rounded;
            // Times show another time step; without that, right steps do.
            let is_open =
                matches!(undo, Undo::TimeStep(_) | Undo::ConstantStep(_)) && !is_of_kind(scene);
            let undone = undo.undone(judged.scene, judged.states);
            let (scene, states) = undone.filter(|(_, states)| is_faulty && states.len() > 1)?;
            let rounding = undo.rounding(&scene, &states);
            let (steps, evidence) = steps::examine(&scene, &states, rounding);
            let is_right = steps.total > 0
                && is_start(&scene, &states[0])
                && evidence.iter().all(|one| !one.is_wrong() || is_near(one));
            if is_open && (!is_right || scene.time_step == judged.scene.time_step) {
                return None;
            }
            let envelope = judged.envelope.iter().skip(usize::from(undo == Undo::Late));
            let envelope = envelope.copied().collect();
            let layout = undo.layout();
            let restored = Restored {
                number,
                feature,
                layout,
                rounding,
                scene,
                states,
                envelope,
                passed,
                is_right,
            };
            Some((restored, (steps, evidence)))
        };
        scenes.par_iter().enumerate().filter_map(of).collect()
    };
    let n_right = |all: &[(Restored, Examined)]| all.iter().filter(|one| one.0.is_right).count();
    let possible = Undo::of(kind, scenes).into_iter().filter(starts_right).take(MOST).map(restore);
    let mut is_open = false;
    let best = possible.reduce(|best, one| {
        let more = n_right(&one).cmp(&n_right(&best));
        let layout = |all: &[(Restored, Examined)]| {
            all.first().and_then(|(restored, _)| restored.layout.clone())
        };
        let is_other = more == Ordering::Equal && layout(&one) != layout(&best);
        is_open = is_other || is_open && more != Ordering::Greater;
        if more == Ordering::Greater { one } else { best }
    });
    let mut best = best.filter(|best| n_right(best) >= FEW).unwrap_or_default();
    if is_open {
        best.iter_mut().for_each(|(restored, _)| restored.layout = None);
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers of three particles in the plane: positions from 1 on, velocities from 7 on.
    fn state() -> State {
        let numbers = |from: i32| (from..from + 6).map(f64::from).collect();
        State { time: None, positions: numbers(1), velocities: numbers(7) }
    }

    #[test]
    fn an_order_undoes_what_another_order_did() {
        let restores = |row: [i32; 12], read: Layout| {
            // The state that a reader makes of the numbers in the file.
            let places = read.places(3, 2);
            let numbers: Vec<f64> = places.iter().map(|place| f64::from(row[*place])).collect();
            let (positions, velocities) = numbers.split_at(6);
            let (positions, velocities) = (positions.to_vec(), velocities.to_vec());
            let got = State { time: None, positions, velocities };
            let undoes = |written: Layout| {
                ordered(&got, &written.places(3, 2), &read.places(3, 2)) == state()
            };
            Layout::all().any(undoes)
        };
        let [csv, binary] = Layout::READ;
        assert!(restores([1, 2, 8, 7, 3, 4, 10, 9, 5, 6, 12, 11], csv), "vx and vy exchanged");
        assert!(restores([1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12], csv), "all positions first");
        assert!(restores([1, 2, 7, 8, 3, 4, 9, 10, 5, 6, 11, 12], binary), "by particles");
        assert!(restores([7, 8, 9, 10, 11, 12, 1, 2, 3, 4, 5, 6], binary), "velocities first");
        assert!(restores([5, 6, 11, 12, 3, 4, 9, 10, 1, 2, 7, 8], csv), "particles in reverse");
        assert!(restores([1, 3, 5, 2, 4, 6, 7, 9, 11, 8, 10, 12], binary), "by axes");
        assert!(!restores([2, 1, 7, 8, 3, 4, 9, 10, 5, 6, 11, 12], csv), "one particle alone");
    }
}
