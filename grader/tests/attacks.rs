//! Hostile submissions: each gets its named verdict, and changes nothing.
//!
//! `attacks/hostile.c` has the attacks; the table of what they come to is printed, and stands in
//! `docs/attacks.md` (`UPDATE_DOCS=1` writes it).

#![cfg(target_os = "linux")]
#![expect(
    clippy::print_stderr,
    reason = "what is skipped is told, and the table is for people to see"
)]

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::net::TcpListener;
use std::panic::AssertUnwindSafe;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::Duration;

use grader::sandbox::{Protection, Sandbox};

const GRADE: &str = env!("CARGO_BIN_EXE_grade");

const SCENE: &str = r#"<scene>
  <duration time="0.5"/>
  <integrator type="explicit-euler" dt="0.1"/>
  <particle m="1" px="0" py="0" vx="1" vy="2" fixed="0"/>
</scene>
"#;

/// What an attack is after.
#[derive(Clone, Copy)]
enum Target {
    Nothing,
    Oracle,
    OtherScene,
    OtherSubmission,
    Home,
    Report,
    Process,
    Port,
}

use Target::{Home, Nothing, Oracle, OtherScene, OtherSubmission, Port, Process, Report};

/// What is tried, by which mode, at what; the verdicts that say it was held. Where an attack has nothing to
/// end it, its trace is right, and the verdict a pass.
const ATTACKS: &[(&str, &str, Target, &[&str])] = &[
    ("hand in a right trace", "hand_in", Nothing, &["pass"]),
    ("read the oracle by its path", "read_oracle", Oracle, &["pass"]),
    ("read the oracle by a symbolic and by a hard link", "read_by_link", Oracle, &["pass"]),
    ("read the oracle through /proc", "read_by_proc", Oracle, &["pass"]),
    ("use what descriptors the grader inherited", "read_inherited", Nothing, &["pass"]),
    ("read the grader's environment and memory", "read_environment", Nothing, &["pass"]),
    ("read another scene", "read_oracle", OtherScene, &["pass"]),
    ("read another submission", "read_oracle", OtherSubmission, &["pass"]),
    ("read the home folder", "read_oracle", Home, &["pass"]),
    ("overwrite the oracle", "overwrite", Oracle, &["pass"]),
    ("overwrite the report", "overwrite", Report, &["pass"]),
    ("write beside its folder, and move the folder", "write_elsewhere", Nothing, &["pass"]),
    ("a link to the oracle as trace", "output_link", Oracle, &["no-output"]),
    ("a link to a device as trace", "output_device", Nothing, &["no-output"]),
    ("a folder as trace", "output_folder", Nothing, &["no-output"]),
    ("a pipe as trace", "output_fifo", Nothing, &["pass"]),
    ("a socket as trace", "output_socket_file", Nothing, &["pass"]),
    ("a file of two names as trace", "output_second_name", Nothing, &["no-output"]),
    // The kernel refuses it more processes, or it is seen to have too many.
    ("fork bomb", "fork_bomb", Nothing, &["too-many-processes", "timed-out"]),
    ("thread bomb", "thread_bomb", Nothing, &["too-many-processes", "timed-out"]),
    ("memory bomb", "memory_bomb", Nothing, &["out-of-memory"]),
    ("bomb of shared memory", "shared_memory_bomb", Nothing, &["out-of-memory"]),
    ("memory in many processes", "forked_memory_bomb", Nothing, &["out-of-memory"]),
    ("spin", "spin", Nothing, &["timed-out"]),
    ("sleep", "sleep_long", Nothing, &["timed-out"]),
    ("stop itself", "stop_itself", Nothing, &["timed-out"]),
    ("ignore every signal", "ignore_signals", Nothing, &["timed-out"]),
    ("flood of trace", "flood_trace", Nothing, &["too-much-output"]),
    ("flood of standard output", "flood_stdout", Nothing, &["too-much-output"]),
    ("flood of standard error", "flood_stderr", Nothing, &["too-much-output"]),
    ("files without end", "many_files", Nothing, &["too-much-output"]),
    ("fill the disk with files of fair size", "many_large_files", Nothing, &["too-much-output"]),
    ("a trace that claims a petabyte", "huge_claim", Nothing, &["too-much-output"]),
    ("a trace of millions of zeros", "sparse_trace", Nothing, &["malformed"]),
    ("garbage as trace", "garbage_trace", Nothing, &["malformed"]),
    ("a daemon that outlives its parent", "daemon_outlives", Nothing, &["pass"]),
    ("alter the trace after the end", "alter_afterwards", Nothing, &["pass"]),
    ("kill the grader and others", "kill_others", Process, &["pass"]),
    ("trace the grader and others", "trace_others", Process, &["pass"]),
    ("limit others", "limit_others", Nothing, &["pass"]),
    ("connect to loopback", "connect_loopback", Port, &["pass"]),
    ("connect out", "connect_out", Port, &["pass"]),
    ("send a datagram", "send_datagram", Port, &["pass"]),
    ("a socket of the file system", "unix_socket", Nothing, &["pass"]),
    ("gain privileges, make namespaces, mount", "new_privileges", Nothing, &["pass"]),
    ("leave shared memory behind", "leave_behind", Nothing, &["pass"]),
    ("terminal escapes", "escapes", Nothing, &["crashed"]),
    ("crash", "segfault", Nothing, &["crashed"]),
    ("exit 0 with no output", "nothing", Nothing, &["no-output"]),
    ("exit 1 with a right trace", "exit_1_with_a_right_trace", Nothing, &["crashed"]),
];

