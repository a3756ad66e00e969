//! Mistakes in Jacobians. They have an effect only with the two implicit methods, and with implicit Euler only if
//! Newton's method no longer converges.

use super::super::student::{
    DragJacobian, Jacobian, Mat2, Pair, Parameters, Student, drag_dv, four_blocks, quarter_turn,
};
use super::{Area, Mistake, Scope, Subject};
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

fn subject(name: &'static str, part: Part) -> Subject {
    Subject { area: Area::Jacobian, name, scope: Scope::Jacobian(part) }
}

/// Mistakes possible in any Jacobian of a pair force.
fn in_any(subject: &Subject, of: fn(&mut Student) -> &mut Jacobian) -> Vec<Mistake> {
    vec![
        subject.mistake("missing", move |s| of(s).spread = |_| [[Mat2::zeros(); 2]; 2]),
        subject.mistake("wrong sign", move |s| of(s).spread = |k| four_blocks(-k)),
        subject.mistake("off-diagonal blocks missing", move |s| {
            of(s).spread = |k| [[k, Mat2::zeros()], [Mat2::zeros(), k]];
        }),
        subject.mistake("off-diagonal blocks with the wrong sign", move |s| {
            of(s).spread = |k| [[k, k], [k, k]];
        }),
        subject.mistake("rows of j missing", move |s| {
            of(s).spread = |k| [[k, -k], [Mat2::zeros(); 2]];
        }),
        subject.mistake("local instead of global indices", move |s| of(s).place = |_| [0, 1]),
    ]
}

fn transposed(subject: &Subject, of: fn(&mut Student) -> &mut Jacobian) -> Mistake {
    subject.mistake("transposed", move |s| of(s).spread = |k| four_blocks(k.transpose()))
}

fn in_elastic_dx() -> Vec<Mistake> {
    let of = subject("spring, elastic force, ∂F/∂x", Part::One("springforce", "elastic"));
    let mut mistakes = in_any(&of, |s| &mut s.elastic_dx);
    mistakes.extend([
        of.mistake("n nᵀ missing", |s| {
            s.elastic_dx.block = |pair, p| -p["k"] * strain(pair, p) * pair.across();
        }),
        of.mistake("(l − l0)/l (I − n nᵀ) missing", |s| {
            s.elastic_dx.block = |pair, p| -p["k"] * pair.nn();
        }),
        of.mistake("I instead of I − n nᵀ", |s| {
            s.elastic_dx.block =
                |pair, p| -p["k"] * (pair.nn() + strain(pair, p) * Mat2::identity());
        }),
        of.mistake("(l − l0)/l missing", |s| {
            s.elastic_dx.block = |_, p| -p["k"] * Mat2::identity()
        }),
        of.mistake("l − l0 not divided by l", |s| {
            s.elastic_dx.block =
                |pair, p| -p["k"] * (pair.nn() + (pair.l() - p["l0"]) * pair.across());
        }),
        of.mistake("rest length in the denominator of (l − l0)/l", |s| {
            s.elastic_dx.block =
                |pair, p| -p["k"] * (pair.nn() + (pair.l() - p["l0"]) / p["l0"] * pair.across());
        }),
        of.mistake("stiffness missing", |s| {
            s.elastic_dx.block = |pair, p| -(pair.nn() + strain(pair, p) * pair.across());
        }),
        of.mistake("direction not normalised", |s| {
            s.elastic_dx.block = |pair, p| {
                let dd = pair.d() * pair.d().transpose();
                -p["k"] * (dd + strain(pair, p) * (Mat2::identity() - dd))
            };
        }),
    ]);
    mistakes
}

