//! Circuit breaker: scenes of a feature that are not run after several failures of the same kind.
//!
//! The scenes of a feature run one after the other, and features in parallel, so that the result does not depend on
//! timing. A program whose first scenes of several features all time out is not run further at all. A scene that is
//! not run fails like those before it: no verdict improves.

use crate::boundary::printed::Untrusted;
use crate::rubric::Breaker;
use crate::suite::Case;
use crate::verdict::{Failure, Verdict};

/// Number of features whose first scenes are run before the others.
pub(super) const PILOTS: usize = 4;

/// The failures of one feature so far.
#[derive(Debug, Clone, Default)]
pub(super) struct Failures {
    timeouts: Vec<Untrusted>,
    /// Messages of crashes.
    crashes: Vec<Untrusted>,
}

impl Failures {
    /// Adds the verdict of a scene that was run.
    pub(super) fn add(&mut self, verdict: &Verdict) {
        match verdict {
            Verdict::Fail(Failure::TimedOut { detail }) => self.timeouts.push(detail.clone()),
            Verdict::Fail(Failure::Crashed { detail }) => self.crashes.push(detail.clone()),
            _ => {}
        }
    }

    /// The failure of a further scene, if it is not run.
    pub(super) fn next(&self, breaker: Breaker) -> Option<Failure> {
        let is_reached = |count: usize, limit: usize| limit > 0 && count >= limit;
        if is_reached(self.timeouts.len(), breaker.timeouts) {
            let detail = format!("not run: {} time-outs before in this feature", breaker.timeouts);
            return Some(Failure::TimedOut { detail: detail.into() });
        }
        let last = self.crashes.last()?;
        let same = self.crashes.iter().rev().take_while(|message| *message == last).count();
        is_reached(same, breaker.crashes).then(|| Failure::Crashed {
            detail: format!(
                "not run: {same} crashes with the same message before: {}",
                last.text()
            )
            .into(),
        })
    }
}

/// The failure of all further scenes if each of the first scenes of [`PILOTS`] features timed out.
pub(super) fn after_pilots<'a>(
    verdicts: impl Iterator<Item = &'a Verdict>,
    breaker: Breaker,
) -> Option<Failure> {
    let mut count = 0;
    for verdict in verdicts {
        if !matches!(verdict, Verdict::Fail(Failure::TimedOut { .. })) {
            return None;
        }
        count += 1;
    }
    let detail = format!("not run: the first scenes of {count} features all timed out").into();
    (count >= PILOTS && breaker.timeouts > 0).then_some(Failure::TimedOut { detail })
}

/// The scenes of each feature, features and scenes in the order of the suite.
pub(super) fn by_feature(cases: &[Case]) -> Vec<Vec<&Case>> {
    let mut features: Vec<Vec<&Case>> = Vec::new();
    for case in cases {
        match features.iter_mut().find(|known| known[0].feature == case.feature) {
            Some(known) => known.push(case),
            None => features.push(vec![case]),
        }
    }
    features
}

#[cfg(test)]
mod tests {
    use super::*;

    fn failures(verdicts: &[Failure]) -> Failures {
        let mut failures = Failures::default();
        verdicts.iter().for_each(|failure| failures.add(&Verdict::Fail(failure.clone())));
        failures
    }

    fn crash(detail: &str) -> Failure {
        Failure::Crashed { detail: detail.into() }
    }

    fn timeout() -> Failure {
        Failure::TimedOut { detail: "still ran after 10 s".into() }
    }

    #[test]
    fn feature_stops_after_repeated_time_outs_or_equal_crashes() {
        let breaker = Breaker { timeouts: 2, crashes: 3 };
        let next = |verdicts: &[Failure]| failures(verdicts).next(breaker).map(|f| f.name());
        assert_eq!(next(&[timeout()]), None);
        assert_eq!(next(&[timeout(), crash("a"), timeout()]), Some("timed-out"));
        assert_eq!(next(&[crash("a"), crash("a")]), None);
        assert_eq!(next(&[crash("a"), crash("a"), crash("a")]), Some("crashed"));
        assert_eq!(next(&[crash("a"), crash("b"), crash("a"), crash("b")]), None);
        assert_eq!(next(&[Failure::Differs, Failure::Differs, Failure::Differs]), None);
        let never = Breaker { timeouts: 0, crashes: 0 };
        assert_eq!(failures(&[timeout(), timeout(), timeout()]).next(never), None);
    }

    #[test]
    fn a_program_that_only_times_out_is_not_run_further() {
        let all = |verdicts: &[Verdict]| {
            after_pilots(verdicts.iter(), Breaker::default()).map(|failure| failure.name())
        };
        let timed_out = vec![Verdict::Fail(timeout()); PILOTS];
        assert_eq!(all(&timed_out), Some("timed-out"));
        assert_eq!(all(&timed_out[1..]), None);
        let mut one_passed = timed_out;
        one_passed[3] = Verdict::Pass;
        assert_eq!(all(&one_passed), None);
    }
}