/// A folder with a suite of two scenes, their oracle, and submissions.
struct Stage {
    root: tempfile::TempDir,
    victim: Child,
    listener: TcpListener,
}

impl Drop for Stage {
    fn drop(&mut self) {
        let _ = self.victim.kill();
        let _ = self.victim.wait();
    }
}

impl Stage {
    fn new(program: &Path) -> Self {
        let root = tempfile::tempdir().unwrap();
        let victim = Command::new("sleep").arg("600").stdout(Stdio::null()).spawn().unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let stage = Self { root, victim, listener };
        for folder in ["assets/Free", "submissions/other", "home", "reports"] {
            fs::create_dir_all(stage.path(folder)).unwrap();
        }
        fs::write(stage.path("assets/Free/one.xml"), SCENE).unwrap();
        fs::write(stage.path("assets/Free/two.xml"), SCENE.replace("vx=\"1\"", "vx=\"3\""))
            .unwrap();
        fs::write(stage.path("submissions/other/solution.c"), "int main;").unwrap();
        fs::write(stage.path("home/diary.txt"), "secret").unwrap();
        fs::copy(program, stage.path("hostile")).unwrap();
        let made = stage.grade(["oracle", "regenerate"]);
        assert!(made.status.success(), "{made:?}");
        // Only the first scene is graded; the second is there to be spied on.
        stage
    }

    fn path(&self, name: &str) -> PathBuf {
        self.root.path().join(name)
    }

    fn grade<const N: usize>(&self, arguments: [&str; N]) -> Output {
        self.grade_in(arguments, &std::env::temp_dir())
    }

    fn grade_in<const N: usize>(&self, arguments: [&str; N], scratch: &Path) -> Output {
        // A descriptor that whoever starts the grader has left open.
        let mut command = Command::new("sh");
        command.args(["-c", "exec 9<\"$0\"; exec \"$@\""]).arg(self.path("hostile")).arg(GRADE);
        command.args(arguments).arg("--root").arg(self.root.path());
        command.env("ATTACK_SECRET", "secret").env("HOME", self.path("home"));
        command.env("TMPDIR", scratch);
        command.output().unwrap()
    }

    /// Makes the submission of a mode, and returns its folder.
    fn submission(&self, mode: &str, target: Target) -> PathBuf {
        let folder = self.path("submissions").join(mode);
        fs::create_dir_all(&folder).unwrap();
        fs::copy(self.path("hostile"), folder.join("hostile")).unwrap();
        fs::copy(self.path("expected/Free/one.csv"), folder.join("right.csv")).unwrap();
        let target = match target {
            Nothing => "nothing".to_owned(),
            Oracle => self.path("expected/Free/one.csv").display().to_string(),
            OtherScene => self.path("assets/Free/two.xml").display().to_string(),
            OtherSubmission => self.path("submissions/other/solution.c").display().to_string(),
            Home => self.path("home/diary.txt").display().to_string(),
            Report => self.path("reports/report.json").display().to_string(),
            Process => self.victim.id().to_string(),
            Port => self.listener.local_addr().unwrap().port().to_string(),
        };
        let manifest = format!(
            "name = \"hostile\"\nrun = [\"./hostile\", \"{mode}\", \"{{scene}}\", \"{{trace}}\", \
             \"{{folder}}/right.csv\", \"{target}\"]\n"
        );
        fs::write(folder.join("submission.toml"), manifest).unwrap();
        folder
    }

