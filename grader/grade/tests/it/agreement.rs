//! The text, the JSON report and the pages agree on one program, and the default text is short.

use needs::needs;

use crate::folder::{Folder, words};
use crate::student;

/// A mistake of the small simulator.
const TRANSPOSED: &str = "block (j, i) transposed";

/// Lacks drag and crashes on gravitation.
const LIMITED: &str =
    "grep -q '<dragdamping' \"$2\" && { echo 'unknown force dragdamping' >&2; exit 77; }
grep -q '<gravitationalforce' \"$2\" && kill -ABRT $$
";

/// Text without markup and line breaks.
fn plain(text: &str) -> String {
    let mut plain = String::new();
    for (number, part) in text.split('<').enumerate() {
        let text = part.split_once('>').map_or("", |(_, text)| text);
        plain += &if number == 0 { part.to_owned() } else { format!(" {text}") };
    }
    let entities = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&#39;", "'"), ("&amp;", "&")];
    for (entity, character) in entities {
        plain = plain.replace(entity, character);
    }
    words(&plain)
}

/// A folder with a submission, `my-simulator`, that has this mistake and these limits.
pub(crate) fn mistaken(limits: &str, mistake: &str) -> Folder {
    let folder = Folder::new();
    student::compile(&folder.path("my-simulator"), "");
    let run = format!("export MISTAKE='{mistake}'\nexec \"$(dirname \"$0\")/student\" \"$@\"\n");
    folder.write("my-simulator/run.sh", &format!("{limits}{run}"));
    folder.write("my-simulator/submission.toml", &manifest("my-simulator"));
    folder
}

/// A `submission.toml` that runs `run.sh`.
pub(crate) fn manifest(name: &str) -> String {
    let run =
        "\"sh\", \"{folder}/run.sh\", \"-s\", \"{scene}\", \"-d\", \"0\", \"-o\", \"{trace}\"";
    format!("name = \"{name}\"\nformat = \"fosssim\"\nrun = [{run}]\n")
}

#[needs("command -v cc")]
#[test]
fn text_json_and_pages_say_the_same_of_every_scene() {
    let folder = mistaken(LIMITED, TRANSPOSED);
    let reports = ["text=report.txt", "json=report.json", "html=pages"];
    let reports = reports.iter().flat_map(|report| ["--report", report]);
    let arguments = ["my-simulator", "--assignment", "t1m3", "--details", "1000"];
    let arguments: Vec<&str> = arguments.into_iter().chain(reports).collect();
    let run = folder.grade(&arguments);
    assert_eq!(run.code, 1, "{}", run.stderr);
    let [text, json, front] =
        ["report.txt", "report.json", "pages/index.html"].map(|name| folder.read(name));
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    let (text_words, front_words) = (words(&text.replace(" \\\n", " ")), plain(&front));
    let string = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
    let list = |value: &serde_json::Value| value.as_array().unwrap().clone();
    let mut verdicts = Vec::new();
    for feature in list(&json["features"]) {
        for scene in list(&feature["scenes"]) {
            let (name, verdict) = (string(&scene["name"]), string(&scene["verdict"]));
            let shown = verdict.replace('-', " ");
            let row = text.lines().find(|line| line.trim_start().starts_with(&format!("{name} ")));
            let row = words(row.unwrap_or_else(|| panic!("the text lacks {name}")));
            assert_eq!(row, format!("{name} {shown}"));
            let sign = if verdict == "pass" { "✓" } else { "✗" };
            // A feature that is not there is no mistake.
            let sign = if verdict == "not-implemented" { "–" } else { sign };
            assert!(front_words.contains(&format!("{name} {sign} {shown}")), "{name} {verdict}");
            let page = plain(&folder.read(&format!("pages/scenes/{name}.html")));
            let message = words(&string(&scene["message"]));
            assert!(verdict == "pass" || page.contains(&message), "{name}: {message}");
            if let Some(first) = scene["first_wrong"].as_object() {
                for place in [&front_words, &page] {
                    let step = first["step"].to_string();
                    assert!(place.to_lowercase().contains(&format!("step {step}, t = ")), "{name}");
                }
                // Reading a number as JSON may round its last digit.
                let got: String = first["got"].to_string().chars().take(15).collect();
                assert!(text_words.contains(got.trim_start_matches('-')), "{name} {got}");
            }
            verdicts.push(verdict);
        }
    }
    for verdict in ["pass", "differs", "not-implemented", "crashed"] {
        assert!(verdicts.iter().any(|found| found == verdict), "{verdict} is not among them");
    }
    for finding in list(&json["findings"]) {
        let message = words(&string(&finding["message"]));
        let what = message.trim_start_matches("Not implemented: ");
        assert!(text_words.contains(what) && front_words.contains(what), "{message}");
    }
    for (key, title) in [("required", "Required"), ("extra_credit", "Extra credit")] {
        let [passed, scenes] = ["scenes_passed", "scenes"].map(|name| json[key][name].to_string());
        assert!(text_words.contains(&format!("{title} {passed}/{scenes} scenes")));
        assert!(front_words.contains(&format!("{title}: {passed} of {scenes} scenes")));
    }
    let next = json["progress"]["next"]["scene"].as_str().unwrap();
    assert!(text_words.contains(&format!("--only {next}")) && front_words.contains(next));
}

#[needs("command -v cc")]
#[test]
#[ignore = "long: ten seconds"]
fn long_default_texts_are_short_and_end_with_what_to_do() {
    for limits in ["", LIMITED] {
        let folder = mistaken(limits, TRANSPOSED);
        assert_short(&folder.grade(&["my-simulator", "--assignment", "t1m3"]).stdout);
    }
}

/// Checks the default text of a program that fails required scenes.
pub(crate) fn assert_short(text: &str) {
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines.len() < 60, "{} lines\n{text}", lines.len());
    assert!(lines.iter().all(|line| line.chars().count() <= 80), "{text}");
    let (_, next) = text.split_once("\nNext\n").unwrap();
    // Commands are continued as in a shell.
    let commands = words(&next.replace("\\\n", ""));
    assert!(commands.contains("grade explain "), "{commands}");
    assert!(
        commands.ends_with("grade my-simulator --assignment t1m3 --html report.html"),
        "{commands}"
    );
    for (proposed, _) in commands.match_indices("--only ") {
        let scene = commands[proposed + 7..].split(' ').next().unwrap();
        let required = test_support::root().join(format!("assets/{scene}.xml"));
        assert!(required.exists(), "{scene} is extra credit, and required scenes fail");
    }
}
