//! Mistakes in integrators.

use nalgebra::{DMatrix, DVector};

use super::super::student::{Explicit, Implicit, Keeps, Student, Vec2};
use super::{Area, Mistake, Scope, Subject};

pub(super) fn mistakes() -> Vec<Mistake> {
    let groups = [in_explicit(), in_symplectic(), in_linearized(), in_implicit()];
    groups.into_iter().flatten().collect()
}

fn subject(name: &'static str, integrator: &'static str) -> Subject {
    Subject { area: Area::Integrator, name, scope: Scope::Integrator(integrator) }
}

/// Mistakes possible in both explicit methods.
fn in_either(subject: &Subject, of: fn(&mut Student) -> &mut Explicit) -> Vec<Mistake> {
    vec![
        subject.mistake("forgotten h in the velocity", move |s| {
            of(s).velocity = |v, f, m, _| v + f / m;
        }),
        subject.mistake("forgotten mass", move |s| of(s).velocity = |v, f, _, h| v + h * f),
        subject.mistake("multiplies by the mass", move |s| {
            of(s).velocity = |v, f, m, h| v + h * m * f;
        }),
        subject.mistake("force with the wrong sign", move |s| {
            of(s).velocity = |v, f, m, h| v - h / m * f;
        }),
        subject.mistake("force at q + h v", move |s| of(s).force_at = |q, v, h| q + h * v),
        subject.mistake("position not moved", move |s| of(s).position = |q, _, _, _| q),
        subject.mistake("position with the mean of the old and the new velocity", move |s| {
            of(s).position = |q, old, new, h| q + h / 2.0 * (old + new);
        }),
        subject.mistake("forces not set to zero between steps", move |s| {
            of(s).keeps = Keeps::Forces;
        }),
    ]
}

fn in_explicit() -> Vec<Mistake> {
    let of = subject("explicit Euler", "explicit-euler");
    let mut mistakes = in_either(&of, |s| &mut s.explicit);
    mistakes.extend([
        of.mistake("position with the new velocity", |s| s.explicit.position = with_new),
        of.mistake("forgotten h in the position", |s| {
            s.explicit.position = |q, old, _, _| q + old;
        }),
    ]);
    mistakes
}

fn in_symplectic() -> Vec<Mistake> {
    let of = subject("symplectic Euler", "symplectic-euler");
    let mut mistakes = in_either(&of, |s| &mut s.symplectic);
    mistakes.extend([
        of.mistake("position with the old velocity", |s| s.symplectic.position = with_old),
        of.mistake("forgotten h in the position", |s| {
            s.symplectic.position = |q, _, new, _| q + new;
        }),
    ]);
    mistakes
}

fn with_new(q: Vec2, _old: Vec2, new: Vec2, h: f64) -> Vec2 {
    q + h * new
}

fn with_old(q: Vec2, old: Vec2, _new: Vec2, h: f64) -> Vec2 {
    q + h * old
}

/// Mistakes possible in both implicit methods.
fn in_either_implicit(subject: &Subject, of: fn(&mut Student) -> &mut Implicit) -> Vec<Mistake> {
    vec![
        subject.mistake("force at q", move |s| of(s).force_at = |q, _, _| q),
        subject.mistake("identity instead of M", move |s| of(s).mass = |_| 1.0),
        subject.mistake("position with the old velocity", move |s| of(s).position = with_old),
        subject.mistake("forgotten h in the position", move |s| {
            of(s).position = |q, _, new, _| q + new;
        }),
        subject.mistake("right-hand side without h", move |s| {
            of(s).right_hand_side = |m, v, u, f, _| -m * (u - v) + f;
        }),
        subject.mistake("right-hand side with the wrong sign of the force", move |s| {
            of(s).right_hand_side = |m, v, u, f, h| -m * (u - v) - h * f;
        }),
    ]
}

