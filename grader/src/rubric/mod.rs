//! The rubric: tolerances and points, read from one TOML file.
//!
//! ```toml
//! assignment = "t1m3"    # the assignment that is graded; default: every scene
//!
//! [default]
//! largest = 1e-10        # each residual stays below this
//! accumulated = 1e-6     # and their sum over particles and states below this
//! points = 1             # of each feature
//! partial = true         # points in proportion to the scenes that pass; false: all or nothing
//! criteria = "course"    # these tolerances; or "calibrated": each scene's own envelope, where it has one. Default:
//!                        # "calibrated" if the section sets no tolerance
//! other-root = "fail"    # verdict on a trace of implicit Euler whose steps all solve their equations, with another
//!                        # solution than the oracle's; or "pass"
//!
//! [[feature]]            # applies to every matching feature; a later entry overrides an earlier one
//! section = "required"   # or "extra-credit"; section, group and integrator are optional
//! group = "Spring"
//! integrator = "explicit-euler"
//! points = 2
//!
//! [[scene]]              # one scene, by its name
//! name = "Spring/two-springs"
//! largest = 1e-9
//! weight = 2             # counts as two scenes of its feature
//!
//! [pack]                 # hand-ins are sources that a course pack builds
//! folder = "packs/functions-python"    # relative to this file
//! starter = "../starter" # its starter code, in the place of the pack's own; optional
//!
//! [hidden]               # there are hidden scenes; both keys are optional
//! folder = "../hidden"   # relative to this file; if it does not exist, hidden scenes are not run
//! scenes = 12            # number of hidden scenes
//!
//! [limits]               # for each run of a program; defaults as in `grade --help`
//! wall = 10              # seconds
//! memory = 1_000_000_000 # bytes
//! budget = 1200          # seconds of all runs together; then no further scene is run
//!
//! [build-limits]         # for its build
//! cpu = 300
//!
//! [breaker]              # a feature is not run to its end after as many
//! timeouts = 3           # time-outs; 0: no limit
//! crashes = 5            # crashes with the same message; 0: no limit
//!
//! [faults]               # points of scenes that could not be judged
//! points = "apart"       # show judged points, and the others apart; or "withheld": show none
//!
//! [late]                 # points of late submissions, if a course platform or a roster tells the times
//! penalty = 20           # per cent of the points earned, for each day begun
//! cap = 50               # the most per cent that are taken off
//! grace = 15             # minutes after the deadline that do not count
//!
//! [creative]             # credit for creative scenes, from the judges' marks
//! cap = 15               # credit for the best marks, in per cent of the required points
//! maximum = 10           # best mark of a criterion
//!
//! [platform]             # what a course platform shows and counts
//! keep = "best"          # of the submissions of a student; or "last"
//! hidden = "visible"     # when students see the results of hidden scenes; or "after-due-date", "after-published"
//! leaderboard = false    # whether it shows points, and the time of programs that pass everything
//! limit = { submissions = 5, hours = 24 }    # how many are graded in any such time; without it, all
//!
//! [class]                # what `grade class` accepts
//! traces = false         # folders of traces; true: a folder without submission.toml is graded as traces
//!
//! [protection]           # protections without which no program is run
//! require = ["files"]    # or "closed-folders", which accepts a separate user ID and closed folders in their place
//! hidden-without-namespaces = false    # whether hidden scenes run where a program could tell the next one about them
//! ```
//!
//! A scene's tolerance comes from its own entry, else from its feature's entry, else from the calibration stored with
//! the oracle (unless the course's criteria are chosen), else from the default.

mod bounded;

pub mod creative;
pub mod late;

use std::collections::BTreeMap;
use std::fmt;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

use crate::boundary::own_file::{OwnFileError, Toml, read_text};
use crate::compare::{Calibrated, Criteria, Tolerances};
use crate::suite::assignment::Assignment;
use crate::suite::{Case, Feature, Section, Suite};
use crate::verdict::number;
use bounded::bounded;
use creative::CreativeRule;
use late::{LateRule, PlatformRule};
use sandbox::{Limits, Protection};

