//! Likely causes of a submission's failures, inferred from which scenes fail and which pass.
//!
//! ```text
//! verdicts × scenes ── clue.rs    evidence from one failure: form, digits, the position rule
//!                   ── scope.rs   each cause with the scenes that it makes fail
//!                   ── mod.rs     log P(verdicts | cause) for all causes, ranked
//! ```
//!
//! A cause predicts for each scene that it fails, may fail or passes. With `p` the probability of a failure for each of
//! the three, the score of a cause is `Σ log p(failed) + Σ log (1 − p(passed))`, with a penalty for causes that need
//! special circumstances. One cause is reported if every other is less likely by a factor of [`CLEAR`]. Two are
//! reported if they are close, or if both together explain what neither does alone. None is reported if no cause fits
//! better than chance.

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

/// Ratio of likelihoods above which the best cause is reported alone.
pub const CLEAR: f64 = 20.0;

/// Prior probability of a cause that needs special circumstances (unequal masses, several elements, …), relative to
/// one that needs none.
const SPECIAL: f64 = 0.1;

/// Minimum share of the failing scenes that a reported cause explains.
const MOST: f64 = 0.75;

/// If all of fewer scenes than this fail, no cause is inferred.
const FEW: usize = 5;

/// Number of suspects that are kept.
const KEPT: usize = 5;

/// Likely causes of a submission's failures.
#[derive(Debug, Clone, PartialEq)]
pub struct Blame {
    /// One finding for each symptom, the most frequent first. Scenes with one symptom are no evidence on the causes of
    /// another.
    pub findings: Vec<Finding>,
}

/// The causes of all failures with one symptom.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The symptom.
    pub symptom: Symptom,
    /// The likeliest causes, in falling order.
    pub suspects: Vec<Suspect>,
    /// Number of reported suspects: 1 if one stands out, 2 if two are close or act together, 0 if the cause is unknown.
    pub named: usize,
    /// Whether the two reported causes act together, rather than being alternatives.
    pub together: bool,
    /// Number of scenes that failed with this symptom.
    pub failing: usize,
}

impl Finding {
    /// The reported suspects.
    pub fn named(&self) -> &[Suspect] {
        &self.suspects[..self.named]
    }
}

/// A suspected cause.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspect {
    /// The symptom.
    pub symptom: Symptom,
    /// The feature at fault.
    pub feature: Feature,
    /// The circumstances or the kind of mistake; may be empty.
    pub detail: String,
    /// Number of failing scenes that it explains.
    pub explained: usize,
    /// Number of passing scenes that contradict it.
    pub against: usize,
    /// Log-likelihood of the verdicts under this cause, up to a constant.
    pub score: f64,
}

impl Suspect {
    /// The feature and the circumstances, in words.
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

/// A scene with its evidence.
struct Judged<'a> {
    case: &'a Case,
    /// `None` where it passed.
    clue: Option<Clue>,
}

impl Blame {
    /// Explains the verdicts; `None` if nothing failed. Scenes that could not be judged are ignored.
    pub fn of<'a>(results: impl IntoIterator<Item = (&'a Case, &'a Comparison)>) -> Option<Self> {
        let judged: Vec<Judged<'a>> = results
            .into_iter()
            .filter(|(_, comparison)| !matches!(comparison.verdict, Verdict::GraderFault(_)))
            .map(|(case, comparison)| Judged { case, clue: Clue::of(case, comparison) })
            .collect();
        // The compiler's message is in the report already.
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
        // Stable: equally frequent symptoms keep their order.
        findings.sort_by_key(|finding| std::cmp::Reverse(finding.failing));
        (!findings.is_empty()).then_some(Self { findings })
    }
}

impl Finding {
    /// The finding for one symptom, from scenes that passed or failed with it; `None` if none did.
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
            // If traces elsewhere have the right form, the pattern of failing scenes is better evidence.
            let differs =
                |best: &Suspect| best.feature != Feature::Everything && best.score > baseline;
            if is_certain || !suspects.first().is_some_and(differs) {
                convincing = baseline;
                is_told = true;
                suspects = vec![Suspect { score: baseline, ..told }];
            }
        }
        if failing == judged.len() && failing >= FEW {
            // Nothing explains a failure of all scenes better than chance.
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
        // A certain cause, or one that explains everything, needs no second one.
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

/// Log-likelihood of the verdicts if scenes fail by chance.
fn baseline(judged: &[&Judged<'_>], failing: usize, symptom: Symptom) -> f64 {
    let rate = (failing as f64 / judged.len() as f64).clamp(0.05, 0.95);
    let score = |scene: &&Judged<'_>| match &scene.clue {
        Some(clue) => rate.ln() + of_evidence(Feature::Everything, clue, symptom),
        None => (1.0 - rate).ln(),
    };
    judged.iter().map(score).sum()
}

/// Contribution of a failure's evidence to a score.
fn of_evidence(feature: Feature, clue: &Clue, symptom: Symptom) -> f64 {
    if symptom == Symptom::Wrong { likelihood(feature, clue.evidence).ln() } else { 0.0 }
}

/// All causes that distinguish scenes, the likeliest first; for each feature, its best circumstances.
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
    // Stable: of equally likely causes, the one listed first wins.
    suspects.sort_by(|a, b| b.score.total_cmp(&a.score));
    suspects
}

/// The possible causes of failures with this symptom.
fn hypotheses(judged: &[&Judged<'_>], symptom: Symptom) -> Vec<Hypothesis> {
    let mut all = scope::hypotheses(judged.iter().map(|scene| scene.case));
    // Rounding only shows in wrong numbers.
    all.retain(|cause| cause.feature != Feature::Precision || symptom == Symptom::Wrong);
    all
}

/// Scores a cause against the verdicts.
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

/// Probability of this evidence if that feature is wrong.
///
/// A force moves no fixed particle, and does not affect the position rule. Rounding errors start almost right; other
/// mistakes do so only where they grow slowly.
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
        // Another dt always violates the position rule.
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

/// Number of scenes for each kind of failure.
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
        // Stable: the kind seen first comes first.
        kinds.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        Self(kinds)
    }

    /// The cause that the failures themselves show, and whether it is certain whatever the scenes; `None` if only the
    /// pattern of failing scenes can show it.
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
