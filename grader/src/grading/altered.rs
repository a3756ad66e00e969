//! Copy detection: runs a submission on altered copies of the scenes that it passes.
//!
//! A program that looks up stored traces, or simulates some forces and looks up the rest, passes the shipped scenes that it
//! has stored. So a passed scene counts only if the program also takes right steps with other numbers in every term of it:
//!
//! ```text
//! term     a part of a force under an integrator, motion, or fixed particles, whose absence would show in the first steps
//! copy     all masses times a factor of 1.06 to 1.1, all velocities and each part of a force times one of 1.01 to 1.05
//! right    the program ends normally within twice the limits of a run, and in the first three steps
//!          |x − x*| ≤ 1e-5 max(|x*|, 0.1),  |v − v*| ≤ 1e-5 max(|v*|, 0.1), or the scene's own tolerance if that is wider
//! ```
//!
//! Zeros and ones stay, equal values stay equal, and positions, lengths and steps stay as they are: a copy costs as much as
//! its original, and is as well-posed. A mistake that does not show in a scene does not show in its copy either. Values are
//! replaced in the text of the scene ([`edit`](mod@edit)); the rest of the file stays. The factors follow from the scene and
//! from a secret number ([`Secret`]), so that nobody can make the copies, and their traces, at home.
//!
//! First the fewest copies that hold all terms are run. Then, twice, of each term without a right copy the one that holds
//! the fewest other such terms. Their numbers have six digits, which a program may read or write wrongly: the same is done
//! again for terms without a right copy, with copies whose numbers are as short as can be. A term with two wrong copies and
//! no right one is not shown, and no scene that holds it counts. The copies are of two scenes, unless the suite has only one
//! with the term: a program with a mistake may pass one scene of many by chance. Scenes not confirmed otherwise are reported,
//! and cost nothing.
//!
//! Cost: one run for each integrator and dimension, or two, for a program that simulates. Others are stopped after
//! `MOST_EXCEEDED` exceeded limits.

use std::cmp::Reverse;
use std::collections::{BTreeSet, HashMap};
use std::fmt;
use std::fs;
use std::path::Path;

use fastrand::Rng;
use rayon::prelude::*;
use sandbox::scratch::scratch_folder;
use scene::schema::Convergence;
use scene::trace::{Shape, State};
use scene::xml::edit::{self, AttributeValue};
use scene::{ParseOptions, Scene};
use serde_json::{Map, Value};
use simulator::solver::linear::LinearSolver;
use simulator::vocabulary;
use tempfile::TempDir;

use crate::boundary::own_file::read_text;
use crate::boundary::seal::Secret;
use crate::compare::Criteria;
use crate::rubric::OtherRoot;
use crate::submission::program::{Program, SceneSource};
use crate::submission::{StateSource, builtin};
use crate::suite::{Case, Suite, hash_bytes};
use crate::verdict::{Failure, Fault, Verdict};

/// Number of steps that are compared.
const STEPS: usize = 3;

/// Wrong copies of a term without a right one.
const FEWEST_WRONG: usize = 2;

/// Copies that exceed a limit, after which no more are run: these fail like those before them.
const MOST_EXCEEDED: usize = 4;

/// Copies that are run at the same time.
const AT_ONCE: usize = 8;

/// Maximum size of a scene file that is altered, in MiB.
pub(super) const MAX_MEBIBYTES: u64 = 1;

/// Maximum error of a right state, relative to the largest number: that of six digits. Simple numbers of a scene may need no
/// more, and those of its copy do.
const RIGHT: f64 = 1e-5;

/// Numbers below this are compared as this one: a program may write six decimals.
const SMALL: f64 = 0.1;

/// Ratio of the smallest change that shows to the maximum error of a right state.
const SHOWS: f64 = 10.0;

/// Draws of the factors until a copy differs from its original.
const DRAWS: u64 = 4;

/// A scene that a program passes.
#[derive(Debug, Clone, Copy)]
pub struct Passed<'a> {
    /// The scene.
    pub case: &'a Case,
    /// The criteria it was judged by.
    pub criteria: &'a Criteria,
    /// Whether another solution of an implicit step passes.
    pub other_root: OtherRoot,
}

