//! Mistakes in reading particles, seen in the first states of all scenes.
//!
//! ```text
//! first state     px py vx vy of each particle, as the program read them
//! reading         one of them is another, its size, its negative, an integer or 0, or two are exchanged, or all lose digits or
//!                 signs: in every scene, and no other reading says as much
//! precision       all of them are single, and so is the time step by which the times count: in every scene
//! ```

use scene::Scene;
use scene::trace::State;

use super::FEW;
use super::evidence::SceneEvidence;
use super::form::{Kind, NAMES, same};
use super::judged::Outcome;
use super::restore::is_start;

/// A wrong reading of an attribute of every particle, by its place in [`NAMES`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Reading {
    /// Another attribute is read.
    As(usize, usize),
    /// Two are read each for the other.
    Exchanged(usize, usize),
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
    /// Of all, negative ones above −1 lose their sign.
    SmallUnsigned,
}

impl Reading {
    fn all() -> impl Iterator<Item = Self> {
        let places = || 0..NAMES.len();
        let pairs = places().flat_map(move |of| places().map(move |from| (of, from)));
        let others = pairs.filter(|(of, from)| of != from).flat_map(|(of, from)| {
            let both = (of < from).then_some(Self::Exchanged(of, from));
            [Self::As(of, from)].into_iter().chain(both)
        });
        let each = places()
            .flat_map(|of| [Self::Zero(of), Self::Size(of), Self::Negative(of), Self::Integer(of)]);
        others.chain(each).chain([Self::Integers, Self::SmallUnsigned])
    }

    /// The attributes as they are read.
    fn of(self, mut numbers: [f64; 4]) -> [f64; 4] {
        match self {
            Self::As(of, from) => numbers[of] = numbers[from],
            Self::Exchanged(of, from) => numbers.swap(of, from),
            Self::Zero(of) => numbers[of] = 0.0,
            Self::Size(of) => numbers[of] = numbers[of].abs(),
            Self::Negative(of) => numbers[of] = -numbers[of],
            Self::Integer(of) => numbers[of] = numbers[of].trunc(),
            Self::Integers => numbers = numbers.map(f64::trunc),
            Self::SmallUnsigned => {
                numbers = numbers.map(|value| if value > -1.0 { value.abs() } else { value });
            }
        }
        numbers
    }

    fn words(self) -> String {
        match self {
            Self::As(of, from) => format!("{} is read for {}", NAMES[from], NAMES[of]),
            Self::Exchanged(of, from) => {
                format!("{} and {} are read each for the other", NAMES[of], NAMES[from])
            }
            Self::Zero(of) => format!("{} is taken as 0", NAMES[of]),
            Self::Size(of) => format!("{} is read without its sign", NAMES[of]),
            Self::Negative(of) => format!("{} is read with the wrong sign", NAMES[of]),
            Self::Integer(of) => format!("{} is read as an integer", NAMES[of]),
            Self::Integers => "positions and velocities are read as integers".to_owned(),
            Self::SmallUnsigned => {
                "negative numbers above −1 are read without their sign".to_owned()
            }
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

/// Gives scenes the kind of failure that the first states of all show together.
pub(super) fn settle(scenes: &mut [SceneEvidence<'_>]) {
    settle_readings(scenes);
    settle_precision(scenes);
}

/// Scenes that start or count their times otherwise than they should, if all do so in single precision.
fn settle_precision(scenes: &mut [SceneEvidence<'_>]) {
    let single = |value: &f64| f64::from(*value as f32);
    let singles = |values: Vec<f64>| values.iter().map(single).collect::<Vec<f64>>();
    let counts = |scene: &SceneEvidence<'_>| matches!(scene.kind, Some(Kind::TimeStep(_)));
    let shows = |scene: &SceneEvidence<'_>| {
        counts(scene) || scene.kind.as_ref().is_none_or(Kind::shows_start)
    };
    let is_so = |scene: &SceneEvidence<'_>| {
        let inner = scene.judged.scene;
        let step = match scene.judged.outcome {
            Outcome::OtherTimes(step) => step,
            Outcome::Passed => inner.time_step,
            _ => single(&inner.time_step),
        };
        let first = scene.judged.states.first().filter(|_| shows(scene));
        same(&[step], &[single(&inner.time_step)])
            && first.is_none_or(|first| {
                same(&first.positions, &singles(inner.positions()))
                    && same(&first.velocities, &singles(inner.velocities()))
            })
    };
    let is_rounded = |scene: &&SceneEvidence<'_>| shows(scene) && !begins_right(scene);
    let is_shown = scenes.iter().filter(|scene| counts(scene)).count() >= FEW
        && scenes.iter().filter(is_rounded).count() >= FEW;
    if !is_shown || !scenes.iter().all(is_so) {
        return;
    }
    for scene in scenes.iter_mut().filter(|scene| scene.kind.is_some()) {
        if counts(scene) || is_rounded(&&*scene) {
            scene.kind = Some(Kind::ReadInSingle);
        }
    }
}

/// Whether a trace begins with the scene's own state; true where it has none.
fn begins_right(scene: &SceneEvidence<'_>) -> bool {
    let first = scene.judged.states.first();
    first.is_none_or(|first| is_start(scene.judged.scene, first))
}

/// Says what is read where that is so in all scenes of a plane, if some start otherwise than they should and go on from there.
fn settle_readings(scenes: &mut [SceneEvidence<'_>]) {
    let is_read = |scene: &SceneEvidence<'_>| {
        matches!(scene.kind, Some(Kind::InitialState | Kind::OrderRead))
    };
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
        let numbers = [[-1.5, 2.25, 3.75, -4.125], [5.5, -0.25, -0.75, 8.125]];
        let all: Vec<[[f64; 4]; 2]> =
            Reading::all().map(|one| numbers.map(|numbers| one.of(numbers))).collect();
        for (number, one) in all.iter().enumerate() {
            assert!(!all[..number].contains(one), "{one:?}");
        }
    }
}
