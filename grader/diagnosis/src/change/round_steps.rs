//! Steps by rounds of a local and a global step, by the [rules](super::rounds) of a model.
//!
//! Shapes: `Q` is `n × n`, dense; `p`, `b`, `d` have a row of three components for each particle or spring. Cost: `O(n³)`
//! once, and `O(n²)` a round.

use nalgebra::{DMatrix, Vector3};
use scene::trace::State;
use scene::{ForceElement, Parameters};

use super::Particles;
use super::expression::Inputs;
use super::model::{Model, Point};
use super::rounds::{Count, ELASTIC, Held, Rounds, Summand, is_elastic, local};
use super::work::cost;

/// A row of `A`.
struct Spring {
    ends: [usize; 2],
    parameters: Parameters,
}

impl Model {
    /// Factorises `Q`, with all changes made.
    pub(super) fn factorise(&mut self) {
        let Some(rounds) = &self.rounds else { return };
        let mut q = DMatrix::zeros(self.scene.particles.len(), self.scene.particles.len());
        for Spring { ends, parameters } in self.springs(rounds) {
            let k = self.of_spring(rounds, 0, &parameters);
            let entries = ends.into_iter().zip(rounds.entries[0]);
            for (row, a) in entries.clone() {
                for (column, b) in entries.clone() {
                    q[(row, column)] += k * a * b;
                }
            }
        }
        let pins = self.pins(rounds);
        let pin = rounds.factor(Summand::Pins, 0);
        for particle in 0..pins.len() {
            q[(particle, particle)] += self.of_inertia(rounds, 0, particle);
            match self.weight() {
                Some(w) if pins[particle] => {
                    q[(particle, particle)] += w * pin.of(self.h, w);
                }
                // A pin that is left out of the equations.
                None if pins[particle] => {
                    q.row_mut(particle).fill(0.0);
                    q[(particle, particle)] = 1.0;
                }
                _ => {}
            }
        }
        if let Some(rounds) = &mut self.rounds {
            rounds.system = Some(q.lu());
        }
    }

    /// `w`, where a penalty holds the pins.
    fn weight(&self) -> Option<f64> {
        let options = &self.scene.integrator_options;
        (options.choice("pins") == "penalty").then(|| options.number("pin_weight"))
    }

    /// The rows of `A`: those of the hand-out, in which springs between two pins have a row as well. At their rest length,
    /// they exert nothing.
    fn springs(&self, rounds: &Rounds) -> Vec<Spring> {
        let is_row = |element: &&ForceElement| match self.weight() {
            Some(_) => element.schema.tag == ELASTIC.tag,
            None => is_elastic(&self.scene, element),
        };
        let elastic = self.scene.forces.iter().filter(is_row);
        let all: Vec<Spring> = elastic
            .filter_map(|element| {
                Some(Spring { ends: element.pair()?, parameters: element.parameters.clone() })
            })
            .collect();
        let kept = Particles::of(rounds.springs, all.len());
        let each = all.into_iter().enumerate();
        each.filter(|(row, _)| kept.contains(row)).map(|(_, spring)| spring).collect()
    }

    /// Whether `C` selects each particle.
    fn pins(&self, rounds: &Rounds) -> Vec<bool> {
        let n = self.scene.particles.len();
        let fixed = (0..n).filter(|particle| self.scene.particles[*particle].fixed);
        let fixed: Vec<usize> = fixed.collect();
        let mut selected = vec![false; n];
        for row in Particles::of(rounds.pins, fixed.len()) {
            let column = fixed[row] as isize + rounds.shift;
            selected[column.rem_euclid(n as isize) as usize] = true;
        }
        selected
    }

    /// The coefficient of a spring in `Q` or `b`.
    fn of_spring(&self, rounds: &Rounds, place: usize, parameters: &[f64]) -> f64 {
        let k = parameters[ELASTIC.schema().parameter_idx("k")];
        k * rounds.factor(Summand::Springs, place).of(self.h, k)
    }

    /// The coefficient of a particle's inertia in `Q` or `b`.
    fn of_inertia(&self, rounds: &Rounds, place: usize, particle: usize) -> f64 {
        if !Particles::of(rounds.masses, self.scene.particles.len()).contains(&particle) {
            return 0.0;
        }
        let mass = self.scene.particles[particle].mass;
        mass / (self.h * self.h) * rounds.factor(Summand::Inertia, place).of(self.h, mass)
    }

