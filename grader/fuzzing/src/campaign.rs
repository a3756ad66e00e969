//! A run over many scenes: draws, judges, and shrinks what fails.
//!
//! ```text
//! for each number of a scene: candidates, drawn anew or mutated ── the one with the rarest pairs for its size ── judged
//! ```
//!
//! The candidates of a scene depend on the seed, its number and what the batches before it showed, so that a run of a
//! deterministic program is repeated by its seed. Scenes are mutated whose runs were new: another largest residual, within its
//! tolerance, or another number of iterations, under the same features. A feature that a program always refuses is no longer drawn.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::time::{Duration, Instant};

use diagnosis::findings::Finding;
use fastrand::Rng;
use grader::verdict::Fault;
use rayon::prelude::*;
use scene::Scene;
use scene::schema::{Convergence, IntegratorSchema};

use crate::cause::{self, Evidence};
use crate::choices::{Choices, mutated, simplest};
use crate::draw::{Drawn, Pair, Scope, Sketch, draw, pairs, plain, read};
use crate::judge::{How, Judge, Judgement, Nothing, Run, Subject, Wrong};
use crate::motion::statistics;
use crate::shrink::{Effort, Shrunk, measure, shrink};
use crate::symmetry::{self, Symmetry};

/// The scenes and the limits of a campaign.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The features that scenes may have.
    pub scope: Scope,
    /// The seed of all scenes.
    pub seed: u64,
    /// The longest time; shrinking comes on top of it.
    pub time: Duration,
    /// The most scenes.
    pub scenes: u64,
    /// Failures after which the run ends.
    pub failures: usize,
    /// How much shrinking one failure may cost.
    pub effort: Effort,
}

/// Scenes that are judged at a time.
const BATCH: u64 = 32;

/// Candidates of each scene. A candidate takes a hundredth of the time of a run; a circumstance that one in a hundred has is then
/// tried as often as common ones.
const CANDIDATES: usize = 16;

/// The most tries to draw candidates without refused features.
const TRIES: usize = 100;

/// Refusals of a feature, without a run, from which it is not drawn any more.
const REFUSALS: u32 = 100;

/// The most scenes that are kept to be mutated.
const MOST_KEPT: usize = 1000;

/// Of so many scenes, one is run by itself if the program is right in it with others in one run. Such a run takes as
/// long as six others, and the other threads wait for it: one in 64 takes up to a fifth of the time, one in 16 two fifths.
const CONFIRMED: u64 = 128;

/// The most runs that are right and serve as evidence.
const MOST_RIGHT: usize = 40;

/// The most discoveries.
const MOST_DISCOVERIES: usize = 4;

/// The most kinds of failures that are shrunk: some turn out to be the same.
const MOST_SHRUNK: usize = 8;

/// The counts of a run.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// Scenes that were run.
    pub scenes: u64,
    /// Scenes in which the program is right.
    pub right: u64,
    /// Scenes of which it says that it lacks something.
    pub refused: u64,
    /// Scenes in which it is wrong.
    pub wrong: u64,
    /// Scenes that tell nothing, by reason.
    pub nothing: BTreeMap<Nothing, u64>,
    /// Pairs of a feature and a circumstance, or another feature, that were run.
    pub covered: usize,
    /// Scenes that a program took with others in one run.
    pub served: u64,
    /// Scenes in which it is right, and was not with others in one run.
    pub unlike: u64,
    /// Scenes in which it is not right, and was with others in one run.
    pub right_served: u64,
    /// The time.
    pub time: Duration,
    /// When the first failure was found: the number of scenes, and the time.
    pub first: Option<(u64, Duration)>,
}

/// The result of a run.
#[derive(Debug, Clone, Default)]
pub struct Campaign {
    /// The seed.
    pub seed: u64,
    /// The counts.
    pub tally: Tally,
    /// The discoveries, most frequent first.
    pub discoveries: Vec<Discovery>,
    /// Kinds of failures that were not shrunk.
    pub further: usize,
    /// A fault that ended the run.
    pub fault: Option<Fault>,
}

