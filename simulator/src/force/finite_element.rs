//! Finite elements with linear shape functions: one element code, and the materials of triangles. Those of tetrahedra are
//! in [`solid`].
//!
//! ```text
//! F = (x_2 − x_1 | x_3 − x_1) B    B = (b_2 − b_1 | b_3 − b_1)⁻¹    U = Ā ψ(F)    P = ∂ψ/∂F
//! f_a = −Ā P w_a                   ∂f_a/∂d_b e = −Ā dP[e w_bᵀ] w_a
//! ```
//!
//! `b` are the undeformed corners, `Ā` their area, `w_a` the row of `B` of corner `a` as a column, and `dP[dF]` the change
//! of the stress along `dF`. In space, `F` is 3×2. Lamé's parameters are those of plane stress, with `E` Young's modulus
//! times the thickness,
//!
//! ```text
//! μ = E/(2 (1 + ν))    λ = E ν/(1 − ν²)
//! ```
//!
//! With `J` the area's ratio, in the plane the determinant of `F`, and `G = ∂J/∂F`, so that `‖G‖ = ‖F‖`,
//!
//! ```text
//! St. Venant–Kirchhoff   ψ = μ ‖ε‖² + λ/2 (tr ε)²                      ε = ½ (FᵀF − I)    P = F (2μ ε + λ tr ε I)
//! corotated              ψ = μ ‖F − R‖² + λ/2 (tr(RᵀF) − 2)²           P = 2μ (F − R) + λ (s − 2) R
//! stable neo-Hookean     ψ = μ/2 (‖F‖² − 2J) + (λ + μ)/2 (J − 1)²      P = μ (F − G) + (λ + μ) (J − 1) G
//! ```
//!
//! `R` is the rotation of the polar decomposition, `R = (F + G)/s` with `s = tr(RᵀF) = √(‖F‖² + 2J)`, and
//! `dR = (dF + dG − (R : dF) R)/s`. By singular values, `ψ` of the last is `μ/2 (σ1 − σ2)² + (λ + μ)/2 (σ1 σ2 − 1)²`: of
//! Smith, de Goes and Kim's energy, without their logarithm. In a solid, it removes a minimum at `F = 0`. Here there is
//! none: `J` is of second order in `F`.
//!
//! In the plane, a triangle turned inside out has `J < 0`, where both last energies are finite and push it back: they have
//! no other equilibrium than the rotations, and `F = 0` of the neo-Hookean one, which is none of its minima. That of St.
//! Venant and Kirchhoff does not tell a rotation from a reflection. The corotated one has a kink at multiples of
//! reflections, `s = 0`. In space, there is no inside; `J ≥ 0` has a kink at flat triangles, where both have no force.
//!
//! Rayleigh's damping `β` adds a viscous stress to each material,
//!
//! ```text
//! S' = β (2μ ε' + λ tr ε' I)    ε' = ½ (F'ᵀF + FᵀF')    P' = F S'    R = β Ā (μ ‖ε'‖² + λ/2 (tr ε')²)
//! ∂P'[dF] = dF S' + F dS'[½ (F'ᵀdF + dFᵀF')]            ∂P'[dF'] = F dS'[½ (dF'ᵀF + FᵀdF')]
//! ```
//!
//! with `F'` the rate of `F`. At rest, where all materials have the same stiffness matrix `K`, the force is `−β K v`. Elsewhere
//! it is not the tangent stiffness that damps: `K(x)` has negative eigenvalues under pressure, which would feed energy, and
//! under stress it does not vanish for a rotation, which would have a torque. The rate of Green's strain has neither fault.
//!
//! Sources: Sifakis and Barbič, FEM simulation of 3D deformable solids (2012), sections 3.3 and 3.4; Smith, de Goes and
//! Kim, Stable neo-Hookean flesh simulation (2018), section 3. Damping by the stiffness at rest and the rate of the strain is
//! that of the beams and shells of Project Chrono.

pub(super) mod solid;

use std::marker::PhantomData;

use nalgebra::{SMatrix, Vector3};

use super::elastic_triangle::{CORNERS, PARAMETERS, SHAPE, undeformed};
use super::stencil::{Local, LocalJacobians, StencilForce, StencilLaw};
use super::{Force, ForceKind, Numbered, Vector};
use scene::schema::{
    Conserves, Dependence, Derivatives, ForceSchema, Initial, Masses, ParameterSchema, PartSchema,
    Potential, Stencil,
};
use scene::{Dimension, ForceElement, Scene};