/// Evidence of altered copies against passed scenes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Copied {
    /// Number of shipped scenes that the program passed.
    pub passed: usize,
    /// The counts of scenes, if it passes nothing but shipped scenes.
    pub only_shipped: Option<OnlyShipped>,
    /// Passed scenes that do not count, with the terms that the program does not show.
    pub withdrawn: Vec<Withdrawn>,
    /// The scenes with a wrong copy, and the verdict on it.
    pub wrong: Vec<(String, &'static str)>,
    /// Passed scenes that are neither confirmed nor withdrawn.
    pub unchecked: Vec<String>,
    /// Number of passed scenes with a term that is right in copies with short numbers alone.
    pub short_numbers: usize,
    /// A shipped scene that fails once a line break is appended to the file, if there is one.
    pub bytes: Option<String>,
}

/// The scenes of a program that is right in shipped ones alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OnlyShipped {
    /// Number of shipped scenes.
    pub shipped: usize,
    /// Number of altered copies, all wrong.
    pub copies: usize,
    /// Number of hidden scenes, all wrong; 0 if they were not run.
    pub hidden: usize,
}

/// A passed scene that does not count.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Withdrawn {
    /// Its name.
    pub scene: String,
    /// Its terms that the program does not show, in words.
    pub terms: String,
}

impl Copied {
    /// The failure of a scene; `None` if its pass counts.
    pub fn failure(&self, scene: &str) -> Option<Failure> {
        let Withdrawn { terms, .. } =
            self.withdrawn.iter().find(|withdrawn| withdrawn.scene == scene)?;
        Some(Failure::FailsAltered { terms: terms.clone() })
    }

    /// Adds the counts of hidden scenes that were judged.
    pub(super) fn add_hidden(&mut self, judged: usize, passed: usize) {
        self.only_shipped = self.only_shipped.filter(|_| passed == 0);
        if let Some(only) = &mut self.only_shipped {
            only.hidden = judged;
        }
    }
}

impl fmt::Display for OnlyShipped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { copies, hidden, .. } = self;
        write!(f, "of {copies} altered {}", if *copies == 1 { "copy" } else { "copies" })?;
        match hidden {
            0 => {}
            1 => write!(f, " and 1 hidden scene")?,
            _ => write!(f, " and {hidden} hidden scenes")?,
        }
        write!(f, ", none has")
    }
}

impl fmt::Display for Copied {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { passed, withdrawn, unchecked, short_numbers, bytes, .. } = self;
        if *short_numbers > 0 {
            write!(
                f,
                "Numbers with more digits may be read or written wrongly: copies of {} are right with short numbers, wrong \
                 with six digits{}",
                match short_numbers {
                    1 => "1 passed scene".to_owned(),
                    more => format!("{more} passed scenes"),
                },
                if withdrawn.is_empty() && unchecked.is_empty() { "" } else { ". " }
            )?;
        }
        if !withdrawn.is_empty() {
            let other = ", or numbers with more digits are read or written wrongly";
            write!(f, "Possibly copied answers{}: ", if bytes.is_some() { "" } else { other })?;
            match self.only_shipped {
                Some(only @ OnlyShipped { shipped, .. }) => write!(
                    f,
                    "of {shipped} shipped scenes, {passed} have a right trace; {only}. Of the {passed}, "
                )?,
                None => write!(f, "of {passed} shipped scenes with a right trace, ")?,
            }
            write!(
                f,
                "{} do not count, because the program fails on every altered copy of scenes with the same terms",
                withdrawn.len()
            )?;
            if let Some(scene) = bytes {
                write!(f, ", and on {scene} with a line break appended to the file")?;
            }
        }
        match (unchecked.is_empty(), withdrawn.is_empty()) {
            (true, _) => Ok(()),
            (false, true) => {
                write!(f, "Passed, but not confirmed by altered copies: {}", unchecked.join(", "))
            }
            (false, false) => write!(f, "; not confirmed: {}", unchecked.join(", ")),
        }
    }
}

/// A part of what a program has to compute.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Term {
    integrator: &'static str,
    axes: usize,
    solver: &'static str,
    what: What,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum What {
    /// Initial velocities.
    Motion,
    /// Fixed particles.
    Fixed,
    /// A part of a force.
    Force { tag: &'static str, part: &'static str },
}

