//! Common wrong formulas of forces and Jacobians.
//!
//! With `d = x_i − x_j`, `w = v_i − v_j`, `l = |d|`, `n = d/l`, `A = I − n nᵀ` and `R` the rotation by a quarter turn.
//! Each formula replaces the force on `i`, or its derivative by `x_i` or `v_i`. The right formulas are in
//! [`crate::jacobian`].

use nalgebra::{Matrix3, Vector3};
use simulator::scene::ForceElement;
use simulator::scene::schema::ForceSchema;

/// The inputs of a formula; in two dimensions z is 0.
pub(super) struct Pair {
    pub(super) element: ForceElement,
    pub(super) d: Vector3<f64>,
    pub(super) w: Vector3<f64>,
    /// Velocities of both.
    pub(super) v: [Vector3<f64>; 2],
}

impl Pair {
    fn p(&self, name: &str) -> f64 {
        self.element.parameter(name)
    }

    fn l(&self) -> f64 {
        self.d.norm()
    }

    fn n(&self) -> Vector3<f64> {
        self.d / self.l()
    }

    fn nn(&self) -> Matrix3<f64> {
        self.n() * self.n().transpose()
    }

    fn across(&self) -> Matrix3<f64> {
        Matrix3::identity() - self.nn()
    }

    /// `(l − l0)/l`.
    fn strain(&self) -> f64 {
        (self.l() - self.p("l0")) / self.l()
    }

    /// `l²/l0²`.
    fn ratio(&self) -> f64 {
        (self.l() / self.p("l0")).powi(2)
    }

    /// `n·w`.
    fn closing(&self) -> f64 {
        self.n().dot(&self.w)
    }

    /// `kvc/lᵉ`.
    fn whirl(&self, power: i32) -> f64 {
        self.p("kvc") / self.l().powi(power)
    }
}

/// A wrong formula for a force.
pub(super) struct WrongForce {
    /// The end of the term's name.
    pub(super) term: &'static str,
    /// The mistake; the text follows the term's name.
    pub(super) words: &'static str,
    pub(super) on_i: fn(&Pair) -> Vector3<f64>,
}

/// A wrong formula for a Jacobian.
pub(super) struct WrongJacobian {
    /// The end of the term's name.
    pub(super) term: &'static str,
    /// Whether it is the derivative by velocities.
    pub(super) by_velocity: bool,
    /// The mistake; the text follows `dF/dx of` and the term's name.
    pub(super) words: &'static str,
    pub(super) block: fn(&Pair) -> Matrix3<f64>,
}

const fn force(
    term: &'static str,
    words: &'static str,
    on_i: fn(&Pair) -> Vector3<f64>,
) -> WrongForce {
    WrongForce { term, words, on_i }
}

const fn dx(
    term: &'static str,
    words: &'static str,
    block: fn(&Pair) -> Matrix3<f64>,
) -> WrongJacobian {
    WrongJacobian { term, by_velocity: false, words, block }
}

const fn dv(
    term: &'static str,
    words: &'static str,
    block: fn(&Pair) -> Matrix3<f64>,
) -> WrongJacobian {
    WrongJacobian { term, by_velocity: true, words, block }
}

/// The quarter turn about z, which maps z to itself.
fn turn() -> Matrix3<f64> {
    Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
}

const SPRING: &str = "springforce";
const ELASTIC: &str = "springforce's elastic force";
const DAMPING: &str = "springforce's damping";
const GREEN: &str = "greenspringforce";
const VORTEX: &str = "vortexforce";

