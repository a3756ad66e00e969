//! Cases with extreme parameters: stiffness, masses, damping, size.

use super::{Case, Oscillator};
use crate::stability::draft::Draft;

/// A particle of mass 1 at (1, 0.5), tied to the origin by a spring of this stiffness, with drag.
fn oscillator(stiffness: f64, drag: f64) -> Draft {
    let draft = Draft::new()
        .fixed([0.0; 2])
        .particle(1.0, [1.0, 0.5], [0.0; 2])
        .spring([0, 1], [stiffness, 0.0, 0.0]);
    if drag == 0.0 { draft } else { draft.force("dragdamping", &[], &[("b", drag)]) }
}

const fn undamped(omega: f64) -> Option<Oscillator> {
    Some(Oscillator { omega, zeta: 0.0 })
}

pub(super) static CASES: &[Case] = &[
    Case {
        name: "stiffness-1",
        about: "an oscillator of stiffness 1, below and beyond every limit of a step",
        draft: || oscillator(1.0, 0.0),
        time_steps: &[0.01, 1.0, 2.1],
        steps: [400, 4000],
        energy: 0.625,
        oscillator: undamped(1.0),
    },
    Case {
        name: "stiffness-1e4",
        about: "the same of stiffness 1e4",
        draft: || oscillator(1e4, 0.0),
        time_steps: &[0.001, 0.1],
        steps: [400, 4000],
        energy: 0.625e4,
        oscillator: undamped(1e2),
    },
    Case {
        name: "stiffness-1e8",
        about: "the same of stiffness 1e8",
        draft: || oscillator(1e8, 0.0),
        time_steps: &[1e-5, 0.1],
        steps: [400, 4000],
        energy: 0.625e8,
        oscillator: undamped(1e4),
    },
    Case {
        name: "stiffness-1e12",
        about: "the same of stiffness 1e12: h ω up to 1e5",
        draft: || oscillator(1e12, 0.0),
        time_steps: &[1e-7, 0.1],
        steps: [400, 4000],
        energy: 0.625e12,
        oscillator: undamped(1e6),
    },
    Case {
        name: "stiff-pair-1e12",
        about: "two free particles turn about each other on a spring of 1e12 that is stretched by a tenth",
        draft: || {
            Draft::new()
                .particle(1.0, [0.0, 0.0], [0.0, -1.0])
                .particle(1.0, [0.66, 0.88], [0.5, 1.0])
                .spring([0, 1], [1e12, 1.0, 0.0])
        },
        time_steps: &[1e-7, 0.01],
        steps: [200, 2000],
        energy: 5e9,
        oscillator: None,
    },
    Case {
        name: "stiff-and-soft",
        about: "springs of 1 and 1e12 in one chain",
        draft: || {
            let mut draft = Draft::new().fixed([0.0; 2]);
            for number in 1..=6 {
                let x = f64::from(number);
                draft = draft.particle(1.0, [x, 0.1 * x], [0.0; 2]);
                let stiffness = if number % 2 == 0 { 1e12 } else { 1.0 };
                let pair = [number as usize - 1, number as usize];
                draft = draft.spring(pair, [stiffness, 1.0, 0.0]);
            }
            draft
        },
        time_steps: &[1e-7, 0.01],
        steps: [200, 2000],
        energy: 4e7,
        oscillator: None,
    },
    Case {
        name: "mass-ratio-1e6",
        about: "a particle of 1e-6 kg tied to one of 1 kg",
        draft: || masses(1e-6),
        time_steps: &[1e-4, 0.01],
        steps: [400, 4000],
        energy: 0.5,
        oscillator: None,
    },
    Case {
        name: "mass-ratio-1e12",
        about: "a particle of 1e-12 kg tied to one of 1 kg",
        draft: || masses(1e-12),
        time_steps: &[1e-7, 0.01],
        steps: [400, 4000],
        energy: 0.5,
        oscillator: None,
    },
    Case {
        name: "damping-1e6-drag",
        about: "drag of a million times the critical",
        draft: || oscillator(1.0, 2e6),
        time_steps: &[1e-7, 0.01],
        steps: [400, 4000],
        energy: 0.625,
        oscillator: Some(Oscillator { omega: 1.0, zeta: 1e6 }),
    },
    Case {
        name: "damping-1e6-spring",
        about: "a spring damped a million times beyond the critical",
        draft: || {
            Draft::new()
                .fixed([0.0; 2])
                .particle(1.0, [1.5, 0.0], [0.0, 0.3])
                .spring([0, 1], [1.0, 1.0, 2e6])
        },
        time_steps: &[1e-7, 0.01],
        steps: [400, 4000],
        energy: 0.17,
        oscillator: None,
    },
    Case {
        name: "far-away",
        about: "a spinning pair at coordinates of 1e8, where rounding is 1e-8",
        draft: || {
            Draft::new()
                .particle(1.0, [1e8, -1e8], [0.0, 1.0])
                .particle(1.0, [1e8 + 1.0, -1e8], [0.0, -1.0])
                .spring([0, 1], [100.0, 0.9, 0.0])
        },
        time_steps: &[0.001, 0.1],
        steps: [400, 4000],
        energy: 1.5,
        oscillator: None,
    },
    Case {
        name: "huge-step",
        about: "a step of a million seconds, then of a nanosecond",
        draft: || oscillator(1.0, 0.1),
        time_steps: &[1e-9, 1e6],
        steps: [50, 500],
        energy: 0.625,
        oscillator: Some(Oscillator { omega: 1.0, zeta: 0.05 }),
    },
    Case {
        name: "million-steps",
        about: "10⁶ steps of an oscillator (10⁴ in a quick run): what is small adds up",
        draft: || oscillator(1.0, 0.0),
        time_steps: &[0.01],
        steps: [10_000, 1_000_000],
        energy: 0.625,
        oscillator: undamped(1.0),
    },
];

fn masses(light: f64) -> Draft {
    Draft::new()
        .particle(1.0, [0.0; 2], [0.0; 2])
        .particle(light, [1.1, 0.0], [0.0, 0.5])
        .spring([0, 1], [100.0, 1.0, 0.0])
}