/// A kind of failure, with the smallest scene that shows it.
#[derive(Debug, Clone)]
pub struct Discovery {
    /// The cause that all drawn scenes together prove.
    pub proven: Option<Finding>,
    /// The causes that make the numbers of the smallest scene, of which others may be the true one.
    pub possible: Option<Finding>,
    /// Failures of this kind.
    pub count: usize,
    /// The number of the scene that was shrunk.
    pub number: u64,
    /// How large that was: particles, forces, steps.
    pub original: [usize; 3],
    /// The smallest scene, and the failure in it.
    pub shrunk: Shrunk,
    /// Its file.
    pub text: String,
    /// Whether the scene passes if its file is spelt plainly.
    pub is_spelling: bool,
    /// Symmetries that the program breaks in it.
    pub broken: Vec<Symmetry>,
}

/// A failure of a drawn scene.
#[derive(Debug, Clone)]
struct Failing {
    number: u64,
    /// The choices that drew it; none where it was not drawn.
    choices: Vec<u64>,
    scene: Scene,
    text: String,
    wrong: Wrong,
    is_spelling: bool,
}

impl Failing {
    /// The failure as it was drawn.
    fn discovery(&self, proven: Option<Finding>, count: usize) -> Discovery {
        let Self { number, choices: _, scene, text, wrong, is_spelling } = self.clone();
        let [particles, forces, steps, ..] = measure(&scene);
        Discovery {
            proven,
            possible: None,
            count,
            number,
            original: [particles, forces, steps],
            shrunk: Shrunk { scene, wrong, runs: 0 },
            text,
            is_spelling,
            broken: Vec::new(),
        }
    }
}

/// Results of the batches so far.
#[derive(Default)]
struct Memory {
    /// Scenes with a pair under an integrator.
    covered: HashMap<(Pair, &'static str), u32>,
    /// Scenes that were new.
    kept: Vec<Vec<u64>>,
    seen: HashSet<(Vec<&'static str>, i32, u64)>,
    /// Runs and refusals of each feature.
    features: HashMap<&'static str, (u32, u32)>,
}

impl Memory {
    fn is_refused(&self, scene: &Scene) -> bool {
        features(scene).iter().any(|feature| {
            let counts = self.features.get(feature);
            counts.is_some_and(|(runs, refusals)| *runs == 0 && *refusals >= REFUSALS)
        })
    }

    /// How much a scene covers that few scenes did, by how likely it is to run: a refusal does not say which feature is lacking.
    fn worth(&self, scene: &Scene) -> f64 {
        let under = scene.integrator.name;
        let count = |pair: Pair| 1.0 + f64::from(*self.covered.get(&(pair, under)).unwrap_or(&0));
        // The rarest pairs decide, and not how many a large scene has, which takes longer to run and to shrink.
        let covers: f64 = pairs(scene).into_iter().map(|pair| count(pair).powi(-2)).sum();
        let size = (scene.particles.len() + scene.forces.len()) as f64;
        let runs = features(scene).into_iter().map(|feature| {
            let (runs, refusals) = self.features.get(feature).copied().unwrap_or_default();
            f64::from(runs + 1) / f64::from(runs + refusals + 1)
        });
        covers / size.sqrt() * runs.product::<f64>()
    }

    /// The scene of this number; `None` if everything that may be drawn is refused.
    fn next(&self, plan: &Plan, number: u64) -> Option<Drawn> {
        let mut random = Rng::with_seed(plan.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ number);
        let mut candidates: Vec<(f64, Sketch)> = Vec::new();
        for _ in 0..TRIES {
            let seed = random.u64(..);
            let choices = if !self.kept.is_empty() && random.u8(0..3) == 0 {
                let kept = &self.kept[random.usize(0..self.kept.len())];
                Choices::from(mutated(kept, &mut random), seed)
            } else {
                Choices::random(seed)
            };
            let sketch = Sketch::new(&plan.scope, choices);
            if self.is_refused(&sketch.scene) {
                continue;
            }
            candidates.push((self.worth(&sketch.scene), sketch));
            if candidates.len() == CANDIDATES {
                break;
            }
        }
        candidates.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        candidates.into_iter().find_map(|(_, sketch)| sketch.with_file())
    }

    /// Pairs that were run, under any integrator.
    fn n_pairs(&self) -> usize {
        self.covered.keys().map(|(pair, _)| pair).collect::<HashSet<_>>().len()
    }

    fn learn(&mut self, drawn: &Drawn, judgement: &Judgement) {
        let features = features(&drawn.scene);
        for feature in &features {
            let (runs, refusals) = self.features.entry(feature).or_default();
            match judgement {
                Judgement::Refused => *refusals += 1,
                _ => *runs += 1,
            }
        }
        if matches!(judgement, Judgement::Refused) {
            return;
        }
        for pair in pairs(&drawn.scene) {
            *self.covered.entry((pair, drawn.scene.integrator.name)).or_default() += 1;
        }
        if let Judgement::Right(Run { used, .. }) = judgement
            && self.kept.len() < MOST_KEPT
        {
            let size = if *used > 0.0 { used.log2().floor() as i32 } else { i32::MIN };
            let iterations = match drawn.scene.integrator.convergence {
                Convergence::Update(_) => statistics(&drawn.scene).max_newton_iterations,
                _ => 0,
            };
            if self.seen.insert((features, size, iterations)) {
                self.kept.push(drawn.choices.clone());
            }
        }
    }
}

/// The tags of the forces of a scene.
pub(crate) fn forces(scene: &Scene) -> Vec<&'static str> {
    let mut all: Vec<&'static str> = scene.forces.iter().map(|force| force.schema.tag).collect();
    all.sort_unstable();
    all.dedup();
    all
}

/// The features of a scene: its forces, and the integrator.
fn features(scene: &Scene) -> Vec<&'static str> {
    let mut all = forces(scene);
    all.push(scene.integrator.name);
    all
}