    /// Takes a step; `None` if it has no end.
    pub(super) fn make_rounds(
        &self,
        time: f64,
        earlier: Option<&State>,
        state: &mut State,
    ) -> Option<()> {
        let rounds = self.rounds.as_ref()?;
        let system = rounds.system.as_ref()?;
        let (h, n) = (self.h, self.scene.particles.len());
        let rows = |values: &[f64]| -> Vec<Vector3<f64>> {
            (0..n).map(|particle| self.vector(values, particle)).collect()
        };
        let pins = self.pins(rounds);
        let mut velocities = rows(&state.velocities);
        let before = rows(&state.positions);
        // Of a fixed particle that moves, a trace without velocities has none.
        if let Some(earlier) = earlier.map(|earlier| rows(&earlier.positions)) {
            let loose = (0..n).filter(|i| self.scene.particles[*i].fixed && !pins[*i]);
            loose.for_each(|i| velocities[i] = (before[i] - earlier[i]) / h);
        }
        let external = rows(&self.external(time, state));
        let right: Vec<Vector3<f64>> = (0..n)
            .map(|i| {
                let [a, b] = rounds.ahead;
                let y = before[i] * a + velocities[i] * (b * h.powi(rounds.ahead_h));
                let mass = self.scene.particles[i].mass;
                let force = external[i] * rounds.factor(Summand::External, 1).of(h, mass);
                let free = y * self.of_inertia(rounds, 1, i) + force;
                if !pins[i] {
                    return free;
                }
                let rest = match rounds.held {
                    Held::Prescribed => {
                        let particle = &self.scene.particles[i];
                        Vector3::from(particle.position)
                            + Vector3::from(particle.velocity) * (time + h)
                    }
                    Held::Before => before[i],
                };
                match self.weight() {
                    Some(w) => free + rest * (w * rounds.factor(Summand::Pins, 1).of(h, w)),
                    None => before[i] + velocities[i] * h,
                }
            })
            .collect();
        let springs = self.springs(rounds);
        let of_start = |i: usize| before[i] + velocities[i] * (rounds.start * h);
        let mut p: Vec<Vector3<f64>> = (0..n).map(of_start).collect();
        let tolerance = self.scene.integrator_options.number("tolerance");
        for _ in 0..self.n_rounds(rounds) {
            self.work.add(cost::FORCE * springs.len() + cost::ENTRY * n * n);
            let left = self.left(rounds, &springs, &right, (&before, &p));
            let change = system.solve(&left)?;
            for (i, p) in p.iter_mut().enumerate() {
                *p += change.row(i).transpose();
            }
            if change.amax() / h < tolerance {
                break;
            }
        }
        for i in 0..n {
            let moved = p[i] - before[i];
            for axis in 0..self.dimension {
                let dof = i * self.dimension + axis;
                state.positions[dof] = p[i][axis];
                if let (Some(factor), false) = (rounds.velocity, pins[i]) {
                    let mass = self.scene.particles[i].mass;
                    state.velocities[dof] = moved[axis] / h * factor.of(h, mass);
                }
            }
        }
        Some(())
    }

    /// `b − Q p`, with the local step at `p`.
    fn left(
        &self,
        rounds: &Rounds,
        springs: &[Spring],
        right: &[Vector3<f64>],
        (before, p): (&[Vector3<f64>], &[Vector3<f64>]),
    ) -> DMatrix<f64> {
        let (n, pins) = (p.len(), self.pins(rounds));
        let pin = rounds.factor(Summand::Pins, 0);
        let is_out = |i: usize| self.weight().is_none() && pins[i];
        let mut left: Vec<Vector3<f64>> = (0..n)
            .map(|i| match self.weight() {
                _ if is_out(i) => right[i] - p[i],
                Some(w) if pins[i] => {
                    right[i] - p[i] * (self.of_inertia(rounds, 0, i) + w * pin.of(self.h, w))
                }
                _ => right[i] - p[i] * self.of_inertia(rounds, 0, i),
            })
            .collect();
        for Spring { ends: [i, j], parameters } in springs {
            let row = |place: usize, p: &[Vector3<f64>]| {
                let [a, b] = rounds.entries[place];
                p[*i] * a + p[*j] * b
            };
            let d = self.local(rounds, parameters, row(2, p), row(2, before).norm());
            let pull = d * self.of_spring(rounds, 1, parameters);
            let stiff = row(0, p) * self.of_spring(rounds, 0, parameters);
            for (number, end) in [*i, *j].into_iter().enumerate() {
                if !is_out(end) {
                    left[end] += pull * rounds.entries[1][number];
                    left[end] -= stiff * rounds.entries[0][number];
                }
            }
        }
        DMatrix::from_fn(n, 3, |i, axis| left[i][axis])
    }

    /// `d` of a spring `v`.
    fn local(
        &self,
        rounds: &Rounds,
        parameters: &Parameters,
        v: Vector3<f64>,
        length_before: f64,
    ) -> Vector3<f64> {
        let mut parameters = parameters.clone();
        let rest = &mut parameters[ELASTIC.schema().parameter_idx("l0")];
        if rounds.lengths_before {
            *rest = length_before;
        }
        // A spring of rest length zero needs no direction.
        if *rest == 0.0 && *rounds.local == local() {
            return Vector3::zeros();
        }
        let (masses, still) = ([1.0; 2], [Vector3::zeros(); 2]);
        let (d, l, h) = (v, v.norm(), self.h);
        let (parameters, v) = (&*parameters, still);
        let at = Inputs { parameters, masses, h, d, v, l, helper: None, by_zero: 0.0 };
        rounds.local.value(&at).vector()
    }

    fn n_rounds(&self, rounds: &Rounds) -> u64 {
        let right = self.scene.integrator_options.count("iterations");
        match rounds.count {
            Count::More(more) => right.saturating_add_signed(more),
            Count::Exactly(count) => count,
            Count::Times(part) => (part * right as f64) as u64,
        }
    }

    /// `f_ext`: every term but the elastic part of springs.
    fn external(&self, time: f64, state: &State) -> Vec<f64> {
        let State { positions, velocities, .. } = state;
        let at = Point::new(positions, velocities, time);
        self.force_without(&at, Some(ELASTIC))
    }
}