impl Term {
    /// All terms of a scene, whether they show or not.
    fn all(case: &Case) -> BTreeSet<Self> {
        let scene = &case.scene;
        let mut all = Vec::new();
        if scene.particles.iter().any(|particle| particle.velocity != [0.0; 3]) {
            all.push(What::Motion);
        }
        if scene.particles.iter().any(|particle| particle.fixed) {
            all.push(What::Fixed);
        }
        for element in &scene.forces {
            let schema = element.schema;
            let is_there = |name: &&str| element.parameter(name) != 0.0;
            let parts = schema.parts.iter().filter(|part| part.scaled_by.iter().any(is_there));
            all.extend(parts.map(|part| What::Force { tag: schema.tag, part: part.name }));
        }
        let (integrator, solver) = (scene.integrator.name, case.solver.name());
        let axes = scene.dimension.count();
        all.into_iter().map(|what| Self { integrator, axes, solver, what }).collect()
    }

    /// The scene without this term.
    fn left_out(self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        match self.what {
            What::Motion => scene.particles.iter_mut().for_each(|p| p.velocity = [0.0; 3]),
            What::Fixed => scene.particles.iter_mut().for_each(|p| p.fixed = false),
            What::Force { tag, part } => {
                for element in scene.forces.iter_mut().filter(|e| e.schema.tag == tag) {
                    for name in element.schema.part(part).scaled_by {
                        element.parameters[element.schema.parameter_idx(name)] = 0.0;
                    }
                }
            }
        }
        scene
    }

    fn words(self) -> String {
        let Self { integrator, axes, what, .. } = self;
        let what = match what {
            What::Motion => "moving particles".to_owned(),
            What::Fixed => "fixed particles".to_owned(),
            What::Force { tag, part: "all" } => tag.to_owned(),
            What::Force { tag, part } => format!("{tag} ({part})"),
        };
        format!("{what} under {integrator} in {axes}D")
    }
}

/// Digits of the numbers that a copy replaces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Digits {
    /// Six, so that few copies are alike.
    Six,
    /// As few as the original has, if two of them and another value are left.
    Short,
}

impl Digits {
    /// This multiple of a number in decimal notation; of few digits, the next number if it is rounded to the original.
    fn multiple(self, factor: f64, original: f64) -> String {
        let value = factor * original;
        let decimals =
            |digits: f64| (digits - value.abs().log10().ceil()).clamp(0.0, 300.0) as usize;
        if self == Self::Six {
            return format!("{value:.*}", decimals(6.0));
        }
        // The shortest form has no trailing zeros.
        let own = original.to_string();
        let own = own.split_once('.').map_or(0, |(_, fraction)| fraction.len());
        let decimals = own.max(decimals(2.0));
        let rounded = format!("{value:.decimals$}");
        if rounded.parse() != Ok(original) {
            return rounded;
        }
        let unit = 0.1_f64.powi(decimals as i32).copysign(original);
        format!("{:.decimals$}", original + unit)
    }
}

/// An altered copy of a scene, with the first steps of our simulator.
struct Twin<'a> {
    passed: Passed<'a>,
    case: Case,
    text: String,
    /// The initial state, and those after the first steps.
    states: Vec<State>,
    /// The terms that show in them.
    terms: BTreeSet<Term>,
    digits: Digits,
    /// Tolerance of the scene's criteria.
    tolerance: f64,
    outcome: Option<Outcome>,
}

/// The outcome of a run on a copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outcome {
    Right,
    /// The name of the verdict.
    Wrong(&'static str),
    Unjudged,
}

impl Outcome {
    fn is_exceeded(self) -> bool {
        const LIMITS: [&str; 5] =
            ["timed-out", "out-of-memory", "too-much-output", "too-many-processes", NOT_RUN];
        matches!(self, Self::Wrong(verdict) if LIMITS.contains(&verdict))
    }
}

/// Verdict on copies that are not run, for example beyond the budget: those of an honest program take no longer than their
/// scenes did.
const NOT_RUN: &str = "not-run";

