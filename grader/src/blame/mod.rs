//! What a failing submission looks as if it had wrong, judged by which scenes fail and which pass.
//!
//! ```text
//! verdicts × scenes ── clue.rs    what one failure says by itself: form, digits, the rule of positions
//!                   ── scope.rs   each cause with the scenes that it would make fail
//!                   ── mod.rs     log P(verdicts | cause) for all causes, ranked
//! ```
//!
//! A cause says of each scene that it fails, may fail or passes. With `p` the probability of a failure under
//! each of the three, the score of a cause is `Σ log p(failed) + Σ log (1 − p(passed))`, less a penalty for a
//! cause that names special circumstances. A cause is named alone where no other comes within a factor of
//! [`CLEAR`]; two are named where they are close, or where two together explain what neither does alone; nothing is
//! said where none fits better than no cause at all.

mod clue;
mod feature;
mod pair;
mod scope;

use std::fmt;

use crate::compare::Comparison;
use crate::suite::Case;
use crate::verdict::Verdict;

use clue::{Clue, Evidence, Kind};
pub use feature::{Family, Feature, Part, Symptom};
use scope::{Expected, Hypothesis};

/// How many times as likely as the next a cause must be to be named alone.
pub const CLEAR: f64 = 20.0;

/// How much less likely a cause is beforehand that needs special circumstances (unequal masses, several
/// elements, …).
const SPECIAL: f64 = 0.1;

/// The share of the failing scenes that a cause must explain to be named.
const MOST: f64 = 0.75;

/// From fewer scenes nothing follows where all of them fail.
const FEW: usize = 5;

/// How many suspects are kept.
const KEPT: usize = 5;

/// What a failing submission looks as if it had wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Blame {
    /// One for each way in which scenes failed, the most frequent first. Scenes that failed in one way say nothing
    /// of the causes of another.
    pub findings: Vec<Finding>,
}

/// What is behind failures of one sort.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// How they show.
    pub symptom: Symptom,
    /// The likeliest causes, the likeliest first.
    pub suspects: Vec<Suspect>,
    /// How many of them are named: 1 where it is clear, 2 where two are close or are at work together, 0 where
    /// there is no telling.
    pub named: usize,
    /// Whether the two that are named are at work together, and not one or the other.
    pub together: bool,
    /// Scenes that failed so.
    pub failing: usize,
}

impl Finding {
    /// Those that are named.
    pub fn named(&self) -> &[Suspect] {
        &self.suspects[..self.named]
    }
}

/// A cause that is suspected.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspect {
    /// How it shows.
    pub symptom: Symptom,
    /// What is wrong.
    pub feature: Feature,
    /// In which circumstances, or in what way; empty where there is no more to say.
    pub detail: String,
    /// Failing scenes that it explains.
    pub explained: usize,
    /// Passing scenes that speak against it.
    pub against: usize,
    /// Logarithm of how likely the verdicts are with it, up to a constant.
    pub score: f64,
}

impl Suspect {
    /// What is wrong, in words, and in which circumstances.
    pub fn cause(&self) -> String {
        let Self { feature, detail, .. } = self;
        if detail.is_empty() { feature.to_string() } else { format!("{feature} ({detail})") }
    }
}

impl fmt::Display for Suspect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cause = self.cause();
        match self.symptom {
            Symptom::Wrong => f.write_str(&cause),
            symptom => write!(f, "{symptom}: {cause}"),
        }
    }
}

/// A scene with what became of it.
struct Judged<'a> {
    case: &'a Case,
    /// `None` where it passed.
    clue: Option<Clue>,
}

impl Blame {
    /// What explains these verdicts; `None` where nothing failed. Scenes that could not be judged say nothing.
    pub fn of<'a>(results: impl IntoIterator<Item = (&'a Case, &'a Comparison)>) -> Option<Self> {
        let judged: Vec<Judged<'a>> = results
            .into_iter()
            .filter(|(_, comparison)| !matches!(comparison.verdict, Verdict::GraderFault(_)))
            .map(|(case, comparison)| Judged { case, clue: Clue::of(case, comparison) })
            .collect();
        // The compiler has told what it looks like.
        if judged
            .iter()
            .any(|scene| scene.clue.as_ref().is_some_and(|clue| clue.kind == Kind::NotBuilt))
        {
            return None;
        }
        let of_symptom = |symptom: Symptom| {
            let of_it = |scene: &&Judged<'_>| {
                scene.clue.as_ref().is_none_or(|clue| clue.kind.symptom() == symptom)
            };
            let judged: Vec<&Judged<'_>> = judged.iter().filter(of_it).collect();
            Finding::of(symptom, &judged)
        };
        let mut findings: Vec<Finding> = Symptom::ALL.into_iter().filter_map(of_symptom).collect();
        // Stable: of two that are as frequent, in the order of the symptoms.
        findings.sort_by_key(|finding| std::cmp::Reverse(finding.failing));
        (!findings.is_empty()).then_some(Self { findings })
    }
}

