//! `grade class DIR --similar`.

use std::fs;

use platforms::package::PackageFile;
use test_support::root;

use crate::class::Project;

const STUDENT: &str = "grader/selftest/src/programs/student.cpp";

#[test]
fn pairs_that_share_code_are_listed_and_nothing_is_run() {
    let project = Project::new();
    let original = fs::read_to_string(root().join(STUDENT)).unwrap();
    let renamed: Vec<&str> =
        original.lines().map(|line| line.split("//").next().unwrap()).collect();
    let renamed = renamed.join("\n").replace("mass", "weight").replace("Real", "number_t");
    let other = fs::read_to_string(root().join("grader/selftest/src/programs/student.py")).unwrap();
    project.write("class/ada/src/one.cpp", &original);
    project.write("class/bob\u{1f}/two.cpp", "never read");
    project.write("class/=bob/two\u{1b}.cpp", &renamed);
    project.write("class/cleo/simulate.py", &other);
    project.write("class/dot/notes.txt", "no code");
    let run = project.grade(&["class", "class", "--similar", "-o", "shared", "--root", "."]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    for line in [
        "  1  =bob      100 %  ada        100 %\n",
        "  two\u{fffd}.cpp:",
        "  and  src/one.cpp:",
        "  not compared: dot: it has no sources in a known language\n",
        "its name contains control characters",
    ] {
        assert!(run.stdout.contains(line), "{line}: {}", run.stdout);
    }
    assert!(!run.stdout.contains("cleo,") && !run.stdout.contains("  2  "), "{}", run.stdout);
    assert_eq!(project.read("shared/similar.txt"), run.stdout);
    let csv = project.read("shared/similar.csv");
    assert!(csv.lines().nth(1).unwrap().starts_with("'=bob,ada,1.0000,"), "{csv}");
    assert!(!project.path("shared/reports").exists());

    // The same code as starter code.
    project.write("starter/one.cpp", &original);
    let run =
        project.grade(&["class", "class", "--similar", "--starter", "starter", "--root", "."]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stdout.contains("no pair shares 20 % of the tokens"), "{}", run.stdout);
    assert!(run.stdout.contains("not compared: ada: 0 tokens of its own"), "{}", run.stdout);

    let run = project.grade(&["class", "class", "--starter", "starter", "-o", "out"]);
    assert!(run.code == 2 && run.stderr.contains("--similar"), "{}", run.stderr);
    let run = project.grade(&["class", "class"]);
    assert!(run.code == 2 && run.stderr.contains("--output"), "{}", run.stderr);
}

/// Sources in archives, and those that another source includes, are compared; a pack's starter code does not count.
#[test]
fn archives_and_included_files_are_compared() {
    let project = Project::new();
    let original = fs::read_to_string(root().join(STUDENT)).unwrap();
    project.write("class/ada/FOSSSim/one.cpp", &original);
    project.write("class/eve/main.cpp", "#include \"parts/code.txt\"\n");
    project.write("class/eve/parts/code.txt", &original);
    let zip = PackageFile::data("hw/one.cpp", original.clone().into_bytes());
    let zip = crate::layouts::zipped(vec![zip]);
    project.write("class/zipped/report.txt", "my report");
    fs::write(project.path("class/zipped/hw.zip"), &zip).unwrap();
    fs::write(project.path("class/hw.zip"), &zip).unwrap();
    let run = project.grade(&["class", "class", "--similar", "--root", "."]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    // The first with each of the other two of the same source, and with the one that includes it.
    assert!(run.stdout.contains("  3  ") && !run.stdout.contains("  4  "), "{}", run.stdout);
    let same = "the same source, token by token, 3 times: ada, hw.zip, zipped\n";
    assert!(run.stdout.contains(same), "{}", run.stdout);
    assert!(!run.stdout.contains("not compared"), "{}", run.stdout);

    let manifest = "title = \"t\"\n[hand-in]\nfiles = [\"FOSSSim/*.cpp\"]\n[starter]\nfolder = \"start\"\n[run]\n\
                    command = [\"./a\", \"{scene}\", \"{trace}\"]\n";
    project.write("pack/pack.toml", manifest);
    project.write("pack/start/FOSSSim/one.cpp", &original);
    let run = project.grade(&["class", "class", "--similar", "--pack", "pack", "--root", "."]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stdout.contains("no pair shares 20 % of the tokens"), "{}", run.stdout);
}

#[test]
fn grading_options_are_refused_with_similar() {
    let project = Project::new();
    project.write("class/ada/one.cpp", "int main() {}");
    for option in ["--resume", "--assignment=t1m2", "--on=slurm", "--format=json"] {
        let run = project.grade(&["class", "class", "--similar", option]);
        assert_eq!(run.code, 2, "{}", run.stderr);
        let name = option.split('=').next().unwrap();
        let message = "'--similar' cannot be used with";
        assert!(run.stderr.contains(message) && run.stderr.contains(name), "{}", run.stderr);
    }
}