pub(super) static ST_VENANT_KIRCHHOFF: ForceKind = ForceKind {
    schema: schema(
        TRIANGLE,
        Described {
            tag: "stvktriangle",
            title: "St. Venant–Kirchhoff triangle",
            formula: "`−∂U/∂x`, with `F = (x_i2 − x_i1 \\| x_i3 − x_i1) (b_2 − b_1 \\| b_3 − b_1)⁻¹`, `ε = ½ (FᵀF − I)`, `b` the undeformed corners, `μ = E/(2 (1 + ν))`, `λ = E ν/(1 − ν²)`",
            by_position: "`−∂²U/∂x²`: `F dS + dF S` with the stress `S = 2μ ε + λ tr ε I`",
            energy: "`U = Ā (μ ‖ε‖² + λ/2 (tr ε)²)`, with `Ā` the undeformed area",
            example: r#"<stvktriangle i1="0" i2="1" i3="2" youngsmodulus="100" poissonratio="0.3" xb1x="0" xb1y="0" xb2x="1" xb2y="0" xb3x="0" xb3y="1"/>"#,
        },
    ),
    build_2d: build::<StVenantKirchhoff<2, 2>, 2>,
    build_3d: build::<StVenantKirchhoff<3, 2>, 3>,
};

pub(super) static COROTATED: ForceKind = ForceKind {
    schema: schema(
        TRIANGLE,
        Described {
            tag: "corotatedtriangle",
            title: "corotated triangle",
            formula: "`−∂U/∂x`, with `F`, `μ` and `λ` as of `stvktriangle`, `F = R S` its polar decomposition, and `s = tr S`",
            by_position: "`−∂²U/∂x²`, with the derivative of `R`",
            energy: "`U = Ā (μ ‖F − R‖² + λ/2 (s − 2)²)`",
            example: r#"<corotatedtriangle i1="0" i2="1" i3="2" youngsmodulus="100" poissonratio="0.3" xb1x="0" xb1y="0" xb2x="1" xb2y="0" xb3x="0" xb3y="1"/>"#,
        },
    ),
    build_2d: build::<Corotated<2>, 2>,
    build_3d: build::<Corotated<3>, 3>,
};

pub(super) static NEO_HOOKEAN: ForceKind = ForceKind {
    schema: schema(
        TRIANGLE,
        Described {
            tag: "neohookeantriangle",
            title: "stable neo-Hookean triangle",
            formula: "`−∂U/∂x`, with `F`, `μ` and `λ` as of `stvktriangle`, and `J` the area per undeformed area: `det F` in the plane, `\\|F_1 × F_2\\|` in space",
            by_position: "`−∂²U/∂x²`, with the second derivative of `J`",
            energy: "`U = Ā (μ/2 (‖F‖² − 2J) + (λ + μ)/2 (J − 1)²)`",
            example: r#"<neohookeantriangle i1="0" i2="1" i3="2" youngsmodulus="100" poissonratio="0.3" xb1x="0" xb1y="0" xb2x="1" xb2y="0" xb3x="0" xb3y="1"/>"#,
        },
    ),
    build_2d: build::<NeoHookean<2>, 2>,
    build_3d: build::<NeoHookean<3>, 3>,
};

/// The part of a registry entry that depends on the shape.
struct Shape {
    least_dimension: Dimension,
    corners: &'static [&'static str],
    parameters: &'static [ParameterSchema],
    parts: &'static [PartSchema],
}

const TRIANGLE: Shape = Shape {
    least_dimension: Dimension::Two,
    corners: CORNERS,
    parameters: &damped::<12>(PARAMETERS),
    parts: &[elastic(&"youngsmodulus", SHAPE), damping(&names::<11>(PARAMETERS))],
};

/// The coefficient of Rayleigh's damping.
pub(super) const BETA: ParameterSchema = ParameterSchema::new(
    "beta",
    "damping per stiffness, in seconds",
    (0.05, 0.5),
    [0.25, 0.375, 0.3125],
)
.non_negative()
.default_to(0.0);

/// These parameters, and [`BETA`].
const fn damped<const N: usize>(parameters: &[ParameterSchema]) -> [ParameterSchema; N] {
    assert!(N == parameters.len() + 1);
    let mut all = [BETA; N];
    let mut place = 0;
    while place < parameters.len() {
        all[place] = parameters[place];
        place += 1;
    }
    all
}

/// Their names.
const fn names<const N: usize>(parameters: &[ParameterSchema]) -> [&'static str; N] {
    assert!(N == parameters.len());
    let mut all = [""; N];
    let mut place = 0;
    while place < N {
        all[place] = parameters[place].name;
        place += 1;
    }
    all
}

