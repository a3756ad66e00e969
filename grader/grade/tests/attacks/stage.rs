//! Stages of attacks: a suite of two scenes with its oracle, submissions and a bystander process, and checks that
//! nothing else changes.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::io;
use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::os::unix::fs::{MetadataExt, PermissionsExt, lchown};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use test_support::FREE_PARTICLE;

use super::setting::Setting;
use super::table::Target;

const GRADE: &str = env!("CARGO_BIN_EXE_grade");

/// Small enough that a fork or memory bomb exceeds them soon, large enough for the output of attacks in builds.
const RUBRIC: &str = "[build-limits]\ncpu = 10\nwall = 10\nmemory = 500000000\nprocesses = 64\n\
                      trace = 400000000\n";

/// Limits of each run.
const LIMITS: [&str; 8] = [
    "cpu=4",
    "wall=10",
    "memory=160M",
    "processes=24",
    "trace=16M",
    "stdout=1M",
    "stderr=1M",
    "files=16",
];

/// Timeout of a grading, in case it waits for a hostile program forever.
const LONGEST: Duration = Duration::from_secs(150);

/// Compiled programs.
#[derive(Debug)]
pub(crate) struct Programs {
    folder: tempfile::TempDir,
}

impl Programs {
    /// Compiles them once, with the compiler that Rust links with.
    pub(crate) fn get() -> &'static Self {
        static PROGRAMS: LazyLock<Programs> = LazyLock::new(Programs::compile);
        &PROGRAMS
    }

    fn compile() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/attacks");
        let hostile = fs::read_dir(sources.join("hostile")).unwrap().flatten();
        let mut hostile: Vec<PathBuf> = hostile.map(|entry| entry.path()).collect();
        hostile.retain(|path| path.extension() == Some("c".as_ref()));
        hostile.sort();
        let bystander = vec![sources.join("bystander.c")];
        let setting = vec![sources.join("setting.c")];
        for (name, sources) in
            [("hostile", hostile), ("bystander", bystander), ("setting", setting)]
        {
            let mut compiler = Command::new("cc");
            compiler.args(["-O0", "-pthread", "-o"]).arg(folder.path().join(name));
            let status = compiler.args(sources).arg("-lrt").status().unwrap();
            assert!(status.success(), "{name} is not accepted");
        }
        open_to_all(folder.path());
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The launcher of settings.
    pub(crate) fn launcher(&self) -> PathBuf {
        self.path("setting")
    }
}

/// The bystander: a process with its own objects that attacks target.
#[derive(Debug)]
struct Bystander {
    process: Child,
    number: String,
    key: String,
    queue: String,
    socket: String,
}

impl Drop for Bystander {
    fn drop(&mut self) {
        // The bystander removes its objects when its input ends.
        drop(self.process.stdin.take());
        let _ = self.process.wait();
    }
}

/// A folder with the files shared by the stages of one setting.
#[derive(Debug)]
pub(crate) struct SharedStage {
    pub(crate) setting: Setting,
    root: tempfile::TempDir,
    bystander: Bystander,
    listener: TcpListener,
    count: AtomicUsize,
}

