//! Mistakes in Jacobians. They have an effect only with the two implicit methods, and with implicit Euler only if
//! Newton's method no longer converges.

use super::super::student::{
    Blocks, Body, DragJacobian, Jacobian, Mat2, Pair, PairFormula, Parameters, Student, drag_dv,
    four_blocks, quarter_turn,
};
use super::{Area, Mistake, Place, Scope, Subject};
use diagnosis::findings::Part;

pub(super) fn mistakes() -> Vec<Mistake> {
    let groups = [
        in_elastic_dx(),
        in_green_dx(),
        in_damping_dx(),
        in_damping_dv(),
        in_gravitation_dx(),
        in_drag_dv(),
        in_vortex_dx(),
        in_vortex_dv(),
    ];
    groups.into_iter().flatten().collect()
}

pub(super) fn place<T>(name: &'static str, part: Part, of: fn(&mut Student) -> &mut T) -> Place<T> {
    Place { subject: Subject { area: Area::Jacobian, name, scope: Scope::Jacobian(part) }, of }
}

impl Place<Jacobian> {
    pub(super) fn block(&self, description: &'static str, block: PairFormula<Mat2>) -> Mistake {
        self.mistake(description, move |jacobian| jacobian.block = block)
    }

    pub(super) fn spread(&self, description: &'static str, spread: fn(Mat2) -> Blocks) -> Mistake {
        self.mistake(description, move |jacobian| jacobian.spread = spread)
    }

    fn one_entry_negated(&self) -> Mistake {
        self.spread("entry xy of the block i, j with the wrong sign", |k| {
            let mut cross = -k;
            cross[(0, 1)] = k[(0, 1)];
            [[k, cross], [-k, k]]
        })
    }

    fn transposed(&self) -> Mistake {
        self.spread("transposed", |k| four_blocks(k.transpose()))
    }

    /// Mistakes possible in any Jacobian of a pair force, and these.
    pub(super) fn with(&self, mistakes: impl IntoIterator<Item = Mistake>) -> Vec<Mistake> {
        let usual = [
            self.spread("missing", |_| [[Mat2::zeros(); 2]; 2]),
            self.spread("wrong sign", |k| four_blocks(-k)),
            self.spread("off-diagonal blocks missing", |k| {
                [[k, Mat2::zeros()], [Mat2::zeros(), k]]
            }),
            self.spread("off-diagonal blocks with the wrong sign", |k| [[k, k], [k, k]]),
            self.spread("rows of j missing", |k| [[k, -k], [Mat2::zeros(); 2]]),
            self.mistake("local instead of global indices", |jacobian| jacobian.place = |_| [0, 1]),
        ];
        usual.into_iter().chain(mistakes).collect()
    }
}

impl Place<DragJacobian> {
    pub(super) fn block(
        &self,
        description: &'static str,
        block: fn(&Body, &Parameters) -> Mat2,
    ) -> Mistake {
        self.mistake(description, move |jacobian| jacobian.block = block)
    }
}

fn in_elastic_dx() -> Vec<Mistake> {
    let of = place("spring, elastic force, ∂F/∂x", Part::One("springforce", "elastic"), |s| {
        &mut s.elastic_dx
    });
    of.with([
        of.one_entry_negated(),
        of.block("n nᵀ missing", |pair, p| -p["k"] * strain(pair, p) * pair.across()),
        of.mistake("block j, j assigned, not added", |jacobian| {
            jacobian.add = |sum, block, place| if place == [1, 1] { block } else { sum + block };
        }),
        of.block("(l − l0)/l (I − n nᵀ) missing", |pair, p| -p["k"] * pair.nn()),
        of.block("I instead of I − n nᵀ", |pair, p| {
            -p["k"] * (pair.nn() + strain(pair, p) * Mat2::identity())
        }),
        of.block("(l − l0)/l missing", |_, p| -p["k"] * Mat2::identity()),
        of.block("l − l0 not divided by l", |pair, p| {
            -p["k"] * (pair.nn() + (pair.l() - p["l0"]) * pair.across())
        }),
        of.block("rest length in the denominator of (l − l0)/l", |pair, p| {
            -p["k"] * (pair.nn() + (pair.l() - p["l0"]) / p["l0"] * pair.across())
        }),
        of.block("stiffness missing", |pair, p| -(pair.nn() + strain(pair, p) * pair.across())),
        of.block("direction not normalised", |pair, p| {
            let dd = pair.d() * pair.d().transpose();
            -p["k"] * (dd + strain(pair, p) * (Mat2::identity() - dd))
        }),
    ])
}

