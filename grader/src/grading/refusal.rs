//! Programs that say that they lack a feature.
//!
//! Exit code 77 says so, as in Automake's test suites; so does any other non-zero exit code, or a run without a trace,
//! with a message that refuses the scene's integrator, one of its forces or its format by name ("unknown force vortexforce",
//! "no element vortexforce"). A message that names a force without refusing it ("springforce.cpp:12: index out of range")
//! is a crash.

use scene::Scene;

use crate::boundary::printed::{RawUse, Untrusted};
use crate::verdict::{Failure, Lack, RunEnd, RunFailure};

/// The exit code of a program that lacks a feature.
const NOT_IMPLEMENTED: i32 = 77;

/// Words of a refusal, in lower case.
const REFUSALS: [&str; 19] = [
    "not implemented",
    "not yet",
    "not recogni",
    "not handled",
    "not available",
    "not know",
    "n't know",
    "notimplemented",
    "unimplemented",
    "unknown",
    "unsupported",
    "not supported",
    "does not support",
    "unrecognized",
    "unrecognised",
    "invalid",
    "no such",
    "todo",
    "keyerror",
];

/// What a scene names by numbers, in lower case.
const NUMBERED: [&str; 5] = ["particle", "edge", "index", "node", "vertex"];

/// A shell's exit status of a program that a signal ended is larger.
const SIGNALS: i32 = 128;

/// Letters that a name without its last ones lacks, at most: with more, it may be a shorter name.
const MOST_CUT: usize = 3;

/// Letters of a name that are left are more than these: fewer may be a word.
const LEAST_KEPT: usize = 10;

/// More words of a program that says why it ends, in lower case.
const REASONS: [&str; 4] = ["cannot", "can't", " yet", "only "];

/// Words of reports of errors that a program did not catch, in lower case.
const UNCAUGHT: [&str; 9] = [
    "traceback",
    // Lines of the stack of calls, as JavaScript and Java print them.
    "\n    at ",
    "\n\tat ",
    "panicked",
    "terminate called",
    "assertion",
    "sanitizer",
    "syntaxerror",
    "indentationerror",
];

/// The failure of a program that says that it lacks a feature of the scene, or its format, in the place of a crash or of no
/// trace.
pub fn refusal(scene: &Scene, format: &str, failure: Failure) -> Failure {
    let Failure::Run(run) = &failure else { return failure };
    if !(failure.is_crash() || failure.is_without_trace()) {
        return failure;
    }
    let Some(status) = run.end.exit_status() else { return failure };
    let text = said(run);
    let lines = || text.lines().map(str::to_owned);
    let refuses = |line: &str, name: &str| {
        has_word(line, name) && (is_refused(line) || is_denied(line, name))
    };
    let named =
        names(scene, format).into_iter().find(|name| lines().any(|line| refuses(&line, name)));
    if status != NOT_IMPLEMENTED && named.is_none() {
        return failure;
    }
    // Without a refusal, a name alone is enough where the exit code says the rest.
    let name = named.or_else(|| {
        names(scene, format).into_iter().find(|name| lines().any(|l| has_word(&l, name)))
    });
    Failure::NotImplemented(Lack::Refused { name, failure: run.clone() })
}

/// Whether a line has a word of a refusal that is not about a particle or an edge, such as "no such particle".
fn is_refused(line: &str) -> bool {
    let is_of_data = |rest: &str| NUMBERED.iter().any(|noun| rest.trim_start().starts_with(noun));
    REFUSALS.iter().any(|word| line.split(word).skip(1).any(|rest| !is_of_data(rest)))
}

/// Whether a program ended by itself, with an exit status and words of a refusal.
pub(super) fn says_why(run: &RunFailure) -> bool {
    let text = said(run);
    let has = |words: &[&str]| words.iter().any(|word| text.contains(word));
    says_something(run) && (text.lines().any(is_refused) || has(&REASONS)) && !cuts_a_name(&text)
}

/// Whether a text has the name of an integrator or a force without its last letters, as a program that keeps too few of them
/// says that it does not know it.
fn cuts_a_name(text: &str) -> bool {
    let integrators = simulator::integrator::REGISTRY.iter().map(|kind| kind.schema.name);
    let forces = simulator::force::REGISTRY.iter().map(|kind| kind.schema.tag);
    let names: Vec<&str> = integrators.chain(forces).collect();
    let is_cut = |word: &str, name: &&str| {
        let is_long = word.len() > LEAST_KEPT && word.len() + MOST_CUT >= name.len();
        is_long && name.starts_with(word)
    };
    let mut words = text.split(|letter: char| !(letter.is_alphanumeric() || letter == '-'));
    words.any(|word| !names.contains(&word) && names.iter().any(|name| is_cut(word, name)))
}

