use std::fmt::Write;

use super::*;
use crate::submission::init::{Language as InLanguage, Skeleton};

/// Independent programs of this repository: by other authors, on other tasks or in other languages.
const INDEPENDENT: [(&str, &str); 4] = [
    ("student.cpp", include_str!("../../../selftest/src/programs/student.cpp")),
    ("student.c", include_str!("../../../selftest/src/programs/student.c")),
    ("student.py", include_str!("../../../selftest/src/programs/student.py")),
    ("springs.cpp", include_str!("../../../grade/tests/it/programs/fast_mass_springs.cpp")),
];

/// The same program to the eye of a compiler: every name changed, comments replaced, numbers changed, and the functions in
/// reverse order.
fn disguised(text: &str) -> String {
    let mut parts: Vec<&str> = text.split("\n\n").collect();
    parts.reverse();
    let mut changed = String::new();
    for line in parts.join("\n\n").lines() {
        let code = line.split("//").next().unwrap_or_default();
        let mut rest = code;
        let is_import = code.starts_with('#');
        while let Some(first) = rest.chars().next() {
            let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
            let length = rest.find(|c| !is_word(c)).unwrap_or(rest.len()).max(first.len_utf8());
            let word = &rest[..length];
            let is_name = first.is_ascii_alphabetic() && !is_import;
            let is_keyword = ["if", "else", "for", "while", "return", "struct", "case", "do", "in"];
            changed += word;
            changed += match () {
                () if is_name && !is_keyword.contains(&word) && length > 2 => "Renamed",
                () if first.is_ascii_digit() => "5",
                () => "",
            };
            rest = &rest[length..];
        }
        let _ = writeln!(changed, " // a thought of my own");
    }
    changed
}

fn sources(name: &str, text: &str) -> Sources {
    Sources::of(name, [("simulate.cpp", text)])
}

/// The pairs that are listed: names, and parts in per cent.
fn listed(class: Vec<Sources>, starter: &[Sources]) -> Vec<(String, [u32; 2])> {
    let found = compare(class, starter, Config::default());
    let shown = |pair: &Pair| {
        let names = pair.hand_ins.map(|place| found.hand_ins[place].name.clone());
        (names.join(" "), [0, 1].map(|side| (100.0 * found.part(pair, side)) as u32))
    };
    found.pairs.iter().map(shown).collect()
}

/// The skeleton of `grade init`.
fn skeleton() -> String {
    Skeleton::new(InLanguage::Cpp, None).sources.remove(0).1
}

#[test]
fn a_disguised_copy_is_found_and_independent_programs_are_not() {
    let class = || {
        let independent =
            INDEPENDENT.iter().map(|(name, text)| Sources::of(name, [(*name, *text)]));
        independent.collect::<Vec<_>>()
    };
    assert_eq!(listed(class(), &[]), []);
    let mut with_copy = class();
    with_copy.push(sources("copy", &disguised(INDEPENDENT[0].1)));
    let found = listed(with_copy, &[]);
    let [(names, parts)] = &found[..] else { panic!("{found:?}") };
    assert_eq!(names, "copy student.cpp");
    assert!(parts.iter().all(|part| *part >= 85), "{parts:?}");
}

#[test]
fn independent_programs_share_almost_no_code() {
    let class = INDEPENDENT.iter().map(|(name, text)| Sources::of(name, [(*name, *text)]));
    let config = Config { listed_from: 0.0, ..Config::default() };
    let found = compare(class.collect(), &[], config);
    assert_eq!(found.hand_ins.len(), INDEPENDENT.len());
    for pair in &found.pairs {
        let parts = [0, 1].map(|side| found.part(pair, side));
        assert!(parts.iter().all(|part| *part < 0.05), "{parts:?} {pair:?}");
    }
}

#[test]
fn starter_code_is_subtracted() {
    let skeleton = skeleton();
    let own = |text: &str| {
        text.lines().skip(20).take(60).map(|line| format!("{line}\n")).collect::<String>()
    };
    let ada = format!("{skeleton}\n{}", own(INDEPENDENT[3].1));
    let bob = format!("{}\n{skeleton}", own(INDEPENDENT[1].1));
    let class = || vec![sources("ada", &ada), sources("bob", &bob)];
    assert_eq!(listed(class(), &[]).len(), 1, "the skeleton is a large part of both");
    assert_eq!(listed(class(), &[sources("starter", &skeleton)]), []);
    // Submissions of starter code alone are not compared.
    let found = compare(
        vec![sources("ada", &ada), sources("cleo", &skeleton)],
        &[sources("starter", &skeleton)],
        Config::default(),
    );
    let [(name, reason)] = &found.not_compared[..] else { panic!("{found:?}") };
    assert!(name == "cleo" && reason.starts_with("0 tokens of its own; of "), "{reason}");
    assert_eq!(found.hand_ins.len(), 2);
}

