//! Hard cases.
//!
//! A case is a scene without a method: particles, forces, a few time steps, the number of steps, and its available
//! energy, the scale for a rise of energy. Units are metres, kilograms and seconds. To add a case, add an entry here
//! and run `grade stability --accept`.

mod motion;
mod stiffness;

use super::draft::Draft;

/// A hard case.
pub struct Case {
    /// Its name in tables.
    pub name: &'static str,
    /// Description of the difficulty.
    pub about: &'static str,
    /// Its particles and forces.
    pub(super) draft: fn() -> Draft,
    /// Time steps, in seconds.
    pub time_steps: &'static [f64],
    /// Number of steps of a quick and of a full run.
    pub steps: [u64; 2],
    /// The energy available for motion, in joules.
    pub energy: f64,
    /// Its parameters, if it is a linear oscillator.
    pub oscillator: Option<Oscillator>,
}

/// A particle on a spring of rest length zero, with drag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillator {
    /// Frequency, in radians a second.
    pub omega: f64,
    /// Damping ratio.
    pub zeta: f64,
}

/// A case; its steps and energy follow by the methods of [`Case`].
const fn case(name: &'static str, about: &'static str, draft: fn() -> Draft) -> Case {
    Case { name, about, draft, time_steps: &[], steps: [0; 2], energy: 0.0, oscillator: None }
}

impl Case {
    /// With these time steps, and as many steps in a quick and in a full run.
    const fn steps(mut self, time_steps: &'static [f64], steps: [u64; 2]) -> Self {
        (self.time_steps, self.steps) = (time_steps, steps);
        self
    }

    /// With this energy available for motion, in joules.
    const fn energy(mut self, energy: f64) -> Self {
        self.energy = energy;
        self
    }

    /// As a linear oscillator of this frequency and damping ratio.
    const fn oscillates(mut self, omega: f64, zeta: f64) -> Self {
        self.oscillator = Some(Oscillator { omega, zeta });
        self
    }
}

/// Every case, in the order of the table.
pub fn all() -> impl Iterator<Item = &'static Case> {
    stiffness::CASES.iter().chain(motion::CASES)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_there_are_more_than_twenty() {
        let names: Vec<&str> = all().map(|case| case.name).collect();
        let unique: std::collections::BTreeSet<&&str> = names.iter().collect();
        assert!(names.len() >= 20 && unique.len() == names.len(), "{names:?}");
    }

    #[test]
    fn every_case_is_taken_by_three_methods_or_more() {
        for case in all() {
            let draft = (case.draft)();
            let taken = simulator::integrator::REGISTRY
                .iter()
                .filter(|kind| draft.is_taken_by(&kind.schema))
                .count();
            assert!(taken >= 3, "{}: {taken}", case.name);
        }
    }
}
