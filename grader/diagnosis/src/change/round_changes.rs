//! Changes of the steps by rounds, each with the task of the hand-out that it belongs to.

use std::fmt;
use std::sync::Arc;

use scene::Scene;

use super::edit::{Edit, edits};
use super::expression::{Expression, Leaf};
use super::rounds::{
    Count, ELASTIC, Held, Rounds, RoundsRule, Side, Summand, Task, Uses, is_elastic, local,
    rest_length,
};
use super::{
    Change, Effect, Factor, Particles, Place, Quantity, SceneRule, Term, Which, candidates,
};

/// Changes of the steps of a scene of rounds, each with the task that it belongs to; empty for other scenes.
pub fn of_rounds(scene: &Scene) -> Vec<Change> {
    if Rounds::of(scene).is_none() {
        return Vec::new();
    }
    let mut all = of_summands();
    all.extend(of_matrices());
    all.extend(of_local());
    all.extend(of_inertia_and_rounds());
    all.extend(of_rest_lengths(scene));
    all.retain(|change| change.acts_in(scene));
    all.extend(of_external(scene));
    all.sort_by_key(|change| change.rank);
    all
}

fn change(task: Task, rule: RoundsRule, rank: u8, words: impl fmt::Display) -> Change {
    Change {
        place: Place::Task(task),
        words: format!("{task}: {words}"),
        effect: Effect::Rounds(rule),
        rank,
    }
}

/// Factors, signs, powers of `Δt` and of a summand's own quantity, and omissions.
fn of_summands() -> Vec<Change> {
    let mut all = Vec::new();
    for (summand, quantity, names) in [
        (Summand::Springs, "k", ["the springs", "k AᵀA", "k Aᵀd"]),
        (Summand::Inertia, "M", ["the inertia", "M/Δt²", "(M/Δt²) y"]),
        (Summand::Pins, "w", ["the pins", "w CᵀC", "w CᵀC p_rest"]),
        (Summand::External, "the mass", ["", "", "f_ext"]),
    ] {
        for (side, name) in [Side::Both, Side::System, Side::Right].into_iter().zip(names) {
            if name.is_empty() {
                continue;
            }
            let place = match side {
                Side::Both => format!("in both Q and b, the term of {name}"),
                Side::System => format!("in Q, {name}"),
                Side::Right => format!("in b, {name}"),
            };
            let mut add = |factor: Factor, rank: u8, words: String| {
                let task = match (summand, side) {
                    (Summand::Pins, _) => Task::Selection,
                    (Summand::Inertia, Side::Both) if factor.h == 0 => Task::Masses,
                    (_, Side::Right) => Task::Round,
                    _ => Task::System,
                };
                let rule = RoundsRule::Factor(summand, side, factor);
                all.push(change(task, rule, rank, format!("{place} {words}")));
            };
            for (number, rank) in [(0.0, 0), (-1.0, 0), (2.0, 2), (0.5, 2)] {
                add(Factor::number(number), rank, candidates::factor_words(number));
            }
            let too_often = format!("is multiplied by {quantity} once too often");
            match summand {
                Summand::External => {
                    add(Factor::mass(1), 1, "is multiplied by the mass".to_owned());
                    add(Factor::mass(-1), 1, "is divided by the mass".to_owned());
                }
                _ => {
                    add(Factor::mass(-1), 1, format!("lacks the factor {quantity}"));
                    add(Factor::mass(1), 2, too_often);
                }
            }
            let by_h = |power: i32| if power == 1 { "Δt" } else { "Δt²" };
            for power in [1, 2] {
                let more = match (summand, power) {
                    (Summand::Inertia, 1) => "is divided by Δt, not by Δt²".to_owned(),
                    (Summand::Inertia, _) => "is not divided by Δt²".to_owned(),
                    _ => format!("is multiplied by {}", by_h(power)),
                };
                add(Factor::h(power), 1, more);
                let less = match summand {
                    Summand::Inertia => format!("is divided by {} too often", by_h(power)),
                    _ => format!("is divided by {}", by_h(power)),
                };
                add(Factor::h(-power), 1, less);
            }
        }
    }
    all
}