impl<'a> Twin<'a> {
    /// Alters a scene; `None` if that cannot be done so that it shows.
    fn of(passed: Passed<'a>, secret: Secret, digits: Digits, number: u64) -> Option<Self> {
        let case = passed.case;
        let text = read_text(&case.files.first()?.path, MAX_MEBIBYTES).ok()?;
        let seed = secret.0 ^ u64::from_str_radix(case.scene_hash.get(..16)?, 16).ok()?;
        let original = first_states(&case.scene)?;
        (0..DRAWS).find_map(|draw| {
            let mut random = Rng::with_seed(seed.wrapping_add(DRAWS * number + draw));
            let text = match case.format() {
                "json" => alter_json(&text, &mut random)?,
                _ => alter_xml(&text, digits, &mut random)?,
            };
            let mut twin = Self { digits, ..Self::with_text(passed, text)? };
            let is_hidden = |states: &[State]| twin.is_within(states, SHOWS, true);
            if is_hidden(&original) {
                return None;
            }
            let shows = |term: &Term| {
                first_states(&term.left_out(&twin.case.scene))
                    .is_none_or(|states| !is_hidden(&states))
            };
            twin.terms = Term::all(&twin.case).into_iter().filter(shows).collect();
            (!twin.terms.is_empty()).then_some(twin)
        })
    }

    /// The scene with this text in its file.
    fn with_text(passed: Passed<'a>, text: String) -> Option<Self> {
        let case = passed.case;
        let (path, options) = (&case.files.first()?.path, ParseOptions::default());
        let parsed = scene::parse_bytes(text.as_bytes(), path, &vocabulary(), &options).ok()?;
        let scene_hash = hash_bytes(text.as_bytes());
        let states = first_states(&parsed.scene)?;
        let twin = Case { scene: parsed.scene, scene_hash, ..case.clone() };
        let tolerance = match passed.criteria {
            Criteria::Fixed(tolerances) => tolerances.largest,
            Criteria::Calibrated(_) => 0.0,
        };
        let (terms, digits, outcome) = (BTreeSet::new(), Digits::Six, None);
        Some(Self { passed, case: twin, text, states, terms, digits, tolerance, outcome })
    }

    /// Whether these states agree with the first ones of the copy, to so many times the error of right ones.
    fn is_within(&self, states: &[State], times: f64, has_velocities: bool) -> bool {
        let within = |expected: &[f64], got: &[f64]| {
            let largest = expected.iter().fold(SMALL, |most: f64, value| most.max(value.abs()));
            let bound = times * (RIGHT * largest).max(self.tolerance);
            // A NaN agrees with nothing.
            expected.iter().zip(got).all(|(expected, got)| (expected - got).abs() <= bound)
        };
        states.len() == self.states.len()
            && self.states.iter().zip(states).all(|(expected, got)| {
                within(&expected.positions, &got.positions)
                    && (!has_velocities || within(&expected.velocities, &got.velocities))
            })
    }

    /// Whether our simulator steps the copy to its end, within twice the reach of the original.
    fn is_tame(&self) -> bool {
        let reach = |scene: &Scene| {
            let mut states = builtin::start(scene, LinearSolver::Auto);
            let mut state = State::zeros(Shape::of(scene));
            let mut reach: f64 = 0.0;
            while states.read(&mut state).ok()? {
                reach = state.positions.iter().fold(reach, |most, value| most.max(value.abs()));
            }
            Some(reach)
        };
        match (reach(&self.passed.case.scene), reach(&self.case.scene)) {
            (Some(original), Some(altered)) => altered <= 2.0 * original,
            _ => false,
        }
    }

    /// States of a step times particles.
    fn cost(&self) -> u64 {
        self.case.scene.n_steps() * self.case.scene.particles.len() as u64
    }

    /// Runs a submission on the copy, of which a file is made in this folder.
    fn run(&self, run: Runs<'_>, folder: &Path) -> Outcome {
        let mut case = self.case.clone();
        let folder = TempDir::new_in(folder);
        let (Ok(folder), Some(file)) = (folder, case.files.first_mut()) else {
            return Outcome::Unjudged;
        };
        file.path = folder.path().join("scene");
        if fs::write(&file.path, &self.text).is_err() {
            return Outcome::Unjudged;
        }
        let mut states = match run(&case) {
            Ok(states) => states,
            Err(Verdict::GraderFault(_) | Verdict::Pass) => return Outcome::Unjudged,
            Err(Verdict::Fail(failure)) => return Outcome::Wrong(failure.name()),
        };
        let mut state = State::zeros(Shape::of(&self.case.scene));
        let mut got = Vec::with_capacity(self.states.len());
        for _ in &self.states {
            match states.read(&mut state) {
                Ok(true) => got.push(state.clone()),
                Ok(false) => return Outcome::Wrong("too-short"),
                Err(failure) => return Outcome::Wrong(failure.name()),
            }
        }
        let convergence = self.case.scene.integrator.convergence;
        let may_have_other_root = self.passed.other_root == OtherRoot::Pass
            && matches!(convergence, Convergence::Update(_));
        if self.is_within(&got, 1.0, states.has_velocities()) {
            Outcome::Right
        } else if may_have_other_root {
            Outcome::Unjudged
        } else {
            Outcome::Wrong(Failure::Differs.name())
        }
    }
}

