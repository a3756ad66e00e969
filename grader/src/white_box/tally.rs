//! Gathers the observations of many states into one verdict for each kind of block.

use std::collections::BTreeSet;

use super::check::{Observation, ObservedBlock};
use super::states::CheckState;
use super::verdict::{BlockFinding, BlockKind, By, Exhibit, Part};
use jacobian::verdict::{Entry, Judgement, Reason, Verdict};
use reference::law::Term;
use scene::schema::ForceSchema;

/// One kind of block over all states so far.
pub(super) struct Tally {
    kind: BlockKind,
    /// The law's parameters, and whether each has to affect the block.
    required: Vec<(&'static str, bool)>,
    /// Whether each parameter was seen to affect the block.
    shown: Vec<bool>,
    evidence: usize,
    /// States at which the force was nonzero, but the block was zero by every estimate.
    zeros: usize,
    undecided: usize,
    reason: Option<Reason>,
    /// Row and column of blocks without a verdict at some state, and of those that agreed at some.
    open_places: BTreeSet<(usize, usize)>,
    agreed_places: BTreeSet<(usize, usize)>,
    /// The worst contradiction.
    wrong: Option<(f64, Box<Exhibit>)>,
    /// The first block whose verdict is open for the most severe reason.
    open: Option<(Reason, Box<Exhibit>)>,
    /// The largest error of an entry that agrees.
    largest: Option<(f64, Box<Exhibit>)>,
}

impl Tally {
    /// A tally for each kind of block of this force. A parameter that is zero at all `states` has to affect nothing.
    pub(super) fn all(schema: &ForceSchema, states: &[CheckState]) -> [Self; 4] {
        let elements = || states.iter().flat_map(|state| &state.scene.forces);
        let terms = Term::of(schema);
        BlockKind::ALL.map(|kind| {
            let shows =
                |by: By| by == kind.by && (kind.part == Part::Direct || !schema.stencil.is_field());
            let required = terms.iter().zip(schema.parameters).map(|(term, parameter)| {
                let is_there = elements().any(|of| of.parameter(parameter.name) != 0.0);
                let shows = (term.by_position && shows(By::Position))
                    || (term.by_velocity && shows(By::Velocity));
                (term.parameter, is_there && shows)
            });
            Self {
                kind,
                required: required.collect(),
                shown: vec![false; terms.len()],
                evidence: 0,
                zeros: 0,
                undecided: 0,
                reason: None,
                open_places: BTreeSet::new(),
                agreed_places: BTreeSet::new(),
                wrong: None,
                open: None,
                largest: None,
            }
        })
    }

    /// Adds a state at which the force is undefined.
    pub(super) fn add_degenerate(&mut self) {
        self.undecide(Reason::Degenerate);
    }

    /// Adds an observation at `state`.
    pub(super) fn add(&mut self, state: &CheckState, observation: &Observation) {
        let (mut seen, mut zero, mut undecided) = (false, true, None);
        let kind = self.kind;
        for block in observation.blocks.iter().filter(|block| block.kind == kind) {
            let judgements: Vec<Judgement> = block.entries.iter().map(Entry::judge).collect();
            zero &= block.entries.iter().all(is_zero);
            let reasons = judgements.iter().filter_map(|judgement| match judgement {
                Judgement::Undecided(reason) => Some(*reason),
                Judgement::Agrees | Judgement::Wrong => None,
            });
            // The most severe first, which is the order of the reasons.
            let reason = reasons.min();
            if let Some(reason) = reason {
                self.open_places.insert((block.row, block.column));
                self.leave_open(state, block, reason, &judgements);
            }
            undecided = reason.into_iter().chain(undecided).min();
            if judgements.contains(&Judgement::Wrong) {
                self.contradict(state, block, &judgements);
            } else if judgements.iter().all(|judgement| *judgement == Judgement::Agrees) {
                self.agree(state, block);
                self.agreed_places.insert((block.row, block.column));
                seen |= block.seen;
            }
        }
        self.evidence += usize::from(seen);
        self.zeros += usize::from(zero && observation.force_seen && undecided.is_none());
        if let Some(reason) = undecided {
            self.undecide(reason);
        }
    }

