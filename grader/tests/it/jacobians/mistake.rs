//! Mistakes in Jacobians, each with the blocks that it affects.

use grader::white_box::BlockKind;
use nalgebra::DMatrix;
use reference::law::Jacobians;
use scene::schema::{Dependence, ForceSchema};
use simulator::force::REGISTRY;

use super::element::{
    Element, add, damping, damping_by_velocity, drag, elastic, elements, gravitation, green,
    spring, vortex,
};
use super::planted::{Moment, Plant, VC, VD, XC, XD};

/// A mistake.
pub(crate) struct Mistake {
    pub(crate) force: &'static str,
    pub(crate) description: &'static str,
    /// In three dimensions only.
    pub(crate) in_space: bool,
    /// The affected blocks: these are wrong, and no others.
    pub(crate) spoils: &'static [BlockKind],
    pub(crate) plant: Plant,
}

const X: &[BlockKind] = &[XD, XC];
const V: &[BlockKind] = &[VD, VC];
const ALL: &[BlockKind] = &[XD, XC, VD, VC];

pub(crate) fn all() -> Vec<Mistake> {
    let groups =
        [in_springs(), in_assembly(), in_entries(), in_gravitation(), in_vortices(), in_others()];
    let mut all: Vec<Mistake> = groups.into_iter().flatten().collect();
    let schemas = REGISTRY.iter().map(|kind| &kind.schema);
    let others: Vec<Mistake> = schemas
        .filter(|schema| all.iter().all(|mistake| mistake.force != schema.tag))
        .map(|schema| after(schema.tag, "twice as large", blocks_of(schema), double))
        .collect();
    all.extend(others);
    all
}

/// The blocks that are not zero.
fn blocks_of(schema: &ForceSchema) -> &'static [BlockKind] {
    let Dependence { position, velocity, .. } = schema.depends_on();
    match (schema.stencil.is_field(), position, velocity) {
        (_, false, false) => &[],
        (true, true, false) => &[XD],
        (true, false, true) => &[VD],
        (true, true, true) => &[XD, VD],
        (false, true, false) => X,
        (false, false, true) => V,
        (false, true, true) => ALL,
    }
}

fn double(_: &Moment<'_>, jacobians: &mut Jacobians) {
    jacobians.by_position *= 2.0;
    jacobians.by_velocity *= 2.0;
}

fn law(
    force: &'static str,
    description: &'static str,
    spoils: &'static [BlockKind],
    law: fn(&Element) -> super::element::Blocks,
) -> Mistake {
    Mistake { force, description, in_space: false, spoils, plant: Plant::Law(law) }
}