fn in_green_dx() -> Vec<Mistake> {
    let of = place("spring of squared length, ∂F/∂x", Part::All("greenspringforce"), |s| {
        &mut s.green_dx
    });
    of.with([
        of.block("n nᵀ missing", |pair, p| {
            -2.0 * p["k"] * ((pair.l() / p["l0"]).powi(2) - 1.0) * Mat2::identity()
        }),
        of.block("(l²/l0² − 1) I missing", |pair, p| {
            -4.0 * p["k"] * (pair.l() / p["l0"]).powi(2) * pair.nn()
        }),
        of.block("n nᵀ once instead of twice", |pair, p| {
            let ratio = (pair.l() / p["l0"]).powi(2);
            -2.0 * p["k"] * ((ratio - 1.0) * Mat2::identity() + ratio * pair.nn())
        }),
        of.block("not divided by l0²", |pair, p| {
            let ratio = (pair.l() / p["l0"]).powi(2);
            -2.0 * p["k"] * ((ratio - 1.0) * Mat2::identity() + 2.0 * pair.l().powi(2) * pair.nn())
        }),
        of.block("that of a Hookean spring", |pair, p| {
            -p["k"] * (pair.nn() + strain(pair, p) * pair.across())
        }),
    ])
}

/// `(l − l0)/l`.
fn strain(pair: &Pair, p: &Parameters) -> f64 {
    (pair.l() - p["l0"]) / pair.l()
}

/// `n·w I + n wᵀ`.
fn turning(pair: &Pair) -> Mat2 {
    pair.n().dot(&pair.w()) * Mat2::identity() + pair.n() * pair.w().transpose()
}

fn in_damping_dx() -> Vec<Mistake> {
    let of = place("spring, damping, ∂F/∂x", Part::One("springforce", "damping"), |s| {
        &mut s.damping_dx
    });
    let mut mistakes = of.with([
        of.transposed(),
        of.block("n·w I missing", |pair, p| {
            -p["b"] / pair.l() * pair.n() * pair.w().transpose() * pair.across()
        }),
        of.block("n wᵀ missing", |pair, p| {
            -p["b"] / pair.l() * pair.n().dot(&pair.w()) * pair.across()
        }),
        of.block("factor I − n nᵀ missing", |pair, p| -p["b"] / pair.l() * turning(pair)),
        of.block("1/l missing", |pair, p| -p["b"] * turning(pair) * pair.across()),
        of.block("coefficient missing", |pair, _| -1.0 / pair.l() * turning(pair) * pair.across()),
        of.block("velocity of i instead of v_i − v_j", |pair, p| {
            let (n, v) = (pair.n(), pair.v[0]);
            let turning = n.dot(&v) * Mat2::identity() + n * v.transpose();
            -p["b"] / pair.l() * turning * pair.across()
        }),
    ]);
    for mistake in &mut mistakes {
        mistake.missed_by_the_course =
            ["missing", "wrong sign", "transposed"].contains(&mistake.description);
    }
    mistakes
}

fn in_damping_dv() -> Vec<Mistake> {
    let of = place("spring, damping, ∂F/∂v", Part::One("springforce", "damping"), |s| {
        &mut s.damping_dv
    });
    of.with([
        of.one_entry_negated(),
        of.block("not projected on the spring's axis", |_, p| -p["b"] * Mat2::identity()),
        of.block("projected across the spring's axis", |pair, p| -p["b"] * pair.across()),
        of.block("coefficient missing", |pair, _| -pair.nn()),
        of.block("stiffness instead of the coefficient", |pair, p| -p["k"] * pair.nn()),
        of.block("direction not normalised", |pair, p| -p["b"] * pair.d() * pair.d().transpose()),
    ])
}

/// `I − 3 n nᵀ`.
fn tidal(pair: &Pair) -> Mat2 {
    Mat2::identity() - 3.0 * pair.nn()
}

fn in_gravitation_dx() -> Vec<Mistake> {
    let of =
        place("gravitation, ∂F/∂x", Part::All("gravitationalforce"), |s| &mut s.gravitation_dx);
    of.with([
        of.one_entry_negated(),
        of.block("3 n nᵀ missing", |pair, p| -weight(pair, p) * Mat2::identity()),
        of.block("n nᵀ without its 3", |pair, p| -weight(pair, p) * pair.across()),
        of.block("I missing", |pair, p| 3.0 * weight(pair, p) * pair.nn()),
        of.block("1/l³ missing", |pair, p| -p["G"] * pair.m[0] * pair.m[1] * tidal(pair)),
        of.block("1/l² instead of 1/l³", |pair, p| -weight(pair, p) * pair.l() * tidal(pair)),
        of.block("G missing", |pair, _| -pair.m[0] * pair.m[1] / pair.l().powi(3) * tidal(pair)),
        of.block("first mass missing", |pair, p| {
            -p["G"] * pair.m[1] / pair.l().powi(3) * tidal(pair)
        }),
        of.block("second mass missing", |pair, p| {
            -p["G"] * pair.m[0] / pair.l().powi(3) * tidal(pair)
        }),
    ])
}