/// Whether a program ended by itself, with an exit status and a message, not with the report of an error that nothing caught.
fn says_something(run: &RunFailure) -> bool {
    let RunEnd::Exited(status) = run.end else { return false };
    let text = said(run);
    let is_uncaught = UNCAUGHT.iter().any(|word| text.contains(word));
    (1..SIGNALS).contains(&status) && !text.trim().is_empty() && !is_uncaught
}

/// The output of a program without warnings, in lower case.
fn said(run: &RunFailure) -> String {
    let text = run.output.text.raw(RawUse::Comparison).to_lowercase();
    without_warnings(&text).collect::<Vec<&str>>().join("\n")
}

/// The lines of a text without warnings and the lines of source that follow them.
fn without_warnings(text: &str) -> impl Iterator<Item = &str> {
    let mut is_warning = false;
    text.lines().filter(move |line| {
        is_warning = line.to_lowercase().contains("warning:")
            || is_warning && line.starts_with(char::is_whitespace);
        !is_warning
    })
}

/// The first line that a program printed, if it ended by itself with a message.
pub(super) fn message(run: &RunFailure) -> Option<String> {
    let mut lines = without_warnings(run.output.text.raw(RawUse::Part));
    let first = lines.find(|line| !line.trim().is_empty()).filter(|_| says_something(run))?;
    Some(Untrusted::from(first).line())
}

/// The message of an error that a program did not catch, as its language reports it.
pub(super) fn uncaught(run: &RunFailure) -> Option<String> {
    let mut lines = without_warnings(run.output.text.raw(RawUse::Part));
    let message = loop {
        let line = lines.next()?;
        let first = line.split([' ', ':']).next().unwrap_or_default();
        // Rust's message is on the line after.
        if line.contains("panicked at ") {
            break lines.next()?;
        }
        // Python, JavaScript, Java; then C++.
        let is_error = first.ends_with("Error") || first.ends_with("Exception");
        if is_error || line.contains("what(): ") || line.contains("Assertion ") {
            break line.trim_start();
        }
    };
    Some(Untrusted::from(message).line())
}

/// Features of a scene by the names that a message may use: its integrator, its forces, its format.
fn names(scene: &Scene, format: &str) -> Vec<String> {
    let aliases = scene.integrator.aliases.iter().copied();
    let mut names: Vec<String> =
        aliases.chain([scene.integrator.name]).map(str::to_owned).collect();
    for element in &scene.forces {
        let tag = element.schema.tag.to_owned();
        if !names.contains(&tag) {
            names.push(tag);
        }
    }
    names.extend(Some(format.to_owned()).filter(|format| format != "xml"));
    names
}

/// Whether `name` stands in `line` by itself: not as a part of a longer name, nor as that of a source file. Hyphens and
/// underscores inside names do not count: `implicit-euler` is the class `ImplicitEuler`.
fn has_word(line: &str, name: &str) -> bool {
    let [line, name] = [line, name].map(|text| text.replace(['-', '_'], ""));
    let is_part = |c: char| c.is_alphanumeric();
    line.match_indices(&name).any(|(place, _)| {
        let before = line[..place].chars().next_back();
        let mut after = line[place + name.len()..].chars();
        let next = after.next();
        let is_file = next == Some('.') && after.next().is_some_and(char::is_alphanumeric);
        !before.is_some_and(is_part) && !next.is_some_and(is_part) && !is_file
    })
}

