//! Laws of forces on elements of any number of particles. No registered force has one.
//!
//! A law with an energy `U(x)` is stated by it ([`forces_of`]): dual numbers of dual numbers give its Jacobians.

use num_dual::Dual;

use super::{At, Law, Number, Vector};

/// The laws of this file.
pub(super) static LAWS: &[&Law] = &[];

/// The forces of an energy on its particles, `f_a = −∂U/∂x_a`.
pub fn forces_of<T: Number>(
    at: &[At<'_, T>],
    energy: impl Fn(&[Vector<Dual<T>>]) -> Dual<T>,
) -> Vec<Vector<T>> {
    let positions = at.iter().map(|at| at.position.map(|re| Dual::new(re, T::from(0.0))));
    let positions: Vec<Vector<Dual<T>>> = positions.collect();
    let along = |particle: usize, axis: usize| {
        let mut moved = positions.clone();
        moved[particle][axis].eps = T::from(1.0);
        -energy(&moved).eps
    };
    (0..at.len()).map(|particle| std::array::from_fn(|axis| along(particle, axis))).collect()
}