fn in_linearized() -> Vec<Mistake> {
    let of = subject("linearized implicit Euler", "linearized-implicit-euler");
    let mut mistakes = in_either_implicit(&of, |s| &mut s.linearized);
    mistakes.extend([
        of.mistake("Jacobians at q", |s| s.linearized.jacobians_at = |q, _, _| q),
        of.mistake("∂F/∂x at q, ∂F/∂v at q + h v", |s| {
            s.linearized.dx_at = Some(|q, _, _| q)
        }),
        of.mistake("force and Jacobians at q", |s| {
            s.linearized.force_at = |q, _, _| q;
            s.linearized.jacobians_at = |q, _, _| q;
        }),
        of.mistake("identity instead of M in the matrix alone", |s| {
            s.linearized.matrix = |m, dx, dv, h| f64::from(m != 0.0) - (h * h * dx + h * dv);
        }),
        of.mistake("h instead of h² on ∂F/∂x", |s| {
            s.linearized.matrix = |m, dx, dv, h| m - (h * dx + h * dv);
        }),
        of.mistake("h² instead of h on ∂F/∂v", |s| {
            s.linearized.matrix = |m, dx, dv, h| m - (h * h * dx + h * h * dv);
        }),
        of.mistake("∂F/∂x with the wrong sign", |s| {
            s.linearized.matrix = |m, dx, dv, h| m + h * h * dx - h * dv;
        }),
        of.mistake("∂F/∂v with the wrong sign", |s| {
            s.linearized.matrix = |m, dx, dv, h| m - h * h * dx + h * dv;
        }),
        of.mistake("∂F/∂x and ∂F/∂v with the wrong sign", |s| {
            s.linearized.matrix = |m, dx, dv, h| m + h * h * dx + h * dv;
        }),
        of.mistake("no ∂F/∂x", |s| s.linearized.matrix = |m, _, dv, h| m - h * dv),
        of.mistake("no ∂F/∂v", |s| s.linearized.matrix = |m, dx, _, h| m - h * h * dx),
        of.mistake("no Jacobians at all", |s| s.linearized.matrix = |m, _, _, _| m),
        of.mistake("the blocks on the diagonal of the matrix alone", |s| {
            s.linearized.solved =
                |a, row, column| if row / 2 == column / 2 { a[(row, column)] } else { 0.0 };
        }),
        of.mistake("forces not set to zero between steps", |s| s.linearized.keeps = Keeps::Forces),
        of.mistake("Jacobians not set to zero between steps", |s| {
            s.linearized.keeps = Keeps::Jacobians;
        }),
        of.mistake("Jacobians of the first step in all steps", |s| {
            s.linearized.keeps = Keeps::FirstJacobians;
        }),
        of.mistake("elimination without the last row", |s| {
            s.linearized.solve = |a, b| Some(eliminate(a, b, 1, 0, |factor| factor));
        }),
        of.mistake("elimination with the absolute value of a row's factor", |s| {
            s.linearized.solve = |a, b| Some(eliminate(a, b, 0, 0, f64::abs));
        }),
        of.mistake("back substitution from two columns right of the diagonal", |s| {
            s.linearized.solve = |a, b| Some(eliminate(a, b, 0, 1, |factor| factor));
        }),
        of.mistake("Newton run to convergence (implicit Euler)", |s| s.linearized = s.implicit),
    ]);
    mistakes
}

/// Gaussian elimination: `rows` at the end and `columns` right of the diagonal are left out.
fn eliminate(
    mut a: DMatrix<f64>,
    b: &DVector<f64>,
    rows: usize,
    columns: usize,
    taken: fn(f64) -> f64,
) -> DVector<f64> {
    let (n, mut x) = (b.len(), b.clone());
    for k in 0..n {
        for i in k + 1..n - rows {
            let factor = taken(a[(i, k)] / a[(k, k)]);
            for j in 0..n {
                a[(i, j)] -= factor * a[(k, j)];
            }
            x[i] -= factor * x[k];
        }
    }
    for i in (0..n).rev() {
        for j in i + 1 + columns..n {
            x[i] -= a[(i, j)] * x[j];
        }
        x[i] /= a[(i, i)];
    }
    x
}

fn in_implicit() -> Vec<Mistake> {
    let of = subject("implicit Euler", "implicit-euler");
    let mut mistakes = in_either_implicit(&of, |s| &mut s.implicit);
    mistakes.extend([
        of.mistake("a single Newton iteration", |s| s.implicit.max_iterations = 1),
        of.mistake("two Newton iterations", |s| s.implicit.max_iterations = 2),
        of.mistake("Newton stopped at 1e-3", |s| s.implicit.tolerance = 1e-3),
        of.mistake("forgotten −M (v_i − v_n)", |s| {
            s.implicit.right_hand_side = |_, _, _, f, h| h * f;
        }),
        of.mistake("M (v_i − v_n) without its mass", |s| {
            s.implicit.right_hand_side = |_, v, u, f, h| -(u - v) + h * f;
        }),
        of.mistake("M (v_i − v_n) with the wrong sign", |s| {
            s.implicit.right_hand_side = |m, v, u, f, h| m * (u - v) + h * f;
        }),
    ]);
    mistakes
}
