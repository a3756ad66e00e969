//! Faults of the rows of traces, seen in all scenes: how many there are, and which.
//!
//! ```text
//! times       they count by another time step, and the steps are right by that of the scene, in some scenes
//! integer     there are as many as for a duration without its fraction, in every scene
//! from one    the first row, of step 1, is the initial state, or the one after it
//! fields      as many as free particles have, in every scene with fixed ones
//! column      one number of each particle stands in the place of another one, in every row of every scene
//! single      the rows of some scenes end with what a right program has then, in single precision
//! the same    all rows of a trace are one state, or have its positions: that of the end in some scenes, so that it is in all
//! ```

use std::cmp::Ordering;

use scene::trace::State;
use scene::{Scene, step_count};
use simulator::simulation::Simulation;
use simulator::solver::linear::LinearSolver;

use super::FEW;
use super::evidence::{Marked, SceneEvidence};
use super::form::{Kind, NAMES, same, time_column};
use super::judged::{JudgedScene, Outcome};
use super::restore::is_start;
use crate::steps;

/// States after which numbers of a program in single precision are off by more than a rounding.
const LONG: usize = 50;

/// Gives scenes the kind of failure that all of them show together.
pub(super) fn settle(scenes: &mut [SceneEvidence<'_>]) {
    settle_times(scenes);
    settle_durations(scenes);
    settle_long_durations(scenes);
    settle_fields(scenes);
    settle_same(scenes);
    settle_first_rows(scenes);
    settle_columns(scenes);
    settle_single(scenes);
}

/// Scenes of a plane in which one number of each particle stands in the place of another one in every row, if that is so in
/// all: forces make a difference between what is read so.
fn settle_columns(scenes: &mut [SceneEvidence<'_>]) {
    let is_plane = |scene: &&SceneEvidence<'_>| scene.scene.dimension.count() == 2;
    let rows = || scenes.iter().filter(is_plane).flat_map(|scene| scene.judged.states);
    let places = || 0..NAMES.len();
    let pairs = places().flat_map(|of| places().map(move |from| [of, from]));
    let is_copied = |[of, from]: [usize; 2]| {
        let is_so = |row: &State| {
            let numbers = |place: usize| {
                let all = if place < 2 { &row.positions } else { &row.velocities };
                all.iter().skip(place % 2).step_by(2)
            };
            numbers(of).map(|value| value.to_bits()).eq(numbers(from).map(|value| value.to_bits()))
        };
        of != from && rows().all(is_so)
    };
    let is_shown = |scene: &SceneEvidence<'_>| {
        is_plane(&scene) && scene.judged.states.len() > 2 && !scene.scene.forces.is_empty()
    };
    if scenes.iter().filter(|scene| scene.kind.is_some() && is_shown(scene)).count() < FEW {
        return;
    }
    // Each of two equal columns may be the wrong one: the first number that is wrong says which.
    let first = |scene: &&SceneEvidence<'_>| {
        let first = scene.judged.first_wrong.filter(|_| is_shown(scene))?;
        let row = first.context.iter().find(|row| row.step == first.step)?;
        row.got.iter().zip(&row.expected).position(|(got, right)| !same(&[*got], &[*right]))
    };
    let wrong: Vec<usize> = scenes.iter().filter_map(|scene| first(&scene)).collect();
    let mut copied = pairs.filter(|pair| wrong.contains(&pair[0]) && is_copied(*pair));
    let (Some([of, from]), None) = (copied.next(), copied.next()) else { return };
    for scene in scenes.iter_mut().filter(|scene| is_plane(&&**scene)) {
        if scene
            .kind
            .as_ref()
            .is_some_and(|kind| kind.shows_start() || *kind == Kind::InitialWritten)
        {
            scene.kind = Some(Kind::Column([of, from]));
        }
    }
}

/// Single precision of the written numbers alone, if long scenes end as those of a right program do.
fn settle_single(scenes: &mut [SceneEvidence<'_>]) {
    let is_long = |scene: &SceneEvidence<'_>| {
        scene.kind == Some(Kind::Single) && scene.judged.states.len() > LONG
    };
    let long: Vec<&SceneEvidence<'_>> = scenes.iter().filter(|scene| is_long(scene)).collect();
    let are_rounded = |got: &[f64], right: &[f64]| {
        let half = 0.51 * f64::from(f32::EPSILON);
        got.iter().zip(right).all(|(got, right)| (got - right).abs() <= half * right.abs())
    };
    if long.len() < FEW || !long.into_iter().all(|scene| ends_as(scene.judged, are_rounded)) {
        return;
    }
    for scene in scenes.iter_mut().filter(|scene| scene.kind == Some(Kind::Single)) {
        scene.kind = Some(Kind::SingleWritten);
    }
}

