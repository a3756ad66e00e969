//! The smallest scene that fails by the same cause.
//!
//! ```text
//! steps ── particles ── forces ── parts ── flags ── numbers        again while one of them makes the scene smaller
//! ```
//!
//! Each reduction of a scene is a scene, whose motion and tolerances are measured anew. It is kept if the program still fails in
//! it, in the same way and by the same cause. Particles and elements are left out in halves, then quarters, down to single ones
//! (delta debugging: Zeller and Hildebrandt, IEEE TSE 2002). A long run is restarted from the right state before its first wrong
//! step. Unlike the choices of a drawn scene, a scene of the suite can be reduced too.
//!
//! Cost: one run of the program for each reduction, as many at a time as there are threads.

use std::time::{Duration, Instant};

use rayon::prelude::*;
use scene::schema::{IntegratorOptions, Stencil};
use scene::{Dimension, ForceElement, Particle, Rendering, Scene};
use simulator::integrator;

use crate::judge::Wrong;

/// How much shrinking may cost.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// The most runs of the program.
    pub runs: usize,
    /// The longest time.
    pub time: Duration,
}

impl Default for Effort {
    fn default() -> Self {
        Self { runs: 1500, time: Duration::from_secs(30) }
    }
}

/// The result of shrinking.
#[derive(Debug, Clone)]
pub struct Shrunk {
    /// The smallest scene that was found.
    pub scene: Scene,
    /// The failure in it.
    pub wrong: Wrong,
    /// The runs that it took.
    pub runs: usize,
}

/// A judge of reductions: the failure, if it is the same.
pub type Fails<'a> = dyn Fn(&Scene) -> Option<Wrong> + Sync + 'a;

/// Shrinks a scene in which a program fails.
pub fn shrink(scene: &Scene, wrong: &Wrong, fails: &Fails<'_>, effort: Effort) -> Shrunk {
    let start = Shrunk { scene: scene.clone(), wrong: wrong.clone(), runs: 0 };
    let mut shrinker = Shrinker { best: start, fails, effort, start: Instant::now() };
    shrinker.run();
    shrinker.best
}

struct Shrinker<'a> {
    best: Shrunk,
    fails: &'a Fails<'a>,
    effort: Effort,
    start: Instant,
}

