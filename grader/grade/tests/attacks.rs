//! Attack tests: each hostile submission gets its expected verdict, and changes and leaves nothing behind.
//!
//! `attacks/table.rs` lists the attacks, `attacks/hostile/` is the program that makes them, and
//! `attacks/setting.rs` lists the settings in which each attack runs. `docs/attacks.md` is written from the table
//! (`UPDATE_DOCS=1`).
//!
//! Each run draws some attacks anew. The long tests make each attack in each setting; `ATTACKS=text` restricts them to
//! attacks whose description or mode contains this text.

#![cfg(target_os = "linux")]

#[path = "attacks/gauge.rs"]
mod gauge;
#[path = "attacks/setting.rs"]
mod setting;
#[path = "attacks/stage.rs"]
mod stage;
#[path = "attacks/table.rs"]
mod table;

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::panic::AssertUnwindSafe;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use needs::needs;
use test_support::{assert_document, sample, seed};

use sandbox::{End, Job, Keep, Limits, Sandbox};

use gauge::Gauge;
use setting::Setting;
use stage::{Machine, Programs, SharedStage};
use table::{ATTACKS, Attack, Target};

const GRADE: &str = env!("CARGO_BIN_EXE_grade");

/// Number of concurrent attacks. Most of them wait for a time limit.
const AT_A_TIME: usize = 6;

/// Runs one test at a time: attacks on the processor would delay the others.
static SERIAL: Mutex<()> = Mutex::new(());

/// Settings of an ordinary user, which every user can create.
const ORDINARY: [Setting; 3] =
    [Setting::User, Setting::UserWithoutNamespaces, Setting::UserWithoutLandlock];

/// Settings that only the superuser can create.
const SUPERUSER: [Setting; 4] =
    [Setting::Root, Setting::Container, Setting::RootWithoutLandlock, Setting::RootlessContainer];

/// The setting of the tests that need only one.
fn main_setting() -> Setting {
    Setting::User
}

/// Runs an attack and returns the violated expectations.
fn attack(shared_stage: &SharedStage, attack: &Attack) -> Vec<String> {
    let stage = shared_stage.stage();
    let expected = attack.expected_in(shared_stage.setting);
    let mut limits = attack.limits.to_vec();
    if expected == ["timed-out"] && limits.is_empty() {
        limits = vec!["cpu=1", "wall=2"];
    }
    let mut complaints = Vec::new();
    if !attack.earlier.is_empty() {
        let submission = stage.submission(attack.earlier, "", attack.target);
        let files = stage.files();
        stage.graded(&submission, &limits);
        complaints.extend(stage.complaints(&files));
    }
    let submission = stage.submission(attack.mode, attack.build, attack.target);
    let files = stage.files();
    let gauge = attack.is_measured.then(|| Gauge::start(stage.path("")));
    let graded = stage.graded(&submission, &limits);
    complaints.extend(gauge.and_then(Gauge::breach));
    if !expected.contains(&graded.verdict.as_str()) {
        let mut detail: Vec<&str> =
            graded.report.lines().filter(|line| tells(line)).take(3).collect();
        if detail.is_empty() {
            detail = graded.report.lines().take(5).collect();
        }
        complaints.push(format!("{}, not {expected:?}: {}", graded.verdict, detail.join(" ")));
    }
    if let Some(path) = graded.privileged_file {
        complaints.push(format!("{} had a set-user-ID bit", path.display()));
    }
    complaints.extend(stage.complaints(&files));
    complaints
}

/// Whether a line of a report describes the result of the attack.
fn tells(line: &str) -> bool {
    ["BREACH", "\"message\"", "error"].iter().any(|word| line.contains(word))
}

#[test]
fn sampled_attacks_of_an_ordinary_user_are_refused() {
    assert_refused(&ORDINARY, &sample(ATTACKS, 4));
}

#[needs("test $(id -u) = 0")]
#[test]
fn sampled_attacks_of_the_superuser_are_refused() {
    assert_refused(&SUPERUSER, &sample(ATTACKS, 4));
}

#[test]
#[ignore = "long: minutes"]
fn long_every_attack_of_an_ordinary_user_is_refused() {
    ORDINARY.iter().for_each(|setting| assert_refused(&[*setting], &wanted()));
}

