//! Mistakes with elastic bodies in space: in the geometry that force and Hessian share, in the force, and in the Hessian.

use diagnosis::findings::Part;
use nalgebra::{DMatrix, Matrix3};

use super::super::student::{
    Fold, Gradient, Lame, Simplex, Square, Student, Vec3, area, cofactors, corotated_stress,
    damping_change, damping_stress, polar, rotation_along, second_stress, strain, strain_along,
};
use super::{Area, Mistake, Scope, Subject};

/// A change of the formulas of an element.
type Change<T> = (&'static str, fn(&mut T));

/// The formulas of a kind of element, for the force and for its Jacobian.
type Of<T> = fn(&mut Student) -> &mut [T; 2];

/// The names of a force: its tag, its subject, and that of its Jacobian.
type Names = [&'static str; 3];

/// Changes of both copies of the formulas, of the force's, and of the Jacobian's.
fn planted<T: 'static>(
    [tag, force, jacobian]: Names,
    of: Of<T>,
    [in_both, in_force, in_jacobian]: [&[Change<T>]; 3],
) -> Vec<Mistake> {
    let part = Part::All(tag);
    let force = Subject { area: Area::Force, name: force, scope: Scope::Force(part) };
    let jacobian = Subject { area: Area::Jacobian, name: jacobian, scope: Scope::Jacobian(part) };
    let both = in_both.iter().map(|(description, change)| {
        let change = *change;
        force.mistake(description, move |s| of(s).iter_mut().for_each(change))
    });
    let one = |subject: &Subject, which: usize, (description, change): &Change<T>| {
        let change = *change;
        subject.mistake(description, move |s| change(&mut of(s)[which]))
    };
    let alone = in_force.iter().map(|change| one(&force, 0, change));
    let hessian = in_jacobian.iter().map(|change| one(&jacobian, 1, change));
    both.chain(alone).chain(hessian).collect()
}

pub(super) fn mistakes() -> Vec<Mistake> {
    let of_solids = [
        planted(
            [
                "stvktetrahedron",
                "St. Venant–Kirchhoff tetrahedron",
                "St. Venant–Kirchhoff tetrahedron, ∂F/∂x",
            ],
            |s| &mut s.solids.tetrahedra[0],
            [
                &[IN_TETRAHEDRA, &in_bodies(), &in_dampings()].concat(),
                &[&in_stresses_of_venant()[..], &in_forces_of_bodies(), &in_damping_forces()]
                    .concat(),
                &[&in_changes_of_venant()[..], &in_hessians_of_bodies(), &in_damping_jacobians()]
                    .concat(),
            ],
        ),
        planted(
            ["corotatedtetrahedron", "corotated tetrahedron", "corotated tetrahedron, ∂F/∂x"],
            |s| &mut s.solids.tetrahedra[1],
            [
                &[IN_TETRAHEDRA, &in_dampings()].concat(),
                IN_STRESSES_OF_COROTATED,
                IN_CHANGES_OF_COROTATED,
            ],
        ),
        planted(
            [
                "neohookeantetrahedron",
                "stable neo-Hookean tetrahedron",
                "stable neo-Hookean tetrahedron, ∂F/∂x",
            ],
            |s| &mut s.solids.tetrahedra[2],
            [&in_bodies::<3>(), IN_STRESSES_OF_NEO_HOOKE, IN_CHANGES_OF_NEO_HOOKE],
        ),
    ];
    let of_sheets = [
        planted(
            [
                "stvktriangle",
                "St. Venant–Kirchhoff triangle in space",
                "St. Venant–Kirchhoff triangle in space, ∂F/∂x",
            ],
            |s| &mut s.solids.triangles[0],
            [
                &[IN_TRIANGLES, &in_dampings()].concat(),
                &[&in_stresses_of_venant()[..], &in_forces_of_bodies(), &in_damping_forces()]
                    .concat(),
                &[&in_changes_of_venant()[..], &in_hessians_of_bodies(), &in_damping_jacobians()]
                    .concat(),
            ],
        ),
        planted(
            [
                "neohookeantriangle",
                "stable neo-Hookean triangle in space",
                "stable neo-Hookean triangle in space, ∂F/∂x",
            ],
            |s| &mut s.solids.triangles[2],
            [&in_dampings::<2>(), IN_STRESSES_OF_SHEETS, IN_CHANGES_OF_SHEETS],
        ),
    ];
    let of_folds = planted(
        ["hingebendingforce", "hinge of triangles", "hinge of triangles, ∂F/∂x"],
        |s| &mut s.solids.fold,
        [IN_HINGES, IN_FORCES_OF_HINGES, IN_HESSIANS_OF_HINGES],
    );
    of_solids.into_iter().chain(of_sheets).flatten().chain(of_folds).collect()
}

const IN_TETRAHEDRA: &[Change<Simplex<3>>] = &[
    ("volume without 1/6", |t| t.size = |undeformed, _| undeformed.abs()),
    ("volume by 1/3, not 1/6", |t| t.size = |undeformed, _| undeformed.abs() / 3.0),
    ("volume of the moment", |t| t.size = |_, deformed| deformed / 6.0),
    ("volume left out", |t| t.size = |_, _| 1.0),
    ("λ of plane stress", |t| {
        t.lame = |e, nu| [e / (2.0 * (1.0 + nu)), e * nu / (1.0 - nu * nu)];
    }),
    ("λ without 1 + ν", |t| {
        t.lame = |e, nu| [e / (2.0 * (1.0 + nu)), e * nu / (1.0 - 2.0 * nu)];
    }),
    ("μ without 2", |t| {
        t.lame = |e, nu| [e / (1.0 + nu), e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))];
    }),
    ("μ and λ exchanged", |t| {
        t.lame = |e, nu| [e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu))];
    }),
];