impl Finding {
    /// Of scenes that passed, or failed in this way; `None` where none did.
    fn of(symptom: Symptom, judged: &[&Judged<'_>]) -> Option<Self> {
        let failing = judged.iter().filter(|scene| scene.clue.is_some()).count();
        if failing == 0 {
            return None;
        }
        let baseline = baseline(judged, failing, symptom);
        let mut suspects = ranking(judged, symptom);
        let mut convincing = baseline + CLEAR.ln();
        let mut is_told = false;
        if let Some((told, is_certain)) = Kinds::of(judged).told(failing) {
            // A trace that is in order elsewhere is written in order: then the scenes tell more.
            let differs =
                |best: &Suspect| best.feature != Feature::Everything && best.score > baseline;
            if is_certain || !suspects.first().is_some_and(differs) {
                convincing = baseline;
                is_told = true;
                suspects = vec![Suspect { score: baseline, ..told }];
            }
        }
        if failing == judged.len() && failing >= FEW {
            // Nothing could explain it better than chance that fails always.
            convincing = baseline;
        }
        let enough = |suspect: &&Suspect| {
            suspect.score >= convincing && suspect.explained as f64 >= MOST * failing as f64
        };
        let best = suspects.first().map_or(f64::NEG_INFINITY, |suspect| suspect.score);
        let close = |suspect: &&Suspect| best - suspect.score < CLEAR.ln();
        let mut named = match suspects.iter().take_while(close).filter(enough).count() {
            few @ (1 | 2) => few,
            _ => 0,
        };
        // What is told, or explains all by itself, needs no second cause.
        let suffices = |only: &Suspect| only.explained == failing && only.against == 0;
        let is_enough = is_told || named == 1 && suspects.first().is_some_and(suffices);
        let pair = if is_enough { None } else { pair::best(judged, symptom) };
        let pair = pair.filter(|(score, of_both)| {
            let both = of_both.iter().map(|suspect| suspect.explained).max();
            let alone = if named == 0 { f64::NEG_INFINITY } else { best };
            *score >= convincing.max(alone + CLEAR.ln()) && both.is_some_and(|most| most < failing)
        });
        let together = pair.is_some();
        if let Some((_, of_both)) = pair {
            suspects.retain(|suspect| of_both.iter().all(|of| of.feature != suspect.feature));
            suspects.splice(0..0, of_both);
            named = 2;
        }
        suspects.truncate(KEPT);
        Some(Self { symptom, suspects, named, together, failing })
    }
}

/// How likely the verdicts are if scenes fail by chance alone.
fn baseline(judged: &[&Judged<'_>], failing: usize, symptom: Symptom) -> f64 {
    let rate = (failing as f64 / judged.len() as f64).clamp(0.05, 0.95);
    let score = |scene: &&Judged<'_>| match &scene.clue {
        Some(clue) => rate.ln() + of_evidence(Feature::Everything, clue, symptom),
        None => (1.0 - rate).ln(),
    };
    judged.iter().map(score).sum()
}

/// What the evidence of a failure adds to a score.
fn of_evidence(feature: Feature, clue: &Clue, symptom: Symptom) -> f64 {
    if symptom == Symptom::Wrong { likelihood(feature, clue.evidence).ln() } else { 0.0 }
}

/// All causes that differ between scenes, the likeliest first; of each feature, the circumstances that fit best.
fn ranking(judged: &[&Judged<'_>], symptom: Symptom) -> Vec<Suspect> {
    let mut suspects: Vec<Suspect> = Vec::new();
    for hypothesis in hypotheses(judged, symptom) {
        let suspect = weigh(&hypothesis, judged, symptom);
        if suspect.explained == 0 {
            continue;
        }
        match suspects.iter_mut().find(|known| known.feature == suspect.feature) {
            Some(known) if known.score < suspect.score => *known = suspect,
            Some(_) => {}
            None => suspects.push(suspect),
        }
    }
    // Stable: of two that are alike, the one listed first.
    suspects.sort_by(|a, b| b.score.total_cmp(&a.score));
    suspects
}

/// The causes of failures of this sort.
fn hypotheses(judged: &[&Judged<'_>], symptom: Symptom) -> Vec<Hypothesis> {
    let mut all = scope::hypotheses(judged.iter().map(|scene| scene.case));
    // Rounding shows in numbers alone.
    all.retain(|cause| cause.feature != Feature::Precision || symptom == Symptom::Wrong);
    all
}

/// How well a cause explains the verdicts.
fn weigh(hypothesis: &Hypothesis, judged: &[&Judged<'_>], symptom: Symptom) -> Suspect {
    let Hypothesis { feature, detail, .. } = hypothesis;
    let mut score = if hypothesis.special { SPECIAL.ln() } else { 0.0 };
    let (mut explained, mut against) = (0, 0);
    for Judged { case, clue } in judged {
        let expected = (hypothesis.expects)(&case.scene);
        match clue {
            Some(clue) => {
                score += expected.probability().ln() + of_evidence(*feature, clue, symptom);
                explained += usize::from(expected != Expected::Passes);
            }
            None => {
                score += (1.0 - expected.probability()).ln();
                against += usize::from(expected == Expected::Fails);
            }
        }
    }
    let detail = detail.clone();
    Suspect { symptom, feature: *feature, detail, explained, against, score }
}

/// How likely a failure is to be of this sort where that feature is wrong.
///
/// A force moves no fixed particle, and positions follow velocities by a rule that knows no force. Rounding is
/// nearly right at first, other mistakes are only where they grow slowly.
fn likelihood(feature: Feature, evidence: Evidence) -> f64 {
    const NEVER: f64 = 1e-3;
    let Evidence { fixed_is_wrong, rule_is_broken, nearly_right } = evidence;
    let fixed = match (feature, fixed_is_wrong) {
        (Feature::Force(_) | Feature::Jacobian(_), true) => NEVER,
        (Feature::Fixed(_), _) => 0.5,
        (_, true) => 0.2,
        (_, false) => 1.0,
    };
    let rule = match (feature, rule_is_broken) {
        (Feature::Force(_) | Feature::Jacobian(_), true) => NEVER,
        (Feature::Integrator(_) | Feature::Fixed(_), true) => 0.3,
        // Another dt breaks it always.
        (Feature::Reading, true) => 0.5,
        (_, true) => 0.1,
        (Feature::Integrator(_), false) => 0.7,
        (_, false) => 1.0,
    };
    let size = match (feature, nearly_right) {
        (Feature::Precision, true) => 0.95,
        (Feature::Precision, false) => 0.05,
        (_, true) => 0.3,
        (_, false) => 0.7,
    };
    fixed * rule * size
}

/// How many scenes failed in which way.
struct Kinds(Vec<(Kind, usize)>);

impl Kinds {
    fn of(judged: &[&Judged<'_>]) -> Self {
        let mut kinds: Vec<(Kind, usize)> = Vec::new();
        for Clue { kind, .. } in judged.iter().filter_map(|scene| scene.clue.as_ref()) {
            match kinds.iter_mut().find(|(known, _)| known == kind) {
                Some((_, count)) => *count += 1,
                None => kinds.push((kind.clone(), 1)),
            }
        }
        // Stable: the kind met first comes first.
        kinds.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        Self(kinds)
    }

    /// What the failures say by themselves, and whether that is certain whichever the scenes; `None` where it takes
    /// the pattern of them.
    fn told(&self, failing: usize) -> Option<(Suspect, bool)> {
        let mut features: Vec<(Feature, usize)> = Vec::new();
        for (kind, count) in &self.0 {
            let Some(feature) = kind.feature() else { continue };
            match features.iter_mut().find(|(known, _)| *known == feature) {
                Some((_, sum)) => *sum += count,
                None => features.push((feature, *count)),
            }
        }
        let (feature, explained) = features.into_iter().max_by_key(|(_, count)| *count)?;
        if (explained as f64) < MOST * failing as f64 {
            return None;
        }
        let kind = &self.0.iter().find(|(kind, _)| kind.feature() == Some(feature))?.0;
        let suspect = Suspect {
            symptom: Symptom::Wrong,
            feature,
            detail: kind.to_string(),
            explained,
            against: 0,
            score: 0.0,
        };
        Some((suspect, kind.is_certain()))
    }
}
