//! The scenes, the oracle and the rubric of a run, found and loaded.

use std::path::{Path, PathBuf};

use grader::grading::events::Observer;
use grader::grading::hidden::HiddenSuite;
use grader::grading::{AssignmentName, Checks, Grader, Grading};
use grader::oracle::Oracle;
use grader::pack::{self, Pack};
use grader::rubric::{self, PackRule, Rubric};
use grader::suite::assignment::{self, ALL, Assignment, AssignmentError};
use grader::suite::{Case, Section, Suite};
use scene::ParseOptions;

use crate::args::{CriteriaArg, JudgeArgs, PackArgs, RootArgs, SuiteArgs};
use crate::installed;
use crate::stop::{Stop, complain};

/// The inputs of a run.
pub(super) struct Inputs {
    pub(super) suite: Suite,
    pub(super) expected: PathBuf,
    pub(super) rubric: Rubric,
    /// The file of the rubric; `None` for the default rubric.
    pub(super) rubric_path: Option<PathBuf>,
    /// The hidden scenes, if available, and their folder.
    pub(super) hidden: Option<(HiddenSuite, PathBuf)>,
    /// The folder of the assignments.
    pub(super) assignments: PathBuf,
    /// The assignment that the scenes were narrowed to; `None` if every scene is graded.
    pub(super) assignment: Option<Assignment>,
    /// The pack that hand-ins are built by.
    pub(super) pack: Option<Pack>,
    /// Runs of programs at a time, if not as many as threads.
    runs_at_once: Option<usize>,
}

impl Inputs {
    /// A grader for these inputs.
    pub(super) fn grader<'a>(
        &'a self,
        oracle: &'a Oracle,
        checks: Checks,
        observer: &'a dyn Observer,
    ) -> Grader<'a> {
        let hidden = self.hidden.as_ref().map(|(hidden, _)| hidden);
        let assignment = self.assignment.as_ref();
        Grader {
            suite: &self.suite,
            oracle,
            rubric: &self.rubric,
            assignment,
            hidden,
            functions: self.pack.as_ref().and_then(Pack::functions),
            checks,
            observer,
            runs_at_once: self.runs_at_once,
        }
    }

    /// The name of the assignment that is graded.
    pub(super) fn assignment_name(&self) -> &str {
        self.assignment.as_ref().map_or(ALL, |assignment| &assignment.name)
    }

    /// The assignment that a submission fits, if every scene was graded and it fits exactly one.
    pub(super) fn fitting(&self, grading: &Grading) -> Option<AssignmentName> {
        if self.assignment.is_some() {
            return None;
        }
        // Only a suggestion depends on assignments that nobody named.
        let assignments = Assignment::list(&self.assignments).unwrap_or_default();
        let fitting = assignment::fitting(&assignments, &self.suite, &grading.passed());
        fitting.map(AssignmentName::of)
    }

    /// A scene whose file changed since it was read, for a message.
    pub(super) fn changed(&self) -> Option<String> {
        let shipped = self.suite.cases.iter().find(|case| !case.is_current());
        let hidden = self.hidden.as_ref();
        let hidden = hidden.filter(|(hidden, _)| !hidden.cases().iter().all(Case::is_current));
        // Hidden scenes are not named.
        let hidden = hidden.map(|(_, folder)| format!("{}: a hidden scene", folder.display()));
        shipped.map(|case| case.scene.name.clone()).or(hidden)
    }

    /// The folders that submissions must not read.
    pub(super) fn secrets(&self) -> Vec<PathBuf> {
        let hidden = self.hidden.iter().map(|(_, folder)| folder);
        let mut secrets: Vec<PathBuf> =
            [&self.expected].into_iter().chain(hidden).cloned().collect();
        secrets.extend(
            self.pack.iter().flat_map(Pack::examples).map(|example| example.folder.clone()),
        );
        secrets
    }
}

/// The choices of a command line about what is graded, and how.
#[derive(Default, Clone, Copy)]
pub(super) struct Judging<'a> {
    /// The folder of the hidden scenes.
    pub(super) hidden: Option<&'a Path>,
    /// The criteria for scenes for which the rubric sets no tolerance.
    pub(super) criteria: Option<CriteriaArg>,
    /// The name of the assignment.
    pub(super) assignment: Option<&'a str>,
    /// The name of the assignment in submission.toml, which counts if nothing else names one.
    pub(super) of_submission: Option<&'a str>,
}

