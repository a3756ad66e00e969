//! A finding: what is wrong, in words, with its evidence.

use std::fmt;

use simulator::force;
use simulator::integrator;

use super::feature::{Feature, Symptom};
use crate::change::place_in_registry;

/// A finding.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Its kind.
    pub kind: FindingKind,
    /// The feature at fault; several if each explains everything alike.
    pub features: Vec<Feature>,
    /// The mistake as a sentence, one for each feature; the same for features at fault together, which follow each other.
    pub words: Vec<String>,
    /// The scenes that it explains, by name.
    pub scenes: Vec<String>,
    /// Scenes in which Newton's method converges slowly or not at all with the mistake: neither for nor against it.
    pub open: usize,
    /// Wrong scenes in which the mistake acts, and that no finding explains; 0 if it is proven.
    pub unexplained: usize,
    /// One case in numbers, in words; `None` where the words say it all.
    pub example: Option<String>,
}

/// How sure a finding is, and of what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FindingKind {
    /// A fault of the output.
    Output,
    /// A mistake, proven by replay: with the others that are named, it makes every wrong scene in which it acts, but for
    /// those that another finding explains.
    Cause,
    /// A mistake that makes most of the wrong scenes in which it acts, and not all.
    Possible,
    /// A feature whose scenes are wrong, without a cause.
    Feature,
    /// Runs that crash, report an error, do not end or take too much memory.
    Ends(Symptom),
    /// Implicit steps that satisfy their equation, with another solution.
    OtherRoot,
    /// A common property of scenes that are wrong for no known reason. It may be right.
    Common,
    /// A feature without an effect, by replay: the traces are those of a program that lacks it.
    NoEffect,
    /// A feature that the program says it lacks.
    NotImplemented,
}

impl FindingKind {
    /// The machine-readable name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Output => "output",
            Self::Cause => "cause",
            Self::Possible => "possible-cause",
            Self::Feature => "feature",
            Self::Ends(symptom) => symptom.name(),
            Self::OtherRoot => "other-root",
            Self::Common => "common",
            Self::NoEffect => "no-effect",
            Self::NotImplemented => "not-implemented",
        }
    }

    /// What stands before its words.
    pub fn title(self) -> &'static str {
        match self {
            Self::Possible => "Perhaps",
            Self::Feature => "Look at",
            Self::Common => "No cause found;",
            Self::NoEffect => "As if not implemented:",
            Self::NotImplemented => "Not implemented:",
            Self::Output | Self::Cause | Self::Ends(_) | Self::OtherRoot => "",
        }
    }

    /// Whether it is a feature that is not there, as far as traces tell.
    pub fn is_lack(self) -> bool {
        matches!(self, Self::NoEffect | Self::NotImplemented)
    }
}

impl Finding {
    /// One that nothing speaks against, without an example.
    pub(super) fn new(
        kind: FindingKind,
        features: Vec<Feature>,
        words: Vec<String>,
        scenes: Vec<String>,
    ) -> Self {
        Self { kind, features, words, scenes, open: 0, unexplained: 0, example: None }
    }

    /// Whether it is a cause that replay has proven, or a feature whose absence it has.
    pub fn is_proven(&self) -> bool {
        self.kind == FindingKind::Cause || self.kind.is_lack()
    }