#[needs("test $(id -u) = 0")]
#[test]
#[ignore = "long: minutes"]
fn long_every_attack_of_the_superuser_is_refused() {
    SUPERUSER.iter().for_each(|setting| assert_refused(&[*setting], &wanted()));
}

/// The attacks whose description or mode contains the text of the variable `ATTACKS`.
fn wanted() -> Vec<&'static Attack> {
    let text = std::env::var("ATTACKS").unwrap_or_default();
    let is_wanted = |attack: &&Attack| attack.what.contains(&text) || attack.mode.contains(&text);
    ATTACKS.iter().filter(is_wanted).collect()
}

/// Makes attack number n in setting number n, beginning again after the last setting.
fn assert_refused(settings: &[Setting], attacks: &[&Attack]) {
    let _one = SERIAL.lock().unwrap_or_else(PoisonError::into_inner);
    let programs = Programs::get();
    let machine = Machine::look();
    let mut shared_stages: Vec<SharedStage> =
        settings.iter().map(|setting| SharedStage::new(programs, *setting)).collect();
    let good = |shared_stage: &SharedStage| {
        let stage = shared_stage.stage();
        let graded = stage.graded(&stage.submission("hand_in", "", Target::Nothing), &[]);
        // The report contains the name of the stage, and a hash of files that do.
        let report = graded.report.replace(&stage.path("").display().to_string(), "");
        let is_hash = |line: &&str| line.trim_start().starts_with("\"files\":");
        report.lines().filter(|line| !is_hash(line)).collect::<Vec<&str>>().join("\n")
    };
    let before: Vec<String> = shared_stages.iter().map(good).collect();
    let tries: Vec<(usize, &Attack)> = attacks
        .iter()
        .enumerate()
        .map(|(number, attack)| (number % settings.len(), *attack))
        .collect();
    let (next, failures) = (AtomicUsize::new(0), Mutex::new(BTreeSet::new()));
    let try_one = |(shared_stage, row): &(usize, &Attack)| {
        let shared_stage = &shared_stages[*shared_stage];
        let complaints = std::panic::catch_unwind(AssertUnwindSafe(|| attack(shared_stage, row)))
            .unwrap_or_else(|_| vec!["the test itself failed".to_owned()]);
        if !complaints.is_empty() {
            let failure = format!(
                "{}: {} ({}): {}",
                shared_stage.setting.name(),
                row.what,
                row.mode,
                complaints.join("; ")
            );
            failures.lock().unwrap().insert(failure);
        }
    };
    let (alone, together): (Vec<_>, Vec<_>) =
        tries.iter().partition(|(_, attack)| attack.is_measured);
    std::thread::scope(|scope| {
        for _ in 0..AT_A_TIME {
            scope.spawn(|| {
                while let Some(one) = together.get(next.fetch_add(1, Ordering::Relaxed)) {
                    try_one(one);
                }
            });
        }
    });
    alone.iter().for_each(try_one);
    let mut failures = failures.into_inner().unwrap();
    for (shared_stage, before) in shared_stages.iter_mut().zip(&before) {
        let name = shared_stage.setting.name();
        if good(shared_stage) != *before {
            failures.insert(format!("{name}: a right trace is graded otherwise than before"));
        }
        failures
            .extend(shared_stage.complaints().into_iter().map(|text| format!("{name}: {text}")));
    }
    drop(shared_stages);
    let after = Machine::look();
    if after != machine {
        failures.insert(format!("the machine is not as before: {machine:?}, now {after:?}"));
    }
    let count = failures.len();
    let failures: Vec<String> = failures.into_iter().collect();
    assert!(count == 0, "{count} of {} failed:\n{}", tries.len(), failures.join("\n"));
}

#[test]
fn table_has_enough_attacks() {
    assert!(ATTACKS.len() >= 120, "{}", ATTACKS.len());
    let described: BTreeSet<&str> = ATTACKS.iter().map(|attack| attack.what).collect();
    assert_eq!(described.len(), ATTACKS.len(), "two rows say the same");
}

