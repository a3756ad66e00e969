//! `grade oracle review`: walks through the changes that have to be accepted.
//!
//! ```text
//! stage the new traces ──> each undecided change: show it, ask ──> write: the accepted ones replace the old traces
//!                            └── a decision is stored at once in .expected.review.json, by expected/
//! ```
//!
//! Traces are deterministic, so the pending traces themselves need not be stored: a decision holds the hash of the new
//! trace that it is about, and counts as long as the scene still gives that trace.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

use grader::boundary::own_file;
use grader::oracle::{Acceptance, NumberDifference, Staged, TraceChange, TraceDifference};
use grader::suite::Suite;
use serde_json::{Value, json};

use super::{cause, describe_change, replace, stage};
use crate::args::SuiteArgs;
use crate::output::replace_file;
use crate::stop::{Exit, Stop};
use crate::terminal::terminal;

/// Heights of a bar.
const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// Reviews the changes of the oracle on the terminal.
pub(super) fn run(args: &SuiteArgs) -> Result<Exit, Stop> {
    if !(io::stdin().is_terminal() && io::stdout().is_terminal()) {
        return Err(Stop::bad_input(
            "review needs a terminal\n  help: `grade oracle regenerate` lists the changes, and \
             `grade oracle regenerate --accept SCENE…` accepts some of them",
        ));
    }
    let (staged, inputs) = stage(args, false)?;
    let mut decisions = Decisions::read(&inputs.expected)?;
    let mut review = Review { staged: &staged, suite: &inputs.suite, decisions: &mut decisions };
    let ending = review.ask(&mut io::stdin().lock(), &mut terminal(anstream::stdout()));
    match ending.map_err(|error| Stop::fault(format!("terminal: {error}")))? {
        Ending::Left => Ok(Exit::Failed),
        Ending::NothingToAccept => replace(staged, Acceptance::Nothing, &inputs.expected),
        Ending::Write(accepted) => {
            let exit = replace(staged, Acceptance::Some(&accepted), &inputs.expected)?;
            decisions.forget(&accepted)?;
            Ok(exit)
        }
    }
}

/// Decisions on changes, stored at once.
struct Decisions {
    path: PathBuf,
    /// By name: whether the change is accepted, and the hash of the new trace.
    by_name: BTreeMap<String, (bool, String)>,
}

impl Decisions {
    /// The decisions stored next to this folder; none without a file.
    fn read(expected: &Path) -> Result<Self, Stop> {
        let absolute = std::path::absolute(expected).map_err(Stop::bad_input)?;
        let name = absolute.file_name().unwrap_or_default().to_string_lossy();
        let path = absolute.with_file_name(format!(".{name}.review.json"));
        let text = match own_file::text(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => "{}".to_owned(),
            text => {
                text.map_err(|error| Stop::bad_input(format!("{}: {error}", path.display())))?
            }
        };
        let decision =
            |value: &Value| Some((value["accept"].as_bool()?, value["trace"].as_str()?.to_owned()));
        let parsed: Option<BTreeMap<String, Value>> = serde_json::from_str(&text).ok();
        let by_name = parsed.and_then(|values| {
            values.into_iter().map(|(name, value)| Some((name, decision(&value)?))).collect()
        });
        let by_name = by_name.ok_or_else(|| {
            let path = path.display();
            Stop::bad_input(format!(
                "{path}: no decisions of a review\n  help: remove it, and decide again"
            ))
        })?;
        Ok(Self { path, by_name })
    }

    fn write(&self) -> io::Result<()> {
        if self.by_name.is_empty() {
            return match std::fs::remove_file(&self.path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
                _ => Ok(()),
            };
        }
        let values = self.by_name.iter();
        let values =
            values.map(|(name, (accept, trace))| (name, json!({"accept": accept, "trace": trace})));
        let text = serde_json::to_string_pretty(&values.collect::<BTreeMap<_, _>>())?;
        replace_file(&self.path, (text + "\n").as_bytes())
    }

    /// Forgets decisions that were carried out.
    fn forget(&mut self, names: &BTreeSet<String>) -> Result<(), Stop> {
        self.by_name.retain(|name, _| !names.contains(name));
        self.write().map_err(|error| Stop::bad_input(format!("{}: {error}", self.path.display())))
    }
}

