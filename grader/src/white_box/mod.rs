//! Verification of the Jacobians of forces, block by block and as a whole.
//!
//! For every registered force, in two and three dimensions, at random states and at deliberately hard ones, each entry
//! of `∂F/∂x` and `∂F/∂v` is compared with three estimates:
//!
//! ```text
//! differences    (F(z+h) − F(z−h)) / 2h, extrapolated to h = 0, with an uncertainty (jacobian::ridders)
//! dual numbers   an independent implementation of the law, F(z + ε e) = F(z) + ε J e (reference::law)
//! Taylor         |F(z+te) − F(z) − t J e| falls as t² or as t (jacobian::taylor)
//! ```
//!
//! and judged correct, wrong or inconclusive ([`Verdict`]). Two further checks cover properties of the whole
//! ([`Property`]) and the Newton systems of the implicit methods ([`NewtonCheck`]). Cost: some ten thousand evaluations
//! of the force for each state; all forces together take a twentieth of a second on two cores.

mod check;
mod curves;
mod newton;
mod states;
mod structure;
mod subject;
mod tally;
mod verdict;

use nalgebra::DMatrix;
use rayon::prelude::*;
use reference::law::{self, Law};
use scene::Dimension;
use simulator::force::{self, Block, ElementJacobians, ForceKind};
use simulator::solver::psd::Projection;

pub use curves::{Curves, curves};
pub use jacobian::ridders::{Difference, Estimate};
pub use jacobian::taylor::{Taylor, Window};
pub use jacobian::verdict::{Entry, Reason, Verdict};
pub use newton::NewtonCheck;
pub use states::{CheckState, Given, states, states_given};
pub use subject::{Maker, Subject, simulated, simulated_of_kinds};
pub use verdict::{BlockFinding, BlockKind, By, Exhibit, Part, Property, PropertyFinding};

use structure::{Project, Structure};
use tally::Tally;

/// Settings of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Config {
    /// Number of random states for each force and dimension, in addition to the hard ones.
    pub states: u32,
    /// Seed of the random states.
    pub seed: u64,
}

impl Default for Config {
    fn default() -> Self {
        Self { states: 16, seed: 1 }
    }
}

/// The results of all checks.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JacobianReport {
    /// One entry for each force and dimension.
    pub forces: Vec<JacobianCheck>,
    /// One entry for each implicit method and scene.
    pub newton: Vec<NewtonCheck>,
}

impl JacobianReport {
    /// Whether nothing was checked.
    pub fn is_empty(&self) -> bool {
        self.forces.is_empty()
    }

    /// Whether everything is correct.
    pub fn is_pass(&self) -> bool {
        self.verdicts().all(Verdict::is_correct)
    }

    /// Every verdict.
    pub fn verdicts(&self) -> impl Iterator<Item = Verdict> {
        let of_forces = self.forces.iter().flat_map(JacobianCheck::verdicts);
        of_forces.chain(self.newton.iter().map(|check| check.verdict))
    }

    /// Number of correct verdicts, and number of all applicable ones.
    pub fn counts(&self) -> (usize, usize) {
        let asked = || self.verdicts().filter(|verdict| *verdict != Verdict::NotApplicable);
        (asked().filter(|verdict| verdict.is_correct()).count(), asked().count())
    }
}

/// The results for one force in the plane or in space.
#[derive(Debug, Clone, PartialEq)]
pub struct JacobianCheck {
    /// The force's tag.
    pub tag: &'static str,
    /// Two or three dimensions.
    pub dimension: Dimension,
    /// Number of states checked.
    pub states: usize,
    /// Each kind of block, in the order of [`BlockKind::ALL`].
    pub blocks: Vec<BlockFinding>,
    /// Each property, in the order of [`Property::ALL`].
    pub properties: Vec<PropertyFinding>,
}

impl JacobianCheck {
    /// Whether everything is correct.
    pub fn is_pass(&self) -> bool {
        self.verdicts().all(Verdict::is_correct)
    }

    /// Whether something is wrong.
    pub fn is_wrong(&self) -> bool {
        self.verdicts().any(|verdict| verdict == Verdict::Wrong)
    }

    /// Every verdict: blocks, then properties.
    pub fn verdicts(&self) -> impl Iterator<Item = Verdict> {
        let properties = self.properties.iter().map(|finding| finding.verdict);
        self.blocks.iter().map(|finding| finding.verdict).chain(properties)
    }
}

/// Checks every registered force, and the Newton systems.
pub fn check_all(config: Config) -> JacobianReport {
    JacobianReport { forces: check_forces(config, |_| true), newton: newton::check_all() }
}