/// Name of the rubric's file, next to the required scenes or in a pack.
pub const FILE: &str = "rubric.toml";

/// Maximum size of a rubric, in MiB.
const MAX_MEBIBYTES: u64 = 1;

/// Maximum points of a feature and maximum weight of a scene. Sums of these cannot overflow.
const MOST: f64 = 1e9;

/// A rubric.
#[derive(Debug, Clone, Default)]
pub struct Rubric {
    /// The name of the assignment in the file.
    assignment_name: Option<String>,
    /// The assignment that sets points.
    assignment: Option<Assignment>,
    default: Defaults,
    features: Vec<FeatureRule>,
    scenes: Vec<SceneRule>,
    limits: Vec<(String, f64)>,
    build_limits: Vec<(String, f64)>,
    hidden: Option<HiddenRule>,
    pack: Option<PackRule>,
    faults: FaultPoints,
    breaker: Breaker,
    late: LateRule,
    creative: CreativeRule,
    platform: PlatformRule,
    class: ClassRule,
    /// `None` where the rubric does not set it.
    protections: Option<Vec<Protection>>,
    hidden_without_namespaces: bool,
}

/// The rubric's section on hidden scenes.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HiddenRule {
    /// The folder that holds them.
    pub folder: Option<PathBuf>,
    /// Their number.
    pub scenes: Option<NonZeroUsize>,
}

/// The course pack that builds hand-ins, `[pack]`.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PackRule {
    /// Its folder or archive.
    pub folder: PathBuf,
    /// The folder of the starter code, in the place of the pack's own.
    pub starter: Option<PathBuf>,
}

/// A rubric that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RubricError {
    /// The file cannot be read, or is not a valid rubric.
    #[error(transparent)]
    File(#[from] OwnFileError),
    /// An entry matches nothing that is graded.
    #[error("{}: {entry} matches no scene\n  help: name a feature by section, group and integrator, and a scene by its name, such as Spring/two-springs", path.display())]
    NoMatch {
        /// The file.
        path: PathBuf,
        /// The entry, in words.
        entry: String,
    },
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RubricFile {
    assignment: Option<String>,
    #[serde(default)]
    default: Defaults,
    #[serde(default)]
    feature: Vec<Spanned<FeatureRule>>,
    #[serde(default)]
    scene: Vec<Spanned<SceneRule>>,
    #[serde(default)]
    limits: BTreeMap<String, Spanned<f64>>,
    #[serde(default, rename = "build-limits")]
    build_limits: BTreeMap<String, Spanned<f64>>,
    hidden: Option<HiddenRule>,
    pack: Option<PackRule>,
    #[serde(default)]
    faults: FaultsTable,
    #[serde(default)]
    breaker: Breaker,
    #[serde(default)]
    late: LateRule,
    #[serde(default)]
    creative: CreativeRule,
    #[serde(default)]
    platform: PlatformRule,
    #[serde(default)]
    class: ClassRule,
    #[serde(default)]
    protection: ProtectionTable,
}

/// Hand-ins accepted in a class, `[class]`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ClassRule {
    /// Folders of traces, of which nothing shows that a program made them.
    pub traces: bool,
}

/// Failures of a feature after which its other scenes are not run; 0: no limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Breaker {
    /// Time-outs.
    pub timeouts: usize,
    /// Crashes with the same message.
    pub crashes: usize,
}

impl Default for Breaker {
    fn default() -> Self {
        Self { timeouts: 3, crashes: 5 }
    }
}

/// Display of points if something could not be judged.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FaultPoints {
    /// The points earned, with the points not judged apart.
    #[default]
    Apart,
    /// No points earned.
    Withheld,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct FaultsTable {
    #[serde(default)]
    points: FaultPoints,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct ProtectionTable {
    require: Option<Vec<Spanned<String>>>,
    #[serde(default)]
    hidden_without_namespaces: bool,
}

/// Criteria for scenes without a tolerance in the rubric.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CriteriaName {
    /// The default tolerances, which are the course's unless the rubric says otherwise.
    Course,
    /// The calibrated tolerances; the default tolerances for scenes without calibration.
    Calibrated,
}