#[test]
fn attacks_page_matches_the_table() {
    let mut table = String::from("| attack | verdict | elsewhere |\n| --- | --- | --- |\n");
    for attack in ATTACKS {
        let differs = attack
            .differs
            .iter()
            .map(|(setting, verdicts)| format!("{}: {}", setting.name(), verdicts.join(" or ")));
        let differs = differs.collect::<Vec<_>>().join("; ");
        writeln!(table, "| {} | {} | {differs} |", attack.what, attack.expected.join(" or "))
            .unwrap();
    }
    let document = format!(
        "# Attacks\n\nWritten from the table of `cargo test -p grade --test attacks -- --include-ignored`, which makes \
         each attack in\nseven settings: an ordinary user, the superuser, an ordinary user without user namespaces, the superuser \
         in a container,\neither of the first two without Landlock, and the root of a rootless container with two user IDs. \
         Only the superuser\noutside of containers has a control group here. Each attack is a submission, and gets the \
         verdict that stands\nhere. Attacks on memory and disk that no process shows run alone, and get through if the \
         machine shows more use than\nthe limits allow. Afterwards every file of the suite and of all submissions is as before, with \
         its mode, owner, times\nand names; and no process, mount, control group, shared object or scratch folder \
         is left. An attack that\nis refused hands in a right trace, and passes. `breach` means that the attack \
         gets through.\n\n{table}"
    );
    assert_document("attacks.md", &document, "cargo test --release -p grade --test attacks");
}

#[test]
fn results_of_an_ordinary_user_do_not_depend_on_umask() {
    assert_independent_of_umask(&ORDINARY);
}

#[needs("test $(id -u) = 0")]
#[test]
fn results_of_the_superuser_do_not_depend_on_umask() {
    assert_independent_of_umask(&SUPERUSER);
}

