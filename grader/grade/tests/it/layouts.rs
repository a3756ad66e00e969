//! Hand-ins and class folders as they come: each is made, graded, and lands where it should. None is silently zero.

use std::fs;
use std::os::unix::fs::symlink;

use platforms::archive;
use platforms::package::PackageFile;

use crate::class::{Project, RIGHT};
use crate::folder::Run;

/// A hand-in of two files, by the name of the manifest.
const TOML: &str = "run = [\"/bin/sh\", \"{folder}/sim.sh\", \"{scene}\", \"-o\", \"{trace}\"]\n";

/// Writes no trace.
const SILENT: &str = "exit 0\n";

/// Archives in the place of a text: of the two files, of a folder with them, of a Mac, in another archive, and a broken one.
const ZIP: &str = "zip";
const ZIP_OF_FOLDER: &str = "zip of a folder";
const ZIP_OF_MAC: &str = "zip of a Mac";
const ZIP_IN_ZIP: &str = "zip in a zip";
const ZIP_BROKEN: &str = "zip cut off";

/// The bytes of a file: an archive in the place of its name.
fn bytes(text: &str) -> Vec<u8> {
    let of = |folder: &str, more: &[(&str, &[u8])]| {
        let own = [("submission.toml", TOML.as_bytes()), ("sim.sh", RIGHT.as_bytes())];
        let own = own.map(|(name, bytes)| PackageFile::data(format!("{folder}{name}"), bytes));
        let more = more.iter().map(|(name, bytes)| PackageFile::data(*name, *bytes));
        zipped(own.into_iter().chain(more).collect())
    };
    match text {
        ZIP => of("", &[]),
        ZIP_OF_FOLDER => of("my project/", &[]),
        ZIP_OF_MAC => of(
            "hw/",
            &[
                ("__MACOSX/hw/._submission.toml", b"\0"),
                ("__MACOSX/._hw", b"\0"),
                ("hw/.DS_Store", b"\0"),
            ],
        ),
        ZIP_IN_ZIP => zipped(vec![PackageFile::data("hw.zip", of("hw/", &[]))]),
        ZIP_BROKEN => of("", &[])[..300].to_vec(),
        text => text.as_bytes().to_vec(),
    }
}

pub(crate) fn zipped(files: Vec<PackageFile>) -> Vec<u8> {
    let mut bytes = Vec::new();
    archive::write(&mut bytes, &files).unwrap();
    bytes
}