impl Shrinker<'_> {
    fn run(&mut self) {
        self.first_of(vec![without_looks(&self.best.scene)]);
        loop {
            let before = measure(&self.best.scene);
            self.steps();
            self.leave_out(|scene| scene.particles.len(), without_particles);
            self.leave_out(|scene| scene.forces.len(), without_forces);
            self.leave_out(|scene| scene.edges.len(), without_edges);
            while self.first_of(plainer(&self.best.scene)) {}
            self.numbers();
            if measure(&self.best.scene) >= before || self.is_spent() {
                break;
            }
        }
    }

    fn is_spent(&self) -> bool {
        self.best.runs >= self.effort.runs || self.start.elapsed() >= self.effort.time
    }

    /// Takes the first of these scenes that fails; false if none does.
    fn first_of(&mut self, scenes: Vec<Scene>) -> bool {
        for some in scenes.chunks(rayon::current_num_threads().max(1)) {
            if self.is_spent() {
                return false;
            }
            self.best.runs += some.len();
            let failed = some.par_iter().find_map_first(|scene| {
                let wrong = (self.fails)(scene)?;
                Some((scene.clone(), wrong))
            });
            if let Some((scene, wrong)) = failed {
                (self.best.scene, self.best.wrong) = (scene, wrong);
                return true;
            }
        }
        false
    }

    /// Fewer steps: up to the first wrong one, or that one alone, from the right state before it.
    fn steps(&mut self) {
        loop {
            let Shrunk { scene, wrong, .. } = &self.best;
            let (count, first) = (scene.n_steps(), wrong.first_step().max(1));
            let mut fewer: Vec<Scene> = Vec::new();
            // A two-step method needs a step before it.
            for steps in [1, 2] {
                let before = first.checked_sub(steps).filter(|before| *before > 0);
                let before = before.and_then(|before| wrong.expected.get(before as usize));
                if let Some(state) = before {
                    fewer.push(with_steps(&from_state(scene, state), steps));
                }
            }
            let shorter = [1, 2, first, count / 2, count.saturating_sub(1)];
            fewer.extend(shorter.map(|steps| with_steps(scene, steps)));
            fewer.retain(|other| (1..count).contains(&other.n_steps()));
            if !self.first_of(fewer) {
                return;
            }
        }
    }

    /// Leaves out things of a kind: halves, then quarters, down to single ones.
    fn leave_out(
        &mut self,
        count: fn(&Scene) -> usize,
        without: fn(&Scene, &dyn Fn(usize) -> bool) -> Scene,
    ) {
        let mut size = count(&self.best.scene).div_ceil(2);
        while size > 0 {
            let all = count(&self.best.scene);
            let starts = (0..all).step_by(size).rev();
            let reduced = starts.map(|start| {
                without(&self.best.scene, &|number| (start..start + size).contains(&number))
            });
            if !self.first_of(reduced.collect()) {
                size = if size == 1 { 0 } else { size.div_ceil(2) };
            }
        }
    }

    /// Simpler numbers: several at once, then one after the other.
    fn numbers(&mut self) {
        let count = numbers_of(&mut self.best.scene.clone()).len();
        let all = |digits: usize| {
            let mut scene = self.best.scene.clone();
            numbers_of(&mut scene).into_iter().for_each(|value| *value = rounded(*value, digits));
            rescheduled(scene, &self.best.scene)
        };
        self.first_of(vec![all(1), all(2), all(3)]);
        for place in 0..count {
            let with = |value: f64| {
                let mut scene = self.best.scene.clone();
                *numbers_of(&mut scene)[place] = value;
                rescheduled(scene, &self.best.scene)
            };
            let value = *numbers_of(&mut self.best.scene.clone())[place];
            let sign = if value < 0.0 { -1.0 } else { 1.0 };
            let simpler = [
                0.0,
                1.0,
                2.0 * sign,
                0.5 * sign,
                rounded(value, 1),
                rounded(value, 2),
                rounded(value, 3),
            ];
            let simpler = simpler.into_iter().filter(|other| length(*other) < length(value));
            self.first_of(simpler.map(with).collect());
        }
    }
}

/// How large a scene is: particles, forces, steps, edges, then things that need not be there, then digits.
pub fn measure(scene: &Scene) -> [usize; 6] {
    let mut copy = scene.clone();
    let digits = numbers_of(&mut copy).into_iter().map(|value| length(*value)).sum();
    let flags = scene.particles.iter().filter(|particle| particle.fixed).count()
        + usize::from(scene.dimension == Dimension::Three);
    let steps = scene.n_steps() as usize;
    [scene.particles.len(), scene.forces.len(), steps, scene.edges.len(), flags, digits]
}

/// The length of a number: 0 is shortest, then 1.
fn length(value: f64) -> usize {
    if value == 0.0 {
        0
    } else if value == 1.0 {
        1
    } else {
        1 + value.abs().to_string().len() + usize::from(value < 0.0)
    }
}

fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

/// All numbers of a scene that may become simpler: the time step first.
fn numbers_of(scene: &mut Scene) -> Vec<&mut f64> {
    let axes = scene.dimension.count();
    let mut all = vec![&mut scene.time_step];
    for particle in &mut scene.particles {
        let Particle { mass, position, velocity, .. } = particle;
        all.extend(velocity[..axes].iter_mut().chain(&mut position[..axes]));
        all.push(mass);
    }
    for element in &mut scene.forces {
        let is_there = |three_dimensional: bool| axes == 3 || !three_dimensional;
        let parameters = element.schema.parameters.iter().zip(&mut element.parameters);
        let there = parameters.filter(|(schema, _)| is_there(schema.three_dimensional));
        all.extend(there.map(|(_, value)| value));
    }
    all
}

