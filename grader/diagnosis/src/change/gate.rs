//! Elements that a force treats differently, selected by a number that each has in the file or in its state.
//!
//! ```text
//! measure  m      the number of the element, its edge, a parameter; l, l − l0, n·w; the speed of a particle, …
//! gate            c f in the place of f, for the elements with m > t, or for those with m < t
//! ```
//!
//! So a force that is left out from the tenth element on, or where a spring is shorter than `l0`, or on slow particles, is one
//! rule, and `t` is found from the steps.

use nalgebra::Vector3;
use scene::schema::ForceSchema;
use scene::{ForceElement, Scene};

/// A number that tells the elements of a force apart; of a field, its particles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// The number of the element among those of its force, from 0.
    Number,
    /// 1 where that is odd, of a field where the number of the particle is odd; otherwise 0.
    Odd,
    /// The number of elements of its force after it.
    After,
    /// Its number less that of particles.
    BeyondParticles,
    /// The number of its edge.
    Edge,
    /// The largest number of its particles.
    Highest,
    /// The smallest number of its particles.
    Lowest,
    /// `i − j`.
    Order,
    /// The number of elements of its force before it on the same particles.
    Repeated,
    /// The number of elements of its force after it on the same particles.
    Overridden,
    /// The number of its particles that are fixed.
    Fixed,
    /// The largest mass of its particles.
    Mass,
    /// A parameter: its place and name.
    Parameter(usize, &'static str),
    /// `l`.
    Length,
    /// `l` less a parameter.
    Stretch(usize, &'static str),
    /// The size of that.
    Deviation(usize, &'static str),
    /// `l` divided by a parameter.
    Ratio(usize, &'static str),
    /// `n·w`, the rate at which the length grows.
    Rate,
    /// `x_i − x_j` or `v_i − v_j` along an axis; of a field, the position or velocity.
    Along(Kind, usize),
    /// The size of that; of the velocity, the speed.
    Size(Kind),
}

/// A vector of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Of positions.
    Position,
    /// Of velocities.
    Velocity,
}

/// The elements that a measure singles out, and the factor of their force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate {
    /// The number that selects them.
    pub measure: Measure,
    /// Those above `at`; otherwise those below.
    pub above: bool,
    /// The number between them and the others.
    pub at: f64,
    /// The factor.
    pub factor: f64,
}

/// An element with the state of its particles.
pub(super) struct Measured<'a> {
    pub(super) scene: &'a Scene,
    /// Its place in the scene's list of forces; `None` for a particle with all forces on it.
    pub(super) place: Option<usize>,
    /// Its particles; of a field, one.
    pub(super) particles: &'a [usize],
    /// The position and velocity of a particle.
    pub(super) state: &'a dyn Fn(usize) -> [Vector3<f64>; 2],
}

impl Measure {
    /// Those that tell particles apart, with all forces on them.
    pub fn of_particles(axes: usize) -> Vec<Self> {
        let along =
            |axis: usize| [Kind::Position, Kind::Velocity].map(|kind| Self::Along(kind, axis));
        let plain = [Self::Size(Kind::Velocity), Self::Highest, Self::Odd, Self::Mass];
        plain.into_iter().chain((0..axes).flat_map(along)).collect()
    }