fn after(
    force: &'static str,
    description: &'static str,
    spoils: &'static [BlockKind],
    change: fn(&Moment<'_>, &mut Jacobians),
) -> Mistake {
    Mistake { force, description, in_space: false, spoils, plant: Plant::After(change) }
}

fn strain(e: &Element) -> f64 {
    (e.l() - e.p[1]) / e.l()
}

/// A spring with another elastic part.
fn with_elastic(e: &Element, elastic: DMatrix<f64>) -> super::element::Blocks {
    (elastic + damping(e), damping_by_velocity(e))
}

/// A spring with another damping part of `∂f/∂d`.
fn with_damping(e: &Element, damping: DMatrix<f64>) -> super::element::Blocks {
    (elastic(e) + damping, damping_by_velocity(e))
}

/// A spring with another damping part of `∂f/∂w`.
fn with_by_velocity(e: &Element, by_velocity: DMatrix<f64>) -> super::element::Blocks {
    (elastic(e) + damping(e), by_velocity)
}

fn in_springs() -> Vec<Mistake> {
    let of = "springforce";
    vec![
        law(of, "elastic part: wrong sign", X, |e| with_elastic(e, -elastic(e))),
        law(of, "elastic part missing", X, |e| with_elastic(e, e.zeros())),
        law(of, "elastic part: n nᵀ missing", X, |e| {
            with_elastic(e, e.across() * (-e.p[0] * strain(e)))
        }),
        law(of, "elastic part: (l − l0)/l (I − n nᵀ) missing", X, |e| {
            with_elastic(e, e.along() * -e.p[0])
        }),
        law(of, "elastic part: I instead of I − n nᵀ", X, |e| {
            with_elastic(e, (e.along() + e.identity() * strain(e)) * -e.p[0])
        }),
        law(of, "elastic part: l0 missing", X, |e| with_elastic(e, e.identity() * -e.p[0])),
        law(of, "elastic part: (l − l0)/l², a wrong power of l", X, |e| {
            with_elastic(e, (e.along() + e.across() * (strain(e) / e.l())) * -e.p[0])
        }),
        law(of, "elastic part: (l − l0)/l0 instead of (l − l0)/l", X, |e| {
            let by_rest = if e.p[1] > 0.0 { (e.l() - e.p[1]) / e.p[1] } else { 1.0 };
            with_elastic(e, (e.along() + e.across() * by_rest) * -e.p[0])
        }),
        law(of, "elastic part: what compression adds is left out", X, |e| {
            with_elastic(e, (e.along() + e.across() * strain(e).max(0.0)) * -e.p[0])
        }),
        law(of, "damping part of ∂F/∂x missing", X, |e| with_damping(e, e.zeros())),
        law(of, "damping part of ∂F/∂x: wrong sign", X, |e| with_damping(e, -damping(e))),
        law(of, "damping part of ∂F/∂x transposed", X, |e| {
            with_damping(e, damping(e).transpose())
        }),
        law(of, "damping part of ∂F/∂x: w nᵀ instead of n wᵀ", X, |e| {
            let turning = e.identity() * e.closing() + &e.w * e.n().transpose();
            with_damping(e, turning * e.across() * (-e.p[2] / e.l()))
        }),
        law(of, "damping part of ∂F/∂x: I − n nᵀ missing", X, |e| {
            let turning = e.identity() * e.closing() + e.n() * e.w.transpose();
            with_damping(e, turning * (-e.p[2] / e.l()))
        }),
        law(of, "damping part of ∂F/∂x: n wᵀ missing", X, |e| {
            with_damping(e, e.across() * (-e.p[2] / e.l() * e.closing()))
        }),
        law(of, "damping part of ∂F/∂x: (n·w) I missing", X, |e| {
            with_damping(e, e.n() * e.w.transpose() * e.across() * (-e.p[2] / e.l()))
        }),
        law(of, "damping part of ∂F/∂x not divided by l", X, |e| {
            with_damping(e, damping(e) * e.l())
        }),
        law(of, "damping part of ∂F/∂x: 1/l² instead of 1/l", X, |e| {
            with_damping(e, damping(e) / e.l())
        }),
        law(of, "∂F/∂v: wrong sign", V, |e| with_by_velocity(e, e.along() * e.p[2])),
        law(of, "∂F/∂v missing", V, |e| with_by_velocity(e, e.zeros())),
        law(of, "∂F/∂v not projected on the axis", V, |e| {
            with_by_velocity(e, e.identity() * -e.p[2])
        }),
        law(of, "∂F/∂v: a factor of 2", V, |e| {
            with_by_velocity(e, e.along() * (-2.0 * e.p[2]))
        }),
        law(of, "∂F/∂v: d dᵀ instead of n nᵀ", V, |e| {
            with_by_velocity(e, &e.d * e.d.transpose() * -e.p[2])
        }),
        law(of, "∂F/∂v across the axis", V, |e| with_by_velocity(e, e.across() * -e.p[2])),
        after(of, "∂F/∂x and ∂F/∂v swapped", ALL, |_, j| {
            std::mem::swap(&mut j.by_position, &mut j.by_velocity);
        }),
        after(of, "∂F/∂x made symmetric, which it is not", X, |_, j| {
            j.by_position = (&j.by_position + j.by_position.transpose()) * 0.5;
        }),
        after(of, "only without damping: off by a millionth", X, |moment, j| {
            if moment.scene.forces[0].parameters[2] == 0.0 {
                j.by_position *= 1.0 + 1e-6;
            }
        }),
    ]
}

fn in_assembly() -> Vec<Mistake> {
    let of = "springforce";
    /// Multiplies the block of two particles.
    fn scale(matrix: &mut DMatrix<f64>, dimension: usize, [row, column]: [usize; 2], factor: f64) {
        let start = (row * dimension, column * dimension);
        let mut view = matrix.view_mut(start, (dimension, dimension));
        view *= factor;
    }
    fn cross(moment: &Moment<'_>, matrix: &mut DMatrix<f64>, factor: f64) {
        let n = moment.scene.particles.len();
        for (a, b) in (0..n).flat_map(|a| (0..n).map(move |b| (a, b))).filter(|(a, b)| a != b) {
            scale(matrix, moment.dimension, [a, b], factor);
        }
    }
    vec![
        after(of, "cross blocks of ∂F/∂x not negated", &[XC], |moment, j| {
            cross(moment, &mut j.by_position, -1.0);
        }),
        after(of, "cross blocks of ∂F/∂v missing", &[VC], |moment, j| {
            cross(moment, &mut j.by_velocity, 0.0);
        }),
        after(of, "rows of the second particle missing in ∂F/∂x", X, |moment, j| {
            scale(&mut j.by_position, moment.dimension, [1, 0], 0.0);
            scale(&mut j.by_position, moment.dimension, [1, 1], 0.0);
        }),
        after(of, "only the second particle's own block off by a millionth", &[XD], |moment, j| {
            scale(&mut j.by_position, moment.dimension, [1, 1], 1.0 + 1e-6);
        }),
        after(of, "a block leaks to a particle that no element joins", &[XC], |moment, j| {
            if moment.scene.particles.len() == 3 {
                let dimension = moment.dimension;
                let leak = DMatrix::from_element(dimension, dimension, 1e-6);
                let joined = |a, b| {
                    let is = |pair: [usize; 2]| pair.contains(&a) && pair.contains(&b);
                    moment.scene.forces.iter().any(|force| force.pair().is_some_and(is))
                };
                let free = [[0, 1], [0, 2], [1, 2]].into_iter().find(|[a, b]| !joined(*a, *b));
                if let Some(place) = free {
                    add(&mut j.by_position, place, &leak);
                }
            }
        }),
        after(of, "blocks of a shared particle set instead of added", &[XD, VD], |moment, j| {
            for element in elements(moment.scene, moment.x, moment.v) {
                let (a, b) = spring(&element);
                for particle in element.pair {
                    scale(&mut j.by_position, moment.dimension, [particle; 2], 0.0);
                    scale(&mut j.by_velocity, moment.dimension, [particle; 2], 0.0);
                    add(&mut j.by_position, [particle; 2], &a);
                    add(&mut j.by_velocity, [particle; 2], &b);
                }
            }
        }),
        law(of, "edges listed backwards: damping part of ∂F/∂x with the wrong sign", X, |e| {
            let sign = if e.pair[0] > e.pair[1] { -1.0 } else { 1.0 };
            with_damping(e, damping(e) * sign)
        }),
        law(of, "divided by the mass", ALL, |e| {
            let (a, b) = spring(e);
            (a / e.m[0], b / e.m[0])
        }),
    ]
}

fn in_entries() -> Vec<Mistake> {
    let of = "springforce";
    fn off_diagonal(moment: &Moment<'_>, matrix: &mut DMatrix<f64>, factor: f64) {
        let dimension = moment.dimension;
        let size = matrix.nrows();
        for (row, column) in (0..size).flat_map(|row| (0..size).map(move |column| (row, column))) {
            if row % dimension != column % dimension {
                matrix[(row, column)] *= factor;
            }
        }
    }
    let mut mistakes = vec![
        after(of, "one entry of ∂F/∂x off by a millionth", &[XD], |_, j| {
            j.by_position[(1, 0)] *= 1.0 + 1e-6;
        }),
        after(
            of,
            "one entry of a cross block of ∂F/∂v off by a millionth",
            &[VC],
            |moment, j| {
                j.by_velocity[(0, moment.dimension)] *= 1.0 - 1e-6;
            },
        ),
        after(of, "off-diagonal entries with the wrong sign", ALL, |moment, j| {
            off_diagonal(moment, &mut j.by_position, -1.0);
            off_diagonal(moment, &mut j.by_velocity, -1.0);
        }),
        after(of, "diagonal entries alone", ALL, |moment, j| {
            off_diagonal(moment, &mut j.by_position, 0.0);
            off_diagonal(moment, &mut j.by_velocity, 0.0);
        }),
        after(of, "NaN in one entry", &[XD], |_, j| j.by_position[(1, 1)] = f64::NAN),
        after(of, "infinity in one entry of ∂F/∂v", &[VD], |_, j| {
            j.by_velocity[(0, 0)] = f64::INFINITY;
        }),
        after(of, "in single precision", ALL, |_, j| {
            j.by_position.apply(|entry| *entry = f64::from(*entry as f32));
            j.by_velocity.apply(|entry| *entry = f64::from(*entry as f32));
        }),
        after(of, "by forward differences of step 1e-8", X, |moment, j| {
            use grader::white_box::simulated;
            let subject = simulated(moment.scene);
            let size = moment.x.len();
            let mut forces = [vec![0.0; size], vec![0.0; size]];
            for column in 0..size {
                let mut moved = moment.x.to_vec();
                moved[column] += 1e-8;
                let [here, there] = &mut forces;
                let here_is = subject.force(moment.x, moment.v, 0.0, here);
                let there_is = subject.force(&moved, moment.v, 0.0, there);
                if here_is.is_ok() && there_is.is_ok() {
                    for row in 0..size {
                        j.by_position[(row, column)] = (there[row] - here[row]) / 1e-8;
                    }
                }
            }
        }),
    ];
    mistakes.push(Mistake {
        in_space: true,
        ..after(of, "only the z row, off by a millionth", X, |_, j| {
            let mut row = j.by_position.row_mut(2);
            row *= 1.0 + 1e-6;
        })
    });
    mistakes.push(Mistake {
        in_space: true,
        ..after(of, "z column of ∂F/∂v missing", &[VD], |_, j| {
            j.by_velocity.column_mut(2).rows_mut(0, 3).fill(0.0);
        })
    });
    mistakes
}

fn in_gravitation() -> Vec<Mistake> {
    let of = "gravitationalforce";
    vec![
        law(of, "wrong sign", X, |e| (-gravitation(e).0, e.zeros())),
        law(of, "missing", X, |e| (e.zeros(), e.zeros())),
        law(of, "1/l² instead of 1/l³", X, |e| (gravitation(e).0 * e.l(), e.zeros())),
        law(of, "2 n nᵀ instead of 3 n nᵀ", X, |e| {
            let strength = e.p[0] * e.m[0] * e.m[1] / e.l().powi(3);
            ((e.identity() - e.along() * 2.0) * -strength, e.zeros())
        }),
        law(of, "I missing", X, |e| {
            let strength = e.p[0] * e.m[0] * e.m[1] / e.l().powi(3);
            (e.along() * (3.0 * strength), e.zeros())
        }),
        law(of, "3 d dᵀ instead of 3 n nᵀ", X, |e| {
            let strength = e.p[0] * e.m[0] * e.m[1] / e.l().powi(3);
            ((e.identity() - &e.d * e.d.transpose() * 3.0) * -strength, e.zeros())
        }),
        law(of, "the first mass squared", X, |e| (gravitation(e).0 * (e.m[0] / e.m[1]), e.zeros())),
        law(of, "a ∂F/∂v that is not there", V, |e| (gravitation(e).0, e.identity() * -1e-9)),
    ]
}

fn in_vortices() -> Vec<Mistake> {
    let of = "vortexforce";
    vec![
        law(of, "R transposed", X, |e| {
            let [kbs, kvc, ..] = e.p;
            let turn = e.turn().transpose();
            let rotation = (&turn - &turn * e.along() * 3.0) * kbs;
            let by_position = rotation + &e.w * e.n().transpose() * 2.0;
            (by_position * (kvc / e.l().powi(3)), vortex(e).1)
        }),
        law(of, "3 R n nᵀ missing", X, |e| {
            let [kbs, kvc, ..] = e.p;
            let by_position = e.turn() * kbs + &e.w * e.n().transpose() * 2.0;
            (by_position * (kvc / e.l().powi(3)), vortex(e).1)
        }),
        law(of, "n nᵀ R instead of R n nᵀ", X, |e| {
            let [kbs, kvc, ..] = e.p;
            let rotation = (e.turn() - e.along() * e.turn() * 3.0) * kbs;
            let by_position = rotation + &e.w * e.n().transpose() * 2.0;
            (by_position * (kvc / e.l().powi(3)), vortex(e).1)
        }),
        law(of, "2 w nᵀ missing", X, |e| {
            let [kbs, kvc, ..] = e.p;
            let rotation = (e.turn() - e.turn() * e.along() * 3.0) * kbs;
            (rotation * (kvc / e.l().powi(3)), vortex(e).1)
        }),
        law(of, "2 n wᵀ instead of 2 w nᵀ", X, |e| {
            let [kbs, kvc, ..] = e.p;
            let rotation = (e.turn() - e.turn() * e.along() * 3.0) * kbs;
            let by_position = rotation + e.n() * e.w.transpose() * 2.0;
            (by_position * (kvc / e.l().powi(3)), vortex(e).1)
        }),
        law(of, "1/l² instead of 1/l³", X, |e| (vortex(e).0 * e.l(), vortex(e).1)),
        law(of, "∂F/∂v: 1/l instead of 1/l²", V, |e| (vortex(e).0, vortex(e).1 * e.l())),
        law(of, "∂F/∂v: wrong sign", V, |e| (vortex(e).0, -vortex(e).1)),
        after(of, "made symmetric", X, |_, j| {
            j.by_position = (&j.by_position + j.by_position.transpose()) * 0.5;
        }),
    ]
}

fn in_others() -> Vec<Mistake> {
    vec![
        law("greenspringforce", "wrong sign", X, |e| (-green(e).0, e.zeros())),
        law("greenspringforce", "d dᵀ instead of 2 d dᵀ", X, |e| {
            let [k, l0, ..] = e.p;
            let shape = &e.d * e.d.transpose() + e.identity() * (e.l() * e.l() - l0 * l0);
            (shape * (-2.0 * k / (l0 * l0)), e.zeros())
        }),
        law("greenspringforce", "(l² − l0²) I missing", X, |e| {
            let [k, l0, ..] = e.p;
            (&e.d * e.d.transpose() * (-4.0 * k / (l0 * l0)), e.zeros())
        }),
        law("greenspringforce", "not divided by l0²", X, |e| {
            (green(e).0 * (e.p[1] * e.p[1]), e.zeros())
        }),
        law("greenspringforce", "that of a Hookean spring", X, |e| (elastic(e), e.zeros())),
        law("dragdamping", "wrong sign", &[VD], |e| (e.zeros(), -drag(e).1)),
        law("dragdamping", "times the mass", &[VD], |e| (e.zeros(), drag(e).1 * e.m[0])),
        law("dragdamping", "missing", &[VD], |e| (e.zeros(), e.zeros())),
        law("dragdamping", "by position instead of velocity", &[XD, VD], |e| {
            (drag(e).1, e.zeros())
        }),
        after("dragdamping", "relative to the other particle", &[VC], |moment, j| {
            let b = DMatrix::identity(moment.dimension, moment.dimension)
                * moment.scene.forces[0].parameters[0];
            add(&mut j.by_velocity, [0, 1], &b);
        }),
        law("simplegravity", "a ∂F/∂x that is not there", &[XD], |e| {
            (e.identity() * -1e-9, e.zeros())
        }),
        law("constantforce", "a ∂F/∂v that is not there", &[VD], |e| {
            (e.zeros(), e.identity() * -1e-9)
        }),
        after("windforce", "missing", &[XD], |_, j| j.by_position.fill(0.0)),
        after("windforce", "transposed", &[XD], |_, j| j.by_position.transpose_mut()),
        after("windforce", "by y instead of x", &[XD], |moment, j| {
            for x in (0..j.by_position.ncols()).step_by(moment.dimension) {
                j.by_position.swap_columns(x, x + 1);
            }
        }),
        after("windforce", "twice as large", &[XD], double),
        after("windforce", "that of wind against a moving particle", &[VD], |moment, j| {
            j.by_velocity.fill_diagonal(-moment.scene.forces[0].parameters[0]);
        }),
    ]
}