/// The initial state and those after the first steps of our simulator; `None` if it fails.
fn first_states(scene: &Scene) -> Option<Vec<State>> {
    let mut states = builtin::start(scene, LinearSolver::Auto);
    let mut state = State::zeros(Shape::of(scene));
    let mut first = Vec::with_capacity(STEPS + 1);
    while first.len() <= STEPS && states.read(&mut state).ok()? {
        first.push(state.clone());
    }
    (first.len() > 1).then_some(first)
}

/// The text of an XML scene with other masses, velocities and strengths of forces.
fn alter_xml(text: &str, digits: Digits, random: &mut Rng) -> Option<String> {
    let vocabulary = vocabulary();
    let mut factors: HashMap<(String, &str), f64> = HashMap::new();
    edit::edit(text, |AttributeValue { tag, name, value, .. }| {
        let part = match (tag, name) {
            ("particle", "m") => "m",
            ("particle", "vx" | "vy" | "vz") => "v",
            _ => {
                let mut parts = vocabulary.force(tag)?.parts.iter();
                parts.find(|part| part.scaled_by.contains(&name))?.name
            }
        };
        let drawn = || factor(part == "m", random);
        let factor = *factors.entry((tag.to_owned(), part)).or_insert_with(drawn);
        let value = value.trim().parse::<f64>().ok()?;
        // A coefficient that is forgotten does not show where it is 1.
        if value == 0.0 || value.abs() == 1.0 && part != "v" {
            return None;
        }
        Some(digits.multiple(factor, value))
    })
}

/// The text of a JSON scene with another stiffness and mass.
fn alter_json(text: &str, random: &mut Rng) -> Option<String> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut entries: Map<String, Value> = serde_json::from_str(text).ok()?;
    for (name, is_mass) in [("k", false), ("m", true)] {
        if let Some(value) = entries.get_mut(name) {
            let number = value.as_f64().filter(|number| *number != 1.0)?;
            *value = Value::from((1e6 * factor(is_mass, random) * number).round() / 1e6);
        }
    }
    Some(serde_json::to_string_pretty(&entries).ok()? + "\n")
}

/// A mass grows more than a force: their ratio, and the motion, then change.
fn factor(is_mass: bool, random: &mut Rng) -> f64 {
    let least = if is_mass { 1.06 } else { 1.01 };
    least + 0.04 * random.f64()
}

/// Runs a submission on a scene.
pub type Runs<'a> = &'a (dyn Fn(&Case) -> Result<Box<dyn StateSource>, Verdict> + Sync);