/// Runs a plan. It ends early where `is_stopped`; `notice` receives the counts after each batch.
pub fn run(
    subject: &dyn Subject,
    judge: &Judge,
    plan: &Plan,
    is_stopped: &(dyn Fn() -> bool + Sync),
    notice: &dyn Fn(&Tally),
) -> Campaign {
    let start = Instant::now();
    let mut memory = Memory::default();
    let mut campaign = Campaign { seed: plan.seed, ..Campaign::default() };
    let (mut failures, mut rights) = (Vec::new(), Vec::new());
    let mut next = 0;
    while next < plan.scenes && failures.len() < plan.failures && !is_stopped() {
        if start.elapsed() >= plan.time {
            break;
        }
        let numbers = next..(next + BATCH).min(plan.scenes);
        next = numbers.end;
        let drawn: Vec<(u64, Drawn)> = numbers
            .into_par_iter()
            .filter_map(|number| Some((number, memory.next(plan, number)?)))
            .collect();
        let share = drawn.len().div_ceil(rayon::current_num_threads());
        // A program that is right only when it serves is run on each scene by itself.
        let at_a_time = if campaign.tally.right_served == 0 { subject.at_a_time() } else { 1 };
        let share = share.clamp(1, at_a_time);
        let judged: Vec<Judged> = drawn
            .into_par_iter()
            .chunks(share)
            .flat_map_iter(|drawn| judge_all(subject, judge, drawn, (plan.seed, start), is_stopped))
            .collect();
        if judged.is_empty() {
            break;
        }
        for Judged { number, drawn, judgement, how, time } in judged {
            memory.learn(&drawn, &judgement);
            let tally = &mut campaign.tally;
            tally.scenes += 1;
            tally.served += u64::from(how == How::Served);
            tally.unlike += u64::from(how == How::Unlike);
            tally.right_served += u64::from(how == How::RightServed);
            match judgement {
                Judgement::Right(run) => {
                    tally.right += 1;
                    if rights.len() < MOST_RIGHT {
                        rights.push((drawn.scene, run));
                    }
                }
                Judgement::Refused => tally.refused += 1,
                Judgement::Tells(reason) => *tally.nothing.entry(reason).or_default() += 1,
                Judgement::Fault(fault) => campaign.fault = Some(fault),
                Judgement::Wrong(wrong) => {
                    tally.wrong += 1;
                    tally.first.get_or_insert((tally.scenes, time));
                    let Drawn { choices, scene, text } = drawn;
                    let (wrong, is_spelling) = (*wrong, false);
                    failures.push(Failing { number, choices, scene, text, wrong, is_spelling });
                }
            }
        }
        campaign.tally.covered = memory.n_pairs();
        campaign.tally.time = start.elapsed();
        notice(&campaign.tally);
        if campaign.fault.is_some() {
            return campaign;
        }
    }
    if is_stopped() {
        let simplest = failures.iter().min_by_key(|failing| measure(&failing.scene));
        let simplest = simplest.map(|failing| failing.discovery(None, failures.len()));
        campaign.discoveries = simplest.into_iter().collect();
    } else {
        let (scope, effort) = (&plan.scope, plan.effort);
        let tested = Tested { subject, judge, scope, effort, is_stopped };
        (campaign.discoveries, campaign.further) = tested.discoveries(failures, &rights);
    }
    campaign
}

