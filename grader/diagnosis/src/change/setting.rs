//! The values of a step that changes set: of two that set the same one, the later undoes the earlier, and a program has
//! one of them at most. Factors multiply, and do not undo each other.

use std::mem::discriminant;

use super::{Change, Effect, FixedRule, Place, Quantity, Rule, Start};

/// A value that a rule of an integrator sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Setting {
    /// The point at which forces are evaluated.
    ForcePoint,
    /// That of `∂F/∂x`.
    PositionJacobianPoint,
    /// That of `∂F/∂v`.
    VelocityJacobianPoint,
    /// The right-hand side.
    Right,
    /// How positions move.
    Drift,
    /// The end of Newton's method.
    End,
    /// The steps in the place of one.
    Count,
    /// How the solution is used.
    Solution,
}

impl Rule {
    fn sets(self) -> Vec<Setting> {
        use Setting::{
            Count, Drift, End, ForcePoint, PositionJacobianPoint, Right, Solution,
            VelocityJacobianPoint,
        };
        match self {
            Self::ForcesAt(_) | Self::Stale(_) => vec![ForcePoint],
            Self::JacobiansAt([by_position, by_velocity], _) => {
                let both =
                    [(by_position, PositionJacobianPoint), (by_velocity, VelocityJacobianPoint)];
                both.into_iter().filter(|(is_set, _)| *is_set).map(|(_, setting)| setting).collect()
            }
            Self::StaleJacobians => vec![PositionJacobianPoint, VelocityJacobianPoint],
            Self::Linearized(_) => {
                vec![ForcePoint, PositionJacobianPoint, VelocityJacobianPoint, Right]
            }
            Self::PositionsFirst => vec![ForcePoint, Drift],
            Self::Position { .. } => vec![Drift],
            Self::Inertia { .. } => vec![Right],
            Self::Unbalanced { .. } => vec![Right, End],
            Self::Newton(_) => vec![End],
            Self::Unmoved { .. } => {
                vec![ForcePoint, PositionJacobianPoint, VelocityJacobianPoint, End]
            }
            Self::Whole { .. } | Self::Scaled(_) | Self::Lost => vec![Solution],
            Self::Once | Self::Restarted { .. } | Self::Accumulated { .. } => vec![End],
            Self::SeenAt(_) => vec![ForcePoint, PositionJacobianPoint, VelocityJacobianPoint],
            Self::Mean { moves } => {
                let points = [ForcePoint, PositionJacobianPoint, VelocityJacobianPoint, End];
                points.into_iter().chain(moves.then_some(Drift)).collect()
            }
            Self::PositionAlong(..) => vec![Drift],
            Self::Repeated(_) | Self::Substeps(_) => vec![Count],
            _ => Vec::new(),
        }
    }

    /// Whether two of this kind multiply, or concern different forces.
    fn composes(self) -> bool {
        matches!(self, Self::Forces(_) | Self::Matrix(..) | Self::Matrices(_) | Self::Split(_))
    }
}

impl Change {
    /// Whether this change and another one set the same value.
    pub(crate) fn undoes(&self, other: &Self) -> bool {
        match (&self.effect, &other.effect) {
            (Effect::Method(name, one), Effect::Method(of, two)) => {
                let is_same = !one.composes() && discriminant(one) == discriminant(two);
                let settings = two.sets();
                name == of && (is_same || one.sets().iter().any(|one| settings.contains(one)))
            }
            (Effect::Method(_, rule), Effect::Start(_, quantities, start))
            | (Effect::Start(_, quantities, start), Effect::Method(_, rule)) => {
                let of = |quantity: &Quantity| match quantity {
                    Quantity::Force => Setting::ForcePoint,
                    Quantity::ByPosition => Setting::PositionJacobianPoint,
                    Quantity::ByVelocity => Setting::VelocityJacobianPoint,
                };
                let settings = rule.sets();
                let is_explicit = matches!(rule, Rule::PositionsFirst);
                let is_point = matches!(start, Start::Positions | Start::Both) && !is_explicit;
                is_point && quantities.iter().any(|quantity| settings.contains(&of(quantity)))
            }
            (Effect::Formula(term, quantity, _), Effect::Formula(of, value, _)) => {
                (term, quantity) == (of, value)
            }
            // The Jacobians of such a formula are its derivatives.
            (Effect::Derived(term, _), Effect::Formula(of, ..) | Effect::Derived(of, _))
            | (Effect::Formula(term, ..), Effect::Derived(of, _)) => term == of,
            (Effect::Fixed(FixedRule::Hold(_)), Effect::Fixed(FixedRule::Hold(_)))
            | (Effect::Fixed(FixedRule::Feel(_)), Effect::Fixed(FixedRule::Feel(_))) => {
                match (self.place, other.place) {
                    (Place::FixedUnder(one), Place::FixedUnder(two)) => one == two,
                    _ => true,
                }
            }
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use reference::method::OnePoint;

    use super::super::{Factor, Linearized, Term};
    use super::*;

    fn of_method(name: &'static str, rule: Rule) -> Change {
        let effect = Effect::Method(name, rule);
        Change { place: Place::Integrator(name), words: String::new(), effect, rank: 1 }
    }

    #[test]
    fn points_of_one_method_undo_each_other_and_factors_do_not() {
        let name = "linearized-implicit-euler";
        let at = |forces, jacobians, right| {
            of_method(name, Rule::Linearized(Linearized { forces, jacobians, right }))
        };
        let stiff = Some(Factor::number(1.0));
        let spring = Term { tag: "springforce", part: "elastic" };
        let of_term = Change {
            place: Place::Force(spring),
            words: String::new(),
            effect: Effect::Start(spring, &Quantity::ALL, Start::Positions),
            rank: 2,
        };
        for other in [at(1.0, 1.0, stiff), of_method(name, Rule::ForcesAt(0.5)), of_term] {
            assert!(at(0.0, 0.0, None).undoes(&other), "{other:?}");
            assert!(other.undoes(&at(0.0, 0.0, None)), "{other:?}");
        }
        let factor = || of_method(name, Rule::Matrix(Quantity::ByPosition, Factor::number(0.0)));
        let elsewhere = of_method("explicit-euler", Rule::ForcesAt(0.5));
        let replaced = of_method(name, Rule::Replaced(OnePoint::Explicit));
        for other in [factor(), elsewhere, replaced] {
            assert!(!at(0.0, 0.0, None).undoes(&other), "{other:?}");
        }
        assert!(!factor().undoes(&factor()));
    }
}
