//! Probes one program in the plane or in space: measures every part and repeats no run.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::diagnosis::{self, Measured};
use super::differences::{Differences, Estimate, Offer, Sample};
use super::identify::{Experiment, Steps, Variant};
use super::judge::{
    Forces, compare_forces, failed, judge_by_mass, judge_model, no_implicit, not_judged,
};
use super::noise::CLEAR;
use super::scenes::{
    self, Elements, Group, Part, State, TIME_STEPS, companion, exciter, second_companion,
};
use super::separate::{
    Derivatives, PartMatrix, Separated, block_entries, part_matrices, part_of, separate,
};
use super::stepper::text;
use super::verdict::{Block, Entry, Finding, PartReport, Replay, Verdict};
use crate::verdict::Failure;

type Kept<T> = Vec<(Vec<Elements>, Result<T, Failure>)>;

/// Steps with these elements, and with the exciter if the particles would stay on their lines otherwise.
#[derive(Debug, Clone, PartialEq)]
struct Stepped {
    elements: Vec<Elements>,
    excited: bool,
}

impl Stepped {
    fn new(elements: &[Elements]) -> Self {
        Self { elements: elements.to_vec(), excited: false }
    }

    fn variants(&self) -> Vec<Vec<Elements>> {
        let mut variants = vec![self.elements.clone()];
        if self.excited {
            variants.push(self.elements.iter().copied().chain([exciter()]).collect());
        }
        variants
    }
}

/// All measurements so far.
pub(super) struct Session<'a> {
    offer: Offer<'a>,
    states: Vec<State>,
    forces: Kept<Forces>,
    steps: Vec<(Stepped, Result<Steps, Failure>)>,
}

impl<'a> Session<'a> {
    pub(super) fn new(offer: Offer<'a>) -> Self {
        let states = scenes::states(offer.dimension);
        Self { offer, states, forces: Vec::new(), steps: Vec::new() }
    }