/// Entries and rows of the matrices.
fn of_matrices() -> Vec<Change> {
    let mut all = Vec::new();
    let [every, without_local] =
        [true, false].map(|local| Uses { system: true, right: true, local });
    let entries = [
        ([1.0, 1.0], "the two entries of each row have the same sign"),
        ([1.0, 0.0], "each row lacks its −1"),
        ([0.0, -1.0], "each row lacks its +1"),
        ([0.0, 0.0], "all entries are 0"),
        ([1.0, -2.0], "each row has its −1 twice"),
        ([2.0, -1.0], "each row has its +1 twice"),
    ];
    for (entries, words) in entries {
        for (uses, rest) in [(every, ""), (without_local, "; d is made of p_i − p_j")] {
            let rule = RoundsRule::Entries(entries, uses);
            all.push(change(Task::Incidence, rule, 1, format!("{words}{rest}")));
        }
    }
    let words = "its orientation of each spring is not that of d: +1 and −1 are swapped";
    let swapped = RoundsRule::Entries([-1.0, 1.0], without_local);
    all.push(change(Task::Incidence, swapped, 1, words));
    let none = Uses { system: false, right: false, local: false };
    for (task, uses, name) in [
        (Task::System, Uses { system: true, ..none }, "in Q, each row of A in AᵀA"),
        (Task::Round, Uses { right: true, ..none }, "in b, each row of A in Aᵀd"),
        (Task::Round, Uses { local: true, ..none }, "each row of A in v = A p"),
    ] {
        for (entries, words) in [
            ([1.0, 1.0], "has two entries of the same sign"),
            ([1.0, 0.0], "lacks its −1"),
            ([0.0, -1.0], "lacks its +1"),
        ] {
            let rule = RoundsRule::Entries(entries, uses);
            all.push(change(task, rule, 2, format!("{name} {words}")));
        }
    }
    for (task, rows) in [
        (
            Task::Incidence,
            ["only its first row is there", "it lacks its first row", "it lacks its last row"],
        ),
        (
            Task::Masses,
            [
                "only its first entry is there",
                "it lacks its first entry",
                "it lacks its last entry",
            ],
        ),
        (
            Task::Selection,
            ["only the first pin is held", "the first pin is not held", "the last pin is not held"],
        ),
    ] {
        let which = [Particles::First, Particles::NotFirst, Particles::NotLast];
        for (particles, words) in which.into_iter().zip(rows) {
            all.push(change(task, RoundsRule::Rows(task, particles), 1, words));
        }
    }
    for (shift, words) in [
        (1, "the vertex after each pin is held in its place: b counts from 1"),
        (-1, "the vertex before each pin is held in its place"),
    ] {
        all.push(change(Task::Selection, RoundsRule::Shifted(shift), 1, words));
    }
    let words = "pins are held where they were at the start of the step, not at p_rest";
    all.push(change(Task::Selection, RoundsRule::Held(Held::Before), 1, words));
    for (rule, words) in [
        (SceneRule::FirstMass, "every mass is that of the first vertex"),
        (SceneRule::IntegerMasses, "masses are read as integers"),
    ] {
        all.push(of_scene(Task::Masses, rule, 2, words));
    }
    all.push(of_scene(Task::Selection, SceneRule::Unfixed, 0, "no pin is held"));
    let which = Which::Joined;
    let unjoined = SceneRule::LeftOut { tag: ELASTIC.tag, which };
    all.push(of_scene(Task::Selection, unjoined, 2, "springs to pins are left out"));
    let before = SceneRule::ParticlesBefore(ELASTIC.tag);
    all.push(of_scene(Task::Incidence, before, 2, "each row is that of the spring before it"));
    all
}

fn of_scene(task: Task, rule: SceneRule, rank: u8, words: &str) -> Change {
    Change {
        place: Place::Task(task),
        words: format!("{task}: {words}"),
        effect: Effect::Scene(rule),
        rank,
    }
}

