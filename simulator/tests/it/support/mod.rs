//! Helpers shared by the tests.

pub(crate) mod bending;
pub(crate) mod failing;
pub(crate) mod local_global;
pub(crate) mod shared;

/// The largest magnitude; a NaN if there is one.
pub(crate) fn largest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    numbers
        .into_iter()
        .fold(0.0, |largest, number| if number.abs() <= largest { largest } else { number.abs() })
}

pub(crate) fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    largest(a.iter().zip(b).map(|(a, b)| a - b))
}