/// A review in progress.
struct Review<'a> {
    staged: &'a Staged,
    suite: &'a Suite,
    decisions: &'a mut Decisions,
}

/// How a review ended.
#[derive(Debug, PartialEq, Eq)]
enum Ending {
    /// No change has to be accepted.
    NothingToAccept,
    /// Changes wait for a decision, or for being written.
    Left,
    /// These changes are to be written.
    Write(BTreeSet<String>),
}

impl Review<'_> {
    /// Shows the changes and asks about each, until they are written or the user leaves.
    fn ask(&mut self, input: &mut dyn BufRead, out: &mut dyn Write) -> io::Result<Ending> {
        let pending = self.staged.changes.iter().filter(|(_, change)| change.needs_accepting());
        let pending: Vec<&(String, TraceChange)> = pending.collect();
        if pending.is_empty() {
            return Ok(Ending::NothingToAccept);
        }
        // A decision about another trace, or about none, has no effect.
        let hashes: BTreeMap<&str, &str> =
            pending.iter().map(|(name, _)| (name.as_str(), hash(self.staged, name))).collect();
        self.decisions
            .by_name
            .retain(|name, (_, hash)| hashes.get(name.as_str()) == Some(&hash.as_str()));
        let is_open = |review: &Self, place: usize| {
            pending.get(place).is_some_and(|(name, _)| !review.decisions.by_name.contains_key(name))
        };
        let mut place = 0;
        while place < pending.len() && !is_open(self, place) {
            place += 1;
        }
        loop {
            let actions = match pending.get(place) {
                Some((name, change)) => {
                    write!(
                        out,
                        "\n{} of {}  {}",
                        place + 1,
                        pending.len(),
                        self.page(name, change)
                    )?;
                    "accept (a), reject (r), skip (s), undo (u), quit (q)? "
                }
                None => {
                    write!(out, "\n{}", self.summary(pending.len()))?;
                    "write (w), undo (u), quit (q)? "
                }
            };
            write!(out, "{actions}")?;
            out.flush()?;
            let mut line = String::new();
            let is_end = input.read_line(&mut line)? == 0;
            match (line.trim(), pending.get(place)) {
                _ if is_end => return self.leave(out),
                ("q" | "quit", _) => return self.leave(out),
                (answer @ ("a" | "accept" | "r" | "reject"), Some((name, _))) => {
                    let decision = (answer.starts_with('a'), hash(self.staged, name).to_owned());
                    self.decisions.by_name.insert(name.clone(), decision);
                    self.decisions.write()?;
                    place += 1;
                }
                ("s" | "skip", Some(_)) => place += 1,
                ("u" | "undo", _) if place > 0 => {
                    place -= 1;
                    self.decisions.by_name.remove(&pending[place].0);
                    self.decisions.write()?;
                }
                ("u" | "undo", _) => writeln!(out, "This is the first change.")?,
                ("w" | "write", None) => {
                    let accepted = self.decisions.by_name.iter().filter(|(_, (accept, _))| *accept);
                    return Ok(Ending::Write(accepted.map(|(name, _)| name.clone()).collect()));
                }
                _ => writeln!(out, "Type one of the letters in brackets.")?,
            }
            // Decisions of an earlier run are not asked again.
            while place < pending.len() && !is_open(self, place) {
                place += 1;
            }
        }
    }

    fn leave(&self, out: &mut dyn Write) -> io::Result<Ending> {
        let (count, path) = (self.decisions.by_name.len(), self.decisions.path.display());
        if count > 0 {
            writeln!(
                out,
                "\nNothing was replaced. Decisions kept in {path}: {count}. `grade oracle review` continues."
            )?;
        }
        Ok(Ending::Left)
    }

    fn summary(&self, total: usize) -> String {
        let accepted = self.decisions.by_name.values().filter(|(accept, _)| *accept).count();
        let rejected = self.decisions.by_name.len() - accepted;
        format!(
            "Changes: {total}. Accepted: {accepted}, rejected: {rejected}, skipped: {}. Old traces stay where a change is not \
             accepted.\n",
            total - accepted - rejected
        )
    }

    /// Facts about a change.
    fn page(&self, name: &str, change: &TraceChange) -> String {
        let case = self.suite.cases.iter().find(|case| case.id == name);
        let file = case.and_then(|case| case.files.first());
        let file = file.map_or_else(String::new, |file| format!(" ({})", file.path.display()));
        let mut text = format!("{name}{file}\n  {}\n", describe_change(change));
        let TraceChange::Changed { scene_edited, difference, .. } = change else { return text };
        if let (true, Some(case), Some(hash)) =
            (scene_edited, case, self.staged.old_scene_hash(name))
        {
            let changes = cause::changes(case, hash);
            if changes.is_empty() {
                text += "  cause: the scene was edited; git does not know the file that the old trace was made from\n";
            }
            for change in changes {
                text += &format!("  cause: {change}\n");
            }
        } else {
            text +=
                "  cause: not the scene, which is as it was; the simulator changed, or the trace\n";
        }
        if let TraceDifference::Numbers(difference) = difference {
            text += &plots(difference);
        }
        if let Some(bounds) = self.staged.bounds(name) {
            text += &format!(
                "  correct programs differ by up to {:.1e} in position and {:.1e} in velocity at the end\n",
                bounds.position, bounds.velocity
            );
        }
        text
    }
}