/// Edits of the formula of `d`; those of its factor `r` may be in the rest lengths as well.
fn of_local() -> Vec<Change> {
    let leaf = Expression::Leaf;
    let k = Leaf::Parameter(ELASTIC.schema().parameter_idx("k"), "k");
    let own = local();
    let scalars = [rest_length(), leaf(Leaf::Length), leaf(k)];
    let mut all = Vec::new();
    let rule = |formula: Expression| RoundsRule::Local(Arc::new(formula));
    // Divided by r, it lacks r.
    let is_new = |edit: &&Edit| !edit.words.ends_with("divided by l0");
    for edit in edits(&own, &scalars).iter().filter(is_new) {
        let words = format!("d {}", in_symbols(&edit.words));
        all.push(change(Task::Round, rule(edit.expression.clone()), edit.rank, words));
    }
    for (number, rank) in [(-1.0, 0), (0.0, 0), (2.0, 2), (0.5, 2)] {
        let scaled = Expression::Product(vec![Expression::Number(number), own.clone()]);
        let words = format!("d {}", candidates::factor_words(number));
        all.push(change(Task::Round, rule(scaled), rank, words));
    }
    let square = Expression::Power(Box::new(rest_length()), 2);
    let inverse = Expression::Power(Box::new(rest_length()), -1);
    let of_rest = |by: Expression| Expression::Product(vec![by, leaf(Leaf::Direction)]);
    for (by, rank, words) in [
        (square, 1, "rest lengths are squared"),
        (inverse, 2, "rest lengths are 1/r"),
        (Expression::Number(1.0), 1, "every rest length is 1"),
        (Expression::Number(0.0), 1, "every rest length is 0"),
        (rest_length().negated(), 2, "rest lengths are negative"),
        (leaf(Leaf::Length), 1, "rest lengths are those of the deformed mesh, of each round's p"),
        (
            Expression::Product(vec![Expression::Number(2.0), rest_length()]),
            2,
            "rest lengths are doubled",
        ),
        (
            Expression::Product(vec![Expression::Number(0.5), rest_length()]),
            2,
            "rest lengths are halved",
        ),
    ] {
        all.push(change(Task::RestLengths, rule(of_rest(by)), rank, words));
    }
    let words = "rest lengths are those of the deformed mesh, at p^t";
    all.push(change(Task::RestLengths, RoundsRule::LengthsBefore, 1, words));
    all
}

/// Words about a formula in the hand-out's symbols: `r` for `l0`, and the spring `v = A p` for `d`.
fn in_symbols(words: &str) -> String {
    let symbol = |word: &str| {
        match word {
            "l0" => "r",
            "l0²" => "r²",
            "l" => "|v|",
            "l²" => "|v|²",
            "n" => "v/|v|",
            "d" => "v",
            "d/|d|₁" => "v/|v|₁",
            "d/|d|∞" => "v/|v|∞",
            other => other,
        }
        .to_owned()
    };
    words.split(' ').map(symbol).collect::<Vec<String>>().join(" ")
}

/// The places of rest lengths in the scene.
fn of_rest_lengths(scene: &Scene) -> Vec<Change> {
    let tag = ELASTIC.tag;
    let task = Task::RestLengths;
    let of_first = SceneRule::ParametersOfOne { tag, name: None, last: false };
    let mut all = vec![
        of_scene(task, of_first, 1, "every rest length is that of the first spring"),
        of_scene(task, SceneRule::Integer(tag, "l0"), 2, "rest lengths are read as integers"),
    ];
    let has_one = scene.forces.iter().filter(|element| is_elastic(scene, element)).count() < 2;
    all.retain(|change| !(has_one && change.effect == Effect::Scene(of_first)));
    all
}