/// The umask is inherited from the parent of the grader; it must not open scratch folders.
fn assert_independent_of_umask(settings: &[Setting]) {
    let _one = SERIAL.lock().unwrap_or_else(PoisonError::into_inner);
    let programs = Programs::get();
    let mut failures = Vec::new();
    for &setting in settings {
        let shared_stage = SharedStage::new(programs, setting);
        let mut protections = Vec::new();
        for mask in ["022", "0", "027", "077"] {
            let stage = shared_stage.stage();
            let submission = stage.submission("inherited_state", "", Target::Nothing);
            let output = stage.grade_with_mask(mask, &submission, &[]).output().unwrap();
            let report = fs::read(stage.path("reports/report.json")).unwrap_or_default();
            let report: serde_json::Value = serde_json::from_slice(&report).unwrap_or_default();
            protections.push(report["protection"].to_string());
            if output.status.code() != Some(0)
                || protections[0] != protections[protections.len() - 1]
            {
                let printed = String::from_utf8_lossy(&output.stderr).into_owned();
                let protection = &report["protection"];
                failures.push(format!("{}, mask {mask}: {protection} {printed}", setting.name()));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn killed_grader_leaves_no_process_mount_or_partial_file() {
    kill_graders(16);
}

#[test]
#[ignore = "long: a minute"]
fn long_killed_grader_leaves_no_process_mount_or_partial_file() {
    kill_graders(600);
}

/// Kills the grader at random moments of a run, so often in each setting. Each time, no process and no mount remains, no
/// file is partially written, and the next run is correct.
fn kill_graders(count: usize) {
    let _one = SERIAL.lock().unwrap_or_else(PoisonError::into_inner);
    let programs = Programs::get();
    for setting in [main_setting(), Setting::UserWithoutNamespaces] {
        let shared_stage = SharedStage::new(programs, setting);
        let stages = [shared_stage.stage(), shared_stage.stage()];
        let good = stages[0].submission("hand_in", "", Target::Nothing);
        let slow = stages[1].submission("stubborn_daemons", "", Target::Nothing);
        let expected = stages[0].graded(&good, &[]).report;
        let machine = Machine::look();
        let files = stages.each_ref().map(|stage| stage.files());
        let mut rng = fastrand::Rng::with_seed(seed());
        for moment in 0..count {
            let (stage, submission) =
                if moment % 2 == 0 { (&stages[0], &good) } else { (&stages[1], &slow) };
            let mut grader = stage.grade(submission, &[]).stderr(Stdio::null()).spawn().unwrap();
            std::thread::sleep(Duration::from_micros(rng.u64(0..40_000)));
            grader.kill().unwrap();
            grader.wait().unwrap();
            // The next grader removes scratch folders.
            let scratch = stage.path("scratch");
            let left: Vec<_> =
                stage.left().into_iter().filter(|left| !left.starts_with(&scratch)).collect();
            assert!(left.is_empty(), "{}, moment {moment}: {left:?}", setting.name());
            let report = fs::read_to_string(stage.path("reports/report.json")).unwrap_or_default();
            let whole: Result<serde_json::Value, _> = serde_json::from_str(&report);
            assert!(report.is_empty() || whole.is_ok(), "moment {moment}: {report}");
        }
        for (stage, submission) in stages.iter().zip([&good, &slow]) {
            let after = stage.graded(submission, &[]);
            assert_eq!(after.verdict, "pass", "{}", after.report);
        }
        assert_eq!(stages[0].graded(&good, &[]).report, expected);
        for (stage, files) in stages.iter().zip(&files) {
            assert_eq!(stage.complaints(files), Vec::<String>::new(), "{}", setting.name());
        }
        assert_eq!(Machine::look(), machine, "{}", setting.name());
    }
}

/// A supervisor is killed while programs run that ignore every signal, without namespaces and without a control group. Each
/// time, no process remains.
#[test]
fn killed_supervisor_leaves_no_process() {
    let _one = SERIAL.lock().unwrap_or_else(PoisonError::into_inner);
    let programs = Programs::get();
    for setting in [main_setting(), Setting::UserWithoutNamespaces] {
        let shared_stage = SharedStage::new(programs, setting);
        let stage = shared_stage.stage();
        let slow = stage.submission("lasting_daemons", "", Target::Nothing);
        let mut rng = fastrand::Rng::with_seed(seed());
        for moment in 0..6 {
            let mut grader = stage.grade(&slow, &[]).stderr(Stdio::null()).spawn().unwrap();
            while stage.running().len() < 3 {
                assert!(matches!(grader.try_wait(), Ok(None)), "moment {moment}");
                std::thread::sleep(Duration::from_millis(2));
            }
            std::thread::sleep(Duration::from_micros(rng.u64(0..20_000)));
            let starter = stage::below(grader.id())[0];
            let supervisor = stage::below(starter)[0];
            // Before the grader, which would run the program again.
            kill(supervisor);
            grader.kill().unwrap();
            grader.wait().unwrap();
            let left = stage.remaining();
            assert!(left.is_empty(), "{}, moment {moment}: {left:?}", setting.name());
        }
    }
}

#[test]
fn time_of_short_lived_children_of_an_ordinary_user_is_limited() {
    assert_time_is_limited(main_setting());
}

#[needs("test $(id -u) = 0")]
#[test]
fn time_of_short_lived_children_of_the_superuser_is_limited() {
    assert_time_is_limited(Setting::Root);
}

/// Children that live for 4 ms and are not waited for show no processor time. A control group counts it; elsewhere the
/// limit of elapsed time ends them.
fn assert_time_is_limited(setting: Setting) {
    let _one = SERIAL.lock().unwrap_or_else(PoisonError::into_inner);
    let shared_stage = SharedStage::new(Programs::get(), setting);
    let stage = shared_stage.stage();
    let spins = stage.submission("spin_in_shorter_children", "", Target::Nothing);
    let grade = |wall| {
        let graded = stage.graded(&spins, &["cpu=1", wall]);
        let report: serde_json::Value = serde_json::from_str(&graded.report).unwrap();
        (report["protection"].to_string().contains("memory"), graded)
    };
    let (is_counted, mut graded) = grade("wall=3");
    if is_counted && graded.report.contains("after 3 s") {
        // On a busy machine, a second of processor time takes longer.
        (_, graded) = grade("wall=60");
    }
    let limit = if is_counted { "1 s of processor time" } else { "after 3 s" };
    assert!(graded.report.contains(limit), "{}: {}", setting.name(), graded.report);
}

/// Runs that share a user ID kill neither each other nor a process of the machine with the same ID.
#[needs("test $(id -u) = 0")]
#[test]
fn runs_sharing_a_user_id_do_not_kill_each_other() {
    let _one = SERIAL.lock().unwrap_or_else(PoisonError::into_inner);
    let programs = Programs::get();
    let setting = Setting::RootlessContainer;
    let shared_stage = SharedStage::new(programs, setting);
    let user = setting.user().unwrap() + 1;
    let mut bystander = Command::new(programs.launcher());
    bystander.args(["--user", &user.to_string(), "--", "sleep", "600"]);
    let mut bystander = bystander.spawn().unwrap();
    let failures = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for number in 0..AT_A_TIME {
            // A run that leaves processes behind kills them.
            let mode = if number % 2 == 0 { "honest_pause" } else { "stubborn_daemons" };
            let (shared_stage, failures) = (&shared_stage, &failures);
            scope.spawn(move || {
                let stage = shared_stage.stage();
                let submission = stage.submission(mode, "", Target::Nothing);
                for _ in 0..2 {
                    let graded = stage.graded(&submission, &[]);
                    if graded.verdict != "pass" {
                        failures.lock().unwrap().push(graded.report);
                    }
                }
            });
        }
    });
    let lives = matches!(bystander.try_wait(), Ok(None));
    let _ = bystander.kill();
    let _ = bystander.wait();
    assert!(lives, "the bystander was killed");
    let failures = failures.into_inner().unwrap();
    assert!(failures.is_empty(), "{} of {}: {}", failures.len(), 2 * AT_A_TIME, failures[0]);
}

fn kill(process: u32) {
    let process = rustix::process::Pid::from_raw(process.cast_signed()).unwrap();
    rustix::process::kill_process(process, rustix::process::Signal::KILL).unwrap();
}

/// A submission is killed from outside at random moments of its run: its verdict is a crash, the report is complete,
/// and another submission gets the same verdict as before.
#[test]
fn killed_submission_is_reported_as_crashed() {
    let _one = SERIAL.lock().unwrap_or_else(PoisonError::into_inner);
    let programs = Programs::get();
    let shared_stage = SharedStage::new(programs, main_setting());
    let stages = [shared_stage.stage(), shared_stage.stage()];
    let good = stages[0].submission("hand_in", "", Target::Nothing);
    let slow = stages[1].submission("sleep_long", "", Target::Nothing);
    let expected = stages[0].graded(&good, &[]).report;
    let mut rng = fastrand::Rng::with_seed(seed());
    for moment in 0..8 {
        let pause = Duration::from_micros(rng.u64(0..20_000));
        let done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                while !done.load(Ordering::Relaxed) {
                    std::thread::sleep(pause);
                    for process in stages[1].running() {
                        // The process may have ended meanwhile.
                        let _ = Command::new("kill").arg("-9").arg(process).output();
                    }
                }
            });
            let graded =
                std::panic::catch_unwind(AssertUnwindSafe(|| stages[1].graded(&slow, &[])));
            done.store(true, Ordering::Relaxed);
            let graded = graded.unwrap();
            assert_eq!(graded.verdict, "crashed", "moment {moment}: {}", graded.report);
        });
    }
    assert_eq!(stages[0].graded(&good, &[]).report, expected);
}

