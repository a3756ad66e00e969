//! One factor of the Jacobians in a matrix, in the place of the same factor of each force's own.

use rayon::prelude::*;

use crate::change::candidates;
use crate::change::{Change, Effect, Factor, Quantity, Rule, Term};

use super::{Cause, Search};
use crate::findings::evidence::{Agreement, Marked};
use crate::findings::is_linearized;

/// The factor of a term's Jacobians, and all that it is a factor of.
fn of_jacobians(cause: &Cause) -> Option<(Term, &'static [Quantity], Factor)> {
    let Effect::Factor(term, quantities, factor) = cause.change().effect else { return None };
    let has_one = quantities.iter().any(|quantity| *quantity != Quantity::Force);
    has_one.then_some((term, quantities, factor))
}

impl Search<'_> {
    /// Replaces causes that give Jacobians of several forces one factor by one of the matrix that makes the same scenes.
    /// Returns whether it did.
    pub(super) fn merge_in_matrix(&mut self) -> bool {
        let factors: Vec<Factor> =
            self.found.iter().filter_map(of_jacobians).map(|(_, _, factor)| factor).collect();
        let several = |factor: &&Factor| factors.iter().filter(|other| other == factor).count() > 1;
        let Some(&factor) = factors.iter().find(several) else { return false };
        let is_its = |cause: &Cause| of_jacobians(cause).is_some_and(|(_, _, of)| of == factor);
        let numbers = self.found.iter().filter(|cause| is_its(cause)).flat_map(|one| &one.scenes);
        let (scenes, others): (Vec<usize>, Vec<usize>) =
            numbers.copied().partition(|number| is_linearized(&self.scenes[*number]));
        let Some(&first) = scenes.first() else { return false };
        let newton = others.iter().find(|number| self.scenes[**number].is_newton());
        let newton = newton.map(|number| self.scenes[*number].scene.integrator.name);
        let rules = [
            (Rule::Matrices(factor), &[Quantity::ByPosition, Quantity::ByVelocity][..]),
            (Rule::Matrix(Quantity::ByPosition, factor), &[Quantity::ByPosition]),
            (Rule::Matrix(Quantity::ByVelocity, factor), &[Quantity::ByVelocity]),
        ];
        let of_matrix = candidates::of_integrator(&self.scenes[first].scene);
        let merged = rules.into_iter().find_map(|(rule, quantities)| {
            let is_it =
                |change: &&Change| matches!(change.effect, Effect::Method(_, of) if of == rule);
            let change = of_matrix.iter().find(is_it)?;
            let mut found = Vec::new();
            for cause in &self.found {
                match of_jacobians(cause).filter(|(_, _, of)| *of == factor) {
                    None => found.push(cause.clone()),
                    Some((term, own, _)) => {
                        found.extend(without(cause, term, own, quantities, factor)?);
                    }
                }
            }
            let group = 1 + self.found.iter().map(|cause| cause.group).max().unwrap_or(0);
            let of_newton = newton.and_then(|name| candidates::of_newton(name, change));
            let of_each = [(Some(change.clone()), &scenes), (of_newton, &others)];
            for (change, scenes) in of_each {
                let merged =
                    change.map(|change| Cause::of_scenes(change, scenes.clone(), Vec::new()));
                found.extend(merged.map(|merged| Cause { group, ..merged }));
            }
            self.is_as_good(&found, change).then_some(found)
        });
        let is_merged = merged.is_some();
        if let Some(found) = merged {
            self.found = found;
            self.settle();
        }
        is_merged
    }

    /// Whether these causes make every scene that those found make, and no other scene in which this change acts is wrong.
    fn is_as_good(&self, causes: &[Cause], change: &Change) -> bool {
        let made: Vec<Change> = causes.iter().map(|cause| cause.change().clone()).collect();
        let is_made = |scene: &Marked<'_>| {
            let model = scene.model(&made);
            match scene.explained && scene.is_suspect() {
                true => {
                    model.can_step()
                        && scene.agrees_with(&model, usize::MAX) == Agreement::Agrees
                        && scene.replay(&made) == Agreement::Agrees
                }
                false => {
                    !scene.is_settled()
                        || !change.acts_in(&scene.scene)
                        || scene.agrees_with(&model, usize::MAX) != Agreement::Differs
                }
            }
        };
        self.scenes.par_iter().all(is_made)
    }
}

/// What is left of a cause without these quantities: one that has a name, or none. `None` if it has no name.
fn without(
    cause: &Cause,
    term: Term,
    own: &[Quantity],
    quantities: &[Quantity],
    factor: Factor,
) -> Option<Option<Cause>> {
    let is_left = |quantity: &&Quantity| term.has(**quantity) && !quantities.contains(quantity);
    let left: Vec<Quantity> = own.iter().filter(is_left).copied().collect();
    let [one] = left[..] else { return left.is_empty().then_some(None) };
    let is_number = factor == Factor::number(factor.number);
    let alternatives = vec![candidates::factor(term, one.alone(), factor.number)];
    is_number.then(|| Some(Cause { alternatives, rivals: Vec::new(), ..cause.clone() }))
}