    /// Those that tell elements of a force apart, the plainest first.
    pub fn of_force(schema: &'static ForceSchema, axes: usize) -> Vec<Self> {
        let is_field = schema.stencil.is_field();
        let is_pair = schema.stencil.size() == 2;
        let mut all = vec![Self::Fixed];
        if is_pair {
            all.push(Self::Rate);
            for parameter in schema.parameters.iter().filter(|parameter| parameter.is_length) {
                let place = schema.parameter_idx(parameter.name);
                let of = [Self::Stretch, Self::Deviation, Self::Ratio];
                all.extend(of.map(|measure| measure(place, parameter.name)));
            }
            all.push(Self::Length);
            all.push(Self::Order);
        }
        if !is_field {
            all.extend([Self::Repeated, Self::Overridden, Self::Edge, Self::Highest, Self::Lowest]);
        }
        if is_field {
            all.extend([Self::Highest, Self::Size(Kind::Velocity)]);
        }
        all.extend([Self::Number, Self::After, Self::Odd, Self::BeyondParticles, Self::Mass]);
        if is_field || is_pair {
            let kinds = [Kind::Position, Kind::Velocity];
            let along = |axis: usize| kinds.map(|kind| Self::Along(kind, axis));
            all.extend((0..axes).flat_map(along));
        }
        if is_pair {
            all.push(Self::Size(Kind::Velocity));
        }
        let parameters = schema.parameters.iter().filter(|parameter| !parameter.three_dimensional);
        all.extend(parameters.map(|one| Self::Parameter(schema.parameter_idx(one.name), one.name)));
        all
    }

    /// Whether its numbers are counts.
    pub fn is_count(self) -> bool {
        use Measure::{
            After, BeyondParticles, Edge, Fixed, Highest, Lowest, Number, Odd, Order, Overridden,
            Repeated,
        };
        matches!(
            self,
            Number
                | Odd
                | After
                | BeyondParticles
                | Edge
                | Highest
                | Lowest
                | Order
                | Repeated
                | Overridden
                | Fixed
        )
    }

    /// Its number for an element; `None` where it has none.
    pub(super) fn of(self, element: &Measured<'_>) -> Option<f64> {
        let Measured { scene, place, particles, state } = element;
        let own = || place.map(|place| &scene.forces[place]);
        let count = |is_before: bool, on_same: bool| {
            let (place, own) = (place.as_ref()?, own()?);
            let all = if is_before { &scene.forces[..*place] } else { &scene.forces[place + 1..] };
            let is_like = |other: &&ForceElement| {
                let is_same = || {
                    let mut each = own.particles.iter();
                    other.particles.len() == own.particles.len()
                        && each.all(|particle| other.particles.contains(particle))
                };
                other.schema.tag == own.schema.tag && (!on_same || is_same())
            };
            Some(all.iter().filter(is_like).count() as f64)
        };
        let vector = |kind: Kind| {
            let of = |particle: usize| state(particle)[usize::from(kind == Kind::Velocity)];
            match particles {
                [i, j] => of(*i) - of(*j),
                _ => of(particles[0]),
            }
        };
        let length = || vector(Kind::Position).norm();
        let value = match self {
            Self::Number => count(true, false)?,
            Self::Odd => {
                let is_field = own().is_none_or(|own| own.particles.is_empty());
                let number = if is_field { particles[0] as f64 } else { count(true, false)? };
                number % 2.0
            }
            Self::After => count(false, false)?,
            Self::BeyondParticles => count(true, false)? - scene.particles.len() as f64,
            Self::Edge => own()?.edge? as f64,
            Self::Highest => *particles.iter().max()? as f64,
            Self::Lowest => *particles.iter().min()? as f64,
            Self::Order => particles[0] as f64 - particles[1] as f64,
            Self::Repeated => count(true, true)?,
            Self::Overridden => count(false, true)?,
            Self::Fixed => {
                particles.iter().filter(|particle| scene.particles[**particle].fixed).count() as f64
            }
            Self::Mass => {
                particles.iter().map(|particle| scene.particles[*particle].mass).fold(0.0, f64::max)
            }
            Self::Parameter(number, _) => own()?.parameters[number],
            Self::Length => length(),
            Self::Stretch(number, _) => length() - own()?.parameters[number],
            Self::Deviation(number, _) => (length() - own()?.parameters[number]).abs(),
            Self::Ratio(number, _) => length() / own()?.parameters[number],
            Self::Rate => {
                let d = vector(Kind::Position);
                d.dot(&vector(Kind::Velocity)) / d.norm()
            }
            Self::Along(kind, axis) => vector(kind)[axis],
            Self::Size(kind) => vector(kind).norm(),
        };
        value.is_finite().then_some(value)
    }
}