/// A ring of copies, larger than the number from which tokens are common.
#[test]
fn equal_hand_ins_are_named_and_count_once() {
    let ring = |number: usize| sources(&format!("cheat{number}"), INDEPENDENT[0].1);
    let mut class: Vec<Sources> =
        INDEPENDENT[1..].iter().map(|(name, text)| Sources::of(name, [(*name, *text)])).collect();
    class.extend((1..=8).map(ring));
    class.push(sources("disguised", &disguised(INDEPENDENT[0].1)));
    let found = compare(class, &[], Config::default());
    let names: Vec<String> = (1..=8).map(|number| format!("cheat{number}")).collect();
    assert_eq!(found.equal, [names]);
    assert_eq!(found.not_compared, []);
    assert_eq!(found.hand_ins.len(), 12);
    // The first is compared with the seven others, and with the disguised copy.
    assert_eq!(found.pairs.len(), 8);
    assert!(found.pairs.iter().all(|pair| found.hand_ins[pair.hand_ins[0]].name == "cheat1"));
}

#[test]
fn widely_shared_code_is_ignored_and_group_copies_are_not() {
    let shared = INDEPENDENT[3].1;
    // Expressions of some operators that no two hand-ins share.
    let own = |seed: u64| {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut text = String::new();
        for _ in 0..600 {
            let _ = write!(
                text,
                "a {} ",
                ["+", "-", "*", "/", "%", "&", "|", "(", ")"][random.usize(0..9)]
            );
        }
        text
    };
    let class = |having: u64, total: u64| {
        let text = |number: u64| {
            if number < having { shared.to_owned() + &own(number) } else { own(number) }
        };
        (0..total).map(|number| sources(&format!("{number:02}"), &text(number))).collect::<Vec<_>>()
    };
    let config = Config::default();
    assert_eq!((config.common(4), config.common(40)), (5, 10));
    assert_eq!(listed(class(10, 40), &[]).len(), 45);
    let found = compare(class(11, 40), &[], config);
    assert_eq!(found.pairs, []);
    assert!(found.hand_ins[0].common > 1000 && found.hand_ins[11].common == 0);
}

#[test]
fn runs_name_the_lines_of_both_sides() {
    let block = |name: &str| {
        let mut text = String::new();
        for number in 0..30 {
            let signs = ["+", "-", "*", "/"];
            let (a, b) = (signs[number % 4], signs[number * number % 3]);
            let _ = writeln!(text, "{name} = {name} {a} ({name} {b} 2);");
        }
        text
    };
    let one = format!("x ^ y\n\n{}", block("alpha"));
    let other = format!("// one\n// two\n\n\n{}\n& ^", block("beta"));
    let found = compare(vec![sources("b", &other), sources("a", &one)], &[], Config::default());
    let [pair] = &found.pairs[..] else { panic!("{found:?}") };
    let file = || "simulate.cpp".to_owned();
    let places =
        [Place { file: file(), first: 3, last: 32 }, Place { file: file(), first: 5, last: 34 }];
    assert_eq!(pair.runs, [Run { tokens: 300, places }]);
    assert_eq!(pair.shared, [300, 300]);
}

#[test]
fn similarity_does_not_depend_on_order_or_threads() {
    let class = || {
        let mut class: Vec<Sources> =
            INDEPENDENT.iter().map(|(name, text)| Sources::of(name, [(*name, *text)])).collect();
        for (name, text) in INDEPENDENT {
            class.push(Sources::of(&format!("copy of {name}"), [(name, disguised(text).as_str())]));
        }
        class
    };
    let first = compare(class(), &[], Config::default());
    assert!(first.pairs.len() >= 3, "{:?}", first.pairs);
    let mut reversed = class();
    reversed.reverse();
    assert_eq!(compare(reversed, &[], Config::default()), first);
}

#[cfg(unix)]
#[test]
fn only_regular_source_files_within_limits_are_read() {
    use std::fs;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ada");
    fs::create_dir_all(path.join("src")).unwrap();
    fs::write(path.join("src/a.cpp"), "int a;\n").unwrap();
    fs::write(path.join("src/a.o"), "int a;\n").unwrap();
    fs::write(path.join("._a.cpp"), "int a;\n").unwrap();
    fs::write(folder.path().join("secret.cpp"), "int b; int c;\n").unwrap();
    std::os::unix::fs::symlink("../secret.cpp", path.join("link.cpp")).unwrap();
    std::os::unix::fs::symlink("..", path.join("up")).unwrap();
    fs::File::create(path.join("huge.py")).unwrap().set_len(MAX_FILE + 1).unwrap();
    let read = Sources::read("ada", &path).unwrap();
    assert_eq!(
        (&read.files[..], read.tokens.len(), read.unread),
        (&["src/a.cpp".to_owned()][..], 3, 1)
    );
    rustix::fs::mkfifoat(rustix::fs::CWD, path.join("pipe.cpp"), rustix::fs::Mode::RWXU).unwrap();
    let error = Sources::read("ada", &path).err().unwrap().to_string();
    assert!(error.starts_with("pipe.cpp: is a pipe"), "{error}");
    // A single file is a hand-in, too.
    let read = Sources::read("bob.py", &folder.path().join("secret.cpp")).unwrap();
    assert_eq!((&read.files[..], read.tokens.len()), (&["secret.cpp".to_owned()][..], 6));
}