/// Checks every registered force whose tag `select` accepts, in parallel.
pub fn check_forces(config: Config, select: impl Fn(&str) -> bool) -> Vec<JacobianCheck> {
    let kinds = force::REGISTRY.iter().copied().filter(|kind| select(kind.schema.tag));
    let both = |kind| [(kind, Dimension::Two), (kind, Dimension::Three)];
    let jobs = kinds.flat_map(both).filter(|(kind, dimension)| kind.schema.exists_in(*dimension));
    let jobs: Vec<(&'static ForceKind, Dimension)> = jobs.collect();
    jobs.into_par_iter()
        .filter_map(|(kind, dimension)| check(kind, dimension, config, &simulated))
        .collect()
}

/// Checks the subjects that `make` creates for the states of `kind`; `None` for a force without a law.
pub fn check(
    kind: &'static ForceKind,
    dimension: Dimension,
    config: Config,
    make: &Maker<'_>,
) -> Option<JacobianCheck> {
    Some(check_against(kind, law::find(kind.schema.tag)?, dimension, config, make))
}

/// The same of one element of which something is given.
pub fn check_given(
    kind: &'static ForceKind,
    dimension: Dimension,
    config: Config,
    given: &Given,
    make: &Maker<'_>,
) -> Option<JacobianCheck> {
    let states = states_given(kind, dimension, config.states, config.seed, given);
    Some(check_with(kind, law::find(kind.schema.tag)?, dimension, &states, make, &clamp))
}

/// The same against a given law.
pub fn check_against(
    kind: &'static ForceKind,
    law: &'static Law,
    dimension: Dimension,
    config: Config,
    make: &Maker<'_>,
) -> JacobianCheck {
    let states = states(kind, dimension, config.states, config.seed);
    check_with(kind, law, dimension, &states, make, &clamp)
}

fn check_with(
    kind: &'static ForceKind,
    law: &'static Law,
    dimension: Dimension,
    states: &[CheckState],
    make: &Maker<'_>,
    project: Project<'_>,
) -> JacobianCheck {
    let mut tallies = Tally::all(&kind.schema, states);
    let mut structure = Structure::new(law, project);
    let subjects: Vec<_> = states.iter().map(|state| make(&state.scene)).collect();
    let mut both = states.iter().zip(&subjects);
    let is_the_laws =
        both.all(|(state, subject)| check::has_the_laws_force(subject.as_ref(), state, law));
    for (state, subject) in states.iter().zip(&subjects) {
        match check::observe(subject.as_ref(), state, law, is_the_laws) {
            Some(observation) => {
                tallies.iter_mut().for_each(|tally| tally.add(state, &observation))
            }
            None => tallies.iter_mut().for_each(Tally::add_degenerate),
        }
        structure.add(subject.as_ref(), state);
    }
    JacobianCheck {
        tag: kind.schema.tag,
        dimension,
        states: states.len(),
        blocks: tallies.map(Tally::finish).into(),
        properties: structure.finish(),
    }
}

/// The projection of `projected-newton`, of the Hessian of one element by the positions of its particles.
fn clamp(hessian: &DMatrix<f64>, dimension: usize) -> DMatrix<f64> {
    match dimension {
        2 => clamp_in::<2>(hessian),
        _ => clamp_in::<3>(hessian),
    }
}

fn clamp_in<const D: usize>(hessian: &DMatrix<f64>) -> DMatrix<f64> {
    // The last particle is the origin of the local coordinates.
    let m = hessian.nrows() / D - 1;
    let block = |place: usize| {
        let (row, column) = (place / m * D, place % m * D);
        Block::<D>::from_fn(|i, j| hessian[(row + i, column + j)])
    };
    let mut blocks: Vec<Block<D>> = (0..m * m).map(block).collect();
    Projection::Clamp.project_element(&mut blocks, true, &mut Vec::new());
    let particles: Vec<usize> = (0..m).collect();
    let by_velocity = vec![Block::zeros(); m * m];
    let element = ElementJacobians {
        particles: &particles,
        origin: Some(m),
        by_position: &blocks,
        by_velocity: &by_velocity,
    };
    let mut projected = DMatrix::zeros(hessian.nrows(), hessian.nrows());
    element.spread(&blocks, |row, column, block| {
        projected.fixed_view_mut::<D, D>(row * D, column * D).copy_from(block);
    });
    projected
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;
    use reference::law::Term;
    use scene::schema::{ForceSchema, Vocabulary};
    use scene::{ParseOptions, Scene, xml};
    use simulator::force::{Degenerate, ElementJacobians, Force, JacobianSink, Numbered, State};
    use simulator::system::BuildForce;

    /// The reason why a force cannot be checked, if there is one: it has no law, or its example among particles
    /// in general position yields nothing to check.
    fn registry_fault(kind: &'static ForceKind) -> Option<String> {
        let tag = kind.schema.tag;
        if law::find(tag).is_none() {
            return Some(format!("{tag} has no law"));
        }
        let text = format!(
            r#"<scene><duration time="1"/><integrator type="explicit-euler" dt="0.1"/>
            <particle m="1.5" px="0.3" py="-0.7" pz="0.2" vx="0.4" vy="1.1" fixed="0"/>
            <particle m="0.8" px="1.9" py="0.6" pz="-0.1" vx="-0.9" vy="0.2" fixed="0"/>
            <particle m="1.1" px="2.2" py="-0.9" pz="0.4" vx="0.3" vy="-0.8" fixed="0"/>
            <particle m="0.6" px="0.7" py="1.4" pz="1.3" vx="0.8" vy="0.5" fixed="0"/>
            <edge i="0" j="1"/>{}</scene>"#,
            kind.schema.example
        );
        let integrators = simulator::vocabulary().integrators;
        let vocabulary = Vocabulary { forces: vec![&kind.schema], integrators };
        let scene = match xml::parse(&text, "example", &vocabulary, &ParseOptions::default()) {
            Ok(parsed) => parsed.scene,
            Err(error) => return Some(format!("{tag}: its example cannot be read: {error}")),
        };
        let elements: Vec<Numbered<'_>> = scene.forces.iter().enumerate().collect();
        let force: Box<dyn Force<3>> = kind.build(&scene, &elements);
        let state = State {
            masses: &[1.5, 0.8, 1.1, 0.6],
            positions: &[0.3, -0.7, 0.2, 1.9, 0.6, -0.1, 2.2, -0.9, 0.4, 0.7, 1.4, 1.3],
            velocities: &[0.4, 1.1, 0.0, -0.9, 0.2, 0.0, 0.3, -0.8, 0.0, 0.8, 0.5, 0.0],
            time: 0.25,
        };
        let mut values = [0.0; 12];
        let mut largest = Largest([0.0; 2]);
        let defined = force
            .add_force(state, 0..4, &mut values)
            .and_then(|()| force.add_jacobians(state, &mut largest));
        if defined.is_err() || values.iter().any(|value| !value.is_finite()) {
            return Some(format!("{tag}: its example is degenerate"));
        }
        if values.iter().all(|value| *value == 0.0) {
            return Some(format!("{tag}: its example exerts no force"));
        }
        let shows = [kind.schema.depends_on().position, kind.schema.depends_on().velocity];
        // An example need not have damping, but one that depends on nothing at all cannot be checked.
        let Largest([by_position, by_velocity]) = largest;
        let hidden = shows.iter().any(|shows| *shows) && by_position == 0.0 && by_velocity == 0.0;
        hidden.then(|| format!("{tag}: the Jacobians of its example are zero"))
    }

    /// The largest entry by position and by velocity.
    struct Largest([f64; 2]);

    impl JacobianSink<3> for Largest {
        fn add(&mut self, element: ElementJacobians<'_, 3>) {
            for (largest, blocks) in
                self.0.iter_mut().zip([element.by_position, element.by_velocity])
            {
                *largest = blocks.iter().map(|block| block.amax()).fold(*largest, f64::max);
            }
        }
    }

    #[test]
    fn every_registered_force_can_be_checked() {
        let faults: Vec<String> =
            force::REGISTRY.iter().filter_map(|kind| registry_fault(kind)).collect();
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }

    /// A force that is always zero.
    struct Idle;

    impl<const D: usize> Force<D> for Idle {
        fn energy(&self, _: State<'_>) -> Option<f64> {
            None
        }

        fn add_force(
            &self,
            _: State<'_>,
            _: Range<usize>,
            _: &mut [f64],
        ) -> Result<(), Degenerate> {
            Ok(())
        }

        fn add_jacobians(
            &self,
            _: State<'_>,
            _: &mut dyn JacobianSink<D>,
        ) -> Result<(), Degenerate> {
            Ok(())
        }

        fn couplings(&self, _: &mut dyn FnMut(force::Coupling)) {}
    }

    #[test]
    fn a_force_that_cannot_be_checked_is_reported() {
        fn idle<const D: usize>(_: &Scene, _: &[Numbered<'_>]) -> Box<dyn Force<D>> {
            Box::new(Idle)
        }
        let spring = &force::REGISTRY.iter().find(|kind| kind.schema.tag == "springforce").unwrap();
        let like_a_spring = |tag, example| ForceSchema {
            tag,
            example,
            title: spring.schema.title,
            least_dimension: spring.schema.least_dimension,
            stencil: spring.schema.stencil,
            parameters: spring.schema.parameters,
            formula: spring.schema.formula,
            derivatives: spring.schema.derivatives,
            parts: spring.schema.parts,
            masses: spring.schema.masses,
            initial: spring.schema.initial,
            ignored: spring.schema.ignored,
            conserves: spring.schema.conserves,
        };
        let fault = |schema, build_2d, build_3d| {
            registry_fault(Box::leak(Box::new(ForceKind { schema, build_2d, build_3d })))
        };
        let of_spring = |schema| fault(schema, spring.build_2d, spring.build_3d);
        assert_eq!(of_spring(like_a_spring("springforce", spring.schema.example)), None);
        let unknown = like_a_spring("rubberband", r#"<rubberband edge="0" k="1" l0="1"/>"#);
        assert_eq!(of_spring(unknown).unwrap(), "rubberband has no law");
        let slack = like_a_spring("springforce", r#"<springforce edge="0" k="0" l0="1"/>"#);
        assert!(of_spring(slack).unwrap().ends_with("exerts no force"));
        let unreadable = like_a_spring("springforce", r#"<springforce edge="3" k="1" l0="1"/>"#);
        assert!(of_spring(unreadable).unwrap().contains("cannot be read"));
        let silent = like_a_spring("springforce", spring.schema.example);
        assert!(fault(silent, idle::<2>, idle::<3>).unwrap().ends_with("exerts no force"));
    }

    #[test]
    fn parameters_show_only_where_their_law_says() {
        for kind in force::REGISTRY {
            let law = law::find(kind.schema.tag).unwrap();
            let terms = Term::of(&kind.schema);
            let mut shown = vec![[false; 2]; terms.len()];
            for state in states(kind, Dimension::Three, 4, 3) {
                let subject = simulated(&state.scene);
                let observation = check::observe(subject.as_ref(), &state, law, true).unwrap();
                for block in &observation.blocks {
                    for (shown, shows) in shown.iter_mut().zip(&block.terms) {
                        shown[usize::from(block.kind.by == By::Velocity)] |= shows;
                    }
                }
            }
            let stated: Vec<[bool; 2]> =
                terms.iter().map(|term| [term.by_position, term.by_velocity]).collect();
            assert_eq!(shown, stated, "{}", kind.schema.tag);
        }
    }

    #[test]
    fn a_projection_that_is_not_the_nearest_is_called_wrong() {
        let kind = force::REGISTRY.iter().find(|kind| kind.schema.tag == "gravitationalforce");
        let verdict = |project: Project<'_>, dimension| {
            let (kind, law) = (kind.unwrap(), law::find("gravitationalforce").unwrap());
            let states = states(kind, dimension, 4, 1);
            let check = check_with(kind, law, dimension, &states, &simulated, project);
            let mut found = check.properties.iter();
            found.find(|finding| finding.property == Property::Projection).unwrap().verdict
        };
        type Change = fn(&DMatrix<f64>, usize) -> DMatrix<f64>;
        let absolute: Change = |block, _| {
            let mut eigen = block.clone().symmetric_eigen();
            eigen.eigenvalues.apply(|eigenvalue| *eigenvalue = eigenvalue.abs());
            eigen.recompose()
        };
        let shifted: Change = |block, _| {
            let lowest = block.symmetric_eigenvalues().min().min(0.0);
            block - DMatrix::identity(block.nrows(), block.nrows()) * lowest
        };
        let mistakes: [(&str, Change); 5] = [
            ("nothing", |block, _| block.clone()),
            ("absolute values", absolute),
            ("shifted until it is semi-definite", shifted),
            ("zero", |block, _| DMatrix::zeros(block.nrows(), block.nrows())),
            ("off by 1e-9", |block, dimension| clamp(block, dimension) * (1.0 + 1e-9)),
        ];
        for dimension in [Dimension::Two, Dimension::Three] {
            assert_eq!(verdict(&clamp, dimension), Verdict::Correct);
            for (name, change) in mistakes {
                assert_eq!(verdict(&change, dimension), Verdict::Wrong, "{name}");
            }
        }
    }

    #[test]
    fn results_do_not_depend_on_the_number_of_threads() {
        let config = Config { states: 2, seed: 5 };
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| check_all(config))
        };
        let (one, four) = (with(1), with(4));
        assert_eq!(format!("{one:?}"), format!("{four:?}"));
        assert!(one.is_pass());
    }
}
