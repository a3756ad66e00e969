//! Cases with difficult geometry or motion: coincident particles, compression, long chains, empty scenes.

use simulator::generate::{Chain, Generator, SpringLaw, Springs, Timeline};
use simulator::vocabulary;

use super::{Case, case};
use crate::stability::draft::Draft;

pub(super) static CASES: &[Case] = &[
    case("nearly-coincident", "two particles 1e-12 apart on a spring of rest length 1", || pair([1e-12, 0.0], [0.0; 2])).steps(&[0.001, 0.1], [200, 2000]).energy(50.0),
    case("coincident", "two particles in one place, at rest: the spring has no direction", || pair([0.0; 2], [0.0; 2])).steps(&[0.01], [20, 20]).energy(50.0),
    case("coincident-parting", "two particles in one place that fly apart", || pair([0.0; 2], [1.0, 0.5])).steps(&[0.01], [200, 2000]).energy(50.0),
    case("onto-its-end", "the guess x + h v of the first step lies on the spring's other end", || {
            Draft::new()
                .fixed([0.0; 2])
                .particle(1.0, [0.5, 0.0], [-1.0, 0.0])
                .spring([0, 1], [1.0, 1.0, 0.0])
        }).steps(&[0.5], [40, 400]).energy(0.7),
    case("zero-rest-length", "a triangle of springs that pull themselves to a point", || triangle(0.0)).steps(&[0.001, 0.1], [400, 4000]).energy(150.0),
    case("zero-rest-length-damped", "the same with damping, which needs a direction at the point", || triangle(1.0)).steps(&[0.001, 0.1], [400, 4000]).energy(150.0),
    case("through-its-end", "a particle shot through the end of its spring, which comes out inverted", || {
            Draft::new()
                .fixed([0.0; 2])
                .particle(1.0, [1.0, 0.0], [-9.7, 0.0])
                .spring([0, 1], [50.0, 1.0, 0.0])
        }).steps(&[0.01, 0.1], [200, 2000]).energy(47.0),
    case("compressed", "a lattice compressed to a tenth: across every spring the stiffness is negative", || lattice(0.1, 1e4)).steps(&[0.001, 0.05], [100, 1000]).energy(6e4),
    case("inverted", "a lattice with one row folded over its neighbour", inverted).steps(&[0.001, 0.05], [100, 1000]).energy(4e4),
    case("indefinite", "a column of springs pressed together by half: Newton's matrix has a negative eigenvalue", || {
            let mut draft = Draft::new().fixed([0.0; 2]);
            for number in 1..=5 {
                let (x, y) = (1e-3 * f64::from(number % 2), 0.5 * f64::from(number));
                draft = draft.particle(1.0, [x, y], [0.0; 2]);
                let pair = [number as usize - 1, number as usize];
                draft = draft.spring(pair, [1e4, 1.0, 0.0]);
            }
            draft
        }).steps(&[0.001, 0.05], [100, 1000]).energy(6.3e3),
    case("green-compressed", "springs of the squared length, pressed to a hundredth: indefinite, and steep once stretched", || {
            Draft::new()
                .fixed([0.0; 2])
                .particle(1.0, [0.01, 0.003], [0.0; 2])
                .particle(1.0, [-0.004, 0.011], [0.0; 2])
                .force("greenspringforce", &[0, 1], &[("k", 1e4), ("l0", 1.0)])
                .force("greenspringforce", &[0, 2], &[("k", 1e4), ("l0", 1.0)])
                .force("greenspringforce", &[1, 2], &[("k", 1e4), ("l0", 1.0)])
        }).steps(&[0.001, 0.05], [100, 1000]).energy(1.5e4),
    case("cold-start", "five particles flung at 30 m/s on springs to 5e8, at steps of a second: plain Newton runs in circles", flung).steps(&[1e-5, 1.0], [20, 200]).energy(6e8),
    case("near-collision", "a comet that passes its star at a thousandth of its distance", || gravitating([0.03, 0.0])).steps(&[1e-4, 0.01], [2_000, 20_000]).energy(1.0),
    case("head-on", "two bodies fall straight into each other", || gravitating([0.0, 0.0])).steps(&[1e-4, 0.01], [2_000, 20_000]).energy(1.0),
    case("chain-1000", "a chain of 1,000 links let go sideways", chain).steps(&[1e-4, 0.01], [20, 500]).energy(245.0),
    case("vortex-heavy", "a vortex of two particles of which one is 1e9 times as heavy", || {
            Draft::new()
                .particle(1e9, [0.0; 2], [0.0; 2])
                .particle(1.0, [1.0, 0.0], [0.0, 0.5])
                .force("vortexforce", &[0, 1], &[("kbs", 0.8), ("kvc", 1000.0)])
        }).steps(&[1e-4, 0.01], [400, 4000]).energy(0.5),
    case("free-spin", "a rigid square that spins freely, its springs of 1e6", spinning).steps(&[1e-4, 0.01], [1_000, 10_000]).energy(4.0),
    case("cut-by-fixed", "a chain that fixed particles cut into systems of their own", || {
            let mut draft = Draft::new();
            for number in 0..13_usize {
                let x = number as f64;
                draft = match number % 4 {
                    0 => draft.fixed([x, 0.0]),
                    _ => draft.particle(1.0, [x, 0.0], [0.0; 2]),
                };
                if number > 0 {
                    draft = draft.spring([number - 1, number], [1e3, 0.9, 0.0]);
                }
            }
            draft.force("simplegravity", &[], &[("fy", -9.81)])
        }).steps(&[0.001, 0.1], [200, 2000]).energy(120.0),
    case("nothing-free", "all particles are fixed: there is nothing to solve", || Draft::new().fixed([0.0; 2]).fixed([2.0, 0.0]).spring([0, 1], [1e6, 1.0, 0.0])).steps(&[0.1], [20, 200]).energy(5e5),
    case("nothing-acts", "free particles without any force", || {
            Draft::new().particle(1e-12, [1e8, 0.0], [1e4, 0.0]).particle(
                1e12,
                [0.0; 2],
                [1.0, 2.0],
            )
        }).steps(&[0.1], [20, 200]).energy(2.5e12),
    case("no-particles", "a scene of nothing", Draft::new).steps(&[0.1], [20, 200]).energy(1.0),
    case("at-rest", "a lattice at rest, which must stay where it is", || lattice(1.0, 1e6)).steps(&[0.001, 0.1], [100, 1000]).energy(1.0),
];