/// The hash of the new trace that a decision is about.
fn hash<'a>(staged: &'a Staged, name: &str) -> &'a str {
    staged.trace_hash(name).unwrap_or("removed")
}

/// The size of a change over time, of positions and of velocities.
fn plots(NumberDifference { sizes, comparison }: &NumberDifference) -> String {
    let last = comparison.states.saturating_sub(1);
    let plot = |quantity: usize, name: &str| {
        let values: Vec<f64> = sizes.iter().map(|size| size[quantity]).collect();
        format!("  {name} {}\n", bars(&values))
    };
    let (position, velocity) = (plot(0, "position"), plot(1, "velocity"));
    format!("{position}{velocity}           from step 0 to {last}; heights are logarithmic\n")
}

/// Values as bars of logarithmic height, from the smallest positive value to the largest; a space for 0.
fn bars(values: &[f64]) -> String {
    let positive = || values.iter().copied().filter(|value| *value > 0.0);
    let (low, high) = (positive().fold(f64::INFINITY, f64::min), positive().fold(0.0, f64::max));
    if high == 0.0 {
        return "equal".to_owned();
    }
    let top = (BARS.len() - 1) as f64;
    let bar = |value: &f64| match *value {
        value if value > 0.0 && high > low => {
            BARS[((value / low).ln() / (high / low).ln() * top).round() as usize]
        }
        value if value > 0.0 => BARS[BARS.len() - 1],
        _ => ' ',
    };
    let drawn: String = values.iter().map(bar).collect();
    format!("{drawn}  {low:.1e} to {high:.1e}")
}

#[cfg(test)]
mod tests {
    use grader::oracle::Origin;
    use grader::rubric::Rubric;
    use grader::suite::Section;
    use scene::ParseOptions;
    use tempfile::TempDir;

    use super::*;

    const SCENE: &str = r#"<scene>
      <duration time="0.3"/> <integrator type="explicit-euler" dt="0.1"/>
      <particle m="1" px="0" py="0" vx="SPEED" vy="0" fixed="0"/>
    </scene>"#;

    /// Three scenes, of which the first two were edited after their traces were made, and a trace without a scene.
    struct Edited {
        folder: TempDir,
        suite: Suite,
    }

    impl Edited {
        fn new() -> Self {
            let folder = tempfile::tempdir().unwrap();
            let scenes = folder.path().join("assets");
            std::fs::create_dir(&scenes).unwrap();
            let write = |name: &str, speed: &str| {
                let text = SCENE.replace("SPEED", speed);
                std::fs::write(scenes.join(format!("{name}.xml")), text).unwrap();
            };
            let load = || {
                let sections = [(Section::Required, scenes.clone())];
                Suite::load(&sections, &ParseOptions::default()).unwrap()
            };
            ["a", "b", "c", "d"].iter().for_each(|name| write(name, "1"));
            let first = Self { suite: load(), folder };
            first.stage().replace(Acceptance::Nothing, &Origin::default()).unwrap();
            ["a", "b"].iter().for_each(|name| write(name, "2"));
            std::fs::remove_file(scenes.join("d.xml")).unwrap();
            Self { suite: load(), ..first }
        }

        fn expected(&self) -> PathBuf {
            self.folder.path().join("expected")
        }

        fn stage(&self) -> Staged {
            let rubric = Rubric::default();
            Staged::make(&self.suite, &self.expected(), &rubric, Acceptance::Nothing).unwrap()
        }