impl SharedStage {
    pub(crate) fn new(programs: &Programs, setting: Setting) -> Self {
        let root = tempfile::tempdir().unwrap();
        open_to_all(root.path());
        for folder in ["bystander", "bin"] {
            fs::create_dir(root.path().join(folder)).unwrap();
        }
        // The setting's user may be unable to reach the folder where it was compiled.
        fs::copy(GRADE, root.path().join("bin/grade")).unwrap();
        for name in ["setting", "hostile"] {
            fs::copy(programs.path(name), root.path().join("bin").join(name)).unwrap();
        }
        give(setting, &root.path().join("bystander"));
        let mut process = setting
            .command(&programs.launcher())
            .arg(programs.path("bystander"))
            .arg(root.path().join("bystander"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let mut words = line.split_ascii_whitespace().map(str::to_owned);
        let mut word = || words.next().unwrap();
        let [number, key, queue, socket] = [word(), word(), word(), word()];
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        listener.set_nonblocking(true).unwrap();
        let bystander = Bystander { process, number, key, queue, socket };
        let shared_stage = Self { setting, root, bystander, listener, count: AtomicUsize::new(0) };
        let template = shared_stage.path("template");
        for folder in ["assets/Free", "submissions/other", "home", "reports"] {
            fs::create_dir_all(template.join(folder)).unwrap();
        }
        let other = FREE_PARTICLE.replace("vx=\"1\"", "vx=\"3\"");
        // Only the first scene is graded; the second is a target for spying.
        for (name, text) in [
            ("assets/Free/one.xml", FREE_PARTICLE),
            ("assets/Free/two.xml", &other),
            ("assets/rubric.toml", RUBRIC),
            ("submissions/other/solution.c", "int main;"),
            ("home/diary.txt", "secret"),
        ] {
            fs::write(template.join(name), text).unwrap();
        }
        let mut regenerate = Command::new(GRADE);
        regenerate.args(["oracle", "regenerate", "--root"]).arg(&template);
        let made = regenerate.output().unwrap();
        assert!(made.status.success(), "{made:?}");
        shared_stage
    }

    fn path(&self, name: &str) -> PathBuf {
        self.root.path().join(name)
    }

    /// A new stage.
    pub(crate) fn stage(&self) -> Stage<'_> {
        let number = self.count.fetch_add(1, Ordering::Relaxed);
        let folder = self.path(&format!("stage-{number}"));
        copy_folder(&self.path("template"), &folder);
        fs::create_dir(folder.join("scratch")).unwrap();
        give(self.setting, &folder);
        Stage { shared_stage: self, folder }
    }

    fn target(&self, target: Target, stage: &Stage) -> String {
        let path = |name: &str| stage.path(name).display().to_string();
        match target {
            Target::Nothing => "nothing".to_owned(),
            Target::Oracle => path("expected/Free/one.csv"),
            Target::OtherScene => path("assets/Free/two.xml"),
            Target::OtherSubmission => path("submissions/other/solution.c"),
            Target::Home => path("home/diary.txt"),
            Target::Report => path("reports/report.json"),
            Target::Process => self.bystander.number.clone(),
            Target::Port => self.listener.local_addr().unwrap().port().to_string(),
            Target::Key => self.bystander.key.clone(),
            Target::Queue => self.bystander.queue.clone(),
            Target::Socket => self.bystander.socket.clone(),
            Target::Mount => foreign_mount(),
        }
    }

    /// Changes to the bystander, or remains of the setting's user, caused by attacks.
    pub(crate) fn complaints(&mut self) -> Vec<String> {
        let mut complaints = Vec::new();
        if !matches!(self.bystander.process.try_wait(), Ok(None)) {
            complaints.push("the bystander was killed".to_owned());
        }
        if self.listener.accept().is_ok() {
            complaints.push("a program connected to the bystander's port".to_owned());
        }
        if let Some(user) = self.setting.user() {
            let left = processes().filter(|process| {
                process.file_name() != Some(self.bystander.number.as_ref())
                    && fs::metadata(process)
                        .is_ok_and(|metadata| (user..user + 2).contains(&metadata.uid()))
            });
            complaints.extend(left.map(|process| format!("a process is left: {process:?}")));
        }
        complaints
    }
}

/// A folder with a suite, its oracle, and submissions, for one attack.
#[derive(Debug)]
pub(crate) struct Stage<'a> {
    shared_stage: &'a SharedStage,
    folder: PathBuf,
}

/// Result of a grading.
#[derive(Debug)]
pub(crate) struct Graded {
    /// The verdict on the first scene; `breach` if the attack reports success.
    pub(crate) verdict: String,
    /// The report.
    pub(crate) report: String,
    /// Whether a set-user-ID or set-group-ID file appeared in the scratch folder.
    pub(crate) privileged_file: Option<PathBuf>,
}

impl Drop for Stage<'_> {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
    }
}