/// [`look_for_copies`] for a program. Nothing is run after a stop.
pub fn of_program(
    suite: &Suite,
    passed: &[Passed<'_>],
    secret: Secret,
    program: &Program,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Option<Copied> {
    let program = program.clone().with_twice_the_limits();
    look_for_copies(suite, passed, secret, &|case| {
        if is_stopped() {
            let detail = "the run was ended".to_owned();
            return Err(Verdict::GraderFault(Fault::NotRun { detail }));
        }
        Ok(Box::new(program.run(SceneSource::Case(case), Shape::of(&case.scene))?))
    })
}

/// Runs a submission on altered copies of the scenes that it passes. Returns what these do not confirm.
pub fn look_for_copies(
    suite: &Suite,
    passed: &[Passed<'_>],
    secret: Secret,
    run: Runs<'_>,
) -> Option<Copied> {
    // Without a folder for them, nothing is known.
    let folder = scratch_folder().ok()?;
    let folder = folder.path();
    let mut search = Search { twins: Vec::new(), secret, run, folder, n_exceeded: 0 };
    search.confirm(Digits::Six, passed);
    let refuted = search.refuted(suite);
    let holds_refuted = |passed: &&Passed<'_>| !Term::all(passed.case).is_disjoint(&refuted);
    let doubted: Vec<Passed<'_>> = passed.iter().filter(holds_refuted).copied().collect();
    search.confirm(Digits::Short, &doubted);
    search.result(suite, passed, &refuted)
}

struct Search<'a> {
    twins: Vec<Twin<'a>>,
    secret: Secret,
    run: Runs<'a>,
    /// Where the copies are.
    folder: &'a Path,
    n_exceeded: usize,
}

impl<'a> Search<'a> {
    /// Terms of these copies that no right one holds.
    fn not_shown(&self) -> BTreeSet<Term> {
        let of = |is_wanted: fn(Option<Outcome>) -> bool| -> BTreeSet<Term> {
            let twins = self.twins.iter().filter(|twin| is_wanted(twin.outcome));
            twins.flat_map(|twin| &twin.terms).copied().collect()
        };
        let shown = of(|outcome| outcome == Some(Outcome::Right));
        of(|_| true).difference(&shown).copied().collect()
    }

    /// Runs copies with numbers of so many digits, until each term has a right copy or enough wrong ones.
    fn confirm(&mut self, digits: Digits, passed: &[Passed<'a>]) {
        let twin = |passed: &Passed<'a>| Twin::of(*passed, self.secret, digits, 0);
        let twins: Vec<Twin<'a>> = passed.par_iter().filter_map(twin).collect();
        self.twins.extend(twins);
        let first = self.cover(digits);
        self.run_all(&first);
        for number in 1..=FEWEST_WRONG as u64 {
            let specific = self.specific(digits, number);
            self.run_all(&specific);
        }
    }

    /// Few copies that hold all terms.
    fn cover(&mut self, digits: Digits) -> Vec<usize> {
        let mut missing = self.not_shown();
        let mut chosen = Vec::new();
        loop {
            let held = |number: &usize| self.twins[*number].terms.intersection(&missing).count();
            let is_of = |number: &usize| self.twins[*number].digits == digits;
            let open = (0..self.twins.len()).filter(is_of).filter(|number| held(number) > 0);
            let best = open.max_by_key(|number| {
                (held(number), Reverse(self.twins[*number].cost()), Reverse(*number))
            });
            let Some(best) = best else { return chosen };
            if self.twins[best].is_tame() {
                missing.retain(|term| !self.twins[best].terms.contains(term));
                chosen.push(best);
            } else {
                self.twins[best].terms.clear();
            }
        }
    }

    /// For each term that is not shown, a copy that was not run and holds the fewest others; another one of the same scene
    /// if all were.
    fn specific(&mut self, digits: Digits, number: u64) -> Vec<usize> {
        let missing = self.not_shown();
        let mut chosen = BTreeSet::new();
        for term in &missing {
            let key = |place: &usize| {
                let twin = &self.twins[*place];
                (twin.terms.intersection(&missing).count(), twin.cost(), *place)
            };
            let holds = |place: &usize| {
                let twin = &self.twins[*place];
                twin.digits == digits && twin.terms.contains(term)
            };
            let holders = || (0..self.twins.len()).filter(holds);
            let is_open = |place: &usize| {
                self.twins[*place].outcome.is_none() && self.twins[*place].is_tame()
            };
            let open = holders().filter(is_open).min_by_key(key);
            let Some(place) = open.or_else(|| holders().min_by_key(key)) else { continue };
            if open.is_some() {
                chosen.insert(place);
                continue;
            }
            let other = Twin::of(self.twins[place].passed, self.secret, digits, number);
            if let Some(twin) = other.filter(Twin::is_tame) {
                chosen.insert(self.twins.len());
                self.twins.push(twin);
            }
        }
        chosen.into_iter().collect()
    }

    fn run_all(&mut self, chosen: &[usize]) {
        for some in chosen.chunks(AT_ONCE) {
            let is_over = self.n_exceeded >= MOST_EXCEEDED;
            let run = |place: &usize| {
                if is_over {
                    return Outcome::Wrong(NOT_RUN);
                }
                self.twins[*place].run(self.run, self.folder)
            };
            let outcomes: Vec<Outcome> = some.par_iter().map(run).collect();
            for (place, outcome) in some.iter().zip(outcomes) {
                self.n_exceeded += usize::from(outcome.is_exceeded());
                self.twins[*place].outcome = Some(outcome);
            }
        }
    }

    /// The counts of scenes, if all copies that were judged are wrong.
    fn only_shipped(&self, suite: &Suite) -> Option<OnlyShipped> {
        let outcomes = || self.twins.iter().filter_map(|twin| twin.outcome);
        let is_wrong =
            |outcome: &Outcome| matches!(outcome, Outcome::Wrong(verdict) if *verdict != NOT_RUN);
        let copies = outcomes().filter(is_wrong).count();
        let is_right = outcomes().any(|outcome| outcome == Outcome::Right);
        let shipped = suite.cases.len();
        (copies > 0 && !is_right).then_some(OnlyShipped { shipped, copies, hidden: 0 })
    }

    /// The wrong copies, with their verdicts.
    fn wrong(&self) -> impl Iterator<Item = (&Twin<'a>, &'static str)> {
        self.twins.iter().filter_map(|twin| match twin.outcome {
            Some(Outcome::Wrong(verdict)) => Some((twin, verdict)),
            _ => None,
        })
    }

    /// The terms that have wrong copies alone, and enough of them.
    fn refuted(&self, suite: &Suite) -> BTreeSet<Term> {
        let is_refuted = |term: &Term| {
            let copies = || self.wrong().filter(|(twin, _)| twin.terms.contains(term));
            let scenes: BTreeSet<&str> =
                copies().map(|(twin, _)| twin.passed.case.id.as_str()).collect();
            let with_term = suite.cases.iter().filter(|case| Term::all(case).contains(term));
            copies().count() >= FEWEST_WRONG && scenes.len() >= FEWEST_WRONG.min(with_term.count())
        };
        self.not_shown().into_iter().filter(is_refuted).collect()
    }

    /// Unconfirmed scenes; `doubted` are the terms that are refuted by copies with numbers of six digits.
    fn result(
        &self,
        suite: &Suite,
        passed: &[Passed<'_>],
        doubted: &BTreeSet<Term>,
    ) -> Option<Copied> {
        let (missing, refuted) = (self.not_shown(), self.refuted(suite));
        let known: BTreeSet<Term> =
            self.twins.iter().flat_map(|twin| &twin.terms).copied().collect();
        let (mut withdrawn, mut unchecked) = (Vec::new(), Vec::new());
        for Passed { case, .. } in passed {
            let terms = Term::all(case);
            let words: Vec<String> =
                terms.intersection(&refuted).map(|term| term.words()).collect();
            let is_checked = !terms.is_disjoint(&known) && terms.is_disjoint(&missing);
            if !words.is_empty() {
                withdrawn.push(Withdrawn { scene: case.id.clone(), terms: words.join(", ") });
            } else if !is_checked {
                unchecked.push(case.id.clone());
            }
        }
        let is_of_bytes = |twin: &Twin<'_>| {
            let text = read_text(&twin.passed.case.files.first()?.path, MAX_MEBIBYTES).ok()?;
            let same = Twin::with_text(twin.passed, text + "\n")?;
            matches!(same.run(self.run, self.folder), Outcome::Wrong(_))
                .then(|| twin.passed.case.id.clone())
        };
        let first = self.wrong().next().filter(|_| !withdrawn.is_empty() && self.n_exceeded == 0);
        let bytes = first.and_then(|(twin, _)| is_of_bytes(twin));
        let wrong: BTreeSet<(String, &'static str)> =
            self.wrong().map(|(twin, verdict)| (twin.passed.case.id.clone(), verdict)).collect();
        let wrong = wrong.into_iter().collect();
        let short: BTreeSet<Term> = doubted.difference(&missing).copied().collect();
        let of_short = passed.iter().filter(|passed| !Term::all(passed.case).is_disjoint(&short));
        let short_numbers = of_short.count();
        let is_confirmed = withdrawn.is_empty() && unchecked.is_empty() && short_numbers == 0;
        let passed = passed.len();
        let only_shipped = self.only_shipped(suite);
        (!is_confirmed).then_some(Copied {
            passed,
            only_shipped,
            withdrawn,
            wrong,
            unchecked,
            short_numbers,
            bytes,
        })
    }
}