/// Whether a scene of this number, if it is right in a run with others, is also run by itself.
fn is_confirmed(seed: u64, number: u64) -> bool {
    let (group, place) = (number / CONFIRMED, number % CONFIRMED);
    Rng::with_seed(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ group).u64(0..CONFIRMED) == place
}

/// A scene that was judged, and when.
struct Judged {
    number: u64,
    drawn: Drawn,
    judgement: Judgement,
    how: How,
    time: Duration,
}

/// Judges scenes, in one run of the subject if it can.
fn judge_all(
    subject: &dyn Subject,
    judge: &Judge,
    drawn: Vec<(u64, Drawn)>,
    (seed, start): (u64, Instant),
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Vec<Judged> {
    let expected: Vec<_> = drawn.iter().map(|(_, drawn)| judge.expected(&drawn.scene)).collect();
    let answered = drawn.iter().zip(&expected).filter(|(_, expected)| expected.is_ok());
    let runs: Vec<(&Scene, &str)> =
        answered.map(|((_, drawn), _)| (&drawn.scene, drawn.text.as_str())).collect();
    let mut served = if is_stopped() { Vec::new() } else { subject.serve(&runs) }.into_iter();
    let mut all = Vec::new();
    for ((number, drawn), expected) in drawn.into_iter().zip(expected) {
        let (judgement, how) = match expected {
            _ if is_stopped() => break,
            Err(nothing) => (Judgement::Tells(nothing), How::Alone),
            Ok(expected) => {
                let scene = (&drawn.scene, drawn.text.as_str());
                match judge.judge_served(subject, scene, &expected, served.next().flatten()) {
                    (_, How::Served) if is_confirmed(seed, number) => {
                        judge.confirm(subject, scene, &expected)
                    }
                    judged => judged,
                }
            }
        };
        // An interrupt kills programs, which is no failure of theirs.
        if is_stopped() {
            break;
        }
        all.push(Judged { number, drawn, judgement, how, time: start.elapsed() });
    }
    all
}

/// The smallest scene in which a subject fails as in this one, by this cause if it is proven; `None` where it does not fail, or
/// the scene tells nothing.
pub fn smallest(
    subject: &dyn Subject,
    (scope, effort): (&Scope, Effort),
    scene: &Scene,
    proven: Option<Finding>,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> Option<Discovery> {
    let judge = &Judge::default();
    let text = plain(scene)?;
    let scene = read(&text)?;
    let Judgement::Wrong(wrong) = judge.judge(subject, &scene, &text) else { return None };
    let (choices, wrong) = (Vec::new(), *wrong);
    let failing = Failing { number: 0, choices, scene, text, wrong, is_spelling: false };
    let tested = Tested { subject, judge, scope, effort, is_stopped };
    Some(tested.discovery(&failing, proven, 1))
}

/// The tested program, and how much its failures may cost.
struct Tested<'a> {
    subject: &'a dyn Subject,
    judge: &'a Judge,
    scope: &'a Scope,
    effort: Effort,
    /// A program that is run after that is killed, which is no failure of it.
    is_stopped: &'a (dyn Fn() -> bool + Sync),
}

impl Tested<'_> {
    /// The kinds of failures, each shrunk, and the number of kinds beyond these.
    fn discoveries(
        &self,
        mut failures: Vec<Failing>,
        rights: &[(Scene, Run)],
    ) -> (Vec<Discovery>, usize) {
        failures.par_iter_mut().for_each(|failing| self.spell_plainly(failing));
        let wrong = failures.iter().map(|failing| Evidence::Wrong(&failing.scene, &failing.wrong));
        let right = rights.iter().map(|(scene, run)| Evidence::Right(scene, run));
        let found = cause::find(&wrong.chain(right).collect::<Vec<_>>());
        let mut kinds: Vec<(Vec<String>, Vec<usize>)> = Vec::new();
        for (number, failing) in failures.iter().enumerate() {
            let diagnosis = found.diagnoses.get(number).and_then(Option::as_ref);
            let causes = diagnosis.map(|diagnosis| diagnosis.causes.clone()).unwrap_or_default();
            let key = if failing.is_spelling {
                vec!["the spelling of the file".to_owned()]
            } else if causes.is_empty() {
                let name = failing.wrong.failure.name();
                vec![name.to_owned(), failing.scene.integrator.name.to_owned()]
            } else {
                causes
            };
            match kinds.iter_mut().find(|(known, _)| *known == key) {
                Some((_, scenes)) => scenes.push(number),
                None => kinds.push((key, vec![number])),
            }
        }
        // The most frequent kind first.
        kinds.sort_by_key(|(_, scenes)| std::cmp::Reverse(scenes.len()));
        let mut all: Vec<Discovery> = Vec::new();
        let (mut further, mut shrunk) = (0, 0);
        for (_, scenes) in kinds {
            let simplest =
                scenes.iter().copied().min_by_key(|number| measure(&failures[*number].scene));
            let Some(simplest) = simplest else { continue };
            let is_of_it = |finding: &&Finding| {
                finding.is_proven() && finding.scenes.contains(&simplest.to_string())
            };
            // A proven cause has one entry: what it explains leaves the places to others.
            let entry = |finding: &Finding| {
                let is_known = |known: &Discovery| {
                    known.proven.as_ref().is_some_and(|known| known.words == finding.words)
                };
                all.iter().position(is_known)
            };
            let proven: Vec<&Finding> = found.findings.list.iter().filter(is_of_it).collect();
            let finding = proven.iter().find(|finding| entry(finding).is_none());
            if let (None, Some(known)) = (finding, proven.first().and_then(|first| entry(first))) {
                all[known].count += scenes.len();
                continue;
            }
            if all.len() == MOST_DISCOVERIES || shrunk == MOST_SHRUNK {
                further += 1;
                continue;
            }
            shrunk += 1;
            let finding = finding.copied().cloned();
            let discovery = self.discovery(&failures[simplest], finding, scenes.len());
            // Failures without a proven cause may turn out to be the same once they are shrunk.
            let is_known = |known: &&mut Discovery| {
                discovery.proven.is_none()
                    && forces(&known.shrunk.scene) == forces(&discovery.shrunk.scene)
                    && known.shrunk.wrong.failure.name() == discovery.shrunk.wrong.failure.name()
            };
            match all.iter_mut().find(is_known) {
                Some(known) => known.count += discovery.count,
                None => all.push(discovery),
            }
        }
        (all, further)
    }

    /// Takes the plain file of a scene, if that fails as well.
    fn spell_plainly(&self, failing: &mut Failing) {
        let Some(text) = plain(&failing.scene).filter(|text| *text != failing.text) else { return };
        let Some(scene) = read(&text) else { return };
        match self.judge.judge(self.subject, &scene, &text) {
            Judgement::Wrong(wrong) => {
                (failing.scene, failing.text, failing.wrong) = (scene, text, *wrong);
            }
            _ => failing.is_spelling = true,
        }
    }

    /// Shrinks a failure.
    fn discovery(&self, failing: &Failing, proven: Option<Finding>, count: usize) -> Discovery {
        let Failing { scene, wrong, .. } = failing;
        let mut discovery = failing.discovery(proven, count);
        if failing.is_spelling {
            self.simplify_file(&failing.choices, &mut discovery);
            return discovery;
        }
        let words = discovery.proven.as_ref().map(|finding| finding.words.clone());
        let words = words.filter(|words| cause::shows(scene, wrong, words));
        discovery.shrunk = self.shrink(scene, wrong, words.as_deref());
        let Shrunk { scene, wrong, .. } = &discovery.shrunk;
        discovery.text = plain(scene).unwrap_or_default();
        if discovery.proven.is_none() {
            let alone = cause::find(&[Evidence::Wrong(scene, wrong)]).findings.list;
            discovery.possible = alone.into_iter().find(Finding::is_proven);
        }
        if !wrong.states.is_empty() && self.subject.has_symmetries() {
            let broken = symmetry::broken(self.judge, self.subject, scene, &wrong.states);
            discovery.broken = if (self.is_stopped)() { Vec::new() } else { broken };
        }
        discovery
    }

    /// Takes the simplest drawn file that fails where the plain one of its scene does not.
    fn simplify_file(&self, choices: &[u64], discovery: &mut Discovery) {
        let fails = |planned: Vec<u64>| {
            let Drawn { choices, scene, text } = draw(self.scope, Choices::replayed(planned))?;
            let Judgement::Wrong(wrong) = self.judge.judge(self.subject, &scene, &text) else {
                return None;
            };
            let plain = plain(&scene)?;
            let judged = self.judge.judge(self.subject, &read(&plain)?, &plain);
            let is_spelling = !matches!(judged, Judgement::Wrong(_)) && !(self.is_stopped)();
            is_spelling.then_some((choices, (scene, text, *wrong)))
        };
        let (found, runs) = simplest(choices, &fails, self.effort);
        if let Some((scene, text, wrong)) = found {
            discovery.shrunk = Shrunk { scene, wrong, runs };
            discovery.text = text;
        }
    }

    /// The smallest scene of the scope in which the subject fails in the same way, and by one of these causes if there are any.
    fn shrink(&self, scene: &Scene, wrong: &Wrong, words: Option<&[String]>) -> Shrunk {
        let fails = |scene: &Scene| {
            let is_offered = |(schema, _): &(&IntegratorSchema, &str)| *schema == scene.integrator;
            if !self.scope.integrators.iter().any(is_offered) {
                return None;
            }
            let text = plain(scene)?;
            let scene = read(&text)?;
            let judged = self.judge.judge(self.subject, &scene, &text);
            let Judgement::Wrong(found) = judged else { return None };
            let is_same = found.failure.name() == wrong.failure.name()
                && words.is_none_or(|words| cause::shows(&scene, &found, words));
            (is_same && !(self.is_stopped)()).then_some(*found)
        };
        shrink(scene, wrong, &fails, self.effort)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

    use grader::submission::StateSource;
    use grader::verdict::Verdict;

    use super::*;
    use crate::motion::{Held, simulate};

    /// Our own simulator with fixed particles that move.
    struct Loose;

    impl Subject for Loose {
        fn start(&self, scene: &Scene, _: &str) -> Result<Box<dyn StateSource>, Verdict> {
            let mut scene = scene.clone();
            scene.particles.iter_mut().for_each(|particle| particle.fixed = false);
            Ok(Box::new(Held::of(simulate(&scene).unwrap_or_default())))
        }
    }

    fn plan() -> Plan {
        Plan {
            scope: Scope::all(),
            seed: 1,
            time: Duration::MAX,
            scenes: 1000,
            failures: 10,
            effort: Effort::default(),
        }
    }

    /// Our own simulator, and how many scenes of it have a pair under an integrator.
    #[derive(Default)]
    struct Counted(Mutex<HashMap<(Pair, &'static str), u32>>);

    impl Subject for Counted {
        fn start(&self, scene: &Scene, _: &str) -> Result<Box<dyn StateSource>, Verdict> {
            let mut counts = self.0.lock().unwrap();
            for pair in pairs(scene) {
                *counts.entry((pair, scene.integrator.name)).or_default() += 1;
            }
            Ok(Box::new(Held::of(simulate(scene).unwrap_or_default())))
        }
    }

    #[test]
    fn rare_circumstances_are_tried_early_with_each_force_and_integrator() {
        let mut plan = plan();
        let forces = ["springforce", "gravitationalforce"];
        let integrators = ["explicit-euler", "linearized-implicit-euler", "implicit-euler"];
        plan.scope.forces.retain(|schema| forces.contains(&schema.tag));
        plan.scope.integrators.retain(|(_, spelling)| integrators.contains(spelling));
        let counted = Counted::default();
        run(&counted, &Judge::default(), &plan, &|| false, &|_| {});
        let counts = counted.0.into_inner().unwrap();
        let rare = [
            "diagonal",
            "many at a particle",
            "close",
            "far from the origin",
            "with equal velocities",
            "between fixed particles",
            "very light",
            "very heavy",
            "no step",
        ];
        for feature in forces {
            for (with, under) in rare.iter().flat_map(|with| integrators.map(|under| (with, under)))
            {
                let count = counts.get(&(Pair { feature, with }, under)).copied().unwrap_or(0);
                assert!(count >= 4, "{feature}, {with}, {under}: {count}");
            }
        }
    }

    #[test]
    fn a_failure_is_shrunk_unless_the_run_is_interrupted() {
        let found = run(&Loose, &Judge::default(), &plan(), &|| false, &|_| {});
        let smallest = measure(&found.discoveries[0].shrunk.scene);
        assert!(smallest[0] <= 2 && smallest[2] == 1, "{smallest:?}");

        let is_stopped = AtomicBool::new(false);
        let stop = |tally: &Tally| is_stopped.store(tally.wrong > 0, Relaxed);
        let found = run(&Loose, &Judge::default(), &plan(), &|| is_stopped.load(Relaxed), &stop);
        assert_eq!(found.discoveries.len(), 1);
        assert_eq!(found.discoveries[0].shrunk.runs, 0);
        assert_eq!(found.discoveries[0].count as u64, found.tally.wrong);
    }
}
