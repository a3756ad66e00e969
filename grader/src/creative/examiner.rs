//! Runs [`examine`] in the sandbox, and reads what was found.
//!
//! ```text
//! grade --creative-examiner NAME SECONDS WANTED      in the sandbox; scene/NAME in its working directory
//!   └──> result       a line of JSON (Examined), then the picture that is wanted
//! ```
//!
//! The scene's file is the only file of its author in there, and the mesh that it names: it is asked for, and the scene
//! examined again. The result is as untrusted as the scene: its line is bounded and read strictly, words must be known, and
//! texts are shortened and freed of control characters. A picture is checked by what shows it.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use sandbox::scratch::{Scratch, scratch_folder};
use sandbox::{End, Job, Keep, Limits, Sandbox, SandboxError};
use scene::Scene;
use simulator::vocabulary;

use super::examine::{Examined, Facts, examine};
use super::motion::Motion;
use crate::boundary::door::Door;
use crate::boundary::printed;
use crate::submission::hand_in::HandIn;
use crate::submission::hand_in::place::Place;
use crate::submission::program::failure_of_run;

/// First argument of a process that examines a scene.
const EXAMINER: &str = "--creative-examiner";

/// The folder of the scene in its working directory, and its result.
const FOLDER: &str = "scene";
const RESULT: &str = "result";

/// Largest line of a result, in bytes.
const MAX_LINE: u64 = 1 << 18;

/// Largest number of characters of a text in a result.
const MAX_TEXT: usize = 4_000;

/// Time for all but the two runs of a scene.
const BESIDE: Duration = Duration::from_secs(10);

/// A picture of a scene that is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wanted {
    /// None.
    Nothing,
    /// The motion, for a page.
    Motion,
    /// A contact sheet.
    Sheet,
}

impl Wanted {
    const ALL: [(Self, &str); 3] =
        [(Self::Nothing, "nothing"), (Self::Motion, "motion"), (Self::Sheet, "sheet")];
}

/// The limits of an examination whose runs have so much time each.
pub fn limits(of_run: Duration) -> Limits {
    let seconds = (2 * of_run + BESIDE).as_secs_f64();
    Limits {
        cpu: seconds,
        wall: seconds,
        memory: 1 << 30,
        trace: Door::Examined.facts().limit.bytes(),
        stdout: 1 << 16,
        stderr: 1 << 16,
        ..Limits::default()
    }
}

/// Examines scenes in the sandbox.
#[derive(Debug)]
pub struct Examiner {
    sandbox: Sandbox,
    program: PathBuf,
    limits: Limits,
    of_run: Duration,
    results: Scratch,
    number: AtomicU64,
}

/// A picture that was drawn in the sandbox: untrusted bytes.
#[derive(Debug)]
pub struct Picture {
    path: PathBuf,
    start: u64,
}

impl Picture {
    /// Its bytes, as many as the sandbox let it write.
    ///
    /// # Errors
    /// If they cannot be read.
    pub fn read(&self) -> io::Result<Vec<u8>> {
        let mut file = Door::Examined.open(&self.path).map_err(io::Error::other)?;
        file.get_mut().seek(SeekFrom::Start(self.start))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}

impl Examiner {
    /// An examiner that starts `launcher`, a program that begins with [`serve`].
    ///
    /// # Errors
    /// If its scratch folder cannot be created.
    pub fn new(
        sandbox: Sandbox,
        launcher: &Path,
        of_run: Duration,
        limits: Limits,
    ) -> Result<Self, SandboxError> {
        let results = scratch_folder().map_err(SandboxError::no_scratch)?;
        let mut program = launcher.to_path_buf();
        // The sandbox's own user may lack permission to read the original.
        if sandbox.has_own_user() {
            program = results.path().join("program");
            let copied = HandIn::open(launcher).and_then(|file| file.copy_to(&program));
            copied.map_err(|error| SandboxError::no_scratch(io::Error::other(error)))?;
        }
        Ok(Self { sandbox, program, limits, of_run, results, number: AtomicU64::new(0) })
    }

