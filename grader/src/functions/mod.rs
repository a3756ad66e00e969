//! Functions of a hand-in, each judged by itself: a driver of the pack calls them, and what they give is compared entry by entry.
//!
//! ```text
//! calls    NAME number number …    one a line ─┐
//!                                              ├─ driver of the pack, a run for each function, in the sandbox
//! answers  number number …         one a line <┘   ─> wrong entries, and what the error looks like (jacobian::likeness)
//! ```
//!
//! A function of a pack states what it must give ([`Quantity`]): something of a force, by its law, at the states at which the
//! simulator's own forces are checked; or a matrix of fast mass-spring. It is a feature with one check, so that it has points and
//! stands in every report. Entries are right within the bound of each, which follows from the rounding of the terms.

mod fast_mass_spring;
mod forces;

use jacobian::check::{common, is_alike};
use jacobian::likeness::{Likeness, Pair};

use crate::boundary::printed::{RawUse, Untrusted};
use crate::submission::Submission;
use crate::submission::program::Program;
use crate::verdict::{Failure, Lack, Verdict, number};

/// The folder of their names in reports.
pub const GROUP: &str = "functions";

/// Exit status of a driver whose function is not implemented.
const NOT_IMPLEMENTED: i32 = 77;

/// The functions that a pack grades.
#[derive(Debug, Clone, PartialEq)]
pub struct Functions {
    /// The driver and its arguments, with `{calls}`, `{answers}` and `{folder}`.
    pub command: Vec<String>,
    /// The functions.
    pub each: Vec<Function>,
}

/// A function with its points.
#[derive(Debug, Clone, PartialEq)]
pub struct Function {
    /// Its name in calls and in reports.
    pub name: String,
    /// The quantity that it must return.
    pub quantity: Quantity,
    /// Its points.
    pub points: f64,
}

/// A quantity that a function must return.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Quantity {
    /// Something of a force.
    Force(forces::ForceQuantity),
    /// A matrix of fast mass-spring, or its step.
    FastMassSpring(fast_mass_spring::Matrix),
}

/// One call, and what it must give.
struct Call {
    /// The state, in words.
    state: String,
    arguments: Vec<f64>,
    rows: usize,
    /// The right values, row by row.
    expected: Vec<f64>,
    /// How far each may be off.
    bounds: Vec<f64>,
    /// Places of entries that may also be larger than expected: weights that are to be large.
    at_least: Vec<usize>,
    /// Coordinates of a particle.
    block: usize,
}

impl Quantity {
    /// The quantity that a pack calls `name`: `springforce/jacobian-x`, `fast-mass-spring/A`.
    ///
    /// # Errors
    /// A message with the names that there are.
    pub fn parse(name: &str) -> Result<Self, String> {
        let (owner, what) = name.split_once('/').unwrap_or((name, ""));
        if owner == fast_mass_spring::OWNER {
            return fast_mass_spring::Matrix::parse(what).map(Self::FastMassSpring);
        }
        forces::ForceQuantity::parse(owner, what).map(Self::Force)
    }

    fn calls(self) -> Vec<Call> {
        match self {
            Self::Force(quantity) => quantity.calls(),
            Self::FastMassSpring(matrix) => matrix.calls(),
        }
    }
}

impl Functions {
    /// Judges the functions of a submission. One that cannot be run fails in each.
    pub(crate) fn judge(&self, submission: &Submission) -> Vec<(&Function, Verdict)> {
        let judge = |function| {
            let verdict = match submission {
                Submission::Program(program) => Function::judge(function, program, &self.command),
                Submission::Unusable { failure, .. } => Verdict::Fail(failure.clone()),
                _ => return None,
            };
            Some((function, verdict))
        };
        self.each.iter().filter_map(judge).collect()
    }

    /// The sum of their points.
    pub(crate) fn points(&self) -> f64 {
        self.each.iter().map(|function| function.points).sum()
    }
}

impl Function {
    /// Its name in reports.
    pub fn id(&self) -> String {
        format!("{GROUP}/{}", self.name)
    }