impl JudgeArgs {
    pub(super) fn judging(&self) -> Judging<'_> {
        Judging {
            hidden: self.hidden.as_deref(),
            criteria: self.criteria,
            assignment: self.assignment.as_deref(),
            of_submission: None,
        }
    }
}

/// How the scenes are read.
struct Reading<'a> {
    /// The path or name of the pack.
    pack: Option<&'a Path>,
    /// Whether to keep only those of an assignment.
    narrows: bool,
    /// Whether unknown elements and attributes are errors.
    strict: bool,
}

impl SuiteArgs {
    /// Reads all inputs for every scene; hidden scenes only if the rubric names their folder.
    pub(super) fn read(&self) -> Result<Inputs, Stop> {
        self.load(&Judging::default(), Reading { narrows: false, strict: self.strict, pack: None })
    }

    /// The same; unknown elements and attributes of scenes are errors.
    pub(super) fn read_strictly(&self) -> Result<Inputs, Stop> {
        self.load(&Judging::default(), Reading { narrows: false, strict: true, pack: None })
    }

    /// Reads the inputs of a grading, narrowed to its assignment.
    pub(super) fn read_for(&self, judging: &Judging<'_>) -> Result<Inputs, Stop> {
        self.read_with(judging, None)
    }

    /// The same, with this pack if none is named by an option.
    pub(super) fn read_with(
        &self,
        judging: &Judging<'_>,
        pack: Option<&Path>,
    ) -> Result<Inputs, Stop> {
        let pack = pack.or(self.pack.pack.as_deref());
        self.load(judging, Reading { narrows: true, strict: self.strict, pack })
    }

    fn load(&self, judging: &Judging<'_>, reading: Reading<'_>) -> Result<Inputs, Stop> {
        let runs_at_once = match self.threads {
            Some(threads) => {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
                pool.build_global().map_err(Stop::fault)?;
                None
            }
            // While the kernel makes or removes the namespaces of a run, which takes it mostly waiting, others use its
            // core.
            None => Some((rayon::current_num_threads() * 3).div_ceil(2)),
        };
        let pack =
            reading.pack.map(|named| self.root.pack(named, self.pack.starter()?)).transpose()?;
        let Folders { assets, extra_credit, expected } = self.folders_of(pack.as_ref())?;
        let mut sections = vec![(Section::Required, assets.clone())];
        sections.extend(extra_credit.map(|folder| (Section::ExtraCredit, folder)));
        let options = ParseOptions { strict: reading.strict, ..ParseOptions::default() };
        let mut suite = Suite::load(&sections, &options).map_err(Stop::bad_input)?;
        for warning in &suite.warnings {
            complain("warning", warning);
        }
        let of_pack = pack.as_ref().map(|pack| pack.folder().join(rubric::FILE));
        let mut beside = of_pack.into_iter().chain([assets.join(rubric::FILE)]);
        let rubric_path = self.rubric.clone().or_else(|| beside.find(|path| path.is_file()));
        let mut rubric = match &rubric_path {
            Some(path) => Rubric::load(path).map_err(Stop::bad_input)?,
            None => Rubric::default(),
        };
        let assignments = assets.join(assignment::FOLDER);
        let pack = match (pack, rubric.pack()) {
            (None, Some(PackRule { folder, starter })) if reading.narrows => {
                let starter = self.pack.starter()?.or(starter.as_deref());
                let named = rubric_path.as_deref().unwrap_or(Path::new(rubric::FILE));
                Some(Pack::open(folder, starter).map_err(Stop::about(named))?)
            }
            (pack, _) => pack,
        };
        if pack.is_none() && reading.narrows && !self.pack.starter.is_empty() {
            let message = "--starter names the starter code of a pack, or of --similar\n  help: name the pack with --pack";
            return Err(Stop::bad_input(message));
        }
        let mut assignment = None;
        if reading.narrows {
            let of_pack = pack.as_ref().and_then(|pack| pack.assignment.as_deref());
            let judging = Judging { assignment: judging.assignment.or(of_pack), ..*judging };
            assignment = choose_assignment(&assignments, &judging, &rubric)?;
        }
        let is_part = assignment.as_ref().is_some_and(|assignment| !assignment.is_all());
        // Entries of the rubric may be about scenes of other assignments.
        if let (Some(path), true) = (&rubric_path, is_part) {
            rubric.check(&suite, None, path).map_err(Stop::bad_input)?;
        }
        if let Some(assignment) = &mut assignment {
            for warning in assignment.unknown_groups(&suite) {
                complain("warning", warning);
            }
            assignment.narrow(&mut suite).map_err(Stop::bad_input)?;
            rubric.assign(assignment.clone());
        }
        let of_pack = pack.as_ref().map(|pack| pack.folder().join("hidden"));
        let of_pack = of_pack.filter(|folder| folder.is_dir());
        let named = judging.hidden.or(of_pack.as_deref());
        let hidden = read_hidden(named, &suite, &rubric, (assignment.as_ref(), &options))?;
        if let (Some(path), false) = (&rubric_path, is_part) {
            let hidden = hidden.as_ref().map(|(hidden, _)| hidden.cases());
            rubric.check(&suite, hidden, path).map_err(Stop::bad_input)?;
        }
        if let Some(criteria) = judging.criteria {
            rubric.judge_by(criteria.name());
        }
        let assignment = assignment.filter(|_| is_part);
        Ok(Inputs {
            suite,
            expected,
            rubric,
            rubric_path,
            hidden,
            assignments,
            assignment,
            pack,
            runs_at_once,
        })
    }