    /// Examines the scene of this name and content. An error says why its run was ended.
    pub(super) fn examine(
        &self,
        place: &Place,
        (name, bytes): (&Path, &[u8]),
        wanted: Wanted,
    ) -> Result<Result<(Examined, Option<Picture>), String>, SandboxError> {
        let run = |files: &[(&Path, &[u8])]| {
            // A new folder for each run: what ran in an earlier one may have left links in it.
            let work = scratch_folder().map_err(SandboxError::no_scratch)?;
            let folder = work.path().join("scratch");
            let put = |(below, bytes): &(&Path, &[u8])| {
                let path = folder.join(FOLDER).join(below);
                fs::create_dir_all(path.parent().unwrap_or(&folder))?;
                fs::write(path, bytes)
            };
            files.iter().try_for_each(put).map_err(SandboxError::no_scratch)?;
            self.run(&folder, name, wanted)
        };
        let found = run(&[(name, bytes)])?;
        let Ok((Examined::NeedsMesh { mesh, place: mention }, _)) = &found else {
            return Ok(found);
        };
        let below = Path::new(mesh);
        match place.beside(below).and_then(|file| file.read(Door::CreativeScene)) {
            Ok(mesh) => Ok(match run(&[(name, bytes), (below, &mesh)])? {
                Ok((Examined::NeedsMesh { .. }, _)) => Err("its mesh was not found".to_owned()),
                again => again,
            }),
            Err(error) => {
                let error = format!("{mention}: the mesh {error}");
                Ok(Ok((Examined::Malformed(error), None)))
            }
        }
    }

    fn run(
        &self,
        folder: &Path,
        name: &Path,
        wanted: Wanted,
    ) -> Result<Result<(Examined, Option<Picture>), String>, SandboxError> {
        let number = self.number.fetch_add(1, Ordering::Relaxed);
        let path = self.results.path().join(number.to_string());
        let word =
            Wanted::ALL.iter().find(|(each, _)| *each == wanted).map_or("", |(_, word)| word);
        let seconds = self.of_run.as_secs_f64().to_string();
        let arguments = [EXAMINER.as_ref(), name.as_os_str(), seconds.as_ref(), word.as_ref()];
        let job = Job {
            program: self.program.clone(),
            arguments: arguments.map(OsString::from).into(),
            folder: folder.to_path_buf(),
            input: None,
            keep: Keep::File(RESULT.to_owned(), path.clone()),
            readable: vec![self.program.clone()],
            limits: self.limits,
        };
        let outcome = self.sandbox.run(&job)?;
        if outcome.end != End::Exited(0) {
            let failure = failure_of_run(&outcome, &job, &self.sandbox);
            let help = "help: make the scene smaller or shorter, or set other limits with --seconds and --limit";
            return Ok(Err(format!("its check was ended: {failure}\n{help}")));
        }
        if let Err(reason) = outcome.kept {
            return Ok(Err(format!("its check left no result: it {reason}")));
        }
        let result = read(&path).unwrap_or_else(|error| {
            Err(format!("the result of its check cannot be read: {error}"))
        });
        Ok(result)
    }
}

/// Reads a result.
fn read(path: &Path) -> io::Result<Result<(Examined, Option<Picture>), String>> {
    let file = Door::Examined.open(path).map_err(io::Error::other)?;
    let size = file.get_ref().metadata()?.len();
    let mut line = Vec::new();
    BufReader::new(file).take(MAX_LINE).read_until(b'\n', &mut line)?;
    let start = line.len() as u64;
    let Some(examined) = Examined::parse(&line) else {
        return Ok(Err("the result of its check is malformed".to_owned()));
    };
    let picture = (size > start).then(|| Picture { path: path.to_path_buf(), start });
    Ok(Ok((examined, picture)))
}

impl Examined {
    /// Reads the line of a result, with its line break: its words are known, and its texts harmless.
    pub fn parse(line: &[u8]) -> Option<Self> {
        let line = line.strip_suffix(b"\n")?;
        serde_json::from_slice::<Self>(line).ok().and_then(Self::checked)
    }

    /// The same with harmless texts; `None` if it has words that no scene has.
    fn checked(self) -> Option<Self> {
        let text =
            |text: String| -> String { printed::text(&text).chars().take(MAX_TEXT).collect() };
        let either = |found: Result<String, String>| found.map(text).map_err(text);
        let vocabulary = vocabulary();
        Some(match self {
            Self::NoScene => Self::NoScene,
            Self::NeedsMesh { mesh, place } => Self::NeedsMesh { mesh, place: text(place) },
            Self::Malformed(error) => Self::Malformed(text(error)),
            Self::Scene(facts) => {
                let are_known = facts.forces.iter().all(|tag| vocabulary.force(tag).is_some())
                    && vocabulary.integrator(&facts.integrator).is_some()
                    && [2, 3].contains(&facts.dimension);
                if !are_known {
                    return None;
                }
                Self::Scene(Facts {
                    format: either(facts.format),
                    description: facts.description.map(text),
                    run: either(facts.run),
                    overlap: either(facts.overlap),
                    ..facts
                })
            }
        })
    }
}

/// Examines a scene if this process was started to do so; otherwise returns `None`. `draw` makes the picture that is
/// wanted. Call it before any thread starts.
pub fn serve(draw: impl Fn(Wanted, &Scene, &Motion) -> io::Result<Vec<u8>>) -> Option<ExitCode> {
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next()? != EXAMINER {
        return None;
    }
    Some(match answer(arguments, draw) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let _ = writeln!(io::stderr(), "{error}");
            ExitCode::FAILURE
        }
    })
}

