//! Values that a program keeps from one step to the next: sums never cleared, values computed once.

use nalgebra::DMatrix;

use super::{Carried, Cleared, Kept};

/// The kept values, after the steps made so far; those of a program that has made none by default.
#[derive(Debug, Clone, Default)]
pub struct Memory {
    force: Option<Vec<f64>>,
    jacobians: [Option<DMatrix<f64>>; 2],
    n_masses: f64,
    velocities: Option<Vec<f64>>,
}

impl Memory {
    /// The force that a step uses, where this one is evaluated.
    pub(super) fn force(&mut self, kept: Option<Kept>, mut force: Vec<f64>, h: f64) -> Vec<f64> {
        let Some(Kept { carried, .. }) = kept.filter(|kept| kept.forces) else { return force };
        if let Some(before) = &self.force {
            let n = force.len();
            for (place, (value, before)) in force.iter_mut().zip(before).enumerate() {
                *value = carried.with(*value, *before, ([place, 0], [n, 1]), h);
            }
        }
        self.force = Some(force.clone());
        force
    }

    /// The Jacobians that a step uses, where these are evaluated.
    pub(super) fn jacobians(
        &mut self,
        kept: Option<Kept>,
        mut both: [DMatrix<f64>; 2],
        h: f64,
    ) -> [DMatrix<f64>; 2] {
        let Some(Kept { carried, jacobians, .. }) = kept else { return both };
        for ((matrix, before), _) in
            both.iter_mut().zip(&mut self.jacobians).zip(jacobians).filter(|(_, kept)| *kept)
        {
            if let Some(before) = before {
                let n = matrix.nrows();
                for (row, column) in (0..n).flat_map(|row| (0..n).map(move |column| (row, column)))
                {
                    let (value, before) = (&mut matrix[(row, column)], before[(row, column)]);
                    *value = carried.with(*value, before, ([row, column], [n, n]), h);
                }
            }
            *before = Some(matrix.clone());
        }
        both
    }

    /// How often the matrix of a step has the masses.
    pub(super) fn masses(&mut self, kept: Option<Kept>, h: f64) -> f64 {
        let of_before = match kept.filter(|kept| kept.inertia).map(|kept| kept.carried) {
            Some(Carried::Added(_)) => self.n_masses,
            Some(Carried::Scaled(factor)) => factor.of(h, 1.0) * self.n_masses,
            _ => 0.0,
        };
        self.n_masses = 1.0 + of_before;
        self.n_masses
    }

    /// The velocities along which positions are displaced, in a step from these.
    pub(super) fn velocities(&mut self, kept: Option<Kept>, velocities: &[f64]) -> Option<&[f64]> {
        kept.filter(|kept| kept.displacement)?;
        Some(self.velocities.get_or_insert_with(|| velocities.to_vec()))
    }
}

impl Carried {
    /// A value with the one before it, in this row and column of so many.
    fn with(self, value: f64, before: f64, (at, of): ([usize; 2], [usize; 2]), h: f64) -> f64 {
        match self {
            Self::Again => before,
            Self::Subtracted => value - before,
            Self::Added(cleared) => value + cleared.left(before, at, of),
            Self::Scaled(factor) => value + factor.of(h, 1.0) * before,
        }
    }
}

impl Cleared {
    /// The value left in the entry at this row and column of so many.
    fn left(self, before: f64, [row, column]: [usize; 2], [rows, columns]: [usize; 2]) -> f64 {
        let place = row * columns + column;
        let is_cleared = match self {
            Self::None => false,
            Self::First => place == 0,
            Self::NotFirst => place != 0,
            Self::NotLast => place + 1 != rows * columns,
            Self::Bytes => {
                // Of the last number, the lower bytes.
                let bytes = (rows * columns).saturating_sub(8 * place).min(8);
                let mask = u64::MAX.checked_shl(8 * bytes as u32).unwrap_or(0);
                return f64::from_bits(before.to_bits() & mask);
            }
            Self::Along(axis, axes) => row % axes == axis,
            Self::Few if columns > 1 => row == 0,
            Self::Few => place < rows / 2,
        };
        if is_cleared { 0.0 } else { before }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_call_clears_its_part() {
        let left = |cleared: Cleared, of: [usize; 2]| -> Vec<usize> {
            let all = (0..of[0] * of[1]).map(|place| [place / of[1], place % of[1]]);
            let kept = all.enumerate().filter(|(_, at)| cleared.left(1.5, *at, of) != 0.0);
            kept.map(|(place, _)| place).collect()
        };
        assert_eq!(left(Cleared::None, [2, 2]), [0, 1, 2, 3]);
        assert_eq!(left(Cleared::First, [2, 2]), [1, 2, 3]);
        assert_eq!(left(Cleared::NotFirst, [2, 2]), [0]);
        assert_eq!(left(Cleared::NotLast, [2, 2]), [3]);
        assert_eq!(left(Cleared::Few, [2, 2]), [2, 3]);
        assert_eq!(left(Cleared::Few, [4, 1]), [2, 3]);
        assert_eq!(left(Cleared::Along(0, 2), [4, 1]), [1, 3]);
        assert_eq!(left(Cleared::Bytes, [4, 4]), (2..16).collect::<Vec<_>>());
        // Of 36 numbers, 36 bytes: four numbers, and the lower half of the fifth.
        let fifth = Cleared::Bytes.left(1.0 / 3.0, [0, 4], [6, 6]);
        assert_eq!(fifth.to_bits(), (1.0_f64 / 3.0).to_bits() >> 32 << 32);
    }
}