fn pair(apart: [f64; 2], velocity: [f64; 2]) -> Draft {
    Draft::new()
        .particle(1.0, [0.0; 2], [0.0; 2])
        .particle(1.0, apart, velocity)
        .spring([0, 1], [100.0, 1.0, 0.0])
}

fn triangle(damping: f64) -> Draft {
    Draft::new()
        .particle(1.0, [0.0, 0.0], [0.0; 2])
        .particle(1.0, [1.0, 0.0], [0.0; 2])
        .particle(1.0, [0.3, 1.0], [0.0; 2])
        .spring([0, 1], [100.0, 0.0, damping])
        .spring([1, 2], [100.0, 0.0, damping])
        .spring([2, 0], [100.0, 0.0, damping])
}

/// A lattice of four by four particles at distance 1 times `scale`, with springs along the axes and one diagonal, and
/// a fixed lower row.
fn lattice(scale: f64, stiffness: f64) -> Draft {
    let mut draft = Draft::new();
    for (row, column) in (0..4).flat_map(|row| (0..4).map(move |column| (row, column))) {
        let position = [scale * f64::from(column), scale * f64::from(row)];
        draft = match row {
            0 => draft.fixed(position),
            _ => draft.particle(1.0, position, [0.0; 2]),
        };
    }
    for (row, column) in (0..4).flat_map(|row| (0..4).map(move |column| (row, column))) {
        let number = 4 * row + column;
        if column < 3 {
            draft = draft.spring([number, number + 1], [stiffness, 1.0, 0.0]);
        }
        if row < 3 {
            draft = draft.spring([number, number + 4], [stiffness, 1.0, 0.0]);
        }
        if row < 3 && column < 3 {
            let diagonal = std::f64::consts::SQRT_2;
            draft = draft.spring([number, number + 5], [stiffness, diagonal, 0.0]);
        }
    }
    draft
}