impl Stage<'_> {
    /// A file of the stage.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// An argument that identifies processes of this stage.
    fn tag(&self) -> String {
        let shared_stage = self.shared_stage.root.path().file_name().unwrap().to_string_lossy();
        format!("tag{shared_stage}-{}-end", self.folder.file_name().unwrap().to_string_lossy())
    }

    /// Creates the hostile submission with these modes and returns its folder.
    pub(crate) fn submission(&self, mode: &str, build: &str, target: Target) -> PathBuf {
        let folder = self.path("submissions").join("hostile");
        fs::create_dir_all(&folder).unwrap();
        let program = self.shared_stage.path("bin/hostile");
        for name in ["hostile", "privileged"] {
            // A new file each time: its predecessor may still be running.
            let _ = fs::remove_file(folder.join(name));
            fs::copy(&program, folder.join(name)).unwrap();
        }
        fs::copy(self.path("expected/Free/one.csv"), folder.join("right.csv")).unwrap();
        let (target, tag) = (self.shared_stage.target(target, self), self.tag());
        let mut manifest = format!(
            "name = \"hostile\"\nrun = [\"./hostile\", \"{mode}\", \"{{scene}}\", \"{{trace}}\", \
             \"{{folder}}/right.csv\", \"{target}\", \"{tag}\"]\n"
        );
        if !build.is_empty() {
            manifest += &format!(
                "build = [\"./hostile\", \"{build}\", \"\", \"\", \"{{folder}}/right.csv\", \"{target}\", \
                 \"{tag}\"]\n"
            );
        }
        fs::write(folder.join("submission.toml"), manifest).unwrap();
        give(self.shared_stage.setting, &self.path("submissions"));
        // A change of owner clears these bits.
        let bits = fs::Permissions::from_mode(0o6755);
        fs::set_permissions(folder.join("privileged"), bits).unwrap();
        folder
    }

    /// The command that grades a submission in the setting.
    pub(crate) fn grade(&self, submission: &Path, limits: &[&str]) -> Command {
        self.grade_with_mask("022", submission, limits)
    }

    /// The same, started with this umask.
    pub(crate) fn grade_with_mask(
        &self,
        mask: &str,
        submission: &Path,
        limits: &[&str],
    ) -> Command {
        let shared_stage = self.shared_stage;
        let mut command = shared_stage.setting.command(&shared_stage.path("bin/setting"));
        // A descriptor, a umask and ignored signals, inherited from the parent of the grader.
        let state = format!("umask {mask}; trap '' HUP INT USR1; exec 9<\"$0\"; exec \"$@\"");
        command.args(["sh", "-c", &state]);
        command.arg(shared_stage.path("bin/hostile")).arg(shared_stage.path("bin/grade"));
        command.arg(submission).arg("--root").arg(&self.folder);
        command.args(["--only", "Free/one", "--format=json", "--no-jacobians", "--output"]);
        command.arg(self.path("reports/report.json"));
        for limit in LIMITS.iter().chain(limits) {
            command.arg(format!("--limit={limit}"));
        }
        command.env("ATTACK_SECRET", "secret").env("HOME", self.path("home"));
        // The grader stores the failed scenes for `--last-failed`.
        command.env("XDG_CACHE_HOME", self.path("reports"));
        command.env("TMPDIR", self.path("scratch")).current_dir(&self.folder);
        command.stdin(Stdio::null()).stdout(Stdio::null());
        command
    }

    /// Grades a submission to its end.
    pub(crate) fn graded(&self, submission: &Path, limits: &[&str]) -> Graded {
        let report = self.path("reports/report.json");
        let errors = self.path("reports/stderr");
        let _ = fs::remove_file(&report);
        let mut command = self.grade(submission, limits);
        let mut grader = command.stderr(fs::File::create(&errors).unwrap()).spawn().unwrap();
        let started = Instant::now();
        let mut privileged_file = None;
        let status = loop {
            if let Some(status) = grader.try_wait().unwrap() {
                break Some(status);
            }
            if started.elapsed() > LONGEST {
                let _ = grader.kill();
                let _ = grader.wait();
                break None;
            }
            if privileged_file.is_none() {
                privileged_file = find_privileged(&self.path("scratch"));
            }
            std::thread::sleep(Duration::from_millis(10));
        };
        let errors = fs::read(errors).unwrap_or_default();
        let errors = String::from_utf8_lossy(&errors).into_owned();
        let failed = |verdict: &str| Graded {
            verdict: verdict.to_owned(),
            report: errors.clone(),
            privileged_file: None,
        };
        let Some(status) = status else { return failed("the grader hung") };
        if !matches!(status.code(), Some(0 | 1)) {
            return failed(&format!("the grader ended with {status}"));
        }
        let report = fs::read_to_string(report).unwrap_or_default();
        let Ok(json) = serde_json::from_str::<serde_json::Value>(&report) else {
            return failed("the report is not JSON");
        };
        let verdict = match json["features"][0]["scenes"][0]["verdict"].as_str() {
            _ if report.contains("BREACH") => "breach",
            Some(verdict) => verdict,
            None => "no verdict",
        };
        Graded { verdict: verdict.to_owned(), report: report.clone(), privileged_file }
    }

    /// Remains and changes of an attack, given the files before it.
    pub(crate) fn complaints(&self, before: &Files) -> Vec<String> {
        let mut complaints = Vec::new();
        let after = self.files();
        for (path, now) in &after {
            match before.get(path) {
                None => complaints.push(format!("{} is new", path.display())),
                Some(then) if then != now => {
                    complaints.push(format!("{}: {then}, now {now}", path.display()));
                }
                Some(_) => {}
            }
        }
        let gone = before.keys().filter(|path| !after.contains_key(*path));
        complaints.extend(gone.map(|path| format!("{} is gone", path.display())));
        complaints.extend(self.left().iter().map(|left| format!("{} is left", left.display())));
        complaints
    }

    /// Remaining processes and scratch folders.
    pub(crate) fn left(&self) -> Vec<PathBuf> {
        let mut left: Vec<PathBuf> =
            self.remaining().iter().map(|number| Path::new("/proc").join(number)).collect();
        left.extend(
            fs::read_dir(self.path("scratch")).unwrap().flatten().map(|entry| entry.path()),
        );
        left
    }

    /// The numbers of the processes that remain after a while.
    pub(crate) fn remaining(&self) -> Vec<OsString> {
        let mut running = self.running();
        // The kernel kills the remaining processes, which takes a moment on a busy machine.
        for _ in 0..2_000 {
            if running.is_empty() {
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
            running = self.running();
        }
        running
    }

    /// The numbers of the processes of this stage's submission.
    pub(crate) fn running(&self) -> Vec<OsString> {
        let tag = self.tag();
        let of_stage = |process: &PathBuf| {
            let command = fs::read(process.join("cmdline")).unwrap_or_default();
            command.windows(tag.len()).any(|window| window == tag.as_bytes())
        };
        processes().filter(of_stage).filter_map(|path| Some(path.file_name()?.to_owned())).collect()
    }

    /// All files and folders with their metadata, except reports and scratch folders.
    pub(crate) fn files(&self) -> Files {
        let mut files = Files::new();
        let skipped = [self.path("reports"), self.path("scratch")];
        let mut paths = vec![self.folder.clone()];
        while let Some(path) = paths.pop() {
            if skipped.contains(&path) {
                continue;
            }
            let metadata = fs::symlink_metadata(&path).unwrap();
            let mut entry = format!(
                "mode {:o}, owner {}:{}, size {}, names {}, changed {}.{:09} and {}.{:09}",
                metadata.mode(),
                metadata.uid(),
                metadata.gid(),
                metadata.size(),
                metadata.nlink(),
                metadata.mtime(),
                metadata.mtime_nsec(),
                metadata.ctime(),
                metadata.ctime_nsec(),
            );
            let mut names = [0; 4096];
            if let Ok(length) = rustix::fs::llistxattr(&path, &mut names) {
                entry += &format!(", attributes {:?}", String::from_utf8_lossy(&names[..length]));
            }
            if metadata.is_dir() {
                paths.extend(fs::read_dir(&path).unwrap().flatten().map(|entry| entry.path()));
            } else if metadata.is_file() {
                let content = fs::read(&path).unwrap();
                entry += &format!(", content {:x}", hash_of(&content));
            }
            files.insert(path, entry);
        }
        files
    }
}