/// The elastic part of a damped element.
pub(super) const fn elastic(
    scaled_by: &'static &'static str,
    shaped_by: &'static [&'static str],
) -> PartSchema {
    PartSchema {
        name: "elastic",
        title: "elastic force",
        meaning: "elements without damping",
        scaled_by: std::slice::from_ref(scaled_by),
        shaped_by,
        stands_alone: true,
        depends_on: Dependence::POSITION,
        derives_from: Potential::Energy,
    }
}

/// The damping of an element, which is shaped by parameters of its elastic part.
pub(super) const fn damping(shaped_by: &'static [&'static str]) -> PartSchema {
    PartSchema {
        name: "damping",
        title: "damping",
        meaning: "contribution of beta to elements",
        scaled_by: &["beta"],
        shaped_by,
        stands_alone: false,
        depends_on: Dependence::STATE,
        derives_from: Potential::Neither,
    }
}

/// The part of a registry entry that depends on the material.
struct Described {
    tag: &'static str,
    title: &'static str,
    formula: &'static str,
    by_position: &'static str,
    energy: &'static str,
    example: &'static str,
}

const fn schema(shape: Shape, of: Described) -> ForceSchema {
    ForceSchema {
        tag: of.tag,
        title: of.title,
        formula: of.formula,
        derivatives: Derivatives {
            by_position: of.by_position,
            by_velocity: "`−∂²R/∂v²`, 0 without `beta`",
            energy: of.energy,
        },
        least_dimension: shape.least_dimension,
        stencil: Stencil::Named(shape.corners),
        parameters: shape.parameters,
        parts: shape.parts,
        masses: Masses::None,
        initial: Initial::None,
        ignored: &[],
        conserves: Conserves::AngularMomentum,
        example: of.example,
    }
}

fn build<M: Material<D, 2> + 'static, const D: usize>(
    scene: &Scene,
    elements: &[Numbered<'_>],
) -> Box<dyn Force<D>> {
    Box::new(StencilForce::new(scene, elements, Element::<M, 2>::of_triangle::<D>))
}

/// `F`, or a stress, or a change of one.
type Gradient<const D: usize, const N: usize> = SMatrix<f64, D, N>;

/// Lamé's parameters.
#[derive(Clone, Copy)]
struct Lame {
    mu: f64,
    lambda: f64,
}

impl Lame {
    /// `2μ ε + λ tr ε I`, which is linear in `ε`.
    fn stress<const N: usize>(self, strain: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
        strain * (2.0 * self.mu) + SMatrix::identity() * (self.lambda * strain.trace())
    }
}

/// A material at one `F`.
trait Material<const D: usize, const N: usize>: Sized + Send + Sync {
    /// `None` where the force is not defined.
    fn at(lame: Lame, f: Gradient<D, N>) -> Option<Self>;

    /// `ψ`.
    fn energy(&self) -> f64;

    /// `P`.
    fn stress(&self) -> Gradient<D, N>;

    /// `dP[dF]`.
    fn change(&self, df: &Gradient<D, N>) -> Gradient<D, N>;
}

struct Element<M, const N: usize> {
    lame: Lame,
    /// `Ā`.
    volume: f64,
    /// `B`.
    inverse: SMatrix<f64, N, N>,
    /// `β`.
    damping: f64,
    material: PhantomData<fn() -> M>,
}

impl<M> Element<M, 2> {
    fn of_triangle<const D: usize>(element: &ForceElement) -> Self {
        let (inverse, volume) = undeformed::<D>(element);
        let (modulus, nu) = (element.parameter("youngsmodulus"), element.parameter("poissonratio"));
        let lame =
            Lame { mu: modulus / (2.0 * (1.0 + nu)), lambda: modulus * nu / (1.0 - nu * nu) };
        Self { lame, volume, inverse, damping: element.parameter("beta"), material: PhantomData }
    }
}

impl<M, const N: usize> Element<M, N> {
    fn gradient<const D: usize>(&self, of: &[Vector<D>; N]) -> Gradient<D, N> {
        Gradient::from_columns(of) * self.inverse
    }

    fn material<const D: usize>(&self, at: &Local<N, D>) -> Option<M>
    where
        M: Material<D, N>,
    {
        M::at(self.lame, self.gradient(&at.d))
    }

    /// Its viscosity; `None` without damping.
    fn viscosity<const D: usize>(&self, at: &Local<N, D>) -> Option<Viscosity<D, N>> {
        (self.damping > 0.0).then(|| {
            let lame =
                Lame { mu: self.damping * self.lame.mu, lambda: self.damping * self.lame.lambda };
            let [f, rate] = [&at.d, &at.w].map(|of| self.gradient(of));
            Viscosity { lame, f, rate, stress: lame.stress(&symmetric(f.transpose() * rate)) }
        })
    }

