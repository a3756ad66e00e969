//! Measured methods, their bodies and sizes, and the ratios that are aimed at.

use std::collections::BTreeSet;

/// A time integration method, ours and the peer's.
pub(crate) struct Method {
    /// Its name in the table.
    pub(crate) title: &'static str,
    /// The body that is stepped.
    pub(crate) body: Body,
    /// Our integrator.
    pub(crate) integrator: &'static str,
    /// Its options.
    pub(crate) options: &'static [(&'static str, &'static str)],
    /// Which peer.
    pub(crate) peer: Peer,
    /// Unit of the times.
    pub(crate) unit: Unit,
    /// Time step in seconds.
    pub(crate) time_step: f64,
    /// Whether our first step is left out, as the peer factors its constant matrix before its clock starts.
    pub(crate) first_step_untimed: bool,
    /// Rough time of the slower side, in ns an element and step: it sets the number of steps.
    pub(crate) rough_cost: f64,
    /// Segments a side, and the ratio aimed at.
    pub(crate) targets: &'static [(usize, f64)],
}

/// The simulated body; its elements are counted by segments a side.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Body {
    /// The square net of springs.
    Net,
    /// The square sheet of triangles.
    Sheet,
}

impl Body {
    /// Its elements, in the plural.
    pub(crate) fn elements_name(self) -> &'static str {
        match self {
            Self::Net => "springs",
            Self::Sheet => "triangles",
        }
    }

    /// How many elements it has.
    pub(crate) fn elements(self, segments: usize) -> usize {
        match self {
            Self::Net => 4 * segments * segments + 2 * segments,
            Self::Sheet => 2 * segments * segments,
        }
    }
}