    /// The verdict.
    pub(super) fn finish(self) -> BlockFinding {
        let required = || self.required.iter().zip(&self.shown).filter(|((_, shows), _)| *shows);
        let unseen: Vec<&str> =
            required().filter(|(_, shown)| !**shown).map(|((name, _), _)| *name).collect();
        let is_zero = required().next().is_none();
        // Agreement of one pair of particles is no evidence on another that could never be judged.
        let settled = self.open_places.is_subset(&self.agreed_places);
        let verdict = match self.reason {
            _ if self.wrong.is_some() => Verdict::Wrong,
            Some(Reason::Disagreement) => Verdict::Inconclusive(Reason::Disagreement),
            _ if !is_zero && settled && self.evidence > 0 && unseen.is_empty() => Verdict::Correct,
            _ if is_zero && settled && self.zeros > 0 => Verdict::CorrectZero,
            reason => Verdict::Inconclusive(reason.unwrap_or(Reason::NoEvidence)),
        };
        let Self { kind, evidence, zeros, undecided, wrong, open, largest, .. } = self;
        let open = open.filter(|_| verdict.reason().is_some());
        let exhibit = wrong.map(|(_, exhibit)| exhibit);
        let exhibit = exhibit.or(open.map(|(_, exhibit)| exhibit));
        BlockFinding {
            kind,
            verdict,
            evidence: if is_zero { zeros } else { evidence },
            undecided,
            unseen,
            exhibit: exhibit.or(largest.map(|(_, exhibit)| exhibit)),
        }
    }

    fn undecide(&mut self, reason: Reason) {
        self.undecided += 1;
        self.reason = Some(self.reason.map_or(reason, |known| known.min(reason)));
    }

    fn contradict(&mut self, state: &CheckState, block: &ObservedBlock, judgements: &[Judgement]) {
        let wrong = (0..judgements.len()).filter(|place| judgements[*place] == Judgement::Wrong);
        let excess = |place: &usize| block.entries[*place].excess();
        let Some(worst) = wrong.max_by(|a, b| excess(a).total_cmp(&excess(b))) else { return };
        let excess = block.entries[worst].excess();
        if self.wrong.as_ref().is_none_or(|(known, _)| excess > *known) {
            self.wrong = Some((excess, exhibit(state, block, worst)));
        }
    }

    fn leave_open(
        &mut self,
        state: &CheckState,
        block: &ObservedBlock,
        reason: Reason,
        judgements: &[Judgement],
    ) {
        let is_graver = self.open.as_ref().is_none_or(|(known, _)| reason < *known);
        let place = judgements.iter().position(|each| *each == Judgement::Undecided(reason));
        if let (true, Some(place)) = (is_graver, place) {
            self.open = Some((reason, exhibit(state, block, place)));
        }
    }

    fn agree(&mut self, state: &CheckState, block: &ObservedBlock) {
        for (shown, shows) in self.shown.iter_mut().zip(&block.terms) {
            *shown |= shows;
        }
        let error = |place: &usize| block.entries[*place].error().value;
        let places = 0..block.entries.len();
        let Some(worst) = places.max_by(|a, b| error(a).total_cmp(&error(b))) else { return };
        let relative = if block.size > 0.0 { error(&worst) / block.size } else { 0.0 };
        // If all blocks are zero, the first state represents them.
        let counts = block.seen || self.largest.is_none();
        let is_first = self.largest.as_ref().is_none_or(|(_, known)| known.size == 0.0);
        if counts && (is_first || self.largest.as_ref().is_none_or(|(known, _)| relative > *known))
        {
            self.largest = Some((relative, exhibit(state, block, worst)));
        }
    }
}

/// Whether an entry is zero, both as stated and as measured.
fn is_zero(entry: &Entry) -> bool {
    entry.analytic == 0.0 && entry.sharpest().is_some_and(|estimate| estimate.value == 0.0)
}

fn exhibit(state: &CheckState, block: &ObservedBlock, worst: usize) -> Box<Exhibit> {
    Box::new(Exhibit {
        state: state.clone(),
        row: block.row,
        column: block.column,
        entries: block.entries.clone(),
        worst,
        size: block.size,
    })
}