    /// The forces of a stress on the corners.
    fn forces_of<const D: usize>(&self, stress: Gradient<D, N>) -> [Vector<D>; N] {
        let forces = stress * self.inverse.transpose() * -self.volume;
        std::array::from_fn(|corner| forces.column(corner).into())
    }
}

impl<M: Material<D, N>, const N: usize, const D: usize> StencilLaw<N, D> for Element<M, N> {
    const ORIGIN: Option<usize> = Some(0);

    fn energy(&self, at: &Local<N, D>) -> Option<f64> {
        Some(self.volume * self.material(at)?.energy())
    }

    fn forces(&self, at: &Local<N, D>) -> Option<[Vector<D>; N]> {
        let mut stress = self.material(at)?.stress();
        if let Some(viscosity) = self.viscosity(at) {
            stress += viscosity.f * viscosity.stress;
        }
        Some(self.forces_of(stress))
    }

    fn jacobians(&self, at: &Local<N, D>) -> Option<LocalJacobians<N, D>> {
        let (material, viscosity) = (self.material(at)?, self.viscosity(at));
        let mut jacobians = LocalJacobians::<N, D>::zeros();
        for b in 0..N {
            for axis in 0..D {
                // Not by `set_row`: reading a matrix right after writing one row of it waits for the memory.
                let entry = |row, place| if row == axis { self.inverse[(b, place)] } else { 0.0 };
                let df = Gradient::<D, N>::from_fn(entry);
                let mut change = material.change(&df);
                if let Some(viscosity) = &viscosity {
                    change += viscosity.change(&df);
                    let forces = self.forces_of(viscosity.change_by_rate(&df));
                    for (a, force) in forces.iter().enumerate() {
                        jacobians.by_velocity[a][b].set_column(axis, force);
                    }
                }
                for (a, force) in self.forces_of(change).iter().enumerate() {
                    jacobians.by_position[a][b].set_column(axis, force);
                }
            }
        }
        Some(jacobians)
    }
}

/// The viscous stress at one `F` and `F'`.
struct Viscosity<const D: usize, const N: usize> {
    /// Lamé's parameters times `β`.
    lame: Lame,
    f: Gradient<D, N>,
    /// `F'`.
    rate: Gradient<D, N>,
    /// `S'`.
    stress: SMatrix<f64, N, N>,
}

impl<const D: usize, const N: usize> Viscosity<D, N> {
    /// `∂P'[dF]`.
    fn change(&self, df: &Gradient<D, N>) -> Gradient<D, N> {
        let strain = symmetric(self.rate.transpose() * df);
        df * self.stress + self.f * self.lame.stress(&strain)
    }

    /// `∂P'[dF']`.
    fn change_by_rate(&self, df: &Gradient<D, N>) -> Gradient<D, N> {
        self.f * self.lame.stress(&symmetric(self.f.transpose() * df))
    }
}

fn symmetric<const N: usize>(matrix: SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    let half = matrix * 0.5;
    half + half.transpose()
}

struct StVenantKirchhoff<const D: usize, const N: usize> {
    lame: Lame,
    f: Gradient<D, N>,
    /// `ε`.
    strain: SMatrix<f64, N, N>,
    /// `S`.
    stress: SMatrix<f64, N, N>,
}

impl<const D: usize, const N: usize> Material<D, N> for StVenantKirchhoff<D, N> {
    fn at(lame: Lame, f: Gradient<D, N>) -> Option<Self> {
        let strain = (f.transpose() * f - SMatrix::identity()) * 0.5;
        Some(Self { lame, f, strain, stress: lame.stress(&strain) })
    }

    fn energy(&self) -> f64 {
        let (Lame { mu, lambda }, trace) = (self.lame, self.strain.trace());
        mu * self.strain.norm_squared() + 0.5 * lambda * trace * trace
    }

    fn stress(&self) -> Gradient<D, N> {
        self.f * self.stress
    }

    fn change(&self, df: &Gradient<D, N>) -> Gradient<D, N> {
        let change = self.lame.stress(&symmetric(self.f.transpose() * df));
        df * self.stress + self.f * change
    }
}

struct Corotated<const D: usize> {
    lame: Lame,
    f: Gradient<D, 2>,
    area: Area<D>,
    /// `R`.
    rotation: Gradient<D, 2>,
    /// `s`.
    trace: f64,
}