#[test]
fn repeated_runs_leave_no_process_or_file() {
    run_nothing(50);
}

#[test]
#[ignore = "long: a quarter of a minute"]
fn long_repeated_runs_leave_no_process_or_file() {
    run_nothing(1_000);
}

/// Runs of a program that does nothing.
fn run_nothing(count: usize) {
    let _one = SERIAL.lock().unwrap_or_else(PoisonError::into_inner);
    let nothing = Path::new("/bin/true");
    let folder = tempfile::tempdir().unwrap();
    let scratch = folder.path().join("scratch");
    fs::create_dir(&scratch).unwrap();
    let job = Job {
        program: nothing.into(),
        arguments: Vec::new(),
        folder: scratch,
        input: None,
        keep: Keep::File("nothing".to_owned(), folder.path().join("nothing")),
        readable: Vec::new(),
        limits: Limits::default(),
    };
    let sandbox = Sandbox::open(Path::new(GRADE)).unwrap();
    // The number of the process that makes a scratch folder is in its name.
    let own = format!("spring-oracle-{}-", std::process::id());
    let folders = || {
        let entries = fs::read_dir(std::env::temp_dir()).unwrap().flatten();
        entries.filter(|entry| entry.file_name().to_string_lossy().starts_with(&own)).count()
    };
    let descriptors = || fs::read_dir("/proc/self/fd").unwrap().count();
    let before = (Machine::look(), stage::children(), folders(), descriptors());
    for number in 0..count {
        let outcome = sandbox.run(&job).unwrap();
        assert_eq!(outcome.end, End::Exited(0), "run {number}");
    }
    assert_eq!((Machine::look(), stage::children(), folders(), descriptors()), before);
}
