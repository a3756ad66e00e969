//! The hard cases, and what is hard about each.
//!
//! A case is a scene without a method: particles, forces, a few time steps, how many steps of each, and the energy
//! that it has at hand, against which a rise of energy is measured. Units are metres, kilograms and seconds.
//! Adding one is an entry here, and `grade stability --accept`.

mod motion;
mod stiffness;

use super::draft::Draft;

/// A hard case.
pub struct Case {
    /// What tables call it.
    pub name: &'static str,
    /// What is hard about it.
    pub about: &'static str,
    /// Its particles and forces.
    pub(super) draft: fn() -> Draft,
    /// Time steps, in seconds.
    pub time_steps: &'static [f64],
    /// Steps of a quick run and of a full one.
    pub steps: [u64; 2],
    /// The energy that can turn into motion, in joules.
    pub energy: f64,
    /// The oscillator that it is, where it is a linear one.
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