fn in_bodies<const K: usize>() -> [Change<Simplex<K>>; 5] {
    [
        ("undeformed edges transposed", |t| {
            t.gradient = |edges, b| edges * b.transpose();
            t.pull = |p, b| p * b;
        }),
        ("undeformed corners are the initial positions", |t| {
            t.corners = |_, start| start.to_vec();
        }),
        ("second and third corner exchanged", |t| t.order = |x| x.swap(1, 2)),
        ("corners in another order than the undeformed ones", |t| {
            t.order = |x| x.reverse();
        }),
        ("ν left out", |t| t.lame = |e, _| [e / 2.0, 0.0]),
    ]
}

const IN_TRIANGLES: &[Change<Simplex<2>>] = &[
    ("area without 1/2", |t| t.size = |undeformed, _| undeformed.abs()),
    ("area of the moment", |t| t.size = |_, deformed| deformed / 2.0),
    ("area left out", |t| t.size = |_, _| 1.0),
    ("λ of a solid", |t| {
        t.lame = |e, nu| [e / (2.0 * (1.0 + nu)), e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))];
    }),
    ("undeformed corners are the initial positions", |t| t.corners = |_, start| start.to_vec()),
    ("second and third corner exchanged", |t| t.order = |x| x.swap(1, 2)),
];

fn in_stresses_of_venant<const K: usize>() -> [Change<Simplex<K>>; 6] {
    [
        ("strain without 1/2", |t| {
            t.stress = |f, lame| f * second_stress(2.0 * strain(f), lame);
        }),
        ("strains off the diagonal by half", |t| {
            t.stress = |f, lame| {
                let e = strain(f);
                f * second_stress(0.5 * (e + Square::from_diagonal(&e.diagonal())), lame)
            };
        }),
        ("strains off the diagonal left out", |t| {
            t.stress =
                |f, lame| f * second_stress(Square::from_diagonal(&strain(f).diagonal()), lame);
        }),
        ("λ tr ε I left out", |t| {
            t.stress = |f, [mu, _]: Lame| f * second_stress(strain(f), [mu, 0.0]);
        }),
        ("μ ε instead of 2 μ ε", |t| {
            t.stress = |f, [mu, lambda]: Lame| f * second_stress(strain(f), [0.5 * mu, lambda]);
        }),
        ("the stress without F before it", |t| {
            t.stress = |f, lame| {
                let s = second_stress(strain(f), lame);
                Gradient::from_fn(|a, b| if a < K { s[(a, b)] } else { 0.0 })
            };
        }),
    ]
}

fn in_forces_of_bodies<const K: usize>() -> [Change<Simplex<K>>; 5] {
    [
        ("missing", |t| t.share = |pulls| pulls.fill(Vec3::zeros())),
        ("gradient instead of force", |t| {
            t.share = |pulls| pulls.iter_mut().for_each(|pull| *pull = -*pull);
        }),
        ("force on the first corner missing", |t| t.share = |pulls| pulls[0] = Vec3::zeros()),
        ("forces on the second and third corner exchanged", |t| {
            t.share = |pulls| pulls.swap(1, 2);
        }),
        ("B in the place of Bᵀ", |t| t.pull = |p, b| p * b),
    ]
}

