//! Mistakes in the treatment of fixed particles.

use diagnosis::findings::Family;
use scene::Scene;

use super::super::student::Vec2;
use super::{Area, Mistake, Scope, Subject};

pub(super) fn mistakes() -> Vec<Mistake> {
    let groups = [under_any_method(), under_explicit_methods(), under_implicit_methods()];
    groups.into_iter().flatten().collect()
}

fn subject(name: &'static str, family: Family) -> Subject {
    Subject { area: Area::Fixed, name, scope: Scope::Fixed(family) }
}

fn under_any_method() -> Vec<Mistake> {
    let of = subject("any integrator", Family::Any);
    vec![
        of.mistake("stopped: its velocity does not move it", |s| s.fixed.position = |old, _| old),
        of.mistake("its velocity is set to zero", |s| s.fixed.velocity = |_, _| Vec2::zeros()),
        of.mistake("still falls under simple gravity", |s| {
            s.fixed.velocity = |v, fall| v + fall;
        }),
        of.mistake("exerts no force on the particles it is joined to", |s| s.read = unjoin),
        of.mistake("treated as free", |s| s.read = free),
        of.mistake("free, with a mass of 1e6", |s| s.read = heavy),
    ]
}

/// Removes the forces between two particles of which one is fixed.
fn unjoin(scene: &mut Scene) {
    let Scene { particles, forces, .. } = scene;
    forces.retain(|element| element.particles.iter().all(|particle| !particles[*particle].fixed));
}

fn free(scene: &mut Scene) {
    for particle in &mut scene.particles {
        particle.fixed = false;
    }
}

fn heavy(scene: &mut Scene) {
    for particle in scene.particles.iter_mut().filter(|particle| particle.fixed) {
        (particle.fixed, particle.mass) = (false, 1e6);
    }
}

fn under_explicit_methods() -> Vec<Mistake> {
    let of = subject("explicit and symplectic Euler", Family::Explicit);
    vec![
        of.mistake("feels forces", |s| s.fixed.held = |_, free| free),
        of.mistake("held along x only", |s| s.fixed.held = |old, free| Vec2::new(old.x, free.y)),
    ]
}

fn under_implicit_methods() -> Vec<Mistake> {
    let of = subject("linearized implicit and implicit Euler", Family::Implicit);
    vec![
        of.mistake("nothing cleared: it feels forces", |s| s.fixed.hold = |_, _, _, _| ()),
        of.mistake("right-hand side cleared, rows and columns not", |s| {
            s.fixed.hold = |_, right, i, _| right.rows_mut(2 * i, 2).fill(0.0);
        }),
        of.mistake("right-hand side and columns cleared, rows not", |s| {
            s.fixed.hold = |matrix, right, i, _| {
                right.rows_mut(2 * i, 2).fill(0.0);
                for dof in [2 * i, 2 * i + 1] {
                    matrix.column_mut(dof).fill(0.0);
                    matrix[(dof, dof)] = 1.0;
                }
            };
        }),
        of.mistake("rows and columns cleared, right-hand side not", |s| {
            s.fixed.hold = |matrix, _, i, _| clear_rows_and_columns(matrix, [2 * i, 2 * i + 1]);
        }),
        of.mistake("no mass in the matrix instead of cleared rows and columns", |s| {
            s.fixed.hold = |matrix, right, i, mass| {
                right.rows_mut(2 * i, 2).fill(0.0);
                for dof in [2 * i, 2 * i + 1] {
                    matrix[(dof, dof)] -= mass;
                }
            };
        }),
        of.mistake("only its x is held", |s| {
            s.fixed.hold = |matrix, right, i, _| {
                right[2 * i] = 0.0;
                clear_rows_and_columns(matrix, [2 * i]);
            };
        }),
        of.mistake("entries i and i + 1 cleared instead of 2i and 2i + 1", |s| {
            s.fixed.hold = |matrix, right, i, _| {
                right.rows_mut(i, 2).fill(0.0);
                clear_rows_and_columns(matrix, [i, i + 1]);
            };
        }),
        of.mistake("not moved where the forces are evaluated", |s| s.fixed.ahead = |old, _| old),
    ]
}

fn clear_rows_and_columns(
    matrix: &mut nalgebra::DMatrix<f64>,
    dofs: impl IntoIterator<Item = usize>,
) {
    for dof in dofs {
        matrix.row_mut(dof).fill(0.0);
        matrix.column_mut(dof).fill(0.0);
        matrix[(dof, dof)] = 1.0;
    }
}