    /// The reports on these parts, from parallel measurements.
    pub(super) fn reports(&mut self, parts: &[&'static Part]) -> Vec<PartReport> {
        let mut elements: Vec<[Elements; 1]> = Vec::new();
        for needed in parts.iter().flat_map(|part| [Some(part.full), part.without]).flatten() {
            if !elements.contains(&[needed]) {
                elements.push([needed]);
            }
        }
        let take = |elements: &[Elements; 1]| (elements.to_vec(), self.take_forces(elements));
        self.forces = elements.par_iter().map(take).collect();
        let mut wanted = Vec::new();
        let forces: Vec<Finding> = parts.iter().map(|part| self.judge_force(part)).collect();
        for (part, force) in parts.iter().zip(&forces) {
            if force.verdict == Verdict::NotOffered {
                continue;
            }
            let Ok((full, without)) = self.steps_of(part) else { continue };
            for stepped in [Some(full), without].into_iter().flatten() {
                let is_known = self.steps.iter().any(|(known, _)| *known == stepped);
                if !is_known && wanted.iter().all(|(known, _)| *known != stepped) {
                    let own = self.own_matrices(&stepped.elements);
                    wanted.push((stepped, own));
                }
            }
        }
        let take = |(stepped, own): (Stepped, Result<Vec<_>, Failure>)| {
            let steps = own.and_then(|own| self.take_steps(&stepped, &own));
            (stepped, steps)
        };
        let taken: Vec<_> = wanted.into_par_iter().map(take).collect();
        self.steps.extend(taken);
        parts.iter().zip(forces).map(|(part, force)| self.report(part, force)).collect()
    }

    /// The report on one part, whose force was judged.
    fn report(&mut self, part: &'static Part, force: Finding) -> PartReport {
        let mut report = PartReport {
            force: part.force,
            part: part.name,
            meaning: part.meaning,
            dimension: self.offer.dimension,
            step: Finding::only(Verdict::NotOffered, force.reason.clone()),
            blocks: Block::ALL.map(|_| Finding::only(Verdict::NotOffered, force.reason.clone())),
            force_finding: force,
            diagnosis: Vec::new(),
            replay: None,
        };
        if !matches!(report.force_finding.verdict, Verdict::NotOffered) {
            self.judge_steps(part, &mut report);
        }
        let is_wrong = |finding: &Finding| finding.verdict == Verdict::Wrong;
        if is_wrong(&report.force_finding) && is_wrong(&report.step) {
            report.step = Finding::not_measured(
                "steps are held against the program's own forces, and these are wrong",
            );
        }
        let all_well = |verdict| matches!(verdict, Verdict::Correct | Verdict::NotOffered);
        if !all_well(report.verdict()) {
            report.replay = Some(self.replay(part, &report));
        }
        report
    }

    /// Measures the force of these elements, unless it was measured before.
    fn measure_forces(&mut self, elements: &[Elements]) -> usize {
        if let Some(found) = self.forces.iter().position(|(known, _)| known == elements) {
            return found;
        }
        let forces = self.take_forces(elements);
        self.forces.push((elements.to_vec(), forces));
        self.forces.len() - 1
    }

    fn take_forces(&self, elements: &[Elements]) -> Result<Forces, Failure> {
        let centers = Group::of_unit_masses(&self.states, self.offer.dimension);
        let (differences, by_mass) = self.offer.differences(elements, &centers, &self.groups())?;
        Ok(Forces { differences, by_mass })
    }

    /// Every state with every combination of masses.
    fn groups(&self) -> Vec<Group> {
        Group::of_all_masses(&self.states, self.offer.dimension)
    }

    /// Takes these steps, unless they were taken before.
    fn measure_steps(&mut self, stepped: &Stepped) -> usize {
        if let Some(found) = self.steps.iter().position(|(known, _)| known == stepped) {
            return found;
        }
        let own = self.own_matrices(&stepped.elements);
        let steps = own.and_then(|own| self.take_steps(stepped, &own));
        self.steps.push((stepped.clone(), steps));
        self.steps.len() - 1
    }

    fn take_steps(&self, stepped: &Stepped, own: &[Vec<DMatrix<f64>>]) -> Result<Steps, Failure> {
        let implicit = self.offer.implicit.ok_or_else(no_implicit)?;
        let variant = |elements: Vec<Elements>| {
            let known = self.forces.iter().find(|(known, _)| *known == elements);
            let forces = match known {
                Some((_, Ok(forces))) => forces.by_mass.clone(),
                _ => self.offer.samples(&elements, &self.groups())?,
            };
            Ok(Variant { elements, forces })
        };
        let variants: Result<Vec<_>, Failure> =
            stepped.variants().into_iter().map(variant).collect();
        Steps::take(self.offer, implicit, &variants?, &self.states, own)
    }

    /// The expected matrix of a step, from the program's own force, by state and time step.
    fn own_matrices(&mut self, elements: &[Elements]) -> Result<Vec<Vec<DMatrix<f64>>>, Failure> {
        let size = self.offer.size();
        let zeros = || vec![DMatrix::zeros(size, size); TIME_STEPS.len()];
        let mut matrices: Vec<Vec<DMatrix<f64>>> = self.states.iter().map(|_| zeros()).collect();
        for element in elements {
            let index = self.measure_forces(&[*element]);
            let forces = self.forces[index].1.as_ref().map_err(Clone::clone)?;
            for (of_state, differences) in matrices.iter_mut().zip(&forces.differences) {
                let [by_x, by_v] = [&differences.by_position, &differences.by_velocity];
                for (matrix, h) in of_state.iter_mut().zip(TIME_STEPS) {
                    *matrix += &by_x.value * (h * h) + &by_v.value * h;
                }
            }
        }
        Ok(matrices)
    }

    /// Adds the exciter if a wrong Jacobian keeps the particles on their lines.
    fn excite(&mut self, full: &mut Stepped, without: &mut Option<Stepped>) {
        let mut all: Vec<&mut Stepped> = vec![full];
        all.extend(without);
        let is_partial = |stepped: &&mut Stepped| {
            let steps = self.measure_steps(stepped);
            self.steps[steps].1.as_ref().is_ok_and(Steps::is_partial)
        };
        if all.iter().any(is_partial) && self.has_force(exciter()) {
            for stepped in all {
                stepped.excited = !stepped.elements.contains(&exciter());
            }
        }
    }

    fn judge_force(&mut self, part: &Part) -> Finding {
        let full = self.measure_forces(&[part.full]);
        let without = part.without.map(|without| self.measure_forces(&[without]));
        let full = match &self.forces[full].1 {
            Ok(forces) => forces,
            Err(failure) => return failed(failure),
        };
        let without = match without.map(|index| &self.forces[index].1) {
            None => None,
            Some(Ok(forces)) => Some(forces),
            Some(Err(failure)) => {
                let reason = format!("the force cannot be measured without this part: {failure}");
                return Finding::only(Verdict::Inconclusive, reason);
            }
        };
        compare_forces(full, without, &self.states, self.offer.dimension.count())
    }

    fn judge_steps(&mut self, part: &Part, report: &mut PartReport) {
        let (mut full, mut without) = match self.steps_of(part) {
            Ok(elements) => elements,
            Err(finding) => {
                not_judged(report, &finding);
                report.step = *finding;
                return;
            }
        };
        self.excite(&mut full, &mut without);
        let full_steps = self.measure_steps(&full);
        let without_steps = without.as_ref().map(|without| self.measure_steps(without));
        let full_steps = match &self.steps[full_steps].1 {
            Ok(steps) => steps,
            Err(failure) => {
                // A solver that diverges on these scenes says nothing of the forces.
                report.step = match failed(failure) {
                    finding if finding.verdict == Verdict::Wrong => {
                        Finding::not_measured(&failure.to_string())
                    }
                    finding => finding,
                };
                return not_judged(report, &report.step.clone());
            }
        };
        let without_steps = match without_steps.map(|index| &self.steps[index].1) {
            None => None,
            Some(Ok(steps)) if steps.is_explained() => Some(steps),
            Some(Ok(_)) => {
                let reason = "no matrix explains the steps without this part";
                report.step = Finding::only(Verdict::Inconclusive, reason);
                return not_judged(report, &report.step.clone());
            }
            Some(Err(failure)) => {
                let reason = format!("no steps without this part: {failure}");
                report.step = Finding::only(Verdict::Inconclusive, reason);
                return not_judged(report, &report.step.clone());
            }
        };
        report.step = judge_model(full_steps);
        let Some(derivatives) = self.derivatives(part) else { return };
        if !full_steps.is_explained() {
            return self.judge_unexplained(part, &full.elements, full_steps, &derivatives, report);
        }
        let matrices = part_matrices(full_steps, without_steps);
        let count = self.offer.dimension.count();
        let separated: Vec<Separated> =
            matrices.iter().map(|of_state| separate(of_state)).collect();
        let misfit = separated.iter().map(|separated| separated.misfit).fold(0.0, f64::max);
        if misfit > CLEAR {
            let reason = "the matrix of the steps does not have the form h² K + h B";
            if report.step.verdict == Verdict::Correct {
                report.step = Finding::only(Verdict::Wrong, reason);
            }
            report.diagnosis = self.diagnose(part, &matrices, &derivatives);
            return not_judged(report, &Finding::only(Verdict::Inconclusive, reason));
        }
        let scale = |which: usize| {
            let sizes = derivatives.iter().map(|of_state| of_state.own[which].value.amax());
            let largest = sizes.fold(0.0, f64::max);
            derivatives.iter().map(|of_state| of_state.force).fold(largest, f64::max)
        };
        let is_force_wrong = report.force_finding.verdict == Verdict::Wrong;
        let mut is_of_right_force = false;
        report.blocks = Block::ALL.map(|block| {
            let which = usize::from(!block.is_by_position());
            let entries = separated.iter().zip(&derivatives).enumerate();
            let entries = entries.flat_map(|(state, (found, expected))| {
                block_entries(block, state, count, found, expected)
            });
            let entries: Vec<Entry> = entries.collect();
            let mut finding = Finding::of(entries.iter().cloned(), scale(which));
            if finding.verdict == Verdict::Wrong && is_force_wrong {
                let of_ours = entries.into_iter().map(|e| Entry { expected: e.ours, ..e });
                let right = Finding::of(of_ours, scale(which));
                if right.verdict == Verdict::Correct {
                    is_of_right_force = true;
                    let reason =
                        "the derivative of the right force; the program's force is another"
                            .to_owned();
                    finding = Finding { reason, ..right };
                }
            }
            if let Some(Entry { state, row, column: Some(column), block, .. }) = &mut finding.worst
            {
                let matrices = [
                    &separated[*state].matrices[which].value,
                    &derivatives[*state].own[which].value,
                    &derivatives[*state].ours[which],
                ];
                *block = Some(matrices.map(|matrix| part_of(matrix, row.0, column.0, count)));
            }
            finding
        });
        if full_steps.is_partial() || without_steps.is_some_and(Steps::is_partial) {
            for block in &mut report.blocks {
                let reason = match block.verdict {
                    Verdict::Wrong => {
                        "the steps do not move the particles in every direction, so the wrong block \
                         cannot be identified with certainty"
                    }
                    Verdict::Correct => {
                        block.verdict = Verdict::Inconclusive;
                        "the steps do not move the particles in every direction, so an error may not show"
                    }
                    _ => continue,
                };
                block.reason = reason.to_owned();
            }
        }
        let is_wrong = report.blocks.iter().any(|block| block.verdict == Verdict::Wrong);
        if is_wrong || is_of_right_force {
            report.diagnosis = self.diagnose(part, &matrices, &derivatives);
        }
    }

    /// Judges steps that no single matrix explains: the matrix may depend on the masses.
    fn judge_unexplained(
        &self,
        part: &Part,
        elements: &[Elements],
        steps: &Steps,
        derivatives: &[Derivatives],
        report: &mut PartReport,
    ) {
        if report.force_finding.verdict == Verdict::Wrong
            && !steps.is_loose()
            && let Ok(excess) = self.excess(elements, steps)
        {
            let (step, blocks) = judge_by_mass(excess, steps.residual_of_right);
            report.step = step;
            return not_judged(report, &blocks);
        }
        not_judged(report, &Finding::only(Verdict::Inconclusive, "no matrix explains the steps"));
        for (by_mass, reason) in BY_MASS {
            if self.is_scaled(part, steps, derivatives, by_mass) {
                report.step = Finding::only(Verdict::Correct, "");
                report.diagnosis.push(format!("the Jacobian {reason}"));
                report.blocks = Block::ALL.map(|block| {
                    let which = usize::from(!block.is_by_position());
                    let count = self.offer.dimension.count();
                    let shows =
                        derivatives.iter().any(|of_state| of_state.shows(block, which, count));
                    let verdict = if shows { Verdict::Wrong } else { Verdict::Correct };
                    Finding::only(verdict, if shows { reason } else { "" })
                });
                return;
            }
        }
    }

    /// Whether the part's Jacobian, with each row scaled by a function of the particle's mass, explains the steps.
    fn is_scaled(
        &self,
        part: &Part,
        steps: &Steps,
        derivatives: &[Derivatives],
        by_mass: fn(f64) -> f64,
    ) -> bool {
        let count = self.offer.dimension.count();
        let masses = scenes::masses(self.offer.dimension);
        let rest = part.steps == scenes::Steps::BesideSprings;
        let companion = self.forces.iter().find(|(known, _)| rest && known == &[companion()]);
        let companion = companion.and_then(|(_, forces)| forces.as_ref().ok());
        let without = part.without.map(|without| [without]);
        let base = self
            .forces
            .iter()
            .find(|(known, _)| without.as_ref().is_some_and(|without| known == without.as_slice()));
        let base = base.and_then(|(_, forces)| forces.as_ref().ok()).or(companion);
        steps.experiments.iter().enumerate().all(|(state, experiments)| {
            experiments.iter().all(|experiment| {
                let h = experiment.h;
                let [by_x, by_v] = &derivatives[state].own;
                let of_part = by_x.combine(h * h, by_v, h);
                let matrices: Vec<Estimate> = masses
                    .iter()
                    .map(|masses| {
                        let mut matrix = of_part.clone();
                        for row in 0..matrix.value.nrows() {
                            let factor = by_mass(masses[row / count]);
                            matrix.value.row_mut(row).scale_mut(factor);
                            matrix.bound.row_mut(row).scale_mut(factor);
                        }
                        match base {
                            None => matrix,
                            Some(base) => {
                                let at = &base.differences[state];
                                let other = at.by_position.combine(h * h, &at.by_velocity, h);
                                matrix.combine(1.0, &other, 1.0)
                            }
                        }
                    })
                    .collect();
                experiment.excess(&matrices) <= CLEAR
            })
        })
    }

    /// The steps that measure a part, and the steps without it.
    fn steps_of(&mut self, part: &Part) -> Result<(Stepped, Option<Stepped>), Box<Finding>> {
        if part.steps == scenes::Steps::None {
            let reason = "the force depends on the time or its Jacobians on masses: only its value is judged";
            return Err(Box::new(Finding::only(Verdict::NotOffered, reason)));
        }
        if self.offer.implicit.is_none() {
            return Err(Box::new(failed(&no_implicit())));
        }
        if part.steps == scenes::Steps::Chain {
            let without = part.without.map(|without| Stepped::new(&[without]));
            return Ok((Stepped::new(&[part.full]), without));
        }
        let mut companions = vec![companion()];
        if part.full != second_companion() {
            companions.push(second_companion());
        }
        for companion in companions {
            if self.moves(companion) {
                let full = Stepped::new(&[companion, part.full]);
                let without: Vec<Elements> = [companion].into_iter().chain(part.without).collect();
                return Ok((full, Some(Stepped::new(&without))));
            }
        }
        if part.full == second_companion() {
            return Ok((Stepped::new(&[part.full]), None));
        }
        let reason = "no other force moves the particles in every direction";
        Err(Box::new(Finding::only(Verdict::Inconclusive, reason)))
    }

    /// Whether explicit steps with these elements move anything.
    fn has_force(&mut self, elements: Elements) -> bool {
        let forces = self.measure_forces(&[elements]);
        let moves = |sample: &Sample| sample.force.iter().any(|force| *force != 0.0);
        self.forces[forces].1.as_ref().is_ok_and(|forces| forces.by_mass.iter().any(moves))
    }

    /// Whether explicit and implicit steps with these elements move anything.
    fn moves(&mut self, elements: Elements) -> bool {
        let steps = self.measure_steps(&Stepped::new(&[elements]));
        self.has_force(elements) && self.steps[steps].1.as_ref().is_ok_and(Steps::is_explained)
    }

    /// The part's own derivatives at each state.
    fn derivatives(&self, part: &Part) -> Option<Vec<Derivatives>> {
        let of = |elements: Elements| {
            let found = self.forces.iter().find(|(known, _)| known == &[elements])?;
            found.1.as_ref().ok()
        };
        let full = of(part.full)?;
        let without = match part.without {
            Some(without) => Some(of(without)?),
            None => None,
        };
        Some(derivatives_of(&full.differences, without.map(|without| &without.differences[..])))
    }

    /// Misfit of the steps and the differences at their own masses, as a multiple of the bound.
    fn excess(&self, elements: &[Elements], steps: &Steps) -> Result<f64, Failure> {
        let Some(experiments) = steps.experiments.first() else {
            return Ok(f64::INFINITY);
        };
        let centers = Group::of_all_masses(&self.states[..1], self.offer.dimension);
        let (found, _) = self.offer.differences(elements, &centers, &[])?;
        let excess = |experiment: &Experiment| {
            let h = experiment.h;
            let matrices: Vec<Estimate> =
                found.iter().map(|at| at.by_position.combine(h * h, &at.by_velocity, h)).collect();
            experiment.excess(&matrices)
        };
        Ok(experiments.iter().map(excess).fold(0.0, f64::max))
    }

    fn diagnose(
        &self,
        part: &Part,
        matrices: &[Vec<PartMatrix>],
        derivatives: &[Derivatives],
    ) -> Vec<String> {
        let starts: Vec<State> = TIME_STEPS
            .into_iter()
            .flat_map(|h| self.states.iter().map(move |state| state.before(h)))
            .collect();
        let at_start = self.derivatives_at(part, &starts);
        let mut all = Vec::new();
        for (index, derivatives) in derivatives.iter().enumerate() {
            for (step, h) in TIME_STEPS.into_iter().enumerate() {
                let PartMatrix { matrix, moved } = &matrices[index][step];
                let at_start = at_start.as_ref().map(|at| &at[step * self.states.len() + index]);
                all.push(Measured {
                    h,
                    moved,
                    count: self.offer.dimension.count(),
                    matrix,
                    own: [&derivatives.own[0], &derivatives.own[1]],
                    ours: [&derivatives.ours[0], &derivatives.ours[1]],
                    at_start: at_start.map(|at| &at.own),
                });
            }
        }
        diagnosis::diagnose(&all)
    }

    /// The part's own derivatives at other states.
    fn derivatives_at(&self, part: &Part, states: &[State]) -> Option<Vec<Derivatives>> {
        let centers = Group::of_unit_masses(states, self.offer.dimension);
        let at = |elements: Elements| {
            let found = self.offer.differences(&[elements], &centers, &[]).ok();
            found.map(|(found, _)| found)
        };
        let full = at(part.full)?;
        let without = match part.without {
            Some(without) => Some(at(without)?),
            None => None,
        };
        Some(derivatives_of(&full, without.as_deref()))
    }

    /// The scenes of the worst finding's state.
    fn replay(&self, part: &Part, report: &PartReport) -> Replay {
        let worst = report.findings().filter(|(_, finding)| finding.verdict == Verdict::Wrong);
        let entry = worst.filter_map(|(_, finding)| finding.worst.as_ref()).last();
        let state = entry.map_or(0, |entry| entry.state);
        let groups = |state: State| Group::of_all_masses(&[state], self.offer.dimension);
        let beside = part.steps == scenes::Steps::BesideSprings;
        let stepped = if beside { vec![companion(), part.full] } else { vec![part.full] };
        let Offer { dimension, explicit, implicit, .. } = self.offer;
        let at = &self.states[state];
        let force = scenes::scene(dimension, &[part.full], &groups(at.clone()), 1.0, false);
        let step = scenes::scene(dimension, &stepped, &groups(at.before(1.0)), 1.0, true);
        Replay {
            state,
            explicit: text(&force, explicit),
            implicit: implicit.map_or_else(String::new, |implicit| text(&step, implicit)),
        }
    }
}

/// The derivatives of a part at each state, from those of its force with it and without it.
fn derivatives_of(full: &[Differences], without: Option<&[Differences]>) -> Vec<Derivatives> {
    let states = full.iter().enumerate();
    let of_state = |(state, full)| Derivatives::new(full, without.map(|without| &without[state]));
    states.map(of_state).collect()
}

/// A factor of a row as a function of its particle's mass, with its description.
type Scaling = (fn(f64) -> f64, &'static str);

/// Wrong factors that depend on the mass.
const BY_MASS: [Scaling; 2] = [
    (|mass| mass, "is multiplied by the particle's mass"),
    (|mass| 1.0 / mass, "is divided by the particle's mass"),
];

/// Whether a program steps groups without forces, by this name of a method.
pub(super) fn takes(offer: Offer<'_>, spelling: &str, implicit: bool) -> Result<(), Failure> {
    let groups = Group::of_unit_masses(&scenes::states(offer.dimension), offer.dimension);
    let scene = scenes::scene(offer.dimension, &[], &groups, 1.0, implicit);
    offer.stepper.step(&scene, spelling).map(|_| ())
}