fn in_changes_of_venant<const K: usize>() -> [Change<Simplex<K>>; 4] {
    [
        ("geometric part dF S missing", |t| {
            t.change = |f, df, lame| f * second_stress(strain_along(f, df), lame);
        }),
        ("material part F dS missing", |t| {
            t.change = |f, df, lame| df * second_stress(strain(f), lame);
        }),
        ("dFᵀ F of the strain's change missing", |t| {
            t.change = |f, df, lame| {
                let half = 0.5 * f.transpose() * df;
                df * second_stress(strain(f), lame) + f * second_stress(half, lame)
            };
        }),
        ("geometric part with the wrong sign", |t| {
            t.change = |f, df, lame| {
                f * second_stress(strain_along(f, df), lame) - df * second_stress(strain(f), lame)
            };
        }),
    ]
}

fn in_hessians_of_bodies<const K: usize>() -> [Change<Simplex<K>>; 6] {
    [
        ("missing", |t| t.place = |matrix| matrix.fill(0.0)),
        ("wrong sign", |t| t.place = |matrix| matrix.neg_mut()),
        ("half as large", |t| t.place = |matrix| *matrix *= 0.5),
        ("blocks of different corners missing", |t| t.place = diagonal),
        ("rows of the first corner missing", |t| {
            t.place = |matrix| matrix.fixed_rows_mut::<3>(0).fill(0.0);
        }),
        ("half of it: the blocks below the diagonal missing", |t| t.place = upper),
    ]
}

fn in_dampings<const K: usize>() -> [Change<Simplex<K>>; 4] {
    [
        ("damping left out", |t| {
            t.damping = |_, _, _| Gradient::zeros();
            t.damping_change = |_, _, _, _| Gradient::zeros();
        }),
        ("damping twice as large", |t| {
            t.damping = |f, rate, lame| 2.0 * damping_stress(f, rate, lame);
            t.damping_change = |f, rate, df, lame| 2.0 * damping_change(f, rate, df, lame);
        }),
        ("damping with the wrong sign", |t| {
            t.damping = |f, rate, lame| -damping_stress(f, rate, lame);
            t.damping_change = |f, rate, df, lame| -damping_change(f, rate, df, lame);
        }),
        ("damping without λ", |t| {
            t.damping = |f, rate, [mu, _]: Lame| damping_stress(f, rate, [mu, 0.0]);
            t.damping_change = |f, rate, df, [mu, _]: Lame| damping_change(f, rate, df, [mu, 0.0]);
        }),
    ]
}

fn in_damping_forces<const K: usize>() -> [Change<Simplex<K>>; 3] {
    [
        ("damping missing", |t| t.damping = |_, _, _| Gradient::zeros()),
        ("damping by FᵀF', which is not symmetric", |t| {
            t.damping = |f, rate, lame| f * second_stress(f.transpose() * rate, lame);
        }),
        ("damping by the rate of F", |t| {
            t.damping = |_, rate, [mu, _]: Lame| 2.0 * mu * rate;
        }),
    ]
}

fn in_damping_jacobians<const K: usize>() -> [Change<Simplex<K>>; 2] {
    [
        ("∂F/∂v missing", |t| t.damping = |_, _, _| Gradient::zeros()),
        ("damping missing", |t| t.damping_change = |_, _, _, _| Gradient::zeros()),
    ]
}

const IN_STRESSES_OF_COROTATED: &[Change<Simplex<3>>] = &[
    ("rotation left out", |t| {
        t.stress = |f, [mu, lambda]: Lame| {
            let (r, _, sigma) = polar(f);
            2.0 * mu * (f - Matrix3::identity()) + lambda * (sigma.sum() - 3.0) * r
        };
    }),
    ("λ (tr S − 2) R", |t| {
        t.stress = |f, [mu, lambda]: Lame| corotated_stress(f, [mu, lambda]) + lambda * polar(f).0;
    }),
    ("λ (tr S − 3) R left out", |t| {
        t.stress = |f, [mu, _]: Lame| corotated_stress(f, [mu, 0.0]);
    }),
    ("μ (F − R) instead of 2 μ (F − R)", |t| {
        t.stress = |f, [mu, lambda]: Lame| corotated_stress(f, [0.5 * mu, lambda]);
    }),
    ("R transposed", |t| {
        t.stress = |f, [mu, lambda]: Lame| {
            let (r, _, sigma) = polar(f);
            2.0 * mu * (f - r.transpose()) + lambda * (sigma.sum() - 3.0) * r
        };
    }),
];