    /// The verdict on the first scene, and the report.
    fn verdict(&self, submission: &Path) -> (String, String) {
        self.verdict_in(submission, &std::env::temp_dir())
    }

    /// The same, with scratch folders below this one.
    fn verdict_in(&self, submission: &Path, scratch: &Path) -> (String, String) {
        let report = self.path("reports/report.json");
        let arguments = [
            submission.to_str().unwrap(),
            "--only",
            "Free/one",
            "--format=json",
            "--output",
            report.to_str().unwrap(),
            "--limit=cpu=1",
            "--limit=wall=2",
            "--limit=memory=160M",
            "--limit=processes=24",
            "--limit=trace=16M",
            "--limit=stdout=1M",
            "--limit=stderr=1M",
            "--limit=files=16",
        ];
        let output = self.grade_in(arguments, scratch);
        assert!(matches!(output.status.code(), Some(0 | 1)), "{output:?}");
        let text = fs::read_to_string(report).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        let verdict = &json["features"][0]["scenes"][0]["verdict"];
        (verdict.as_str().unwrap().to_owned(), text)
    }

    /// Everything there is, but for the reports.
    fn files(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut files = BTreeMap::new();
        let mut folders = vec![self.root.path().to_path_buf()];
        while let Some(folder) = folders.pop() {
            for entry in folder.read_dir().unwrap().flatten() {
                let path = entry.path();
                if path == self.path("reports") {
                } else if path.is_dir() {
                    folders.push(path);
                } else {
                    files.insert(path.clone(), fs::read(path).unwrap());
                }
            }
        }
        files
    }
}

/// Processes that are called so.
fn running(name: &str) -> Vec<PathBuf> {
    let processes = fs::read_dir("/proc").unwrap().flatten().map(|entry| entry.path());
    let called = |path: &PathBuf| {
        fs::read_to_string(path.join("comm")).is_ok_and(|comm| comm.trim_end() == name)
    };
    processes.filter(called).collect()
}

/// The compiled attacks; `None`, with a printed reason, where they cannot be run.
fn hostile() -> Option<PathBuf> {
    static PROGRAM: OnceLock<Option<(tempfile::TempDir, PathBuf)>> = OnceLock::new();
    let made = PROGRAM.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("hostile");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/attacks/hostile.c");
        let mut compiler = Command::new("cc");
        compiler.args(["-O0", "-pthread", "-o"]).arg(&program).arg(source);
        match compiler.status() {
            Ok(status) => assert!(status.success(), "hostile.c is not accepted"),
            Err(error) => {
                eprintln!("skipped: there is no C compiler: {error}");
                return None;
            }
        }
        let offered = Sandbox::open(Path::new(GRADE)).unwrap();
        let offered = offered.protections();
        if offered != Protection::ALL {
            eprintln!("skipped: this system offers only {offered:?}");
            return None;
        }
        Some((folder, program))
    });
    made.as_ref().map(|(_, program)| program.clone())
}

/// One at a time: each looks for processes of the other's name.
static ONE: Mutex<()> = Mutex::new(());