pub(super) static FORCES: &[WrongForce] = &[
    force(ELASTIC, "adds the rest length instead of subtracting it", |e| {
        -e.p("k") * (e.l() + e.p("l0")) * e.n()
    }),
    force(ELASTIC, "pulls and never pushes", |e| -e.p("k") * (e.l() - e.p("l0")).max(0.0) * e.n()),
    force(GREEN, "has lengths that are not squared", |e| {
        -2.0 * e.p("k") * (e.l() / e.p("l0") - 1.0) * e.d
    }),
    force(GREEN, "is not divided by l0²", |e| {
        -2.0 * e.p("k") * (e.l().powi(2) - e.p("l0").powi(2)) * e.d
    }),
    force(GREEN, "is that of a Hookean spring", |e| -e.p("k") * (e.l() - e.p("l0")) * e.n()),
    force(GREEN, "pulls and never pushes", |e| -2.0 * e.p("k") * (e.ratio() - 1.0).max(0.0) * e.d),
    force(DAMPING, "is not projected on the spring's axis", |e| -e.p("b") * e.w),
    force(DAMPING, "uses the velocity of i alone", |e| -e.p("b") * e.n().dot(&e.v[0]) * e.n()),
    force(DAMPING, "adds the two velocities instead of subtracting them", |e| {
        -e.p("b") * e.n().dot(&(e.v[0] + e.v[1])) * e.n()
    }),
    force(DAMPING, "uses the absolute value of the velocity along the axis", |e| {
        -e.p("b") * e.closing().abs() * e.n()
    }),
    force(VORTEX, "lacks the quarter turn", |e| e.whirl(2) * (e.p("kbs") * e.n() - e.w)),
    force(VORTEX, "turns the other way round", |e| {
        e.whirl(2) * (-e.p("kbs") * (turn() * e.n()) - e.w)
    }),
    force(VORTEX, "has kvc on its viscous part alone", |e| {
        (e.p("kbs") * (turn() * e.n()) - e.p("kvc") * e.w) / e.l().powi(2)
    }),
    force(VORTEX, "lacks its viscous part", |e| e.whirl(2) * e.p("kbs") * (turn() * e.n())),
    force(VORTEX, "has its viscous part with the wrong sign", |e| {
        e.whirl(2) * (e.p("kbs") * (turn() * e.n()) + e.w)
    }),
    force(VORTEX, "uses the velocity of i alone", |e| {
        e.whirl(2) * (e.p("kbs") * (turn() * e.n()) - e.v[0])
    }),
];

