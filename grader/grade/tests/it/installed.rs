//! The program alone, far from its source: it brings its scenes and its oracle, and keeps them from submissions.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use needs::needs;
use tempfile::TempDir;

const NOTE: &str = "note: scenes and oracle are those of this program, in ";

/// A home with the program in `bin/` and nothing else, and a skeleton in `mine/`.
struct Home(TempDir);

impl Home {
    fn new() -> Self {
        let home = Self(tempfile::tempdir().unwrap());
        fs::create_dir(home.path("bin")).unwrap();
        fs::copy(env!("CARGO_BIN_EXE_grade"), home.path("bin/grade")).unwrap();
        assert!(home.grade(&["init", "python", "mine"]).status.success());
        home
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(self.path("bin/grade"));
        command.args(arguments).current_dir(self.0.path());
        command.env("HOME", self.0.path()).env_remove("XDG_CACHE_HOME");
        command
    }

    fn grade(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }
}

/// Grades the skeleton on a simple group; the folder of the scenes, as the only note says.
fn graded(command: &mut Command) -> PathBuf {
    let run = command.args(["mine", "--only", "Inertia", "--no-jacobians"]).output().unwrap();
    let said = String::from_utf8(run.stderr).unwrap();
    assert_eq!(run.status.code(), Some(0), "{said}");
    let folders: Vec<&str> = said.lines().filter_map(|line| line.strip_prefix(NOTE)).collect();
    assert_eq!(folders.len(), 1, "{said}");
    PathBuf::from(folders[0])
}

#[needs("test -x /usr/bin/python3")]
#[test]
fn program_alone_in_an_empty_folder_gives_a_verdict() {
    let home = Home::new();
    let folder = graded(&mut home.command(&[]));
    assert!(folder.starts_with(home.path(".cache/spring-oracle")), "{}", folder.display());
    let run = home.grade(&["assignments", "t1m3"]);
    assert!(run.status.success(), "{run:?}");

    // Editing the extracted oracle changes no verdict.
    let trace = folder.join("expected/Inertia/lone-drifter-explicit.csv");
    let text = fs::read(&trace).unwrap();
    fs::write(&trace, "step,time\n").unwrap();
    assert_eq!(graded(&mut home.command(&[])), folder);
    assert_eq!(fs::read(&trace).unwrap(), text);
    let run = home.grade(&["oracle", "regenerate"]);
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("does not change"), "{run:?}");

    // Without a cache folder, below that of temporary files; a relative one does not count.
    let temporary = home.path("temporary");
    fs::create_dir(&temporary).unwrap();
    let mut command = home.command(&[]);
    command.env_remove("HOME").env("XDG_CACHE_HOME", "here").env("TMPDIR", &temporary);
    assert!(graded(&mut command).starts_with(&temporary));

    // Scenes that are there count instead.
    fs::create_dir_all(home.path("assets/Inertia")).unwrap();
    let run = home.grade(&["mine"]);
    assert!(!String::from_utf8_lossy(&run.stderr).contains(NOTE), "{run:?}");
}

/// A submission that prints how much of a file it can read, and fails.
fn spying(home: &Home, file: &Path) -> String {
    let spy = home.path("spy");
    fs::create_dir_all(&spy).unwrap();
    let run = r#"run = ["/usr/bin/python3", "{folder}/spy.py", "{scene}", "{trace}"]"#;
    fs::write(spy.join("submission.toml"), run).unwrap();
    let text = format!("import sys\nsys.exit(str(len(open({file:?}, 'rb').read())) + ' bytes')\n");
    fs::write(spy.join("spy.py"), text).unwrap();
    let bin = home.path("bin");
    let run = home.grade(&["spy", "--only", "Inertia", "--readable", bin.to_str().unwrap()]);
    String::from_utf8(run.stdout).unwrap()
}

#[needs("test -x /usr/bin/python3 && unshare --user --mount true")]
#[test]
fn programs_cannot_read_the_oracle_in_the_program() {
    let home = Home::new();
    // The folder of the program is named as readable, as ~/.cargo/bin may be.
    fs::write(home.path("bin/other"), "1234").unwrap();
    set_mode(home.0.path(), 0o755);
    let said = spying(&home, &home.path("bin/other"));
    assert!(said.contains("4 bytes"), "{said}");
    let said = spying(&home, &home.path("bin/grade"));
    assert!(said.contains("Permission denied"), "{said}");
    let folder = graded(&mut home.command(&[]));
    let said = spying(&home, &folder.join("expected/Inertia/lone-drifter-explicit.csv"));
    assert!(said.contains("No such file"), "{said}");
}

fn set_mode(folder: &Path, mode: u32) {
    fs::set_permissions(folder, fs::Permissions::from_mode(mode)).unwrap();
}

#[needs("test $(id -u) = 0 && test -x /usr/bin/python3")]
#[test]
fn closed_readable_folder_is_refused_before_anything_runs() {
    let home = Home::new();
    let tools = tempfile::tempdir().unwrap();
    set_mode(tools.path(), 0o700);
    let named = tools.path().to_str().unwrap();
    let run = home.grade(&["mine", "--only", "Inertia", "--readable", named]);
    assert_eq!((run.status.code(), &*run.stdout), (Some(2), &b""[..]), "{run:?}");
    let said = String::from_utf8(run.stderr).unwrap();
    assert!(
        said.contains(&format!("--readable {named}: programs run as a user of their own")),
        "{said}"
    );
    assert!(said.contains(&format!("`chmod o+rX {named}`")), "{said}");
    set_mode(tools.path(), 0o755);
    graded(home.command(&[]).args(["--readable", named]));
}