    fn judge(&self, program: &Program, command: &[String]) -> Verdict {
        let calls = self.quantity.calls();
        let line = |call: &Call| {
            let numbers = call.arguments.iter().map(|value| format!(" {value:?}"));
            format!("{}{}\n", self.name, numbers.collect::<String>())
        };
        let text: String = calls.iter().map(line).collect();
        match program.answers(command, &text) {
            Ok(answers) => match compare(&calls, &answers) {
                None => Verdict::Pass,
                Some(detail) => Verdict::Fail(Failure::WrongFunction { detail }),
            },
            Err(Verdict::Fail(Failure::Run(run)))
                if run.end.exit_status() == Some(NOT_IMPLEMENTED) =>
            {
                let name = Some(self.name.clone());
                Verdict::Fail(Failure::NotImplemented(Lack::Refused { name, failure: run }))
            }
            Err(verdict) => verdict,
        }
    }
}

/// An entry that is wrong.
struct Wrong<'a> {
    call: &'a Call,
    place: (usize, usize),
    stated: f64,
}

/// The mistake in the answers, if there is one.
fn compare(calls: &[Call], answers: &Untrusted) -> Option<String> {
    let mut lines = answers.raw(RawUse::Parsing).lines();
    let mut worst: Option<(f64, Wrong<'_>)> = None;
    let (mut wrong_states, mut likenesses) = (0, Vec::new());
    for call in calls {
        let size = call.expected.len();
        let words: Vec<&str> = lines.next().unwrap_or_default().split_whitespace().collect();
        let values: Result<Vec<f64>, _> = words.iter().map(|word| word.parse()).collect();
        let stated = match values {
            Ok(values) if values.len() == size => values,
            Ok(values) => {
                let (state, found, rows) = (&call.state, values.len(), call.rows);
                let columns = size / rows;
                return Some(format!("wrong: {found} numbers, not {rows} x {columns}, at {state}"));
            }
            Err(_) => {
                return Some(format!("wrong: an answer that is no numbers, at {}", call.state));
            }
        };
        let wrong = call.wrong(&stated);
        wrong_states += usize::from(!wrong.is_empty());
        let columns = size / call.rows;
        for place in &wrong {
            let excess = (stated[*place] - call.expected[*place]).abs() / call.bounds[*place];
            let excess = if excess.is_finite() { excess } else { f64::INFINITY };
            if worst.as_ref().is_none_or(|(known, _)| excess > *known) {
                let at = (place / columns, place % columns);
                worst = Some((excess, Wrong { call, place: at, stated: stated[*place] }));
            }
        }
        likenesses.extend((!wrong.is_empty()).then(|| call.likeness(&stated, &wrong)));
    }
    let (_, Wrong { call, place: (row, column), stated }) = worst?;
    let expected = call.expected[row * (call.expected.len() / call.rows) + column];
    let alike = common(&likenesses).map(|likeness| {
        let count = likenesses.iter().filter(|other| is_alike(&likeness, other)).count();
        format!("; at {count} of them {}", likeness.of("all of it"))
    });
    Some(format!(
        "wrong at {wrong_states} of {} states{}\n  entry ({row}, {column}) at {}: yours {}, correct {}",
        calls.len(),
        alike.unwrap_or_default(),
        call.state,
        number(stated),
        number(expected),
    ))
}

impl Call {
    /// The places of wrong entries.
    fn wrong(&self, stated: &[f64]) -> Vec<usize> {
        let is_right = |place: usize| {
            let error = stated[place] - self.expected[place];
            error.abs() <= self.bounds[place] || error > 0.0 && self.at_least.contains(&place)
        };
        (0..stated.len()).filter(|place| !is_right(*place)).collect()
    }

    fn likeness(&self, stated: &[f64], wrong: &[usize]) -> Likeness {
        let columns = stated.len() / self.rows;
        let by_column = |values: &dyn Fn(usize) -> f64| -> Vec<f64> {
            let place = |column: usize| (0..self.rows).map(move |row| row * columns + column);
            (0..columns).flat_map(place).map(values).collect()
        };
        // Entries that may be larger are right as they are.
        let measured = by_column(&|place| {
            let is_larger = self.at_least.contains(&place) && !wrong.contains(&place);
            if is_larger { stated[place] } else { self.expected[place] }
        });
        let bounds = self.bounds.chunks(columns);
        let bounds: Vec<f64> = bounds.map(|row| row.iter().copied().fold(0.0, f64::max)).collect();
        let wrong: Vec<_> = wrong.iter().map(|place| (place / columns, place % columns)).collect();
        let (rows, block) = (self.rows, self.block);
        let stated = by_column(&|place| stated[place]);
        let pair = Pair {
            rows,
            block,
            stated: &stated,
            measured: &measured,
            bounds: &bounds,
            wrong: &wrong,
        };
        pair.likeness(&[], false)
    }
}

#[cfg(test)]
mod tests {
    use simulator::force;

    use super::*;

    /// All functions that a pack can name.
    fn all() -> Vec<(String, Quantity)> {
        let forces = force::REGISTRY.iter().flat_map(|kind| {
            let gives = forces::Gives::ALL.iter();
            gives.map(|gives| format!("{}/{}", kind.schema.tag, gives.name()))
        });
        let matrices = fast_mass_spring::Matrix::ALL.iter();
        let matrices =
            matrices.map(|matrix| format!("{}/{}", fast_mass_spring::OWNER, matrix.name()));
        let parsed = forces.chain(matrices).filter_map(|name| {
            let quantity = Quantity::parse(&name).ok()?;
            Some((name, quantity))
        });
        parsed.collect()
    }

    fn answers(calls: &[Call], change: impl Fn(&mut Vec<f64>)) -> Untrusted {
        let line = |call: &Call| {
            let mut values = call.expected.clone();
            change(&mut values);
            let words: Vec<String> = values.iter().map(|value| format!("{value:e}")).collect();
            words.join(" ") + "\n"
        };
        calls.iter().map(line).collect::<String>().into()
    }

    #[test]
    fn right_answers_pass_and_a_millionth_does_not() {
        let all = all();
        assert!(all.len() > 60, "{}", all.len());
        for (name, quantity) in all {
            let calls = quantity.calls();
            assert!(!calls.is_empty(), "{name}");
            assert_eq!(compare(&calls, &answers(&calls, |_| {})), None, "{name}");
            let is_zero = calls.iter().all(|call| call.expected.iter().all(|value| *value == 0.0));
            let millionth =
                answers(&calls, |values| values.iter_mut().for_each(|v| *v *= 1.0 + 3e-6));
            assert_eq!(compare(&calls, &millionth).is_some(), !is_zero, "{name}");
            let extra = answers(&calls, |values| values[0] += 1.0);
            assert!(compare(&calls, &extra).is_some(), "{name}");
        }
    }

    #[test]
    fn mistakes_are_named() {
        let calls = Quantity::parse("springforce/jacobian-x").unwrap().calls();
        let negative = answers(&calls, |values| values.iter_mut().for_each(|v| *v = -*v));
        let found = compare(&calls, &negative).unwrap();
        assert!(found.contains(" of them all of it is exactly the negative\n"), "{found}");
        let calls = Quantity::parse("fast-mass-spring/A").unwrap().calls();
        let first = answers(&calls, |values| values[0] = 0.0);
        let found = compare(&calls, &first).unwrap();
        assert!(
            found.contains("entry (0, 0) at ") && found.contains("yours 0, correct 1"),
            "{found}"
        );
    }

    #[test]
    fn answers_of_another_form_are_refused() {
        let calls = Quantity::parse("dragdamping/force").unwrap().calls();
        for (text, says) in
            [("1 2 3\n", "3 numbers, not 2 x 1, at "), ("a b\n", "no numbers"), ("", "0 numbers")]
        {
            assert!(compare(&calls, &text.into()).unwrap().contains(says), "{text}");
        }
    }
}