/// Paths with their metadata and content.
pub(crate) type Files = BTreeMap<PathBuf, String>;

/// State of the machine that attacks must not change: mounts, control groups, and objects that outlive processes.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Machine {
    mounts: usize,
    groups: Vec<PathBuf>,
    objects: Vec<String>,
    files: Vec<PathBuf>,
}

impl Machine {
    pub(crate) fn look() -> Self {
        let lines = |path: &str| fs::read_to_string(path).unwrap_or_default().lines().count();
        let objects = ["shm", "sem", "msg"].iter().flat_map(|kind| {
            let table = fs::read_to_string(format!("/proc/sysvipc/{kind}")).unwrap_or_default();
            // Compare key and number; the other fields change with use.
            let object = |line: &str| {
                let fields: Vec<&str> = line.split_ascii_whitespace().take(2).collect();
                format!("{kind} {}", fields.join(" "))
            };
            table.lines().skip(1).map(object).collect::<Vec<_>>()
        });
        let mut groups = vec![PathBuf::from("/sys/fs/cgroup")];
        let mut next = 0;
        while let Some(group) = groups.get(next) {
            let below = fs::read_dir(group).into_iter().flatten().flatten();
            let below = below.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()));
            groups.extend(below.map(|entry| entry.path()).collect::<Vec<_>>());
            next += 1;
        }
        // Groups of other programs on this machine come and go, also those of graders that others run.
        groups.retain(|group| {
            let name = group.to_string_lossy();
            let owner = name.rsplit_once("-run-").map(|(_, owner)| format!("/proc/{owner}/exe"));
            let program = owner.and_then(|link| fs::read_link(link).ok());
            name.contains("spring-oracle") && program.is_none_or(|program| is_of_tests(&program))
        });
        groups.sort();
        let places =
            ["/tmp", "/var/tmp", "/dev/shm", "/dev/mqueue", "/", "/usr", "/etc", "/root", "/home"];
        let files = places.iter().flat_map(|place| {
            let entries = fs::read_dir(place).into_iter().flatten().flatten();
            entries.map(|entry| entry.path()).filter(|path| {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                ["escaped", "moved", "sem.escaped", "hostile"]
                    .iter()
                    .any(|start| name.starts_with(start))
            })
        });
        Self {
            mounts: lines("/proc/self/mountinfo"),
            groups,
            objects: objects.collect(),
            files: files.collect(),
        }
    }
}

