//! Cases with extreme parameters: stiffness, masses, damping, size.

use super::{Case, case};
use crate::stability::draft::Draft;

/// A particle of mass 1 at (1, 0.5), tied to the origin by a spring of this stiffness, with drag.
fn oscillator(stiffness: f64, drag: f64) -> Draft {
    let draft = Draft::new()
        .fixed([0.0; 2])
        .particle(1.0, [1.0, 0.5], [0.0; 2])
        .spring([0, 1], [stiffness, 0.0, 0.0]);
    if drag == 0.0 { draft } else { draft.force("dragdamping", &[], &[("b", drag)]) }
}

pub(super) static CASES: &[Case] = &[
    case(
        "stiffness-1",
        "an oscillator of stiffness 1, below and beyond every limit of a step",
        || oscillator(1.0, 0.0),
    )
    .steps(&[0.01, 1.0, 2.1], [400, 4000])
    .energy(0.625)
    .oscillates(1.0, 0.0),
    case("stiffness-1e4", "the same of stiffness 1e4", || oscillator(1e4, 0.0))
        .steps(&[0.001, 0.1], [400, 4000])
        .energy(0.625e4)
        .oscillates(1e2, 0.0),
    case("stiffness-1e8", "the same of stiffness 1e8", || oscillator(1e8, 0.0))
        .steps(&[1e-5, 0.1], [400, 4000])
        .energy(0.625e8)
        .oscillates(1e4, 0.0),
    case("stiffness-1e12", "the same of stiffness 1e12: h ω up to 1e5", || oscillator(1e12, 0.0))
        .steps(&[1e-7, 0.1], [400, 4000])
        .energy(0.625e12)
        .oscillates(1e6, 0.0),
    case(
        "stiff-pair-1e12",
        "two free particles turn about each other on a spring of 1e12 that is stretched by a tenth",
        || {
            Draft::new()
                .particle(1.0, [0.0, 0.0], [0.0, -1.0])
                .particle(1.0, [0.66, 0.88], [0.5, 1.0])
                .spring([0, 1], [1e12, 1.0, 0.0])
        },
    )
    .steps(&[1e-7, 0.01], [200, 2000])
    .energy(5e9),
    case("stiff-and-soft", "springs of 1 and 1e12 in one chain", || {
        let mut draft = Draft::new().fixed([0.0; 2]);
        for number in 1..=6 {
            let x = f64::from(number);
            draft = draft.particle(1.0, [x, 0.1 * x], [0.0; 2]);
            let stiffness = if number % 2 == 0 { 1e12 } else { 1.0 };
            let pair = [number as usize - 1, number as usize];
            draft = draft.spring(pair, [stiffness, 1.0, 0.0]);
        }
        draft
    })
    .steps(&[1e-7, 0.01], [200, 2000])
    .energy(4e7),
    case("mass-ratio-1e6", "a particle of 1e-6 kg tied to one of 1 kg", || masses(1e-6))
        .steps(&[1e-4, 0.01], [400, 4000])
        .energy(0.5),
    case("mass-ratio-1e12", "a particle of 1e-12 kg tied to one of 1 kg", || masses(1e-12))
        .steps(&[1e-7, 0.01], [400, 4000])
        .energy(0.5),
    case("damping-1e6-drag", "drag of a million times the critical", || oscillator(1.0, 2e6))
        .steps(&[1e-7, 0.01], [400, 4000])
        .energy(0.625)
        .oscillates(1.0, 1e6),
    case("damping-1e6-spring", "a spring damped a million times beyond the critical", || {
        Draft::new()
            .fixed([0.0; 2])
            .particle(1.0, [1.5, 0.0], [0.0, 0.3])
            .spring([0, 1], [1.0, 1.0, 2e6])
    })
    .steps(&[1e-7, 0.01], [400, 4000])
    .energy(0.17),
    case("far-away", "a spinning pair at coordinates of 1e8, where rounding is 1e-8", || {
        Draft::new()
            .particle(1.0, [1e8, -1e8], [0.0, 1.0])
            .particle(1.0, [1e8 + 1.0, -1e8], [0.0, -1.0])
            .spring([0, 1], [100.0, 0.9, 0.0])
    })
    .steps(&[0.001, 0.1], [400, 4000])
    .energy(1.5),
    case("huge-step", "a step of a million seconds, then of a nanosecond", || oscillator(1.0, 0.1))
        .steps(&[1e-9, 1e6], [50, 500])
        .energy(0.625)
        .oscillates(1.0, 0.05),
    case(
        "million-steps",
        "10⁶ steps of an oscillator (10⁴ in a quick run): what is small adds up",
        || oscillator(1.0, 0.0),
    )
    .steps(&[0.01], [10_000, 1_000_000])
    .energy(0.625)
    .oscillates(1.0, 0.0),
];

fn masses(light: f64) -> Draft {
    Draft::new()
        .particle(1.0, [0.0; 2], [0.0; 2])
        .particle(light, [1.1, 0.0], [0.0, 0.5])
        .spring([0, 1], [100.0, 1.0, 0.0])
}