fn in_green_dx() -> Vec<Mistake> {
    let of = subject("spring of squared length, ∂F/∂x", Part::All("greenspringforce"));
    let mut mistakes = in_any(&of, |s| &mut s.green_dx);
    mistakes.extend([
        of.mistake("n nᵀ missing", |s| {
            s.green_dx.block =
                |pair, p| -2.0 * p["k"] * ((pair.l() / p["l0"]).powi(2) - 1.0) * Mat2::identity();
        }),
        of.mistake("(l²/l0² − 1) I missing", |s| {
            s.green_dx.block = |pair, p| -4.0 * p["k"] * (pair.l() / p["l0"]).powi(2) * pair.nn();
        }),
        of.mistake("n nᵀ once instead of twice", |s| {
            s.green_dx.block = |pair, p| {
                let ratio = (pair.l() / p["l0"]).powi(2);
                -2.0 * p["k"] * ((ratio - 1.0) * Mat2::identity() + ratio * pair.nn())
            };
        }),
        of.mistake("not divided by l0²", |s| {
            s.green_dx.block = |pair, p| {
                let ratio = (pair.l() / p["l0"]).powi(2);
                -2.0 * p["k"]
                    * ((ratio - 1.0) * Mat2::identity() + 2.0 * pair.l().powi(2) * pair.nn())
            };
        }),
        of.mistake("that of a Hookean spring", |s| {
            s.green_dx.block = |pair, p| -p["k"] * (pair.nn() + strain(pair, p) * pair.across());
        }),
    ]);
    mistakes
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
    let of = subject("spring, damping, ∂F/∂x", Part::One("springforce", "damping"));
    let field: fn(&mut Student) -> &mut Jacobian = |s| &mut s.damping_dx;
    let mut mistakes = in_any(&of, field);
    for mistake in &mut mistakes {
        mistake.missed_by_the_course = ["missing", "wrong sign"].contains(&mistake.description);
    }
    mistakes.extend([
        transposed(&of, field).missed_by_the_course(),
        of.mistake("n·w I missing", |s| {
            s.damping_dx.block =
                |pair, p| -p["b"] / pair.l() * pair.n() * pair.w().transpose() * pair.across();
        }),
        of.mistake("n wᵀ missing", |s| {
            s.damping_dx.block =
                |pair, p| -p["b"] / pair.l() * pair.n().dot(&pair.w()) * pair.across();
        }),
        of.mistake("factor I − n nᵀ missing", |s| {
            s.damping_dx.block = |pair, p| -p["b"] / pair.l() * turning(pair);
        }),
        of.mistake("1/l missing", |s| {
            s.damping_dx.block = |pair, p| -p["b"] * turning(pair) * pair.across();
        }),
        of.mistake("coefficient missing", |s| {
            s.damping_dx.block = |pair, _| -1.0 / pair.l() * turning(pair) * pair.across();
        }),
        of.mistake("velocity of i instead of v_i − v_j", |s| {
            s.damping_dx.block = |pair, p| {
                let (n, v) = (pair.n(), pair.v[0]);
                let turning = n.dot(&v) * Mat2::identity() + n * v.transpose();
                -p["b"] / pair.l() * turning * pair.across()
            };
        }),
    ]);
    mistakes
}

fn in_damping_dv() -> Vec<Mistake> {
    let of = subject("spring, damping, ∂F/∂v", Part::One("springforce", "damping"));
    let mut mistakes = in_any(&of, |s| &mut s.damping_dv);
    mistakes.extend([
        of.mistake("not projected on the spring's axis", |s| {
            s.damping_dv.block = |_, p| -p["b"] * Mat2::identity();
        }),
        of.mistake("projected across the spring's axis", |s| {
            s.damping_dv.block = |pair, p| -p["b"] * pair.across();
        }),
        of.mistake("coefficient missing", |s| s.damping_dv.block = |pair, _| -pair.nn()),
        of.mistake("stiffness instead of the coefficient", |s| {
            s.damping_dv.block = |pair, p| -p["k"] * pair.nn();
        }),
        of.mistake("direction not normalised", |s| {
            s.damping_dv.block = |pair, p| -p["b"] * pair.d() * pair.d().transpose();
        }),
    ]);
    mistakes
}

/// `I − 3 n nᵀ`.
fn tidal(pair: &Pair) -> Mat2 {
    Mat2::identity() - 3.0 * pair.nn()
}

fn in_gravitation_dx() -> Vec<Mistake> {
    let of = subject("gravitation, ∂F/∂x", Part::All("gravitationalforce"));
    let mut mistakes = in_any(&of, |s| &mut s.gravitation_dx);
    mistakes.extend([
        of.mistake("3 n nᵀ missing", |s| {
            s.gravitation_dx.block = |pair, p| -weight(pair, p) * Mat2::identity();
        }),
        of.mistake("n nᵀ without its 3", |s| {
            s.gravitation_dx.block = |pair, p| -weight(pair, p) * pair.across();
        }),
        of.mistake("I missing", |s| {
            s.gravitation_dx.block = |pair, p| 3.0 * weight(pair, p) * pair.nn();
        }),
        of.mistake("1/l³ missing", |s| {
            s.gravitation_dx.block = |pair, p| -p["G"] * pair.m[0] * pair.m[1] * tidal(pair);
        }),
        of.mistake("1/l² instead of 1/l³", |s| {
            s.gravitation_dx.block = |pair, p| -weight(pair, p) * pair.l() * tidal(pair);
        }),
        of.mistake("G missing", |s| {
            s.gravitation_dx.block =
                |pair, _| -pair.m[0] * pair.m[1] / pair.l().powi(3) * tidal(pair);
        }),
        of.mistake("first mass missing", |s| {
            s.gravitation_dx.block = |pair, p| -p["G"] * pair.m[1] / pair.l().powi(3) * tidal(pair);
        }),
        of.mistake("second mass missing", |s| {
            s.gravitation_dx.block = |pair, p| -p["G"] * pair.m[0] / pair.l().powi(3) * tidal(pair);
        }),
    ]);
    mistakes
}

