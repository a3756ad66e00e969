//! Cases with difficult geometry or motion: coincident particles, compression, long chains, empty scenes.

use simulator::generate::{Chain, Generator, SpringLaw, Springs, Timeline};
use simulator::vocabulary;

use super::Case;
use crate::stability::draft::Draft;

pub(super) static CASES: &[Case] = &[
    Case {
        name: "nearly-coincident",
        about: "two particles 1e-12 apart on a spring of rest length 1",
        draft: || pair([1e-12, 0.0], [0.0; 2]),
        time_steps: &[0.001, 0.1],
        steps: [200, 2000],
        energy: 50.0,
        oscillator: None,
    },
    Case {
        name: "coincident",
        about: "two particles in one place, at rest: the spring has no direction",
        draft: || pair([0.0; 2], [0.0; 2]),
        time_steps: &[0.01],
        steps: [20, 20],
        energy: 50.0,
        oscillator: None,
    },
    Case {
        name: "coincident-parting",
        about: "two particles in one place that fly apart",
        draft: || pair([0.0; 2], [1.0, 0.5]),
        time_steps: &[0.01],
        steps: [200, 2000],
        energy: 50.0,
        oscillator: None,
    },
    Case {
        name: "onto-its-end",
        about: "the guess x + h v of the first step lies on the spring's other end",
        draft: || {
            Draft::new()
                .fixed([0.0; 2])
                .particle(1.0, [0.5, 0.0], [-1.0, 0.0])
                .spring([0, 1], [1.0, 1.0, 0.0])
        },
        time_steps: &[0.5],
        steps: [40, 400],
        energy: 0.7,
        oscillator: None,
    },
    Case {
        name: "zero-rest-length",
        about: "a triangle of springs that pull themselves to a point",
        draft: || triangle(0.0),
        time_steps: &[0.001, 0.1],
        steps: [400, 4000],
        energy: 150.0,
        oscillator: None,
    },
    Case {
        name: "zero-rest-length-damped",
        about: "the same with damping, which needs a direction at the point",
        draft: || triangle(1.0),
        time_steps: &[0.001, 0.1],
        steps: [400, 4000],
        energy: 150.0,
        oscillator: None,
    },
    Case {
        name: "through-its-end",
        about: "a particle shot through the end of its spring, which comes out inverted",
        draft: || {
            Draft::new()
                .fixed([0.0; 2])
                .particle(1.0, [1.0, 0.0], [-9.7, 0.0])
                .spring([0, 1], [50.0, 1.0, 0.0])
        },
        time_steps: &[0.01, 0.1],
        steps: [200, 2000],
        energy: 47.0,
        oscillator: None,
    },
    Case {
        name: "compressed",
        about: "a lattice compressed to a tenth: across every spring the stiffness is negative",
        draft: || lattice(0.1, 1e4),
        time_steps: &[0.001, 0.05],
        steps: [100, 1000],
        energy: 6e4,
        oscillator: None,
    },
    Case {
        name: "inverted",
        about: "a lattice with one row folded over its neighbour",
        draft: inverted,
        time_steps: &[0.001, 0.05],
        steps: [100, 1000],
        energy: 4e4,
        oscillator: None,
    },
    Case {
        name: "indefinite",
        about: "a column of springs pressed together by half: Newton's matrix has a negative eigenvalue",
        draft: || {
            let mut draft = Draft::new().fixed([0.0; 2]);
            for number in 1..=5 {
                let (x, y) = (1e-3 * f64::from(number % 2), 0.5 * f64::from(number));
                draft = draft.particle(1.0, [x, y], [0.0; 2]);
                let pair = [number as usize - 1, number as usize];
                draft = draft.spring(pair, [1e4, 1.0, 0.0]);
            }
            draft
        },
        time_steps: &[0.001, 0.05],
        steps: [100, 1000],
        energy: 6.3e3,
        oscillator: None,
    },
    Case {
        name: "green-compressed",
        about: "springs of the squared length, pressed to a hundredth: indefinite, and steep once stretched",
        draft: || {
            Draft::new()
                .fixed([0.0; 2])
                .particle(1.0, [0.01, 0.003], [0.0; 2])
                .particle(1.0, [-0.004, 0.011], [0.0; 2])
                .force("greenspringforce", &[0, 1], &[("k", 1e4), ("l0", 1.0)])
                .force("greenspringforce", &[0, 2], &[("k", 1e4), ("l0", 1.0)])
                .force("greenspringforce", &[1, 2], &[("k", 1e4), ("l0", 1.0)])
        },
        time_steps: &[0.001, 0.05],
        steps: [100, 1000],
        energy: 1.5e4,
        oscillator: None,
    },
    Case {
        name: "cold-start",
        about: "five particles flung at 30 m/s on springs to 5e8, at steps of a second: plain Newton runs in circles",
        draft: flung,
        time_steps: &[1e-5, 1.0],
        steps: [20, 200],
        energy: 6e8,
        oscillator: None,
    },
    Case {
        name: "near-collision",
        about: "a comet that passes its star at a thousandth of its distance",
        draft: || gravitating([0.03, 0.0]),
        time_steps: &[1e-4, 0.01],
        steps: [2_000, 20_000],
        energy: 1.0,
        oscillator: None,
    },
    Case {
        name: "head-on",
        about: "two bodies fall straight into each other",
        draft: || gravitating([0.0, 0.0]),
        time_steps: &[1e-4, 0.01],
        steps: [2_000, 20_000],
        energy: 1.0,
        oscillator: None,
    },
    Case {
        name: "chain-1000",
        about: "a chain of 1,000 links let go sideways",
        draft: chain,
        time_steps: &[1e-4, 0.01],
        steps: [20, 500],
        energy: 245.0,
        oscillator: None,
    },
    Case {
        name: "vortex-heavy",
        about: "a vortex of two particles of which one is 1e9 times as heavy",
        draft: || {
            Draft::new()
                .particle(1e9, [0.0; 2], [0.0; 2])
                .particle(1.0, [1.0, 0.0], [0.0, 0.5])
                .force("vortexforce", &[0, 1], &[("kbs", 0.8), ("kvc", 1000.0)])
        },
        time_steps: &[1e-4, 0.01],
        steps: [400, 4000],
        energy: 0.5,
        oscillator: None,
    },
    Case {
        name: "free-spin",
        about: "a rigid square that spins freely, its springs of 1e6",
        draft: spinning,
        time_steps: &[1e-4, 0.01],
        steps: [1_000, 10_000],
        energy: 4.0,
        oscillator: None,
    },
    Case {
        name: "cut-by-fixed",
        about: "a chain that fixed particles cut into systems of their own",
        draft: || {
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
        },
        time_steps: &[0.001, 0.1],
        steps: [200, 2000],
        energy: 120.0,
        oscillator: None,
    },
    Case {
        name: "nothing-free",
        about: "all particles are fixed: there is nothing to solve",
        draft: || Draft::new().fixed([0.0; 2]).fixed([2.0, 0.0]).spring([0, 1], [1e6, 1.0, 0.0]),
        time_steps: &[0.1],
        steps: [20, 200],
        energy: 5e5,
        oscillator: None,
    },
    Case {
        name: "nothing-acts",
        about: "free particles without any force",
        draft: || {
            Draft::new().particle(1e-12, [1e8, 0.0], [1e4, 0.0]).particle(
                1e12,
                [0.0; 2],
                [1.0, 2.0],
            )
        },
        time_steps: &[0.1],
        steps: [20, 200],
        energy: 2.5e12,
        oscillator: None,
    },
    Case {
        name: "no-particles",
        about: "a scene of nothing",
        draft: Draft::new,
        time_steps: &[0.1],
        steps: [20, 200],
        energy: 1.0,
        oscillator: None,
    },
    Case {
        name: "at-rest",
        about: "a lattice at rest, which must stay where it is",
        draft: || lattice(1.0, 1e6),
        time_steps: &[0.001, 0.1],
        steps: [100, 1000],
        energy: 1.0,
        oscillator: None,
    },
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