/// Verdict on a trace whose implicit steps solve their equations, with another solution than the oracle's.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OtherRoot {
    /// The trace differs: the course fixes the first guess of Newton's method.
    #[default]
    Fail,
    /// It passes.
    Pass,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Defaults {
    largest: Option<Positive>,
    accumulated: Option<Positive>,
    points: Points,
    partial: bool,
    criteria: Option<CriteriaName>,
    #[serde(rename = "other-root")]
    other_root: OtherRoot,
}

impl Default for Defaults {
    fn default() -> Self {
        Self {
            largest: None,
            accumulated: None,
            points: Points(1.0),
            partial: true,
            criteria: None,
            other_root: OtherRoot::Fail,
        }
    }
}

impl Defaults {
    fn tolerances(&self) -> Tolerances {
        let or = |set: Option<Positive>, otherwise: f64| set.map_or(otherwise, |value| value.0);
        Tolerances {
            largest: or(self.largest, Tolerances::COURSE.largest),
            accumulated: or(self.accumulated, Tolerances::COURSE.accumulated),
        }
    }

    /// The criteria. A section that sets tolerances and no criteria is judged by its tolerances.
    fn criteria(&self) -> CriteriaName {
        let set = self.largest.is_some() || self.accumulated.is_some();
        let otherwise = if set { CriteriaName::Course } else { CriteriaName::Calibrated };
        self.criteria.unwrap_or(otherwise)
    }
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct FeatureRule {
    section: Option<SectionName>,
    group: Option<String>,
    integrator: Option<String>,
    largest: Option<Positive>,
    accumulated: Option<Positive>,
    points: Option<Points>,
    partial: Option<bool>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneRule {
    name: String,
    largest: Option<Positive>,
    accumulated: Option<Positive>,
    weight: Option<SceneWeight>,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum SectionName {
    Required,
    ExtraCredit,
}

bounded! {
    struct Positive, |value| value.is_finite() && value > 0.0,
    "a tolerance is above 0, not {}", number(value)
}

bounded! {
    struct Points, |value| (0.0..=MOST).contains(&value),
    "points are from 0 to {MOST:e}, not {}", number(value)
}

bounded! {
    struct SceneWeight, |value| value > 0.0 && value <= MOST,
    "a weight is above 0 and at most {MOST:e}, not {}", number(value)
}

impl Rubric {
    /// Reads the rubric at `path`.
    ///
    /// # Errors
    /// If it cannot be read, or is not a valid rubric.
    pub fn load(path: &Path) -> Result<Self, RubricError> {
        let text = read_text(path, MAX_MEBIBYTES)
            .map_err(|source| OwnFileError::Unreadable { path: path.to_path_buf(), source })?;
        Self::parse(&text, path)
    }

    /// Parses a rubric. `path` is the name in messages.
    ///
    /// # Errors
    /// As [`load`](Self::load), except for reading the file.
    pub fn parse(text: &str, path: &Path) -> Result<Self, RubricError> {
        let toml = Toml { path, text };
        let invalid = |start, message| RubricError::File(toml.invalid(start, message));
        let file: RubricFile = toml.parse()?;
        let RubricFile {
            default, feature, scene, limits, build_limits, mut hidden, mut pack, ..
        } = file;
        let protection = |name: Spanned<String>| {
            let known = || Protection::ALL.into_iter().chain([Protection::ClosedFolders]);
            known().find(|known| known.name() == name.as_ref()).ok_or_else(|| {
                let names = known().map(Protection::name).collect::<Vec<_>>().join(", ");
                let message = format!(
                    "unknown protection {:?}\n  help: the protections are {names}",
                    name.as_ref()
                );
                invalid(name.span().start, message)
            })
        };
        let required = file.protection.require;
        let protections = required
            .map(|names| names.into_iter().map(protection).collect::<Result<Vec<_>, _>>())
            .transpose()?;
        let idle = |start: usize, entry: &dyn fmt::Display, keys: &str| {
            let message =
                format!("{entry} sets nothing\n  help: give it {keys}, or remove the entry");
            invalid(start, message)
        };
        for rule in &feature {
            if rule.as_ref().sets_nothing() {
                let keys = "largest, accumulated, points or partial";
                return Err(idle(rule.span().start, rule.as_ref(), keys));
            }
        }
        for rule in &scene {
            if rule.as_ref().sets_nothing() {
                return Err(idle(
                    rule.span().start,
                    rule.as_ref(),
                    "largest, accumulated or weight",
                ));
            }
        }
        if let Some(value) = build_limits.get("budget") {
            let message =
                "a build is one run, and has no budget\n  help: set it in [limits]".to_owned();
            return Err(invalid(value.span().start, message));
        }
        // Validated here, where the line is known.
        for (name, value) in limits.iter().chain(&build_limits) {
            let tried = Limits::default().set(name, *value.as_ref());
            tried.map_err(|message| invalid(value.span().start, message))?;
        }
        let plain = |limits: BTreeMap<String, Spanned<f64>>| {
            limits.into_iter().map(|(name, value)| (name, value.into_inner())).collect()
        };
        let mut folders: Vec<&mut PathBuf> = Vec::new();
        folders.extend(hidden.as_mut().and_then(|hidden| hidden.folder.as_mut()));
        if let Some(PackRule { folder, starter }) = &mut pack {
            folders.push(folder);
            folders.extend(starter);
        }
        for folder in folders {
            *folder = path.parent().unwrap_or(Path::new("")).join(&folder);
        }
        Ok(Self {
            assignment_name: file.assignment,
            assignment: None,
            default,
            hidden,
            pack,
            faults: file.faults.points,
            breaker: file.breaker,
            late: file.late,
            creative: file.creative,
            platform: file.platform,
            class: file.class,
            protections,
            hidden_without_namespaces: file.protection.hidden_without_namespaces,
            limits: plain(limits),
            build_limits: plain(build_limits),
            features: feature.into_iter().map(Spanned::into_inner).collect(),
            scenes: scene.into_iter().map(Spanned::into_inner).collect(),
        })
    }

    /// Checks that every entry matches something in the suite. `path` is the rubric's name in messages.
    ///
    /// An entry for a section without a folder is not checked: it belongs to another run. Nor is an entry that matches
    /// no shipped scene, if the rubric has hidden scenes that are not available.
    ///
    /// # Errors
    /// If an entry matches nothing, most likely because of a spelling mistake.
    pub fn check(
        &self,
        suite: &Suite,
        hidden: Option<&[Case]>,
        path: &Path,
    ) -> Result<(), RubricError> {
        if self.hidden.is_some() && hidden.is_none() {
            return Ok(());
        }
        let hidden = hidden.unwrap_or_default();
        let cases = || suite.cases.iter().chain(hidden);
        let no_match = |entry: String| RubricError::NoMatch { path: path.to_path_buf(), entry };
        let elsewhere = |rule: &&FeatureRule| {
            rule.section.is_some_and(|section| !suite.sections.contains(&section.section()))
        };
        for rule in self.features.iter().filter(|rule| !elsewhere(rule)) {
            if !cases().any(|case| rule.fits(&case.feature)) {
                return Err(no_match(rule.to_string()));
            }
        }
        for rule in &self.scenes {
            if !cases().any(|case| rule.name == case.id) {
                return Err(no_match(rule.to_string()));
            }
        }
        Ok(())
    }

    /// The tolerances of a scene.
    pub fn tolerances(&self, case: &Case) -> Tolerances {
        let Tolerances { mut largest, mut accumulated } = self.default.tolerances();
        let mut set = |rule: (Option<Positive>, Option<Positive>)| {
            largest = rule.0.map_or(largest, |value| value.0);
            accumulated = rule.1.map_or(accumulated, |value| value.0);
        };
        let features = self.features.iter().filter(|rule| rule.fits(&case.feature));
        features.for_each(|rule| set((rule.largest, rule.accumulated)));
        let scenes = self.scenes.iter().filter(|rule| rule.name == case.id);
        scenes.for_each(|rule| set((rule.largest, rule.accumulated)));
        Tolerances { largest, accumulated }
    }

    /// The criteria of a scene: `calibrated` if given, unless the rubric says otherwise.
    pub fn criteria(&self, case: &Case, calibrated: Option<Calibrated>) -> Criteria {
        let features = self.features.iter().filter(|rule| rule.fits(&case.feature));
        let of_features = features.map(|rule| (rule.largest, rule.accumulated));
        let scenes = self.scenes.iter().filter(|rule| rule.name == case.id);
        let of_scenes = scenes.map(|rule| (rule.largest, rule.accumulated));
        let is_set = of_features
            .chain(of_scenes)
            .any(|(largest, accumulated)| largest.is_some() || accumulated.is_some());
        match calibrated {
            Some(calibrated) if !is_set && self.default.criteria() == CriteriaName::Calibrated => {
                Criteria::Calibrated(calibrated)
            }
            _ => Criteria::Fixed(self.tolerances(case)),
        }
    }

    /// Sets the default criteria, whatever the rubric says.
    pub fn judge_by(&mut self, criteria: CriteriaName) {
        self.default.criteria = Some(criteria);
    }

    /// The verdict on traces at another root.
    pub fn other_root(&self) -> OtherRoot {
        self.default.other_root
    }

    /// The limits of a run of a program.
    pub fn limits(&self) -> Limits {
        with(Limits::default(), &self.limits)
    }

    /// The limits of the build of a program.
    pub fn build_limits(&self) -> Limits {
        with(Limits::of_builds(), &self.build_limits)
    }

    /// Display of points if something could not be judged.
    pub fn fault_points(&self) -> FaultPoints {
        self.faults
    }

    /// Failures of a feature after which its other scenes are not run.
    pub fn breaker(&self) -> Breaker {
        self.breaker
    }

    /// The rule for late submissions.
    pub fn late(&self) -> LateRule {
        self.late
    }

    /// The rule for creative scenes.
    pub fn creative(&self) -> CreativeRule {
        self.creative
    }

    /// The rules for course platforms.
    pub fn platform(&self) -> PlatformRule {
        self.platform
    }

    /// Hand-ins accepted in a class.
    pub fn class(&self) -> ClassRule {
        self.class
    }

    /// The protections without which no program is run.
    pub fn required_protections(&self) -> &[Protection] {
        self.protections.as_deref().unwrap_or(&[Protection::Files])
    }

    /// Whether programs run on hidden scenes under these protections. Without a separate process namespace, a program can
    /// leave a number for another one in counts of the machine.
    pub fn runs_hidden_under(&self, protections: &[Protection]) -> bool {
        self.hidden_without_namespaces || protections.contains(&Protection::Processes)
    }

    /// The name of the assignment that the rubric is for; `None` if it names none.
    pub fn assignment(&self) -> Option<&str> {
        self.assignment_name.as_deref()
    }

    /// Lets an assignment set the points of its features.
    pub fn assign(&mut self, assignment: Assignment) {
        self.assignment = Some(assignment);
    }

    /// The points of a feature: the assignment's if it sets any, else those of the last entry that fits.
    pub fn points(&self, feature: &Feature) -> f64 {
        let assigned = self.assignment.as_ref().and_then(|assignment| assignment.points(feature));
        if let Some(points) = assigned {
            return points;
        }
        let rules = self.features.iter().filter(|rule| rule.fits(feature));
        rules.filter_map(|rule| rule.points).next_back().unwrap_or(self.default.points).0
    }

    /// Whether a feature earns points in proportion to its passed scenes, rather than all or nothing.
    pub fn partial(&self, feature: &Feature) -> bool {
        let rules = self.features.iter().filter(|rule| rule.fits(feature));
        rules.filter_map(|rule| rule.partial).next_back().unwrap_or(self.default.partial)
    }

    /// The weight of a scene among those of its feature.
    pub fn weight(&self, case: &Case) -> f64 {
        let rules = self.scenes.iter().filter(|rule| rule.name == case.id);
        rules.filter_map(|rule| rule.weight).next_back().map_or(1.0, |weight| weight.0)
    }

    /// The section on hidden scenes; `None` if there is none.
    pub fn hidden(&self) -> Option<&HiddenRule> {
        self.hidden.as_ref()
    }

    /// The course pack that builds hand-ins, with paths seen from the current folder.
    pub fn pack(&self) -> Option<&PackRule> {
        self.pack.as_ref()
    }
}

fn with(mut limits: Limits, changes: &[(String, f64)]) -> Limits {
    for (name, value) in changes {
        // Validated when the rubric was read.
        let _ = limits.set(name, *value);
    }
    limits
}

impl SectionName {
    fn section(self) -> Section {
        match self {
            Self::Required => Section::Required,
            Self::ExtraCredit => Section::ExtraCredit,
        }
    }
}

impl SceneRule {
    fn sets_nothing(&self) -> bool {
        self.largest.is_none() && self.accumulated.is_none() && self.weight.is_none()
    }
}

impl fmt::Display for SceneRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[[scene]] {:?}", self.name)
    }
}

impl FeatureRule {
    fn sets_nothing(&self) -> bool {
        self.largest.is_none()
            && self.accumulated.is_none()
            && self.points.is_none()
            && self.partial.is_none()
    }