/// A scene with another time step, and as many steps as before.
fn rescheduled(mut scene: Scene, before: &Scene) -> Scene {
    if scene.time_step != before.time_step {
        let share = before.duration / before.time_step;
        scene.duration = share * scene.time_step;
        if share.fract() == 0.0 {
            scene = with_steps(&scene, share as u64);
        }
    }
    scene
}

/// The scene with so many steps; of one whose last step is cut, the last is.
fn with_steps(scene: &Scene, steps: u64) -> Scene {
    let share = (scene.duration / scene.time_step).fract();
    let wanted = if share == 0.0 { steps as f64 } else { steps as f64 - 1.0 + share };
    let mut duration = wanted * scene.time_step;
    for _ in 0..4 {
        let found = duration / scene.time_step;
        if share != 0.0 || found == wanted {
            break;
        }
        duration = if found > wanted { duration.next_down() } else { duration.next_up() };
    }
    Scene { duration, ..scene.clone() }
}

/// The scene from this state on.
fn from_state(scene: &Scene, state: &scene::trace::State) -> Scene {
    let axes = scene.dimension.count();
    let mut other = scene.clone();
    let states = state.positions.chunks(axes).zip(state.velocities.chunks(axes));
    for (particle, (position, velocity)) in other.particles.iter_mut().zip(states) {
        particle.position[..axes].copy_from_slice(position);
        particle.velocity[..axes].copy_from_slice(velocity);
    }
    other
}

fn without_looks(scene: &Scene) -> Scene {
    let mut other = scene.clone();
    (other.description, other.tag, other.max_simulation_frequency) = (None, None, None);
    other.rendering = Rendering::default();
    for particle in &mut other.particles {
        (particle.radius, particle.tag) = (scene::PARTICLE_RADIUS, None);
    }
    other.edges.iter_mut().for_each(|edge| edge.radius = scene::EDGE_RADIUS);
    other
}

/// The scene without these particles, and without the elements and edges that need them.
fn without_particles(scene: &Scene, is_out: &dyn Fn(usize) -> bool) -> Scene {
    let kept: Vec<usize> = (0..scene.particles.len()).filter(|number| !is_out(*number)).collect();
    let place = |number: &usize| kept.iter().position(|kept| kept == number);
    let mut other = scene.clone();
    other.particles = kept.iter().map(|number| scene.particles[*number].clone()).collect();
    other.forces.retain(|element| element.particles.iter().all(|number| place(number).is_some()));
    for number in other.forces.iter_mut().flat_map(|element| &mut element.particles) {
        *number = place(number).unwrap_or(0);
    }
    let gone = |number: usize| scene.edges[number].particles.iter().any(|end| place(end).is_none());
    let mut other = without_edges(&other, &gone);
    for end in other.edges.iter_mut().flat_map(|edge| &mut edge.particles) {
        *end = place(end).unwrap_or(0);
    }
    other
}

fn without_forces(scene: &Scene, is_out: &dyn Fn(usize) -> bool) -> Scene {
    let mut number = 0;
    let mut other = scene.clone();
    other.forces.retain(|_| {
        number += 1;
        !is_out(number - 1)
    });
    other
}

/// The scene without these edges, and without the elements on them.
fn without_edges(scene: &Scene, is_out: &dyn Fn(usize) -> bool) -> Scene {
    let kept: Vec<usize> = (0..scene.edges.len()).filter(|number| !is_out(*number)).collect();
    let mut other = scene.clone();
    other.edges = kept.iter().map(|number| scene.edges[*number].clone()).collect();
    other.forces.retain(|element| {
        element.schema.stencil != Stencil::Edge
            || element.edge.is_some_and(|edge| kept.contains(&edge))
    });
    for edge in other.forces.iter_mut().filter_map(|element| element.edge.as_mut()) {
        *edge = kept.iter().position(|kept| kept == edge).unwrap_or(0);
    }
    other
}