/// Whether `line` says that there is no `name`: "no vortexforce", "no element 'vortexforce' here".
fn is_denied(line: &str, name: &str) -> bool {
    let words: Vec<&str> = line.split_whitespace().collect();
    let is_name = |word: &&str| has_word(word, name);
    words
        .iter()
        .position(|word| *word == "no")
        .is_some_and(|no| words[no + 1..].iter().take(2).any(is_name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verdict::LastOutput;

    #[test]
    fn a_program_that_says_why_it_ends_refuses() {
        let says = |end: RunEnd, text: &str| {
            let output = LastOutput { text: text.to_owned().into(), misses_file: false };
            says_why(&RunFailure { end, output })
        };
        assert!(says(RunEnd::Exited(1), "cannot do this yet"));
        assert!(says(RunEnd::Exited(1), "unknown integrator: linearized-implicit"));
        assert!(!says(RunEnd::Exited(1), "unknown integrator: linearized-implicit-eul"));
        assert!(!says(RunEnd::Exited(1), ""));
        let warning =
            "sim.py:3: RuntimeWarning: invalid value encountered in divide\n  n = d / l\n";
        assert!(!says(RunEnd::Exited(1), &format!("{warning}Newton's method did not converge")));
        assert!(says(RunEnd::Exited(1), &format!("{warning}unknown integrator")));
        assert!(!says(RunEnd::Exited(1), "  File \"sim.py\", line 3\nSyntaxError: invalid syntax"));
        assert!(!says(RunEnd::Exited(139), "not implemented"));
        assert!(!says(RunEnd::Killed(6), "not implemented"));
        assert!(!says(RunEnd::Exited(1), "Traceback (most recent call last):\nKeyError: cannot"));
    }

    #[test]
    fn a_message_is_the_first_line_of_a_program_that_ends_by_itself() {
        let first = |end: RunEnd, text: &str| {
            let output = LastOutput { text: text.to_owned().into(), misses_file: false };
            message(&RunFailure { end, output })
        };
        let text = "sim.c:3: warning: unused\n  int x;\n\nattribute px is missing\nin line 3\n";
        assert_eq!(first(RunEnd::Exited(1), text).as_deref(), Some("attribute px is missing"));
        for (end, text) in [
            (RunEnd::Exited(0), text),
            (RunEnd::Killed(6), text),
            (RunEnd::Exited(1), "\n"),
            (RunEnd::Exited(1), "Traceback (most recent call last):\nKeyError: 'px'"),
        ] {
            assert_eq!(first(end, text), None, "{text}");
        }
    }

    #[test]
    fn the_message_of_an_error_that_is_not_caught_is_found() {
        let output = |text: &str| LastOutput { text: text.to_owned().into(), misses_file: false };
        for (text, message) in [
            (
                "Traceback (most recent call last):\n  File \"a.py\", line 1, in <module>\n    \
                 raise ValueError(x)\nValueError: no edge 3",
                "ValueError: no edge 3",
            ),
            (
                "/a/sim.js:3\n  throw new Error(x);\n  ^\n\nError: Cannot find module 'x'\n    at f (/a/sim.js:3:9)",
                "Error: Cannot find module 'x'",
            ),
            (
                "Exception in thread \"main\" java.lang.NullPointerException: x\n\tat Sim.main(Sim.java:3)",
                "Exception in thread \"main\" java.lang.NullPointerException: x",
            ),
            (
                "\nthread 'main' panicked at a.rs:2:5:\nindex out of bounds\nnote: x",
                "index out of bounds",
            ),
            (
                "terminate called after throwing an instance of 'std::out_of_range'\n  what():  map::at\n",
                "what():  map::at",
            ),
        ] {
            let run = RunFailure { end: RunEnd::Exited(1), output: output(text) };
            assert_eq!(uncaught(&run).as_deref(), Some(message));
            assert!(!says_why(&run), "{text}");
        }
        let run = RunFailure { end: RunEnd::Exited(1), output: output("no particles\n") };
        assert_eq!(uncaught(&run), None);
    }

    #[test]
    fn a_message_denies_what_it_says_there_is_no_such_thing_as() {
        for (line, is_there) in [
            ("no element vortexforce", true),
            ("error: there is no 'vortexforce' here", true),
            ("no two particles of vortexforce may coincide", false),
            ("vortexforce: no convergence", false),
        ] {
            assert_eq!(is_denied(line, "vortexforce"), is_there, "{line}");
        }
    }

    #[test]
    fn a_particle_that_is_not_there_is_no_feature_that_a_program_lacks() {
        for (line, is_it) in [
            ("no such particle in <gravitationalforce>", false),
            ("invalid edge of springforce", false),
            ("no such force gravitationalforce", true),
            ("invalid edge: unknown force gravitationalforce", true),
        ] {
            assert_eq!(is_refused(line), is_it, "{line}");
        }
    }

    #[test]
    fn force_names_match_whole_words() {
        for (line, is_there) in [
            ("unknown force springforce", true),
            ("keyerror: 'springforce'", true),
            ("springforce is not implemented.", true),
            ("springforce.cpp:12: invalid index", false),
            ("unknown greenspringforce", false),
            ("unknown springforce-2", false),
        ] {
            assert_eq!(has_word(line, "springforce"), is_there, "{line}");
        }
    }
}