const IN_CHANGES_OF_COROTATED: &[Change<Simplex<3>>] = &[
    ("dR missing", |t| {
        t.change = |f, df, [mu, lambda]: Lame| {
            let (r, _, _) = polar(f);
            2.0 * mu * df + lambda * r.dot(df) * r
        };
    }),
    ("dR missing from the part with λ", |t| {
        t.change = |f, df, [mu, lambda]: Lame| {
            let (r, _, _) = polar(f);
            2.0 * mu * (df - rotation_along(f, df)) + lambda * r.dot(df) * r
        };
    }),
    ("part with λ missing", |t| {
        t.change = |f, df, [mu, _]: Lame| 2.0 * mu * (df - rotation_along(f, df));
    }),
    ("missing", |t| t.place = |matrix| matrix.fill(0.0)),
];

const IN_STRESSES_OF_NEO_HOOKE: &[Change<Simplex<3>>] = &[
    ("logarithm left out", |t| {
        t.stress = |f, [mu, lambda]: Lame| {
            let growth = f.determinant() - 1.0;
            4.0 / 3.0 * mu * f + ((lambda + 5.0 / 6.0 * mu) * growth - mu) * cofactors(f)
        };
    }),
    ("λ instead of λ + 5/6 μ", |t| {
        t.stress = |f, [mu, lambda]: Lame| {
            let (i, growth) = (f.norm_squared(), f.determinant() - 1.0);
            4.0 / 3.0 * mu * i / (i + 1.0) * f + (lambda * growth - mu) * cofactors(f)
        };
    }),
    ("μ instead of 4/3 μ", |t| {
        t.stress = |f, [mu, lambda]: Lame| {
            let (i, growth) = (f.norm_squared(), f.determinant() - 1.0);
            mu * i / (i + 1.0) * f + ((lambda + 5.0 / 6.0 * mu) * growth - mu) * cofactors(f)
        };
    }),
    ("cofactors transposed", |t| {
        t.stress = |f, [mu, lambda]: Lame| {
            let (i, growth) = (f.norm_squared(), f.determinant() - 1.0);
            4.0 / 3.0 * mu * i / (i + 1.0) * f
                + ((lambda + 5.0 / 6.0 * mu) * growth - mu) * cofactors(f).transpose()
        };
    }),
];

const IN_CHANGES_OF_NEO_HOOKE: &[Change<Simplex<3>>] = &[
    ("change of the cofactors missing", |t| {
        t.change = |f, df, [mu, lambda]: Lame| {
            let (i, g) = (f.norm_squared(), cofactors(f));
            let shear = i / (i + 1.0) * df + 2.0 * f.dot(df) / (i + 1.0).powi(2) * f;
            4.0 / 3.0 * mu * shear + (lambda + 5.0 / 6.0 * mu) * g.dot(df) * g
        };
    }),
    ("missing", |t| t.place = |matrix| matrix.fill(0.0)),
    ("blocks of different corners missing", |t| t.place = diagonal),
];

const IN_STRESSES_OF_SHEETS: &[Change<Simplex<2>>] = &[
    ("λ instead of λ + μ", |t| {
        t.stress = |f, [mu, lambda]: Lame| {
            let (j, g, _) = area(f);
            mu * (f - g) + lambda * (j - 1.0) * g
        };
    }),
    ("μ F instead of μ (F − G)", |t| {
        t.stress = |f, [mu, lambda]: Lame| {
            let (j, g, _) = area(f);
            mu * f + (lambda + mu) * (j - 1.0) * g
        };
    }),
];

const IN_CHANGES_OF_SHEETS: &[Change<Simplex<2>>] = &[
    ("change of the normal missing", |t| {
        t.change = |f, df, [mu, lambda]: Lame| {
            let (j, g, n) = area(f);
            let (dp, dq): (Vec3, Vec3) = (df.column(0).into(), df.column(1).into());
            let dg = Gradient::<2>::from_columns(&[dq.cross(&n), n.cross(&dp)]);
            mu * (df - dg) + (lambda + mu) * (g.dot(df) * g + (j - 1.0) * dg)
        };
    }),
    ("change of G missing", |t| {
        t.change = |f, df, [mu, lambda]: Lame| {
            let (_, g, _) = area(f);
            mu * df + (lambda + mu) * g.dot(df) * g
        };
    }),
];

fn double_areas(x: &[Vec3; 4]) -> [f64; 2] {
    let e = x[1] - x[0];
    [2, 3].map(|corner| e.cross(&(x[corner] - x[0])).norm())
}