    /// Whether it is about the scene of this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.scenes.iter().any(|one| one == name)
    }

    /// Adds the scenes that it has not yet.
    pub(super) fn add_scenes(&mut self, scenes: Vec<String>) {
        for scene in scenes {
            if !self.scenes.contains(&scene) {
                self.scenes.push(scene);
            }
        }
    }

    /// The finding as a sentence.
    pub fn sentence(&self) -> String {
        let mut all = self.words.clone();
        all.dedup();
        let all = all.join(", or ");
        match (self.kind, self.kind.title()) {
            (FindingKind::Ends(symptom), _) => format!("{symptom}: {all}"),
            (_, "") => all,
            (_, title) => format!("{title} {all}"),
        }
    }

    /// The order in which features that are not there should be made: that of the registries.
    pub(super) fn in_order_of_work(&self) -> usize {
        let forces = force::REGISTRY.len();
        match self.features.first().filter(|_| self.kind.is_lack()) {
            Some(Feature::Force(part)) => place_in_registry(part.tag()).unwrap_or(0),
            Some(Feature::Integrator(name)) => {
                let place = integrator::REGISTRY.iter().position(|kind| kind.schema.name == *name);
                forces + place.unwrap_or(0)
            }
            _ => 0,
        }
    }

    /// The assumptions of the findings: the symbols of formulas, and the hand-outs' sign convention.
    pub fn notes<'a>(list: impl Iterator<Item = &'a Self> + Clone) -> Vec<&'static str> {
        let is_of_change =
            |finding: &&Self| matches!(finding.kind, FindingKind::Cause | FindingKind::Possible);
        let causes = || list.clone().filter(is_of_change);
        let is_of_pair = |feature: &Feature| match feature {
            Feature::Force(part) | Feature::Jacobian(part) => part.schema().stencil.size() == 2,
            _ => false,
        };
        let is_symbol = |word: &str| ["d", "l", "n", "w", "nᵀ", "wᵀ", "n·w"].contains(&word);
        let mut words = causes()
            .filter(|finding| finding.features.iter().any(is_of_pair))
            .flat_map(|finding| &finding.words)
            .flat_map(|words| words.split(|c: char| c.is_whitespace() || "(),/".contains(c)));
        let is_jacobian = |finding: &Self| {
            finding.features.iter().all(|feature| matches!(feature, Feature::Jacobian(_)))
        };
        let mut notes = Vec::new();
        if words.any(is_symbol) {
            notes.push("Of particles i and j: d = x_i − x_j, l = |d|, n = d/l, w = v_i − v_j.");
        }
        if causes().any(is_jacobian) {
            notes.push(
                "If your code follows the starter code, accumulateddUdxdx adds −dF/dx and accumulateddUdxdv adds −dF/dv.",
            );
        }
        notes
    }

    /// The evidence in words.
    pub fn evidence(&self) -> String {
        let count = self.scenes.len();
        let scenes = |count: usize| {
            if count == 1 { "1 scene".to_owned() } else { format!("{count} scenes") }
        };
        let open = match self.open {
            0 => String::new(),
            open => format!(
                "; {open} more say nothing of it, as Newton's method converges slowly or not at all with the mistakes found"
            ),
        };
        let evidence = match self.kind {
            FindingKind::Cause => {
                format!("proven: reproduces your traces in {}{open}", scenes(count))
            }
            FindingKind::Possible => {
                format!(
                    "not proven: reproduces your traces in {}, and not in {} more that are wrong where it acts{open}",
                    scenes(count),
                    self.unexplained
                )
            }
            FindingKind::Feature => {
                format!("wrong in {}, without a proven cause", scenes(count))
            }
            FindingKind::OtherRoot => {
                format!("{}: the step solves the same equation; another solution", scenes(count))
            }
            FindingKind::Output
            | FindingKind::Ends(_)
            | FindingKind::Common
            | FindingKind::NoEffect
            | FindingKind::NotImplemented => scenes(count),
        };
        match &self.example {
            Some(example) => format!("{evidence}; {example}"),
            None => evidence,
        }
    }

    /// The finding on a program whose repeated runs of these scenes differ: no other finding is sure then.
    pub fn of_differing_runs(scenes: Vec<String>) -> Self {
        let words = "the program is not deterministic: the same scene gives different traces, as where a variable is \
                     used before it is set; what else is said may change from run to run";
        Self::new(FindingKind::Output, vec![Feature::Output], vec![words.to_owned()], scenes)
    }

    /// The finding on a program that comes further with these scenes if their files are written plainly.
    pub fn of_misread(what: &str, scenes: Vec<String>) -> Self {
        let words =
            format!("reading the scene: {what} misread; the same scenes are read from plain files");
        Self::new(FindingKind::Output, vec![Feature::Reading], vec![words], scenes)
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.sentence(), self.evidence())
    }
}

/// The implemented features of an unfinished submission, and the next one.
#[derive(Debug, Clone, PartialEq)]
pub struct Progress {
    /// The implemented features, in words.
    pub implemented: Vec<String>,
    /// The simplest required thing that is not there, or another one once nothing required is wrong: in words, and a scene.
    pub next: Option<(String, String)>,
}

impl fmt::Display for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Implemented: {}", self.implemented.join(", "))?;
        match &self.next {
            Some((what, scene)) => write!(f, "; next: {what}, scene {scene}"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merged_findings_count_each_scene_once() {
        let names =
            |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let all = vec![Feature::Everything];
        let mut finding = Finding::new(FindingKind::Feature, all, Vec::new(), names(&["a", "b"]));
        finding.add_scenes(names(&["b", "c"]));
        assert_eq!(finding.scenes, ["a", "b", "c"]);
    }
}