    /// The folders of the scenes and the oracle: those of the pack, if it has scenes.
    pub(super) fn folders_of(&self, pack: Option<&Pack>) -> Result<Folders, Stop> {
        let own = pack.map(Pack::folder).filter(|folder| folder.join("assets").is_dir());
        match own {
            Some(folder) if self.assets.is_none() && self.root.root.is_none() => Ok(Folders {
                assets: folder.join("assets"),
                extra_credit: Some(folder.join("extracreditassets")),
                expected: self.expected.clone().unwrap_or(folder.join("expected")),
            }),
            _ => self.folders(),
        }
    }

    pub(super) fn folders(&self) -> Result<Folders, Stop> {
        for folder in [&self.root.root, &self.assets, &self.extra_credit].into_iter().flatten() {
            if !folder.is_dir() {
                return Err(Stop::bad_input(format!("{}: folder not found", folder.display())));
            }
        }
        let (assets, extra_credit) = match &self.assets {
            Some(assets) => (assets.clone(), self.extra_credit.clone()),
            None => {
                let root = self.root.find()?;
                let extra_credit = self.extra_credit.clone();
                (root.join("assets"), Some(extra_credit.unwrap_or(root.join("extracreditassets"))))
            }
        };
        let expected = self.expected.clone().unwrap_or_else(|| assets.with_file_name("expected"));
        Ok(Folders { assets, extra_credit, expected })
    }
}

pub(super) struct Folders {
    pub(super) assets: PathBuf,
    pub(super) extra_credit: Option<PathBuf>,
    pub(super) expected: PathBuf,
}

/// The assignment of a grading: that of the command line, else of the rubric, else of the submission (not on a platform), else
/// that of every scene. `None` if nothing names one and the folder has none.
fn choose_assignment(
    folder: &Path,
    judging: &Judging<'_>,
    rubric: &Rubric,
) -> Result<Option<Assignment>, Stop> {
    let named = judging.assignment.or(rubric.assignment()).or(judging.of_submission);
    let name = named.unwrap_or(ALL);
    match Assignment::load(folder, name) {
        Ok(assignment) => Ok(Some(assignment)),
        // Scenes of other folders need no assignments.
        Err(AssignmentError::Unknown { .. }) if name.eq_ignore_ascii_case(ALL) => Ok(None),
        Err(error) => Err(Stop::bad_input(error)),
    }
}

