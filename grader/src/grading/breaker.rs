//! Circuit breaker: scenes of a feature that are not run after several failures of the same kind.
//!
//! The scenes of a feature run one after the other, and features in parallel, so that the result does not depend on
//! timing. A program whose first scenes of several features all time out is not run further at all. A scene that is
//! not run fails like those before it: no verdict improves.

use crate::rubric::Breaker;
use crate::suite::Case;
use crate::verdict::{Failure, Skipped, Verdict};

/// Number of features whose first scenes are run before the others; those that a program refuses are not counted.
pub(super) const PILOTS: usize = 4;

/// The failures of one feature so far.
#[derive(Debug, Clone, Default)]
pub(super) struct Failures {
    timeouts: usize,
    crashes: Vec<Failure>,
}

impl Failures {
    /// Adds the verdict of a scene that was run.
    pub(super) fn add(&mut self, verdict: &Verdict) {
        if let Verdict::Fail(failure) = verdict {
            self.timeouts += usize::from(failure.is_timeout());
            self.crashes.extend(Some(failure.clone()).filter(Failure::is_crash));
        }
    }

    /// The failure of a further scene, if it is not run.
    pub(super) fn next(&self, breaker: Breaker) -> Option<Failure> {
        let is_reached = |count: usize, limit: usize| limit > 0 && count >= limit;
        if is_reached(self.timeouts, breaker.timeouts) {
            return Some(Failure::Skipped(Skipped::TimeOuts { count: breaker.timeouts }));
        }
        let last = self.crashes.last()?;
        let count = self.crashes.iter().rev().take_while(|crash| *crash == last).count();
        let crashes = Skipped::Crashes { count, last: Box::new(last.clone()) };
        is_reached(count, breaker.crashes).then_some(Failure::Skipped(crashes))
    }
}

/// The failure of all further scenes if each of the first scenes of [`PILOTS`] features timed out.
pub(super) fn after_pilots<'a>(
    verdicts: impl Iterator<Item = &'a Verdict>,
    breaker: Breaker,
) -> Option<Failure> {
    let mut count = 0;
    for verdict in verdicts.filter(|verdict| !verdict.is_lack()) {
        if !matches!(verdict, Verdict::Fail(failure) if failure.is_timeout()) {
            return None;
        }
        count += 1;
    }
    let skipped = Failure::Skipped(Skipped::Features { count });
    (count >= PILOTS && breaker.timeouts > 0).then_some(skipped)
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
    use crate::verdict::{Lack, LastOutput, RunEnd, RunFailure};

    fn failures(verdicts: &[Failure]) -> Failures {
        let mut failures = Failures::default();
        verdicts.iter().for_each(|failure| failures.add(&Verdict::Fail(failure.clone())));
        failures
    }

    fn run(end: RunEnd, text: &str) -> Failure {
        let output = LastOutput { text: text.into(), misses_file: false };
        RunFailure { end, output }.into()
    }

    fn crash(text: &str) -> Failure {
        run(RunEnd::Exited(1), text)
    }

    fn timeout() -> Failure {
        run(RunEnd::Wall(10.0), "")
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
        let refused = Lack::LeftOut { words: "springforce".into() };
        let lack = Verdict::Fail(Failure::NotImplemented(refused));
        assert_eq!(all(&[vec![lack], timed_out.clone()].concat()), Some("timed-out"));
        let mut one_passed = timed_out;
        one_passed[3] = Verdict::Pass;
        assert_eq!(all(&one_passed), None);
    }
}
