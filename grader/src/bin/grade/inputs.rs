//! The scenes, the oracle and the rubric that a run works on.

use std::path::{Path, PathBuf};

use grader::oracle::Oracle;
use grader::rubric::Rubric;
use grader::suite::{Section, Suite};
use simulator::scene::ParseOptions;

use crate::args::SuiteArgs;
use crate::stop::{Stop, complain};

/// What a run works on.
pub(super) struct Inputs {
    pub(super) suite: Suite,
    pub(super) expected: PathBuf,
    pub(super) rubric: Rubric,
}

impl SuiteArgs {
    pub(super) fn read(&self) -> Result<Inputs, Stop> {
        if let Some(threads) = self.threads {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
            pool.build_global().map_err(Stop::fault)?;
        }
        let Folders { assets, extra_credit, expected } = self.folders()?;
        let mut sections = vec![(Section::Required, assets.clone())];
        sections.extend(extra_credit.map(|folder| (Section::ExtraCredit, folder)));
        let options = ParseOptions { strict: self.strict, ..ParseOptions::default() };
        let suite = Suite::load(&sections, &options).map_err(Stop::bad_input)?;
        for warning in &suite.warnings {
            complain("warning", warning);
        }
        let beside = assets.join("rubric.toml");
        let rubric_path = self.rubric.clone().or_else(|| beside.is_file().then_some(beside));
        let rubric = match &rubric_path {
            Some(path) => {
                let rubric = Rubric::load(path).map_err(Stop::bad_input)?;
                rubric.check(&suite, path).map_err(Stop::bad_input)?;
                rubric
            }
            None => Rubric::default(),
        };
        Ok(Inputs { suite, expected, rubric })
    }

    pub(super) fn folders(&self) -> Result<Folders, Stop> {
        for folder in [&self.root, &self.assets, &self.extra_credit].into_iter().flatten() {
            if !folder.is_dir() {
                return Err(Stop::bad_input(format!(
                    "{}: there is no such folder",
                    folder.display()
                )));
            }
        }
        let (assets, extra_credit) = match &self.assets {
            Some(assets) => (assets.clone(), self.extra_credit.clone()),
            None => {
                let root = match &self.root {
                    Some(root) => root.clone(),
                    None => find_root()?,
                };
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

/// The nearest folder, here or above, that holds assets/; as a short relative path where it is here.
pub(super) fn find_root() -> Result<PathBuf, Stop> {
    if Path::new("assets").is_dir() {
        return Ok(PathBuf::new());
    }
    let here = std::env::current_dir().map_err(Stop::bad_input)?;
    let root = here.ancestors().find(|folder| folder.join("assets").is_dir());
    root.map(Path::to_path_buf).ok_or_else(|| {
        let message = "there is no assets/ folder here or above\n  help: run grade where the scenes are, or name a folder with --root or --assets";
        Stop::bad_input(message)
    })
}

/// The oracle of a folder, which must be there.
pub(super) fn open_oracle(folder: &Path) -> Result<Oracle, Stop> {
    if !folder.is_dir() {
        let folder = folder.display();
        return Err(Stop::bad_input(format!(
            "{folder}: there is no such folder; make it with `grade oracle regenerate`"
        )));
    }
    Oracle::open(folder).map_err(Stop::bad_input)
}