impl Gate {
    pub(super) fn factor_of(&self, element: &Measured<'_>) -> f64 {
        let is_in = |value: f64| if self.above { value > self.at } else { value < self.at };
        match self.measure.of(element) {
            Some(value) if is_in(value) => self.factor,
            _ => 1.0,
        }
    }

    /// The elements that it singles out, in words that follow those of what is done to them.
    pub fn words(&self, is_field: bool) -> String {
        let Self { measure, above, at, .. } = *self;
        // Of counts: the first one above, and the last one below.
        let (first, last) = (at.ceil(), at.floor());
        let number = |value: f64| value.to_string().replace('-', "−");
        let more = if above { "more" } else { "less" };
        let is_with_zero = at.abs() == TINY;
        let than = |what: &str| match above {
            true if is_with_zero => format!("where {what} is not smaller than 0"),
            false if is_with_zero => format!("where {what} is not larger than 0"),
            true => format!("where {what} is larger than {}", number(at)),
            false => format!("where {what} is smaller than {}", number(at)),
        };
        let counted = |what: &str| match (above, first) {
            (true, _) => format!("{what} {} on", number(first)),
            (false, _) => format!("{what} 0 to {}", number(last)),
        };
        let axis = |axis: usize| ["x", "y", "z"][axis];
        match measure {
            Measure::Number if above => counted("from element") + " (counted from 0)",
            Measure::Number => counted("for elements") + " (counted from 0)",
            Measure::Odd => {
                let parity = if above { "odd" } else { "even" };
                let of = if is_field { "particles" } else { "elements" };
                format!("for {of} with an {parity} number (counted from 0)")
            }
            Measure::After if above => {
                format!("for all elements but the last {} of a scene", number(first))
                    .replace("the last 1 ", "the last ")
            }
            Measure::After => format!("for the last {} elements of a scene", number(last + 1.0))
                .replace("last 1 elements", "last element"),
            Measure::BeyondParticles if above && first == 0.0 => {
                "for elements beyond as many as there are particles".to_owned()
            }
            Measure::BeyondParticles => than("the number of an element less that of particles"),
            Measure::Edge if above => counted("from edge"),
            Measure::Edge => counted("on edges"),
            Measure::Highest if is_field && above => counted("from particle"),
            Measure::Highest if is_field => counted("for particles"),
            Measure::Highest if above => counted("with particles from number"),
            Measure::Highest => counted("between particles"),
            Measure::Lowest if above => counted("between particles from number"),
            Measure::Lowest => counted("with one of the particles"),
            Measure::Order if at.abs() < 1.0 => {
                format!("where i is {} than j", if above { "larger" } else { "smaller" })
            }
            Measure::Order => than("i − j"),
            Measure::Repeated if above && first == 1.0 => {
                "where an element before acts on the same particles".to_owned()
            }
            Measure::Repeated if !above && last == 0.0 => {
                "for the first element on the same particles".to_owned()
            }
            Measure::Repeated => than("the number of earlier elements on the same particles"),
            Measure::Overridden if above && first == 1.0 => {
                "where a later element acts on the same particles".to_owned()
            }
            Measure::Overridden if !above && last == 0.0 => {
                "for the last element on the same particles".to_owned()
            }
            Measure::Overridden => than("the number of later elements on the same particles"),
            Measure::Fixed if is_field && above => "on fixed particles".to_owned(),
            Measure::Fixed if is_field => "on free particles".to_owned(),
            Measure::Fixed if above && first == 1.0 => "where one end is fixed".to_owned(),
            Measure::Fixed if !above && last == 0.0 => "between free particles".to_owned(),
            Measure::Fixed if above => "between fixed particles".to_owned(),
            Measure::Fixed => "unless all its particles are fixed".to_owned(),
            Measure::Mass if is_field => than("the mass of a particle"),
            Measure::Mass => than("the larger mass"),
            Measure::Parameter(_, name) => than(name),
            Measure::Length => match above {
                true => format!("where its particles are more than {} apart", number(at)),
                false => format!("where its particles are less than {} apart", number(at)),
            },
            Measure::Stretch(_, name) if at == 0.0 => match above {
                true => format!("where it is longer than {name}"),
                false => format!("where it is shorter than {name}"),
            },
            Measure::Stretch(_, name) if is_with_zero => match above {
                true => format!("where it is not shorter than {name}"),
                false => format!("where it is not longer than {name}"),
            },
            Measure::Stretch(_, name) => than(&format!("l − {name}")),
            Measure::Deviation(_, name) => {
                format!("where its length is {more} than {} off {name}", number(at))
            }
            Measure::Ratio(_, name) => {
                format!("where its length is {more} than {} {name}", number(at))
            }
            Measure::Rate if at == 0.0 => match above {
                true => "where its particles move apart".to_owned(),
                false => "where its particles approach each other".to_owned(),
            },
            Measure::Rate => than("the rate at which its length grows"),
            Measure::Along(kind, along) => {
                let letter = match kind {
                    Kind::Position => axis(along).to_owned(),
                    Kind::Velocity => format!("v_{}", axis(along)),
                };
                match is_field {
                    true => than(&letter),
                    false => than(&format!("{letter} of i less that of j")),
                }
            }
            Measure::Size(Kind::Velocity) if is_field => than("the speed of a particle"),
            Measure::Size(Kind::Velocity) => than("the relative speed"),
            Measure::Size(Kind::Position) => than("the distance from the origin"),
        }
    }
}