/// The prediction `y`, where rounds start, how many there are, and the new velocity.
fn of_inertia_and_rounds() -> Vec<Change> {
    let mut all = Vec::new();
    let mut add = |rule: RoundsRule, rank: u8, words: &str| {
        all.push(change(Task::Round, rule, rank, words));
    };
    let ahead = |position: f64, velocity: f64, h: i32| RoundsRule::Ahead { position, velocity, h };
    for (velocity, h, rank, words) in [
        (0.0, 1, 0, "y is p^t: Δt v is missing"),
        (-1.0, 1, 0, "y is p^t − Δt v, which is p^{t−Δt}"),
        (2.0, 1, 2, "y has Δt v twice"),
        (0.5, 1, 2, "y has half of Δt v"),
        (1.0, 0, 1, "y has v without Δt"),
        (1.0, 2, 1, "y has Δt² v in the place of Δt v"),
    ] {
        add(ahead(1.0, velocity, h), rank, words);
    }
    // y = α p^t + β p^{t−Δt}, with p^{t−Δt} = p^t − Δt v.
    for (now, before, words) in [
        (2.0, 1.0, "y is 2 p^t + p^{t−Δt}"),
        (2.0, 0.0, "y is 2 p^t: p^{t−Δt} is missing"),
        (1.0, -1.0, "y is p^t − p^{t−Δt}: 2 p^t counts once"),
        (0.0, -1.0, "y is −p^{t−Δt}: 2 p^t is missing"),
        (-2.0, -1.0, "y is −2 p^t − p^{t−Δt}"),
        (2.0, -2.0, "y is 2 p^t − 2 p^{t−Δt}"),
        (-1.0, 2.0, "y is 2 p^{t−Δt} − p^t: the two are swapped"),
    ] {
        add(ahead(now + before, -before, 1), 1, words);
    }
    add(ahead(0.0, 0.0, 1), 0, "y is missing");
    add(RoundsRule::Start(1.0), 1, "rounds start from y = p^t + Δt v, not from p^t");
    add(RoundsRule::Start(-1.0), 2, "rounds start from p^{t−Δt}, not from p^t");
    for (more, words) in [(-1, "a round too few is made"), (1, "a round too many is made")] {
        add(RoundsRule::Count(Count::More(more)), 1, words);
    }
    add(RoundsRule::Count(Count::Exactly(0)), 1, "no round is made");
    add(RoundsRule::Count(Count::Exactly(1)), 0, "a single round is made");
    for count in [2, 3, 4, 5, 10, 20, 30, 40, 50, 100] {
        let words = format!("{count} rounds are made, whatever their number should be");
        add(RoundsRule::Count(Count::Exactly(count)), 2, &words);
    }
    add(RoundsRule::Count(Count::Times(0.5)), 2, "half as many rounds are made");
    add(RoundsRule::Count(Count::Times(2.0)), 2, "twice as many rounds are made");
    add(RoundsRule::Velocity(None), 0, "the velocity is not renewed");
    for (factor, words) in [
        (Factor::h(1), "the velocity is p − p^t, not divided by Δt"),
        (Factor::h(-1), "the velocity is divided by Δt once too often"),
        (Factor::number(-1.0), "the velocity has the wrong sign"),
        (Factor::number(0.0), "the velocity is 0"),
        (Factor::number(2.0), "the velocity is multiplied by 2"),
        (Factor::number(0.5), "the velocity is multiplied by 0.5"),
    ] {
        add(RoundsRule::Velocity(Some(factor)), 1, words);
    }
    all
}

/// Changes of the value of each force that is external to the rounds.
fn of_external(scene: &Scene) -> Vec<Change> {
    let name = scene.integrator.name;
    let mut terms: Vec<Term> =
        scene.forces.iter().flat_map(|element| Term::of(element.schema)).collect();
    terms.sort_unstable();
    terms.dedup();
    terms.retain(|term| *term != ELASTIC);
    let is_of_value = |change: &&Change| match &change.effect {
        Effect::Factor(_, quantities, _) => **quantities == [Quantity::Force],
        Effect::Derived(..) => false,
        effect => effect.quantities().contains(&Quantity::Force),
    };
    let of = |term: Term| {
        let all = candidates::of_term(term).iter().filter(is_of_value);
        all.map(move |change| Change {
            place: Place::ForceUnder(term, name),
            words: format!("{name}: {}", change.words),
            ..change.clone()
        })
    };
    terms.into_iter().flat_map(of).collect()
}
