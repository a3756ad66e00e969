//! What is read wrongly of particles, seen in the first states of all scenes.
//!
//! ```text
//! first state     px py vx vy of each particle, as the program read them
//! reading         one of them is another, its size, its negative, an integer or 0: in every scene, and no other one says as much
//! ```

use scene::Scene;
use scene::trace::State;

use super::FEW;
use super::evidence::SceneEvidence;
use super::form::{Kind, same};

/// The attributes of a particle: position, then velocity.
const NAMES: [&str; 4] = ["px", "py", "vx", "vy"];

/// A wrong reading of an attribute of every particle, by its place in [`NAMES`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reading {
    /// Another attribute is read.
    As(usize, usize),
    /// It is not read.
    Zero(usize),
    /// The sign is lost.
    Size(usize),
    /// The sign is the other one.
    Negative(usize),
    /// It is cut to an integer.
    Integer(usize),
    /// So are all.
    Integers,
}

impl Reading {
    fn all() -> impl Iterator<Item = Self> {
        let places = || 0..NAMES.len();
        let pairs = places().flat_map(move |of| places().map(move |from| (of, from)));
        let others = pairs.filter(|(of, from)| of != from).map(|(of, from)| Self::As(of, from));
        let each = places()
            .flat_map(|of| [Self::Zero(of), Self::Size(of), Self::Negative(of), Self::Integer(of)]);
        others.chain(each).chain([Self::Integers])
    }

    /// The attributes as they are read.
    fn of(self, mut numbers: [f64; 4]) -> [f64; 4] {
        match self {
            Self::As(of, from) => numbers[of] = numbers[from],
            Self::Zero(of) => numbers[of] = 0.0,
            Self::Size(of) => numbers[of] = numbers[of].abs(),
            Self::Negative(of) => numbers[of] = -numbers[of],
            Self::Integer(of) => numbers[of] = numbers[of].trunc(),
            Self::Integers => numbers = numbers.map(f64::trunc),
        }
        numbers
    }

    fn words(self) -> String {
        match self {
            Self::As(of, from) => format!("{} is read for {}", NAMES[from], NAMES[of]),
            Self::Zero(of) => format!("{} is taken as 0", NAMES[of]),
            Self::Size(of) => format!("{} is read without its sign", NAMES[of]),
            Self::Negative(of) => format!("{} is read with the wrong sign", NAMES[of]),
            Self::Integer(of) => format!("{} is read as an integer", NAMES[of]),
            Self::Integers => "positions and velocities are read as integers".to_owned(),
        }
    }

    /// Whether a first state is what is read so of the scene.
    fn is_of(self, scene: &Scene, first: &State) -> bool {
        let [x, v] = [&first.positions, &first.velocities].map(|all| all.chunks(2));
        scene.particles.iter().zip(x.zip(v)).all(|(particle, (x, v))| {
            let ([px, py, _], [vx, vy, _]) = (particle.position, particle.velocity);
            same(&self.of([px, py, vx, vy]), &[x, v].concat())
        })
    }
}

/// Says what is read where that is so in all scenes of a plane, if some start otherwise than they should and go on from there.
pub(super) fn settle(scenes: &mut [SceneEvidence<'_>]) {
    let is_read = |scene: &SceneEvidence<'_>| scene.kind == Some(Kind::InitialState);
    let starts = scenes.iter().filter(|scene| scene.scene.dimension.count() == 2);
    let starts = starts.filter(|scene| scene.kind.as_ref().is_none_or(Kind::shows_start));
    let starts: Vec<(&Scene, &State)> = starts
        .filter_map(|scene| Some((scene.judged.scene, scene.judged.states.first()?)))
        .collect();
    if scenes.iter().filter(|scene| is_read(scene)).count() < FEW {
        return;
    }
    let mut all =
        Reading::all().filter(|one| starts.iter().all(|(scene, first)| one.is_of(scene, first)));
    let (Some(reading), None) = (all.next(), all.next()) else { return };
    let begins_right = |scene: &SceneEvidence<'_>| {
        let first = scene.judged.states.first();
        first.is_none_or(|first| {
            let (x, v) = (scene.judged.scene.positions(), scene.judged.scene.velocities());
            same(&first.positions, &x) && same(&first.velocities, &v)
        })
    };
    for scene in scenes.iter_mut() {
        let shows = scene.kind.as_ref().is_some_and(Kind::shows_start);
        if shows && scene.scene.dimension.count() == 2 && !begins_right(scene) {
            scene.kind = Some(Kind::InitialRead(reading.words()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_reading_is_told_by_the_numbers_it_gives() {
        let numbers = [[-1.5, 2.25, 3.75, -4.125], [5.5, -6.25, -7.75, 8.125]];
        let all: Vec<[[f64; 4]; 2]> =
            Reading::all().map(|one| numbers.map(|numbers| one.of(numbers))).collect();
        for (number, one) in all.iter().enumerate() {
            assert!(!all[..number].contains(one), "{one:?}");
        }
    }
}