/// `G m_i m_j / l³`.
fn weight(pair: &Pair, p: &Parameters) -> f64 {
    p["G"] * pair.m[0] * pair.m[1] / pair.l().powi(3)
}

fn in_drag_dv() -> Vec<Mistake> {
    let of = place("linear drag, ∂F/∂v", Part::All("dragdamping"), |s| &mut s.drag_dv);
    vec![
        of.block("missing", |_, _| Mat2::zeros()),
        of.block("wrong sign", |body, p| -drag_dv(body, p)),
        of.block("scaled by mass", |body, p| body.m * drag_dv(body, p)),
        of.block("coefficient missing", |_, _| -Mat2::identity()),
        of.block("only along x", |_, p| Mat2::new(-p["b"], 0.0, 0.0, 0.0)),
        of.block("fills the whole 2 × 2 block", |_, p| Mat2::repeat(-p["b"])),
        of.mistake("local instead of global indices", |jacobian| jacobian.place = |_| 0),
    ]
}

/// `kvc / r³`.
fn scale(pair: &Pair, p: &Parameters) -> f64 {
    p["kvc"] / pair.l().powi(3)
}

/// `kbs (R − 3 R n nᵀ)`.
fn swirl(pair: &Pair, p: &Parameters) -> Mat2 {
    p["kbs"] * quarter_turn() * tidal(pair)
}

/// `2 w nᵀ`.
fn viscous(pair: &Pair) -> Mat2 {
    2.0 * pair.w() * pair.n().transpose()
}

fn in_vortex_dx() -> Vec<Mistake> {
    let of = place("vortex, ∂F/∂x", Part::All("vortexforce"), |s| &mut s.vortex_dx);
    of.with([
        of.transposed(),
        of.block("rotating part missing", |pair, p| scale(pair, p) * viscous(pair)),
        of.block("R missing", |pair, p| {
            let swirl = -3.0 * p["kbs"] * quarter_turn() * pair.nn();
            scale(pair, p) * (swirl + viscous(pair))
        }),
        of.block("3 R n nᵀ missing", |pair, p| {
            scale(pair, p) * (p["kbs"] * quarter_turn() + viscous(pair))
        }),
        of.block("R n nᵀ without its 3", |pair, p| {
            scale(pair, p) * (p["kbs"] * quarter_turn() * pair.across() + viscous(pair))
        }),
        of.block("no rotation (I instead of R)", |pair, p| {
            scale(pair, p) * (p["kbs"] * tidal(pair) + viscous(pair))
        }),
        of.block("2 w nᵀ missing", |pair, p| scale(pair, p) * swirl(pair, p)),
        of.block("w nᵀ without its 2", |pair, p| {
            scale(pair, p) * (swirl(pair, p) + 0.5 * viscous(pair))
        }),
        of.block("n wᵀ instead of w nᵀ", |pair, p| {
            scale(pair, p) * (swirl(pair, p) + viscous(pair).transpose())
        }),
        of.block("kbs missing", |pair, p| {
            scale(pair, p) * (quarter_turn() * tidal(pair) + viscous(pair))
        }),
        of.block("kvc missing", |pair, p| (swirl(pair, p) + viscous(pair)) / pair.l().powi(3)),
        of.block("1/r² instead of 1/r³", |pair, p| {
            scale(pair, p) * pair.l() * (swirl(pair, p) + viscous(pair))
        }),
    ])
}

fn in_vortex_dv() -> Vec<Mistake> {
    let of = place("vortex, ∂F/∂v", Part::All("vortexforce"), |s| &mut s.vortex_dv);
    of.with([
        of.block("projected on the axis", |pair, p| -p["kvc"] / pair.l().powi(2) * pair.nn()),
        of.block("kvc missing", |pair, _| -Mat2::identity() / pair.l().powi(2)),
        of.block("1/r² missing", |_, p| -p["kvc"] * Mat2::identity()),
        of.block("1/r instead of 1/r²", |pair, p| -p["kvc"] / pair.l() * Mat2::identity()),
    ])
}