/// Scenes whose times alone are wrong, if so are those of some in which every step is right.
fn settle_times(scenes: &mut [SceneEvidence<'_>]) {
    let counts = |scene: &SceneEvidence<'_>| matches!(scene.kind, Some(Kind::TimeStep(_)));
    let is_right = |scene: &SceneEvidence<'_>| scene.steps.total > 0 && scene.steps.wrong == 0;
    if scenes.iter().filter(|scene| counts(scene) && is_right(scene)).count() < FEW {
        return;
    }
    for scene in scenes.iter_mut().filter(|scene| counts(scene)) {
        scene.kind = time_column(scene.judged).or_else(|| scene.kind.take());
    }
}

/// Scenes whose traces end early by one rule: that of an integer duration, or the same time, part of the duration, or number
/// of steps in all of these.
fn settle_durations(scenes: &mut [SceneEvidence<'_>]) {
    let is_so = |scene: &SceneEvidence<'_>| {
        let inner = scene.judged.scene;
        let read = step_count(inner.duration.trunc(), inner.time_step) + 1.0;
        match scene.judged.outcome {
            Outcome::Passed | Outcome::Differs => read == inner.n_steps() as f64 + 1.0,
            Outcome::TooShort { states, .. } => read == states as f64,
            Outcome::TooLong => false,
            _ => true,
        }
    };
    let short = scenes.iter().filter(|scene| scene.kind == Some(Kind::EndsEarly));
    // Of each, the last step, the number of steps, and the time step.
    let ends: Vec<[f64; 3]> = short
        .map(|scene| {
            let inner = scene.judged.scene;
            [scene.judged.states.len() as f64 - 1.0, inner.n_steps() as f64, inner.time_step]
        })
        .collect();
    // Numbers of which each may be a step off.
    let are_same = |of: fn([f64; 3]) -> [f64; 2]| {
        let below = ends.iter().map(|end| of(*end)).map(|[x, off]| x - off);
        let above = ends.iter().map(|end| of(*end)).map(|[x, off]| x + off);
        below.fold(0.0, f64::max) <= above.fold(f64::INFINITY, f64::min)
    };
    let rules = [
        |[last, _, _]: [f64; 3]| [last, 0.0],
        |[last, _, h]: [f64; 3]| [last * h, h],
        |[last, all, _]: [f64; 3]| [last / all, 1.0 / all],
    ];
    let kind = match ends.len() {
        ..FEW => return,
        _ if scenes.iter().all(is_so) => Kind::IntegerDuration,
        _ if rules.into_iter().any(are_same) => Kind::Duration,
        _ => return,
    };
    for scene in scenes {
        let is_one_less = scene.kind == Some(Kind::StateTooFew) && kind == Kind::IntegerDuration;
        if scene.kind == Some(Kind::EndsEarly) || is_one_less {
            scene.kind = Some(kind.clone());
        }
    }
}

/// Scenes whose traces have too many states, if those have it whose duration is no integer, and no others.
fn settle_long_durations(scenes: &mut [SceneEvidence<'_>]) {
    let is_long = |scene: &SceneEvidence<'_>| scene.kind == Some(Kind::StateTooMany);
    let is_whole = |scene: &SceneEvidence<'_>| scene.judged.scene.duration.fract() == 0.0;
    let is_shown = |scene: &&SceneEvidence<'_>| {
        is_long(scene) || matches!(scene.judged.outcome, Outcome::Passed | Outcome::Differs)
    };
    let (whole, other): (Vec<_>, Vec<_>) =
        scenes.iter().filter(is_shown).partition(|one| is_whole(one));
    let is_so = whole.iter().all(|one| !is_long(one)) && other.iter().all(|one| is_long(one));
    if is_so && whole.len().min(other.len()) >= FEW {
        for scene in scenes.iter_mut().filter(|scene| is_long(scene)) {
            scene.kind = Some(Kind::RoundedDuration);
        }
    }
}

/// Scenes whose rows have the numbers of free particles alone, if so have all with fixed ones.
fn settle_fields(scenes: &mut [SceneEvidence<'_>]) {
    let count = |scene: &Scene, n_particles: usize| 2 + 2 * scene.dimension.count() * n_particles;
    let is_so = |scene: &SceneEvidence<'_>| {
        let inner = scene.judged.scene;
        let free = inner.particles.iter().filter(|particle| !particle.fixed).count();
        match scene.judged.outcome {
            Outcome::Fields { expected, found } => {
                [expected, found] == [inner.particles.len(), free].map(|n| count(inner, n))
            }
            _ => scene.judged.states.is_empty() || free == inner.particles.len(),
        }
    };
    let is_other =
        |scene: &&SceneEvidence<'_>| matches!(scene.judged.outcome, Outcome::Fields { .. });
    if scenes.iter().filter(is_other).count() < FEW || !scenes.iter().all(is_so) {
        return;
    }
    for scene in scenes.iter_mut().filter(|scene| is_other(&&**scene)) {
        scene.kind = Some(Kind::FixedLeftOut);
    }
}

/// Scenes whose traces start with step 1, if all that move start with the initial state, or none and some with the next.
fn settle_first_rows(scenes: &mut [SceneEvidence<'_>]) {
    let is_open = |scene: &SceneEvidence<'_>| scene.kind == Some(Kind::StartsAtOne);
    let (mut n_moving, mut n_initial, mut n_next) = (0, 0, 0);
    for scene in scenes.iter().filter(|scene| is_open(scene)) {
        let (inner, states) = (scene.judged.scene, scene.judged.states);
        let moves = states.windows(2).any(|pair| {
            pair[0].positions != pair[1].positions || pair[0].velocities != pair[1].velocities
        });
        if !moves {
            continue;
        }
        let (positions, velocities) = (inner.positions(), inner.velocities());
        let start = State { time: None, positions, velocities };
        let (steps, _) = steps::examine(inner, &[start, states[0].clone()], 0.0);
        n_moving += 1;
        n_initial += usize::from(is_start(inner, &states[0]));
        n_next += usize::from(steps.total > steps.wrong);
    }
    let kind = if n_initial == n_moving && n_moving >= FEW {
        Kind::CountsFromOne
    } else if n_initial == 0 && n_next >= FEW {
        Kind::InitialMissing
    } else {
        return;
    };
    for scene in scenes.iter_mut().filter(|scene| is_open(scene)) {
        scene.kind = Some(kind.clone());
    }
}

/// Scenes whose traces have the same positions in all rows, which are not the initial ones.
fn settle_same(scenes: &mut [SceneEvidence<'_>]) {
    let all: Vec<Option<Same>> = scenes.iter().map(|scene| same_in_rows(scene.judged)).collect();
    let shows = |scene: &SceneEvidence<'_>| {
        let rows = scene.judged.first_wrong.map_or(&[][..], |first| first.context);
        let moves = rows.windows(2).any(|pair| pair[0].expected != pair[1].expected);
        let is_open = matches!(
            scene.kind,
            Some(Kind::InitialState | Kind::InitialOpen | Kind::InitialWritten)
        );
        moves && is_open && scene.judged.states.len() > 2
    };
    let shown = scenes.iter().zip(&all).filter(|(scene, same)| same.is_some() && shows(scene));
    let shown: Vec<&SceneEvidence<'_>> = shown.map(|(scene, _)| scene).collect();
    if shown.len() < FEW {
        return;
    }
    let is_end = shown.iter().filter(|scene| ends_right(scene.judged)).count() >= FEW;
    let has = |same: Same| all.contains(&Some(same));
    let end = match (has(Same::States), has(Same::Positions)) {
        (true, false) => "every state is the same, the one at the end",
        (true, true) => {
            "every state is the same, the one at the end; in some scenes, in its positions only"
        }
        _ => "the positions of every state are those at the end",
    };
    for (scene, same) in scenes.iter_mut().zip(all) {
        scene.kind = match same {
            Some(_) if is_end => Some(Kind::LastState(end)),
            Some(Same::States) => Some(Kind::OneState),
            _ => continue,
        };
    }
}

/// The values that are the same in all rows of a trace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Same {
    Positions,
    /// The velocities as well.
    States,
}

/// The values that are the same in all rows of a trace that starts wrong.
fn same_in_rows(judged: &JudgedScene<'_>) -> Option<Same> {
    let first = judged.first_wrong.filter(|first| first.step == 0)?;
    let axes = judged.scene.dimension.count();
    // Traces of large scenes are not kept.
    let kept = judged.states.iter().map(|one| [&one.positions[..], &one.velocities]);
    let shown = first.context.iter().map(|row| [&row.got[..axes], &row.got[axes..]]);
    let rows: Vec<[&[f64]; 2]> =
        if judged.states.is_empty() { shown.collect() } else { kept.collect() };
    let is_same = |kind: usize| rows.windows(2).all(|pair| pair[0][kind] == pair[1][kind]);
    let all = if is_same(1) { Same::States } else { Same::Positions };
    (rows.len() > 1 && is_same(0)).then_some(all)
}

/// Whether the last state of a trace is that of a right program.
fn ends_right(judged: &JudgedScene<'_>) -> bool {
    ends_as(judged, same)
}

/// Whether this holds of the last state of a trace and that of a right program: of positions, and of velocities.
fn ends_as(judged: &JudgedScene<'_>, are: fn(&[f64], &[f64]) -> bool) -> bool {
    let scene = judged.scene;
    let Some(last) = judged.states.last().filter(|_| !judged.has_positions_alone) else {
        return false;
    };
    let mut simulation = Simulation::with_solver(scene, LinearSolver::Auto);
    for _ in 0..scene.n_steps() {
        if !matches!(simulation.advance(), Ok(true)) {
            return false;
        }
    }
    let right = simulation.state();
    are(&last.positions, right.positions) && are(&last.velocities, right.velocities)
}

/// How a program counts its steps: the ways that give right counts in the scenes that passed, and too few or too many states
/// where there are those. `None` if no scene passed, unless there are too many whether dt divides the duration or not.
pub(super) fn miscounted(scenes: &[Marked<'_>]) -> Option<String> {
    let seen = |scene: &Marked<'_>| match &scene.kind {
        None if scene.passed => Some(Ordering::Equal),
        Some(Kind::StateTooFew) => Some(Ordering::Less),
        Some(Kind::StateTooMany) => Some(Ordering::Greater),
        _ => None,
    };
    let has_more = |is_divided: bool| {
        let mut of_it = scenes.iter().filter(|one| one.judged.scene.is_divided() == is_divided);
        of_it.any(|scene| seen(scene) == Some(Ordering::Greater))
    };
    let has_right = scenes.iter().any(|scene| seen(scene) == Some(Ordering::Equal));
    let shows = has_right || has_more(true) && has_more(false);
    if !shows {
        return None;
    }
    let mut explains = [true; WAYS.len()];
    for (scene, seen) in scenes.iter().filter_map(|scene| Some((scene.judged.scene, seen(scene)?)))
    {
        let right = step_count(scene.duration, scene.time_step);
        for (explains, count) in explains.iter_mut().zip(counts(scene)) {
            *explains &= count.total_cmp(&right) == seen;
        }
    }
    let ways = WAYS.into_iter().zip(explains).filter(|(_, explains)| *explains);
    let ways: Vec<&str> = ways.map(|(words, _)| words).collect();
    (!ways.is_empty()).then(|| format!(", as where {}", ways.join(", or ")))
}

/// Ways to count steps.
const WAYS: [&str; 7] = [
    "duration/dt is rounded down",
    "duration/dt is rounded to the nearest integer",
    "duration/dt is rounded down and 1 step is added",
    "duration/dt is rounded up and 1 step is added",
    "steps end where the sum of all dt reaches the duration",
    "steps end where the sum of all dt exceeds the duration",
    "duration/dt is computed in single precision and rounded up",
];

/// The number of steps by each of [`WAYS`].
fn counts(scene: &Scene) -> [f64; WAYS.len()] {
    let ratio = scene.duration / scene.time_step;
    let below = summed(scene, |time, end| time < end);
    let up_to = summed(scene, |time, end| time <= end);
    let right = step_count(scene.duration, scene.time_step);
    let single = f64::from((scene.duration as f32 / scene.time_step as f32).ceil());
    [ratio.floor(), ratio.round(), ratio.floor() + 1.0, right + 1.0, below, up_to, single]
}

/// Steps that are taken while this holds of the sum of their dt and the duration.
fn summed(scene: &Scene, goes_on: fn(f64, f64) -> bool) -> f64 {
    let right = step_count(scene.duration, scene.time_step);
    let (mut time, mut count) = (0.0, 0.0);
    while goes_on(time, scene.duration) && count <= right {
        time += scene.time_step;
        count += 1.0;
    }
    count
}