#[test]
fn every_attack_is_held() {
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(program) = hostile() else { return };
    let mut stage = Stage::new(&program);
    let good = stage.submission("hand_in", Nothing);
    let (_, before) = stage.verdict(&good);

    let mut table = String::from("| attack | verdict |\n| --- | --- |\n");
    for (what, mode, target, expected) in ATTACKS {
        let submission = stage.submission(mode, *target);
        let files = stage.files();
        let (verdict, report) = stage.verdict(&submission);
        assert!(expected.contains(&verdict.as_str()), "{what}: {verdict}\n{report}");
        assert!(!report.contains("BREACH"), "{what}: {report}");
        assert_eq!(stage.files(), files, "{what}");
        assert_eq!(running("hostile"), Vec::<PathBuf>::new(), "{what}");
        writeln!(table, "| {what} | {} |", expected.join(" or ")).unwrap();
    }
    for escaped in ["/tmp/escaped", "/var/tmp/escaped", "/dev/shm/escaped", "/tmp/moved"] {
        assert!(!Path::new(escaped).exists(), "{escaped}");
    }
    assert!(stage.listener.accept().is_err(), "someone connected");
    assert_eq!(stage.victim.try_wait().unwrap(), None, "the bystander was killed");
    let (_, after) = stage.verdict(&good);
    assert_eq!(before, after);

    eprint!("{table}");
    let document = format!(
        "# Attacks\n\nWritten and held by `cargo test -p grader --test attacks`. Each is a submission; none \
         reads or changes\nanything but its own, leaves anything running, or keeps its verdict from being \
         given. Where nothing ends\nan attack, it hands in a right trace, and passes.\n\n{table}"
    );
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/attacks.md");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&path, &document).unwrap();
    }
    assert_eq!(
        fs::read_to_string(&path).unwrap_or_default(),
        document,
        "run it with UPDATE_DOCS=1"
    );
}

/// The grader is killed at fifty moments of a run; each time nothing is left running, no file is half written,
/// and the next run is right.
#[test]
fn a_killed_grader_leaves_nothing() {
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(program) = hostile() else { return };
    let stage = Stage::new(&program);
    let (good, slow) = (stage.submission("hand_in", Nothing), stage.submission("spin", Nothing));
    let scratch = stage.path("scratch");
    fs::create_dir(&scratch).unwrap();
    let (_, expected) = stage.verdict(&good);
    let files = stage.files();
    let report = stage.path("reports/report.json");
    let mut rng = fastrand::Rng::with_seed(1);
    for moment in 0..50 {
        let mut grader = Command::new(GRADE)
            .arg(if moment % 2 == 0 { &good } else { &slow })
            .args(["--format=json", "--output"])
            .arg(&report)
            .arg("--root")
            .arg(stage.root.path())
            .env("TMPDIR", &scratch)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_micros(rng.u64(0..20_000)));
        grader.kill().unwrap();
        grader.wait().unwrap();
        // The kernel ends what is left; at its low priority that takes a moment, or more on a busy machine.
        for _ in 0..10_000 {
            if running("hostile").is_empty() {
                break;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        assert_eq!(running("hostile"), Vec::<PathBuf>::new(), "moment {moment}");
        let text = fs::read_to_string(&report).unwrap();
        let whole: Result<serde_json::Value, _> = serde_json::from_str(&text);
        assert!(whole.is_ok(), "moment {moment}: {text}");
    }
    let (_, after) = stage.verdict_in(&good, &scratch);
    assert_eq!(after, expected);
    assert_eq!(fs::read_dir(&scratch).unwrap().count(), 0, "scratch folders are left");
    assert_eq!(stage.files(), files);
}

/// A submission is killed from outside at twenty moments of its run: it has crashed, the report is whole, and what
/// another one gets is what it got before.
#[test]
fn a_killed_submission_has_crashed() {
    let _one = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(program) = hostile() else { return };
    let stage = Stage::new(&program);
    let (good, slow) =
        (stage.submission("hand_in", Nothing), stage.submission("sleep_long", Nothing));
    let (_, expected) = stage.verdict(&good);
    let mut rng = fastrand::Rng::with_seed(2);
    for moment in 0..20 {
        let pause = Duration::from_micros(rng.u64(0..20_000));
        let done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !done.load(Ordering::Relaxed) {
                    std::thread::sleep(pause);
                    for process in running("hostile") {
                        let number = process.file_name().unwrap();
                        // It may have ended meanwhile.
                        let _ = Command::new("kill").arg("-9").arg(number).output();
                    }
                }
            });
            let graded = std::panic::catch_unwind(AssertUnwindSafe(|| stage.verdict(&slow)));
            done.store(true, Ordering::Relaxed);
            let (verdict, report) = graded.unwrap();
            assert_eq!(verdict, "crashed", "moment {moment}: {report}");
        });
    }
    assert_eq!(stage.verdict(&good).1, expected);
}