/// Rounding errors of what is compared with 0.
const TINY: f64 = 1e-12;

/// The simplest number between these, of a gate that singles out what is above or below it: 0, where 0 itself is not singled
/// out; `TINY` or its negative, where it is; or a number of few digits.
pub fn between(low: f64, high: f64, above: bool) -> f64 {
    let sign = |value: f64| if value.abs() < TINY { 0 } else { value.signum() as i32 };
    match (sign(low), sign(high), above) {
        (-1, 1, _) | (-1, 0, false) | (0, 1, true) => return 0.0,
        (0, 1, false) => return TINY,
        (-1, 0, true) => return -TINY,
        _ => {}
    }
    let is_in = |number: f64| low < number && number < high;
    let middle = 0.5 * (low + high);
    let rounded =
        |digits: usize| -> f64 { format!("{middle:.digits$e}").parse().unwrap_or(middle) };
    (0..16).map(rounded).find(|number| is_in(*number)).unwrap_or(middle)
}

#[cfg(test)]
mod tests {
    use scene::trace::State;
    use scene::{ParseOptions, xml};

    use super::super::model::{Model, Point};
    use super::super::{Change, Effect, Place, Quantity, SceneRule, Term};
    use super::*;

    /// A square with one side doubled, its springs of other lengths, and one particle fixed.
    const SQUARE: &str = r#"<scene>
  <duration time="1"/> <integrator type="explicit-euler" dt="0.1"/>
  <particle m="1" px="0" py="0" vx="0" vy="0" fixed="1"/>
  <particle m="2" px="1" py="0" vx="3" vy="4" fixed="0"/>
  <particle m="3" px="1" py="1" vx="0" vy="0" fixed="0"/>
  <edge i="0" j="1"/> <edge i="2" j="1"/> <edge i="1" j="0"/>
  <springforce edge="0" k="1" l0="0.5"/>
  <springforce edge="2" k="2" l0="1"/>
  <springforce edge="1" k="3" l0="2"/>
</scene>"#;

    fn numbers(measure: Measure) -> Vec<f64> {
        let vocabulary = simulator::vocabulary();
        let scene = xml::parse(SQUARE, "square.xml", &vocabulary, &ParseOptions::default());
        let scene = scene.expect("a scene").scene;
        let state = |particle: usize| {
            let scene::Particle { position, velocity, .. } = &scene.particles[particle];
            [Vector3::from(*position), Vector3::from(*velocity)]
        };
        let of = |place: usize| {
            let particles = &scene.forces[place].particles;
            measure.of(&Measured { scene: &scene, place: Some(place), particles, state: &state })
        };
        (0..scene.forces.len()).filter_map(of).collect()
    }