/// The lattice with its third row moved below the second.
fn inverted() -> Draft {
    let mut draft = Draft::new();
    for (row, column) in (0..4).flat_map(|row| (0..4).map(move |column| (row, column))) {
        let y = [0.0, 1.0, 0.4, 2.0][row];
        let position = [f64::from(column), y];
        draft = match row {
            0 => draft.fixed(position),
            _ => draft.particle(1.0, position, [0.0; 2]),
        };
    }
    let all = lattice(1.0, 1e4);
    draft.with_forces_of(all)
}

/// The scene of the tests of `simulate --robust`.
fn flung() -> Draft {
    let particles = [
        [0.713, 0.179, -16.76, 28.54],
        [1.191, 0.066, -16.61, 8.91],
        [-0.42, 0.303, -10.73, 7.86],
        [-1.765, -0.806, 28.07, 22.53],
    ];
    let springs = [
        ([1, 0], 340356.0),
        ([2, 0], 196142647.0),
        ([2, 1], 356302.0),
        ([3, 0], 497098166.0),
        ([3, 1], 52385440.0),
        ([3, 2], 1204651.0),
        ([4, 0], 182722.0),
        ([4, 1], 11026.0),
        ([4, 2], 247508143.0),
        ([4, 3], 15473.0),
    ];
    let mut draft = Draft::new().fixed([0.0; 2]);
    for [x, y, vx, vy] in particles {
        draft = draft.particle(1.0, [x, y], [vx, vy]);
    }
    for (pair, stiffness) in springs {
        draft = draft.spring(pair, [stiffness, 1.0, 0.0]);
    }
    draft
}

/// Two bodies of mass 1 at distance 1 along x; `velocity` of the second is (sideways, along x).
fn gravitating(velocity: [f64; 2]) -> Draft {
    Draft::new()
        .particle(1.0, [0.0; 2], [0.0; 2])
        .particle(1.0, [1.0, 0.0], [velocity[1], velocity[0]])
        .force("gravitationalforce", &[0, 1], &[("G", 1.0)])
}

fn chain() -> Draft {
    let integrator = vocabulary().integrator("symplectic-euler");
    let chain = Chain {
        links: 1000,
        length: 10.0,
        mass: 0.005,
        sag: 0.0,
        springs: Springs { stiffness: 1e5, damping: 0.0, law: SpringLaw::Hooke },
        timeline: Timeline {
            integrator: integrator.expect("it is of the registry"),
            options: Vec::new(),
            time_step: Some(1e-3),
            duration: 0.0,
            steps: Some(1),
        },
        ..Chain::default()
    };
    Draft::of(&chain.scene().expect("its options are in their domains"))
}

fn spinning() -> Draft {
    let corners = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
    let mut draft = Draft::new();
    for [x, y] in corners {
        draft = draft.particle(1.0, [x, y], [-y, x]);
    }
    for [i, j] in [[0, 1], [1, 2], [2, 3], [3, 0]] {
        draft = draft.spring([i, j], [1e6, 2.0, 0.0]);
    }
    let diagonal = 2.0 * std::f64::consts::SQRT_2;
    draft.spring([0, 2], [1e6, diagonal, 0.0]).spring([1, 3], [1e6, diagonal, 0.0])
}