        /// The end of a review with these answers, and what it printed.
        fn review(&self, answers: &str) -> (Ending, String) {
            let staged = self.stage();
            let mut decisions = Decisions::read(&self.expected()).ok().unwrap();
            let mut review =
                Review { staged: &staged, suite: &self.suite, decisions: &mut decisions };
            let mut out = Vec::new();
            let ending = review.ask(&mut answers.as_bytes(), &mut out).unwrap();
            (ending, String::from_utf8(out).unwrap())
        }
    }

    fn names(names: &[&str]) -> Ending {
        Ending::Write(names.iter().map(|name| (*name).to_owned()).collect())
    }

    #[test]
    fn changes_are_accepted_rejected_skipped_and_undone() {
        let edited = Edited::new();
        let (ending, text) = edited.review("x\na\nu\nr\ns\na\nu\na\nw\n");
        assert_eq!(ending, names(&["d"]));
        assert!(text.contains("1 of 3  a ("), "{text}");
        assert!(text.contains("scene edited; changed beyond tolerance"), "{text}");
        assert!(text.contains("first at step 0"), "{text}");
        assert!(text.contains("  position  ▁"), "{text}");
        assert!(text.contains("git does not know"), "{text}");
        assert!(text.contains("3 of 3  d\n  removed: its scene is gone"), "{text}");
        assert!(text.contains("Type one of the letters"), "{text}");
        assert!(text.contains("Changes: 3. Accepted: 1, rejected: 1, skipped: 1."), "{text}");
    }

    #[test]
    fn review_resumes_and_asks_again_about_later_changes() {
        let mut edited = Edited::new();
        let (ending, text) = edited.review("a\n");
        assert_eq!(ending, Ending::Left);
        assert!(text.contains(".expected.review.json: 1."), "{text}");
        let (ending, text) = edited.review("r\na\nw\n");
        assert_eq!(ending, names(&["a", "d"]));
        assert!(!text.contains("1 of 3") && text.contains("2 of 3  b"), "{text}");

        // Another trace than the one that was accepted.
        let path = edited.folder.path().join("assets/a.xml");
        std::fs::write(&path, SCENE.replace("SPEED", "3")).unwrap();
        let sections = [(Section::Required, edited.folder.path().join("assets"))];
        edited.suite = Suite::load(&sections, &ParseOptions::default()).unwrap();
        let (ending, text) = edited.review("a\nw\n");
        assert_eq!(ending, names(&["a", "d"]));
        assert!(text.contains("1 of 3  a") && !text.contains("2 of 3"), "{text}");
    }

    #[test]
    fn accepted_traces_are_replaced_and_others_stay_with_their_entries() {
        let edited = Edited::new();
        let read = |name: &str| std::fs::read_to_string(edited.expected().join(name)).unwrap();
        let (old_a, old_d) = (read("a.csv"), read("d.csv"));
        let (ending, _) = edited.review("r\na\ns\nw\n");
        let Ending::Write(accepted) = ending else { panic!("not written") };
        let origin = Origin { commit: Some("c0ffee".to_owned()), platform: None };
        let accept = Acceptance::Some(&accepted);
        let regeneration = edited.stage().replace(accept, &origin).unwrap();
        assert!(regeneration.replaced && regeneration.refused());
        assert_eq!(regeneration.kept.into_iter().collect::<Vec<_>>(), ["a", "d"]);
        assert_eq!((read("a.csv"), read("d.csv")), (old_a, old_d));
        assert!(read("b.csv").contains(",2.0,"), "{}", read("b.csv"));
        // Only the new trace has a new origin.
        assert_eq!(read("manifest.toml").matches("c0ffee").count(), 1);
        assert_eq!(read("envelopes.toml").matches("[[scene]]").count(), 4);
        let oracle = grader::oracle::Oracle::open(&edited.expected()).unwrap();
        let faults: Vec<bool> =
            edited.suite.cases.iter().map(|case| oracle.fault(case).is_some()).collect();
        assert_eq!(faults, [true, false, false], "the trace of a is that of the old scene");
        // Nothing more changes by the same answer.
        let regeneration = edited.stage().replace(accept, &Origin::default()).unwrap();
        assert!(!regeneration.replaced && regeneration.kept.len() == 2);
    }
}
