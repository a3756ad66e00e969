//! Tests of assignment files.

use std::path::Path;

use super::*;
use crate::suite::Section;

fn parse(text: &str) -> Result<Assignment, AssignmentError> {
    Assignment::parse("springs", text, Path::new("springs.toml"))
}

fn message(text: &str) -> String {
    parse(text).unwrap_err().to_string()
}

#[test]
fn unknown_names_are_errors_with_their_line() {
    assert_eq!(
        message("title = \"t\"\nforces = [\"spring\"]\nfeature = []").lines().next(),
        Some("springs.toml:2:11: unknown force \"spring\"")
    );
    assert_eq!(
        message("title = \"t\"\nfeature = []\nintegrators = [\"euler\"]").lines().next(),
        Some("springs.toml:3:16: unknown integrator \"euler\"")
    );
    assert_eq!(
        message("title = \"t\"\nformats = [\"yaml\"]\nfeature = []"),
        "springs.toml:2:12: unknown format \"yaml\"\n  help: the formats are xml, json"
    );
    assert_eq!(
        message("title = \"t\"\ndimensions = [4]\nfeature = []"),
        "springs.toml:2:15: a scene has 2 or 3 dimensions, not 4"
    );
    assert_eq!(
        message("title = \"t\"\n[[feature]]\npoints = -1.0"),
        "springs.toml:3:10: points are from 0 to 1e9, not -1"
    );
}

#[test]
fn scenes_follow_from_the_scope_and_later_entries_override_earlier_ones() {
    let folder = tempfile::TempDir::new().unwrap();
    let scene = |name: &str, integrator: &str, force: &str| {
        let text = format!(
            "<scene><duration time=\"1\"/><integrator type=\"{integrator}\" dt=\"0.1\"/>\
             <particle m=\"1\" px=\"0\" py=\"0\" vx=\"1\" vy=\"2\" fixed=\"0\"/>{force}</scene>"
        );
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    let drag = "<dragdamping b=\"1\"/>";
    scene("Drag/a.xml", "explicit-euler", drag);
    scene("Drag/b.xml", "symplectic-euler", drag);
    scene("Drag/c.xml", "symplectic", drag);
    scene("Drag/d.xml", "explicit-euler", "<simplegravity fx=\"0\" fy=\"1\"/>");
    scene("Inertia/e.xml", "explicit-euler", "");
    let mut suite = Suite::load(
        &[(Section::ExtraCredit, folder.path().to_path_buf())],
        &scene::ParseOptions::default(),
    )
    .unwrap();
    let text = "title = \"Drag\"\nforces = [\"dragdamping\"]\n\
                integrators = [\"explicit-euler\", \"symplectic-euler\"]\n\
                [[feature]]\n\
                [[feature]]\nsection = \"required\"\nforces = [\"dragdamping\"]\npoints = 3\n\
                [[feature]]\nsection = \"unscored\"\nintegrators = [\"symplectic\"]\nsolver = \"dense\"\n";
    let mut assignment = parse(text).unwrap();
    let misspelt = format!("{text}[[feature]]\ngroups = [\"Drag\", \"Inertai\", \"Wind\"]\n");
    let warnings = [
        "springs.toml:14:19: no scene is in the group \"Inertai\"\n  help: did you mean Inertia?",
        "springs.toml:14:30: no scene is in the group \"Wind\"",
    ];
    assert_eq!(parse(&misspelt).unwrap().unknown_groups(&suite), warnings);
    assert!(assignment.unknown_groups(&suite).is_empty());
    assignment.narrow(&mut suite).unwrap();
    let found: Vec<(&str, Section, Option<f64>)> = suite
        .cases
        .iter()
        .map(|case| (&*case.id, case.feature.section, assignment.points(&case.feature)))
        .collect();
    assert_eq!(
        found,
        [
            ("Drag/a", Section::Required, Some(3.0)),
            ("Inertia/e", Section::ExtraCredit, None),
            ("Drag/b", Section::Unscored, Some(0.0)),
        ]
    );
    assert_eq!(suite.cases[2].solver, SolverName::Dense);
    let idle = format!("{text}[[feature]]\ngroups = [\"Wind\"]\n");
    let error = parse(&idle).unwrap().narrow(&mut suite).unwrap_err().to_string();
    assert!(error.starts_with("springs.toml:13: [[feature]] selects no scene"), "{error}");
}
