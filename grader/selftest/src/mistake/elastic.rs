//! Mistakes with elastic bodies: in the forces, and the same in the Hessians.

use diagnosis::findings::Part;

use super::super::student::{
    Hinge, Mat2, NineBlocks, Student, Three, Triangle, Vec2, cross, path_length, quarter_turn,
};
use super::{Mistake, Place};
use super::{force, jacobian};

const BAR: Part = Part::All("elasticbodyspringforce");
const HINGE: Part = Part::All("elasticbodybendingforce");
const TRIANGLE: Part = Part::All("elasticbodycstforce");

/// A change of the formulas of an element.
type Change<T> = (&'static str, fn(&mut T));

fn planted<T>(of: &Place<T>, changes: &[Change<T>]) -> Vec<Mistake> {
    changes.iter().map(|(description, change)| of.mistake(description, *change)).collect()
}

pub(super) fn in_forces() -> Vec<Mistake> {
    let bar = force::place("elastic bar", BAR, |s: &mut Student| &mut s.bar);
    let hinge = force::place("bending", HINGE, |s: &mut Student| &mut s.hinge);
    let triangle = force::place("triangle", TRIANGLE, |s: &mut Student| &mut s.triangle);
    let bars = bar.with([
        bar.law("modulus not divided by the rest length", |pair, p| {
            -p["alpha"] * (pair.l() - p["l0"]) * pair.n()
        }),
        bar.law("modulus divided by the length of the moment", |pair, p| {
            -p["alpha"] / pair.l() * (pair.l() - p["l0"]) * pair.n()
        }),
        bar.law("modulus divided by the rest length twice", |pair, p| {
            -p["alpha"] / p["l0"].powi(2) * (pair.l() - p["l0"]) * pair.n()
        }),
        bar.law("rest length left out", |pair, p| -p["alpha"] / p["l0"] * pair.d()),
        bar.law("only pulls, never pushes", |pair, p| {
            -p["alpha"] / p["l0"] * (pair.l() - p["l0"]).max(0.0) * pair.n()
        }),
    ]);
    let hinges = [IN_HINGES, IN_SHARES_OF_HINGES].into_iter().flat_map(|of| planted(&hinge, of));
    let triangles =
        [IN_TRIANGLES, IN_SHARES_OF_TRIANGLES].into_iter().flat_map(|of| planted(&triangle, of));
    bars.into_iter().chain(hinges).chain(triangles).collect()
}

pub(super) fn in_jacobians() -> Vec<Mistake> {
    let bar = jacobian::place("elastic bar, ∂F/∂x", BAR, |s: &mut Student| &mut s.bar_dx);
    let hinge = jacobian::place("bending, ∂F/∂x", HINGE, |s: &mut Student| &mut s.hinge_dx);
    let triangle =
        jacobian::place("triangle, ∂F/∂x", TRIANGLE, |s: &mut Student| &mut s.triangle_dx);
    let bars = bar.with([
        bar.block("(l − l0)/l (I − n nᵀ) missing", |pair, p| {
            -p["alpha"] / p["l0"] * pair.nn()
        }),
        bar.block("(l − l0)/l missing", |_, p| -p["alpha"] / p["l0"] * Mat2::identity()),
        bar.block("modulus not divided by the rest length", |pair, p| {
            let strain = (pair.l() - p["l0"]) / pair.l();
            -p["alpha"] * (pair.nn() + strain * pair.across())
        }),
    ]);
    let hinges = [IN_HINGES, IN_HESSIANS_OF_HINGES].into_iter().flat_map(|of| planted(&hinge, of));
    let triangles =
        [IN_TRIANGLES, IN_HESSIANS_OF_TRIANGLES].into_iter().flat_map(|of| planted(&triangle, of));
    bars.into_iter().chain(hinges).chain(triangles).collect()
}

fn length_now(three: &Three) -> f64 {
    let [a, b, c] = three.x;
    (b - a).norm() + (c - b).norm()
}

const IN_HINGES: &[Change<Hinge>] = &[
    ("angle without its sign, by acos", |h| {
        h.angle = |e1, e2| (e1.dot(&e2) / (e1.norm() * e2.norm())).clamp(-1.0, 1.0).acos();
    }),
    ("angle from e2 to e1", |h| h.angle = |e1, e2| cross(e2, e1).atan2(e1.dot(&e2))),
    ("sine in place of the angle", |h| {
        h.angle = |e1, e2| cross(e1, e2) / (e1.norm() * e2.norm());
    }),
    ("angle at rest added instead of subtracted", |h| h.change = |theta, theta0| theta + theta0),
    ("angle at rest left out", |h| h.change = |theta, _| theta),
    ("lengths of the moment instead of the initial ones", |h| {
        h.stiffness = |three, alpha| alpha / length_now(three);
    }),
    ("not divided by the lengths", |h| h.stiffness = |_, alpha| alpha),
    ("divided by the length of the first bar only", |h| {
        h.stiffness = |three, alpha| alpha / (three.start[1] - three.start[0]).norm();
    }),
    ("divided by the mean of the lengths", |h| {
        h.stiffness = |three, alpha| 2.0 * alpha / path_length(three);
    }),
    ("gradient of the angle divided by |e| instead of |e|²", |h| {
        h.slope = |e| quarter_turn() * e / e.norm();
    }),
];

const IN_SHARES_OF_HINGES: &[Change<Hinge>] = &[
    ("missing", |h| h.share = |_, _| [Vec2::zeros(); 3]),
    ("gradient instead of force", |h| h.share = |a, b| [-a, a + b, -b]),
    ("difference of the angles wrapped to a turn", |h| {
        h.change = |theta, theta0| (theta - theta0).sin().atan2((theta - theta0).cos());
    }),
    ("gradient of the first bar turned the other way", |h| h.share = |a, b| [-a, a - b, b]),
    ("force on the middle particle missing", |h| h.share = |a, b| [a, Vec2::zeros(), b]),
    ("forces on the first and last particle swapped", |h| h.share = |a, b| [b, -a - b, a]),
    ("force on the middle particle of one bar only", |h| h.share = |a, b| [a, -a, b]),
];

const IN_HESSIANS_OF_HINGES: &[Change<Hinge>] = &[
    ("missing", |h| h.weights = [0.0; 2]),
    ("wrong sign", |h| h.weights = [-1.0; 2]),
    ("second derivative of the angle missing (Gauss–Newton)", |h| h.weights = [1.0, 0.0]),
    ("outer product of the gradients missing", |h| h.weights = [0.0, 1.0]),
    ("second derivative of the angle with the wrong sign", |h| h.weights = [1.0, -1.0]),
    ("second derivative of the angle: 2 J e eᵀ/|e|⁴ missing", |h| {
        h.curvature = |e| quarter_turn() / e.norm_squared();
    }),
    ("second derivative of the angle: not symmetric", |h| {
        h.curvature = |e| -2.0 * (quarter_turn() * e) * e.transpose() / e.norm_squared().powi(2);
    }),
    ("blocks of different particles missing", |h| h.place = diagonal),
    ("rows of the middle particle missing", |h| {
        h.place = |[first, _, last]| [first, [Mat2::zeros(); 3], last];
    }),
];

const IN_TRIANGLES: &[Change<Triangle>] = &[
    ("strain with the factor 1/2", |t| {
        t.strain = |p, q| [0.5 * (p.dot(&p) - 1.0), 0.5 * (q.dot(&q) - 1.0), 0.5 * p.dot(&q)];
    }),
    ("shear strain with the factor 1/2", |t| {
        t.strain = |p, q| [p.dot(&p) - 1.0, q.dot(&q) - 1.0, 0.5 * p.dot(&q)];
    }),
    ("1 − ν instead of 2 (1 − ν)", |t| {
        t.stress = |[xx, yy, xy], nu| [xx + nu * yy, yy + nu * xx, (1.0 - nu) * xy];
    }),
    ("ν on the wrong strain", |t| {
        t.stress = |[xx, yy, xy], nu| [nu * xx + yy, nu * yy + xx, 2.0 * (1.0 - nu) * xy];
    }),
    ("shear missing", |t| t.stress = |[xx, yy, _], nu| [xx + nu * yy, yy + nu * xx, 0.0]),
    ("1 − ν instead of 1 − ν²", |t| {
        t.stiffness = |modulus, nu, area| modulus * area / (1.0 - nu);
    }),
    ("ν left out", |t| t.stress = |[xx, yy, xy], _| [xx, yy, 2.0 * xy]),
    ("area left out", |t| t.area = |_, _| 1.0),
    ("area without 1/2", |t| t.area = |undeformed, _| undeformed.determinant().abs()),
    ("area with its sign", |t| t.area = |undeformed, _| 0.5 * undeformed.determinant()),
    ("area of the moment", |t| t.area = |_, deformed| 0.5 * deformed.determinant().abs()),
    ("undeformed edges transposed", |t| {
        t.inverse = |edges| edges.transpose().try_inverse().unwrap_or_else(Mat2::zeros);
    }),
    ("undeformed corners are the initial positions", |t| t.corners = |three, _| three.start),
    ("gradients of the strains xx and yy without 2", |t| {
        t.gradient = |p, q, w, z| [w * p, z * q, z * p + w * q];
    }),
    ("gradient of the shear strain of one product only", |t| {
        t.gradient = |p, q, w, z| [2.0 * w * p, 2.0 * z * q, z * p];
    }),
    ("gradients of p and q exchanged", |t| {
        t.gradient = |p, q, w, z| [2.0 * z * p, 2.0 * w * q, w * p + z * q];
    }),
];

const IN_SHARES_OF_TRIANGLES: &[Change<Triangle>] = &[
    ("missing", |t| t.share = |_, _| [Vec2::zeros(); 3]),
    ("gradient instead of force", |t| t.share = |a, b| [a + b, -a, -b]),
    ("force on the first corner missing", |t| t.share = |a, b| [Vec2::zeros(), a, b]),
    ("forces on the second and third corner swapped", |t| t.share = |a, b| [-a - b, b, a]),
    ("linear strain", |t| {
        t.strain = |p, q| [2.0 * (p.x - 1.0), 2.0 * (q.y - 1.0), p.y + q.x];
    }),
];

const IN_HESSIANS_OF_TRIANGLES: &[Change<Triangle>] = &[
    ("missing", |t| t.weights = [0.0; 2]),
    ("wrong sign", |t| t.weights = [-1.0; 2]),
    ("second derivatives of the strain missing", |t| t.weights = [0.0, 1.0]),
    ("outer products of the strain's gradients missing", |t| t.weights = [1.0, 0.0]),
    ("second derivatives of the strain with the wrong sign", |t| t.weights = [-1.0, 1.0]),
    ("blocks of different particles missing", |t| t.place = diagonal),
    ("rows of the first corner missing", |t| {
        t.place = |[_, second, third]| [[Mat2::zeros(); 3], second, third];
    }),
    ("half of it: the blocks below the diagonal missing", |t| t.place = upper),
];

fn diagonal(blocks: NineBlocks) -> NineBlocks {
    kept(blocks, |row, column| row == column)
}

fn upper(blocks: NineBlocks) -> NineBlocks {
    kept(blocks, |row, column| row <= column)
}

fn kept(mut blocks: NineBlocks, keep: fn(usize, usize) -> bool) -> NineBlocks {
    for (row, blocks) in blocks.iter_mut().enumerate() {
        for (column, block) in blocks.iter_mut().enumerate() {
            if !keep(row, column) {
                *block = Mat2::zeros();
            }
        }
    }
    blocks
}
