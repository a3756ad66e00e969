//! A third implementation of each force's Jacobians, in which mistakes can be planted one at a time.

use nalgebra::{DMatrix, DVector};
use reference::law::Jacobians;
use scene::Scene;

/// An element between two particles, or one particle in a field (`d` is then its position, `w` its velocity).
pub(crate) struct Element {
    /// `x_i − x_j`.
    pub(crate) d: DVector<f64>,
    /// `v_i − v_j`.
    pub(crate) w: DVector<f64>,
    /// Parameters, in the order of the schema.
    pub(crate) p: [f64; 4],
    /// Masses of the two particles.
    pub(crate) m: [f64; 2],
    /// The two particles.
    pub(crate) pair: [usize; 2],
}

/// `∂f/∂d` and `∂f/∂w` of an element.
pub(crate) type Blocks = (DMatrix<f64>, DMatrix<f64>);

impl Element {
    pub(crate) fn l(&self) -> f64 {
        self.d.norm()
    }

    pub(crate) fn n(&self) -> DVector<f64> {
        &self.d / self.l()
    }

    pub(crate) fn identity(&self) -> DMatrix<f64> {
        DMatrix::identity(self.d.len(), self.d.len())
    }

    pub(crate) fn zeros(&self) -> DMatrix<f64> {
        DMatrix::zeros(self.d.len(), self.d.len())
    }

    /// `n nᵀ`.
    pub(crate) fn along(&self) -> DMatrix<f64> {
        self.n() * self.n().transpose()
    }

    /// `I − n nᵀ`.
    pub(crate) fn across(&self) -> DMatrix<f64> {
        self.identity() - self.along()
    }

    /// The speed along the element.
    pub(crate) fn closing(&self) -> f64 {
        self.n().dot(&self.w)
    }

    /// The quarter turn about the z axis.
    pub(crate) fn turn(&self) -> DMatrix<f64> {
        let mut turn = self.identity();
        turn[(0, 0)] = 0.0;
        turn[(1, 1)] = 0.0;
        turn[(0, 1)] = -1.0;
        turn[(1, 0)] = 1.0;
        turn
    }
}

/// The elastic part of a spring's `∂f/∂d`.
pub(crate) fn elastic(e: &Element) -> DMatrix<f64> {
    let [k, l0, ..] = e.p;
    if l0 == 0.0 {
        return e.identity() * -k;
    }
    (e.along() + e.across() * ((e.l() - l0) / e.l())) * -k
}

/// The damping part of a spring's `∂f/∂d`.
pub(crate) fn damping(e: &Element) -> DMatrix<f64> {
    let turning = e.identity() * e.closing() + e.n() * e.w.transpose();
    turning * e.across() * (-e.p[2] / e.l())
}

/// A spring's `∂f/∂w`.
pub(crate) fn damping_by_velocity(e: &Element) -> DMatrix<f64> {
    e.along() * -e.p[2]
}

pub(crate) fn spring(e: &Element) -> Blocks {
    (elastic(e) + damping(e), damping_by_velocity(e))
}

pub(crate) fn gravitation(e: &Element) -> Blocks {
    let strength = e.p[0] * e.m[0] * e.m[1] / e.l().powi(3);
    ((e.identity() - e.along() * 3.0) * -strength, e.zeros())
}

pub(crate) fn vortex(e: &Element) -> Blocks {
    let [kbs, kvc, ..] = e.p;
    let rotation = (e.turn() - e.turn() * e.along() * 3.0) * kbs;
    let drag = &e.w * e.n().transpose() * 2.0;
    ((rotation + drag) * (kvc / e.l().powi(3)), e.identity() * (-kvc / e.l().powi(2)))
}

pub(crate) fn green(e: &Element) -> Blocks {
    let [k, l0, ..] = e.p;
    let shape = &e.d * e.d.transpose() * 2.0 + e.identity() * (e.l() * e.l() - l0 * l0);
    (shape * (-2.0 * k / (l0 * l0)), e.zeros())
}

pub(crate) fn drag(e: &Element) -> Blocks {
    (e.zeros(), e.identity() * -e.p[0])
}

pub(crate) fn nothing(e: &Element) -> Blocks {
    (e.zeros(), e.zeros())
}

/// Every element of `scene` at a state, in the order of the file; a field has one a particle.
pub(crate) fn elements(scene: &Scene, x: &[f64], v: &[f64]) -> Vec<Element> {
    let dimension = scene.dimension.count();
    let of = |values: &[f64], particle: usize| {
        DVector::from_column_slice(&values[particle * dimension..][..dimension])
    };
    let mass = |particle: usize| scene.particles[particle].mass;
    let mut elements = Vec::new();
    for force in &scene.forces {
        let p = std::array::from_fn(|number| force.parameters.get(number).copied().unwrap_or(0.0));
        match force.pair() {
            Some([i, j]) => elements.push(Element {
                d: of(x, i) - of(x, j),
                w: of(v, i) - of(v, j),
                p,
                m: [mass(i), mass(j)],
                pair: [i, j],
            }),
            None => elements.extend((0..scene.particles.len()).map(|i| Element {
                d: of(x, i),
                w: of(v, i),
                p,
                m: [mass(i); 2],
                pair: [i, i],
            })),
        }
    }
    elements
}

/// Sums the blocks of `law` over all elements.
pub(crate) fn assemble(
    scene: &Scene,
    x: &[f64],
    v: &[f64],
    law: impl Fn(&Element) -> Blocks,
) -> Jacobians {
    let mut sum = Jacobians::zeros(x.len());
    for element in elements(scene, x, v) {
        let (a, b) = law(&element);
        let [i, j] = element.pair;
        for (matrix, block) in [(&mut sum.by_position, a), (&mut sum.by_velocity, b)] {
            add(matrix, [i, i], &block);
            if i != j {
                add(matrix, [j, j], &block);
                add(matrix, [i, j], &-&block);
                add(matrix, [j, i], &-&block);
            }
        }
    }
    sum
}

/// Adds `block` at a row and column of particles.
pub(crate) fn add(matrix: &mut DMatrix<f64>, [row, column]: [usize; 2], block: &DMatrix<f64>) {
    let dimension = block.nrows();
    let mut view = matrix.view_mut((row * dimension, column * dimension), (dimension, dimension));
    view += block;
}
