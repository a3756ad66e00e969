//! Mistakes in fast mass-spring: operations on the terms of `Q` and `b`; and its local step, rounds, pins and wind.

use diagnosis::change::Task;
use diagnosis::findings::{Feature, Part};
use scene::schema::StepEquation;
use scene::{ForceElement, Scene};

use super::super::student::{Coefficient, FastMassSpring, Vec3, wind};
use super::{
    Area, MULTIPLY_BY_H_SQUARED, Mistake, NEGATE, OMIT, OMIT_H, OMIT_QUANTITY, Operation, Place,
    SQUARE_QUANTITY, Scope, Subject, TAKE_ROOT_OF_H,
};

const NAME: &str = "fast-mass-spring";

/// A term of the equation: its places in `Q` and `b`, and what may happen to it, with the task to blame if it happens in both.
struct TermMistakes {
    /// Names of these mistakes in `Q` and `b`, in `Q` alone, in `b` alone.
    names: [&'static str; 3],
    place: usize,
    operations: &'static [(Task, Operation)],
}

static TERMS: [TermMistakes; 2] = [
    TermMistakes {
        names: [
            "fast mass-spring, springs",
            "fast mass-spring, springs in Q",
            "fast mass-spring, springs in b",
        ],
        place: 0,
        operations: &[
            (Task::System, ("missing", OMIT)),
            (Task::System, ("wrong sign", NEGATE)),
            (Task::System, ("without the stiffness", OMIT_QUANTITY)),
            (Task::System, ("times h²", MULTIPLY_BY_H_SQUARED)),
        ],
    },
    TermMistakes {
        names: [
            "fast mass-spring, inertia",
            "fast mass-spring, inertia in Q",
            "fast mass-spring, inertia in b",
        ],
        place: 1,
        operations: &[
            (Task::Masses, ("missing", OMIT)),
            (Task::Masses, ("wrong sign", NEGATE)),
            (Task::Masses, ("without the mass", OMIT_QUANTITY)),
            (Task::Masses, ("with the mass squared", SQUARE_QUANTITY)),
            (Task::System, ("over h instead of h²", TAKE_ROOT_OF_H)),
            (Task::System, ("not over h²", OMIT_H)),
        ],
    },
];

pub(super) fn mistakes() -> Vec<Mistake> {
    let mut mistakes = Vec::new();
    for TermMistakes { names, place, operations } in &TERMS {
        for (name, [in_matrix, in_right]) in
            names.iter().zip([[true, true], [true, false], [false, true]])
        {
            mistakes.extend(operations.iter().map(|(task, (description, operation))| {
                let task = match (in_matrix, in_right) {
                    (true, true) => *task,
                    (true, false) => Task::System,
                    _ => Task::Round,
                };
                subject(name, task).mistake(description, move |method| {
                    if in_matrix {
                        operation(&mut method.matrix[*place]);
                    }
                    if in_right {
                        operation(&mut method.right[*place]);
                    }
                })
            }));
        }
    }
    mistakes.extend([in_steps(), in_pins(), in_constant_force(), in_wind()].into_iter().flatten());
    mistakes
}

fn place(area: Area, name: &'static str, scope: Scope) -> Place<FastMassSpring> {
    Place { subject: Subject { area, name, scope }, of: |s| &mut s.fast_mass_spring }
}

fn subject(name: &'static str, task: Task) -> Place<FastMassSpring> {
    place(Area::Integrator, name, Scope::Within(NAME, |_| true, Feature::Task(task)))
}

fn in_steps() -> Vec<Mistake> {
    let local = subject("fast mass-spring, local step", Task::Round);
    let incidence = subject("fast mass-spring, incidence", Task::Incidence);
    let rest = subject("fast mass-spring, rest lengths", Task::RestLengths);
    let of = subject("fast mass-spring", Task::Round);
    vec![
        local.mistake("d without l0", |method| method.local = |v, _| v.normalize()),
        local.mistake("d not normalised", |method| method.local = |v, l0| l0 * v),
        local.mistake("d is the spring itself", |method| method.local = |v, _| v),
        local.mistake("wrong sign of d", |method| method.local = |v, l0| -l0 * v.normalize()),
        local.mistake("springs pull only", |method| {
            method.local = |v, l0| v.norm().min(l0) * v.normalize()
        }),
        incidence.mistake("both ends of A are 1", |method| method.incidence = [1.0; 2]),
        incidence.mistake("one end of A only", |method| method.incidence = [1.0, 0.0]),
        incidence.subject.mistake("the last row of A is missing", |s| {
            s.read = |scene| {
                let is_spring = |element: &ForceElement| element.schema.tag == "springforce";
                let last = scene.forces.iter().rposition(is_spring);
                if scene.integrator.equation == StepEquation::LocalGlobal {
                    last.map(|last| scene.forces.remove(last));
                }
            };
        }),
        rest.mistake("squared", |method| method.local = |v, l0| l0 * l0 * v.normalize()),
        rest.mistake("all 0", |method| method.local = |_, _| Vec3::zeros()),
        rest.subject.mistake("those of the first spring", |s| {
            s.read = |scene| {
                let springs = scene.forces.iter_mut();
                let springs = springs.filter(|element| element.schema.tag == "springforce");
                let mut first = None;
                if scene.integrator.equation == StepEquation::LocalGlobal {
                    for spring in springs {
                        let rest = spring.parameter_mut("l0");
                        *rest = *first.get_or_insert(*rest);
                    }
                }
            };
        }),
        of.mistake("a single round", |method| method.rounds = |_| 1),
        of.mistake("half the rounds", |method| method.rounds = |rounds| rounds / 2),
        of.mistake("a round too few", |method| method.rounds = |rounds| rounds - 1),
        of.mistake("a round too many", |method| method.rounds = |rounds| rounds + 1),
        of.mistake("starts from q + h v", |method| method.first = |q, v, h| q + h * v),
        of.mistake("y = q", |method| method.ahead = |q, _, _| q),
        of.mistake("y = q + v", |method| method.ahead = |q, v, _| q + v),
        of.mistake("y = q − h v", |method| method.ahead = |q, v, h| q - h * v),
        of.mistake("y = q + 2 h v", |method| method.ahead = |q, v, h| q + 2.0 * h * v),
        of.mistake("y = h v", |method| method.ahead = |_, v, h| h * v),
        of.mistake("damps velocities by a hundredth", |method| {
            method.ahead = |q, v, h| q + 0.99 * h * v
        }),
        of.mistake("external forces missing", |method| OMIT(&mut method.right[3])),
        of.mistake("external forces times h²", |method| {
            MULTIPLY_BY_H_SQUARED(&mut method.right[3])
        }),
        of.mistake("velocity not renewed", |method| method.velocity = |_, _, v, _| v),
        of.mistake("velocity without 1/h", |method| method.velocity = |q, p, _, _| p - q),
    ]
}

fn in_pins() -> Vec<Mistake> {
    let feature = Feature::Task(Task::Selection);
    let by_penalty =
        |scene: &Scene| scene.integrator_options.choice("pins") == "penalty" && n_pins(scene) > 0;
    let of = |has: fn(&Scene) -> bool| {
        place(Area::Fixed, "fast mass-spring, pins", Scope::Within(NAME, has, feature))
    };
    let [penalty, any, several] =
        [of(by_penalty), of(|scene| n_pins(scene) > 0), of(|scene| n_pins(scene) > 1)];
    let on_both = |method: &mut FastMassSpring, operation: fn(&mut Coefficient)| {
        operation(&mut method.matrix[2]);
        operation(&mut method.right[2]);
    };
    vec![
        penalty.mistake("not held", move |method| on_both(method, OMIT)),
        penalty.mistake("weight is 1", move |method| on_both(method, OMIT_QUANTITY)),
        penalty.mistake("held where it was a step before", |method| method.pinned_at = |_, q| q),
        penalty.mistake("missing in Q", |method| OMIT(&mut method.matrix[2])),
        penalty.mistake("missing in b", |method| OMIT(&mut method.right[2])),
        penalty.mistake("wrong sign in Q", |method| NEGATE(&mut method.matrix[2])),
        penalty.mistake("wrong sign in b", |method| NEGATE(&mut method.right[2])),
        several.subject.mistake("only the first is held", |s| {
            s.read = |scene| {
                let fixed = scene.particles.iter_mut().filter(|particle| particle.fixed);
                if scene.integrator.equation == StepEquation::LocalGlobal {
                    fixed.skip(1).for_each(|particle| particle.fixed = false);
                }
            };
        }),
        any.subject.mistake("counted from 0", |s| {
            s.read = |scene| {
                if scene.integrator.equation == StepEquation::LocalGlobal {
                    let mut fixed: Vec<bool> = scene.particles.iter().map(|p| p.fixed).collect();
                    fixed.rotate_right(1);
                    let particles = scene.particles.iter_mut().zip(fixed);
                    particles.for_each(|(particle, fixed)| particle.fixed = fixed);
                }
            };
        }),
    ]
}

fn n_pins(scene: &Scene) -> usize {
    scene.particles.iter().filter(|particle| particle.fixed).count()
}

fn in_constant_force() -> Vec<Mistake> {
    let of = under("fast mass-spring, constant force", "constantforce", |scene| {
        has(scene, "constantforce")
    });
    vec![
        of.mistake("missing", |method| method.constant_force = |_, _| Vec3::zeros()),
        of.mistake("wrong sign", |method| method.constant_force = |f, _| -f),
        of.mistake("scaled by mass", |method| method.constant_force = |f, m| m * f),
        of.mistake("y and z swapped", |method| method.constant_force = |f, _| f.xzy()),
    ]
}

fn in_wind() -> Vec<Mistake> {
    let of = under("fast mass-spring, wind", "windforce", |scene| has(scene, "windforce"));
    vec![
        of.mistake("missing", |method| method.wind = |_| Vec3::zeros()),
        of.mistake("wrong sign", |method| method.wind = |gust| -wind(gust.place + gust.time)),
        of.mistake("scaled by mass", |method| {
            method.wind = |gust| gust.mass * wind(gust.place + gust.time)
        }),
        of.mistake("the same everywhere", |method| method.wind = |gust| wind(gust.time)),
        of.mistake("where the particle started", |method| {
            method.wind = |gust| wind(gust.start + gust.time)
        }),
        of.mistake("the same at any time", |method| method.wind = |gust| wind(gust.place)),
        of.mistake("that of the end of the step", |method| {
            method.wind = |gust| wind(gust.place + gust.time + gust.h)
        }),
        of.mistake("y and z swapped", |method| {
            method.wind = |gust| wind(gust.place + gust.time).xzy()
        }),
    ]
}

fn under(
    name: &'static str,
    tag: &'static str,
    matters: fn(&Scene) -> bool,
) -> Place<FastMassSpring> {
    place(Area::Force, name, Scope::Within(NAME, matters, Feature::Force(Part::All(tag))))
}

fn has(scene: &Scene, tag: &str) -> bool {
    scene.forces.iter().any(|force| force.schema.tag == tag)
}
