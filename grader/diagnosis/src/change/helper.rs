//! Slips in functions on vectors that all forces of a program share.
//!
//! ```text
//! dot a·b      length |d| = √(d·d)      direction n = d/l
//! ```

use nalgebra::Vector3;

use super::{Axes, Blocks, Coordinates, Quantity, Read, ReadAt};

/// A function on vectors with a slip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Helper {
    /// Dot products, and the lengths computed by them.
    Dot(Dot),
    /// Lengths, and the directions computed by them.
    Length(Length),
    /// Directions: `d` with other components, divided by this power of the length.
    Direction(Option<Axes>, f64, i32),
    /// The coordinates of the two particles.
    Read(Read),
    /// Where the blocks of these Jacobians are added.
    Blocks(&'static [Quantity], Blocks),
    /// The entries of these blocks.
    Entries(&'static [Quantity], Axes),
}

/// A dot product.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dot {
    /// One component alone.
    Along(usize),
    /// The product of the second components has the wrong sign.
    Minus,
    /// `a_x b_y + a_y b_x`.
    Crossed,
}

/// A length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Length {
    /// Without its root.
    Square,
    /// The sum of the sizes of the components.
    Sum,
    /// The largest of these.
    Largest,
    /// Rounded to single precision.
    Single,
    /// With a root in single precision.
    SingleRoot,
}

/// Coordinates read at a wrong index: what is read, for what.
pub(super) fn reads(has_velocity: bool) -> Vec<(Read, &'static str, String)> {
    let mut all = Vec::new();
    let mut add =
        |of: Coordinates, at: ReadAt, what, of_which| all.push((Read { of, at }, what, of_which));
    let of_number = "coordinate 2 i of particle i, and so on".to_owned();
    add(Coordinates::All, ReadAt::Number, "coordinate i", of_number);
    let of_both = [
        (Coordinates::All, "positions and velocities", true),
        (Coordinates::AllPositions, "positions", has_velocity),
        (Coordinates::AllVelocities, "velocities", has_velocity),
    ];
    for (of, names, is_there) in of_both {
        if is_there {
            add(of, ReadAt::Axis(0, 1), "x", format!("y, of {names}"));
            add(of, ReadAt::Axis(1, 0), "y", format!("x, of {names}"));
        }
    }
    let of_positions = [0, 1].map(|place| (Coordinates::Positions(place), "position", place));
    let of_velocities = [0, 1].map(|place| (Coordinates::Velocities(place), "velocity", place));
    let velocities = of_velocities.into_iter().filter(|_| has_velocity);
    for (of, name, place) in of_positions.into_iter().chain(velocities) {
        let whose = |axis: &str| format!("{axis} of the {name} of {}", ["i", "j"][place]);
        add(of, ReadAt::Axis(0, 1), "x", whose("y"));
        add(of, ReadAt::Axis(1, 0), "y", whose("x"));
        add(of, ReadAt::Next, "the number after it", whose("the last component"));
        add(of, ReadAt::Before, "the number before it", whose("x"));
        let vector = format!("the {name} of {}", ["i", "j"][place]);
        add(of, ReadAt::Scaled(0.0), "0", vector.clone());
        add(of, ReadAt::Scaled(-1.0), "its negative", vector);
        // A sum in the place of one component of the difference.
        for (axis, component) in ["x", "y"].into_iter().enumerate().filter(|_| place == 1) {
            add(of, ReadAt::Negated(axis), "its negative", whose(component));
        }
    }
    all
}

/// Every helper with a slip, in words.
pub(super) fn all() -> Vec<(Helper, &'static str)> {
    let direction = |axes, sign, power| Helper::Direction(axes, sign, power);
    vec![
        (Helper::Length(Length::Square), "lengths have no root: l is d·d"),
        (Helper::Length(Length::Sum), "lengths are sums of components: l is |d_x| + |d_y|"),
        (
            Helper::Length(Length::Largest),
            "lengths are the largest component: l is max(|d_x|, |d_y|)",
        ),
        (Helper::Length(Length::Single), "lengths are rounded to single precision"),
        (Helper::Length(Length::SingleRoot), "the roots in lengths are those of single precision"),
        (direction(None, 1.0, 0), "directions are not normalised: n is d"),
        (direction(None, 1.0, 2), "directions are divided by the length twice: n is d/l²"),
        (direction(None, -1.0, 1), "directions have the wrong sign: n is −d/l"),
        (direction(Some(Axes::Swapped), 1.0, 1), "directions have x and y swapped"),
        (direction(Some(Axes::Copied(0, 1)), 1.0, 1), "directions have x in the place of y"),
        (direction(Some(Axes::Copied(1, 0)), 1.0, 1), "directions have y in the place of x"),
        (Helper::Dot(Dot::Along(0)), "dot products, also in lengths, have the x components alone"),
        (Helper::Dot(Dot::Along(1)), "dot products, also in lengths, have the y components alone"),
        (
            Helper::Dot(Dot::Minus),
            "dot products, also in lengths, subtract the product of the y components",
        ),
        (Helper::Dot(Dot::Crossed), "dot products, also in lengths, multiply x by y components"),
    ]
}

/// `a·b`.
pub(super) fn dot(helper: Option<Helper>, a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    match helper {
        Some(Helper::Dot(Dot::Along(axis))) => a[axis] * b[axis],
        Some(Helper::Dot(Dot::Minus)) => a.dot(b) - 2.0 * a.y * b.y,
        Some(Helper::Dot(Dot::Crossed)) => a.x * b.y + a.y * b.x,
        _ => a.dot(b),
    }
}

/// `|a|`.
pub(super) fn length(helper: Option<Helper>, a: &Vector3<f64>) -> f64 {
    match helper {
        Some(Helper::Dot(_)) => dot(helper, a, a).sqrt(),
        Some(Helper::Length(Length::Square)) => a.norm_squared(),
        Some(Helper::Length(Length::Sum)) => a.abs().sum(),
        Some(Helper::Length(Length::Largest)) => a.amax(),
        Some(Helper::Length(Length::Single)) => f64::from(a.norm() as f32),
        Some(Helper::Length(Length::SingleRoot)) => f64::from((a.norm_squared() as f32).sqrt()),
        _ => a.norm(),
    }
}

/// `d/l`.
pub(super) fn direction(helper: Option<Helper>, d: Vector3<f64>, l: f64) -> Vector3<f64> {
    match helper {
        Some(Helper::Direction(axes, sign, power)) => {
            axes.map_or(d, |axes| axes.of_vector(d)) * sign / l.powi(power)
        }
        _ => d / l,
    }
}