/// `G m_i m_j / l³`.
fn weight(pair: &Pair, p: &Parameters) -> f64 {
    p["G"] * pair.m[0] * pair.m[1] / pair.l().powi(3)
}

fn in_drag_dv() -> Vec<Mistake> {
    let of = subject("linear drag, ∂F/∂v", Part::All("dragdamping"));
    vec![
        of.mistake("missing", |s| s.drag_dv.block = |_, _| Mat2::zeros()),
        of.mistake("wrong sign", |s| s.drag_dv.block = |body, p| -drag_dv(body, p)),
        of.mistake("scaled by mass", |s| s.drag_dv.block = |body, p| body.m * drag_dv(body, p)),
        of.mistake("coefficient missing", |s| s.drag_dv.block = |_, _| -Mat2::identity()),
        of.mistake("only along x", |s| s.drag_dv.block = |_, p| Mat2::new(-p["b"], 0.0, 0.0, 0.0)),
        of.mistake("fills the whole 2 × 2 block", |s| {
            s.drag_dv.block = |_, p| Mat2::repeat(-p["b"]);
        }),
        of.mistake("local instead of global indices", |s| {
            s.drag_dv = DragJacobian { place: |_| 0, ..s.drag_dv };
        }),
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
    let of = subject("vortex, ∂F/∂x", Part::All("vortexforce"));
    let field: fn(&mut Student) -> &mut Jacobian = |s| &mut s.vortex_dx;
    let mut mistakes = in_any(&of, field);
    mistakes.extend([
        transposed(&of, field),
        of.mistake("rotating part missing", |s| {
            s.vortex_dx.block = |pair, p| scale(pair, p) * viscous(pair);
        }),
        of.mistake("R missing", |s| {
            s.vortex_dx.block = |pair, p| {
                let swirl = -3.0 * p["kbs"] * quarter_turn() * pair.nn();
                scale(pair, p) * (swirl + viscous(pair))
            };
        }),
        of.mistake("3 R n nᵀ missing", |s| {
            s.vortex_dx.block =
                |pair, p| scale(pair, p) * (p["kbs"] * quarter_turn() + viscous(pair));
        }),
        of.mistake("R n nᵀ without its 3", |s| {
            s.vortex_dx.block = |pair, p| {
                scale(pair, p) * (p["kbs"] * quarter_turn() * pair.across() + viscous(pair))
            };
        }),
        of.mistake("no rotation (I instead of R)", |s| {
            s.vortex_dx.block = |pair, p| scale(pair, p) * (p["kbs"] * tidal(pair) + viscous(pair));
        }),
        of.mistake("2 w nᵀ missing", |s| {
            s.vortex_dx.block = |pair, p| scale(pair, p) * swirl(pair, p);
        }),
        of.mistake("w nᵀ without its 2", |s| {
            s.vortex_dx.block = |pair, p| scale(pair, p) * (swirl(pair, p) + 0.5 * viscous(pair));
        }),
        of.mistake("n wᵀ instead of w nᵀ", |s| {
            s.vortex_dx.block =
                |pair, p| scale(pair, p) * (swirl(pair, p) + viscous(pair).transpose());
        }),
        of.mistake("kbs missing", |s| {
            s.vortex_dx.block =
                |pair, p| scale(pair, p) * (quarter_turn() * tidal(pair) + viscous(pair));
        }),
        of.mistake("kvc missing", |s| {
            s.vortex_dx.block = |pair, p| (swirl(pair, p) + viscous(pair)) / pair.l().powi(3);
        }),
        of.mistake("1/r² instead of 1/r³", |s| {
            s.vortex_dx.block =
                |pair, p| scale(pair, p) * pair.l() * (swirl(pair, p) + viscous(pair));
        }),
    ]);
    mistakes
}

fn in_vortex_dv() -> Vec<Mistake> {
    let of = subject("vortex, ∂F/∂v", Part::All("vortexforce"));
    let mut mistakes = in_any(&of, |s| &mut s.vortex_dv);
    mistakes.extend([
        of.mistake("projected on the axis", |s| {
            s.vortex_dv.block = |pair, p| -p["kvc"] / pair.l().powi(2) * pair.nn();
        }),
        of.mistake("kvc missing", |s| {
            s.vortex_dv.block = |pair, _| -Mat2::identity() / pair.l().powi(2);
        }),
        of.mistake("1/r² missing", |s| s.vortex_dv.block = |_, p| -p["kvc"] * Mat2::identity()),
        of.mistake("1/r instead of 1/r²", |s| {
            s.vortex_dv.block = |pair, p| -p["kvc"] / pair.l() * Mat2::identity();
        }),
    ]);
    mistakes
}