pub(super) static JACOBIANS: &[WrongJacobian] = &[
    dx(ELASTIC, "lacks n nᵀ", |e| -e.p("k") * e.strain() * e.across()),
    dx(ELASTIC, "lacks its part across the axis", |e| -e.p("k") * e.nn()),
    dx(ELASTIC, "has I in the place of I − n nᵀ", |e| {
        -e.p("k") * (e.nn() + e.strain() * Matrix3::identity())
    }),
    dx(ELASTIC, "lacks (l − l0)/l", |e| -e.p("k") * (e.nn() + e.across())),
    dx(ELASTIC, "has l − l0 not divided by l", |e| {
        -e.p("k") * (e.nn() + (e.l() - e.p("l0")) * e.across())
    }),
    dx(ELASTIC, "has l − l0 divided by l0, not l", |e| {
        -e.p("k") * (e.nn() + (e.l() - e.p("l0")) / e.p("l0") * e.across())
    }),
    dx(ELASTIC, "has a direction that is not normalised", |e| {
        let dd = e.d * e.d.transpose();
        -e.p("k") * (dd + e.strain() * (Matrix3::identity() - dd))
    }),
    dx(GREEN, "lacks n nᵀ", |e| -2.0 * e.p("k") * (e.ratio() - 1.0) * Matrix3::identity()),
    dx(GREEN, "lacks (l²/l0² − 1) I", |e| -4.0 * e.p("k") * e.ratio() * e.nn()),
    dx(GREEN, "has n nᵀ once instead of twice", |e| {
        -2.0 * e.p("k") * ((e.ratio() - 1.0) * Matrix3::identity() + e.ratio() * e.nn())
    }),
    dx(GREEN, "has l² in the place of l²/l0²", |e| {
        let part = 2.0 * e.l().powi(2) * e.nn();
        -2.0 * e.p("k") * ((e.ratio() - 1.0) * Matrix3::identity() + part)
    }),
    dx(GREEN, "is that of a Hookean spring", |e| -e.p("k") * (e.nn() + e.strain() * e.across())),
    dx(DAMPING, "lacks n·w I", |e| -e.p("b") / e.l() * (e.n() * e.w.transpose()) * e.across()),
    dx(DAMPING, "lacks n wᵀ", |e| -e.p("b") / e.l() * e.closing() * e.across()),
    dx(DAMPING, "lacks the factor I − n nᵀ", |e| {
        -e.p("b") / e.l() * (e.closing() * Matrix3::identity() + e.n() * e.w.transpose())
    }),
    dx(DAMPING, "uses the velocity of i alone", |e| {
        let along = e.n().dot(&e.v[0]) * Matrix3::identity();
        -e.p("b") / e.l() * (along + e.n() * e.v[0].transpose()) * e.across()
    }),
    dv(DAMPING, "is not projected on the spring's axis", |e| -e.p("b") * Matrix3::identity()),
    dv(DAMPING, "is projected across the spring's axis", |e| -e.p("b") * e.across()),
    dv(DAMPING, "has a direction that is not normalised", |e| -e.p("b") * e.d * e.d.transpose()),
    dx(VORTEX, "lacks its rotating part", |e| 2.0 * e.whirl(3) * e.w * e.n().transpose()),
    dx(VORTEX, "lacks R", |e| {
        let turned = -3.0 * turn() * e.nn();
        e.whirl(3) * (e.p("kbs") * turned + 2.0 * e.w * e.n().transpose())
    }),
    dx(VORTEX, "lacks 3 R n nᵀ", |e| {
        e.whirl(3) * (e.p("kbs") * turn() + 2.0 * e.w * e.n().transpose())
    }),
    dx(VORTEX, "has R n nᵀ without its 3", |e| {
        let turned = turn() - turn() * e.nn();
        e.whirl(3) * (e.p("kbs") * turned + 2.0 * e.w * e.n().transpose())
    }),
    dx(VORTEX, "lacks the quarter turn", |e| {
        let turned = Matrix3::identity() - 3.0 * e.nn();
        e.whirl(3) * (e.p("kbs") * turned + 2.0 * e.w * e.n().transpose())
    }),
    dx(VORTEX, "lacks 2 w nᵀ", |e| e.whirl(3) * e.p("kbs") * (turn() - 3.0 * turn() * e.nn())),
    dx(VORTEX, "has w nᵀ without its 2", |e| {
        let turned = turn() - 3.0 * turn() * e.nn();
        e.whirl(3) * (e.p("kbs") * turned + e.w * e.n().transpose())
    }),
    dx(VORTEX, "has n wᵀ in the place of w nᵀ", |e| {
        let turned = turn() - 3.0 * turn() * e.nn();
        e.whirl(3) * (e.p("kbs") * turned + 2.0 * e.n() * e.w.transpose())
    }),
    dv(VORTEX, "is projected on the axis", |e| -e.whirl(2) * e.nn()),
];

/// Whether `term`, the end of a name, fits the term of this name.
pub(super) fn is_of(term: &str, name: &str) -> bool {
    term == name || (term == ELASTIC && name == SPRING)
}

/// The name of a part of a force with several parts.
pub(super) fn name_of(schema: &ForceSchema, part: &str) -> String {
    format!("{}'s {}", schema.tag, schema.part(part).title)
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulator::force::REGISTRY;

    #[test]
    fn formulas_are_of_terms_that_scenes_have() {
        let names: Vec<String> = REGISTRY
            .iter()
            .flat_map(|kind| {
                let schema = &kind.schema;
                let parts = schema.parts.iter().filter(|_| schema.is_separable());
                parts.map(|part| name_of(schema, part.name)).chain([schema.tag.to_owned()])
            })
            .collect();
        let terms = FORCES.iter().map(|wrong| wrong.term);
        for term in terms.chain(JACOBIANS.iter().map(|wrong| wrong.term)) {
            assert!(names.iter().any(|name| name == term), "no scene has a term {term}");
        }
    }
}