fn answer(
    arguments: impl Iterator<Item = OsString>,
    draw: impl Fn(Wanted, &Scene, &Motion) -> io::Result<Vec<u8>>,
) -> io::Result<()> {
    let unknown = || io::Error::other("unknown arguments");
    let arguments: Vec<OsString> = arguments.collect();
    let [name, seconds, word] = arguments.as_slice() else { return Err(unknown()) };
    let seconds = seconds.to_str().and_then(|seconds| seconds.parse().ok()).ok_or_else(unknown)?;
    let limit = Duration::try_from_secs_f64(seconds).map_err(io::Error::other)?;
    let wanted = Wanted::ALL.iter().find(|(_, each)| word == each).ok_or_else(unknown)?.0;
    // Processor time is that of all threads.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
    pool.build_global().map_err(io::Error::other)?;
    std::env::set_current_dir(FOLDER)?;
    let (examined, shown) = examine(Path::new(name), limit);
    let examined = examined.checked().ok_or_else(unknown)?;
    let mut result = File::create(Path::new("..").join(RESULT))?;
    result.write_all(format!("{}\n", serde_json::to_string(&examined)?).as_bytes())?;
    if let Some((scene, motion)) = shown {
        result.write_all(&draw(wanted, &scene, &motion)?)?;
    }
    result.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The findings in a result of these bytes.
    fn found(bytes: &[u8]) -> Result<(Examined, Option<Vec<u8>>), String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result");
        fs::write(&path, bytes).unwrap();
        let (examined, picture) = read(&path).unwrap()?;
        Ok((examined, picture.map(|picture| picture.read().unwrap())))
    }

    const SCENE: &str = r#"{"scene":{"format":{"Ok":"a\u001b[2J"},"forces":["springforce"],"integrator":"explicit-euler",
        "dimension":2,"description":"\u202eb","run":{"Err":"c"},"overlap":{"Ok":"d"}}}"#;

    #[test]
    fn texts_of_a_result_are_inert_and_the_picture_follows_them() {
        let line = SCENE.replace("\n        ", "");
        let (examined, picture) = found(format!("{line}\nPICTURE\n").as_bytes()).unwrap();
        let Examined::Scene(facts) = examined else { panic!("{examined:?}") };
        assert_eq!(facts.format.as_deref(), Ok("a\u{fffd}[2J"));
        assert_eq!(facts.description.as_deref(), Some("\u{fffd}b"));
        assert_eq!(picture.as_deref(), Some(&b"PICTURE\n"[..]));
        assert_eq!(found(b"\"no-scene\"\n").unwrap(), (Examined::NoScene, None));
        let long = format!("{{\"malformed\":\"{}\"}}\n", "x".repeat(100_000));
        let expected = Examined::Malformed("x".repeat(MAX_TEXT));
        assert_eq!(found(long.as_bytes()).unwrap().0, expected);
    }

    #[test]
    fn a_malformed_result_is_refused() {
        let line = SCENE.replace("\n        ", "") + "\n";
        let endless = format!("{{\"malformed\":\"{}\"}}\n", "x".repeat(MAX_LINE as usize));
        for result in [
            "",
            "\n",
            "\"no-scene\"",
            "{}\n",
            "\"passed\"\n",
            "[[[[[[[[\n",
            &line.replace("springforce", "<script>"),
            &line.replace("explicit-euler", "magic"),
            &line.replace("\"dimension\":2", "\"dimension\":4"),
            &line.replace("\"dimension\":2", "\"dimension\":2,\"credit\":1"),
            &line.replace("\"run\":{\"Err\":\"c\"},", ""),
            &line.replace("{\"Err\":\"c\"}", "\"passed\""),
            &endless,
        ] {
            assert!(found(result.as_bytes()).is_err(), "{result:.200}");
        }
    }
}