impl<const D: usize> Material<D, 2> for Corotated<D> {
    fn at(lame: Lame, f: Gradient<D, 2>) -> Option<Self> {
        let area = Area::of(&f)?;
        let sum = f + area.gradient();
        // `‖F + G‖² = 2 s²`, without the cancellation of `‖F‖² + 2J`.
        let trace = (0.5 * sum.norm_squared()).sqrt();
        (trace > 0.0).then(|| Self { lame, f, area, rotation: sum / trace, trace })
    }

    fn energy(&self) -> f64 {
        let (Lame { mu, lambda }, stretch) = (self.lame, self.trace - 2.0);
        mu * (self.f - self.rotation).norm_squared() + 0.5 * lambda * stretch * stretch
    }

    fn stress(&self) -> Gradient<D, 2> {
        let Lame { mu, lambda } = self.lame;
        (self.f - self.rotation) * (2.0 * mu) + self.rotation * (lambda * (self.trace - 2.0))
    }

    fn change(&self, df: &Gradient<D, 2>) -> Gradient<D, 2> {
        let Lame { mu, lambda } = self.lame;
        let of_trace = self.rotation.dot(df);
        let turn = (df + self.area.change(df) - self.rotation * of_trace) / self.trace;
        (df - turn) * (2.0 * mu)
            + self.rotation * (lambda * of_trace)
            + turn * (lambda * (self.trace - 2.0))
    }
}

struct NeoHookean<const D: usize> {
    mu: f64,
    /// `λ + μ`.
    bulk: f64,
    f: Gradient<D, 2>,
    area: Area<D>,
    /// `G`.
    gradient: Gradient<D, 2>,
}

impl<const D: usize> Material<D, 2> for NeoHookean<D> {
    fn at(Lame { mu, lambda }: Lame, f: Gradient<D, 2>) -> Option<Self> {
        let area = Area::of(&f)?;
        Some(Self { mu, bulk: lambda + mu, f, gradient: area.gradient(), area })
    }

    fn energy(&self) -> f64 {
        let growth = self.area.ratio - 1.0;
        // `‖F − G‖² = 2 (‖F‖² − 2J)`.
        0.25 * self.mu * (self.f - self.gradient).norm_squared() + 0.5 * self.bulk * growth * growth
    }

    fn stress(&self) -> Gradient<D, 2> {
        (self.f - self.gradient) * self.mu + self.gradient * (self.bulk * (self.area.ratio - 1.0))
    }

    fn change(&self, df: &Gradient<D, 2>) -> Gradient<D, 2> {
        let turn = self.area.change(df);
        (df - turn) * self.mu
            + self.gradient * (self.bulk * self.gradient.dot(df))
            + turn * (self.bulk * (self.area.ratio - 1.0))
    }
}

/// The area per undeformed area, `J = n·(F_1 × F_2)` with the unit normal `n`.
struct Area<const D: usize> {
    columns: [Vector3<f64>; 2],
    /// The z axis in the plane; in space, along `F_1 × F_2`.
    normal: Vector3<f64>,
    /// `J`.
    ratio: f64,
}

impl<const D: usize> Area<D> {
    /// `None` of a flat triangle in space.
    fn of(f: &Gradient<D, 2>) -> Option<Self> {
        let columns = in_space(f);
        let product = columns[0].cross(&columns[1]);
        let (normal, ratio) = if D == 2 {
            (Vector3::z(), product.z)
        } else {
            let ratio = product.norm();
            (product / ratio, ratio)
        };
        (D == 2 || ratio > 0.0).then_some(Self { columns, normal, ratio })
    }

    /// `G = (F_2 × n | n × F_1)`.
    fn gradient(&self) -> Gradient<D, 2> {
        let [p, q] = self.columns;
        of_space([q.cross(&self.normal), self.normal.cross(&p)])
    }

    /// `dG[dF]`.
    fn change(&self, df: &Gradient<D, 2>) -> Gradient<D, 2> {
        let ([p, q], [dp, dq], n) = (self.columns, in_space(df), self.normal);
        let (mut of_p, mut of_q) = (dq.cross(&n), n.cross(&dp));
        if D > 2 {
            let product = dp.cross(&q) + p.cross(&dq);
            let turn = (product - n * n.dot(&product)) / self.ratio;
            of_p += q.cross(&turn);
            of_q += turn.cross(&p);
        }
        of_space([of_p, of_q])
    }
}

fn in_space<const D: usize>(f: &Gradient<D, 2>) -> [Vector3<f64>; 2] {
    [0, 1].map(|column| Vector3::from_fn(|axis, _| if axis < D { f[(axis, column)] } else { 0.0 }))
}

fn of_space<const D: usize>(columns: [Vector3<f64>; 2]) -> Gradient<D, 2> {
    Gradient::from_fn(|axis, column| columns[column][axis])
}