/// The hidden scenes of the named folder, or else of the rubric's folder if it exists.
fn read_hidden(
    named: Option<&Path>,
    shipped: &Suite,
    rubric: &Rubric,
    (assignment, options): (Option<&Assignment>, &ParseOptions),
) -> Result<Option<(HiddenSuite, PathBuf)>, Stop> {
    let rule = rubric.hidden();
    let of_rubric = rule.and_then(|rule| rule.folder.as_deref()).filter(|folder| folder.is_dir());
    let Some(folder) = named.or(of_rubric) else { return Ok(None) };
    let hidden =
        HiddenSuite::load(folder, shipped, assignment, options).map_err(Stop::bad_input)?;
    let (found, promised) = (hidden.n_found(), rule.and_then(|rule| rule.scenes));
    if let Some(promised) = promised.filter(|promised| promised.get() != found) {
        return Err(Stop::bad_input(format!(
            "{}: found {found} hidden scenes, but the rubric states {promised}",
            folder.display()
        )));
    }
    if hidden.n_warnings() > 0 {
        complain(
            "warning",
            format!(
                "{0}: {1} warnings about hidden scenes; show them with `grade oracle verify --root {0}`",
                folder.display(),
                hidden.n_warnings()
            ),
        );
    }
    Ok(Some((hidden, folder.to_path_buf())))
}

impl PackArgs {
    /// The folder of the starter code of a pack.
    pub(super) fn starter(&self) -> Result<Option<&Path>, Stop> {
        match self.starter.as_slice() {
            [] => Ok(None),
            [folder] if !folder.is_dir() => {
                let folder = folder.display();
                Err(Stop::bad_input(format!("--starter {folder}: folder not found")))
            }
            [folder] => Ok(Some(folder)),
            _ => {
                Err(Stop::bad_input("a pack has one folder of starter code\n  help: name it once"))
            }
        }
    }
}

impl RootArgs {
    /// The folder with assets/, searched for if it is not given.
    pub(super) fn find(&self) -> Result<PathBuf, Stop> {
        self.root.clone().map_or_else(find_root, Ok)
    }

    /// The pack at a path, or of this name among those that come with the scenes.
    pub(super) fn pack(&self, named: &Path, starter: Option<&Path>) -> Result<Pack, Stop> {
        let mut path = named.to_path_buf();
        if !path.exists() && named.components().count() == 1 {
            let packs = self.find()?.join("assets").join(pack::FOLDER);
            path = packs.join(named);
            if !path.is_dir() {
                let entries = std::fs::read_dir(&packs).into_iter().flatten().flatten();
                let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
                let mut names: Vec<String> = names.collect();
                names.sort();
                return Err(Stop::bad_input(format!(
                    "{}: no such folder, and no pack of this name\n  help: the packs are {}",
                    named.display(),
                    names.join(", ")
                )));
            }
        }
        Pack::open(&path, starter).map_err(Stop::bad_input)
    }

    /// The assignment of this name.
    pub(super) fn assignment(&self, name: &str) -> Result<Assignment, Stop> {
        Assignment::load(&assignments_below(&self.find()?), name).map_err(Stop::bad_input)
    }
}

/// The folder of the assignments of a root.
pub(super) fn assignments_below(root: &Path) -> PathBuf {
    root.join("assets").join(assignment::FOLDER)
}

/// The nearest folder with assets/ in it: the current one (as the empty path) or a parent; else that of the program.
pub(super) fn find_root() -> Result<PathBuf, Stop> {
    if Path::new("assets").is_dir() {
        return Ok(PathBuf::new());
    }
    let here = std::env::current_dir().map_err(Stop::bad_input)?;
    let root = here.ancestors().find(|folder| folder.join("assets").is_dir());
    root.map_or_else(|| installed::folder().map(Path::to_path_buf), |root| Ok(root.to_path_buf()))
}

/// Opens the oracle in a folder, which must exist.
pub(super) fn open_oracle(folder: &Path) -> Result<Oracle, Stop> {
    if !folder.is_dir() {
        let folder = folder.display();
        return Err(Stop::bad_input(format!(
            "{folder}: folder not found; create it with `grade oracle regenerate`"
        )));
    }
    Oracle::open(folder).map_err(Stop::bad_input)
}
