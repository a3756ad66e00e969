//! Planted mistakes, each with the findings expected to be wrong.

use super::programs::Build;

/// The builds of the fixtures with mistakes.
pub(crate) const CPP: Build = Build::Cpp(&["-O2"]);
pub(crate) const C: Build = Build::C(&["-O2"]);
pub(crate) const PYTHON: Build = Build::Python;

/// A mistake of a fixture.
pub(crate) struct Mistake {
    pub(crate) build: Build,
    /// The probed force.
    pub(crate) force: &'static str,
    /// Its name in the fixture.
    pub(crate) name: &'static str,
    /// All findings expected to be wrong, in 2D or 3D: `part: finding, finding; part: …`. Empty if the mistake
    /// changes no step.
    pub(crate) wrong: &'static str,
}

const fn of(build: Build, force: &'static str, name: &'static str, wrong: &'static str) -> Mistake {
    Mistake { build, force, name, wrong }
}

#[rustfmt::skip]
pub(crate) static MISTAKES: &[Mistake] = &[
    of(CPP, "springforce", "spring: force and Jacobian without l0", "elastic: force"),
    of(CPP, "springforce", "spring: force without l0", "elastic: force"),
    of(CPP, "springforce", "spring: Jacobian without l0", "elastic: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "spring: half the stiffness in force and Jacobian", "elastic: force"),
    of(CPP, "springforce", "spring: l0/l² in the Jacobian", "elastic: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "spring: Jacobian's sign", "elastic: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "spring: only n nᵀ in the Jacobian", "elastic: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "spring: Jacobian off by 1e-6", "elastic: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "damping: force and Jacobian not projected", "damping: force"),
    of(CPP, "springforce", "damping: dF/dx without (n·w) I", "damping: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "damping: dF/dx without n wᵀ", "damping: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "damping: dF/dx without the projection", "damping: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "damping: dF/dx missing", "damping: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "damping: dF/dx has the wrong sign", "damping: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "damping: dF/dx transposed", "damping: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "damping: dF/dx made symmetric", "damping: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "damping: dF/dx over l²", "damping: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "damping: dF/dv not projected", "damping: dF/dv direct, dF/dv cross"),
    of(CPP, "springforce", "damping: dF/dv missing", "damping: dF/dv direct, dF/dv cross"),
    of(CPP, "springforce", "damping: dF/dv has the wrong sign", "damping: dF/dv direct, dF/dv cross"),
    of(CPP, "gravitationalforce", "gravitation: 1/l in force and Jacobian", "all: force"),
    of(CPP, "gravitationalforce", "gravitation: l² for l³ in the Jacobian", "all: dF/dx direct, dF/dx cross"),
    of(CPP, "gravitationalforce", "gravitation: n nᵀ without its 3", "all: dF/dx direct, dF/dx cross"),
    of(CPP, "gravitationalforce", "gravitation: Jacobian's sign", "all: dF/dx direct, dF/dx cross"),
    of(CPP, "gravitationalforce", "gravitation: Jacobian missing", "all: dF/dx direct, dF/dx cross"),
    of(CPP, "gravitationalforce", "gravitation: Jacobian transposed", ""),
    of(CPP, "gravitationalforce", "gravitation: one entry off by 1e-6", "all: dF/dx direct, dF/dx cross"),
    of(CPP, "vortexforce", "vortex: rotates the other way", "rotation: force"),
    of(CPP, "vortexforce", "vortex: 3 R n nᵀ missing", "rotation: dF/dx direct, dF/dx cross"),
    of(CPP, "vortexforce", "vortex: no quarter turn", "rotation: dF/dx direct, dF/dx cross"),
    of(CPP, "vortexforce", "vortex: w nᵀ transposed", "drag: dF/dx direct, dF/dx cross"),
    of(CPP, "vortexforce", "vortex: w nᵀ without its 2", "drag: dF/dx direct, dF/dx cross"),
    of(CPP, "vortexforce", "vortex: dF/dx without its drag part", "drag: dF/dx direct, dF/dx cross"),
    of(CPP, "vortexforce", "vortex: dF/dx over l²", "drag: dF/dx direct, dF/dx cross; rotation: dF/dx direct, dF/dx cross"),
    of(CPP, "vortexforce", "vortex: dF/dv over l", "drag: dF/dv direct, dF/dv cross"),
    of(CPP, "vortexforce", "vortex: dF/dv missing", "drag: dF/dv direct, dF/dv cross"),
    of(CPP, "springforce", "spring: cross blocks have the wrong sign", "elastic: dF/dx cross; damping: dF/dx cross"),
    of(CPP, "springforce", "spring: cross blocks missing", "elastic: dF/dx cross; damping: dF/dx cross"),
    of(CPP, "springforce", "spring: one entry off by 1e-6", "elastic: dF/dx direct; damping: dF/dx direct"),
    of(CPP, "gravitationalforce", "gravitation: cross blocks have the wrong sign", "all: dF/dx cross"),
    of(CPP, "vortexforce", "vortex: cross blocks transposed", "drag: dF/dx cross; rotation: dF/dx cross"),
    of(CPP, "springforce", "damping: dF/dv without its cross blocks", "damping: dF/dv cross"),
    of(CPP, "dragdamping", "drag: scaled by mass in force and Jacobian", "all: force"),
    of(CPP, "simplegravity", "gravity: not scaled by mass", "all: force"),
    of(CPP, "constantforce", "constant force: scaled by mass", "all: force"),
    of(CPP, "dragdamping", "drag: dF/dv scaled by mass", "all: dF/dv direct"),
    of(CPP, "dragdamping", "drag: dF/dv missing", "all: dF/dv direct"),
    of(CPP, "dragdamping", "drag: dF/dv has the wrong sign", "all: dF/dv direct"),
    of(CPP, "dragdamping", "drag: dF/dv off by 1e-6", "all: dF/dv direct"),
    of(CPP, "simplegravity", "gravity: has a Jacobian", "all: dF/dx direct"),
    of(CPP, "springforce", "step: everything at q", "elastic: step; damping: step"),
    of(CPP, "springforce", "step: Jacobians at q", "elastic: step; damping: step"),
    of(CPP, "springforce", "step: right-hand side at q", "elastic: step; damping: step"),
    of(CPP, "springforce", "step: K and B swapped", "elastic: dF/dx direct, dF/dx cross, dF/dv direct, dF/dv cross; damping: dF/dx direct, dF/dx cross, dF/dv direct, dF/dv cross"),
    of(CPP, "springforce", "step: h K for h² K", "elastic: dF/dx direct, dF/dx cross, dF/dv direct, dF/dv cross; damping: dF/dx direct, dF/dx cross, dF/dv direct, dF/dv cross"),
    of(CPP, "springforce", "step: h² B for h B", "damping: dF/dx direct, dF/dx cross, dF/dv direct, dF/dv cross"),
    of(CPP, "springforce", "step: no h before K and B", "elastic: step; damping: step"),
    of(CPP, "springforce", "step: K's sign", "elastic: dF/dx direct, dF/dx cross; damping: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "step: B's sign", "damping: dF/dv direct, dF/dv cross"),
    of(CPP, "springforce", "step: B left out", "damping: dF/dv direct, dF/dv cross"),
    of(CPP, "springforce", "step: no h on the right-hand side", "elastic: step; damping: step"),
    of(CPP, "springforce", "step: h² on the right-hand side", "elastic: step; damping: step"),
    of(CPP, "springforce", "step: matrix transposed", "damping: dF/dx direct, dF/dx cross"),
    of(CPP, "springforce", "step: no mass matrix", "elastic: step; damping: step"),
    of(CPP, "springforce", "step: mass matrix off by 1e-3", "elastic: step"),
    of(C, "springforce", "block (j, i) transposed", "damping: dF/dx cross"),
    of(C, "springforce", "l0/r² in dF/dx", "elastic: dF/dx direct, dF/dx cross"),
    of(C, "springforce", "dF/dx of 1/r² missing", "damping: dF/dx direct, dF/dx cross"),
    of(C, "springforce", "dF/dx of d·w missing", "damping: dF/dx direct, dF/dx cross"),
    of(C, "springforce", "one cross entry off by 1e-6", "elastic: dF/dx cross; damping: dF/dx cross"),
    of(C, "springforce", "dF/dv along the velocity", "damping: dF/dv direct, dF/dv cross"),
    of(C, "gravitationalforce", "2 for 3 in gravitation", "all: dF/dx direct, dF/dx cross"),
    of(C, "gravitationalforce", "gravitation's force doubled, its Jacobian not", "all: force"),
    of(C, "dragdamping", "drag without its Jacobian", "all: dF/dv direct"),
    of(C, "springforce", "no h v ahead", "elastic: step; damping: step"),
    of(C, "springforce", "h² B", "damping: dF/dx direct, dF/dx cross, dF/dv direct, dF/dv cross"),
    of(PYTHON, "springforce", "n and its change swapped", "damping: dF/dx direct, dF/dx cross"),
    of(PYTHON, "springforce", "dF/dv off by 1e-6", "damping: dF/dv direct, dF/dv cross"),
    of(PYTHON, "gravitationalforce", "l⁴ for l⁵ in gravitation", "all: dF/dx direct, dF/dx cross"),
    of(PYTHON, "vortexforce", "2 for 3 in the vortex", "rotation: dF/dx direct, dF/dx cross"),
    of(PYTHON, "dragdamping", "drag's Jacobian divided by the mass", "all: dF/dv direct"),
    of(PYTHON, "springforce", "cross blocks only one way", "elastic: dF/dx cross; damping: dF/dx cross, dF/dv cross"),
];