const IN_HINGES: &[Change<Fold>] = &[
    ("θ by acos", |h| {
        h.angle = |e, a, b| {
            let (of_a, of_b) = (e.cross(&a), b.cross(&e));
            (of_a.dot(&of_b) / (of_a.norm() * of_b.norm())).clamp(-1.0, 1.0).acos()
        };
    }),
    ("θ with the wrong sign", |h| {
        h.angle = |e, a, b| {
            let (of_a, of_b) = (e.cross(&a), b.cross(&e));
            (e.norm() * of_a.dot(&b)).atan2(of_a.dot(&of_b))
        };
    }),
    ("sine in the place of θ", |h| {
        h.angle = |e, a, b| {
            let (of_a, of_b) = (e.cross(&a), b.cross(&e));
            -e.norm() * of_a.dot(&b) / (of_a.norm() * of_b.norm())
        };
    }),
    ("angle at rest added instead of subtracted", |h| h.change = |theta, theta0| theta + theta0),
    ("angle at rest left out", |h| h.change = |theta, _| theta),
    ("factor 3 missing", |h| {
        h.stiffness = |start, _, k| {
            let [of_a, of_b] = double_areas(start);
            4.0 * k * (start[1] - start[0]).norm_squared() / (of_a + of_b)
        };
    }),
    ("not divided by the areas", |h| {
        h.stiffness = |start, _, k| 6.0 * k * (start[1] - start[0]).norm_squared();
    }),
    ("areas of the moment", |h| {
        h.stiffness = |start, now, k| {
            let [of_a, of_b] = double_areas(now);
            12.0 * k * (start[1] - start[0]).norm_squared() / (of_a + of_b)
        };
    }),
    ("edge of the moment", |h| {
        h.stiffness = |start, now, k| {
            let [of_a, of_b] = double_areas(start);
            12.0 * k * (now[1] - now[0]).norm_squared() / (of_a + of_b)
        };
    }),
    ("|ē| instead of |ē|²", |h| {
        h.stiffness = |start, _, k| {
            let [of_a, of_b] = double_areas(start);
            12.0 * k * (start[1] - start[0]).norm() / (of_a + of_b)
        };
    }),
    ("no weight of edge and areas", |h| h.stiffness = |_, _, k| k),
    ("damping left out", |h| h.damping = [0.0; 3]),
    ("damping twice as large", |h| h.damping = [2.0; 3]),
    ("damping with the wrong sign", |h| h.damping = [-1.0; 3]),
];

const IN_FORCES_OF_HINGES: &[Change<Fold>] = &[
    ("damping missing", |h| h.damping[0] = 0.0),
    ("missing", |h| h.share = |_| [Vec3::zeros(); 4]),
    ("gradient instead of force", |h| h.share = |[e, a, b]| [e + a + b, -e, -a, -b]),
    ("difference of the angles wrapped to a turn", |h| {
        h.change = |theta, theta0| (theta - theta0).sin().atan2((theta - theta0).cos());
    }),
    ("forces on the ends of the edge missing", |h| {
        h.share = |[_, a, b]| [Vec3::zeros(), Vec3::zeros(), a, b];
    }),
    ("force on the first end of the edge missing", |h| {
        h.share = |[e, a, b]| [Vec3::zeros(), e, a, b];
    }),
    ("forces on the third and fourth particle exchanged", |h| {
        h.share = |[e, a, b]| [-e - a - b, e, b, a];
    }),
    ("forces on the ends of the edge exchanged", |h| {
        h.share = |[e, a, b]| [e, -e - a - b, a, b];
    }),
    ("n/|n| in the place of |e| n/|n|²", |h| {
        h.slope = |e, a| e.cross(&a).normalize();
    }),
];

const IN_HESSIANS_OF_HINGES: &[Change<Fold>] = &[
    ("damping missing", |h| h.damping[1] = 0.0),
    ("∂F/∂v missing", |h| h.damping[2] = 0.0),
    ("missing", |h| h.weights = [0.0; 2]),
    ("wrong sign", |h| h.weights = [-1.0; 2]),
    ("second derivative of the angle missing (Gauss–Newton)", |h| h.weights = [1.0, 0.0]),
    ("outer product of the gradients missing", |h| h.weights = [0.0, 1.0]),
    ("second derivative of the angle with the wrong sign", |h| h.weights = [1.0, -1.0]),
    ("blocks of different particles missing", |h| h.place = diagonal),
    ("half of it: the blocks below the diagonal missing", |h| h.place = upper),
];

fn diagonal(matrix: &mut DMatrix<f64>) {
    keep(matrix, |row, column| row == column);
}

fn upper(matrix: &mut DMatrix<f64>) {
    keep(matrix, |row, column| row <= column);
}

fn keep(matrix: &mut DMatrix<f64>, is_kept: fn(usize, usize) -> bool) {
    *matrix = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |row, column| {
        if is_kept(row / 3, column / 3) { matrix[(row, column)] } else { 0.0 }
    });
}