/// Whether the grader at this path may be one of these tests.
fn is_of_tests(program: &Path) -> bool {
    let temporary = std::env::temp_dir();
    let folder = program.strip_prefix(temporary).ok().and_then(|path| path.iter().next());
    program == Path::new(GRADE)
        || folder.is_some_and(|name| name.as_encoded_bytes().starts_with(b".tmp"))
}

fn processes() -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir("/proc").unwrap().flatten();
    entries
        .filter(|entry| entry.file_name().as_encoded_bytes()[0].is_ascii_digit())
        .map(|entry| entry.path())
}

/// The child processes of a process.
pub(crate) fn below(process: u32) -> Vec<u32> {
    let threads = fs::read_dir(format!("/proc/{process}/task")).unwrap().flatten();
    let lists = threads.map(|thread| fs::read_to_string(thread.path().join("children")));
    let lists: Vec<String> = lists.map(io::Result::unwrap_or_default).collect();
    lists.iter().flat_map(|list| list.split_ascii_whitespace()).flat_map(str::parse).collect()
}

/// Number of child processes that have not been waited for.
pub(crate) fn children() -> usize {
    let threads = fs::read_dir("/proc/self/task").unwrap().flatten();
    let lists = threads.map(|thread| fs::read_to_string(thread.path().join("children")));
    lists.map(|list| list.unwrap_or_default().split_ascii_whitespace().count()).sum()
}

/// A mount point of the machine that no sandbox contains.
fn foreign_mount() -> String {
    let usual = [
        "/", "/proc", "/dev", "/dev/shm", "/tmp", "/usr", "/etc", "/bin", "/lib", "/lib64",
        "/sbin", "/work",
    ];
    let table = fs::read_to_string("/proc/self/mountinfo").unwrap_or_default();
    let points = table.lines().filter_map(|line| line.split(' ').nth(4));
    let mut foreign = points.filter(|point| !usual.contains(point) && !point.contains('\\'));
    foreign.next().unwrap_or("/no-mount-of-the-machine").to_owned()
}

fn find_privileged(folder: &Path) -> Option<PathBuf> {
    let mut folders = vec![folder.to_path_buf()];
    for _ in 0..100 {
        let folder = folders.pop()?;
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let Ok(metadata) = entry.metadata() else { continue };
            if metadata.is_dir() {
                folders.push(entry.path());
            } else if metadata.mode() & 0o6000 != 0 && entry.file_name() != "privileged" {
                return Some(entry.path());
            }
        }
    }
    None
}

fn open_to_all(folder: &Path) {
    fs::set_permissions(folder, fs::Permissions::from_mode(0o755)).unwrap();
}

/// Makes the setting's user the owner of a folder and its content.
fn give(setting: Setting, folder: &Path) {
    let Some(user) = setting.user() else { return };
    let mut paths = vec![folder.to_path_buf()];
    while let Some(path) = paths.pop() {
        lchown(&path, Some(user), Some(user)).unwrap();
        if fs::symlink_metadata(&path).unwrap().is_dir() {
            paths.extend(fs::read_dir(&path).unwrap().flatten().map(|entry| entry.path()));
        }
    }
}

fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap().flatten() {
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy_folder(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}

fn hash_of(content: &[u8]) -> u64 {
    use std::hash::{DefaultHasher, Hasher};
    let mut hasher = DefaultHasher::new();
    hasher.write(content);
    hasher.finish()
}