    #[test]
    fn measures_of_springs_are_those_of_the_file_and_the_state() {
        for (measure, expected) in [
            (Measure::Number, [0.0, 1.0, 2.0]),
            (Measure::Odd, [0.0, 1.0, 0.0]),
            (Measure::After, [2.0, 1.0, 0.0]),
            (Measure::BeyondParticles, [-3.0, -2.0, -1.0]),
            (Measure::Edge, [0.0, 2.0, 1.0]),
            (Measure::Highest, [1.0, 1.0, 2.0]),
            (Measure::Lowest, [0.0, 0.0, 1.0]),
            (Measure::Order, [-1.0, 1.0, 1.0]),
            (Measure::Repeated, [0.0, 1.0, 0.0]),
            (Measure::Overridden, [1.0, 0.0, 0.0]),
            (Measure::Fixed, [1.0, 1.0, 0.0]),
            (Measure::Mass, [2.0, 2.0, 3.0]),
            (Measure::Length, [1.0, 1.0, 1.0]),
            (Measure::Ratio(1, "l0"), [2.0, 1.0, 0.5]),
            (Measure::Rate, [3.0, 3.0, -4.0]),
            (Measure::Along(Kind::Position, 0), [-1.0, 1.0, 0.0]),
            (Measure::Size(Kind::Velocity), [5.0, 5.0, 5.0]),
        ] {
            assert_eq!(numbers(measure), expected, "{measure:?}");
        }
    }

    #[test]
    fn elements_of_a_scene_read_otherwise_have_their_own_places() {
        let vocabulary = simulator::vocabulary();
        let scene = xml::parse(SQUARE, "square.xml", &vocabulary, &ParseOptions::default());
        let scene = scene.expect("a scene").scene;
        let schema = vocabulary.force("gravitationalforce").expect("a force");
        let term = Term::of(schema)[0];
        let quantities: &[Quantity] = &[Quantity::ByPosition];
        let change = |effect: Effect| Change {
            place: Place::Force(term),
            words: String::new(),
            effect,
            rank: 0,
        };
        let also = SceneRule::AlsoAs("springforce", "gravitationalforce");
        let not_first = Gate { measure: Measure::Number, above: true, at: 0.5, factor: 0.0 };
        let changes = [
            change(Effect::Partly(quantities, also)),
            change(Effect::Gate(term, quantities, not_first)),
        ];
        let mut with_first = scene.clone();
        let spring = &scene.forces[0];
        let parameters = schema.values(&[("G", spring.parameter("k"))]);
        with_first.forces.push(ForceElement::new(
            schema,
            &spring.particles,
            spring.edge,
            parameters,
        ));
        let jacobian = |scene: &Scene, changes: &[Change]| {
            let model = Model::new(scene, changes);
            let State { positions, velocities, .. } = model.start();
            model.jacobian(Quantity::ByPosition, &Point::new(&positions, &velocities, 0.0))
        };
        assert_eq!(jacobian(&scene, &changes), jacobian(&with_first, &[]));
    }

    #[test]
    fn simplest_number_of_an_interval_has_the_fewest_digits() {
        for (low, high, above, expected) in [
            (-3.0, 0.2, true, 0.0),
            (1.4997, 1.5022, true, 1.5),
            (0.0081, 0.0112, false, 0.01),
            (0.123, 0.1249, false, 0.124),
            // A number that is 0 up to rounding is on either side.
            (-2e-5, -1e-17, false, 0.0),
            (-2e-5, 1e-17, true, -TINY),
            (1e-17, 2e-5, false, TINY),
            (0.0, 2e-5, true, 0.0),
        ] {
            assert_eq!(between(low, high, above), expected, "{low} to {high}, {above}");
        }
    }
}