/// Programs and libraries that we are compared with.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Peer {
    /// The C++ program with Eigen, in this mode.
    Eigen(&'static str),
    /// The C++ program with CHOLMOD, in this mode.
    Cholmod(&'static str),
    /// The Python program with numpy and scipy.
    Python,
    /// The Python program with MKL PARDISO.
    Pardiso,
    /// The Python program with Taichi.
    Taichi,
    /// The C++ program with Eigen for triangles, in this mode.
    Triangles(&'static str),
    /// The same with CHOLMOD.
    TrianglesCholmod,
    /// The Python program with Taichi for triangles.
    TaichiTriangles,
    /// The Python program with scikit-fem, which assembles a matrix.
    ScikitFem,
}

/// Unit of a time.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unit {
    /// Milliseconds a step.
    Milliseconds,
    /// Nanoseconds an element and step.
    NanosecondsAnElement,
}

/// Stiffness of the springs, and modulus of the triangles.
pub(crate) const STIFFNESS: f64 = 1e5;

/// Local-global iterations a step of fast mass-spring.
pub(crate) const FMS_ITERATIONS: u32 = 50;

/// Where the peer's projected Newton ends: the largest update over the time step, as in the slides.
pub(crate) const NEWTON_TOLERANCE: f64 = 1e-2;

/// Matrices that a peer factorises where only that is timed; later ones of large nets are indefinite.
pub(crate) const FACTORISED: u64 = 5;

/// A measurement takes about this long, in ns.
const MEASUREMENT: f64 = 3e8;

const LINEARIZED: Method = Method {
    title: "Linearized implicit Euler",
    body: Body::Net,
    integrator: "linearized-implicit-euler",
    options: &[],
    peer: Peer::Eigen("lie"),
    unit: Unit::Milliseconds,
    time_step: 0.004,
    first_step_untimed: false,
    rough_cost: 1500.0,
    targets: &[(4, 3.0), (8, 3.0), (16, 3.0), (64, 3.0), (128, 4.0), (256, 6.0)],
};

const FAST_MASS_SPRING: Method = Method {
    title: "Fast mass-spring, 50 iterations",
    body: Body::Net,
    integrator: "fast-mass-spring",
    options: &[("iterations", "50")],
    peer: Peer::Eigen("fms"),
    unit: Unit::Milliseconds,
    time_step: 0.004,
    first_step_untimed: true,
    rough_cost: 2500.0,
    targets: &[(4, 2.0), (8, 2.0), (16, 2.0), (64, 2.0), (128, 2.0), (256, 3.0)],
};

/// Not slower.
const EVEN: &[(usize, f64)] = &[(4, 1.0), (8, 1.0), (16, 1.0), (64, 1.0), (128, 1.0), (256, 1.0)];

const SYMPLECTIC: Method = Method {
    title: "Symplectic Euler",
    body: Body::Net,
    integrator: "symplectic-euler",
    options: &[],
    peer: Peer::Eigen("symplectic"),
    unit: Unit::NanosecondsAnElement,
    // Stable for all sizes: h² ω² ≤ 4 as long as h ≤ 1.9e-4 s at 256 segments.
    time_step: 5e-5,
    first_step_untimed: false,
    rough_cost: 4.0,
    targets: &[(4, 1.5), (8, 1.5), (16, 1.5), (64, 3.0), (128, 3.0), (256, 3.0)],
};

/// Of some 1,000, 10,000 and 100,000 triangles.
const SHEETS: &[(usize, f64)] = &[(22, 3.0), (71, 3.0), (224, 3.0)];

/// Not slower.
const EVEN_SHEETS: &[(usize, f64)] = &[(22, 1.0), (71, 1.0), (224, 1.0)];

const TRIANGLES: Method = Method {
    title: "Linearized implicit Euler on triangles",
    body: Body::Sheet,
    peer: Peer::Triangles("lie"),
    rough_cost: 3000.0,
    targets: SHEETS,
    ..LINEARIZED
};

const EXPLICIT_TRIANGLES: Method = Method {
    title: "Symplectic Euler on triangles",
    body: Body::Sheet,
    peer: Peer::Triangles("symplectic"),
    rough_cost: 20.0,
    targets: EVEN_SHEETS,
    ..SYMPLECTIC
};

/// The rows, in the order of the table.
pub(crate) static METHODS: [Method; 13] = [
    LINEARIZED,
    Method { peer: Peer::Cholmod("lie"), targets: EVEN, ..LINEARIZED },
    Method {
        peer: Peer::Pardiso,
        targets: &[(16, 1.5), (64, 1.5), (128, 1.5), (256, 1.5), (512, 1.5)],
        ..LINEARIZED
    },
    SYMPLECTIC,
    // Starting a kernel takes 0.1 ms, whatever the size.
    Method { peer: Peer::Taichi, rough_cost: 100.0, targets: EVEN, ..SYMPLECTIC },
    FAST_MASS_SPRING,
    Method { peer: Peer::Cholmod("fms"), targets: EVEN, ..FAST_MASS_SPRING },
    Method {
        title: "Projected Newton",
        body: Body::Net,
        integrator: "projected-newton",
        options: &[("tolerance", "1e-2")],
        peer: Peer::Python,
        unit: Unit::Milliseconds,
        time_step: 0.004,
        first_step_untimed: false,
        rough_cost: 2e5,
        targets: &[(4, 50.0), (8, 50.0), (16, 50.0), (64, 50.0)],
    },
    TRIANGLES,
    Method { peer: Peer::TrianglesCholmod, targets: EVEN_SHEETS, ..TRIANGLES },
    Method {
        title: "Assembly of the tangent stiffness of triangles",
        peer: Peer::ScikitFem,
        rough_cost: 10_000.0,
        ..TRIANGLES
    },
    EXPLICIT_TRIANGLES,
    Method { peer: Peer::TaichiTriangles, ..EXPLICIT_TRIANGLES },
];

impl Method {
    /// How many steps a measurement on a body of this many elements takes, the same for both sides.
    pub(crate) fn steps(&self, elements: usize) -> u64 {
        (MEASUREMENT / (self.rough_cost * elements as f64)).max(2.0) as u64
    }

    /// The unit of its times, after its title.
    pub(crate) fn unit_name(&self) -> String {
        let element = self.body.elements_name().trim_end_matches('s');
        match (self.unit, self.peer) {
            (_, Peer::ScikitFem) => "ms".into(),
            (Unit::Milliseconds, _) => "ms a step".into(),
            (Unit::NanosecondsAnElement, _) => format!("ns a {element} and step"),
        }
    }
}

impl Peer {
    /// After the method's title.
    pub(crate) fn describe(self) -> &'static str {
        match self {
            Self::Eigen(_) | Self::Triangles(_) => "C++ with Eigen",
            Self::Cholmod(_) | Self::TrianglesCholmod => "C++ with CHOLMOD",
            Self::Python => "Python with numpy and scipy",
            Self::Pardiso => "MKL PARDISO, its calls alone",
            Self::Taichi | Self::TaichiTriangles => "Taichi",
            Self::ScikitFem => "scikit-fem",
        }
    }
}

impl Unit {
    /// A time in ns a step, in this unit.
    pub(crate) fn of(self, time: f64, elements: usize) -> f64 {
        match self {
            Self::Milliseconds => time * 1e-6,
            Self::NanosecondsAnElement => time / elements as f64,
        }
    }
}

/// Every size of body, in segments a side.
pub(crate) fn sizes() -> Vec<usize> {
    let all = METHODS.iter().flat_map(|method| method.targets).map(|(segments, _)| *segments);
    all.collect::<BTreeSet<usize>>().into_iter().collect()
}