/// Scenes with one thing less: the third dimension, options, a cut last step, a later integrator of the registry, a place away
/// from the origin, motion, fixed particles, masses, parts of forces.
fn plainer(scene: &Scene) -> Vec<Scene> {
    let mut all = Vec::new();
    let mut push = |change: &dyn Fn(&mut Scene)| {
        let mut other = scene.clone();
        change(&mut other);
        if other != *scene {
            all.push(other);
        }
    };
    let exists = |element: &ForceElement| element.schema.exists_in(Dimension::Two);
    if scene.dimension == Dimension::Three && scene.forces.iter().all(exists) {
        push(&|other| {
            other.dimension = Dimension::Two;
            for particle in &mut other.particles {
                (particle.position[2], particle.velocity[2]) = (0.0, 0.0);
            }
            for element in &mut other.forces {
                let parameters = element.schema.parameters.iter().zip(&mut element.parameters);
                for (schema, value) in parameters.filter(|(schema, _)| schema.three_dimensional) {
                    *value = schema.default.unwrap_or(0.0);
                }
            }
        });
    }
    push(&|other| {
        other.integrator_options = IntegratorOptions::defaults(other.integrator);
    });
    let steps = scene.n_steps() as f64;
    if scene.duration / scene.time_step != steps {
        push(&|other| other.duration = steps * other.time_step);
        if length((steps - 0.5) * scene.time_step) < length(scene.duration) {
            push(&|other| other.duration = (steps - 0.5) * other.time_step);
        }
    }
    for kind in integrator::REGISTRY.iter().take_while(|kind| kind.schema != *scene.integrator) {
        push(&|other| {
            other.integrator = &kind.schema;
            other.integrator_options = IntegratorOptions::defaults(other.integrator);
        });
    }
    for axis in 0..scene.dimension.count() {
        let first = scene.particles.first().map_or(0.0, |particle| particle.position[axis]);
        push(&|other| {
            for particle in &mut other.particles {
                particle.position[axis] -= first;
            }
        });
    }
    push(&|other| other.particles.iter_mut().for_each(|particle| particle.velocity = [0.0; 3]));
    push(&|other| other.particles.iter_mut().for_each(|particle| particle.fixed = false));
    push(&|other| other.particles.iter_mut().for_each(|particle| particle.mass = 1.0));
    for number in 0..scene.particles.len() {
        push(&|other| other.particles[number].fixed = false);
    }
    for (number, element) in scene.forces.iter().enumerate() {
        for part in element.schema.parts {
            push(&|other| other.forces[number].remove_part(part));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use grader::compare::Comparison;
    use grader::compare::calibration::Envelope;
    use grader::verdict::{Failure, Verdict};

    use super::*;
    use crate::choices::Choices;
    use crate::draw::{Scope, draw, plain, read};

    fn wrong() -> Wrong {
        Wrong {
            failure: Failure::Differs,
            comparison: Comparison::without_states(Verdict::Fail(Failure::Differs)),
            states: Vec::new(),
            expected: Vec::new(),
            envelope: Envelope::zero(),
        }
    }

    #[test]
    fn shrinks_to_the_one_element_that_matters() {
        let has_damping = |scene: &Scene| {
            let mut springs = scene.forces.iter().filter(|force| force.schema.tag == "springforce");
            scene.n_steps() > 0 && springs.any(|spring| spring.parameter("b") > 0.1)
        };
        let mut shrunk = 0;
        for seed in 0..400 {
            let Some(drawn) = draw(&Scope::all(), Choices::random(seed)) else { continue };
            if !has_damping(&drawn.scene) {
                continue;
            }
            shrunk += 1;
            let fails = |scene: &Scene| {
                let text = plain(scene)?;
                let same = read(&text)?;
                assert_eq!(same.n_steps(), scene.n_steps(), "{text}");
                has_damping(scene).then(wrong)
            };
            let found = shrink(&drawn.scene, &wrong(), &fails, Effort::default());
            assert_eq!(measure(&found.scene)[..4], [2, 1, 1, 1], "{:?}", found.scene);
            assert_eq!(found.scene.forces[0].parameter("k"), 0.0);
            assert_eq!(found.scene.forces[0].parameter("b"), 1.0);
        }
        assert!(shrunk > 10);
    }
}
