//! Pairs of causes that act together.
//!
//! A scene fails if either cause makes it fail: `p = max(p₁, p₂)`. For each pair of features, the best circumstances
//! count. Cost: pairs of causes times scenes, about two million terms for a suite of 140 scenes.

use rayon::prelude::*;

use super::feature::{Feature, Symptom};
use super::{Judged, SPECIAL, Suspect, hypotheses, of_evidence, weigh};

/// Share of the submissions with a mistake that have a second one, of any kind.
const SECOND: f64 = 0.3;

/// A cause with its contribution to the score, scene by scene.
struct Weighed {
    feature: Feature,
    prior: f64,
    /// For each scene, the probability of a failure and the log-likelihood of the evidence.
    terms: Vec<(f64, f64)>,
}

/// The likeliest pair of different features, with its score; the cause that explains more comes first.
pub(super) fn best(judged: &[&Judged<'_>], symptom: Symptom) -> Option<(f64, Vec<Suspect>)> {
    let causes = hypotheses(judged, symptom);
    let weighed: Vec<Weighed> = causes
        .iter()
        .map(|cause| Weighed {
            feature: cause.feature,
            prior: if cause.special { SPECIAL.ln() } else { 0.0 },
            terms: judged
                .iter()
                .map(|scene| {
                    let evidence = scene.clue.as_ref();
                    let evidence =
                        evidence.map_or(0.0, |clue| of_evidence(cause.feature, clue, symptom));
                    ((cause.expects)(&scene.case.scene).probability(), evidence)
                })
                .collect(),
        })
        .collect();
    let failed: Vec<bool> = judged.iter().map(|scene| scene.clue.is_some()).collect();
    let of_first = |first: usize| {
        let seconds = (first + 1..weighed.len())
            .filter(|second| weighed[*second].feature != weighed[first].feature);
        let scored =
            seconds.map(|second| (score(&weighed[first], &weighed[second], &failed), second));
        // Of equally likely causes, the one listed first.
        scored
            .reduce(|best, next| if next.0 > best.0 { next } else { best })
            .map(|(s, j)| (s, first, j))
    };
    let found: Vec<Option<(f64, usize, usize)>> =
        (0..weighed.len()).into_par_iter().map(of_first).collect();
    let (score, first, second) = found
        .into_iter()
        .flatten()
        .reduce(|best, next| if next.0 > best.0 { next } else { best })?;
    let score = score + (SECOND / weighed.len() as f64).ln();
    let mut suspects = [first, second].map(|cause| weigh(&causes[cause], judged, symptom)).to_vec();
    suspects.sort_by_key(|suspect| std::cmp::Reverse(suspect.explained));
    Some((score, suspects))
}

fn score(a: &Weighed, b: &Weighed, failed: &[bool]) -> f64 {
    let terms = a.terms.iter().zip(&b.terms).zip(failed).map(|((a, b), failed)| {
        let (p, evidence) = if a.0 > b.0 || (a.0 == b.0 && a.1 >= b.1) { *a } else { *b };
        if *failed { p.ln() + evidence } else { (1.0 - p).ln() }
    });
    a.prior + b.prior + terms.sum::<f64>()
}