/// Where a layout lands.
enum Lands {
    /// In a row of this name, with this verdict.
    Row(&'static str, &'static str),
    /// In a row with this verdict, and in the list at the end, with this reason.
    Listed(&'static str, &'static str, &'static str),
    /// In the list at the end alone, with this reason.
    Skipped(&'static str, &'static str),
    /// Nowhere: it is no hand-in.
    Nowhere,
}

use Lands::{Listed, Nowhere, Row, Skipped};

/// A layout: where it comes from, its files below the class, and where it lands.
type Layout = (&'static str, &'static [(&'static str, &'static str)], Lands);

const FLAT: &[Layout] = &[
    ("a program, collected by hand", &[("ada!", RIGHT)], Row("ada", "passed")),
    (
        "a folder of `grade init`",
        &[("bob/submission.toml", TOML), ("bob/sim.sh", RIGHT)],
        Row("bob", "passed"),
    ),
    (
        "the same with what a Mac, git, an editor and a build leave behind",
        &[
            ("cleo/submission.toml", TOML),
            ("cleo/sim.sh", RIGHT),
            ("cleo/.DS_Store", ""),
            ("cleo/.git/HEAD", ""),
            ("cleo/.vscode/settings.json", "{}"),
            ("cleo/build/CMakeCache.txt", ""),
        ],
        Row("cleo", "passed"),
    ),
    (
        "a name with spaces and accents",
        &[("José Ñandú/submission.toml", TOML), ("José Ñandú/sim.sh", RIGHT)],
        Row("José Ñandú", "passed"),
    ),
    (
        "a manifest of a Windows editor",
        &[
            (
                "dan/submission.toml",
                "run = [\"/bin/sh\", \"{folder}/sim.sh\", \"{scene}\", \"-o\", \"{trace}\"]\r\n",
            ),
            ("dan/sim.sh", RIGHT),
        ],
        Row("dan", "passed"),
    ),
    (
        "sources without a manifest",
        &[("dot/main.cpp", "int main() {}")],
        Listed("dot", "bad-hand-in", "there is no submission.toml"),
    ),
    (
        "an empty folder",
        &[("eva/", "")],
        Listed("eva", "bad-hand-in", "there is no submission.toml"),
    ),
    (
        "a manifest that is no TOML",
        &[("fay/submission.toml", "run = ./sim.sh\n")],
        Listed("fay", "bad-hand-in", "submission.toml:1"),
    ),
    (
        "a build that fails",
        &[(
            "gus/submission.toml",
            "build = [\"/bin/false\"]\nrun = [\"./a\", \"{scene}\", \"{trace}\"]\n",
        )],
        Row("gus", "build-failed"),
    ),
    (
        "a program that writes nothing",
        &[("hal/submission.toml", TOML), ("hal/sim.sh", SILENT)],
        Row("hal", "no-output"),
    ),
    (
        "a script whose mode was lost in a download",
        &[("ivy.sh", RIGHT)],
        Skipped("ivy.sh", "not executable"),
    ),
    (
        "a note of the teacher",
        &[("notes.txt", "Ada: late")],
        Skipped("notes.txt", "neither a program nor an archive"),
    ),
    (
        "a Mac's folder beside an unpacked zip",
        &[("__MACOSX/._bob", ""), ("__MACOSX/bob/._sim.sh", "")],
        Nowhere,
    ),
    ("a Mac's files on a foreign disk", &[(".DS_Store", ""), ("._bob", "")], Nowhere),
    ("Windows' files", &[("Thumbs.db", ""), ("desktop.ini", "")], Nowhere),
    (
        "a folder of hand-ins under version control",
        &[(".git/HEAD", ""), (".gitignore", "")],
        Nowhere,
    ),
];

const CANVAS: &[Layout] = &[
    (
        "Canvas: two files of a student",
        &[("lovelaceada_12_345_submission.toml", TOML), ("lovelaceada_12_346_sim.sh", RIGHT)],
        Row("lovelaceada_12", "passed"),
    ),
    (
        "Canvas: late",
        &[
            ("babbagecharles_LATE_13_350_submission.toml", TOML),
            ("babbagecharles_LATE_13_351_sim.sh", RIGHT),
        ],
        Row("babbagecharles_13", "passed"),
    ),
    (
        "Canvas: names of a second and a third attempt",
        &[("curiemarie_14_360_submission-1.toml", TOML), ("curiemarie_14_361_sim-2.sh", RIGHT)],
        Row("curiemarie_14", "passed"),
    ),
    (
        "Canvas: the same file twice, of which the newer counts",
        &[
            ("diracpaul_15_371_sim-1.sh", RIGHT),
            ("diracpaul_15_370_sim.sh", SILENT),
            ("diracpaul_15_369_submission.toml", TOML),
        ],
        Row("diracpaul_15", "passed"),
    ),
    (
        "Canvas: names with underscores of the student's",
        &[
            (
                "eulerleo_16_380_submission.toml",
                "run = [\"/bin/sh\", \"{folder}/my_9_8_sim.sh\", \"{scene}\", \"-o\", \"{trace}\"]\n",
            ),
            ("eulerleo_16_381_my_9_8_sim.sh", RIGHT),
        ],
        Row("eulerleo_16", "passed"),
    ),
    (
        "Canvas: a name with a hyphen",
        &[("smith-jonesann_17_390_submission.toml", TOML), ("smith-jonesann_17_391_sim.sh", RIGHT)],
        Row("smith-jonesann_17", "passed"),
    ),
    (
        "Canvas: anonymous grading",
        &[("anon_x7Y2q_400_submission.toml", TOML), ("anon_x7Y2q_401_sim.sh", RIGHT)],
        Row("anon_x7Y2q", "passed"),
    ),
    (
        "Canvas: two students of one name",
        &[("lovelaceada_18_410_submission.toml", TOML), ("lovelaceada_18_411_sim.sh", SILENT)],
        Row("lovelaceada_18", "no-output"),
    ),
    (
        "Canvas: a zip",
        &[("noetheremmy_21_420_hw-1.zip", ZIP_OF_MAC)],
        Row("noetheremmy_21", "passed"),
    ),
    (
        "Canvas: text that was typed in",
        &[("fermipaul_19_text.html", "<p>see my repository</p>")],
        Listed("fermipaul_19", "bad-hand-in", "there is no submission.toml"),
    ),
    (
        "Canvas: a link",
        &[("gausscarl_LATE_20_link.html", "<a>")],
        Listed("gausscarl_20", "bad-hand-in", "there is no submission.toml"),
    ),
    ("Canvas: a Mac's leavings in it", &[("._lovelaceada_12_345_submission.toml", "")], Nowhere),
    (
        "Canvas: another file in the folder",
        &[("grades.csv", "a")],
        Skipped("grades.csv", "not one of Canvas"),
    ),
];

const NESTED: &[Layout] = &[
    ("a zip of the files", &[("ada.zip", ZIP)], Row("ada.zip", "passed")),
    ("a zip of the folder", &[("bob.zip", ZIP_OF_FOLDER)], Row("bob.zip", "passed")),
    ("a zip that macOS made", &[("cleo.zip", ZIP_OF_MAC)], Row("cleo.zip", "passed")),
    ("a zip in a zip", &[("dan.zip", ZIP_IN_ZIP)], Row("dan.zip", "passed")),
    ("a zip without an ending", &[("dot", ZIP)], Row("dot", "passed")),
    ("a folder that holds a zip", &[("eve/hw 1.zip", ZIP_OF_FOLDER)], Row("eve", "passed")),
    (
        "a zip beside a report",
        &[("gil/hw.zip", ZIP), ("gil/report.txt", "my report")],
        Row("gil", "passed"),
    ),
    (
        "a folder that holds a Mac's zip and leavings",
        &[("fay/hw.zip", ZIP_OF_MAC), ("fay/.DS_Store", ""), ("fay/__MACOSX/._hw.zip", "")],
        Row("fay", "passed"),
    ),
    (
        "a folder in a folder",
        &[("gus/hw/submission.toml", TOML), ("gus/hw/sim.sh", RIGHT)],
        Row("gus", "passed"),
    ),
    (
        "a folder in a folder in a folder",
        &[("hal/a/b/submission.toml", TOML), ("hal/a/b/sim.sh", RIGHT)],
        Row("hal", "passed"),
    ),
    (
        "two versions beside each other",
        &[
            ("ivy/v1/submission.toml", TOML),
            ("ivy/v1/sim.sh", RIGHT),
            ("ivy/v2/submission.toml", TOML),
            ("ivy/v2/sim.sh", RIGHT),
        ],
        Listed("ivy", "bad-hand-in", "v1 and v2"),
    ),
    (
        "a zip that was cut off",
        &[("jim.zip", ZIP_BROKEN)],
        Listed("jim.zip", "bad-hand-in", "the archive is damaged"),
    ),
    (
        "a RAR archive",
        &[("kim.rar", "Rar!\u{1a}\u{7}\0 and so on")],
        Listed("kim.rar", "bad-hand-in", "rar"),
    ),
];

const METADATA: &str = "---
submission_101:
  :submitters:
  - :name: Ada Lovelace
    :sid: al1815
    :email: ada@x.edu
  :created_at: 2026-02-01 23:59:00.000000000 Z
submission_102:
  :submitters:
  - :name: Bob B
    :sid: bb1
    :email: bob@x.edu
  - :name: Cleo C
    :sid:
    :email: cleo@x.edu
  :created_at: 2026-02-02 00:30:00.000000000 Z
submission_103:
  :submitters:
  - :name: Dot
    :email: dot@x.edu
submission_104:
  :submitters:
  - :name: Ada Lovelace
    :sid: al1815
submission_109:
  :submitters:
  - :name: Gone
";

const GRADESCOPE: &[Layout] = &[
    (
        "Gradescope: a student with an ID",
        &[
            ("export/submission_metadata.yml", METADATA),
            ("export/submission_101/submission.toml", TOML),
            ("export/submission_101/sim.sh", RIGHT),
        ],
        Row("al1815 (submission_101)", "passed"),
    ),
    (
        "Gradescope: a group",
        &[("export/submission_102/submission.toml", TOML), ("export/submission_102/sim.sh", RIGHT)],
        Row("bb1+cleo@x.edu", "passed"),
    ),
    (
        "Gradescope: a student without an ID",
        &[("export/submission_103/sim.sh", RIGHT)],
        Listed("dot@x.edu", "bad-hand-in", "there is no submission.toml"),
    ),
    (
        "Gradescope: two submissions of one student",
        &[
            ("export/submission_104/submission.toml", TOML),
            ("export/submission_104/sim.sh", SILENT),
        ],
        Row("al1815 (submission_104)", "no-output"),
    ),
    (
        "Gradescope: a submission that the metadata lack",
        &[("export/submission_105/submission.toml", TOML), ("export/submission_105/sim.sh", RIGHT)],
        Row("submission_105", "passed"),
    ),
    (
        "Gradescope: a submission without a folder",
        &[],
        Skipped("submission_109", "there is no such folder"),
    ),
];

const MOODLE: &[Layout] = &[
    (
        "Moodle: folders",
        &[
            ("Ada Lovelace_101_assignsubmission_file_/submission.toml", TOML),
            ("Ada Lovelace_101_assignsubmission_file_/sim.sh", RIGHT),
        ],
        Row("Ada Lovelace_101", "passed"),
    ),
    (
        "Moodle 4: folders without an underscore at the end",
        &[
            ("Bob B_102_assignsubmission_file/submission.toml", TOML),
            ("Bob B_102_assignsubmission_file/sim.sh", RIGHT),
        ],
        Row("Bob B_102", "passed"),
    ),
    (
        "Moodle: without folders",
        &[
            ("Cleo C_103_assignsubmission_file_submission.toml", TOML),
            ("Cleo C_103_assignsubmission_file_sim.sh", RIGHT),
        ],
        Row("Cleo C_103", "passed"),
    ),
    (
        "Moodle: files, and text beside them",
        &[
            ("Dot_104_assignsubmission_file_/submission.toml", TOML),
            ("Dot_104_assignsubmission_file_/sim.sh", RIGHT),
            ("Dot_104_assignsubmission_onlinetext_/onlinetext.html", "<p>"),
        ],
        Row("Dot_104", "passed"),
    ),
    (
        "Moodle: text alone",
        &[("Eve_105_assignsubmission_onlinetext_/onlinetext.html", "<p>")],
        Listed("Eve_105", "bad-hand-in", "there is no submission.toml"),
    ),
    (
        "Moodle: text alone, without folders",
        &[("Fay_106_assignsubmission_onlinetext_onlinetext.html", "<p>")],
        Listed("Fay_106", "bad-hand-in", "there is no submission.toml"),
    ),
    (
        "Moodle: blind marking",
        &[
            ("Participant_107_assignsubmission_file_/submission.toml", TOML),
            ("Participant_107_assignsubmission_file_/sim.sh", RIGHT),
        ],
        Row("Participant_107", "passed"),
    ),
];

const GITHUB: &[Layout] = &[
    (
        "GitHub: a clone",
        &[
            ("t1m3-ada/.git/HEAD", "ref"),
            ("t1m3-ada/submission.toml", TOML),
            ("t1m3-ada/sim.sh", RIGHT),
        ],
        Row("ada", "passed"),
    ),
    (
        "GitHub: a login with a hyphen",
        &[
            ("t1m3-bob-2/.git/HEAD", "ref"),
            ("t1m3-bob-2/submission.toml", TOML),
            ("t1m3-bob-2/sim.sh", SILENT),
        ],
        Row("bob-2", "no-output"),
    ),
    (
        "GitHub: a worktree, whose .git is a file",
        &[
            ("t1m3-cleo/.git", "gitdir: elsewhere"),
            ("t1m3-cleo/submission.toml", TOML),
            ("t1m3-cleo/sim.sh", RIGHT),
        ],
        Row("cleo", "passed"),
    ),
    (
        "GitHub: an empty repository",
        &[("t1m3-dot/.git/HEAD", "ref")],
        Listed("dot", "bad-hand-in", "there is no submission.toml"),
    ),
];

const UNCLONED: &[Layout] = &[
    (
        "GitHub: downloads without .git, named by --layout",
        &[("lab-ada/submission.toml", TOML), ("lab-ada/sim.sh", RIGHT)],
        Row("ada", "passed"),
    ),
    (
        "GitHub: a file beside them",
        &[("lab-bob/submission.toml", TOML), ("lab-bob/sim.sh", RIGHT), ("list.txt", "")],
        Row("bob", "passed"),
    ),
    ("GitHub: the list of students", &[], Skipped("list.txt", "no clone")),
];

/// Writes the files of the layouts; names that end in `!` are programs, and in `/` folders.
fn make(project: &Project, layouts: &[Layout]) {
    for (name, text) in layouts.iter().flat_map(|(_, files, _)| *files) {
        let path = format!("class/{name}");
        match (path.strip_suffix('!'), path.strip_suffix('/')) {
            (Some(program), _) => project.program(program, text),
            (_, Some(folder)) => fs::create_dir_all(project.path(folder)).unwrap(),
            _ => {
                fs::create_dir_all(project.path(&path).parent().unwrap()).unwrap();
                fs::write(project.path(&path), bytes(text)).unwrap();
            }
        }
    }
}

/// Grades them as one class: each lands where it should, and nothing else is there.
fn check(layouts: &[Layout], note: &str, arguments: &[&str]) -> (Project, Run) {
    check_class(layouts, note, arguments, |project| make(project, layouts))
}

/// The same for a class that is made otherwise.
fn check_class(
    layouts: &[Layout],
    note: &str,
    arguments: &[&str],
    make: impl Fn(&Project),
) -> (Project, Run) {
    let project = Project::new();
    make(&project);
    let run = project.class(arguments);
    let (mut rows, mut listed) = (0, 0);
    let (_, end) = run.stdout.split_once("Not graded, for people to look at").unwrap_or_default();
    for (origin, _, lands) in layouts {
        let (row, entry) = match lands {
            Row(name, verdict) => (Some((name, verdict)), None),
            Listed(name, verdict, reason) => {
                (Some((name, verdict)), Some((format!("  {name}: "), reason)))
            }
            Skipped(name, reason) => (None, Some((format!("  skipped: {name}: "), reason))),
            Nowhere => (None, None),
        };
        if let Some((name, verdict)) = row {
            rows += 1;
            let csv = project.read("out/summary.csv");
            let found = csv.lines().any(|line| line.starts_with(&format!("{name},{verdict},")));
            assert!(found, "{origin}: {csv}{}", run.stderr);
        }
        if let Some((start, reason)) = entry {
            listed += 1;
            let line = end.lines().find(|line| line.starts_with(&start));
            assert!(line.is_some_and(|line| line.contains(reason)), "{origin}: {}", run.stdout);
        }
    }
    assert_eq!(project.read("out/summary.csv").lines().count(), 1 + rows, "{}", run.stdout);
    assert_eq!(end.lines().filter(|line| line.starts_with("  ")).count(), listed, "{end}");
    assert_eq!(run.code, if listed > 0 { 3 } else { 0 }, "{}", run.stderr);
    assert_eq!(run.stderr.contains("hand-ins: "), !note.is_empty(), "{}", run.stderr);
    assert!(run.stderr.contains(note), "{}", run.stderr);
    (project, run)
}

#[test]
fn one_entry_a_student() {
    let (project, _) = check(FLAT, "", &["--html", "pages"]);
    // Why a hand-in was not run or not built is in the findings of the table.
    let page = project.read("pages/index.html");
    for reason in ["bad hand in: there is no submission.toml", "build failed: the build ended with"]
    {
        assert!(page.contains(reason), "{reason}: {page}");
    }
    symlink("/etc", project.path("class/link")).unwrap();
    let run = project.class(&["--resume"]);
    assert!(run.stdout.contains("  skipped: link: it is a link"), "{}", run.stdout);
}

#[test]
fn downloads_of_canvas() {
    let note = "hand-ins: Canvas's download, 11 students, in out/hand-ins";
    let (project, _) = check(CANVAS, note, &[]);
    let table = project.read("out/hand-ins.csv");
    assert!(table.contains("babbagecharles_13,babbagecharles,,13,,,late,,"), "{table}");
    assert!(
        table.contains("\"diracpaul_15_371_sim-1.sh, diracpaul_15_369_submission.toml\""),
        "{table}"
    );
    // Named, and in a folder within the one that is named.
    fs::create_dir(project.path("outer")).unwrap();
    fs::rename(project.path("class"), project.path("outer/submissions")).unwrap();
    fs::rename(project.path("outer"), project.path("class")).unwrap();
    let run = project.class(&["--layout", "canvas"]);
    assert!(run.code == 3 && run.stderr.contains(note), "{}", run.stderr);
    let run = project.class(&["--layout", "moodle"]);
    assert_eq!(run.code, 2, "{}", run.stderr);
    assert!(
        run.stderr.contains("class: nothing in it has the layout moodle\n  help: "),
        "{}",
        run.stderr
    );
}

#[test]
fn archives_and_folders_in_folders() {
    check(NESTED, "", &[]);
}

#[test]
fn archives_of_whole_classes() {
    for (layouts, within, note) in [
        (&CANVAS[..4], "", "hand-ins: Canvas's download, 4 students"),
        (GRADESCOPE, "", "hand-ins: Gradescope's export, 5 students"),
        (&MOODLE[..3], "Homework 1/", "hand-ins: Moodle's download, 3 students"),
        (&NESTED[..5], "", "hand-ins: one entry a student, 5 students"),
        (&FLAT[1..3], "hand-ins/", "hand-ins: one entry a student, 2 students"),
    ] {
        let files = layouts.iter().flat_map(|(_, files, _)| *files);
        let files =
            files.map(|(name, text)| PackageFile::data(format!("{within}{name}"), bytes(text)));
        let archive = zipped(files.collect());
        check_class(layouts, note, &[], |project| {
            fs::write(project.path("class"), &archive).unwrap()
        });
    }
}

#[test]
fn exports_of_gradescope() {
    check(GRADESCOPE, "hand-ins: Gradescope's export, 5 students", &[]);
}

#[test]
fn a_link_among_submissions_of_gradescope_is_named() {
    let project = Project::new();
    make(&project, &GRADESCOPE[..1]);
    let link = project.path("class/export/submission_102");
    symlink("/etc", link).unwrap();
    let run = project.class(&[]);
    assert!(run.stderr.contains("Gradescope's export, 1 students"), "{}", run.stderr);
    let lines: Vec<&str> =
        run.stdout.lines().filter(|line| line.contains("submission_102")).collect();
    assert_eq!(lines, ["  skipped: submission_102: it is a link, or neither a file nor a folder"]);
}

#[test]
fn metadata_of_gradescope_come_through_a_door() {
    let project = Project::new();
    make(&project, &GRADESCOPE[..1]);
    let path = project.path("class/export/submission_metadata.yml");
    let message = || {
        let run = project.class(&[]);
        assert_eq!(run.code, 2, "{}", run.stdout);
        run.stderr
    };
    fs::write(&path, "submission_101: {}\nsubmission_101: {}\n").unwrap();
    let twice = message();
    assert!(
        twice.contains("submission_metadata.yml:2: the key submission_101 stands twice"),
        "{twice}"
    );
    fs::write(&path, [0xff]).unwrap();
    assert!(message().contains("is not text in UTF-8\n  help: "), "{}", message());
    fs::File::create(&path).unwrap().set_len((512 << 20) + 1).unwrap();
    assert!(message().contains("is larger than 512 MiB\n  help: "), "{}", message());
}

/// A file that a student may have written neither decides about the class nor is parsed.
#[test]
fn a_hand_in_called_as_metadata_is_no_export() {
    for is_folder in [false, true] {
        let project = Project::new();
        make(&project, &FLAT[..2]);
        let path = project.path("class/submission_metadata.yml");
        if is_folder {
            fs::create_dir(path).unwrap();
        } else {
            fs::write(path, [0xff]).unwrap();
        }
        let run = project.class(&[]);
        let csv = project.read("out/summary.csv");
        assert!(
            csv.contains("\nada,passed,") && csv.contains("\nbob,passed,"),
            "{csv}{}",
            run.stderr
        );
        assert!(run.stdout.contains("submission_metadata.yml: "), "{}", run.stdout);
    }
}

/// Names that differ on a platform may become the same.
#[test]
fn two_uploads_of_one_name_end_no_class() {
    let project = Project::new();
    make(&project, &CANVAS[..1]);
    for (number, name) in ["sim", "sim ", "a\\b", "a_b"].iter().enumerate() {
        fs::write(project.path(&format!("class/mal_1009_{number}_{name}")), "x").unwrap();
    }
    let run = project.class(&[]);
    let names = |folder: &str| fs::read_dir(project.path(folder)).unwrap().count();
    assert_eq!(names("out/hand-ins/mal_1009"), 4, "{}", run.stderr);
    assert!(project.read("out/summary.csv").contains(",passed,"), "{}", run.stdout);
}

#[test]
fn downloads_of_moodle() {
    check(MOODLE, "hand-ins: Moodle's download, 7 students", &[]);
}

#[test]
fn clones_from_github() {
    check(GITHUB, "hand-ins: clones from GitHub, 4 students", &[]);
    check(UNCLONED, "hand-ins: clones from GitHub, 2 students", &["--layout", "github"]);
}

#[test]
fn names_and_times_of_platforms_reach_the_roster() {
    let gradebook = ["--roster", "roster.csv", "--gradebook", "moodle=grades.csv"];
    let due = ["--due", "2026-02-02T00:00:00Z"];
    let project = Project::new();
    project.write("assets/rubric.toml", "[late]\npenalty = 20\n");
    make(&project, &GRADESCOPE[..2]);
    let roster = "name,id,login,email\nAda Lovelace,al1815,ada,ada@x.edu\nBob B,bb1,bob,bob@x.edu\n\
                  Cleo C,cc1,cleo,cleo@x.edu\nGone,,gone,gone@x.edu\n";
    project.write("roster.csv", roster);
    let run = project.class(&[&gradebook[..], &due].concat());
    let csv = project.read("out/summary.csv");
    // A group has one row, and each of its students the points.
    assert!(
        csv.contains("\nada,passed,") && csv.contains("\nbob+cleo,passed,"),
        "{csv}{}",
        run.stderr
    );
    assert!(
        run.stdout.contains("late: Bob B: on day 1")
            && run.stdout.contains("late: Cleo C: on day 1"),
        "{}",
        run.stdout
    );
    assert!(!run.stdout.contains("late: Ada"), "{}", run.stdout);
    assert!(run.stdout.contains("no submission: Gone"), "{}", run.stdout);
    let grades = project.read("grades.csv");
    assert_eq!(grades.lines().filter(|line| !line.ends_with(',')).count(), 4, "{grades}");

    // Canvas has names without spaces, and marks instead of times.
    let project = Project::new();
    make(&project, &CANVAS[..2]);
    project.write("roster.csv", "name,login\n\"Lovelace, Ada\",ada\nCharles Babbage,charles\n");
    let run = project.class(&[&gradebook[..], &due].concat());
    assert_eq!(run.code, 0, "{}", run.stderr);
    let csv = project.read("out/summary.csv");
    assert!(csv.contains("\nada,passed,") && csv.contains("\ncharles,passed,"), "{csv}");
    let remark =
        "marked as late: Charles Babbage: charles counts as in time until the column submitted";
    assert!(run.stdout.contains(remark), "{}", run.stdout);
    assert!(!run.stdout.contains("marked as late: Lovelace"), "{}", run.stdout);
}

#[test]
fn plan_of_an_arranged_class_needs_the_download_no_longer() {
    let project = Project::new();
    // Equal hand-ins are in one shard.
    make(&project, &CANVAS[2..8]);
    let run = project.class(&["--on", "nothing", "--shards", "2"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    fs::rename(project.path("class"), project.path("elsewhere")).unwrap();
    fs::create_dir(project.path("class")).unwrap();
    for shard in ["0", "1"] {
        let run = project.grade(&["class", "run-shard", "out/plan.json", shard]);
        assert_eq!(run.code, 0, "{}", run.stderr);
    }
    let run = project.grade(&["class", "merge", "out/plan.json"]);
    assert!(run.code == 0 && run.stdout.contains("6 submissions"), "{}{}", run.stdout, run.stderr);
    // Arranged anew, nothing has changed.
    fs::remove_dir(project.path("class")).unwrap();
    fs::rename(project.path("elsewhere"), project.path("class")).unwrap();
    let before = fs::metadata(project.path("out/reports/curiemarie_14.txt")).unwrap().modified();
    let run = project.class(&["--resume"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    let after = fs::metadata(project.path("out/reports/curiemarie_14.txt")).unwrap().modified();
    assert_eq!(before.unwrap(), after.unwrap(), "graded again");
}