    fn fits(&self, feature: &Feature) -> bool {
        let section = self.section.is_none_or(|section| section.section() == feature.section);
        let group = self.group.as_ref().is_none_or(|group| *group == feature.group);
        let integrator = self.integrator.as_ref().is_none_or(|name| *name == feature.integrator);
        section && group && integrator
    }
}

impl fmt::Display for FeatureRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[[feature]]")?;
        if let Some(section) = &self.section {
            write!(f, " section {:?}", section.section().name())?;
        }
        if let Some(group) = &self.group {
            write!(f, " group {group:?}")?;
        }
        if let Some(integrator) = &self.integrator {
            write!(f, " integrator {integrator:?}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Rubric, RubricError> {
        Rubric::parse(text, Path::new("rubric.toml"))
    }

    #[test]
    fn hidden_scenes_need_namespaces_unless_the_rubric_allows_it() {
        let runs = |text: &str, protections| parse(text).unwrap().runs_hidden_under(protections);
        assert!(runs("", &[Protection::Processes]));
        assert!(!runs("", &[Protection::Files, Protection::Memory]));
        assert!(runs("[protection]\nhidden-without-namespaces = true", &[]));
    }

    #[test]
    fn protections_are_required_by_name() {
        let required = |text: &str| parse(text).unwrap().required_protections().to_vec();
        assert_eq!(required(""), [Protection::Files]);
        assert_eq!(required("[protection]\nrequire = []"), []);
        let both = [Protection::Network, Protection::Files];
        assert_eq!(required("[protection]\nrequire = [\"network\", \"files\"]"), both);
        let message =
            parse("[protection]\nrequire = [\"files\", \"fire\"]").unwrap_err().to_string();
        assert_eq!(
            message,
            "rubric.toml:2:21: unknown protection \"fire\"\n  help: the protections are files, network, \
             signals, processes, system-calls, limits, memory, closed-folders"
        );
    }

    #[test]
    fn budget_covers_all_runs() {
        let budget = |text: &str| parse(text).unwrap().limits().budget();
        assert_eq!((budget(""), budget("[limits]\nwall = 120")), (1200.0, 2400.0));
        assert_eq!((budget("[limits]\nwall = 1"), budget("[limits]\nbudget = 5")), (1200.0, 5.0));
        let message = parse("[build-limits]\nbudget = 5").unwrap_err().to_string();
        assert!(message.starts_with("rubric.toml:2:10: a build is one run"), "{message}");
    }
}
